/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * rows.c - the models of the void fraction: how the rows of W are filled.
 *
 * Centre: the whole particle in the cell of its centre. Divided cube (DPVM): the cube of edge d
 * around the particle is cut by the cells, and the share of a cell is
 *
 *     W_pc = prod_a l_a / d,     l_a: length of the edge along axis a that lies within the cell,
 *
 * cut at the boundary of the mesh and divided by the sum, so that rows sum to 1. A share changes
 * continuously when the particle moves through a face.
 *
 * On a box of equal cells the three axes separate: shares are made and normalised for each axis
 * and multiplied. On any other mesh the cells around the centre are searched breadth first through
 * faces; a cell takes part as long as its bounding box cuts the cube, with the volume of the cut
 * times the fraction of its bounding box that the cell fills (1 for bricks aligned with the axes).
 *
 * On several ranks a row may name cells that this rank does not know yet: they are wanted, and
 * map_ranks.c has the rows completed when they have come.
 *
 * References: Y. Mori, doctoral thesis, University of Tokyo (2021), eq. (22)-(23); H. Khawaja et
 * al., J. Comput. Multiphase Flows 4 (2012) 183, doi:10.1260/1757-482X.4.2.183.
 */
#include "map.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static cpl_status outside(cpl_map *map, size_t p, const double x[3])
{
    char rank[32] = "";
    if (map->exchange) snprintf(rank, sizeof rank, " of rank %d", map->exchange->team.rank);
    snprintf(map->message, sizeof map->message,
             "particle in row %zu%s at (%g %g %g) m is in no cell of the mesh", p, rank, x[0], x[1],
             x[2]);
    return CPL_OUTSIDE;
}

static cpl_status no_memory(cpl_map *map)
{
    snprintf(map->message, sizeof map->message, "no memory for the rows of the map");
    return CPL_NO_MEMORY;
}

int cpl_rows_reserve(rows *r, size_t more)
{
    if (r->entries + more <= r->capacity) return 0;
    const size_t capacity = r->entries + more + r->capacity / 2 + 1024;
    int *cell = realloc(r->cell, capacity * sizeof *cell);
    if (cell) r->cell = cell;
    double *weight = realloc(r->weight, capacity * sizeof *weight);
    if (weight) r->weight = weight;
    if (!cell || !weight) return 1;
    r->capacity = capacity;
    return 0;
}

/* Largest whole number not above s; s is within the range of int. (floor() is a function call on
 * plain x86-64.) */
static inline int whole(double s)
{
    const int i = (int)s;
    return i - (s < i);
}

/**
 * Shares along one axis of a box mesh, in units of the cell width: the cube covers [s - r, s + r].
 * Returns their number, 0 when the centre s is outside.
 */
static inline int axis_shares(double s, double r, int cells, int periodic, int *index,
                              double *share)
{
    if (periodic) {
        if (!(s >= 0 && s < cells)) s -= cells * floor(s / cells);
    }
    if (!(s >= 0 && s <= cells)) return 0; /* written so that a NaN is outside */
    double a = s - r, b = s + r;
    if (!periodic) {
        if (a < 0) a = 0;
        if (b > cells) b = cells;
    }
    const int first = whole(a), last = whole(b);
    const double scale = 1 / (b - a);
    int count = 0;
    for (int i = first; i <= last; i++) {
        const double length = (b < i + 1 ? b : i + 1) - (a > i ? a : i);
        if (!(length > 0)) continue;
        int j = i;
        if (periodic) {
            while (j < 0) j += cells;
            while (j >= cells) j -= cells;
        }
        index[count] = j;
        share[count++] = length * scale;
    }
    return count;
}

/* Room for the widest cube along each axis. */
static int reserve_axes(cpl_map *map, size_t n, const double *radius)
{
    double widest = 0;
    for (size_t p = 0; p < n; p++) widest = radius[p] > widest ? radius[p] : widest;
    size_t span = 0;
    for (int a = 0; a < 3; a++) {
        const double reach = 2 * widest / map->mesh.spacing[a];
        const double most = map->mesh.periodic[a] ? reach : fmin(reach, map->mesh.cells[a]);
        if (most > 1e6) return 1;
        if ((size_t)most + 3 > span) span = (size_t)most + 3;
    }
    if (span <= map->span) return 0;
    for (int a = 0; a < 3; a++) {
        free(map->axis_cell[a]), free(map->axis_share[a]);
        map->axis_cell[a] = malloc(span * sizeof(int));
        map->axis_share[a] = malloc(span * sizeof(double));
        if (!map->axis_cell[a] || !map->axis_share[a]) {
            map->span = 0;
            return 1;
        }
    }
    map->span = span;
    return 0;
}

/* From numbers in the whole box to places. A cell that is not known yet is wanted and stands as
 * ~number. */
static inline void place_entries(exchange *x, size_t n, int *cell)
{
    for (size_t e = 0; e < n; e++) {
        const int place = exchange_place(x, cell[e]);
        if (place < 0) exchange_want(x, cell[e]);
        cell[e] = place < 0 ? ~cell[e] : place;
    }
}

static cpl_status fill_box(cpl_map *map, size_t n, const double (*x)[3], const double *radius)
{
    const cpl_mesh *mesh = &map->mesh;
    const int nx = mesh->cells[0], nxy = mesh->cells[0] * mesh->cells[1];
    rows *w = &map->w;
    if (reserve_axes(map, n, radius)) return no_memory(map);
    const double per[3] = {1 / mesh->spacing[0], 1 / mesh->spacing[1], 1 / mesh->spacing[2]};
    for (size_t p = 0; p < n; p++) {
        int count[3];
        for (int a = 0; a < 3; a++) {
            const double s = (x[p][a] - mesh->origin[a]) * per[a];
            count[a] = axis_shares(s, radius[p] * per[a], mesh->cells[a], mesh->periodic[a],
                                   map->axis_cell[a], map->axis_share[a]);
            if (count[a] == 0) return outside(map, p, x[p]);
        }
        if (cpl_rows_reserve(w, (size_t)count[0] * count[1] * count[2])) return no_memory(map);
        size_t e = w->entries;
        for (int k = 0; k < count[2]; k++)
            for (int j = 0; j < count[1]; j++) {
                const int base = nx * map->axis_cell[1][j] + nxy * map->axis_cell[2][k];
                const double share = map->axis_share[1][j] * map->axis_share[2][k];
                for (int i = 0; i < count[0]; i++, e++) {
                    w->cell[e] = base + map->axis_cell[0][i];
                    w->weight[e] = share * map->axis_share[0][i];
                }
            }
        if (map->exchange) place_entries(map->exchange, e - w->entries, w->cell + w->entries);
        w->entries = e;
        map->row[p + 1] = e;
    }
    return CPL_OK;
}

/* Volume of the cube [lo, hi] that cell c takes, m3. */
static double cut(const cpl_mesh *mesh, int c, const double lo[3], const double hi[3])
{
    double volume = mesh->volume[c];
    for (int a = 0; a < 3; a++) {
        const double l = fmin(hi[a], mesh->hi[c][a]) - fmax(lo[a], mesh->lo[c][a]);
        if (!(l > 0)) return 0;
        volume *= l / (mesh->hi[c][a] - mesh->lo[c][a]);
    }
    return volume;
}

/* The row of one particle on a general mesh, by a search from the cell of its centre. */
static int search_row(cpl_map *map, int start, const double x[3], double radius)
{
    const cpl_mesh *mesh = &map->mesh;
    rows *w = &map->w;
    const size_t first = w->entries;
    double lo[3], hi[3], total = 0;
    for (int a = 0; a < 3; a++) lo[a] = x[a] - radius, hi[a] = x[a] + radius;
    const uint64_t search = ++map->search;
    size_t head = 0, tail = 0;
    map->wave[tail++] = start;
    map->seen[start] = search;
    while (head < tail) {
        const int c = map->wave[head++];
        const double share = cut(mesh, c, lo, hi);
        if (!(share > 0)) continue;
        if (cpl_rows_reserve(w, 1)) return 1;
        w->cell[w->entries] = c;
        w->weight[w->entries++] = share;
        total += share;
        for (size_t k = mesh->offset[c]; k < mesh->offset[c + 1]; k++) {
            const int d = mesh->neighbour[k];
            if (d < 0) { /* a cell of another rank, which may have a share */
                exchange_want(map->exchange, mesh->neighbour_id[k]);
                continue;
            }
            if (map->seen[d] == search) continue;
            map->seen[d] = search;
            map->wave[tail++] = d;
        }
    }
    if (w->entries == first) { /* bounds that do not hold the centre: the cell takes it all */
        if (cpl_rows_reserve(w, 1)) return 1;
        w->cell[w->entries] = start;
        w->weight[w->entries++] = total = 1;
    }
    for (size_t e = first; e < w->entries; e++) w->weight[e] /= total;
    return 0;
}

/* Cells of the centres in map->centre_cell, -1 outside. On several ranks map->centre_id has the
 * ids; cells that are not known are wanted. */
static void find_centres(cpl_map *map, size_t n, const double (*x)[3])
{
    if (!map->exchange) {
        map->mesh.locate(map->mesh.context, n, x, map->centre_cell);
        return;
    }
    for (size_t p = 0; p < n; p++) {
        const int64_t id = map->centre_id[p];
        map->centre_cell[p] = id < 0 ? UNKNOWN : exchange_place(map->exchange, id);
        if (id >= 0 && map->centre_cell[p] < 0) exchange_want(map->exchange, id);
    }
}

/* Whether the cell of the centre exists and is only not known. */
static int on_its_way(const cpl_map *map, size_t p)
{
    return map->exchange && map->centre_id[p] >= 0;
}

static cpl_status fill_located(cpl_map *map, size_t n, const double (*x)[3], const double *radius)
{
    find_centres(map, n, x);
    for (size_t p = 0; p < n; p++) {
        const int c = map->centre_cell[p];
        if (c < 0 && !on_its_way(map, p)) return outside(map, p, x[p]);
        if (c < 0) {
            ; /* the row is filled when the cell has come */
        } else if (map->model == CPL_CENTRE) {
            if (cpl_rows_reserve(&map->w, 1)) return no_memory(map);
            map->w.cell[map->w.entries] = c;
            map->w.weight[map->w.entries++] = 1;
        } else if (search_row(map, c, x[p], radius[p])) {
            return no_memory(map);
        }
        map->row[p + 1] = map->w.entries;
    }
    return CPL_OK;
}

cpl_status cpl_rows_fill(cpl_map *map, size_t n, const double (*x)[3], const double *radius)
{
    map->w.entries = 0;
    map->row[0] = 0;
    if (map->mesh.cells[0] > 0 && map->model == CPL_DIVIDED_CUBE)
        return fill_box(map, n, x, radius);
    return fill_located(map, n, x, radius);
}
