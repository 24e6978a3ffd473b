/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing.c - random positions of spheres without overlap, loose or dense.
 *
 * Two stages. (1) Random sequential addition: a centre is drawn uniformly in the room and kept if
 * it is clear of all before it. As long as this succeeds the result is the plain uniform one; it
 * saturates at a solid fraction of .384 (Torquato, Uche & Stillinger, Phys. Rev. E 74 (2006)
 * 061308, doi:10.1103/PhysRevE.74.061308). (2) Spheres that found no place within ATTEMPTS draws
 * stay at their last one, overlapping, and all are pushed apart (packing_push.c).
 *
 * Data: new spheres first, then the fixed ones, in one array; linked cells for every size (grid.h)
 * for the search. Cost is linear in the number of spheres. Nothing depends on anything but the
 * arguments and the state of the generator: every rank does the first stage, alike, and all share
 * the second.
 */
#include "packing.h"

#include "dem_internal.h"

#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Draws for a sphere before it is left to stage 2. At .30, where a draw succeeds once in 10^2 to
 * 10^3, most spheres still find their place by chance; more draws cost more than pushing. */
enum { ATTEMPTS = 100, FEW_ATTEMPTS = 10 };
/* Where more than one in CROWDED spheres so far is left to stage 2, that has much to do anyway. */
enum { CROWDED = 16 };
/* Draws in a row without a centre inside the region: the room is smaller than 1e-6 of its box. */
enum { DRAWS = 4000000 };
const double packing_apart = -1e-9; /* of the distance of touching */

typedef struct packing {
    const packing_room *room;
    size_t n, all;            /* new spheres, new and fixed */
    double (*x)[3];           /* [all] */
    double *r;                /* [all] */
    double smallest, largest; /* radii, m */
    grid grid;                /* over the domain */
} packing;

/* ---- the room -------------------------------------------------------------------------------- */

__attribute__((format(printf, 3, 4))) static dem_status refuse(char *reason, size_t size,
                                                               const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(reason, size, format, list);
    va_end(list);
    return DEM_BAD_ARGUMENT;
}

dem_status packing_find_room(packing_room *room, const dem_sdf *region, const double low[3],
                             const double high[3], const double lo[3], const double hi[3],
                             const int periodic[3], double diameter, char *reason, size_t size)
{
    room->region = region;
    for (int a = 0; a < 3; a++) {
        const double length = hi[a] - lo[a];
        const double slack = 1e-9 * length; /* the same bound written in two files */
        room->lo[a] = lo[a];
        room->hi[a] = hi[a];
        room->periodic[a] = periodic[a];
        room->low[a] = low[a];
        room->high[a] = high[a];
        room->filled[a] = periodic[a] && high[a] - low[a] >= length - slack;
        if (room->filled[a] || !periodic[a]) {
            room->low[a] = room->filled[a] ? lo[a] : fmax(low[a], lo[a]);
            room->high[a] = room->filled[a] ? hi[a] : fmin(high[a], hi[a]);
        }
        if (periodic[a] && length < diameter)
            return refuse(reason, size,
                          "a particle of diameter %g m touches itself across the period %g m",
                          diameter, length);
        if (!(room->high[a] > room->low[a]))
            return refuse(reason, size, "the region lies outside the domain (%c from %g to %g m)",
                          "xyz"[a], low[a], high[a]);
    }
    return DEM_OK;
}

void packing_separation(const packing_room *room, const double a[3], const double b[3], double d[3])
{
    for (int k = 0; k < 3; k++) {
        d[k] = b[k] - a[k];
        if (!room->periodic[k]) continue;
        const double length = room->hi[k] - room->lo[k];
        d[k] -= length * rint(d[k] / length);
    }
}

/* A flat face across a direction that wraps: the region goes on behind it. */
static int is_open(const packing_room *room, const double g[3])
{
    for (int k = 0; k < 3; k++)
        if (room->filled[k] && fabs(g[k]) > 1. - 1e-12) return 1;
    return 0;
}

double packing_clearance(const packing_room *room, const double x[3])
{
    double least = INFINITY, g[3];
    for (int k = 0; k < 3; k++)
        if (!room->filled[k]) least = fmin(least, fmin(x[k] - room->low[k], room->high[k] - x[k]));
    for (int part = 0; part < dem_sdf_parts(room->region); part++) {
        const double phi = dem_sdf_eval(room->region, part, x, g);
        if (!is_open(room, g)) least = fmin(least, phi);
    }
    return least;
}

void packing_inside(const packing_room *room, double radius, double x[3])
{
    double g[3];
    const double wanted = radius * (1. + 1e-6);
    for (int part = 0; part < dem_sdf_parts(room->region); part++) {
        const double phi = dem_sdf_eval(room->region, part, x, g);
        if (phi >= wanted || is_open(room, g)) continue;
        for (int k = 0; k < 3; k++) x[k] += g[k] * (wanted - phi);
    }
    for (int k = 0; k < 3; k++) {
        const double length = room->hi[k] - room->lo[k];
        if (room->filled[k])
            x[k] -= length * floor((x[k] - room->lo[k]) / length);
        else
            x[k] = fmin(fmax(x[k], room->low[k] + radius), room->high[k] - radius);
    }
}

/* ---- spheres --------------------------------------------------------------------------------- */

static void packing_free(packing *p)
{
    free(p->x);
    free(p->r);
    grid_free(&p->grid);
}

/* A packing of n new spheres (positions not yet set) and the fixed ones that are in the grid. */
static dem_status packing_make(packing *p, const packing_room *room, size_t n, const double *r,
                               size_t n_old, const double (*x_old)[3], const double *r_old)
{
    *p = (packing){.room = room, .n = n, .all = n + n_old};
    if (p->all >= INT_MAX) return DEM_BAD_ARGUMENT;
    p->x = malloc((p->all + 1) * sizeof *p->x);
    p->r = malloc((p->all + 1) * sizeof *p->r);
    if (p->x == NULL || p->r == NULL) return DEM_NO_MEMORY;
    if (n) memcpy(p->r, r, n * sizeof *p->r);
    if (n_old) memcpy(p->x + n, x_old, n_old * sizeof *p->x);
    if (n_old) memcpy(p->r + n, r_old, n_old * sizeof *p->r);
    for (size_t i = 0; i < p->all; i++) {
        p->smallest = i ? fmin(p->smallest, p->r[i]) : p->r[i];
        p->largest = fmax(p->largest, p->r[i]);
    }
    dem_status status =
        grid_init(&p->grid, room->lo, room->hi, room->periodic, p->smallest, p->largest, p->all, 0);
    if (status == DEM_OK) status = grid_reserve(&p->grid, p->all, (const double(*)[3])p->x, p->r);
    for (size_t i = n; i < p->all && status == DEM_OK; i++) grid_enter(&p->grid, i);
    return status;
}

typedef struct looking {
    const packing_room *room;
    const grid *grid;
    const double *x;
    double radius, factor;
} looking;

static int is_near(void *context, int j)
{
    const looking *l = context;
    double d[3];
    packing_separation(l->room, l->x, l->grid->x[j], d);
    const double touch = (l->radius + l->grid->r[j]) * l->factor;
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < touch * touch;
}

int packing_overlaps(const packing_room *room, const grid *g, const double x[3], double radius,
                     double tolerance)
{
    looking l = {room, g, x, radius, 1. - tolerance};
    return grid_search(g, x, radius, is_near, &l);
}

static int overlaps(const packing *p, const double x[3], double radius, double tolerance)
{
    return packing_overlaps(p->room, &p->grid, x, radius, tolerance);
}

/* ---- stage 1: random sequential addition ----------------------------------------------------- */

int packing_draw(const packing_room *room, double radius, int draws, const gsl_rng *rng,
                 double x[3])
{
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = room->low[k] + (room->filled[k] ? 0. : radius);
        high[k] = room->high[k] - (room->filled[k] ? 0. : radius);
        if (high[k] < low[k]) return 0;
    }
    for (int attempt = 0; attempt < draws; attempt++) {
        for (int k = 0; k < 3; k++) x[k] = low[k] + (high[k] - low[k]) * gsl_rng_uniform(rng);
        if (packing_clearance(room, x) >= radius) return 1;
    }
    return 0;
}

/* Number of spheres left overlapping, or -1 when no centre could be drawn. */
static int64_t add_sequentially(packing *p, const gsl_rng *rng)
{
    int64_t left = 0;
    for (size_t i = 0; i < p->n; i++) {
        int clear = 0;
        const int attempts = CROWDED * left > (int64_t)i ? FEW_ATTEMPTS : ATTEMPTS;
        for (int attempt = 0; attempt < attempts && !clear; attempt++) {
            if (!packing_draw(p->room, p->r[i], DRAWS, rng, p->x[i])) return -1;
            clear = !overlaps(p, p->x[i], p->r[i], packing_apart);
        }
        left += !clear;
        grid_enter(&p->grid, i);
    }
    return left;
}

/* Spheres that are within the room and clear of those counted before them; refills the cells. */
static int64_t count_clear(packing *p)
{
    grid_clear(&p->grid);
    for (size_t i = p->n; i < p->all; i++) grid_enter(&p->grid, i);
    int64_t clear = 0;
    for (size_t i = 0; i < p->n; i++) {
        if (packing_clearance(p->room, p->x[i]) < p->r[i]) continue;
        if (overlaps(p, p->x[i], p->r[i], packing_apart)) continue;
        grid_enter(&p->grid, i);
        clear++;
    }
    return clear;
}

/* ---- public ---------------------------------------------------------------------------------- */

dem_status packing_random(const packing_room *room, size_t n, const double *r, size_t n_old,
                          const double (*x_old)[3], const double *r_old, const gsl_rng *rng,
                          dem_sim *sim, double (*x)[3], int64_t *placed, double *overlap)
{
    packing p;
    int clear = 1;
    *placed = 0;
    *overlap = 0.;
    dem_status status = packing_make(&p, room, n, r, n_old, x_old, r_old);
    if (sim) status = agree(sim, status == DEM_NO_MEMORY ? no_memory(sim) : status);
    const int64_t left = status == DEM_OK ? add_sequentially(&p, rng) : 0;
    if (left > 0) status = packing_push(room, n, p.all, p.x, p.r, sim, &clear, overlap);
    if (status == DEM_OK) *placed = left < 0 ? -1 : clear ? (int64_t)n : count_clear(&p);
    if (status == DEM_OK) memcpy(x, p.x, n * sizeof *x);
    packing_free(&p);
    return status;
}

dem_status packing_fixed(const packing_room *room, size_t n, const double (*x)[3], const double *r,
                         double diameter, grid *g)
{
    double smallest = .5 * diameter, largest = .5 * diameter;
    for (size_t i = 0; i < n; i++) {
        smallest = fmin(smallest, r[i]);
        largest = fmax(largest, r[i]);
    }
    dem_status status = grid_init(g, room->lo, room->hi, room->periodic, smallest, largest, n, 0);
    if (status == DEM_OK) status = grid_reserve(g, n, x, r);
    for (size_t i = 0; i < n && status == DEM_OK; i++) grid_enter(g, i);
    return status;
}
