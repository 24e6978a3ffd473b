/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * migrate.h - particles go to the ranks that own their places, with their histories and columns.
 */
#ifndef DEM_MIGRATE_H
#define DEM_MIGRATE_H

#include "dem.h"

/**
 * Bring all particles to their owners and make the ghosts, all of `reach` beyond the radii of two
 * that meet. The particles are wrapped, their contacts saved (contact.h). Afterwards particles and
 * ghosts are in no order; saved contacts and entries of walls refer to them as they are. What a
 * rank saved of pairs that are its no more is dropped. Collective, agreed upon.
 */
dem_status migrate(dem_sim *sim, double reach);

#endif
