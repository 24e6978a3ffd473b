/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing.c - random positions of equal spheres without overlap, loose or dense.
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
 * Data: new spheres first, then the fixed ones, in one array; a linked-cell grid (head of each
 * cell, next of each sphere) for the search, and in stage 2 a list of near pairs, made anew when a
 * sphere has moved half its reserve. Cost is linear in the number of spheres. Nothing depends on
 * anything but the arguments and the state of the generator.
 */
#include "packing.h"

#include <limits.h>
#include <math.h>
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
static const double MARGIN = 1e-3;   /* of the diameter: three thousandths of the solid fraction */
static const double RESERVE = .3;    /* of the diameter: reach of the pair list beyond contact */
static const double ROUNDING = 1e-9; /* spheres are apart by this much of their distance */

typedef struct packing {
    const packing_room *room;
    size_t n, all;       /* new spheres, new and fixed */
    double (*x)[3];      /* [all] */
    double *r;           /* [all] */
    double reach;        /* largest distance of a pair that is looked for, m */
    int cells[3];        /* linked cells over the domain */
    double per_m[3];     /* cells per metre */
    int *head, *next;    /* first sphere of a cell, next sphere in the same cell; -1 ends */
    double (*origin)[3]; /* [n] positions at which the pair list was made */
    size_t *offset;      /* [n+1] pairs of sphere i: partner[offset[i] .. offset[i+1]) */
    int *partner;
    size_t capacity;
} packing;

/* ---- geometry -------------------------------------------------------------------------------- */

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

/* ---- linked cells ---------------------------------------------------------------------------- */

static int cell_along(const packing *p, int k, double x)
{
    const packing_room *room = p->room;
    const double length = room->hi[k] - room->lo[k];
    double t = x - room->lo[k];
    if (room->periodic[k]) t -= length * floor(t / length);
    const double c = t * p->per_m[k];
    return c <= 0. ? 0 : c >= p->cells[k] - 1 ? p->cells[k] - 1 : (int)c;
}

static size_t cell_of(const packing *p, const double x[3])
{
    const size_t i = cell_along(p, 0, x[0]), j = cell_along(p, 1, x[1]), k = cell_along(p, 2, x[2]);
    return (k * p->cells[1] + j) * p->cells[0] + i;
}

/* The distinct cells along k next to the one of x and that one itself: their number. */
static int cells_near(const packing *p, int k, double x, int near[3])
{
    const int c = cell_along(p, k, x), n = p->cells[k];
    int count = 0;
    for (int o = -1; o <= 1; o++) {
        int other = c + o;
        if (p->room->periodic[k])
            other = (other + n) % n;
        else if (other < 0 || other >= n)
            continue;
        int seen = 0;
        for (int i = 0; i < count; i++) seen |= near[i] == other;
        if (!seen) near[count++] = other;
    }
    return count;
}

/* Cells at least `reach` wide, and not many more of them than there are spheres. */
static dem_status make_cells(packing *p, double reach)
{
    double volume = 1.;
    for (int k = 0; k < 3; k++) volume *= p->room->hi[k] - p->room->lo[k];
    const double width = fmax(reach, cbrt(volume / (4. * (double)p->all + 1000.)));
    size_t total = 1;
    for (int k = 0; k < 3; k++) {
        const double length = p->room->hi[k] - p->room->lo[k];
        p->cells[k] = (int)fmax(1., floor(length / width));
        p->per_m[k] = p->cells[k] / length;
        total *= (size_t)p->cells[k];
    }
    p->reach = reach;
    free(p->head);
    p->head = malloc(total * sizeof *p->head);
    if (p->head == NULL) return DEM_NO_MEMORY;
    for (size_t c = 0; c < total; c++) p->head[c] = -1;
    return DEM_OK;
}

static void enter(packing *p, size_t i)
{
    const size_t c = cell_of(p, p->x[i]);
    p->next[i] = p->head[c];
    p->head[c] = (int)i;
}

static void packing_free(packing *p)
{
    free(p->x);
    free(p->r);
    free(p->head);
    free(p->next);
    free(p->origin);
    free(p->offset);
    free(p->partner);
}

/* A packing of n new spheres (positions not yet set) and the fixed ones that are in the cells. */
static dem_status packing_make(packing *p, const packing_room *room, double radius, size_t n,
                               size_t n_old, const double (*x_old)[3], const double *r_old)
{
    *p = (packing){.room = room, .n = n, .all = n + n_old};
    if (p->all >= INT_MAX) return DEM_BAD_ARGUMENT;
    p->x = malloc((p->all + 1) * sizeof *p->x);
    p->r = malloc((p->all + 1) * sizeof *p->r);
    p->next = malloc((p->all + 1) * sizeof *p->next);
    if (p->x == NULL || p->r == NULL || p->next == NULL) return DEM_NO_MEMORY;
    double largest = radius;
    for (size_t i = 0; i < n; i++) p->r[i] = radius;
    for (size_t i = 0; i < n_old; i++) {
        memcpy(p->x[n + i], x_old[i], sizeof *p->x);
        p->r[n + i] = r_old[i];
        largest = fmax(largest, r_old[i]);
    }
    const dem_status status = make_cells(p, radius + largest);
    if (status == DEM_OK)
        for (size_t i = n; i < p->all; i++) enter(p, i);
    return status;
}

/* Whether a sphere of `radius` at x overlaps with one in the cells by more than `tolerance` (< 0:
 * comes nearer than that) of the sum of the radii. */
static int overlaps(const packing *p, const double x[3], double radius, double tolerance)
{
    int near[3][3], count[3];
    for (int k = 0; k < 3; k++) count[k] = cells_near(p, k, x[k], near[k]);
    for (int c = 0; c < count[2]; c++)
        for (int b = 0; b < count[1]; b++)
            for (int a = 0; a < count[0]; a++) {
                const size_t cell =
                    ((size_t)near[2][c] * p->cells[1] + near[1][b]) * p->cells[0] + near[0][a];
                for (int j = p->head[cell]; j >= 0; j = p->next[j]) {
                    double d[3];
                    packing_separation(p->room, x, p->x[j], d);
                    const double touch = (radius + p->r[j]) * (1. - tolerance);
                    if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < touch * touch) return 1;
                }
            }
    return 0;
}

/* ---- stage 1: random sequential addition ----------------------------------------------------- */

/* A centre drawn uniformly where a sphere is within the room; 0 when none was found. */
static int draw(const packing_room *room, double radius, gsl_rng *rng, double x[3])
{
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = room->low[k] + (room->filled[k] ? 0. : radius);
        high[k] = room->high[k] - (room->filled[k] ? 0. : radius);
        if (high[k] < low[k]) return 0;
    }
    for (int attempt = 0; attempt < DRAWS; attempt++) {
        for (int k = 0; k < 3; k++) x[k] = low[k] + (high[k] - low[k]) * gsl_rng_uniform(rng);
        if (packing_clearance(room, x) >= radius) return 1;
    }
    return 0;
}

/* Number of spheres left overlapping, or -1 when no centre could be drawn. */
static int64_t add_sequentially(packing *p, double radius, gsl_rng *rng)
{
    int64_t left = 0;
    for (size_t i = 0; i < p->n; i++) {
        int clear = 0;
        for (int attempt = 0; attempt < ATTEMPTS && !clear; attempt++) {
            if (!draw(p->room, radius, rng, p->x[i])) return -1;
            clear = !overlaps(p, p->x[i], radius, -ROUNDING);
        }
        left += !clear;
        enter(p, i);
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

/* Partners of sphere i in the list: later new spheres and all fixed ones within reach. */
static dem_status list_partners(packing *p, size_t i, double reserve, size_t *count)
{
    int near[3][3], n[3];
    for (int k = 0; k < 3; k++) n[k] = cells_near(p, k, p->x[i][k], near[k]);
    for (int c = 0; c < n[2] * n[1] * n[0]; c++) {
        const int a = c % n[0], b = c / n[0] % n[1], e = c / (n[0] * n[1]);
        const size_t cell =
            ((size_t)near[2][e] * p->cells[1] + near[1][b]) * p->cells[0] + near[0][a];
        for (int j = p->head[cell]; j >= 0; j = p->next[j]) {
            if ((size_t)j <= i) continue;
            double d[3];
            packing_separation(p->room, p->x[i], p->x[j], d);
            const double far = p->r[i] + p->r[j] + reserve;
            if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > far * far) continue;
            const dem_status status = note_pair(p, count, j);
            if (status != DEM_OK) return status;
        }
    }
    return DEM_OK;
}

static dem_status make_list(packing *p, double reserve)
{
    const size_t total = (size_t)p->cells[0] * p->cells[1] * p->cells[2];
    for (size_t c = 0; c < total; c++) p->head[c] = -1;
    for (size_t i = p->all; i-- > 0;) enter(p, i);
    size_t count = 0;
    for (size_t i = 0; i < p->n; i++) {
        p->offset[i] = count;
        const dem_status status = list_partners(p, i, reserve, &count);
        if (status != DEM_OK) return status;
        memcpy(p->origin[i], p->x[i], sizeof *p->x);
    }
    p->offset[p->n] = count;
    return DEM_OK;
}

/* What a sweep found before it moved the spheres. */
typedef struct sweep_result {
    double largest, sum; /* overlap / distance of touching, of all pairs */
    double moved;        /* largest displacement since the pair list was made, m */
} sweep_result;

/* Move a pair apart to `1 + MARGIN` of touching: by halves, or the new one alone. */
static double push_pair(packing *p, size_t i, size_t j)
{
    double d[3];
    packing_separation(p->room, p->x[i], p->x[j], d);
    const double touch = p->r[i] + p->r[j], wanted = touch * (1. + MARGIN);
    const double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (d2 >= wanted * wanted) return 0.;
    const double distance = sqrt(d2);
    if (distance == 0.) d[0] = 1.; /* coincident centres part along x */
    const double share = (j < p->n ? .5 : 1.) * (wanted - distance) / fmax(distance, 1e-300);
    const double factor = distance > 0. ? share : (j < p->n ? .5 : 1.) * wanted;
    for (int k = 0; k < 3; k++) {
        p->x[i][k] -= factor * d[k];
        if (j < p->n) p->x[j][k] += factor * d[k];
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
    const size_t total = (size_t)p->cells[0] * p->cells[1] * p->cells[2];
    for (size_t c = 0; c < total; c++) p->head[c] = -1;
    for (size_t i = p->n; i < p->all; i++) enter(p, i);
    int64_t clear = 0;
    for (size_t i = 0; i < p->n; i++) {
        if (packing_clearance(p->room, p->x[i]) < p->r[i]) continue;
        if (overlaps(p, p->x[i], p->r[i], -ROUNDING)) continue;
        enter(p, i);
        clear++;
    }
    return clear;
}

static dem_status push_apart(packing *p, double radius, int64_t *placed, double *overlap)
{
    const double reserve = RESERVE * 2. * radius;
    p->origin = malloc(p->n * sizeof *p->origin);
    p->offset = malloc((p->n + 1) * sizeof *p->offset);
    if (p->origin == NULL || p->offset == NULL) return DEM_NO_MEMORY;
    dem_status status = make_cells(p, p->reach + reserve);
    double moved = INFINITY, best = INFINITY, best_sum = INFINITY;
    int stalled = 0;
    for (int n = 0; n < MOST_SWEEPS && stalled < STALL && status == DEM_OK; n++) {
        /* Spheres that come from beyond the list must not touch before it is made anew. */
        if (moved > .5 * (reserve - MARGIN * p->reach)) status = make_list(p, reserve);
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

dem_status packing_random(const packing_room *room, double radius, size_t n, size_t n_old,
                          const double (*x_old)[3], const double *r_old, gsl_rng *rng,
                          double (*x)[3], int64_t *placed, double *overlap)
{
    packing p;
    *placed = 0;
    *overlap = 0.;
    dem_status status = packing_make(&p, room, radius, n, n_old, x_old, r_old);
    if (status == DEM_OK) {
        const int64_t left = add_sequentially(&p, radius, rng);
        if (left > 0)
            status = push_apart(&p, radius, placed, overlap);
        else
            *placed = left < 0 ? -1 : (int64_t)n;
    }
    if (status == DEM_OK) memcpy(x, p.x, n * sizeof *x);
    packing_free(&p);
    return status;
}

dem_status packing_first_overlap(const packing_room *room, double radius, size_t n,
                                 const double (*x)[3], size_t n_old, const double (*x_old)[3],
                                 const double *r_old, double tolerance, size_t *first)
{
    packing p;
    const dem_status status = packing_make(&p, room, radius, n, n_old, x_old, r_old);
    for (*first = 0; status == DEM_OK && *first < n; (*first)++) {
        memcpy(p.x[*first], x[*first], sizeof *x);
        if (overlaps(&p, x[*first], radius, tolerance)) break;
        enter(&p, *first);
    }
    packing_free(&p);
    return status;
}
