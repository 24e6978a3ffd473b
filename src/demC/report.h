/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * report.h - sums over the particles for dem_last_report.
 */
#ifndef DEM_REPORT_H
#define DEM_REPORT_H

#include "dem_internal.h"

/* Energies, mass, momentum and outside impulse at the end of an advance. */
void report_sums(dem_sim *sim);

#endif
