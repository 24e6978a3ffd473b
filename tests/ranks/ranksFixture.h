/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * ranksFixture.h - what the tests of many ranks share: the same run on every number of ranks that
 * there are, and its particles brought together for comparison. Include after cmocka.h.
 */
#ifndef RANKS_FIXTURE_H
#define RANKS_FIXTURE_H

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dem.h"

/* One particle as its owner sees it. */
typedef struct grain {
    int64_t id;
    double state[9]; /* x, v, omega */
    double radius;
    double owner;
} grain;

/* All particles by their ids. */
typedef struct crowd {
    size_t n;
    grain *grain;
} crowd;

static inline int world_rank(void)
{
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}

static inline int world_size(void)
{
    int size;
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    return size;
}

/* A barrier at which ranks without work leave the processor to the others. */
static inline void rest_until_all(void)
{
    MPI_Request request;
    int done = 0;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    while (MPI_Test(&request, &done, MPI_STATUS_IGNORE), !done)
        nanosleep(&(struct timespec){0, 2000000}, NULL);
}

/* The first `ranks` ranks; MPI_COMM_NULL on the others. */
static inline MPI_Comm first_ranks(int ranks)
{
    MPI_Comm comm;
    MPI_Comm_split(MPI_COMM_WORLD, world_rank() < ranks ? 0 : MPI_UNDEFINED, 0, &comm);
    return comm;
}

static inline int grains_by_id(const void *a, const void *b)
{
    const int64_t x = ((const grain *)a)->id, y = ((const grain *)b)->id;
    return (x > y) - (x < y);
}

static inline void crowd_free(crowd *c)
{
    free(c->grain);
    memset(c, 0, sizeof *c);
}

/* The particles of all ranks of `comm` on its first; none on the others. */
static inline crowd gather(MPI_Comm comm, const dem_sim *sim)
{
    int rank, ranks;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    const dem_view view = dem_particles(sim);
    grain *own = malloc((view.n + 1) * sizeof *own);
    assert_non_null(own);
    for (size_t i = 0; i < view.n; i++) {
        own[i].id = view.id[i];
        memcpy(own[i].state, view.x[i], 3 * sizeof(double));
        memcpy(own[i].state + 3, view.v[i], 3 * sizeof(double));
        memcpy(own[i].state + 6, view.omega[i], 3 * sizeof(double));
        own[i].radius = view.radius[i];
        own[i].owner = rank;
    }
    const int bytes = (int)(view.n * sizeof *own);
    int *count = calloc((size_t)ranks, sizeof *count), *from = calloc((size_t)ranks, sizeof *from);
    MPI_Gather(&bytes, 1, MPI_INT, count, 1, MPI_INT, 0, comm);
    for (int r = 1; r < ranks; r++) from[r] = from[r - 1] + count[r - 1];
    crowd all = {0, NULL};
    if (rank == 0) {
        all.n = (size_t)(from[ranks - 1] + count[ranks - 1]) / sizeof *own;
        all.grain = malloc((all.n + 1) * sizeof *all.grain);
        assert_non_null(all.grain);
    }
    MPI_Gatherv(own, bytes, MPI_BYTE, all.grain, count, from, MPI_BYTE, 0, comm);
    if (all.n > 0) qsort(all.grain, all.n, sizeof *all.grain, grains_by_id);
    for (size_t k = 1; k < all.n; k++) assert_true(all.grain[k - 1].id < all.grain[k].id);
    free(count);
    free(from);
    free(own);
    return all;
}

/* The same particles, to the last bit: how many differ, and by how much at most. */
static inline size_t differences(const crowd *a, const crowd *b, double *most)
{
    size_t differ = 0;
    *most = 0;
    for (size_t k = 0; k < a->n && k < b->n; k++) {
        const grain *x = &a->grain[k], *y = &b->grain[k];
        if (x->id == y->id && memcmp(x->state, y->state, sizeof x->state) == 0) continue;
        differ++;
        for (int c = 0; c < 3; c++) *most = fmax(*most, fabs(x->state[c] - y->state[c]));
    }
    return differ + (a->n > b->n ? a->n - b->n : b->n - a->n);
}

/* Pairs that touch across a border between ranks. */
static inline size_t pairs_across(const crowd *c)
{
    size_t n = 0;
    for (size_t i = 0; i < c->n; i++)
        for (size_t j = i + 1; j < c->n; j++) {
            const grain *a = &c->grain[i], *b = &c->grain[j];
            const double d[3] = {a->state[0] - b->state[0], a->state[1] - b->state[1],
                                 a->state[2] - b->state[2]};
            const double reach = a->radius + b->radius;
            n += a->owner != b->owner && d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < reach * reach;
        }
    return n;
}

/* Particles that are with another rank than before. */
static inline size_t moved_house(const crowd *before, const crowd *now)
{
    size_t n = 0;
    for (size_t i = 0, j = 0; i < before->n && j < now->n;) {
        const int64_t a = before->grain[i].id, b = now->grain[j].id;
        n += a == b && before->grain[i].owner != now->grain[j].owner;
        i += a <= b;
        j += b <= a;
    }
    return n;
}

#endif
