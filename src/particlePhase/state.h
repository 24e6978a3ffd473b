/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * state.h - inside of the particle phase, private to particlePhase.
 *
 * What must follow a particle through sorting and restart lives in columns of the engine: force of
 * the last solve L, carried imbalance C, drag coefficient and void fraction of the last solve, and
 * for liquids the mean acceleration around it. What lives for one step is scratch.
 */
#ifndef PHASE_STATE_H
#define PHASE_STATE_H

#include "phase.h"

typedef double vector[3];

/* Sums over the particles, on this rank and then over all; plain doubles so that they reduce. */
typedef struct phase_sums {
    double momentum[3], carried[3], delivered[3], force[3];
    double gone[3];        /* sum C of those that left */
    double speed_scale;    /* sum m |v|, |.| the sum of magnitudes of components */
    double carried_scale;  /* sum |C| */
    double impulse_scale;  /* sum |J| */
    double exchange_scale; /* sum kappa (|u| + |v|) + V |grad p|, N */
    double mass, moment;   /* sum m, sum m x.up */
} phase_sums;

/* Parts of a step whose time is taken. */
enum { PHASE_PARTS = 4 };

enum { PHASE_SUMS = sizeof(phase_sums) / sizeof(double) };

struct phase {
    MPI_Comm comm;
    dem_sim *dem;
    cpl_map *map;
    cpl_ledger *ledger;
    cpl_param coupling;
    cpl_mesh mesh;
    double rho, mu, dt;
    double gravity[3];
    double up[3], floor; /* against gravity (zero without), and the mesh's lowest point that way */
    int inertia;         /* the fluid's inertia can matter: some particle is light enough */

    /* Columns of the engine. */
    int carried, force, kappa, eps_p, acceleration, before;

    /* Scratch of a step, [capacity]. */
    size_t capacity;
    double *block;
    double *V, *k, *M, *tensor /* [9] */;
    vector *f, *u, *grad_p, *s;

    /* Cells. */
    double *eps, *eps_before, *K, *mass_cell;
    vector *S, *Us, *vector_cell;

    phase_sums at_start; /* of the step */
    uint64_t revision;   /* of the particles that at_start holds for */
    phase_report report;
    double seconds[PHASE_PARTS]; /* wall-clock of all steps: DEM, map, exchange, drag */
    char message[512];
};

/* Sums over the particles of all ranks now. */
phase_sums phase_sum(const phase *ph);
/* Ledger entry of the step that ends, and the report. */
int phase_book(phase *ph, const double fluid_drag[3], const double fluid_pressure[3]);
/* What the first rank that failed has failed with, its message too, on all ranks; 0 if none has.
 * *flag (or NULL) becomes the largest of the ranks'. */
int phase_agree(phase *ph, int failed, int *flag);
/* Set the message and return `code`. */
int phase_fail(phase *ph, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
