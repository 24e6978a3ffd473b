/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * domain.h - which rank has which part of space.
 *
 * On one rank there is nothing to divide: every position is its own.
 */
#ifndef DEM_DOMAIN_H
#define DEM_DOMAIN_H

#include "dem.h"

struct Zoltan_Struct;

typedef struct domain {
    struct Zoltan_Struct *zoltan; /* NULL on one rank */
    int divided;                  /* there are parts */
    double lo[3], hi[3]; /* of this rank's part; infinite where it has no other beside it */
    int *near;           /* [ranks] what domain_near() found */
    int *found;          /* [ranks] its work space */
    uint64_t *seen, search;
    double busy; /* s that this rank worked since imbalance was last looked at */
    double cost; /* s that the last division took, with all that moved for it */
} domain;

dem_status domain_init(dem_sim *sim);
void domain_free(domain *d);

/* Divide space so that every rank has the same share of the points of all ranks; n of them here, by
 * `weight` > 0, or one like another where it is NULL. Collective, agreed upon. */
dem_status domain_divide(dem_sim *sim, size_t n, const double (*pos)[4], const float *weight);
/* The rank whose part x is in, the same on all ranks. x must lie in the domain where it is
 * periodic. */
int domain_owner(const dem_sim *sim, const double x[3]);
/* The other ranks whose parts come within `reach` of x or of an image of it, into domain.near: how
 * many. */
int domain_near(dem_sim *sim, const double x[3], double reach);
/* Look at how evenly the ranks are at work and, when the busiest has too much, divide anew by the
 * work measured. Collective, agreed upon. Particles are wrapped, the list of old still there. */
dem_status domain_balance(dem_sim *sim);

#endif
