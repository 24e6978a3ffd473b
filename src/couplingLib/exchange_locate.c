/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * exchange_locate.c - which cell of any rank holds a point.
 *
 * Own cells are asked first. A point that is in none of them goes to every rank the bounds of whose
 * cells it lies in; of several answers the smallest id counts, so that a point on a face between
 * parts is given to the same cell by all ranks that ask. What is asked are points outside the
 * caller's own part only.
 */
#include "exchange.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int within(const double bounds[6], const double x[3])
{
    for (int a = 0; a < 3; a++)
        if (!(x[a] >= bounds[a] && x[a] <= bounds[3 + a])) return 0;
    return 1;
}

static cpl_status no_memory(char *text)
{
    snprintf(text, TEXT, "no memory to find cells on other ranks");
    return CPL_NO_MEMORY;
}

/* found[p] of points in own cells, -1 elsewhere; cell and near are work space of m. */
static void locate_own(const exchange *x, const cpl_mesh *part, size_t m, const double (*point)[3],
                       int64_t *found, int *cell, double (*near)[3])
{
    const double *bounds = x->bounds[x->team.rank];
    size_t n = 0;
    for (size_t p = 0; p < m; p++)
        if (within(bounds, point[p])) memcpy(near[n++], point[p], sizeof *near);
    if (n) part->locate(part->context, n, (const double(*)[3])near, cell);
    for (size_t p = 0, i = 0; p < m; p++) {
        found[p] = -1;
        if (!within(bounds, point[p])) continue;
        if (cell[i] >= 0) found[p] = x->id[cell[i]];
        i++;
    }
}

/* One question: a point and where the answer goes. */
typedef struct question {
    double x[3];
    size_t row;
} question;

/* The points that other ranks may know, by rank. */
static int make_questions(const exchange *x, size_t m, const double (*point)[3],
                          const int64_t *found, parcel *ask)
{
    const int ranks = x->team.ranks;
    size_t n = 0;
    for (int pass = 0; pass < 2; pass++) {
        if (pass && parcel_new(&x->team, n, sizeof(question), ask)) return 1;
        n = 0;
        for (int r = 0; r < ranks; r++) {
            if (pass) ask->first[r] = n;
            if (r == x->team.rank) continue;
            for (size_t p = 0; p < m; p++) {
                if (found[p] >= 0 || !within(x->bounds[r], point[p])) continue;
                if (pass) {
                    question *q = (question *)ask->data + n;
                    memcpy(q->x, point[p], sizeof q->x);
                    q->row = p;
                }
                n++;
            }
        }
        if (pass) ask->first[ranks] = n;
    }
    return 0;
}

/* The points that others ask for, answered by ids. */
static int answer(const exchange *x, const cpl_mesh *part, const parcel *asked, int64_t **ids)
{
    const question *q = asked->data;
    double(*point)[3] = malloc(2 * asked->n * sizeof *point + 1);
    int *cell = malloc(asked->n * sizeof *cell + 1);
    *ids = malloc(asked->n * sizeof **ids + 1);
    const int failed = !point || !cell || !*ids;
    if (!failed) {
        for (size_t i = 0; i < asked->n; i++) memcpy(point[i], q[i].x, sizeof *point);
        locate_own(x, part, asked->n, (const double(*)[3])point, *ids, cell, point + asked->n);
    }
    free(point), free(cell);
    return failed;
}

cpl_status exchange_locate(exchange *x, const cpl_mesh *part, cpl_status status, size_t m,
                           const double (*point)[3], int64_t *found, char *text)
{
    parcel ask = {0}, asked = {0};
    int64_t *told = NULL, *heard = NULL;
    double(*near)[3] = malloc(m * sizeof *near + 1);
    int *cell = malloc(m * sizeof *cell + 1);
    if (!status && (!near || !cell)) status = no_memory(text);
    if (!status) {
        locate_own(x, part, m, point, found, cell, near);
        if (make_questions(x, m, point, found, &ask)) status = no_memory(text);
    }
    status = team_send(&x->team, status, text, sizeof(question), &ask, &asked);
    if (!status) {
        heard = malloc(ask.n * sizeof *heard + 1);
        if (answer(x, part, &asked, &told) || !heard) status = no_memory(text);
    }
    status = team_agree(&x->team, status, text, NULL);
    if (!status) {
        team_pass(&x->team, sizeof *told, asked.first, told, ask.first, heard);
        const question *q = ask.data;
        for (size_t i = 0; i < ask.n; i++)
            if (heard[i] >= 0 && (found[q[i].row] < 0 || heard[i] < found[q[i].row]))
                found[q[i].row] = heard[i];
    }
    free(near), free(cell), free(told), free(heard);
    parcel_free(&ask);
    parcel_free(&asked);
    return status;
}
