/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * time_step.h - limits on the time step.
 */
#ifndef DEM_TIME_STEP_H
#define DEM_TIME_STEP_H

#include "dem_internal.h"

dem_limits time_limits(const dem_sim *sim);

#endif
