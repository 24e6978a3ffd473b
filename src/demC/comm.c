/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * comm.c - what the ranks of a simulation tell each other: agreement, sums, blocks of bytes.
 *
 * Counts go first, all to all, then the blocks, point to point and only between ranks that have
 * something for each other. Messages are cut so that none has more than MOST bytes: MPI counts in
 * ints.
 */
#include "comm.h"

#include "dem_internal.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 1 << 30, TAG = 1 };

dem_status agree(dem_sim *sim, dem_status status)
{
    if (sim->ranks == 1) return status;
    /* The first that fails: by its rank, and not to be mixed up with none. */
    int first = status ? sim->rank : sim->ranks, all;
    MPI_Allreduce(&first, &all, 1, MPI_INT, MPI_MIN, sim->comm);
    if (all == sim->ranks) return DEM_OK;
    int code = status;
    MPI_Bcast(&code, 1, MPI_INT, all, sim->comm);
    MPI_Bcast(sim->message, sizeof sim->message, MPI_CHAR, all, sim->comm);
    return (dem_status)code;
}

void sum_reals(const dem_sim *sim, double *x, int n)
{
    if (sim->ranks > 1) MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_DOUBLE, MPI_SUM, sim->comm);
}

void sum_counts(const dem_sim *sim, int64_t *x, int n)
{
    if (sim->ranks > 1) MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_INT64_T, MPI_SUM, sim->comm);
}

void max_reals(const dem_sim *sim, double *x, int n)
{
    if (sim->ranks > 1) MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_DOUBLE, MPI_MAX, sim->comm);
}

void min_reals(const dem_sim *sim, double *x, int n)
{
    if (sim->ranks > 1) MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_DOUBLE, MPI_MIN, sim->comm);
}

void max_counts(const dem_sim *sim, int64_t *x, int n)
{
    if (sim->ranks > 1) MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_INT64_T, MPI_MAX, sim->comm);
}

int64_t sum_before(const dem_sim *sim, int64_t count)
{
    int64_t before = 0;
    if (sim->ranks > 1) MPI_Exscan(&count, &before, 1, MPI_INT64_T, MPI_SUM, sim->comm);
    return sim->rank ? before : 0;
}

size_t counts_to_first(size_t *first, int ranks)
{
    size_t sum = 0;
    for (int r = 0; r < ranks; r++) {
        const size_t count = first[r];
        first[r] = sum;
        sum += count;
    }
    return first[ranks] = sum;
}

void parcel_free(parcel *p)
{
    free(p->first);
    free(p->data);
    memset(p, 0, sizeof *p);
}

dem_status order_by_rank(dem_sim *sim, size_t n, const int *rank, size_t **first, size_t **place)
{
    *first = calloc((size_t)sim->ranks + 2, sizeof **first);
    *place = malloc((n + 1) * sizeof **place);
    if (!*first || !*place) return no_memory(sim);
    size_t *next = *first + 1; /* runs from the begin of a rank to its end */
    for (size_t k = 0; k < n; k++) next[rank[k]]++;
    counts_to_first(next, sim->ranks);
    for (size_t k = 0; k < n; k++) (*place)[k] = next[rank[k]]++;
    return DEM_OK;
}

/* Requests for `bytes` bytes to or from the rank r. */
static int post(const dem_sim *sim, int r, char *data, size_t bytes, int sends,
                MPI_Request *request)
{
    int n = 0;
    for (size_t at = 0; at < bytes; at += MOST) {
        const int part = (int)(bytes - at < MOST ? bytes - at : MOST);
        if (sends)
            MPI_Isend(data + at, part, MPI_BYTE, r, TAG, sim->comm, &request[n++]);
        else
            MPI_Irecv(data + at, part, MPI_BYTE, r, TAG, sim->comm, &request[n++]);
    }
    return n;
}

static void copy_own(const dem_sim *sim, const size_t *first, const void *data, size_t size,
                     const parcel *in)
{
    const size_t bytes = (first[sim->rank + 1] - first[sim->rank]) * size;
    if (bytes)
        memcpy((char *)in->data + in->first[sim->rank] * size,
               (const char *)data + first[sim->rank] * size, bytes);
}

static void exchange(const dem_sim *sim, const size_t *first, const void *data, size_t size,
                     const parcel *in, MPI_Request *request)
{
    int n = 0;
    for (int k = 1; k < sim->ranks; k++) {
        const int r = (sim->rank + sim->ranks - k) % sim->ranks;
        n += post(sim, r, (char *)in->data + in->first[r] * size,
                  (in->first[r + 1] - in->first[r]) * size, 0, request + n);
    }
    for (int k = 1; k < sim->ranks; k++) {
        const int r = (sim->rank + k) % sim->ranks;
        /* Sent, not written to. */
        n += post(sim, r, (char *)(uintptr_t)data + first[r] * size,
                  (first[r + 1] - first[r]) * size, 1, request + n);
    }
    copy_own(sim, first, data, size, in);
    MPI_Waitall(n, request, MPI_STATUSES_IGNORE);
}

dem_status send_blocks(dem_sim *sim, dem_status status, const size_t *first, const void *data,
                       size_t size, parcel *in)
{
    const size_t ranks = (size_t)sim->ranks;
    memset(in, 0, sizeof *in);
    uint64_t *out_count = calloc(2 * ranks, sizeof *out_count), *count = out_count + ranks;
    in->first = calloc(ranks + 1, sizeof *in->first);
    if (!status && (!out_count || !in->first)) status = no_memory(sim);
    status = agree(sim, status);
    if (!status) {
        size_t requests = 0;
        for (size_t r = 0; r < ranks; r++) out_count[r] = first[r + 1] - first[r];
        MPI_Alltoall(out_count, 1, MPI_UINT64_T, count, 1, MPI_UINT64_T, sim->comm);
        for (size_t r = 0; r < ranks; r++) {
            in->first[r] = count[r];
            requests +=
                (out_count[r] * size + MOST - 1) / MOST + (count[r] * size + MOST - 1) / MOST;
        }
        in->n = counts_to_first(in->first, sim->ranks);
        MPI_Request *request = malloc((requests + 1) * sizeof *request);
        in->data = malloc(in->n * size + 1);
        status = agree(sim, in->data && request ? DEM_OK : no_memory(sim));
        if (!status) exchange(sim, first, data, size, in, request);
        free(request);
    }
    free(out_count);
    return status;
}

dem_status share_blocks(dem_sim *sim, dem_status status, size_t n, const void *data, size_t size,
                        parcel *in)
{
    memset(in, 0, sizeof *in);
    const int ranks = sim->ranks;
    uint64_t own = n, *count = malloc(((size_t)ranks + 1) * sizeof *count);
    in->first = calloc((size_t)ranks + 1, sizeof *in->first);
    if (!status && (!count || !in->first)) status = no_memory(sim);
    status = agree(sim, status);
    if (!status) {
        MPI_Allgather(&own, 1, MPI_UINT64_T, count, 1, MPI_UINT64_T, sim->comm);
        for (int r = 0; r < ranks; r++) in->first[r] = count[r];
        in->n = counts_to_first(in->first, ranks);
        in->data = malloc(in->n * size + 1);
        status = agree(sim, in->data ? DEM_OK : no_memory(sim));
    }
    if (!status && n) memcpy((char *)in->data + in->first[sim->rank] * size, data, n * size);
    for (int r = 0; r < ranks && !status && ranks > 1; r++) {
        const size_t bytes = (in->first[r + 1] - in->first[r]) * size;
        char *at = (char *)in->data + in->first[r] * size;
        for (size_t k = 0; k < bytes; k += MOST)
            MPI_Bcast(at + k, (int)(bytes - k < MOST ? bytes - k : MOST), MPI_BYTE, r, sim->comm);
    }
    free(count);
    return status;
}
