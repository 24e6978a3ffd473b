/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * map_ranks.c - rows of the map on several ranks, and its report.
 *
 * Rows are filled with what is known of the mesh. What a row lacks is wanted, fetched by all ranks
 * together, and the rows are completed, until no rank lacks anything: on a box of equal cells after
 * one round, on other meshes after as many as cells lie between a centre and the edge of its cube.
 * Cells stay borrowed from build to build, as particles hardly move from one to the next. Now and
 * then a rank finds that it has many that no row names, and all begin anew.
 */
#include "map.h"

#include <stdio.h>
#include <string.h>

void map_look(cpl_map *map)
{
    const exchange *x = map->exchange;
    cpl_mesh *mesh = &map->mesh;
    mesh->n = x->n;
    mesh->volume = x->volume;
    mesh->centre = NULL;
    mesh->lo = (const double(*)[3])x->lo;
    mesh->hi = (const double(*)[3])x->hi;
    mesh->offset = x->offset;
    mesh->neighbour = x->neighbour;
    mesh->id = x->id;
    mesh->neighbour_id = x->neighbour_id;
}

cpl_status map_fetch(cpl_map *map)
{
    exchange *x = map->exchange;
    cpl_status status = exchange_fetch(x, map->message);
    map_look(map);
    if (!status && map_reserve_cells(map, x->n)) {
        snprintf(map->message, sizeof map->message, "no memory for a map of %zu cells", x->n);
        status = CPL_NO_MEMORY;
    }
    return team_agree(&x->team, status, map->message, NULL);
}

/* Whether most of the borrowed cells are in no row of the last build. */
static int idle(cpl_map *map)
{
    enum { FEW = 64 };
    const exchange *x = map->exchange;
    const uint64_t search = ++map->search;
    size_t used = 0;
    for (size_t e = 0; e < map->row[map->n]; e++) {
        const size_t c = (size_t)map->w.cell[e];
        used += c >= x->own && map->seen[c] != search;
        map->seen[c] = search;
    }
    return x->n - x->own > FEW + 2 * used;
}

/* Every so often, give borrowed cells back if they are too many. */
static cpl_status tidy(cpl_map *map, cpl_status status)
{
    enum { OFTEN = 64 };
    if (++map->builds % OFTEN) return status;
    int give_back = status ? 0 : idle(map);
    status = team_agree(&map->exchange->team, status, map->message, &give_back);
    if (!status && give_back) {
        exchange_clear(map->exchange);
        map_look(map);
    }
    return status;
}

/* Ids of the cells of the centres, where the rows need them. */
static cpl_status find_centres(cpl_map *map, cpl_status status, size_t n, const double (*x)[3])
{
    if (map->part.cells[0] == 0)
        return exchange_locate(map->exchange, &map->part, status, n, x, map->centre_id,
                               map->message);
    if (map->model == CPL_CENTRE && !status)
        for (size_t p = 0; p < n; p++) map->centre_id[p] = box_locate(&map->part, x[p]);
    return status;
}

/* The places of the entries that rows.c left as ~id. */
static void complete_entries(cpl_map *map)
{
    for (size_t e = 0; e < map->w.entries; e++)
        if (map->w.cell[e] < 0) map->w.cell[e] = exchange_place(map->exchange, ~map->w.cell[e]);
}

cpl_status map_fill_ranks(cpl_map *map, cpl_status status, size_t n, const double (*x)[3],
                          const double *radius)
{
    exchange *exchange = map->exchange;
    const int by_number = map->part.cells[0] > 0 && map->model == CPL_DIVIDED_CUBE;
    exchange->team.seconds = 0;
    status = tidy(map, status);
    status = find_centres(map, status, n, x);
    for (;;) {
        if (!status) status = cpl_rows_fill(map, n, x, radius);
        int wanting = !status && exchange_wanting(exchange);
        status = team_agree(&exchange->team, status, map->message, &wanting);
        if (!status && wanting) status = map_fetch(map);
        if (status || !wanting) return status;
        if (by_number) {
            complete_entries(map);
            return CPL_OK;
        }
    }
}

void map_reduce_report(cpl_map *map)
{
    cpl_map_report *r = &map->report;
    team *team = &map->exchange->team;
    const double start = MPI_Wtime();
    const size_t borrowed = map->exchange->n - map->exchange->own;
    double sum[7] = {r->solid_volume,    r->mapped_volume,      r->moved_volume, (double)r->rows,
                     (double)r->entries, (double)r->full_cells, (double)borrowed};
    double least[2] = {r->eps_min, -r->eps_max};
    MPI_Allreduce(MPI_IN_PLACE, sum, 7, MPI_DOUBLE, MPI_SUM, team->comm);
    MPI_Allreduce(MPI_IN_PLACE, least, 2, MPI_DOUBLE, MPI_MIN, team->comm);
    r->solid_volume = sum[0], r->mapped_volume = sum[1], r->moved_volume = sum[2];
    r->rows = (size_t)sum[3], r->entries = (size_t)sum[4];
    r->full_cells = (size_t)sum[5], r->borrowed = (size_t)sum[6];
    r->eps_min = least[0], r->eps_max = -least[1];
    team->seconds += MPI_Wtime() - start;
}
