/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing.c - random positions of spheres without overlap, loose or dense.
 *
 * Two stages. (1) Random sequential addition: a centre is drawn uniformly in the room and kept if
 * it is clear of all before it. As long as this succeeds the result is the plain uniform one; it
 * saturates at a solid fraction of .384 (Torquato, Uche & Stillinger, Phys. Rev. E 74 (2006)
 * 061308, doi:10.1103/PhysRevE.74.061308). (2) Spheres that found no place within ATTEMPTS draws
 * stay at their last one, overlapping, and all are pushed apart: sweep after sweep, every
 * overlapping pair is moved apart along its line of centres by the overlap, and every sphere off
 * the bounds, in the manner of Jodrey & Tory, Phys. Rev. A 32 (1985) 2347,
 * doi:10.1103/PhysRevA.32.2347. Below the random close packing of about .64 the overlaps of a
 * random configuration relax to zero. A sweep aims at a diameter larger by MARGIN, so that the end
 * is reached in finitely many.
 *
 * Of two spheres pushed apart each moves by the volume share of the other, equal ones by halves.
 *
 * Data: new spheres first, then the fixed ones, in one array; linked cells for every size (grid.h)
 * for the search, and in stage 2 a list of near pairs, made anew when a sphere has moved half its
 * reserve. Cost is linear in the number of spheres. Nothing depends on anything but the arguments
 * and the state of the generator.
 */
#include "packing.h"

#include <gsl/gsl_statistics_double.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Draws for a sphere before it is left to stage 2. At .30, where a draw succeeds once in 10^2 to
 * 10^3, most spheres still find their place by chance; more draws cost more than pushing. */
enum { ATTEMPTS = 100 };
/* Draws in a row without a centre inside the region: the room is smaller than 1e-6 of its box. */
enum { DRAWS = 4000000 };
/* Stage 2 ends as jammed when MOST_SWEEPS did not do, or STALL sweeps did not improve the largest
 * overlap nor lessen the sum of overlaps by a twentieth. Dense packings (.60) need some hundred
 * sweeps. */
enum { MOST_SWEEPS = 20000, STALL = 500 };
static const double MARGIN = 1e-3; /* of the diameter: three thousandths of the solid fraction */
static const double RESERVE =
    .3; /* of the median diameter: reach of the pair list beyond contact */
const double packing_apart = -1e-9; /* of the distance of touching */

typedef struct packing {
    const packing_room *room;
    size_t n, all;            /* new spheres, new and fixed */
    double (*x)[3];           /* [all] */
    double *r;                /* [all] */
    double smallest, largest; /* radii, m */
    grid grid;                /* over the domain */
    double (*origin)[3];      /* [n] positions at which the pair list was made */
    size_t *offset;           /* [n+1] pairs of sphere i: partner[offset[i] .. offset[i+1]) */
    int *partner;
    size_t capacity;
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

/* Move a centre to where its sphere is within the room, one bound after the other. */
static void push_inside(const packing_room *room, double radius, double x[3])
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
    free(p->origin);
    free(p->offset);
    free(p->partner);
}

static dem_status make_grid(packing *p, double reserve)
{
    grid_free(&p->grid);
    const dem_status status = grid_init(&p->grid, p->room->lo, p->room->hi, p->room->periodic,
                                        p->smallest, p->largest, p->all, reserve);
    return status ? status : grid_reserve(&p->grid, p->all, (const double(*)[3])p->x, p->r);
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
    const dem_status status = make_grid(p, 0);
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
        for (int attempt = 0; attempt < ATTEMPTS && !clear; attempt++) {
            if (!packing_draw(p->room, p->r[i], DRAWS, rng, p->x[i])) return -1;
            clear = !overlaps(p, p->x[i], p->r[i], packing_apart);
        }
        left += !clear;
        grid_enter(&p->grid, i);
    }
    return left;
}

/* ---- stage 2: pushing apart ------------------------------------------------------------------ */

static dem_status note_pair(packing *p, size_t *count, int j)
{
    if (*count == p->capacity) {
        const size_t capacity = 2 * p->capacity + 16 * p->n + 64;
        int *partner = realloc(p->partner, capacity * sizeof *partner);
        if (partner == NULL) return DEM_NO_MEMORY;
        p->partner = partner;
        p->capacity = capacity;
    }
    p->partner[(*count)++] = j;
    return DEM_OK;
}

typedef struct listing {
    packing *p;
    size_t i, count;
    dem_status status;
} listing;

/* Partners of sphere i in the list: later new spheres and all fixed ones within reach. */
static int list_partner(void *context, int j)
{
    listing *l = context;
    packing *p = l->p;
    if ((size_t)j <= l->i) return 0;
    double d[3];
    packing_separation(p->room, p->x[l->i], p->x[j], d);
    const double far = p->r[l->i] + p->r[j] + p->grid.reserve;
    if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > far * far) return 0;
    l->status = note_pair(p, &l->count, j);
    return l->status != DEM_OK;
}

static dem_status make_list(packing *p)
{
    grid_clear(&p->grid);
    for (size_t i = p->all; i-- > 0;) grid_enter(&p->grid, i);
    listing l = {.p = p};
    for (l.i = 0; l.i < p->n; l.i++) {
        p->offset[l.i] = l.count;
        if (grid_search(&p->grid, p->x[l.i], p->r[l.i], list_partner, &l)) return l.status;
        memcpy(p->origin[l.i], p->x[l.i], sizeof *p->x);
    }
    p->offset[p->n] = l.count;
    return DEM_OK;
}

/* What a sweep found before it moved the spheres. */
typedef struct sweep_result {
    double largest, sum; /* overlap / distance of touching, of all pairs */
    double moved;        /* largest displacement since the pair list was made, m */
} sweep_result;

/* Move a pair apart to `1 + MARGIN` of touching, or the new one alone. */
static double push_pair(packing *p, size_t i, size_t j)
{
    double d[3];
    packing_separation(p->room, p->x[i], p->x[j], d);
    const double touch = p->r[i] + p->r[j], wanted = touch * (1. + MARGIN);
    const double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (d2 >= wanted * wanted) return 0.;
    const double distance = sqrt(d2);
    if (distance == 0.) d[0] = 1.; /* coincident centres part along x */
    const double vi = p->r[i] * p->r[i] * p->r[i], vj = p->r[j] * p->r[j] * p->r[j];
    const double mine = j < p->n ? vj / (vi + vj) : 1.;
    const double factor = distance > 0. ? (wanted - distance) / distance : wanted;
    for (int k = 0; k < 3; k++) {
        p->x[i][k] -= mine * factor * d[k];
        if (j < p->n) p->x[j][k] += (1. - mine) * factor * d[k];
    }
    return fmax(0., 1. - distance / touch);
}

static sweep_result sweep(packing *p)
{
    sweep_result result = {0};
    for (size_t i = 0; i < p->n; i++) {
        for (size_t c = p->offset[i]; c < p->offset[i + 1]; c++) {
            const double overlap = push_pair(p, i, (size_t)p->partner[c]);
            result.largest = fmax(result.largest, overlap);
            result.sum += overlap;
        }
    }
    for (size_t i = 0; i < p->n; i++) {
        double d[3];
        push_inside(p->room, p->r[i], p->x[i]);
        packing_separation(p->room, p->origin[i], p->x[i], d);
        result.moved = fmax(result.moved, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    result.moved = sqrt(result.moved);
    return result;
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

static dem_status median_radius(const packing *p, double *median)
{
    double *r = malloc(p->n * sizeof *r);
    if (r == NULL) return DEM_NO_MEMORY;
    memcpy(r, p->r, p->n * sizeof *r);
    *median = gsl_stats_median(r, 1, p->n);
    free(r);
    return DEM_OK;
}

static dem_status push_apart(packing *p, int64_t *placed, double *overlap)
{
    double median;
    dem_status status = median_radius(p, &median);
    const double reserve = RESERVE * 2. * median;
    p->origin = malloc(p->n * sizeof *p->origin);
    p->offset = malloc((p->n + 1) * sizeof *p->offset);
    if (status || p->origin == NULL || p->offset == NULL) return DEM_NO_MEMORY;
    status = make_grid(p, reserve);
    double moved = INFINITY, best = INFINITY, best_sum = INFINITY;
    int stalled = 0;
    for (int n = 0; n < MOST_SWEEPS && stalled < STALL && status == DEM_OK; n++) {
        /* Spheres that come from beyond the list must not touch before it is made anew. */
        if (moved > .5 * (reserve - MARGIN * 2. * p->largest)) status = make_list(p);
        if (status != DEM_OK) return status;
        const sweep_result now = sweep(p);
        moved = now.moved;
        *overlap = now.largest;
        if (now.largest == 0. && (*placed = count_clear(p)) == (int64_t)p->n) return DEM_OK;
        stalled = now.largest < .95 * best || now.sum < .95 * best_sum ? 0 : stalled + 1;
        if (stalled == 0) {
            best = fmin(best, now.largest);
            best_sum = fmin(best_sum, now.sum);
        }
    }
    if (status == DEM_OK) *placed = count_clear(p);
    return status;
}

/* ---- public ---------------------------------------------------------------------------------- */

dem_status packing_random(const packing_room *room, size_t n, const double *r, size_t n_old,
                          const double (*x_old)[3], const double *r_old, const gsl_rng *rng,
                          double (*x)[3], int64_t *placed, double *overlap)
{
    packing p;
    *placed = 0;
    *overlap = 0.;
    dem_status status = packing_make(&p, room, n, r, n_old, x_old, r_old);
    if (status == DEM_OK) {
        const int64_t left = add_sequentially(&p, rng);
        if (left > 0)
            status = push_apart(&p, placed, overlap);
        else
            *placed = left < 0 ? -1 : (int64_t)n;
    }
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
