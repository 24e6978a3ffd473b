/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * exchange.h - cells of other ranks, borrowed because particles of this one touch them; private to
 * couplingLib.
 *
 * A rank numbers the cells it knows: its own ones 0...own-1 in the order of its part of the mesh,
 * then the borrowed ones in the order in which they came. `place` leads from the number in the
 * whole mesh (id) to that one, through pages of ids that are made when first needed. Who owns an id
 * is kept in a directory that is itself divided among the ranks in blocks of ids.
 *
 * Where particles live has nothing to do with where their cells do: what is not known is wanted,
 * and fetched in rounds that all ranks take part in. A cell stays borrowed until all are given back
 * (exchange_clear); in the long run none need to be fetched.
 */
#ifndef CPL_EXCHANGE_H
#define CPL_EXCHANGE_H

#include "team.h"

enum { PAGE = 512, UNKNOWN = -1, WANTED = -2 };

/* Cells by the rank they are lent to or borrowed from, in the same order on both sides. */
typedef struct loan {
    size_t n;
    int *cell;     /* [n], as this rank numbers them */
    size_t *first; /* [ranks + 1] */
} loan;

typedef struct exchange {
    team team;
    int64_t total; /* cells of all ranks */
    size_t own, n, capacity;
    int64_t *id;
    int *rank; /* that owns the cell */
    double *volume, (*lo)[3], (*hi)[3];
    size_t *offset;        /* [n + 1] */
    int64_t *neighbour_id; /* [offset[n]] */
    int *neighbour;        /* likewise, negative where not known */
    size_t neighbour_capacity;
    int **page;
    int64_t block;   /* ids to a rank of the directory */
    int (*owner)[2]; /* [block], rank and number there of the ids in this rank's block */
    loan lent, borrowed;
    int64_t *want;
    size_t n_want, want_capacity;
    int want_failed;                 /* no memory for a wish */
    double (*bounds)[6];             /* [ranks], of their cells */
    double *value;                   /* [9 capacity], for cell arrays of own and borrowed */
    double *for_lent, *for_borrowed; /* messages, 9 components a cell */
} exchange;

/* Checks that the parts make a whole mesh. Collective. */
cpl_status exchange_new(MPI_Comm comm, const cpl_mesh *part, char *text, exchange **x);
void exchange_free(exchange *x);

static inline int exchange_place(const exchange *x, int64_t id)
{
    const int *page = x->page[id / PAGE];
    return page ? page[id % PAGE] : UNKNOWN;
}
/* Remember an id that is to be fetched. */
void exchange_want(exchange *x, int64_t id);
static inline int exchange_wanting(const exchange *x)
{
    return x->n_want > 0 || x->want_failed;
}
/* Enter the place of an id; 0 on success. */
int exchange_enter(exchange *x, int64_t id, int place);
/* Borrow all that is wanted by the ranks. Collective, agreed upon. */
cpl_status exchange_fetch(exchange *x, char *text);
/* Give all borrowed cells back. Collective. */
void exchange_clear(exchange *x);

/* Ids of the cells that hold m points, -1 outside: `found` [m]. The box of a divided mesh of equal
 * cells is not needed here. Collective, agreed upon. */
cpl_status exchange_locate(exchange *x, const cpl_mesh *part, cpl_status status, size_t m,
                           const double (*point)[3], int64_t *found, char *text);

/* Values [n][width], width at most 9: of the borrowed cells from their owners, or what was summed
 * for them added to their owners', in the order of the ranks. Collective, cannot fail. */
void exchange_borrow(exchange *x, int width, double *value);
void exchange_return(exchange *x, int width, double *value);

/* Room for `more` further cells with `links` neighbours in all; 0 on success. */
int exchange_reserve(exchange *x, size_t more, size_t links);

#endif
