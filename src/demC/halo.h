/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * halo.h - ghosts: copies of the particles of other ranks that are near this rank's part.
 */
#ifndef DEM_HALO_H
#define DEM_HALO_H

#include "dem.h"

#include <mpi.h>

typedef struct halo {
    size_t *first;              /* [ranks + 1] in `send`, by the rank it goes to */
    uint32_t *send;             /* own particles that other ranks have ghosts of */
    size_t *from;               /* [ranks + 1] in `ghost`, by the rank they are from */
    uint32_t *ghost;            /* rows of the ghosts, in the order in which they come */
    double (*out)[9], (*in)[9]; /* x, v, omega on their way */
    MPI_Request *request;       /* [2 ranks] */
} halo;

void halo_free(halo *h);
/* Make the ghosts anew, in the order in which they come: all of `reach` beyond the radii of two
 * that meet. The particles are wrapped and with their owners. Collective, agreed upon. */
dem_status halo_make(dem_sim *sim, double reach);
/* To the n spheres x y z r of this rank, those of other ranks that can touch one here: each goes to
 * the ranks whose parts are within `reach` beyond its radius. *pos and *label, malloc'ed, grow; the
 * own ones stay in front. `status`: the caller's so far. Collective, agreed upon. */
dem_status halo_spheres(dem_sim *sim, dem_status status, double reach, size_t *n, double (**pos)[4],
                        int64_t **label);
/* Particles have been sorted: place[old] is the new row. */
void halo_follow(dem_sim *sim, const uint32_t *place);
/* Bring the ghosts to where their owners have them now. */
void halo_refresh(dem_sim *sim);

#endif
