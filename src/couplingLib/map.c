/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * map.c - the sparse map between particles and cells: life cycle, build, gather and scatter.
 *
 * Method and layout: map.h; filling of rows: rows.c; packing limit: packing.c. Every loop runs over
 * the rows in order, so that sums are taken in the same order in every run. Gather and scatter are
 * specialised for the widths that occur (1, 3, 9) by an always-inline body with literal width.
 */
#include "map.h"
#include "tally.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int grow(void *array, size_t bytes)
{
    void **a = array, *grown = realloc(*a, bytes);
    if (grown) *a = grown;
    return !grown;
}

int map_reserve_cells(cpl_map *map, size_t n)
{
    const size_t old = map->cell_capacity;
    if (map->solid && n <= old) return 0;
    const size_t m = map->exchange ? n + n / 8 + 256 : n;
    if (grow(&map->solid, m * sizeof *map->solid) || grow(&map->wave, m * sizeof *map->wave) ||
        grow(&map->seen, m * sizeof *map->seen) || grow(&map->over, m * sizeof *map->over) ||
        grow(&map->shift_row, (m + 1) * sizeof *map->shift_row))
        return 1;
    memset(map->seen + old, 0, (m - old) * sizeof *map->seen);
    map->cell_capacity = m;
    return 0;
}

static int reserve_particles(cpl_map *map, size_t n)
{
    if (map->row && n <= map->row_capacity) return 0;
    const size_t capacity = n + n / 4 + 64;
    free(map->row), free(map->volume), free(map->centre_cell), free(map->centre_id);
    map->row = malloc((capacity + 1) * sizeof *map->row);
    map->volume = malloc(capacity * sizeof *map->volume);
    map->centre_cell = malloc(capacity * sizeof *map->centre_cell);
    map->centre_id = map->exchange ? malloc(capacity * sizeof *map->centre_id) : NULL;
    map->row_capacity = capacity;
    map->n = 0; /* the rows of the last build are gone */
    if (map->row) map->row[0] = 0;
    return !map->row || !map->volume || !map->centre_cell || (map->exchange && !map->centre_id);
}

static cpl_status check(cpl_map *map, size_t cells, cpl_map_model model, double packing_limit)
{
    if (cells > 0 && packing_limit > 0 && packing_limit < 1 &&
        (model == CPL_CENTRE || model == CPL_DIVIDED_CUBE))
        return CPL_OK;
    snprintf(map->message, sizeof map->message,
             "a map needs a mesh with cells, a known model and a packing limit between 0 and 1 "
             "(found %g)",
             packing_limit);
    return CPL_BAD_ARGUMENT;
}

static cpl_status prepare(cpl_map *map, cpl_map_model model, double packing_limit)
{
    map->model = model;
    map->packing_limit = packing_limit;
    if (map_reserve_cells(map, map->mesh.n) || reserve_particles(map, 0)) {
        snprintf(map->message, sizeof map->message, "no memory for a map of %zu cells",
                 map->mesh.n);
        return CPL_NO_MEMORY;
    }
    return CPL_OK;
}

cpl_status cpl_map_new(const cpl_mesh *mesh, cpl_map_model model, double packing_limit,
                       cpl_map **result)
{
    cpl_map *map = *result = calloc(1, sizeof *map);
    if (!map) return CPL_NO_MEMORY;
    const cpl_status status = check(map, mesh ? mesh->n : 0, model, packing_limit);
    if (status) return status;
    map->mesh = *mesh;
    map->own = mesh->n;
    return prepare(map, model, packing_limit);
}

/* Whether the numbers of the cells are their ids: then a map of one rank needs no exchange. */
static int in_order(const cpl_mesh *mesh)
{
    for (size_t c = 0; mesh->id && c < mesh->n; c++)
        if (mesh->id[c] != (int64_t)c) return 0;
    return !mesh->id || mesh->neighbour;
}

cpl_status cpl_map_new_ranks(MPI_Comm comm, const cpl_mesh *mesh, cpl_map_model model,
                             double packing_limit, cpl_map **result)
{
    int ranks;
    MPI_Comm_size(comm, &ranks);
    if (ranks == 1 && in_order(mesh)) return cpl_map_new(mesh, model, packing_limit, result);
    cpl_map *map = *result = calloc(1, sizeof *map);
    char text[TEXT] = "no memory for a map";
    exchange *exchange;
    cpl_status status = exchange_new(comm, mesh, text, &exchange);
    if (map) {
        map->exchange = exchange;
        memcpy(map->message, text, sizeof text);
    }
    if (!exchange || status) return status;
    if (map) {
        status = check(map, (size_t)exchange->total, model, packing_limit);
        map->part = map->mesh = *mesh;
        map->own = mesh->n;
        map_look(map);
        if (!status) status = prepare(map, model, packing_limit);
        memcpy(text, map->message, sizeof text);
    }
    status = team_agree(&exchange->team, map ? status : CPL_NO_MEMORY, text, NULL);
    if (!map)
        exchange_free(exchange);
    else if (status)
        memcpy(map->message, text, sizeof text);
    else
        map->message[0] = 0;
    return status;
}

void cpl_map_free(cpl_map *map)
{
    if (!map) return;
    rows *r[3] = {&map->w, &map->spare, &map->shift};
    for (int i = 0; i < 3; i++) {
        free(r[i]->cell), free(r[i]->weight);
        free(map->axis_cell[i]), free(map->axis_share[i]);
    }
    free(map->row), free(map->volume), free(map->centre_cell), free(map->centre_id);
    exchange_free(map->exchange);
    free(map->solid), free(map->wave), free(map->seen), free(map->over), free(map->shift_row);
    free(map);
}

const char *cpl_map_message(const cpl_map *map)
{
    return map ? map->message : "no memory";
}

void cpl_map_sum_solid(cpl_map *map)
{
    memset(map->solid, 0, map->mesh.n * sizeof *map->solid);
    for (size_t p = 0; p < map->n; p++)
        for (size_t e = map->row[p]; e < map->row[p + 1]; e++)
            map->solid[map->w.cell[e]] += map->w.weight[e] * map->volume[p];
    if (map->exchange) exchange_return(map->exchange, 1, map->solid);
}

static void make_report(cpl_map *map)
{
    cpl_map_report *r = &map->report;
    tally particles = {0}, mapped = {0};
    r->rows = map->n;
    r->entries = map->w.entries;
    r->eps_min = 1;
    r->eps_max = 0;
    for (size_t p = 0; p < map->n; p++) tally_add(&particles, map->volume[p]);
    for (size_t c = 0; c < map->own; c++) {
        const double eps = 1 - map->solid[c] / map->mesh.volume[c];
        tally_add(&mapped, map->solid[c]);
        r->eps_min = fmin(r->eps_min, eps);
        r->eps_max = fmax(r->eps_max, eps);
    }
    r->solid_volume = tally_total(&particles);
    r->mapped_volume = tally_total(&mapped);
    if (map->exchange) map_reduce_report(map);
}

/* Room for the particles, which must be sound. */
static cpl_status receive(cpl_map *map, size_t n, const double *radius, const double *V)
{
    if (reserve_particles(map, n)) {
        map->row_capacity = map->n = 0;
        snprintf(map->message, sizeof map->message, "no memory for the map of %zu particles", n);
        return CPL_NO_MEMORY;
    }
    for (size_t p = 0; p < n; p++)
        if (!(radius[p] > 0) || !(V[p] >= 0)) {
            snprintf(map->message, sizeof map->message,
                     "particle in row %zu has radius %g m and volume %g m3", p, radius[p], V[p]);
            return CPL_BAD_ARGUMENT;
        }
    return CPL_OK;
}

cpl_status cpl_map_build(cpl_map *map, size_t n, const double (*x)[3], const double *radius,
                         const double *V)
{
    map->message[0] = 0;
    cpl_status status = receive(map, n, radius, V);
    if (map->exchange)
        status = map_fill_ranks(map, status, n, x, radius);
    else if (!status)
        status = cpl_rows_fill(map, n, x, radius);
    map->n = 0; /* until the rows are whole */
    if (status) return status;
    map->n = n;
    if (n) memcpy(map->volume, V, n * sizeof *V);
    cpl_map_sum_solid(map);
    const cpl_status packed = map->exchange ? map_pack_ranks(map) : cpl_map_pack(map);
    make_report(map);
    return packed;
}

void cpl_voidage(const cpl_map *map, double *eps)
{
    for (size_t c = 0; c < map->own; c++) eps[c] = 1 - map->solid[c] / map->mesh.volume[c];
}

static inline __attribute__((always_inline)) void
gather(const cpl_map *map, int width, const double *restrict q, double *restrict out)
{
    const int *restrict cell = map->w.cell;
    const double *restrict weight = map->w.weight;
    for (size_t p = 0; p < map->n; p++) {
        double *o = out + p * (size_t)width;
        for (int k = 0; k < width; k++) o[k] = 0;
        for (size_t e = map->row[p]; e < map->row[p + 1]; e++)
            for (int k = 0; k < width; k++)
                o[k] += weight[e] * q[(size_t)cell[e] * (size_t)width + (size_t)k];
    }
}

static inline __attribute__((always_inline)) void
sum(const cpl_map *map, int width, const double *restrict s, double *restrict out)
{
    const int *restrict cell = map->w.cell;
    const double *restrict weight = map->w.weight;
    memset(out, 0, map->mesh.n * (size_t)width * sizeof *out);
    for (size_t p = 0; p < map->n; p++)
        for (size_t e = map->row[p]; e < map->row[p + 1]; e++)
            for (int k = 0; k < width; k++)
                out[(size_t)cell[e] * (size_t)width + (size_t)k] +=
                    weight[e] * s[p * (size_t)width + (size_t)k];
}

static inline __attribute__((always_inline)) void divide(const cpl_map *map, int width,
                                                         const double *total, double *out)
{
    for (size_t c = 0; c < map->own; c++)
        for (int k = 0; k < width; k++)
            out[c * (size_t)width + (size_t)k] =
                total[c * (size_t)width + (size_t)k] / map->mesh.volume[c];
}

/* Values of the own cells, completed by those of borrowed ones. */
static const double *complete(const cpl_map *map, int width, const double *q)
{
    exchange *x = map->exchange;
    if (!x) return q;
    if (x->own) memcpy(x->value, q, x->own * (size_t)width * sizeof *q);
    exchange_borrow(x, width, x->value);
    return x->value;
}

void cpl_gather(const cpl_map *map, int width, const double *q_cell, double *q_particle)
{
    const double *q = complete(map, width, q_cell);
    switch (width) {
    case 1:
        gather(map, 1, q, q_particle);
        break;
    case 3:
        gather(map, 3, q, q_particle);
        break;
    case 9:
        gather(map, 9, q, q_particle);
        break;
    default:
        gather(map, width, q, q_particle);
    }
}

void cpl_scatter(const cpl_map *map, int width, const double *s_particle, double *S_cell)
{
    exchange *x = map->exchange;
    double *total = x ? x->value : S_cell;
    switch (width) {
    case 1:
        sum(map, 1, s_particle, total);
        break;
    case 3:
        sum(map, 3, s_particle, total);
        break;
    case 9:
        sum(map, 9, s_particle, total);
        break;
    default:
        sum(map, width, s_particle, total);
    }
    if (x) exchange_return(x, width, total);
    divide(map, width, total, S_cell);
}

cpl_map_report cpl_map_last_report(const cpl_map *map)
{
    cpl_map_report report = map->report;
    if (map->exchange) report.seconds_exchange = map->exchange->team.seconds;
    return report;
}
