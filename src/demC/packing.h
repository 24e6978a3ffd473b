/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing.h - random positions of equal spheres without overlap.
 */
#ifndef PACKING_H
#define PACKING_H

#include "dem.h"

#include <gsl/gsl_rng.h>

/* Where the spheres may be: the part of a region that lies in a domain. */
typedef struct packing_room {
    const dem_sdf *region;
    double lo[3], hi[3];    /* domain, m */
    int periodic[3];        /* direction wraps */
    int filled[3];          /* periodic and filled by the region: no bound in this direction */
    double low[3], high[3]; /* the region's bounding box, the domain where filled, m */
} packing_room;

/* Smallest distance from x to what bounds the room. Flat faces normal to a filled direction and the
 * box in that direction are no bounds. */
double packing_clearance(const packing_room *room, const double x[3]);

/* Vector from a to b, to the nearest image. */
void packing_separation(const packing_room *room, const double a[3], const double b[3],
                        double d[3]);

/**
 * Place n spheres of `radius` at random in the room, clear of n_old fixed ones. *placed is n when
 * all found room. Otherwise x means nothing and *placed is how many are clear of one another at
 * the end of the search, with *overlap the largest overlap left (of the distance of touching), or
 * -1 when not even a single centre was found.
 */
dem_status packing_random(const packing_room *room, double radius, size_t n, size_t n_old,
                          const double (*x_old)[3], const double *r_old, gsl_rng *rng,
                          double (*x)[3], int64_t *placed, double *overlap);

/**
 * The first sphere of the n that overlaps with an earlier one or an old one by more than
 * `tolerance` of the sum of their radii; n if none does. DEM_NO_MEMORY or DEM_OK.
 */
dem_status packing_first_overlap(const packing_room *room, double radius, size_t n,
                                 const double (*x)[3], size_t n_old, const double (*x_old)[3],
                                 const double *r_old, double tolerance, size_t *first);

#endif
