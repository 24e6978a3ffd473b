/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * feed.h - particles that enter during the run at a given rate.
 */
#ifndef FEED_H
#define FEED_H

#include "packing.h"
#include "size.h"
#include "tally.h"

/* All that a feeder goes by: who has it can go on from there. Every rank has the same. */
typedef struct feeder {
    dem_feeder given; /* its region is the simulation's once dem_new has succeeded */
    packing_room room;
    mixture mixture;
    gsl_rng *rng;
    double interval; /* between the moments at which it feeds, s */
    double origin;   /* time from which they are counted, s */
    double before;   /* kg or particles that were due before the origin */
    double moment;   /* the number of the last one */
    double diameter; /* of the particle that is next, m */
    int material;
    int64_t number; /* fed since dem_new */
    tally mass;     /* kg */
    double waiting; /* kg due at the last moment that found no room */
} feeder;

typedef struct feeders {
    size_t n;
    feeder *feeder;
} feeders;

/* The feeders of `param`; their message in error. Collective, agreed upon. */
dem_status feeders_init(dem_sim *sim, const dem_param *param);
void feeders_free(feeders *f, int free_regions);
/* The clock is set to `time`: nothing is due for what is jumped over. */
void feeders_set_time(dem_sim *sim, double time);
/* At the start of a step of the length dt. Collective, agreed upon. */
dem_status feeders_feed(dem_sim *sim, double dt);
/* kg, or particles where the rate is one of number, due at the last moment. */
double feeder_due(const feeder *f);
/* Whether a feeder has particles yet to come. */
int feeder_goes_on(const dem_sim *sim, const feeder *f);

#endif
