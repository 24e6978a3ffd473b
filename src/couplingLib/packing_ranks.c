/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing_ranks.c - the packing limit on several ranks, with the result of one.
 *
 * On one rank (packing.c) cells over the limit give in the order of their numbers, each into the
 * room that those before it left. Here the order is that of the ids, and a rank decides what its
 * own cells give. What it must know of others is what their cells have given to cells that it
 * knows:
 *
 *     repeat
 *         go through the own cells over the limit and the gifts heard of, in the order of the
 *         givers' ids: decide the gifts of the former anew, take the latter as they are
 *         tell the gifts to the owners of the receiving cells, who tell those who borrow these
 *     until nobody hears anything new
 *
 * The first of all givers decides rightly at once, every other one as soon as those before it whose
 * gifts it sees have: the end is reached, and is the same for every division of cells and ranks.
 * Cells that a search for room needs are fetched as it goes on. At last those who borrow a cell
 * that gives are told where its weight goes.
 */
#include "map.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A volume (m3) or share that goes from one cell to another, by id. */
typedef struct gift {
    int64_t giver, receiver;
    double amount;
} gift;

typedef struct packing {
    size_t n_over;
    int *over;           /* [n_over], own cells over the limit, by id */
    double *solid;       /* [cells known], before anything was given */
    size_t *borrower_of; /* [own + 1], rows of `borrower`: */
    int *borrower;       /* the ranks that borrow each own cell */
    parcel heard;        /* gifts of other ranks to cells known here, in the order of the givers */
    cpl_status full;     /* whether a cell found no room */
} packing;

static cpl_status no_memory(cpl_map *map)
{
    snprintf(map->message, sizeof map->message, "no memory to move volume between cells");
    return CPL_NO_MEMORY;
}

static void free_packing(packing *k)
{
    free(k->over), free(k->solid), free(k->borrower_of), free(k->borrower);
    parcel_free(&k->heard);
}

typedef struct numbered {
    int64_t id;
    int cell;
} numbered;

static int by_id(const void *a, const void *b)
{
    const int64_t i = ((const numbered *)a)->id, j = ((const numbered *)b)->id;
    return (i > j) - (i < j);
}

static int by_giver(const void *a, const void *b)
{
    const gift *i = a, *j = b;
    if (i->giver != j->giver) return i->giver > j->giver ? 1 : -1;
    return (i->receiver > j->receiver) - (i->receiver < j->receiver);
}

static double limit_of(const cpl_map *map, size_t c)
{
    return map->packing_limit * map->mesh.volume[c];
}

/* List the own cells over the limit and give them their numbers in map->over; 0 on success. */
static int number_over(cpl_map *map, packing *k)
{
    numbered *list = malloc(map->own * sizeof *list + 1);
    if (!list) return 1;
    for (size_t c = 0; c < map->mesh.n; c++) map->over[c] = -1;
    for (size_t c = 0; c < map->own; c++)
        if (map->solid[c] > limit_of(map, c)) {
            list[k->n_over].id = map->mesh.id[c];
            list[k->n_over++].cell = (int)c;
        }
    qsort(list, k->n_over, sizeof *list, by_id);
    k->over = malloc(k->n_over * sizeof *k->over + 1);
    for (size_t i = 0; i < k->n_over && k->over; i++) {
        k->over[i] = list[i].cell;
        map->over[list[i].cell] = (int)i;
    }
    free(list);
    return !k->over;
}

/* CPL_FULL if all cells together cannot hold the solid. */
static cpl_status weigh(cpl_map *map, size_t n_over)
{
    double sum[3] = {(double)n_over, 0, 0};
    for (size_t c = 0; c < map->own; c++) {
        const double excess = map->solid[c] - limit_of(map, c);
        sum[excess > 0 ? 1 : 2] += excess > 0 ? excess : -excess;
    }
    MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPI_DOUBLE, MPI_SUM, map->exchange->team.comm);
    if (!(sum[1] > sum[2])) return CPL_OK;
    snprintf(map->message, sizeof map->message,
             "%.0f cells hold %g m3 of solid more than the packing limit %g allows, and all others "
             "have room for %g m3 only",
             sum[0], sum[1], map->packing_limit, sum[2]);
    return CPL_FULL;
}

/* What has to be known of the cells at first and when some were fetched, behind `known` of them:
 * solid volume and borrowers. */
static cpl_status survey(cpl_map *map, packing *k, size_t known)
{
    exchange *x = map->exchange;
    double *solid = realloc(k->solid, x->n * sizeof *solid + 1);
    if (solid) k->solid = solid;
    if (solid && known == 0) memcpy(solid, map->solid, x->own * sizeof *solid);
    free(k->borrower_of), free(k->borrower);
    size_t *first = k->borrower_of = calloc(x->own + 2, sizeof *first);
    k->borrower = malloc(x->lent.n * sizeof *k->borrower + 1);
    cpl_status status = solid && first && k->borrower ? CPL_OK : no_memory(map);
    status = team_agree(&x->team, status, map->message, NULL);
    if (status) return status;
    for (size_t c = known ? known : x->own; c < x->n; c++) map->over[c] = -1;
    exchange_borrow(x, 1, solid);
    for (size_t i = 0; i < x->lent.n; i++) first[x->lent.cell[i] + 2]++;
    for (size_t c = 0; c < x->own; c++) first[c + 2] += first[c + 1];
    for (int r = 0; r < x->team.ranks; r++)
        for (size_t i = x->lent.first[r]; i < x->lent.first[r + 1]; i++)
            k->borrower[first[x->lent.cell[i] + 1]++] = r;
    return CPL_OK;
}

/* Decide what the own cells give, seeing the gifts heard of. */
static cpl_status decide(cpl_map *map, packing *k)
{
    const exchange *x = map->exchange;
    const gift *heard = k->heard.data;
    memcpy(map->solid, k->solid, x->n * sizeof *map->solid);
    map->report.moved_volume = 0;
    map->shift.entries = 0;
    map->shift_row[0] = 0;
    k->full = CPL_OK;
    for (size_t i = 0, h = 0; i < k->n_over; i++) {
        const int c = k->over[i];
        for (; h < k->heard.n && heard[h].giver < x->id[c]; h++)
            map->solid[exchange_place(x, heard[h].receiver)] += heard[h].amount;
        const cpl_status status = pack_spread(map, c);
        if (status == CPL_NO_MEMORY) return status;
        if (status) k->full = status; /* may yet change with what is heard */
        map->shift_row[i + 1] = map->shift.entries;
    }
    return CPL_OK;
}

/* ---- telling --------------------------------------------------------------------------------- */

/* Gifts under way, each to a rank. */
typedef struct post {
    size_t n, capacity;
    gift *gift;
    int *rank;
} post;

static int post_add(post *p, int rank, int64_t giver, int64_t receiver, double amount)
{
    if (p->n == p->capacity) {
        const size_t m = p->capacity + p->capacity / 2 + 256;
        gift *g = realloc(p->gift, m * sizeof *g);
        if (g) p->gift = g;
        int *r = realloc(p->rank, m * sizeof *r);
        if (r) p->rank = r;
        if (!g || !r) return 1;
        p->capacity = m;
    }
    p->gift[p->n] = (gift){giver, receiver, amount};
    p->rank[p->n++] = rank;
    return 0;
}

/* Deliver a post and free it. */
static cpl_status deliver(cpl_map *map, cpl_status status, post *p, parcel *in)
{
    team *team = &map->exchange->team;
    parcel out = {0};
    size_t *at = malloc(p->n * sizeof *at + 1);
    if (!status && (!at || parcel_new(team, p->n, sizeof(gift), &out))) status = no_memory(map);
    if (!status) {
        parcel_sort(team, p->n, p->rank, &out, at);
        for (size_t i = 0; i < p->n; i++) ((gift *)out.data)[at[i]] = p->gift[i];
    }
    status = team_send(team, status, map->message, sizeof(gift), &out, in);
    free(at), free(p->gift), free(p->rank);
    memset(p, 0, sizeof *p);
    parcel_free(&out);
    return status;
}

/* A gift to the own cell d for those who borrow it, but the rank that gave. */
static int pass_on(const packing *k, int d, int from, const gift *g, post *p)
{
    int failed = 0;
    for (size_t b = k->borrower_of[d]; b < k->borrower_of[d + 1]; b++)
        if (k->borrower[b] != from)
            failed |= post_add(p, k->borrower[b], g->giver, g->receiver, g->amount);
    return failed;
}

/* Own gifts to cells of others, for their owners, and to own cells, for their borrowers. */
static int tell_own(const cpl_map *map, const packing *k, post *owners, post *borrowers)
{
    const exchange *x = map->exchange;
    int failed = 0;
    for (size_t i = 0; i < k->n_over; i++)
        for (size_t e = map->shift_row[i]; e < map->shift_row[i + 1]; e++) {
            const int d = map->shift.cell[e];
            const gift g = {x->id[k->over[i]], x->id[d], map->shift.weight[e]};
            if (d < (int)x->own)
                failed |= pass_on(k, d, x->team.rank, &g, borrowers);
            else
                failed |= post_add(owners, x->rank[d], g.giver, g.receiver, g.amount);
        }
    return failed;
}

/* Both parcels in one, in the order of the givers; 0 on success. */
static int merge(const team *team, const parcel *a, const parcel *b, parcel *sum)
{
    if (parcel_new(team, a->n + b->n, sizeof(gift), sum)) return 1;
    if (a->n) memcpy(sum->data, a->data, a->n * sizeof(gift));
    if (b->n) memcpy((gift *)sum->data + a->n, b->data, b->n * sizeof(gift));
    qsort(sum->data, sum->n, sizeof(gift), by_giver);
    return 0;
}

/* Tell and hear; *news: whether any rank hears something else than before. */
static cpl_status tell(cpl_map *map, packing *k, int *news)
{
    exchange *x = map->exchange;
    post owners = {0}, borrowers = {0};
    parcel here = {0}, there = {0}, heard = {0};
    cpl_status status = tell_own(map, k, &owners, &borrowers) ? no_memory(map) : CPL_OK;
    status = deliver(map, status, &owners, &here);
    for (int r = 0; r < x->team.ranks && !status; r++)
        for (size_t i = here.first[r]; i < here.first[r + 1]; i++) {
            const gift *g = (const gift *)here.data + i;
            if (pass_on(k, exchange_place(x, g->receiver), r, g, &borrowers))
                status = no_memory(map);
        }
    status = deliver(map, status, &borrowers, &there);
    if (!status && merge(&x->team, &here, &there, &heard)) status = no_memory(map);
    *news = !status && (heard.n != k->heard.n ||
                        (heard.n && memcmp(heard.data, k->heard.data, heard.n * sizeof(gift))));
    status = team_agree(&x->team, status, map->message, news);
    parcel_free(&here);
    parcel_free(&there);
    parcel_free(&k->heard);
    k->heard = heard;
    return status;
}

/* ---- the weights ----------------------------------------------------------------------------- */

/* From volumes to shares of what the givers hold; 0 on success. */
static int tell_shares(cpl_map *map, const packing *k, post *borrowers)
{
    const exchange *x = map->exchange;
    int failed = 0;
    for (size_t i = 0; i < k->n_over; i++) {
        const int c = k->over[i];
        for (size_t e = map->shift_row[i]; e < map->shift_row[i + 1]; e++) {
            map->shift.weight[e] /= k->solid[c];
            const gift g = {x->id[c], x->id[map->shift.cell[e]], map->shift.weight[e]};
            failed |= pass_on(k, c, x->team.rank, &g, borrowers);
        }
    }
    return failed;
}

/* Add the shares of borrowed cells to the rows of T. */
static int hear_shares(cpl_map *map, const packing *k, const parcel *in)
{
    const exchange *x = map->exchange;
    const gift *g = in->data;
    size_t over = k->n_over;
    if (cpl_rows_reserve(&map->shift, in->n)) return 1;
    for (size_t i = 0; i < in->n; i++) {
        const int c = exchange_place(x, g[i].giver);
        if (map->over[c] < 0) map->over[c] = (int)over++;
        map->shift.cell[map->shift.entries] = exchange_place(x, g[i].receiver);
        map->shift.weight[map->shift.entries++] = g[i].amount;
        map->shift_row[over] = map->shift.entries;
    }
    return 0;
}

/* Tell who borrows a giver where its weight goes; all then know the cells that it goes to. */
static cpl_status share(cpl_map *map, packing *k)
{
    exchange *x = map->exchange;
    post borrowers = {0};
    parcel in;
    cpl_status status = tell_shares(map, k, &borrowers) ? no_memory(map) : CPL_OK;
    status = deliver(map, status, &borrowers, &in);
    for (size_t i = 0; i < in.n && !status; i++)
        exchange_want(x, ((const gift *)in.data)[i].receiver);
    int wanting = exchange_wanting(x);
    status = team_agree(&x->team, status, map->message, &wanting);
    const size_t known = x->n;
    if (!status && wanting) status = map_fetch(map);
    for (size_t c = known; c < x->n; c++) map->over[c] = -1;
    if (!status && hear_shares(map, k, &in)) status = no_memory(map);
    if (!status && pack_transfer(map)) status = no_memory(map);
    parcel_free(&in);
    return team_agree(&x->team, status, map->message, NULL);
}

/* ---- all together ---------------------------------------------------------------------------- */

/* Decide and tell until nobody hears anything new. */
static cpl_status settle(cpl_map *map, packing *k)
{
    exchange *x = map->exchange;
    cpl_status status = survey(map, k, 0);
    for (int news = 1; news && !status;) {
        const size_t known = x->n;
        status = decide(map, k);
        int wanting = exchange_wanting(x);
        status = team_agree(&x->team, status, map->message, &wanting);
        if (!status && wanting) {
            status = map_fetch(map);
            if (!status) status = survey(map, k, known);
        } else if (!status) {
            status = tell(map, k, &news);
        }
    }
    return team_agree(&x->team, status ? status : k->full, map->message, NULL);
}

cpl_status map_pack_ranks(cpl_map *map)
{
    packing k = {0};
    cpl_status status = number_over(map, &k) ? no_memory(map) : CPL_OK;
    int any = k.n_over > 0;
    map->report.moved_volume = 0;
    map->report.full_cells = k.n_over;
    status = team_agree(&map->exchange->team, status, map->message, &any);
    if (!status && any) {
        status = weigh(map, k.n_over);
        if (!status) status = settle(map, &k);
        if (!status) status = share(map, &k);
        if (!status) cpl_map_sum_solid(map);
    }
    free_packing(&k);
    return status;
}
