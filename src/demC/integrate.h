/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * integrate.h - one step of translation and rotation under contact, gravity and outside force.
 */
#ifndef DEM_INTEGRATE_H
#define DEM_INTEGRATE_H

#include "particles.h"

typedef struct motion {
    double dt;
    double gravity[3];
    int outside; /* nonzero: p->outside acts */
    int last;    /* nonzero: keep the force, with the weight, in p->last */
    /* Zero at the beginning of a step: */
    double most[3]; /* largest square of each component of the velocity, m2/s2 */
    int lost;       /* nonzero: some velocity is not finite */
} motion;

/* Moves the particles begin...end-1, adds to p->impulse and zeroes p->force for the next sum. */
void integrate(motion *m, particles *p, size_t begin, size_t end);

#endif
