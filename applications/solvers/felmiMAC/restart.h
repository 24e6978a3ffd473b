/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart.h - the fluid and the clock of a run in the restart file of its particles.
 */
#ifndef MAC_RESTART_H
#define MAC_RESTART_H

#include "coupling.h"

/* Where a run is in time, s. */
typedef struct mac_clock {
    double time;
    double dt;         /* wanted for the next step, before it is shortened to meet an output */
    double next_write; /* time of the next output */
    double interval;   /* between outputs */
} mac_clock;

/* Write <directory>/<name>.h5, and keep so many (dem_write_restart); 0, or -1 with the text in
 * `message`. */
int mac_restart_write(mac_coupled *c, const mac_clock *clock, const char *directory,
                      const char *name, int keep, char *message, size_t size);
/* The fluid and the clock as they were, once mac_coupled_new has taken the particles from `file`.
 * An output interval that has changed counts from the restart. Likewise. */
int mac_restart_read(mac_coupled *c, mac_clock *clock, const char *file, char *message,
                     size_t size);

#endif
