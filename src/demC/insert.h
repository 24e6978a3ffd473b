/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert.h - positions and velocities of the particles that an insertion creates.
 */
#ifndef INSERT_H
#define INSERT_H

#include "dem.h"

/**
 * Positions for one insertion into the domain [lo, hi] (periodic[a]: direction a wraps) that holds
 * n_old particles already, which are left where they are and not overlapped (RANDOM, LATTICE).
 * *x and *v, [*n][3], are malloced and belong to the caller; both NULL when *n is 0. Positions lie
 * in the domain, wrapped into it in periodic directions. The result depends on the arguments
 * only. Not collective.
 *
 * DEM_BAD_ARGUMENT when the particles cannot be placed, with the reason in `message` (of `size`
 * bytes), DEM_NO_MEMORY; *x, *v are NULL and *n is 0 then.
 */
dem_status insert_positions(const dem_insertion *ins, const double lo[3], const double hi[3],
                            const int periodic[3], size_t n_old, const double (*x_old)[3],
                            const double *r_old, double (**x)[3], double (**v)[3], size_t *n,
                            char *message, size_t size);

/**
 * Volume of the region within the box [lo, hi], m3. Octree down to 1/256 of the box, planes of the
 * distance function in the leaves: relative error below 1e-4 for convex shapes that fill their
 * box, rounding for an aligned box. skip[a]: flat faces of the region normal to axis a do not bound
 * it.
 */
double insert_region_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                            const int skip[3]);

#endif
