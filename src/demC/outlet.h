/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * outlet.h - regions that take the particles whose centres get into them.
 */
#ifndef OUTLET_H
#define OUTLET_H

#include "dem.h"
#include "tally.h"

typedef struct outlet {
    dem_outlet given;    /* its region is the simulation's once dem_new has succeeded */
    double lo[3], hi[3]; /* box of the region, m */
    int64_t number;      /* taken since dem_new, on all ranks; every rank has the sum */
    tally mass;          /* kg, likewise */
} outlet;

typedef struct outlets {
    size_t n;
    outlet *outlet;
} outlets;

/* The outlets of `param`; their message in error. Collective, agreed upon. */
dem_status outlets_init(dem_sim *sim, const dem_param *param);
void outlets_free(outlets *o, int free_regions);
/* Take what is in them now. Collective, agreed upon. */
dem_status outlets_take(dem_sim *sim);

#endif
