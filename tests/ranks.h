/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * ranks.h - comparison of a simulation that is divided among ranks with one that is not: every
 * particle, to the last bit. Include after cmocka.h.
 */
#ifndef RANKS_H
#define RANKS_H

#include <mpi.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "dem.h"

typedef struct ranked {
    int64_t id, material;
    double x[3], v[3], omega[3], radius, mass;
} ranked;

static inline int ranked_by_id(const void *left, const void *right)
{
    const ranked *a = left, *b = right;
    return (a->id > b->id) - (a->id < b->id);
}

/* The particles of all ranks of `comm`, sorted by id, on every rank; to be freed. */
static inline ranked *ranked_all(const dem_sim *sim, MPI_Comm comm, size_t *n)
{
    const dem_view view = dem_particles(sim);
    int ranks, bytes = (int)(view.n * sizeof(ranked)), sum = 0;
    MPI_Comm_size(comm, &ranks);
    int *count = calloc((size_t)ranks, sizeof *count),
        *first = calloc((size_t)ranks, sizeof *first);
    MPI_Allgather(&bytes, 1, MPI_INT, count, 1, MPI_INT, comm);
    for (int r = 0; r < ranks; sum += count[r++]) first[r] = sum;
    ranked *own = calloc(view.n + 1, sizeof *own), *all = malloc((size_t)sum + 1);
    for (size_t i = 0; i < view.n; i++) {
        own[i].id = view.id[i];
        own[i].material = view.material[i];
        own[i].radius = view.radius[i];
        own[i].mass = view.mass[i];
        memcpy(own[i].x, view.x[i], sizeof own->x);
        memcpy(own[i].v, view.v[i], sizeof own->v);
        memcpy(own[i].omega, view.omega[i], sizeof own->omega);
    }
    MPI_Allgatherv(own, bytes, MPI_BYTE, all, count, first, MPI_BYTE, comm);
    *n = (size_t)sum / sizeof *all;
    if (*n) qsort(all, *n, sizeof *all, ranked_by_id);
    free(own);
    free(count);
    free(first);
    return all;
}

/* Both have the same particles in the same state; how many. */
static inline size_t assert_same_particles(const dem_sim *divided, MPI_Comm comm,
                                           const dem_sim *alone)
{
    size_t n, m;
    ranked *a = ranked_all(divided, comm, &n), *b = ranked_all(alone, MPI_COMM_SELF, &m);
    assert_int_equal(n, m);
    for (size_t i = 0; i < n; i++) {
        if (memcmp(&a[i], &b[i], sizeof *a) == 0) continue;
        fail_msg("particle %lld at (%.17g %.17g %.17g) m, %lld at (%.17g %.17g %.17g) on one rank",
                 (long long)a[i].id, a[i].x[0], a[i].x[1], a[i].x[2], (long long)b[i].id, b[i].x[0],
                 b[i].x[1], b[i].x[2]);
    }
    free(a);
    free(b);
    return n;
}

#endif
