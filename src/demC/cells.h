/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * cells.h - linked cells: a grid in whose cells particles are counted and beside which pairs lie.
 *
 * One grid spans all particles of all ranks; of its planes a rank keeps those that hold something
 * of its own, and cells have three numbers each among the planes that are kept.
 *
 * Cells follow each other in tiles of CELLS_TILE x CELLS_TILE columns, within a tile with x
 * fastest and z slowest. Who walks through them in that order, and looks at the neighbours behind
 * each, has a few layers of a tile before him at a time, which the second-level cache holds however
 * wide the bed is. Tiles begin at planes of the whole grid, so that the order of two cells is the
 * same on every rank. Hockney & Eastwood, Computer Simulation Using Particles (1988) ch. 8.
 */
#ifndef DEM_CELLS_H
#define DEM_CELLS_H

#include "dem.h"

#define CELLS_TILE 12 /* cells of about 1.7 spheres in a bed: 250 in a layer of a tile */

/* Where all particles of all ranks are, and how many. */
typedef struct extent {
    double lo[3], hi[3];
    double n;
} extent;

typedef struct cells {
    int periodic[3];
    double origin[3], per_width[3];
    int planes[3]; /* of the grid in all */
    int kept[3];   /* planes that are kept here */
    int *plane[3]; /* [kept] its number among all planes */
    int *local[3]; /* [planes] its number among those kept, -1: none */
    int *tile[3];  /* [kept] the first plane, of those kept, of its tile */
    int *wide[3];  /* [kept] planes of its tile */
    int plane_capacity[3];
    size_t n; /* cells */
} cells;

void cells_free(cells *g);
/* Cells as wide as `reach`, m, or wider where particles are few, over `all` (over lo..hi in
 * periodic directions); the planes in which the n positions are, are kept. */
dem_status cells_lay(cells *g, const double lo[3], const double hi[3], const int periodic[3],
                     const extent *all, double reach, const double (*pos)[4], size_t n);
/* Of the position, which one of those for which the grid was laid. */
uint32_t cells_of(const cells *g, const double x[3]);
/* Of the cell after that in at[3], which begins as 0 0 0. */
void cells_next(const cells *g, int at[3]);
/* The cell in at[3] and its neighbours behind it; returns their number. inner: none is beyond a
 * periodic side. */
int cells_behind(const cells *g, const int at[3], uint32_t cell[27], int *inner);
/* Called for a cell; anything but zero ends the search and is returned. */
typedef int cells_visit(void *context, uint32_t cell);
/* The cells that the box from lo to hi, or an image of it, meets. */
int cells_in_box(const cells *g, const double lo[3], const double hi[3], cells_visit *visit,
                 void *context);

#endif
