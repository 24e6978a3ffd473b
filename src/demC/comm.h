/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * comm.h - what the ranks of a simulation tell each other: agreement, sums, blocks of bytes.
 *
 * Everything here is collective over sim->comm and does nothing on one rank. A rank that fails must
 * not leave the others waiting: whoever may fail locally asks agree() before the next exchange.
 */
#ifndef DEM_COMM_H
#define DEM_COMM_H

#include "dem.h"

/* DEM_OK if all ranks are well. Else, on all of them, the status and the message of the first rank
 * that is not. */
dem_status agree(dem_sim *sim, dem_status status);

/* In place; n numbers. Sums of reals differ in rounding with the number of ranks: for reports only,
 * never for what decides the motion. */
void sum_reals(const dem_sim *sim, double *x, int n);
void sum_counts(const dem_sim *sim, int64_t *x, int n);
void max_reals(const dem_sim *sim, double *x, int n);
void min_reals(const dem_sim *sim, double *x, int n);
void max_counts(const dem_sim *sim, int64_t *x, int n);
/* Of n things in a row the rank r has those from slice(n, r, ranks) to slice(n, r + 1, ranks). */
static inline size_t slice(size_t n, int r, int ranks)
{
    return n * (size_t)r / (size_t)ranks;
}
/* How much the ranks before this one have of it. */
int64_t sum_before(const dem_sim *sim, int64_t count);

/* What came from other ranks, in the order of the ranks. */
typedef struct parcel {
    size_t n;      /* blocks */
    size_t *first; /* [ranks + 1] blocks of the rank r: first[r]...first[r + 1] - 1 */
    void *data;    /* [n] blocks */
} parcel;

/* To every rank r the blocks first[r]...first[r + 1] - 1 of `data`, `size` bytes each. `status` is
 * that of the caller so far: nothing is sent unless all are well. The result is agreed upon; the
 * parcel is to be freed in any case. */
dem_status send_blocks(dem_sim *sim, dem_status status, const size_t *first, const void *data,
                       size_t size, parcel *in);
/* The same n blocks to all ranks. */
dem_status share_blocks(dem_sim *sim, dem_status status, size_t n, const void *data, size_t size,
                        parcel *in);
void parcel_free(parcel *p);
/* Where n blocks lie when they are in the order of the ranks they go to: block k at (*place)[k],
 * and *first as send_blocks wants it; both to be freed, in error too. Not collective. */
dem_status order_by_rank(dem_sim *sim, size_t n, const int *rank, size_t **first, size_t **place);
/* From counts[r] to first[r], in place; first has ranks + 1 places. */
size_t counts_to_first(size_t *first, int ranks);

#endif
