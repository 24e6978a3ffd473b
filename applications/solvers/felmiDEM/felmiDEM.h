/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiDEM.h - what the parts of the particles-only solver share.
 */
#ifndef FELMI_DEM_H
#define FELMI_DEM_H

#include <stdio.h>

#include "case.h"
#include "dem.h"

/* start.c: what the log says of the case before the first step. */
void start_case(const case_dem *dem, const case_control *control);
void start_time_step(const case_dem *dem, const dem_sim *sim, double delta_t);

/* record.c: time series in <case>/postProcessing. */
typedef struct record record;

/* A file in <directory>/postProcessing, open; NULL with the reason on stderr. */
FILE *record_open(const char *directory, const char *name);
/* NULL with the reason on stderr. gravity (m/s2) is for the potential energy. */
record *record_new(const char *directory, const dem_sim *sim, const double gravity[3]);
/* One row of each file, after a step. 0, or -1 with the reason on stderr. */
int record_write(record *r, const dem_sim *sim);
void record_free(record *r);

/* books.c: series of the balances of mass and, with `balance`, energy and angular momentum. As
 * above. */
typedef struct books books;
books *books_new(const char *directory, const dem_sim *sim, int balance);
int books_write(books *b, const dem_sim *sim);
void books_free(books *b);

#endif
