/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * grid.h - linked cells that spheres of any sizes enter one by one; for creating particles.
 *
 * As in levels.h every size, a factor of two wide, has cells of its own, as wide as its largest
 * diameter; but here spheres may come at any time, and the sizes on both sides of the one that
 * looks are searched, so that a fixed number of cells holds all that can be near it among spheres
 * of its size and larger. Data: the first sphere of every cell, the next one of every sphere.
 */
#ifndef GRID_H
#define GRID_H

#include "dem.h"

enum { GRID_LEVELS = 32 };

typedef struct grid_level {
    double radius; /* that no sphere of it exceeds, m */
    size_t n;      /* spheres that have entered */
    int cells[3];
    double per_m[3]; /* cells per metre */
    int *head;       /* first sphere of a cell, -1: none; NULL: no sphere has that size */
} grid_level;

typedef struct grid {
    double lo[3], length[3]; /* m; what lies beyond is kept in the outermost cells */
    int periodic[3];         /* unless the direction wraps */
    double smallest;         /* radius, m */
    double reserve;          /* pairs farther apart than touching by this much are found, m */
    grid_level level[GRID_LEVELS];
    const double (*x)[3]; /* of the caller */
    const double *r;
    int *next; /* [capacity] next sphere in the same cell, -1: none */
    size_t capacity;
} grid;

/* Called for the spheres of the cells near x; anything but zero ends the search and is returned. */
typedef int grid_visitor(void *context, int j);

/* An empty grid from lo to hi for some n spheres of radii from `smallest` to `largest`. */
dem_status grid_init(grid *g, const double lo[3], const double hi[3], const int periodic[3],
                     double smallest, double largest, size_t n, double reserve);
/* The spheres that may enter are n, at x with radii r: arrays of the caller. */
dem_status grid_reserve(grid *g, size_t n, const double (*x)[3], const double *r);
void grid_free(grid *g);
/* All spheres leave. */
void grid_clear(grid *g);
void grid_enter(grid *g, size_t i);
int grid_search(const grid *g, const double x[3], double radius, grid_visitor *visit,
                void *context);

#endif
