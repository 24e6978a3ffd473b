/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * log.h - what a run of felmiMAC says: the start of its log, and solver.csv.
 */
#ifndef MAC_LOG_H
#define MAC_LOG_H

#include <stdio.h>
#include "coupling.h"
#include "settings.h"

/* Mesh, fluid, sides, scheme and equations. */
void mac_log_case(const mac_case *c);
/* Every limit on the time step, once the simulation is built. */
void mac_log_limits(const mac_case *c, const mac_coupled *coupled, double dt);
/* Where the time of the run went. */
void mac_log_shares(const mac_coupled *coupled, double seconds_elapsed);
/* The line of a step. */
void mac_log_step(const mac_case *c, const mac_coupled *coupled, double time, double dt,
                  double seconds_elapsed);

/* <case>/postProcessing/felmiMAC/solver.csv, with the rows up to the time `from` of a restart, none
 * if it is NAN; NULL with the text in message, which is a note otherwise. */
FILE *mac_series_open(const mac_case *c, double from, char *message, size_t size);
/* A row: time, step, Courant number, iterations, residual, mean pressure of each patch (Pa), bed
 * height (m). 0, or -1 when it could not be written. */
int mac_series_write(FILE *file, const mac_case *c, const mac_coupled *coupled, double time,
                     double dt);

#endif
