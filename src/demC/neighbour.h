/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * neighbour.h - the Verlet list of pairs that may touch before the next rebuild.
 *
 * A half list in compressed rows: row i holds the partners j > i with |x_i - x_j| < r_i + r_j +
 * skin. Particles are sorted by (cell, id), so that partners lie near each other in memory and so
 * that the order of the list, and with it the order in which forces are summed, depends on
 * positions and ids alone, never on the order in which particles came in. The list holds until
 * some particle has moved by skin/2.
 *
 * Sizes within a factor of two share one grid of cells; else the grids of levels.h find the pairs,
 * so that the cost of a rebuild is linear in the number of particles whatever their sizes.
 *
 * In periodic directions an entry also names the image of j: positions are wrapped only when the
 * list is built, so the shift is a constant of the entry. Refused: a periodic box shorter than
 * twice the range, where a pair could touch twice.
 *
 * Several ranks. The grid is one for all of them, and rows are in the order of (cell, id) over a
 * rank's own particles and its ghosts, so that the pairs a particle is in come in the same order
 * whatever the number of ranks. Row r then is that of particle slot[r]: a rank's own particles are
 * in front, its ghosts behind them. Pairs of two ghosts are left out. Of the grid a rank keeps the
 * planes of cells that hold something of its own.
 */
#ifndef DEM_NEIGHBOUR_H
#define DEM_NEIGHBOUR_H

#include "cells.h"
#include "particles.h"

#define NEIGHBOUR_BITS  27 /* of an entry for the index of j; the other 5 for one of 27 images */
#define NEIGHBOUR_MASK  ((UINT32_C(1) << NEIGHBOUR_BITS) - 1)
#define NEIGHBOUR_SPARE 64 /* zero entries behind the last row, for those who look ahead */
#define NEIGHBOUR_HOME  13 /* the image of j that is j itself */

typedef struct neighbour {
    double lo[3], hi[3];
    int periodic[3], any_periodic;
    double shift[27][4]; /* what to add to x_j, m */

    double skin;  /* m */
    double moved; /* no particle has moved farther than this since the build, m */
    int valid;

    cells grid;
    size_t cell_capacity;
    uint32_t *cell_first; /* [grid.n + 1] rows */

    uint32_t *cell, *order, *place; /* [capacity]: cell of a particle; sorting and its inverse */
    size_t n_row;
    size_t *row; /* [n_row + 1] */
    size_t row_capacity;
    int shared;              /* there are several ranks */
    uint32_t *slot, *row_of; /* particle of a row, row of a particle; NULL on one rank: the same */
    double (*sorted)[4];     /* [n_row] positions in the order of the rows; several ranks */
    uint8_t *own;            /* [n_row] the particle is no ghost; several ranks */
    uint32_t *entry;         /* [row[n]] */
    size_t entry_capacity;
    uint32_t (*pair)[2]; /* of particles of many sizes, before they are put into rows */
    size_t pair_capacity;
    int ascending; /* the entries of a row are sorted by j */
    size_t checks; /* distances computed for the list */
} neighbour;

void neighbour_init(neighbour *list, const double lo[3], const double hi[3], const int periodic[3],
                    int shared);
void neighbour_free(neighbour *list);
/* Bring positions into the box in periodic directions. */
void neighbour_wrap(const neighbour *list, particles *p);
/* Of this rank's own particles. */
extent neighbour_extent(const particles *p);
/* Sort particles, wrapped, by (cell, id), ghosts apart; list->place[old] is then the new index. */
dem_status neighbour_sort(neighbour *list, particles *p, const extent *all, double range);
/* Fill the rows for sorted particles; uneven: their radii differ by more than a factor of two, and
 * the range of the sort may be less than the largest of a pair. */
dem_status neighbour_fill(neighbour *list, particles *p, int uneven);
/* Row of a particle. */
static inline uint32_t neighbour_row(const neighbour *list, uint32_t i)
{
    return list->row_of ? list->row_of[i] : i;
}
/* Particle of a row. */
static inline uint32_t neighbour_slot(const neighbour *list, uint32_t row)
{
    return list->slot ? list->slot[row] : row;
}
/* The place among the entries of the pair of the particles i and j, i with the lower row; the end
 * of that row if it is not in the list. */
size_t neighbour_find(const neighbour *list, uint32_t i, uint32_t j);
/* Called for a particle; anything but zero ends the search and is returned. */
typedef int neighbour_visit(void *context, uint32_t i);
/* This rank's particles in the box from lo to hi, m, or an image of it, and some around it; all of
 * them when there is no valid list. */
int neighbour_near(const neighbour *list, const particles *p, const double lo[3],
                   const double hi[3], neighbour_visit *visit, void *context);
/* How far the particle of this rank that moved most is from where the list found it, m. */
double neighbour_displacement(const particles *p);

#endif
