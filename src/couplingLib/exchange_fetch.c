/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * exchange_fetch.c - borrowing cells of other ranks, and giving them back.
 *
 * In four messages: the directory is asked for the owners of what is wanted and answers; the owners
 * are told which of their cells are borrowed from now on and answer with volume, bounds and number
 * of neighbours, then with the ids of these. Every answer has as many blocks as its question, in
 * the same order. Faces are shared: a new cell finds among its neighbours those that are known, and
 * enters itself with them.
 */
#include "exchange.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What an owner says of a cell. */
typedef struct portrait {
    double volume, lo[3], hi[3];
    int64_t links;
} portrait;

typedef int owner_place[2];

static cpl_status no_memory(char *text)
{
    snprintf(text, TEXT, "no memory for cells of other ranks");
    return CPL_NO_MEMORY;
}

static int by_id(const void *a, const void *b)
{
    const int64_t i = *(const int64_t *)a, j = *(const int64_t *)b;
    return (i > j) - (i < j);
}

/* Owners and their numbers of the cells wanted, in the order of ids. */
static cpl_status ask_directory(exchange *x, cpl_status status, owner_place *owner, char *text)
{
    parcel ask = {0}, asked = {0};
    owner_place *answer = NULL;
    if (!status && parcel_new(&x->team, 0, 0, &ask)) status = no_memory(text);
    if (!status) {
        free(ask.data);
        ask.data = x->want; /* sorted by id, and so by rank of the directory */
        ask.n = x->n_want;
        for (size_t i = 0; i < ask.n; i++) ask.first[x->want[i] / x->block + 1]++;
        for (int r = 0; r < x->team.ranks; r++) ask.first[r + 1] += ask.first[r];
    }
    status = team_send(&x->team, status, text, sizeof *x->want, &ask, &asked);
    if (!status) answer = malloc(asked.n * sizeof *answer + 1);
    status = team_agree(&x->team, status || answer ? status : no_memory(text), text, NULL);
    if (!status) {
        const int64_t *id = asked.data, begin = x->block * x->team.rank;
        for (size_t i = 0; i < asked.n; i++)
            memcpy(answer[i], x->owner[id[i] - begin], sizeof *answer);
        team_pass(&x->team, sizeof *answer, asked.first, answer, ask.first, owner);
    }
    if (ask.data == x->want) ask.data = NULL;
    parcel_free(&ask);
    parcel_free(&asked);
    free(answer);
    return status;
}

/* A fetch under way. Blocks of the parcels belong together one by one, in these pairs: what is
 * asked of others with what they answer, what others ask with what is answered. */
typedef struct fetch {
    parcel ask, asked;              /* int: number of the cell at its owner */
    portrait *seen, *shown;         /* [ask.n], [asked.n] */
    parcel links_seen, links_shown; /* int64_t: ids of neighbours */
    loan lent, borrowed;            /* that will be */
    double *for_lent, *for_borrowed;
    owner_place *owner; /* [n_want] */
    int *rank;          /* likewise */
    size_t *at;         /* likewise, place among the blocks of ask */
} fetch;

static void free_fetch(fetch *f)
{
    parcel *parcel[4] = {&f->ask, &f->asked, &f->links_seen, &f->links_shown};
    for (int i = 0; i < 4; i++) parcel_free(parcel[i]);
    free(f->seen), free(f->shown), free(f->owner), free(f->rank), free(f->at);
    free(f->lent.cell), free(f->lent.first), free(f->borrowed.cell), free(f->borrowed.first);
    free(f->for_lent), free(f->for_borrowed);
}

/* Tell owners which of their cells are wanted. */
static cpl_status ask_owners(exchange *x, cpl_status status, fetch *f, char *text)
{
    if (!status && parcel_new(&x->team, x->n_want, sizeof(int), &f->ask)) status = no_memory(text);
    if (!status) {
        for (size_t i = 0; i < x->n_want; i++) f->rank[i] = f->owner[i][0];
        parcel_sort(&x->team, x->n_want, f->rank, &f->ask, f->at);
        for (size_t i = 0; i < x->n_want; i++) ((int *)f->ask.data)[f->at[i]] = f->owner[i][1];
    }
    return team_send(&x->team, status, text, sizeof(int), &f->ask, &f->asked);
}

static cpl_status show_cells(exchange *x, cpl_status status, fetch *f, char *text)
{
    if (!status) {
        f->seen = malloc(f->ask.n * sizeof *f->seen + 1);
        f->shown = malloc(f->asked.n * sizeof *f->shown + 1);
        if (!f->seen || !f->shown) status = no_memory(text);
    }
    status = team_agree(&x->team, status, text, NULL);
    if (status) return status;
    for (size_t i = 0; i < f->asked.n; i++) {
        const size_t c = (size_t)((const int *)f->asked.data)[i];
        portrait *p = &f->shown[i];
        p->volume = x->volume[c];
        p->links = (int64_t)(x->offset[c + 1] - x->offset[c]);
        memcpy(p->lo, x->lo[c], sizeof p->lo);
        memcpy(p->hi, x->hi[c], sizeof p->hi);
    }
    team_pass(&x->team, sizeof *f->shown, f->asked.first, f->shown, f->ask.first, f->seen);
    return CPL_OK;
}

/* Room for the neighbours of cells that go or come by rank. */
static int links_new(const exchange *x, const size_t *first, const portrait *cell, parcel *links)
{
    size_t sum = 0;
    for (size_t i = 0; i < first[x->team.ranks]; i++) sum += (size_t)cell[i].links;
    if (parcel_new(&x->team, sum, sizeof(int64_t), links)) return 1;
    for (int r = 0; r < x->team.ranks; r++) {
        links->first[r + 1] = links->first[r];
        for (size_t i = first[r]; i < first[r + 1]; i++)
            links->first[r + 1] += (size_t)cell[i].links;
    }
    return 0;
}

/* A loan with further cells, by rank, and its messages; 0 on success. */
static int extend(const team *team, const loan *old, const size_t *first, const int *cell,
                  loan *loan, double **message)
{
    const size_t ranks = (size_t)team->ranks;
    loan->n = old->n + first[ranks];
    loan->first = malloc((ranks + 1) * sizeof *loan->first);
    loan->cell = malloc(loan->n * sizeof *loan->cell + 1);
    *message = malloc(9 * loan->n * sizeof **message + 1);
    if (!loan->first || !loan->cell || !*message) return 1;
    loan->first[0] = 0;
    for (size_t r = 0; r < ranks; r++) {
        int *at = loan->cell + loan->first[r];
        const size_t before = old->first[r + 1] - old->first[r], more = first[r + 1] - first[r];
        if (before) memcpy(at, old->cell + old->first[r], before * sizeof *at);
        if (more) memcpy(at + before, cell + first[r], more * sizeof *at);
        loan->first[r + 1] = loan->first[r] + before + more;
    }
    return 0;
}

/* All the memory that the new cells take. */
static int prepare(exchange *x, fetch *f)
{
    if (links_new(x, f->ask.first, f->seen, &f->links_seen) ||
        links_new(x, f->asked.first, f->shown, &f->links_shown) ||
        exchange_reserve(x, f->ask.n, f->links_seen.n))
        return 1;
    int *fresh = f->ask.data; /* has been sent: now the numbers of the cells here */
    for (size_t i = 0; i < f->ask.n; i++) fresh[i] = (int)(x->n + i);
    return extend(&x->team, &x->lent, f->asked.first, f->asked.data, &f->lent, &f->for_lent) ||
           extend(&x->team, &x->borrowed, f->ask.first, fresh, &f->borrowed, &f->for_borrowed);
}

static void show_links(exchange *x, fetch *f)
{
    int64_t *to = f->links_shown.data;
    for (size_t i = 0; i < f->asked.n; i++) {
        const size_t c = (size_t)((const int *)f->asked.data)[i];
        memcpy(to, x->neighbour_id + x->offset[c], (size_t)f->shown[i].links * sizeof *to);
        to += f->shown[i].links;
    }
    team_pass(&x->team, sizeof *to, f->links_shown.first, f->links_shown.data, f->links_seen.first,
              f->links_seen.data);
}

/* Neighbours of the new cell c that are known, and c as a neighbour of theirs. */
static void join(exchange *x, size_t c)
{
    for (size_t k = x->offset[c]; k < x->offset[c + 1]; k++) {
        const int d = x->neighbour[k] = exchange_place(x, x->neighbour_id[k]);
        if (d < 0) continue;
        for (size_t j = x->offset[d]; j < x->offset[d + 1]; j++)
            if (x->neighbour_id[j] == x->id[c]) x->neighbour[j] = (int)c;
    }
}

static void take(exchange *x, fetch *f)
{
    const size_t old = x->n;
    for (size_t i = 0; i < x->n_want; i++) {
        x->id[old + f->at[i]] = x->want[i];
        x->rank[old + f->at[i]] = f->rank[i];
        exchange_enter(x, x->want[i], (int)(old + f->at[i])); /* its page is there */
    }
    for (size_t i = 0; i < f->ask.n; i++) {
        const size_t c = old + i;
        x->volume[c] = f->seen[i].volume;
        memcpy(x->lo[c], f->seen[i].lo, sizeof *x->lo);
        memcpy(x->hi[c], f->seen[i].hi, sizeof *x->hi);
        x->offset[c + 1] = x->offset[c] + (size_t)f->seen[i].links;
    }
    x->n = old + f->ask.n;
    if (f->links_seen.n)
        memcpy(x->neighbour_id + x->offset[old], f->links_seen.data,
               f->links_seen.n * sizeof *x->neighbour_id);
    for (size_t c = old; c < x->n; c++) join(x, c);
    /* the old ones go with f */
    const loan lent = x->lent, borrowed = x->borrowed;
    double *for_lent = x->for_lent, *for_borrowed = x->for_borrowed;
    x->lent = f->lent, x->borrowed = f->borrowed;
    x->for_lent = f->for_lent, x->for_borrowed = f->for_borrowed;
    f->lent = lent, f->borrowed = borrowed;
    f->for_lent = for_lent, f->for_borrowed = for_borrowed;
}

cpl_status exchange_fetch(exchange *x, char *text)
{
    fetch f;
    memset(&f, 0, sizeof f);
    if (x->n_want) qsort(x->want, x->n_want, sizeof *x->want, by_id);
    f.owner = malloc(x->n_want * sizeof *f.owner + 1);
    f.rank = malloc(x->n_want * sizeof *f.rank + 1);
    f.at = malloc(x->n_want * sizeof *f.at + 1);
    const int short_of_memory = x->want_failed || !f.owner || !f.rank || !f.at;
    cpl_status status = short_of_memory ? no_memory(text) : CPL_OK;
    x->want_failed = 0;
    status = ask_directory(x, status, f.owner, text);
    status = ask_owners(x, status, &f, text);
    status = show_cells(x, status, &f, text);
    if (!status && prepare(x, &f)) status = no_memory(text);
    status = team_agree(&x->team, status, text, NULL);
    if (!status) {
        show_links(x, &f);
        take(x, &f);
    } else {
        for (size_t i = 0; i < x->n_want; i++) exchange_enter(x, x->want[i], UNKNOWN);
    }
    x->n_want = 0;
    free_fetch(&f);
    return status;
}

void exchange_clear(exchange *x)
{
    const size_t ranks = (size_t)x->team.ranks;
    for (size_t c = x->own; c < x->n; c++) exchange_enter(x, x->id[c], UNKNOWN);
    for (size_t k = 0; k < x->offset[x->own]; k++)
        if (x->neighbour[k] >= (int)x->own) x->neighbour[k] = UNKNOWN;
    x->n = x->own;
    x->lent.n = x->borrowed.n = 0;
    memset(x->lent.first, 0, (ranks + 1) * sizeof *x->lent.first);
    memset(x->borrowed.first, 0, (ranks + 1) * sizeof *x->borrowed.first);
}
