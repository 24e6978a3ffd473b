/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * check.h - checks of parameters and of the state of particles, with messages for people.
 */
#ifndef DEM_CHECK_H
#define DEM_CHECK_H

#include "dem_internal.h"

dem_status check_param(dem_sim *sim, const dem_param *param);
/* A particle to be added; `k` is its place in the caller's arrays. */
dem_status check_particle(dem_sim *sim, size_t k, const double x[3], const double v[3],
                          const double omega[3], double radius, int material);
/* Some particle's state is not finite. */
dem_status check_finite(dem_sim *sim);
/* No particle has left the domain through a side that is not periodic. */
dem_status check_inside(dem_sim *sim);
/* Particles that have gone through a periodic side find the walls on the other as they left them.
 */
dem_status check_crossing(dem_sim *sim);
/* Of a label of one to be added: those for its place in what the caller gave. */
enum { LABEL_BITS = 40 };
/* No two particles, present or among the n to be added, overlap by more than 1.5 times the
 * smaller radius. *largest is the largest overlap of them and of walls, in smaller radii. Those to
 * be added are with their owners; label[i], unless NULL, is -1 less their place in what the caller
 * gave and, above LABEL_BITS, the rank of that one; no radius is above `largest_radius`.
 * Collective. */
dem_status check_overlaps(dem_sim *sim, size_t n, const double (*x)[3], const double *radius,
                          const int64_t *label, double largest_radius, double *largest);
/* Periodic sides are at least two ranges apart. */
dem_status check_range(dem_sim *sim, double largest_radius);

#endif
