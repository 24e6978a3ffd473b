/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * banner.h - the head of a log.
 */
#ifndef FELMI_BANNER_H
#define FELMI_BANNER_H

/* Program, version, host, case and ranks, in a frame as OpenFOAM's; after MPI_Init. */
void banner_program(const char *program, const char *directory);
/* A line across the log. */
void banner_line(void);
/* One limit on the time step, s; a dash where it is no number above zero. */
void banner_limit(const char *name, double value, const char *what);

#endif
