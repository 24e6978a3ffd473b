/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * cells.c - linked cells: a grid in whose cells particles are counted and beside which pairs lie.
 */
#include "cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void cells_free(cells *g)
{
    for (int a = 0; a < 3; a++) {
        free(g->plane[a]);
        free(g->local[a]);
        free(g->tile[a]);
        free(g->wide[a]);
    }
    memset(g, 0, sizeof *g);
}

static dem_status reserve(cells *g, int a, int planes)
{
    int **array[] = {&g->plane[a], &g->local[a], &g->tile[a], &g->wide[a]};
    if (planes <= g->plane_capacity[a]) return DEM_OK;
    g->plane_capacity[a] = 0;
    for (size_t k = 0; k < sizeof array / sizeof *array; k++) {
        int *grown = realloc(*array[k], (size_t)planes * sizeof *grown);
        if (!grown) return DEM_NO_MEMORY;
        *array[k] = grown;
    }
    g->plane_capacity[a] = planes;
    return DEM_OK;
}

/* The grid covers all particles (the domain in periodic directions). */
static void lay_planes(cells *g, const double domain_lo[3], const double domain_hi[3],
                       const extent *all, double reach)
{
    double width[3];
    for (int a = 0; a < 3; a++) {
        double lo = g->periodic[a] ? domain_lo[a] : all->lo[a];
        double hi = g->periodic[a] ? domain_hi[a] : all->hi[a];
        g->origin[a] = lo;
        width[a] = hi - lo;
    }
    /* More than a few cells per particle would cost memory and time for nothing. */
    double most = 4. * all->n + 64, wide = reach, count;
    for (;; wide *= 1.26) {
        count = 1;
        for (int a = 0; a < 3; a++) count *= fmax(1, floor(width[a] / wide));
        if (count <= most) break;
    }
    for (int a = 0; a < 3; a++) {
        g->planes[a] = (int)fmax(1, floor(width[a] / wide));
        g->per_width[a] = width[a] > 0 ? g->planes[a] / width[a] : 0;
    }
}

static int plane_of(const cells *g, int a, double x)
{
    int c = (int)((x - g->origin[a]) * g->per_width[a]);
    if (c > g->planes[a] - 1) c = g->planes[a] - 1;
    return c < 0 ? 0 : c;
}

/* Keep the planes along a in which particles are, in their order. */
static void keep_planes(cells *g, int a, const double (*pos)[4], size_t n)
{
    int *local = g->local[a], *plane = g->plane[a], kept = 0;
    memset(local, 0, (size_t)g->planes[a] * sizeof *local);
    for (size_t i = 0; i < n; i++) local[plane_of(g, a, pos[i][a])] = 1;
    for (int k = 0; k < g->planes[a]; k++) {
        if (local[k]) plane[kept] = k;
        local[k] = local[k] ? kept++ : -1;
    }
    g->kept[a] = kept;
    for (int k = 0, end; k < kept; k = end) {
        for (end = k + 1; end < kept && plane[end] / CELLS_TILE == plane[k] / CELLS_TILE;) end++;
        for (int m = k; m < end; m++) {
            g->tile[a][m] = k;
            g->wide[a][m] = end - k;
        }
    }
}

dem_status cells_lay(cells *g, const double lo[3], const double hi[3], const int periodic[3],
                     const extent *all, double reach, const double (*pos)[4], size_t n)
{
    memcpy(g->periodic, periodic, sizeof g->periodic);
    lay_planes(g, lo, hi, all, reach);
    g->n = 1;
    for (int a = 0; a < 3; a++) {
        if (reserve(g, a, g->planes[a])) return DEM_NO_MEMORY;
        keep_planes(g, a, pos, n);
        g->n *= (size_t)g->kept[a];
    }
    return DEM_OK;
}

/* Columns of the tiles in front, then layers, rows and cells of the own one. */
static uint32_t number_of(const cells *g, int x, int y, int z)
{
    const size_t x0 = (size_t)g->tile[0][x], wx = (size_t)g->wide[0][x];
    const size_t y0 = (size_t)g->tile[1][y], wy = (size_t)g->wide[1][y];
    const size_t columns = y0 * (size_t)g->kept[0] + wy * x0;
    const size_t row = (size_t)z * wy + (size_t)y - y0;
    return (uint32_t)(columns * (size_t)g->kept[2] + row * wx + (size_t)x - x0);
}

uint32_t cells_of(const cells *g, const double x[3])
{
    int c[3];
    for (int a = 0; a < 3; a++) c[a] = g->local[a][plane_of(g, a, x[a])];
    return number_of(g, c[0], c[1], c[2]);
}

void cells_next(const cells *g, int at[3])
{
    const int x0 = g->tile[0][at[0]], x1 = x0 + g->wide[0][at[0]];
    const int y0 = g->tile[1][at[1]], y1 = y0 + g->wide[1][at[1]];
    if (++at[0] < x1) return;
    at[0] = x0;
    if (++at[1] < y1) return;
    at[1] = y0;
    if (++at[2] < g->kept[2]) return;
    at[2] = 0;
    at[0] = x1;
    if (x1 < g->kept[0]) return;
    at[0] = 0;
    at[1] = y1 < g->kept[1] ? y1 : 0;
}

int cells_behind(const cells *g, const int at[3], uint32_t cell[27], int *inner)
{
    const uint32_t self = number_of(g, at[0], at[1], at[2]);
    const int *m = g->planes;
    int plane[3], from[3], to[3], n = 0;
    *inner = 1;
    for (int a = 0; a < 3; a++) {
        const int p = plane[a] = g->plane[a][at[a]];
        *inner &= !g->periodic[a] || (m[a] > 4 && p > 0 && p < m[a] - 1);
        /* With one or two cells in a periodic direction some neighbours are the same cell. */
        from[a] = g->periodic[a] ? (m[a] > 2 ? -1 : 0) : (p > 0 ? -1 : 0);
        to[a] = g->periodic[a] ? (m[a] > 1 ? 1 : 0) : (p < m[a] - 1 ? 1 : 0);
    }
    for (int z = from[2]; z <= to[2]; z++)
        for (int y = from[1]; y <= to[1]; y++)
            for (int x = from[0]; x <= to[0]; x++) {
                const int cx = g->local[0][(plane[0] + x + m[0]) % m[0]],
                          cy = g->local[1][(plane[1] + y + m[1]) % m[1]],
                          cz = g->local[2][(plane[2] + z + m[2]) % m[2]];
                if (cx < 0 || cy < 0 || cz < 0) continue;
                const uint32_t other = number_of(g, cx, cy, cz);
                if (other >= self) cell[n++] = other;
            }
    return n;
}

/* The planes along a that cover lo..hi: from *from on, their number. */
static int stretch(const cells *g, int a, double lo, double hi, int *from)
{
    const int m = g->planes[a];
    const double begin = floor((lo - g->origin[a]) * g->per_width[a]);
    const double end = floor((hi - g->origin[a]) * g->per_width[a]);
    *from = 0;
    if (!g->periodic[a]) {
        *from = (int)fmin(fmax(begin, 0), m - 1);
        return (int)fmin(fmax(end, 0), m - 1) - *from + 1;
    }
    if (end - begin + 1 >= m) return m;
    *from = (int)(begin - m * floor(begin / m));
    return (int)(end - begin) + 1;
}

int cells_in_box(const cells *g, const double lo[3], const double hi[3], cells_visit *visit,
                 void *context)
{
    int from[3], count[3], end_it = 0;
    for (int a = 0; a < 3; a++) count[a] = stretch(g, a, lo[a], hi[a], &from[a]);
    for (int k = 0; k < count[0] * count[1] * count[2] && !end_it; k++) {
        const int x = g->local[0][(from[0] + k % count[0]) % g->planes[0]],
                  y = g->local[1][(from[1] + k / count[0] % count[1]) % g->planes[1]],
                  z = g->local[2][(from[2] + k / count[0] / count[1]) % g->planes[2]];
        if (x < 0 || y < 0 || z < 0) continue;
        end_it = visit(context, number_of(g, x, y, z));
    }
    return end_it;
}
