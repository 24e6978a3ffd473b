/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * map.h - inside of the map: the sparse matrix and its work space, private to couplingLib.
 *
 * Rows of W are stored one after the other (compressed sparse rows): the entries of particle p are
 * cell[row[p] .. row[p+1]) with weight likewise. A cell may appear twice in a row (a cube wider
 * than a periodic box); sums do not mind. All arrays grow and never shrink, so that a step
 * allocates nothing once the bed has been seen.
 */
#ifndef CPL_MAP_H
#define CPL_MAP_H

#include "cpl.h"

typedef struct rows {
    size_t entries, capacity;
    int *cell;
    double *weight;
} rows;

struct cpl_map {
    cpl_mesh mesh;
    cpl_map_model model;
    double packing_limit;
    size_t n, row_capacity;
    size_t *row;    /* [n+1] */
    rows w;         /* the matrix */
    rows spare;     /* the matrix before the packing limit moved weight */
    double *volume; /* [n], of the particles */
    double *solid;  /* [cells], solid volume, m3 */
    /* Shares of a cube along the axes: `span` places each. */
    size_t span;
    int *axis_cell[3];
    double *axis_share[3];
    /* Breadth-first search: cells of the wave, and the search that last saw a cell. */
    int *wave;
    uint64_t *seen, search;
    /* Packing: transfers of the cells over the limit, as rows of the matrix T. */
    int *over;         /* [cells], number of the cell among those over the limit, or -1 */
    size_t *shift_row; /* [cells+1] */
    rows shift;
    int *centre_cell; /* [row_capacity], general meshes only */
    cpl_map_report report;
    char message[256];
};

/* Room for `more` entries beyond rows->entries; 0 on success. */
int cpl_rows_reserve(rows *r, size_t more);
/* Fill map->row and map->w by the model. */
cpl_status cpl_rows_fill(cpl_map *map, size_t n, const double (*x)[3], const double *radius);
/* map->solid from the rows. */
void cpl_map_sum_solid(cpl_map *map);
/* Move weight within the rows so that no cell holds more than its limit. */
cpl_status cpl_map_pack(cpl_map *map);

#endif
