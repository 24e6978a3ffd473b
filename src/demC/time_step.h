/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * time_step.h - limits on the time step.
 */
#ifndef DEM_TIME_STEP_H
#define DEM_TIME_STEP_H

#include "dem_internal.h"

dem_limits time_limits(const dem_sim *sim);
void pair_limits(const dem_sim *sim, int a, int b, double *contact, double *rayleigh);
/* DEM_BAD_ARGUMENT if sim->fixed_step is above a limit. */
dem_status check_fixed_step(dem_sim *sim);
/* How many make up dt where 0 are asked for; else DEM_BAD_ARGUMENT for too few. */
dem_status choose_substeps(dem_sim *sim, double dt, int *substeps);
/* DEM_BAD_ARGUMENT if the linear spring is weaker than the attraction of the largest spheres. */
dem_status check_cohesion(dem_sim *sim);

#endif
