/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * poisson.h - the pressure equation: sum_f c_f (x_P - x_N) = b on a box of cells, by conjugate
 * gradients with one multigrid cycle as preconditioner.
 *
 * Layout as in multigrid.h: one ghost layer, interior 1..n.
 */
#ifndef POISSON_H
#define POISSON_H

#include "multigrid.h"

typedef struct mac_poisson {
    mac_multigrid mg;
    double tolerance; /* of |b - A x| / |b - A 0| */
    int max_iterations;
    int singular;      /* no side of given value: x is free by a constant; set by assemble */
    double *x, *s, *q; /* solution, search direction and A s; the right-hand side is `b` */
    double *b;
    int iterations;  /* of the last solve */
    double residual; /* |b - A x| / |b| of the last solve */
} mac_poisson;

typedef enum mac_poisson_status {
    MAC_SOLVED,
    MAC_NOT_CONVERGED,
    MAC_NOT_FINITE
} mac_poisson_status;

/* 0, or -1 when out of memory. */
int mac_poisson_init(mac_poisson *ps, const int n[3], const double h[3], const int periodic[3],
                     mac_cycle cycle, double tolerance, int max_iterations);
void mac_poisson_free(mac_poisson *ps);
/* The coefficients to fill: c[d] at cells 1..n+1 along d. Then call assemble. */
double **mac_poisson_coefficients(mac_poisson *ps);
void mac_poisson_assemble(mac_poisson *ps);
/* Solve from the guess in ps->x for ps->b (kept). `floor`: |b| (root mean square) below it counts
 * as zero. A singular system is solved for b less its mean, and x keeps zero mean. */
mac_poisson_status mac_poisson_solve(mac_poisson *ps, double floor);
/* y = A x; the ghosts of x are filled. */
void mac_poisson_multiply(mac_poisson *ps, double *x, double *y);

#endif
