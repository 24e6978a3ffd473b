/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiDEM.h - what the parts of the particles-only solver share.
 *
 * Every rank runs all of it, for the engine's functions are collective; the first one writes the
 * series and the log (message.h). What returns whether it failed may do so on some ranks only,
 * unless it says otherwise.
 */
#ifndef FELMI_DEM_H
#define FELMI_DEM_H

#include <stdio.h>

#include "case.h"
#include "dem.h"

/* How many particles there are on all ranks. */
long long count_particles(const dem_sim *sim);
/* In place, over all ranks. */
void sum_over_ranks(double *x, int n);

/* start.c: what the log says of the case before the first step. */
void start_case(const case_dem *dem, const case_control *control);
void start_time_step(const case_dem *dem, const dem_sim *sim, double delta_t);

/* plan.c: steps, outputs and restart files in time. */
typedef struct plan {
    double origin, end;           /* s */
    double delta_t;               /* as shortened, so that output falls on whole steps */
    long first, steps;            /* the last step done, and all, counted from the origin */
    long per_output, per_restart; /* steps between outputs and between restart files; 0: none */
} plan;
/* From the time `now` on; `origin`: where the run once began. */
plan plan_of(const case_control *control, double origin, double now);
/* The end of a step. The last one ends at the end time, whatever the interval of output. */
double plan_time(const plan *p, long step);

/* series.c: a time series in <directory>/postProcessing. Behind its head are the rows there are up
 * to the time `from`, s (NAN: none). NULL with the reason on stderr. */
FILE *series_open(const char *directory, const char *name, const char *head, double from);
/* The head that `write` writes, to be freed; NULL with the reason on stderr. */
char *head_of(void (*write)(FILE *file, const dem_sim *sim), const dem_sim *sim);

/* record.c: time series in <case>/postProcessing. */
typedef struct record record;

/* On the first rank NULL with the reason on stderr. gravity (m/s2) is for the potential energy;
 * from: see series.c. */
record *record_new(const char *directory, const dem_sim *sim, const double gravity[3], double from);
/* Collective: one row of each file, after a step. 0, or -1 with the reason on stderr. */
int record_write(record *r, const dem_sim *sim);
void record_free(record *r);

/* books.c: series of the balances of mass and, with `balance`, energy and angular momentum. As
 * above. */
typedef struct books books;
books *books_new(const char *directory, dem_sim *sim, int balance, double from);
int books_write(books *b, const dem_sim *sim);
void books_free(books *b);

/* shares.c: what the time goes into. */
typedef struct shares {
    double force, neighbour, exchange, other; /* of the engine, s, sum over its calls */
    double engine, output;                    /* wall clock, s */
} shares;
void shares_add(shares *s, const dem_report *report, double engine);
/* A table for the end of the log. `all`: wall clock of the run, s. */
void shares_print(const shares *s, double all, const dem_report *report);

#endif
