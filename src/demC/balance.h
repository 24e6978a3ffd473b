/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * balance.h - the balance of energy and of angular momentum, kept when param.balance is set.
 */
#ifndef DEM_BALANCE_H
#define DEM_BALANCE_H

#include "contact_extra.h"
#include "particles.h"

struct dem_sim;

typedef struct balance {
    int on;
    /* J, sums since dem_new; as in dem_energy. Of this rank: they mean something when they are
     * added up over all. */
    double gravity, outside, walls, damping, sliding, rolling, supply;
    double tangential, turned; /* J in tangential and rolling springs, at the last sum of forces */
    int changed;               /* particles came or went since, */
    double elastic;            /* and this was in all springs before, J */
    double gravity_angular[3], outside_angular[3], wall_angular[3]; /* in this dem_advance */

    /* for every particle and ghost, of one step */
    double (*damped)[6];  /* force and torque of the dashpots */
    double (*slid)[6];    /* of the contacts that slide */
    double (*rolled)[3];  /* torque of the rolling resistance, less that of its springs */
    double (*before)[12]; /* x, v, omega, gain when the step began */
    size_t capacity;
} balance;

void balance_free(balance *b);
/* Particles are about to come or go: call before the first of them does, while the neighbour list
 * is as it was. Twice does no harm. Collective: no rank may have failed on its own. */
void balance_changing(struct dem_sim *sim);
/* The particle in the given row of the store has come (sign 1) or is going (sign -1): its energy is
 * booked as supply; what its contacts bring or take is found at the next sum of forces. */
void balance_supply(struct dem_sim *sim, size_t row, int sign);
/* In a step: before the forces are summed, */
dem_status balance_open(struct dem_sim *sim);
/* when they are, with what the loops found in springs, */
void balance_summed(struct dem_sim *sim);
void balance_springs(balance *b, const spring_energy *pairs, const spring_energy *walls);
/* and when the particles have moved. */
void balance_moved(struct dem_sim *sim, double dt);
/* At the begin and end of a dem_advance; the report, of all ranks, is collective. */
void balance_clear(struct dem_sim *sim);
void balance_report(struct dem_sim *sim);

#endif
