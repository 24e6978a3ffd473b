/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * map.h - inside of the map: the sparse matrix and its work space, private to couplingLib.
 *
 * Rows of W are stored one after the other (compressed sparse rows): the entries of particle p are
 * cell[row[p] .. row[p+1]) with weight likewise. A cell may appear twice in a row (a cube wider
 * than a periodic box); sums do not mind. All arrays grow and never shrink, so that a step
 * allocates nothing once the bed has been seen.
 *
 * On several ranks the cells are the own ones, then those borrowed from other ranks (exchange.h),
 * and the rows those of the particles on this rank.
 */
#ifndef CPL_MAP_H
#define CPL_MAP_H

#include "exchange.h"

typedef struct rows {
    size_t entries, capacity;
    int *cell;
    double *weight;
} rows;

struct cpl_map {
    cpl_mesh mesh;
    size_t own;         /* cells of this rank: the first ones of the mesh */
    exchange *exchange; /* NULL on one rank */
    cpl_mesh part;      /* on several ranks: the mesh as it was given */
    size_t cell_capacity;
    unsigned builds;
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
    /* [row_capacity], general meshes only; ids on several ranks only */
    int *centre_cell;
    int64_t *centre_id;
    cpl_map_report report;
    char message[TEXT];
};

/* Room for `more` entries beyond rows->entries; 0 on success. */
int cpl_rows_reserve(rows *r, size_t more);
/* Fill map->row and map->w by the model. On several ranks cells that are not known are wanted and
 * their entries hold no place yet. */
cpl_status cpl_rows_fill(cpl_map *map, size_t n, const double (*x)[3], const double *radius);
/* Cell of a box mesh that holds x, -1 outside. */
int box_locate(const cpl_mesh *box, const double x[3]);
/* Arrays for more cells; 0 on success. */
int map_reserve_cells(cpl_map *map, size_t n);
/* map->solid from the rows. */
void cpl_map_sum_solid(cpl_map *map);
/* Move weight within the rows so that no cell holds more than its limit. */
cpl_status cpl_map_pack(cpl_map *map);
/* Its parts, packing.c: what cell c gives to those around it, as volumes at the end of map->shift;
 * W <- W T, 0 on success. */
cpl_status pack_spread(cpl_map *map, int c);
int pack_transfer(cpl_map *map);

/* The same on several ranks, all collective: map_ranks.c, packing_ranks.c. */
cpl_status map_fill_ranks(cpl_map *map, cpl_status status, size_t n, const double (*x)[3],
                          const double *radius);
cpl_status map_pack_ranks(cpl_map *map);
void map_reduce_report(cpl_map *map);
/* Make the mesh of the map that of the exchange, whose arrays may have moved. Not collective. */
void map_look(cpl_map *map);
/* Fetch the cells that are wanted, and make room for them. */
cpl_status map_fetch(cpl_map *map);

#endif
