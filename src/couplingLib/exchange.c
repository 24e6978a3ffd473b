/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * exchange.c - cells of other ranks: life cycle, places of ids, values to and fro.
 *
 * Layout: exchange.h. The directory is filled once: every rank tells the ranks of the directory
 * which ids it owns, and these find what is owned twice or by nobody.
 */
#include "exchange.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDEST = 9 };

/* ---- places ---------------------------------------------------------------------------------- */

int exchange_enter(exchange *x, int64_t id, int place)
{
    int **page = &x->page[id / PAGE];
    if (!*page) {
        *page = malloc(PAGE * sizeof **page);
        if (!*page) return 1;
        for (int i = 0; i < PAGE; i++) (*page)[i] = UNKNOWN;
    }
    (*page)[id % PAGE] = place;
    return 0;
}

void exchange_want(exchange *x, int64_t id)
{
    if (exchange_place(x, id) != UNKNOWN) return;
    if (x->n_want == x->want_capacity) {
        const size_t capacity = x->want_capacity + x->want_capacity / 2 + 256;
        int64_t *want = realloc(x->want, capacity * sizeof *want);
        if (!want) {
            x->want_failed = 1;
            return;
        }
        x->want = want;
        x->want_capacity = capacity;
    }
    if (exchange_enter(x, id, WANTED))
        x->want_failed = 1;
    else
        x->want[x->n_want++] = id;
}

static int grow(void *array, size_t bytes)
{
    void **a = array, *grown = realloc(*a, bytes);
    if (grown) *a = grown;
    return !grown;
}

int exchange_reserve(exchange *x, size_t more, size_t links)
{
    const size_t n = x->n + more, linked = (x->offset ? x->offset[x->n] : 0) + links;
    if (!x->offset || n > x->capacity) {
        const size_t m = n + n / 8 + 256;
        if (grow(&x->id, m * sizeof *x->id) || grow(&x->rank, m * sizeof *x->rank) ||
            grow(&x->volume, m * sizeof *x->volume) || grow(&x->lo, m * sizeof *x->lo) ||
            grow(&x->hi, m * sizeof *x->hi) || grow(&x->value, WIDEST * m * sizeof *x->value) ||
            grow(&x->offset, (m + 1) * sizeof *x->offset))
            return 1;
        if (x->capacity == 0) x->offset[0] = 0;
        x->capacity = m;
    }
    if (!x->neighbour || linked > x->neighbour_capacity) {
        const size_t m = linked + linked / 8 + 1024;
        if (grow(&x->neighbour_id, m * sizeof *x->neighbour_id) ||
            grow(&x->neighbour, m * sizeof *x->neighbour))
            return 1;
        x->neighbour_capacity = m;
    }
    return 0;
}

/* ---- life cycle ------------------------------------------------------------------------------ */

static cpl_status no_memory(const exchange *x, char *text)
{
    snprintf(text, TEXT, "no memory for the %zu cells of rank %d", x->own, x->team.rank);
    return CPL_NO_MEMORY;
}

static int exists(const exchange *x, int64_t id)
{
    return id >= 0 && id < x->total;
}

/* Whether the ids of this rank and of its neighbours exist. */
static cpl_status check_ids(const exchange *x, const cpl_mesh *part, char *text)
{
    if (x->own && (!part->id || !part->neighbour_id || !part->volume || !part->lo || !part->hi ||
                   !part->offset)) {
        snprintf(text, TEXT,
                 "rank %d: a part of a mesh needs ids, ids of neighbours, volumes and bounds",
                 x->team.rank);
        return CPL_BAD_ARGUMENT;
    }
    for (size_t c = 0; c < x->own; c++) {
        int64_t id = part->id[c];
        for (size_t k = part->offset[c]; k < part->offset[c + 1] && exists(x, id); k++)
            id = part->neighbour_id[k];
        if (exists(x, id)) continue;
        snprintf(text, TEXT,
                 "rank %d: cell %zu or a neighbour of it has the id %lld, the mesh has %lld cells",
                 x->team.rank, c, (long long)id, (long long)x->total);
        return CPL_BAD_ARGUMENT;
    }
    return CPL_OK;
}

static int copy_part(exchange *x, const cpl_mesh *part)
{
    const size_t n = x->own, links = n ? part->offset[n] : 0;
    const size_t pages = (size_t)(x->total / PAGE) + 1;
    x->page = calloc(pages, sizeof *x->page);
    x->owner = malloc((size_t)x->block * sizeof *x->owner);
    x->bounds = malloc((size_t)x->team.ranks * sizeof *x->bounds);
    if (!x->page || !x->owner || !x->bounds || exchange_reserve(x, n, links)) return 1;
    if (n) {
        memcpy(x->id, part->id, n * sizeof *x->id);
        memcpy(x->volume, part->volume, n * sizeof *x->volume);
        memcpy(x->lo, part->lo, n * sizeof *x->lo);
        memcpy(x->hi, part->hi, n * sizeof *x->hi);
        memcpy(x->offset, part->offset, (n + 1) * sizeof *x->offset);
        memcpy(x->neighbour_id, part->neighbour_id, links * sizeof *x->neighbour_id);
    }
    x->n = n;
    for (size_t c = 0; c < n; c++) {
        x->rank[c] = x->team.rank;
        if (exchange_enter(x, x->id[c], (int)c)) return 1;
    }
    for (size_t k = 0; k < links; k++) x->neighbour[k] = exchange_place(x, x->neighbour_id[k]);
    return 0;
}

/* Enter into the directory what the ranks own; a cell with two owners is an error. */
static cpl_status enter_owners(exchange *x, const parcel *in, char *text)
{
    for (int64_t i = 0; i < x->block; i++) x->owner[i][0] = -1;
    for (int r = 0; r < x->team.ranks; r++)
        for (size_t k = in->first[r]; k < in->first[r + 1]; k++) {
            const int64_t *pair = (const int64_t *)in->data + 2 * k;
            int *owner = x->owner[pair[0] - x->block * x->team.rank];
            if (owner[0] >= 0) {
                snprintf(text, TEXT, "the cell with id %lld is on the ranks %d and %d",
                         (long long)pair[0], owner[0], r);
                return CPL_BAD_ARGUMENT;
            }
            owner[0] = r;
            owner[1] = (int)pair[1];
        }
    return CPL_OK; /* as many ids as cells, none twice: none is missing */
}

static cpl_status make_directory(exchange *x, cpl_status status, char *text)
{
    parcel out = {0}, in = {0};
    int *rank = malloc(x->own * sizeof *rank + 1);
    size_t *at = malloc(x->own * sizeof *at + 1);
    if (!status && (!rank || !at || parcel_new(&x->team, x->own, 2 * sizeof(int64_t), &out)))
        status = no_memory(x, text);
    if (!status) {
        for (size_t c = 0; c < x->own; c++) rank[c] = (int)(x->id[c] / x->block);
        parcel_sort(&x->team, x->own, rank, &out, at);
        for (size_t c = 0; c < x->own; c++) {
            int64_t *pair = (int64_t *)out.data + 2 * at[c];
            pair[0] = x->id[c], pair[1] = (int64_t)c;
        }
    }
    status = team_send(&x->team, status, text, 2 * sizeof(int64_t), &out, &in);
    if (!status) status = enter_owners(x, &in, text);
    free(rank), free(at);
    parcel_free(&out);
    parcel_free(&in);
    return team_agree(&x->team, status, text, NULL);
}

/* Bounds of the cells of all ranks, a little wide for points on a face. */
static void share_bounds(exchange *x)
{
    static const double wide = 1e-6;
    double b[6] = {HUGE_VAL, HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t c = 0; c < x->own; c++)
        for (int a = 0; a < 3; a++) {
            const double w = wide * (x->hi[c][a] - x->lo[c][a]);
            b[a] = fmin(b[a], x->lo[c][a] - w);
            b[3 + a] = fmax(b[3 + a], x->hi[c][a] + w);
        }
    MPI_Allgather(b, 6, MPI_DOUBLE, x->bounds, 6, MPI_DOUBLE, x->team.comm);
}

cpl_status exchange_new(MPI_Comm comm, const cpl_mesh *part, char *text, exchange **result)
{
    exchange *x = *result = calloc(1, sizeof *x);
    cpl_status status = CPL_OK;
    /* Without the object there is no communicator of its own to tell the others. */
    int lacking = !x, any;
    MPI_Allreduce(&lacking, &any, 1, MPI_INT, MPI_MAX, comm);
    if (any) {
        snprintf(text, TEXT, "no memory for the exchange between ranks");
        free(x);
        *result = NULL;
        return CPL_NO_MEMORY;
    }
    x->own = part->n;
    const int alone = team_new(comm, &x->team);
    const size_t ranks = (size_t)x->team.ranks;
    x->lent.first = calloc(ranks + 1, sizeof *x->lent.first);
    x->borrowed.first = calloc(ranks + 1, sizeof *x->borrowed.first);
    if (alone || !x->lent.first || !x->borrowed.first) status = no_memory(x, text);
    status = team_agree(&x->team, status, text, NULL);
    if (status) return status;
    const int64_t own = (int64_t)x->own;
    MPI_Allreduce(&own, &x->total, 1, MPI_INT64_T, MPI_SUM, x->team.comm);
    x->block = x->total / x->team.ranks + 1;
    status = check_ids(x, part, text);
    if (!status && copy_part(x, part)) status = no_memory(x, text);
    status = make_directory(x, status, text);
    if (!status) share_bounds(x);
    return status;
}

void exchange_free(exchange *x)
{
    if (!x) return;
    const size_t pages = (size_t)(x->total / PAGE) + 1;
    if (x->page)
        for (size_t i = 0; i < pages; i++) free(x->page[i]);
    free(x->page), free(x->owner), free(x->bounds), free(x->want);
    free(x->id), free(x->rank), free(x->volume), free(x->lo), free(x->hi), free(x->value);
    free(x->offset), free(x->neighbour_id), free(x->neighbour);
    free(x->lent.cell), free(x->lent.first), free(x->borrowed.cell), free(x->borrowed.first);
    free(x->for_lent), free(x->for_borrowed);
    team_free(&x->team);
    free(x);
}

/* ---- values ---------------------------------------------------------------------------------- */

void exchange_borrow(exchange *x, int width, double *value)
{
    const size_t w = (size_t)width, size = w * sizeof *value;
    const loan *lent = &x->lent, *borrowed = &x->borrowed;
    for (size_t i = 0; i < lent->n; i++)
        memcpy(x->for_lent + i * w, value + (size_t)lent->cell[i] * w, size);
    team_pass(&x->team, size, lent->first, x->for_lent, borrowed->first, x->for_borrowed);
    for (size_t i = 0; i < borrowed->n; i++)
        memcpy(value + (size_t)borrowed->cell[i] * w, x->for_borrowed + i * w, size);
}

void exchange_return(exchange *x, int width, double *value)
{
    const size_t w = (size_t)width, size = w * sizeof *value;
    const loan *lent = &x->lent, *borrowed = &x->borrowed;
    for (size_t i = 0; i < borrowed->n; i++)
        memcpy(x->for_borrowed + i * w, value + (size_t)borrowed->cell[i] * w, size);
    team_pass(&x->team, size, borrowed->first, x->for_borrowed, lent->first, x->for_lent);
    for (size_t i = 0; i < lent->n; i++)
        for (size_t k = 0; k < w; k++)
            value[(size_t)lent->cell[i] * w + k] += x->for_lent[i * w + k];
}
