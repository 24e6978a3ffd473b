/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * report.h - sums over the particles for dem_last_report.
 */
#ifndef DEM_REPORT_H
#define DEM_REPORT_H

#include "dem_internal.h"

/* Energies, momentum, outside and gravity impulse at the end of an advance by dt. */
void report_sums(dem_sim *sim, double dt);

#endif
