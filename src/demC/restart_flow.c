/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_flow.c - feeders and outlets in a restart file.
 *
 * A feeder goes on from the particle it drew last, with the random numbers that follow, at the
 * moments of its own. They go by their names: one that is new begins, one that is no more leaves
 * nothing behind. Where rate or moments of a feeder are not what they were, what it owed at its
 * last moment is due still, and the new moments count from there.
 */
#include "restart.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LENGTH(table) (sizeof table / sizeof *table)
#define FEED(name, units, type, member)                                                            \
    {                                                                                              \
        "feeders/" name, units, type, offsetof(feeder, member)                                     \
    }
#define TAKE(name, units, type, member)                                                            \
    {                                                                                              \
        "outlets/" name, units, type, offsetof(outlet, member)                                     \
    }

static const restart_record FEEDER[] = {
    FEED("number", "-", RECORD_INT64, number),
    FEED("mass", "kg", RECORD_REAL, mass.sum),
    FEED("massLost", "kg", RECORD_REAL, mass.lost),
    FEED("waiting", "kg", RECORD_REAL, waiting),
    FEED("before", "kg or -", RECORD_REAL, before),
    FEED("origin", "s", RECORD_REAL, origin),
    FEED("moment", "-", RECORD_REAL, moment),
    FEED("interval", "s", RECORD_REAL, interval),
    FEED("massRate", "kg/s", RECORD_REAL, given.mass_rate),
    FEED("numberRate", "1/s", RECORD_REAL, given.number_rate),
    FEED("end", "s", RECORD_LIMIT, given.end),
    FEED("nextDiameter", "m", RECORD_REAL, diameter),
    FEED("nextMaterial", "-", RECORD_INT, material),
    FEED("turn", "-", RECORD_REAL, mixture.turn),
};

static const restart_record OUTLET[] = {
    TAKE("number", "-", RECORD_INT64, number),
    TAKE("mass", "kg", RECORD_REAL, mass.sum),
    TAKE("massLost", "kg", RECORD_REAL, mass.lost),
};

/* Names, a text in each of n structs. */
static void put_names(restart_job *job, const char *set, const void *first, size_t stride, size_t n)
{
    char(*name)[DEM_NAME] = calloc(n + 1, sizeof *name);
    for (size_t k = 0; k < n && name; k++)
        snprintf(name[k], sizeof *name, "%s", (const char *)first + k * stride);
    if (name)
        restart_put_here(job, set, RESTART_TEXT, n, 1, name, "-");
    else
        h5file_fail(&job->file->f, set, "out of memory");
    free(name);
}

/* State of the random numbers, as the library has it in memory. */
static void put_random(restart_job *job)
{
    const feeders *f = &job->sim->feeders;
    if (!f->n) return;
    const size_t size = gsl_rng_size(f->feeder[0].rng);
    unsigned char *state = malloc(f->n * size);
    for (size_t k = 0; k < f->n && state; k++)
        memcpy(state + k * size, gsl_rng_state(f->feeder[k].rng), size);
    if (state)
        restart_put_here(job, "feeders/random", RESTART_BYTES, f->n, (int)size, state, "-");
    else
        h5file_fail(&job->file->f, "feeders/random", "out of memory");
    free(state);
}

void restart_save_flow(restart_job *job)
{
    const feeders *f = &job->sim->feeders;
    const outlets *o = &job->sim->outlets;
    double *due = calloc(f->n + 1, sizeof *due);
    for (size_t k = 0; k < f->n && due; k++) due[k] = feeder_due(&f->feeder[k]);
    if (!due) h5file_fail(&job->file->f, "feeders", "out of memory");
    put_names(job, "feeders/name", f->n ? f->feeder[0].given.name : "", sizeof *f->feeder, f->n);
    restart_put_records(job, FEEDER, LENGTH(FEEDER), f->feeder, sizeof *f->feeder, f->n);
    restart_put_here(job, "feeders/due", RESTART_REAL, f->n, 1, due, "kg or -");
    put_random(job);
    put_names(job, "outlets/name", o->n ? o->outlet[0].given.name : "", sizeof *o->outlet, o->n);
    restart_put_records(job, OUTLET, LENGTH(OUTLET), o->outlet, sizeof *o->outlet, o->n);
    free(due);
}

/* `f` as it was saved goes on under what `now` is told to do. */
static void adapt(const restart_job *job, const feeder *now, double due, feeder *f)
{
    const dem_feeder *g = &now->given;
    const int same = f->given.mass_rate == g->mass_rate && f->given.number_rate == g->number_rate &&
                     f->given.end == g->end && f->interval == now->interval;
    const double last = fmin(f->origin + f->moment * f->interval, f->given.end);
    /* By mass and by number are different debts: what came counts as what was due. */
    const int other = (f->given.mass_rate > 0) != (g->mass_rate > 0);
    f->given = now->given;
    f->interval = now->interval;
    if (!same) {
        f->before = !other ? due : g->mass_rate > 0 ? tally_total(&f->mass) : (double)f->number;
        f->origin = fmax(g->begin, last);
        f->moment = 0;
    }
    const int known = f->material >= 0 && (size_t)f->material < job->n_material;
    f->material = known ? job->material[f->material] : -1;
    /* Where sizes or materials have changed so far, the first that is drawn is next. */
    int there = f->diameter >= now->mixture.smallest * (1 - 1e-9) &&
                f->diameter <= now->mixture.largest * (1 + 1e-9),
        listed = 0;
    for (size_t k = 0; k < now->mixture.n; k++) listed |= now->mixture.material[k] == f->material;
    if (there && listed) return;
    f->diameter = now->diameter;
    f->material = now->material;
}

static void load_feeders(restart_job *job)
{
    feeders *all = &job->sim->feeders;
    size_t n;
    const size_t *place =
        restart_match(job, "feeders/name", all->n, all->n ? all->feeder[0].given.name : "",
                      sizeof *all->feeder, &n);
    feeder *now = restart_room(job, all->n * sizeof *now);
    if (!place || !now || !n || !all->n) return;
    const size_t size = gsl_rng_size(all->feeder[0].rng);
    const double *due = restart_get(job->file, "feeders/due", RESTART_REAL, 1, &n);
    const unsigned char *state =
        restart_get(job->file, "feeders/random", RESTART_BYTES, (int)size, &n);
    memcpy(now, all->feeder, all->n * sizeof *now);
    restart_get_records(job, FEEDER, LENGTH(FEEDER), all->feeder, sizeof *all->feeder, n, place);
    if (job->file->f.failed) {
        memcpy(all->feeder, now, all->n * sizeof *now);
        return;
    }
    for (size_t k = 0; k < n; k++) {
        if (place[k] == SIZE_MAX) continue;
        feeder *f = &all->feeder[place[k]];
        adapt(job, &now[place[k]], due[k], f);
        memcpy(gsl_rng_state(f->rng), state + k * size, size);
    }
}

void restart_load_flow(restart_job *job)
{
    outlets *o = &job->sim->outlets;
    size_t n;
    load_feeders(job);
    const size_t *place = restart_match(job, "outlets/name", o->n,
                                        o->n ? o->outlet[0].given.name : "", sizeof *o->outlet, &n);
    if (place)
        restart_get_records(job, OUTLET, LENGTH(OUTLET), o->outlet, sizeof *o->outlet, n, place);
}
