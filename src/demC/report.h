/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * report.h - sums over the particles for dem_last_report.
 */
#ifndef DEM_REPORT_H
#define DEM_REPORT_H

#include "dem_internal.h"

/* Energies, mass, momentum and outside impulse of the particles of all ranks as they are. */
void report_sums(dem_sim *sim);
/* What ranks counted and summed for themselves in an advance: over all ranks. Not the overlap. */
void report_gather(dem_sim *sim);

#endif
