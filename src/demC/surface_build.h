/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * surface_build.h - what a surface is made of while it is being made.
 */
#ifndef SURFACE_BUILD_H
#define SURFACE_BUILD_H

#include "surface.h"

typedef struct edge {
    uint32_t a, b; /* vertices, a < b */
    uint32_t triangle;
    int k, forward; /* from corner k to k + 1; forward: from a to b */
} edge;

typedef struct builder {
    const char *name;
    char *message;
    size_t size;
    int mend;
    double angle;                       /* of features, rad */
    size_t n, n_vertex, n_edge, n_open; /* n_open: edges that have not two triangles */
    double (*x)[3];                     /* welded */
    uint32_t (*vertex)[3];              /* [n], welded */
    double (*normal)[3];                /* [n] */
    int32_t (*mate)[3];                 /* [n]: triangle across an edge, or RIM */
    signed char (*bend)[3];             /* [n]: how the surface bends there */
    uint32_t *label;                    /* [n]: union-find, then part */
    uint32_t *place;                    /* [n]: of a triangle when sorted by part */
    uint32_t *base;                     /* [n_vertex of the surface]: welded vertex */
    edge *edges;
} builder;

static inline double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void minus(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

static inline void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* Parts, order, normals and tree of the surface, from triangles that are welded, paired and turned
 * as they shall be; 0, or -1: out of memory. */
int surface_assemble(builder *b, surface *s);

#endif
