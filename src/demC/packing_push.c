/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing_push.c - spheres that overlap are pushed apart.
 *
 * Sweep after sweep, every overlapping pair is moved apart along its line of centres by the
 * overlap, and every sphere off the bounds, in the manner of Jodrey & Tory, Phys. Rev. A 32 (1985)
 * 2347, doi:10.1103/PhysRevA.32.2347. Below the random close packing of about .64 the overlaps of a
 * random configuration relax to zero. A sweep aims at a diameter larger by MARGIN, so that the end
 * is reached in finitely many. Of two spheres pushed apart each moves by the volume share of the
 * other, equal ones by halves.
 *
 * Space is cut in blocks of some PER_BLOCK spheres, which lie side by side in memory. Within a
 * block pairs are moved one after the other, each from where the one before left them. A partner in
 * another block is taken to be where it was when the sweep began; both blocks see the pair and move
 * each its own. So blocks are independent of each other within a sweep, a block stays in the cache,
 * and ranks have blocks of their own: which, does not change a bit of the result. After a sweep
 * they tell each other where the partners of others are; before the lists of pairs are made anew,
 * when a sphere has moved half its reserve, where all are.
 */
#include "packing.h"

#include "dem_internal.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* It ends as jammed when MOST_SWEEPS did not do, or STALL sweeps did not improve the largest
 * overlap nor lessen the sum of overlaps by a twentieth. Dense packings (.60) need some hundred
 * sweeps. */
enum { MOST_SWEEPS = 20000, STALL = 500 };
enum { PER_BLOCK = 1000 };
static const double MARGIN = 1e-3; /* of the diameter: three thousandths of the solid fraction */
static const double RESERVE =
    .3; /* of the median diameter: reach of the pair list beyond contact */
static const double QUANTUM = 1. / (1 << 30); /* overlaps are summed in whole numbers of it */

typedef struct pusher {
    const packing_room *room;
    dem_sim *sim; /* whose ranks share the work, or NULL */
    int rank, ranks;
    size_t n, all;            /* new spheres, new and fixed */
    double (*x)[3], *r;       /* [all], sorted by block */
    double (*begin)[3];       /* [all], when the sweep began */
    double (*origin)[3];      /* [n], when the pair list was made */
    uint32_t *order;          /* [n], place of the caller's that a sphere has */
    uint32_t *block;          /* [n] that it is in */
    size_t *rank_first;       /* [ranks + 1] spheres of a rank */
    size_t first, end;        /* of this one */
    double smallest, largest; /* radii, m */
    double reserve;           /* m */
    grid grid;                /* over the domain */
    size_t *offset, *middle;  /* [end - first + 1] pairs of a sphere: partners of its block,
                                 behind `middle` others */
    uint32_t *partner;
    size_t capacity;
    uint32_t *needed, *asked; /* spheres of other ranks, of this one for others */
    size_t n_needed, n_asked;
    size_t *ask_first; /* [ranks + 1] in `asked`, by the rank it goes to */
} pusher;

static dem_status out_of_memory(const pusher *p)
{
    return p->sim ? no_memory(p->sim) : DEM_NO_MEMORY;
}

static dem_status agreed(const pusher *p, dem_status status)
{
    return p->sim ? agree(p->sim, status) : status;
}

/* ---- blocks ---------------------------------------------------------------------------------- */

/* The block that each of the caller's spheres is in; how many there are. */
static size_t find_blocks(const pusher *p, double (*const x)[3], uint32_t *block)
{
    const packing_room *room = p->room;
    double volume = 1, per_m[3];
    size_t count[3];
    for (int k = 0; k < 3; k++) volume *= room->high[k] - room->low[k];
    const double side = cbrt(volume * PER_BLOCK / (double)p->n);
    for (int k = 0; k < 3; k++) {
        const double length = room->high[k] - room->low[k];
        count[k] = (size_t)fmax(1, rint(length / side));
        per_m[k] = (double)count[k] / length;
    }
    for (size_t i = 0; i < p->n; i++) {
        size_t at[3];
        for (int k = 0; k < 3; k++) {
            const double t = (x[i][k] - room->low[k]) * per_m[k];
            at[k] = t > 0 ? (size_t)fmin(t, (double)count[k] - 1) : 0;
        }
        block[i] = (uint32_t)((at[2] * count[1] + at[1]) * count[0] + at[0]);
    }
    return count[0] * count[1] * count[2];
}

/* Sort the caller's spheres by block, in a block as they are, and give every rank whole blocks. */
static dem_status sort_by_block(pusher *p, double (*const x)[3], const double *r)
{
    uint32_t *block = malloc((p->n + 1) * sizeof *block);
    const size_t n_block = block ? find_blocks(p, x, block) : 0;
    size_t *first = calloc(n_block + 2, sizeof *first);
    const int well = block && first;
    for (size_t i = 0; i < p->n && well; i++) first[block[i] + 1]++;
    for (size_t b = 0; b < n_block && well; b++) first[b + 1] += first[b];
    for (int rank = 0; rank <= p->ranks && well; rank++) {
        size_t b = 0;
        while (b < n_block && first[b] < slice(p->n, rank, p->ranks)) b++;
        p->rank_first[rank] = first[b];
    }
    for (size_t i = 0; i < p->n && well; i++) {
        const size_t to = first[block[i]]++;
        memcpy(p->x[to], x[i], sizeof *p->x);
        p->r[to] = r[i];
        p->block[to] = block[i];
        p->order[to] = (uint32_t)i;
    }
    memcpy(p->x + p->n, x + p->n, (p->all - p->n) * sizeof *p->x);
    memcpy(p->r + p->n, r + p->n, (p->all - p->n) * sizeof *p->r);
    memcpy(p->begin, p->x, p->all * sizeof *p->x);
    p->first = p->rank_first[p->rank];
    p->end = p->rank_first[p->rank + 1];
    free(block);
    free(first);
    return well ? DEM_OK : out_of_memory(p);
}

static double median_radius(const pusher *p)
{
    double *r = malloc(p->n * sizeof *r);
    if (!r) return -1;
    memcpy(r, p->r, p->n * sizeof *r);
    const double median = gsl_stats_median(r, 1, p->n);
    free(r);
    return median;
}

static dem_status start(pusher *p, double (*const x)[3], const double *r)
{
    p->x = malloc(p->all * sizeof *p->x);
    p->r = malloc(p->all * sizeof *p->r);
    p->begin = malloc(p->all * sizeof *p->begin);
    p->origin = malloc(p->n * sizeof *p->origin);
    p->order = malloc(p->n * sizeof *p->order);
    p->block = malloc(p->n * sizeof *p->block);
    p->rank_first = malloc(((size_t)p->ranks + 1) * sizeof *p->rank_first);
    p->ask_first = calloc((size_t)p->ranks + 1, sizeof *p->ask_first);
    if (!p->x || !p->r || !p->begin || !p->origin || !p->order || !p->block || !p->rank_first ||
        !p->ask_first || sort_by_block(p, x, r))
        return out_of_memory(p);
    p->offset = malloc((p->end - p->first + 1) * sizeof *p->offset);
    p->middle = malloc((p->end - p->first + 1) * sizeof *p->middle);
    const double median = median_radius(p);
    if (!p->offset || !p->middle || median < 0) return out_of_memory(p);
    for (size_t i = 0; i < p->all; i++) {
        p->smallest = i ? fmin(p->smallest, p->r[i]) : p->r[i];
        p->largest = fmax(p->largest, p->r[i]);
    }
    p->reserve = RESERVE * 2. * median;
    const packing_room *room = p->room;
    if (grid_init(&p->grid, room->lo, room->hi, room->periodic, p->smallest, p->largest, p->all,
                  p->reserve) ||
        grid_reserve(&p->grid, p->all, (const double(*)[3])p->x, p->r))
        return out_of_memory(p);
    return DEM_OK;
}

static void finish(pusher *p)
{
    free(p->x), free(p->r), free(p->begin), free(p->origin), free(p->order), free(p->block);
    free(p->rank_first), free(p->ask_first), free(p->offset), free(p->middle), free(p->partner);
    free(p->needed), free(p->asked);
    grid_free(&p->grid);
}

/* ---- among the ranks ------------------------------------------------------------------------- */

/* Where all spheres are, to all; into the cells. */
static dem_status share_all(pusher *p)
{
    if (p->ranks > 1) {
        parcel in;
        const dem_status status =
            share_blocks(p->sim, DEM_OK, p->end - p->first, p->x + p->first, sizeof *p->x, &in);
        if (!status) memcpy(p->x, in.data, p->n * sizeof *p->x);
        parcel_free(&in);
        if (status) return status;
    }
    grid_clear(&p->grid);
    for (size_t i = p->all; i-- > 0;) grid_enter(&p->grid, i);
    return DEM_OK;
}

static int ascending(const void *left, const void *right)
{
    const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
    return (a > b) - (a < b);
}

/* The partners that belong to other ranks, each once, in ascending order: that of the ranks. */
static dem_status find_needed(pusher *p)
{
    const size_t own = p->end - p->first;
    size_t n = 0, kept = 0;
    for (size_t i = 0; i < own; i++)
        for (size_t c = p->middle[i]; c < p->offset[i + 1]; c++)
            n += p->partner[c] < p->n && (p->partner[c] < p->first || p->partner[c] >= p->end);
    uint32_t *needed = realloc(p->needed, (n + 1) * sizeof *needed);
    if (!needed) return out_of_memory(p);
    p->needed = needed;
    n = 0;
    for (size_t i = 0; i < own; i++)
        for (size_t c = p->middle[i]; c < p->offset[i + 1]; c++) {
            const uint32_t j = p->partner[c];
            if (j < p->n && (j < p->first || j >= p->end)) needed[n++] = j;
        }
    if (n) qsort(needed, n, sizeof *needed, ascending);
    for (size_t k = 0; k < n; k++)
        if (!kept || needed[k] != needed[kept - 1]) needed[kept++] = needed[k];
    p->n_needed = kept;
    return DEM_OK;
}

/* Ask their ranks for them. */
static dem_status ask(pusher *p, dem_status status)
{
    if (p->ranks == 1) return status;
    if (!status) status = find_needed(p);
    size_t k = 0;
    for (int rank = 0; rank < p->ranks && !status; rank++) {
        p->ask_first[rank] = k;
        while (k < p->n_needed && p->needed[k] < p->rank_first[rank + 1]) k++;
    }
    p->ask_first[p->ranks] = k;
    parcel in;
    status = send_blocks(p->sim, status, p->ask_first, p->needed, sizeof *p->needed, &in);
    if (!status) {
        free(p->asked);
        p->asked = in.data;
        p->n_asked = in.n;
        memcpy(p->ask_first, in.first, ((size_t)p->ranks + 1) * sizeof *in.first);
        in.data = NULL;
    }
    parcel_free(&in);
    return status;
}

/* Where the partners are when a sweep begins. */
static dem_status look(pusher *p)
{
    memcpy(p->begin + p->first, p->x + p->first, (p->end - p->first) * sizeof *p->x);
    if (p->ranks == 1) return DEM_OK;
    parcel in = {0};
    double(*out)[3] = malloc((p->n_asked + 1) * sizeof *out);
    for (size_t k = 0; k < p->n_asked && out; k++) memcpy(out[k], p->x[p->asked[k]], sizeof *out);
    const dem_status status =
        send_blocks(p->sim, out ? DEM_OK : out_of_memory(p), p->ask_first, out, sizeof *out, &in);
    const double(*x)[3] = in.data;
    for (size_t k = 0; k < in.n && !status; k++) memcpy(p->begin[p->needed[k]], x[k], sizeof *x);
    parcel_free(&in);
    free(out);
    return status;
}

/* ---- pairs ----------------------------------------------------------------------------------- */

/* As packing_separation(); most are near without looking for an image. */
static inline void separation(const packing_room *room, const double a[3], const double b[3],
                              double d[3])
{
    for (int k = 0; k < 3; k++) {
        d[k] = b[k] - a[k];
        if (!room->periodic[k]) continue;
        const double length = room->hi[k] - room->lo[k];
        if (fabs(d[k]) > .5 * length) d[k] -= length * rint(d[k] / length);
    }
}

typedef struct listing {
    pusher *p;
    size_t i, count;            /* sphere, pairs so far */
    uint32_t *outer;            /* of it in other blocks, */
    size_t n_outer, room_outer; /* to be appended */
} listing;

static int keep(uint32_t **list, size_t n, size_t *room, uint32_t j)
{
    if (n == *room) {
        const size_t more = 2 * *room + 256;
        uint32_t *grown = realloc(*list, more * sizeof *grown);
        if (!grown) return -1;
        *list = grown;
        *room = more;
    }
    (*list)[n] = j;
    return 0;
}

static int list_partner(void *context, int other)
{
    listing *l = context;
    pusher *p = l->p;
    const uint32_t j = (uint32_t)other;
    const int same = j < p->n && p->block[j] == p->block[l->i];
    if (same && j <= l->i) return 0;
    double d[3];
    separation(p->room, p->x[l->i], p->x[j], d);
    const double far = p->r[l->i] + p->r[j] + p->reserve;
    if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > far * far) return 0;
    return same ? keep(&p->partner, l->count++, &p->capacity, j)
                : keep(&l->outer, l->n_outer++, &l->room_outer, j);
}

static dem_status make_list(pusher *p)
{
    dem_status status = share_all(p);
    if (status) return status;
    listing l = {.p = p};
    int bad = 0;
    for (l.i = p->first; l.i < p->end && !bad; l.i++) {
        p->offset[l.i - p->first] = l.count;
        l.n_outer = 0;
        bad = grid_search(&p->grid, p->x[l.i], p->r[l.i], list_partner, &l);
        p->middle[l.i - p->first] = l.count;
        for (size_t k = 0; k < l.n_outer && !bad; k++)
            bad = keep(&p->partner, l.count++, &p->capacity, l.outer[k]);
        memcpy(p->origin[l.i], p->x[l.i], sizeof *p->x);
    }
    p->offset[p->end - p->first] = l.count;
    free(l.outer);
    return ask(p, bad ? out_of_memory(p) : DEM_OK);
}

/* ---- sweeps ---------------------------------------------------------------------------------- */

/* What a sweep found before it moved the spheres. */
typedef struct sweep_result {
    double largest; /* overlap / distance of touching, of all pairs */
    double moved;   /* largest displacement since the pair list was made, m */
    int64_t sum;    /* of overlaps, in quanta */
} sweep_result;

/* How far to bring sphere i from j, at y, to `1 + MARGIN` of touching: `d`, in lengths of the
 * vector from i to j; 0 when they are far enough. */
static inline double push_of(const pusher *p, const double x[3], double ri, const double y[3],
                             double rj, double d[3], sweep_result *result)
{
    separation(p->room, x, y, d);
    const double touch = ri + rj, wanted = touch * (1. + MARGIN);
    const double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (d2 >= wanted * wanted) return 0.;
    const double distance = sqrt(d2), overlap = fmax(0., 1. - distance / touch);
    if (distance == 0.) d[0] = 1.; /* coincident centres part along x */
    result->largest = fmax(result->largest, overlap);
    result->sum += (int64_t)(overlap / QUANTUM);
    return distance > 0. ? (wanted - distance) / distance : wanted;
}

/* The part of the way that falls to i: the volume share of j. */
static inline double share_of(double ri, double rj)
{
    const double vi = ri * ri * ri, vj = rj * rj * rj;
    return ri == rj ? .5 : vj / (vi + vj);
}

static void push_sphere(pusher *p, size_t i, sweep_result *result)
{
    const size_t row = i - p->first;
    const double ri = p->r[i];
    double *x = p->x[i], d[3];
    for (size_t c = p->offset[row]; c < p->middle[row]; c++) {
        const uint32_t j = p->partner[c];
        const double push = push_of(p, x, ri, p->x[j], p->r[j], d, result);
        if (push == 0.) continue;
        const double mine = share_of(ri, p->r[j]);
        for (int k = 0; k < 3; k++) {
            x[k] -= mine * push * d[k];
            p->x[j][k] += (1. - mine) * push * d[k];
        }
    }
    for (size_t c = p->middle[row]; c < p->offset[row + 1]; c++) {
        const uint32_t j = p->partner[c];
        const double push = push_of(p, x, ri, p->begin[j], p->r[j], d, result);
        if (push == 0.) continue;
        const double mine = j < p->n ? share_of(ri, p->r[j]) : 1.;
        for (int k = 0; k < 3; k++) x[k] -= mine * push * d[k];
    }
}

static void sweep(pusher *p, sweep_result *result)
{
    *result = (sweep_result){0};
    for (size_t i = p->first; i < p->end; i++) push_sphere(p, i, result);
    for (size_t i = p->first; i < p->end; i++) {
        double d[3];
        packing_inside(p->room, p->r[i], p->x[i]);
        separation(p->room, p->origin[i], p->x[i], d);
        result->moved = fmax(result->moved, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    result->moved = sqrt(result->moved);
    if (!p->sim) return;
    double most[2] = {result->largest, result->moved};
    max_reals(p->sim, most, 2);
    sum_counts(p->sim, &result->sum, 1);
    result->largest = most[0];
    result->moved = most[1];
}

typedef struct looking {
    const pusher *p;
    size_t i;
} looking;

static int is_touching(void *context, int j)
{
    const looking *l = context;
    const pusher *p = l->p;
    double d[3];
    if ((size_t)j == l->i) return 0;
    separation(p->room, p->x[l->i], p->x[j], d);
    const double apart = (p->r[l->i] + p->r[j]) * (1. - packing_apart);
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < apart * apart;
}

/* Whether all spheres are within the room and clear of each other. */
static dem_status check_clear(pusher *p, int *clear)
{
    const dem_status status = share_all(p);
    int64_t bad = 0;
    for (size_t i = p->first; i < p->end && !bad && !status; i++) {
        looking l = {p, i};
        bad = packing_clearance(p->room, p->x[i]) < p->r[i] ||
              grid_search(&p->grid, p->x[i], p->r[i], is_touching, &l);
    }
    if (p->sim && !status) sum_counts(p->sim, &bad, 1);
    *clear = !bad && !status;
    return status;
}

static dem_status relax(pusher *p, int *clear, double *overlap)
{
    dem_status status = DEM_OK;
    double moved = INFINITY, best = INFINITY, best_sum = INFINITY;
    int stalled = 0;
    for (int n = 0; n < MOST_SWEEPS && stalled < STALL; n++) {
        /* Spheres that come from beyond the list must not touch before it is made anew. */
        if (moved > .5 * (p->reserve - MARGIN * 2. * p->largest)) status = make_list(p);
        if (!status) status = look(p);
        if (status) return status;
        sweep_result now;
        sweep(p, &now);
        moved = now.moved;
        *overlap = now.largest;
        if (now.largest == 0.) status = check_clear(p, clear);
        if (status || *clear) return status;
        const double sum = (double)now.sum;
        stalled = now.largest < .95 * best || sum < .95 * best_sum ? 0 : stalled + 1;
        if (stalled == 0) {
            best = fmin(best, now.largest);
            best_sum = fmin(best_sum, sum);
        }
    }
    return share_all(p);
}

dem_status packing_push(const packing_room *room, size_t n, size_t all, double (*x)[3],
                        const double *r, dem_sim *sim, int *clear, double *overlap)
{
    pusher p = {.room = room,
                .sim = sim,
                .rank = sim ? sim->rank : 0,
                .ranks = sim ? sim->ranks : 1,
                .n = n,
                .all = all};
    *clear = 0;
    dem_status status = agreed(&p, start(&p, x, r));
    if (!status) status = relax(&p, clear, overlap);
    for (size_t i = 0; i < n && !status; i++) memcpy(x[p.order[i]], p.x[i], sizeof *x);
    finish(&p);
    return status;
}
