/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * map.c - the sparse map between particles and cells: life cycle, build, gather and scatter.
 *
 * Method and layout: map.h; filling of rows: rows.c; packing limit: packing.c. Every loop runs over
 * the rows in order, so that sums are taken in the same order in every run. Gather and scatter are
 * specialised for the widths that occur (1, 3, 9) by an always-inline body with literal width.
 */
#include "map.h"
#include "sum.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int allocate_cells(cpl_map *map)
{
    const size_t n = map->mesh.n;
    map->solid = calloc(n, sizeof *map->solid);
    map->wave = calloc(n, sizeof *map->wave);
    map->seen = calloc(n, sizeof *map->seen);
    map->over = calloc(n, sizeof *map->over);
    map->shift_row = calloc(n + 1, sizeof *map->shift_row);
    return !map->solid || !map->wave || !map->seen || !map->over || !map->shift_row;
}

static int reserve_particles(cpl_map *map, size_t n)
{
    if (map->row && n <= map->row_capacity) return 0;
    const size_t capacity = n + n / 4 + 64;
    free(map->row), free(map->volume), free(map->centre_cell);
    map->row = malloc((capacity + 1) * sizeof *map->row);
    map->volume = malloc(capacity * sizeof *map->volume);
    map->centre_cell = malloc(capacity * sizeof *map->centre_cell);
    map->row_capacity = capacity;
    return !map->row || !map->volume || !map->centre_cell;
}

cpl_status cpl_map_new(const cpl_mesh *mesh, cpl_map_model model, double packing_limit,
                       cpl_map **result)
{
    *result = NULL;
    cpl_map *map = calloc(1, sizeof *map);
    if (!map) return CPL_NO_MEMORY;
    *result = map;
    if (!mesh || mesh->n == 0 || !(packing_limit > 0 && packing_limit < 1) ||
        (model != CPL_CENTRE && model != CPL_DIVIDED_CUBE)) {
        snprintf(map->message, sizeof map->message,
                 "a map needs a mesh with cells, a known model and a packing limit between 0 and 1 "
                 "(found %g)",
                 packing_limit);
        return CPL_BAD_ARGUMENT;
    }
    map->mesh = *mesh;
    map->model = model;
    map->packing_limit = packing_limit;
    if (allocate_cells(map) || reserve_particles(map, 0)) {
        snprintf(map->message, sizeof map->message, "no memory for a map of %zu cells", mesh->n);
        return CPL_NO_MEMORY;
    }
    map->row[0] = 0;
    return CPL_OK;
}

void cpl_map_free(cpl_map *map)
{
    if (!map) return;
    rows *r[3] = {&map->w, &map->spare, &map->shift};
    for (int i = 0; i < 3; i++) {
        free(r[i]->cell), free(r[i]->weight);
        free(map->axis_cell[i]), free(map->axis_share[i]);
    }
    free(map->row), free(map->volume), free(map->centre_cell);
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
}

static void make_report(cpl_map *map)
{
    cpl_map_report *r = &map->report;
    cpl_sum particles = {0}, mapped = {0};
    r->rows = map->n;
    r->entries = map->w.entries;
    r->eps_min = 1;
    r->eps_max = 0;
    for (size_t p = 0; p < map->n; p++) cpl_add(&particles, map->volume[p]);
    for (size_t c = 0; c < map->mesh.n; c++) {
        const double eps = 1 - map->solid[c] / map->mesh.volume[c];
        cpl_add(&mapped, map->solid[c]);
        r->eps_min = fmin(r->eps_min, eps);
        r->eps_max = fmax(r->eps_max, eps);
    }
    r->solid_volume = cpl_total(&particles);
    r->mapped_volume = cpl_total(&mapped);
}

cpl_status cpl_map_build(cpl_map *map, size_t n, const double (*x)[3], const double *radius,
                         const double *V)
{
    map->message[0] = 0;
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
    map->n = 0; /* until the rows are whole */
    const cpl_status filled = cpl_rows_fill(map, n, x, radius);
    if (filled) return filled;
    map->n = n;
    memcpy(map->volume, V, n * sizeof *V);
    cpl_map_sum_solid(map);
    const cpl_status packed = cpl_map_pack(map);
    make_report(map);
    return packed;
}

void cpl_voidage(const cpl_map *map, double *eps)
{
    for (size_t c = 0; c < map->mesh.n; c++) eps[c] = 1 - map->solid[c] / map->mesh.volume[c];
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
scatter(const cpl_map *map, int width, const double *restrict s, double *restrict out)
{
    const int *restrict cell = map->w.cell;
    const double *restrict weight = map->w.weight;
    memset(out, 0, map->mesh.n * (size_t)width * sizeof *out);
    for (size_t p = 0; p < map->n; p++)
        for (size_t e = map->row[p]; e < map->row[p + 1]; e++)
            for (int k = 0; k < width; k++)
                out[(size_t)cell[e] * (size_t)width + (size_t)k] +=
                    weight[e] * s[p * (size_t)width + (size_t)k];
    for (size_t c = 0; c < map->mesh.n; c++)
        for (int k = 0; k < width; k++) out[c * (size_t)width + (size_t)k] /= map->mesh.volume[c];
}

void cpl_gather(const cpl_map *map, int width, const double *q_cell, double *q_particle)
{
    switch (width) {
    case 1:
        gather(map, 1, q_cell, q_particle);
        break;
    case 3:
        gather(map, 3, q_cell, q_particle);
        break;
    case 9:
        gather(map, 9, q_cell, q_particle);
        break;
    default:
        gather(map, width, q_cell, q_particle);
    }
}

void cpl_scatter(const cpl_map *map, int width, const double *s_particle, double *S_cell)
{
    switch (width) {
    case 1:
        scatter(map, 1, s_particle, S_cell);
        break;
    case 3:
        scatter(map, 3, s_particle, S_cell);
        break;
    case 9:
        scatter(map, 9, s_particle, S_cell);
        break;
    default:
        scatter(map, width, s_particle, S_cell);
    }
}

cpl_map_report cpl_map_last_report(const cpl_map *map)
{
    return map->report;
}
