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
    int outside;    /* nonzero: p->outside acts */
    int last;       /* nonzero: keep the force, with the weight, in p->last */
    double most[3]; /* out: largest square of each component of the velocity, m2/s2 */
    int finite;     /* out: zero if some velocity is not finite */
} motion;

/* Moves the particles, adds to p->impulse and zeroes p->force for the next sum. */
void integrate(motion *m, particles *p);

#endif
