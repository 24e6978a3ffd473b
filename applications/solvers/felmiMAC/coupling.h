/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * coupling.h - the staggered fluid and the particle phase in one time step.
 */
#ifndef MAC_COUPLING_H
#define MAC_COUPLING_H

#include "mac.h"
#include "phase.h"

typedef struct mac_coupled {
    mac *fluid;
    phase *particles; /* NULL: fluid alone */
    cpl_mesh mesh;
    size_t cells;
    double (*U)[3], (*gradient)[3], (*tensor)[9]; /* [cells], scratch */
    double drag[3], pressure[3];                  /* on the particles in the last step, N */
    double seconds_fluid;     /* wall-clock of the last step without the particles' part */
    double seconds_fluid_all; /* of all steps */
} mac_coupled;

/* Takes what `dem` and `coupling` describe; `dem` NULL: no particles. 0, or -1 with the text in
 * `message`; free in both cases. */
int mac_coupled_new(mac_coupled *c, const mac_param *flow, const dem_param *dem,
                    const cpl_param *coupling, const char *ledger, char *message, size_t size);
void mac_coupled_free(mac_coupled *c);
/* Advance both by dt; the same. */
int mac_coupled_step(mac_coupled *c, double dt, char *message, size_t size);

#endif
