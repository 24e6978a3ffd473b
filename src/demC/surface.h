/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * surface.h - a surface of triangles, parted at its concave creases, with search for the nearest.
 */
#ifndef SURFACE_H
#define SURFACE_H

#include "stl.h"

#include <stdint.h>

/* What lies beyond an edge: a triangle of the same part, nothing (or several triangles), or, across
 * a crease, triangle t of another part as ACROSS - t. */
enum { RIM = -1, ACROSS = -2 };

/* Node of the tree of boxes: a leaf has `count` triangles from `first` on, an inner node has count
 * 0 and its children at `first` and first + 1. */
typedef struct surface_node {
    double lo[3], hi[3];
    uint32_t first, count;
} surface_node;

/* What a node looks like from far. */
typedef struct surface_dipole {
    double area[3];   /* sum of the area vectors below */
    double centre[3]; /* of the areas */
    double radius;    /* about it, of all below */
} surface_dipole;

typedef struct surface {
    int inside, mended;
    double feature_angle; /* rad */
    double measure;       /* area, m2 */
    double lo[3], hi[3];

    size_t n_vertex;          /* each belongs to one part: shared places are there several times */
    double (*x)[3];           /* [n_vertex], m */
    double (*tip)[3];         /* [n_vertex], angle-weighted normal of the whole surface there */
    double (*own)[3];         /* [n_vertex], the same of its part; neither of unit length */
    unsigned char *on_crease; /* [n_vertex], ON_CREASE, ON_RIDGE: edges from it part the surface */

    size_t n; /* triangles, sorted by part, then by leaf of the tree */
    uint32_t (*vertex)[3];
    int32_t (*beyond)[3]; /* across the edge from corner k to k + 1: see above */
    double (*normal)[3];  /* unit, to the free side */

    int parts;
    size_t *first;          /* [parts + 1], triangles of a part */
    size_t *touching_first; /* [parts + 1] */
    int *touching;          /* parts that share a crease with a part */
    surface_node *node;
    size_t n_node;
    surface_dipole *dipole;
    uint32_t *root; /* [parts] */
} surface;

/**
 * Make a surface of triangles whose corners turn anticlockwise seen from outside. Welds corners,
 * and checks it. NULL in error, with the reason in `message`; a note there with a surface that
 * was inside out and has been turned about. `name` stands at the head of messages.
 */
surface *surface_new(const soup *s, const char *name, int inside, int mend, double feature_angle,
                     char *message, size_t size);
/* The same with solid and free space exchanged, or NULL: out of memory. */
surface *surface_turned(const surface *s);
void surface_free(surface *s);
size_t surface_memory(const surface *s);

/* Edges that part the surface: it bends towards the free side, or away from it. */
enum { ON_CREASE = 1, ON_RIDGE = 2 };

/* Whether the edge k of t, which parts the surface, is a ridge. */
static inline int surface_is_ridge(const surface *s, size_t t, int k)
{
    const int32_t u = ACROSS - s->beyond[t][k];
    const double *a = s->x[s->vertex[t][k]], *n = s->normal[t];
    double height = 0.;
    for (int v = 0; v < 3; v++)
        for (int i = 0; i < 3; i++) height += (s->x[s->vertex[u][v]][i] - a[i]) * n[i];
    return height < 0.;
}

/* The nearest point of a part. */
typedef struct surface_hit {
    double d2; /* square of the distance, m2 */
    double y[3];
    uint32_t triangle;
    int feature; /* 0...2 corner, 3...5 edge from corner feature - 3, 6 within */
} surface_hit;

/* Find the nearest point of part `part` (-1: of all) that is closer than hit->d2 (m2, set it
 * before; INFINITY: any); whether there is one. */
int surface_nearest(const surface *s, int part, const double x[3], surface_hit *hit);

/* Signed distance of part `part` at x with gradient. *hidden: another part answers at that place.
 */
double surface_eval(const surface *s, int part, const double x[3], double g[3], int *hidden);
/**
 * The same for samples: beyond a crease the part goes on as a plane, so that an interpolant is
 * right up to the crease. `hint`, a triangle of the part, in and out: where the last one was found.
 */
double surface_sample(const surface *s, int part, const double x[3], int *hidden, uint32_t *hint);
/* Signed distance of the whole surface, its gradient and the part that is nearest. */
double surface_distance(const surface *s, const double x[3], double g[3], int *part);
/* Generalised winding number at x, in turns: 1 within a closed surface of outward normals. */
double surface_winding(const surface *s, const double x[3]);
/* Build the tree, at the end of surface_new; 0, or -1: out of memory. */
int surface_index(surface *s);

#endif
