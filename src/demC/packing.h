/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing.h - random positions of spheres without overlap.
 */
#ifndef PACKING_H
#define PACKING_H

#include "grid.h"

#include <gsl/gsl_rng.h>

/* Where the spheres may be: the part of a region that lies in a domain. */
typedef struct packing_room {
    const dem_sdf *region;
    double lo[3], hi[3];    /* domain, m */
    int periodic[3];        /* direction wraps */
    int filled[3];          /* periodic and filled by the region: no bound in this direction */
    double low[3], high[3]; /* the region's bounding box, the domain where filled, m */
} packing_room;

/**
 * The room of a region in the box [low, high]: cut to the domain, sides open where it wraps.
 * `diameter` is that of the largest sphere. DEM_BAD_ARGUMENT with the reason, as in size.h.
 */
dem_status packing_find_room(packing_room *room, const dem_sdf *region, const double low[3],
                             const double high[3], const double lo[3], const double hi[3],
                             const int periodic[3], double diameter, char *reason, size_t size);

/* Smallest distance from x to what bounds the room. Flat faces normal to a filled direction and the
 * box in that direction are no bounds. */
double packing_clearance(const packing_room *room, const double x[3]);

/* Vector from a to b, to the nearest image. */
void packing_separation(const packing_room *room, const double a[3], const double b[3],
                        double d[3]);

/* A centre drawn uniformly where a sphere of `radius` is within the room; 0 when none was found in
 * `draws` points of the box. */
int packing_draw(const packing_room *room, double radius, int draws, const gsl_rng *rng,
                 double x[3]);

/* Move a centre to where its sphere is within the room, one bound after the other. */
void packing_inside(const packing_room *room, double radius, double x[3]);

/**
 * Place n spheres of radii r at random in the room, clear of n_old fixed ones; large ones first
 * makes it easy. *placed is n when all found room. Otherwise x means nothing and *placed is how
 * many are clear of one another at the end of the search, with *overlap the largest overlap left
 * (of the distance of touching), or -1 when not even a single centre was found. All ranks of `sim`
 * (NULL: this one alone) give and get the same; collective, agreed upon.
 */
dem_status packing_random(const packing_room *room, size_t n, const double *r, size_t n_old,
                          const double (*x_old)[3], const double *r_old, const gsl_rng *rng,
                          dem_sim *sim, double (*x)[3], int64_t *placed, double *overlap);

/**
 * Push the first n of `all` spheres in the room until they are clear of each other and of the rest,
 * which stay; *clear says whether that was reached, *overlap is the largest left. As above, the
 * ranks share the work. packing_push.c
 */
dem_status packing_push(const packing_room *room, size_t n, size_t all, double (*x)[3],
                        const double *r, dem_sim *sim, int *clear, double *overlap);

/* Whether a sphere at x comes nearer to one in the grid than by `tolerance` of touching: overlap
 * allowed above, distance wanted below zero. */
int packing_overlaps(const packing_room *room, const grid *g, const double x[3], double radius,
                     double tolerance);
extern const double packing_apart; /* the tolerance by which spheres that are created are apart */

/* A grid over the domain with n fixed spheres in it, for the search by spheres of `diameter`. */
dem_status packing_fixed(const packing_room *room, size_t n, const double (*x)[3], const double *r,
                         double diameter, grid *g);

#endif
