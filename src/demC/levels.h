/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * levels.h - near pairs among spheres of any sizes, at a cost linear in their number.
 *
 * Spheres are sorted into levels by size, each a factor of two wide, and every level has a grid of
 * linked cells of its own, as wide as its largest diameter. A sphere looks for partners on its own
 * level and on those of larger ones: there the cells are wider than itself, so that a fixed number
 * of cells, each with room for a few spheres, holds all that can be near. With one grid for all,
 * either its cells hold crowds of small spheres or the large ones cover crowds of cells. Ogarko &
 * Luding, Comput. Phys. Commun. 183 (2012) 931, doi:10.1016/j.cpc.2011.12.019.
 */
#ifndef DEM_LEVELS_H
#define DEM_LEVELS_H

#include "dem.h"

/* A factor of two each: 2^32 from the smallest sphere to the largest; larger ones share the last.
 */
enum { LEVELS = 32 };

typedef struct level {
    uint32_t n;    /* spheres on it */
    double radius; /* the largest of them, m */
    int cells[3];
    double origin[3], per_width[3]; /* of its grid */
    uint32_t *first;                /* [cells + 1] places in `sphere` */
} level;

typedef struct levels {
    double lo[3], length[3]; /* of the domain */
    int periodic[3];
    double skin; /* m */
    size_t n;
    const double (*pos)[4]; /* x y z r, of the caller */
    double smallest;        /* radius, m */
    level level[LEVELS];
    uint32_t *sphere; /* [n] by level and cell, in a cell by index */
    size_t checks;    /* distances computed so far */
} levels;

/* Called for j with |x_i - x_j| < r_i + r_j + skin and for no pair twice; d is x_i - x_j to the
 * nearest image, d2 its square. Anything but zero ends the search and is returned by it. */
typedef int levels_visit(void *context, uint32_t i, uint32_t j, const double d[3], double d2);

/* Sort n spheres, which must lie in the domain where it is periodic; they are not copied. */
dem_status levels_init(levels *g, const double lo[3], const double hi[3], const int periodic[3],
                       size_t n, const double (*pos)[4], double skin);
void levels_free(levels *g);
/* The partners of i that are on its own level behind it, or on a level of larger spheres. */
int levels_partners(levels *g, uint32_t i, levels_visit *visit, void *context);

#endif
