/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force.h - the loop over pairs: list -> touching pairs -> law -> forces and torques.
 */
#ifndef DEM_FORCE_H
#define DEM_FORCE_H

#include "balance.h"
#include "contact.h"
#include "contact_extra.h"

/* Which vector instructions this machine has: 0 none that we use, 1 AVX2, 2 AVX-512. Their results
 * differ in rounding: ranks that share pairs take what all of them have. */
int force_vectors(void);

typedef struct pair_forces {
    dem_law law;
    int vectors;              /* at most force_vectors() */
    const coefficient *table; /* [n_material * n_material] */
    int n_material;
    int one_material;    /* all particles have the same, and then */
    coefficient only;    /* any two of them have this */
    int uniform;         /* moreover one radius and one mass, */
    double mass, radius; /* which are these */
    double dt;
    const extras *extras;  /* models beyond the plain law, or NULL */
    balance *balance;      /* where its parts go, if it is kept */
    int survey;            /* nonzero: fill in `overlap` */
    size_t contacts;       /* out: touching pairs whose first particle is no ghost */
    double overlap;        /* out: largest overlap / smaller radius */
    spring_energy springs; /* out, if the balance is kept */
} pair_forces;

/* The loop under way. */
typedef struct force_loop {
    pair_forces *job;
    particles *p;
    const neighbour *list;
    contact_stream springs;
} force_loop;

force_loop forces_open(pair_forces *job, particles *p, const neighbour *list, contacts *c);
/* Adds the forces of the pairs in the rows begin...end-1 of the list to p->force; the rows one
 * after the other. No pair of a later row has the particle of an earlier one: it may move. */
void forces_of_rows(force_loop *loop, size_t begin, size_t end);
/* When all rows are done. */
dem_status forces_close(force_loop *loop);

#endif
