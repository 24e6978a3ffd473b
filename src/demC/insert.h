/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert.h - the particles that an insertion creates.
 */
#ifndef INSERT_H
#define INSERT_H

#include "dem.h"

#include <gsl/gsl_rng.h>

/* Particles that come into being. */
typedef struct arrivals {
    size_t n, capacity;
    double (*x)[3], (*v)[3], (*omega)[3];
    double *radius;
    int *material;
} arrivals;

/* Room for n particles in all; what is there stays. */
dem_status arrivals_reserve(arrivals *a, size_t n);
void arrivals_free(arrivals *a);

/* Where they come: the domain (periodic[a]: direction a wraps), what it holds, materials. */
typedef struct insert_place {
    const double *lo, *hi; /* [3], m */
    const int *periodic;   /* [3] */
    size_t n_old;
    const double (*x_old)[3];
    const double *r_old;
    size_t n_material;
    const dem_material *material;
} insert_place;

/**
 * The particles of one insertion. The n_old that are there already are left where they are and not
 * overlapped (RANDOM, LATTICE). *made is overwritten and belongs to the caller. Positions lie in
 * the domain, wrapped into it in periodic directions. The result depends on the arguments only. Not
 * collective.
 *
 * DEM_BAD_ARGUMENT when the particles cannot be placed, with the reason in `message` (of `size`
 * bytes), DEM_NO_MEMORY; *made is empty then.
 */
dem_status insert_particles(const dem_insertion *ins, const insert_place *place, arrivals *made,
                            char *message, size_t size);

/* A generator that all 64 bits of the seed decide; NULL when out of memory. */
gsl_rng *insert_generator(uint64_t seed);
/* mean + normal deviate of the deviation `spread` in every component. */
void insert_velocity(const gsl_rng *rng, const double mean[3], double spread, double v[3]);

/**
 * Volume of the region within the box [lo, hi], m3. Octree down to 1/256 of the box, planes of the
 * distance function in the leaves: relative error below 1e-4 for convex shapes that fill their
 * box, rounding for an aligned box. skip[a]: flat faces of the region normal to axis a do not bound
 * it.
 */
double insert_region_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                            const int skip[3]);

#endif
