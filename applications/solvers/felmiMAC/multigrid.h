/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * multigrid.h - one multigrid cycle for a symmetric 7-point operator, the preconditioner of the
 * pressure equation.
 *
 * Layout. A level is a box of n[0] x n[1] x n[2] cells with one ghost layer, cell (i, j, k) at
 * i + j stride[1] + k stride[2], interior 1..n. c[d] at a cell couples it to its lower neighbour in
 * direction d; a closed side has c = 0, a side of given value its coefficient, with zero in the
 * ghost cell. The operator is (A x)_P = sum_f c_f (x_P - x_N).
 */
#ifndef MULTIGRID_H
#define MULTIGRID_H

#include <stddef.h>

typedef enum mac_cycle { MAC_V_CYCLE = 1, MAC_W_CYCLE = 2 } mac_cycle;

typedef struct mac_level {
    int n[3];
    int periodic[3];
    int merge;    /* direction whose cells are paired on the next level, -1 on the last one */
    int smoothed; /* 0: only a step on the way, when several directions are paired at once */
    size_t stride[3], size;
    double *c[3];
    double *inv; /* 1 / sum of c, 0 for a cell without neighbours */
    double *w;   /* weight of the coarse neighbour on a cell's own side, when interpolating */
    double *x, *b, *r;
} mac_level;

#define MAC_LEVELS 96 /* three for each halving of the largest int */

typedef struct mac_multigrid {
    int levels;
    mac_cycle cycle;
    mac_level level[MAC_LEVELS];
} mac_multigrid;

/* Levels for a box of n cells of size h down to one cell. 0, or -1 when out of memory. */
int mac_multigrid_init(mac_multigrid *mg, const int n[3], const double h[3], const int periodic[3],
                       mac_cycle cycle);
void mac_multigrid_free(mac_multigrid *mg);
/* Operators of all levels from level[0].c. */
void mac_multigrid_assemble(mac_multigrid *mg);
/* level[0].x = M level[0].b: symmetric and positive where A is. */
void mac_multigrid_apply(mac_multigrid *mg);
/* Copy the periodic ghost cells of a field on the level. */
void mac_level_wrap(const mac_level *l, double *x);

#endif
