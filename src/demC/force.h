/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force.h - the loop over pairs: list -> touching pairs -> law -> forces and torques.
 */
#ifndef DEM_FORCE_H
#define DEM_FORCE_H

#include "balance.h"
#include "contact.h"
#include "contact_extra.h"

typedef struct pair_forces {
    dem_law law;
    const coefficient *table; /* [n_material * n_material] */
    int n_material;
    int uniform;         /* all particles have one material, one radius and one mass */
    double mass, radius; /* of each, if uniform, */
    coefficient only;    /* and of any two of them */
    double dt;
    const extras *extras;  /* models beyond the plain law, or NULL */
    balance *balance;      /* where its parts go, if it is kept */
    int survey;            /* nonzero: fill in `overlap` */
    size_t contacts;       /* out: touching pairs whose first particle is no ghost */
    double overlap;        /* out: largest overlap / smaller radius */
    spring_energy springs; /* out, if the balance is kept */
} pair_forces;

/* Adds to p->force. */
dem_status sum_pair_forces(pair_forces *job, particles *p, const neighbour *list, contacts *c);

#endif
