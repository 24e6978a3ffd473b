/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * team.c - the ranks that share a map: agreement and messages.
 *
 * Messages are point to point and only between ranks that have something for each other; how many
 * blocks come from whom is told all to all where it is not known. A block is a type of its own, so
 * that the number of blocks, not of bytes, has to fit into an int.
 */
#include "team.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TAG = 11 };

int team_new(MPI_Comm comm, team *team)
{
    MPI_Comm_dup(comm, &team->comm);
    MPI_Comm_rank(team->comm, &team->rank);
    MPI_Comm_size(team->comm, &team->ranks);
    team->request = malloc(2 * (size_t)team->ranks * sizeof *team->request);
    team->count = malloc(2 * (size_t)team->ranks * sizeof *team->count);
    team->seconds = 0;
    return !team->request || !team->count;
}

void team_free(team *team)
{
    free(team->request), free(team->count);
    MPI_Comm_free(&team->comm);
}

cpl_status team_agree(team *team, cpl_status status, char *text, int *flag)
{
    const double start = MPI_Wtime();
    /* The largest is that of the first rank that fails. */
    int mine[2] = {status ? team->ranks - team->rank : 0, flag ? *flag : 0}, all[2];
    MPI_Allreduce(mine, all, 2, MPI_INT, MPI_MAX, team->comm);
    if (flag) *flag = all[1];
    if (all[0]) {
        int code = status;
        const int first = team->ranks - all[0];
        MPI_Bcast(&code, 1, MPI_INT, first, team->comm);
        MPI_Bcast(text, TEXT, MPI_CHAR, first, team->comm);
        status = (cpl_status)code;
    }
    team->seconds += MPI_Wtime() - start;
    return status;
}

void team_pass(team *team, size_t size, const size_t *out_first, const void *out,
               const size_t *in_first, void *in)
{
    const double start = MPI_Wtime();
    const int me = team->rank, ranks = team->ranks;
    MPI_Datatype block;
    MPI_Type_contiguous((int)size, MPI_BYTE, &block);
    MPI_Type_commit(&block);
    int n = 0;
    for (int k = 1; k < ranks; k++) {
        const int r = (me + ranks - k) % ranks;
        const int count = (int)(in_first[r + 1] - in_first[r]);
        if (count)
            MPI_Irecv((char *)in + in_first[r] * size, count, block, r, TAG, team->comm,
                      &team->request[n++]);
    }
    for (int k = 1; k < ranks; k++) {
        const int r = (me + k) % ranks;
        const int count = (int)(out_first[r + 1] - out_first[r]);
        if (count)
            MPI_Isend((const char *)out + out_first[r] * size, count, block, r, TAG, team->comm,
                      &team->request[n++]);
    }
    const size_t own = out_first[me + 1] - out_first[me];
    if (own)
        memcpy((char *)in + in_first[me] * size, (const char *)out + out_first[me] * size,
               own * size);
    MPI_Waitall(n, team->request, MPI_STATUSES_IGNORE);
    MPI_Type_free(&block);
    team->seconds += MPI_Wtime() - start;
}

static size_t counts_to_first(const team *team, const uint64_t *count, size_t *first)
{
    first[0] = 0;
    for (int r = 0; r < team->ranks; r++) first[r + 1] = first[r] + (size_t)count[r];
    return first[team->ranks];
}

static cpl_status no_memory(char *text)
{
    snprintf(text, TEXT, "no memory for messages between ranks");
    return CPL_NO_MEMORY;
}

/* Tell everyone how many blocks to expect, or that this rank is not well: whether all are. */
static int tell_counts(team *team, int well, const parcel *out, uint64_t *mine, uint64_t *theirs)
{
    const double start = MPI_Wtime();
    const size_t ranks = (size_t)team->ranks;
    for (size_t r = 0; r < ranks; r++)
        mine[r] = well ? out->first[r + 1] - out->first[r] : UINT64_MAX;
    MPI_Alltoall(mine, 1, MPI_UINT64_T, theirs, 1, MPI_UINT64_T, team->comm);
    for (size_t r = 0; r < ranks; r++) well = well && theirs[r] != UINT64_MAX;
    team->seconds += MPI_Wtime() - start;
    return well;
}

cpl_status team_send(team *team, cpl_status status, char *text, size_t size, const parcel *out,
                     parcel *in)
{
    memset(in, 0, sizeof *in);
    in->first = calloc((size_t)team->ranks + 1, sizeof *in->first);
    if (!status && !in->first) status = no_memory(text);
    const int well = tell_counts(team, !status, out, team->count, team->count + team->ranks);
    if (well) {
        in->n = counts_to_first(team, team->count + team->ranks, in->first);
        in->data = malloc(in->n * size + 1);
        if (!in->data) status = no_memory(text);
    }
    status = team_agree(team, status, text, NULL);
    if (!status) team_pass(team, size, out->first, out->data, in->first, in->data);
    return status;
}

int parcel_new(const team *team, size_t n, size_t size, parcel *p)
{
    p->n = n;
    p->first = calloc((size_t)team->ranks + 1, sizeof *p->first);
    p->data = malloc(n * size + 1);
    return !p->first || !p->data;
}

void parcel_free(parcel *p)
{
    free(p->first);
    free(p->data);
    memset(p, 0, sizeof *p);
}

void parcel_sort(const team *team, size_t m, const int *rank, parcel *p, size_t *at)
{
    size_t *first = p->first;
    memset(first, 0, ((size_t)team->ranks + 1) * sizeof *first);
    for (size_t i = 0; i < m; i++)
        if (rank[i] >= 0) first[rank[i] + 1]++;
    for (int r = 0; r < team->ranks; r++) first[r + 1] += first[r];
    p->n = first[team->ranks];
    /* first[r] serves as the next free place of rank r, and is then the end of it. */
    for (size_t i = 0; i < m; i++)
        if (rank[i] >= 0) at[i] = first[rank[i]]++;
    for (int r = team->ranks; r > 0; r--) first[r] = first[r - 1];
    first[0] = 0;
}
