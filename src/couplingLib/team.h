/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * team.h - the ranks that share a map: agreement and messages, private to couplingLib.
 *
 * A rank that fails must not leave the others waiting: whoever may fail by itself asks
 * team_agree before the next message. Functions are collective.
 */
#ifndef CPL_TEAM_H
#define CPL_TEAM_H

#include "cpl.h"

enum { TEXT = 256 }; /* bytes of a message to the user */

typedef struct team {
    MPI_Comm comm;
    int rank, ranks;
    MPI_Request *request; /* [2 ranks] */
    uint64_t *count;      /* [2 ranks], of blocks to and from them */
    double seconds;       /* wall-clock in here, s */
} team;

/* `n` blocks of one size for or from the ranks: those of rank r are first[r]...first[r + 1] - 1. */
typedef struct parcel {
    size_t n;
    size_t *first; /* [ranks + 1] */
    void *data;
} parcel;

/* 0 on success; local but for the duplication of comm. */
int team_new(MPI_Comm comm, team *team);
void team_free(team *team);

/* CPL_OK if all ranks are well. Else, on all of them, the status and the text (TEXT bytes) of
 * the first rank that is not. *flag (or NULL) becomes the largest of the ranks'. */
cpl_status team_agree(team *team, cpl_status status, char *text, int *flag);

/* Blocks of `size` bytes from everyone to everyone, where both sides know how many. Cannot fail. */
void team_pass(team *team, size_t size, const size_t *out_first, const void *out,
               const size_t *in_first, void *in);
/* The same where the receiver does not know. Agreed upon; nothing is sent unless `status` is well
 * everywhere. The parcel `in` is to be freed in any case. */
cpl_status team_send(team *team, cpl_status status, char *text, size_t size, const parcel *out,
                     parcel *in);

/* Room for n blocks of `size` bytes and the places of the ranks; 0 on success. */
int parcel_new(const team *team, size_t n, size_t size, parcel *p);
void parcel_free(parcel *p);
/**
 * Fill p->first by the ranks of m blocks (negative: for nobody) and `at` [m] with the place of each
 * block in the parcel: blocks of a rank stay in their order.
 */
void parcel_sort(const team *team, size_t m, const int *rank, parcel *p, size_t *at);

#endif
