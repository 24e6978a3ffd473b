/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiDEM.h - what the parts of the particles-only solver share.
 */
#ifndef FELMI_DEM_H
#define FELMI_DEM_H

#include "case.h"
#include "dem.h"

/* start.c: what the log says of the case before the first step. */
void start_case(const dem_param *param, const case_control *control);
void start_time_step(const dem_limits *limits, double delta_t);

/* record.c: time series in <case>/postProcessing. */
typedef struct record record;

/* NULL with the reason on stderr. gravity (m/s2) is for the potential energy. */
record *record_new(const char *directory, const dem_sim *sim, const double gravity[3]);
/* One row of each file, after a step. 0, or -1 with the reason on stderr. */
int record_write(record *r, const dem_sim *sim);
void record_free(record *r);

#endif
