/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * packing.c - the packing limit: volume that does not fit into a cell moves to cells around it.
 *
 * No void fraction model knows that spheres do not overlap: shares of cubes can fill a small cell
 * beyond what any packing holds. Clipping would lose volume and with it mass conservation of the
 * fluid. Instead weight is moved within the rows, W <- W T, with a stochastic matrix T:
 *
 *     excess of cell c      e_c  = s_c - limit V_c          (s_c: solid volume of the cell)
 *     row c of T            1 - e_c/s_c  to itself, the rest to cells d with room
 *     room of a cell        r_d  = limit V_d - s_d  > 0
 *
 * The excess goes to the cells that share a face, in proportion to their room; what they cannot
 * take goes to the next ring of neighbours, and so on outward. Cells over the limit are treated in
 * the order of their numbers, each with the room that those before it left: no cell that receives
 * is ever filled beyond the limit, so one sweep suffices and T is not a product. The amounts are
 * continuous functions of the solid volumes (a ring that is just full passes on nothing), hence of
 * the particles' positions. Rows of W still sum to 1: gather and scatter stay transposes.
 */
#include "map.h"

#include <stdio.h>
#include <string.h>

static cpl_status no_memory(cpl_map *map)
{
    snprintf(map->message, sizeof map->message, "no memory to move volume between cells");
    return CPL_NO_MEMORY;
}

/* Number the cells over the limit; returns how many. */
static size_t number_over(cpl_map *map)
{
    size_t count = 0;
    for (size_t c = 0; c < map->mesh.n; c++) {
        const int full = map->solid[c] > map->packing_limit * map->mesh.volume[c];
        map->over[c] = full ? (int)count : -1;
        count += (size_t)full;
    }
    return count;
}

static double room(const cpl_map *map, int c)
{
    const double r = map->packing_limit * map->mesh.volume[c] - map->solid[c];
    return r > 0 ? r : 0;
}

/* Next ring of the search: appends unseen neighbours of wave[from..to); returns the new end. */
static size_t next_ring(cpl_map *map, size_t from, size_t to)
{
    size_t end = to;
    for (size_t i = from; i < to; i++) {
        const int c = map->wave[i];
        for (size_t k = map->mesh.offset[c]; k < map->mesh.offset[c + 1]; k++) {
            const int d = map->mesh.neighbour[k];
            if (d < 0) { /* a cell of another rank, which may have room */
                exchange_want(map->exchange, map->mesh.neighbour_id[k]);
                continue;
            }
            if (map->seen[d] == map->search) continue;
            map->seen[d] = map->search;
            map->wave[end++] = d;
        }
    }
    return end;
}

cpl_status pack_spread(cpl_map *map, int c)
{
    const double solid = map->solid[c];
    const double limit = map->packing_limit * map->mesh.volume[c];
    double excess = solid - limit;
    map->report.moved_volume += excess;
    map->search++;
    map->seen[c] = map->search;
    map->wave[0] = c;
    for (size_t from = 0, to = 1; excess > 0;) {
        const size_t end = next_ring(map, from, to);
        from = to, to = end;
        if (from == to) {
            snprintf(map->message, sizeof map->message,
                     "cell %d holds %g m3 of solid more than the packing limit %g allows, and no "
                     "cell connected with it has room left",
                     c, excess, map->packing_limit);
            return CPL_FULL;
        }
        double free_volume = 0;
        for (size_t i = from; i < to; i++) free_volume += room(map, map->wave[i]);
        if (!(free_volume > 0)) continue;
        const double part = excess < free_volume ? excess / free_volume : 1;
        if (cpl_rows_reserve(&map->shift, to - from)) return no_memory(map);
        for (size_t i = from; i < to; i++) {
            const double amount = part * room(map, map->wave[i]);
            if (!(amount > 0)) continue;
            map->shift.cell[map->shift.entries] = map->wave[i];
            map->shift.weight[map->shift.entries++] = amount;
            map->solid[map->wave[i]] += amount;
        }
        excess = part < 1 ? 0 : excess - free_volume;
    }
    map->solid[c] = limit;
    return CPL_OK;
}

/* Add weight to cell c in the row that starts at `first` and ends the matrix. */
static void add_to_row(rows *w, size_t first, int c, double weight)
{
    for (size_t e = first; e < w->entries; e++)
        if (w->cell[e] == c) {
            w->weight[e] += weight;
            return;
        }
    w->cell[w->entries] = c;
    w->weight[w->entries++] = weight;
}

/* Entries that row p may have after the transfer. */
static size_t widest(const cpl_map *map, const rows *old, size_t begin, size_t end)
{
    size_t count = end - begin;
    for (size_t e = begin; e < end; e++) {
        const int k = map->over[old->cell[e]];
        if (k >= 0) count += map->shift_row[k + 1] - map->shift_row[k];
    }
    return count;
}

static void transfer_row(cpl_map *map, const rows *old, size_t begin, size_t end, size_t first)
{
    rows *w = &map->w;
    for (size_t e = begin; e < end; e++) {
        const int c = old->cell[e], k = map->over[c];
        double stays = old->weight[e];
        if (k >= 0)
            for (size_t s = map->shift_row[k]; s < map->shift_row[k + 1]; s++) {
                const double moves = old->weight[e] * map->shift.weight[s];
                add_to_row(w, first, map->shift.cell[s], moves);
                stays -= moves;
            }
        add_to_row(w, first, c, stays);
    }
}

/* W <- W T. */
int pack_transfer(cpl_map *map)
{
    const rows old = map->w;
    map->w = map->spare;
    map->spare = old;
    map->w.entries = 0;
    for (size_t p = 0, begin = 0; p < map->n; p++) {
        const size_t end = map->row[p + 1], count = widest(map, &old, begin, end);
        if (cpl_rows_reserve(&map->w, count)) return 1;
        const size_t first = map->w.entries;
        if (count == end - begin) {
            memcpy(map->w.cell + first, old.cell + begin, count * sizeof *old.cell);
            memcpy(map->w.weight + first, old.weight + begin, count * sizeof *old.weight);
            map->w.entries += count;
        } else {
            transfer_row(map, &old, begin, end, first);
        }
        map->row[p + 1] = map->w.entries;
        begin = end;
    }
    return 0;
}

cpl_status cpl_map_pack(cpl_map *map)
{
    map->report.moved_volume = 0;
    map->report.full_cells = number_over(map);
    if (map->report.full_cells == 0) return CPL_OK;
    map->shift.entries = 0;
    map->shift_row[0] = 0;
    for (size_t c = 0; c < map->mesh.n; c++) {
        if (map->over[c] < 0) continue;
        const double solid = map->solid[c];
        const size_t first = map->shift.entries;
        const cpl_status status = pack_spread(map, (int)c);
        if (status) return status;
        for (size_t e = first; e < map->shift.entries; e++) map->shift.weight[e] /= solid;
        map->shift_row[map->over[c] + 1] = map->shift.entries;
    }
    if (pack_transfer(map)) return no_memory(map);
    cpl_map_sum_solid(map);
    return CPL_OK;
}
