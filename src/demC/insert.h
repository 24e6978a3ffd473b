/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert.h - the particles that an insertion creates.
 */
#ifndef INSERT_H
#define INSERT_H

#include "packing.h"

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
    const int64_t *id_old; /* or NULL: they are in the order of their ids */
    size_t n_material;
    const dem_material *material;
    dem_sim *sim; /* whose ranks share the work, or NULL: this one alone */
} insert_place;

/**
 * The particles of one insertion. The n_old that are there already are left where they are and not
 * overlapped (RANDOM, LATTICE). *made is overwritten and belongs to the caller. Positions lie in
 * the domain, wrapped into it in periodic directions. The result depends on the arguments only.
 *
 * Collective over the ranks of place->sim, agreed upon; `message` is sim->message then. The old
 * ones are those of this rank, and *made is its share of the new ones: all of them together, in the
 * order of the ranks, are what one rank would make.
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

/* ---- insert_lattice.c ------------------------------------------------------------------------ */

/* Images of a point across periodic sides among which neighbours are looked for; those of a lattice
 * that has more near a point touch each other. */
enum { LATTICE_SPANS = 16 };

typedef struct lattice {
    const dem_sdf *region;
    double lo[3], spacing[3]; /* m */
    double slack;             /* by which a point may be outside, m */
    size_t count[3], n;       /* points along the axes, and in all; in the region or not */
} lattice;

/* The lattice that fills the box of `ins`; -1: it has more than 1e9 points. */
int lattice_lay(lattice *l, const dem_insertion *ins);
/* Point p < n; whether it is in the region. */
int lattice_point(const lattice *l, size_t p, double x[3]);
/* Whether a sphere at p overlaps with one at an earlier point in the region. */
int lattice_crowded(const lattice *l, const packing_room *room, size_t p, double diameter);

/* ---- insert_old.c ---------------------------------------------------------------------------- */

/* Spheres that are there already. */
typedef struct old_spheres {
    size_t n;
    double (*x)[3];
    double *r;
} old_spheres;

/* Those of all ranks that a sphere of `diameter` whose centre is in the box from low to high can
 * meet, in the order of their ids. Collective over the ranks of place->sim, to which `status` is
 * that of the caller so far; agreed upon. */
dem_status old_gather(const insert_place *place, dem_status status, const double low[3],
                      const double high[3], double diameter, old_spheres *old);
void old_free(old_spheres *old);

/* ---- volume.c -------------------------------------------------------------------------------- */

/**
 * Volume of the region within the box [lo, hi], m3. Octree down to 1/256 of the box, planes of the
 * distance function in the leaves: relative error below 1e-4 for convex shapes that fill their
 * box, rounding for an aligned box. skip[a]: flat faces of the region normal to axis a do not bound
 * it.
 */
double insert_region_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                            const int skip[3]);

#endif
