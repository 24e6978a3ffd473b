/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * levels.c - near pairs among spheres of any sizes, at a cost linear in their number: levels.h.
 *
 * A grid covers the spheres of its level, or the domain in periodic directions, with cells of
 * 2 r_max + skin or wider. A pair is looked for from its smaller level, within r_i + r_max + skin
 * of x_i, which is at most three cells wide in every direction.
 */
#include "levels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int level_of(const levels *g, double radius)
{
    int l = ilogb(radius / g->smallest);
    return l < 0 ? 0 : l < LEVELS ? l : LEVELS - 1;
}

static int cell_along(const level *l, int a, double x)
{
    double c = (x - l->origin[a]) * l->per_width[a];
    return c <= 0 ? 0 : c >= l->cells[a] - 1 ? l->cells[a] - 1 : (int)c;
}

static size_t cell_of(const level *l, const double x[3])
{
    size_t i = (size_t)cell_along(l, 0, x[0]), j = (size_t)cell_along(l, 1, x[1]),
           k = (size_t)cell_along(l, 2, x[2]);
    return (k * (size_t)l->cells[1] + j) * (size_t)l->cells[0] + i;
}

static size_t cells_of(const level *l)
{
    return (size_t)l->cells[0] * (size_t)l->cells[1] * (size_t)l->cells[2];
}

/* The grid of a level over lo..hi. */
static dem_status lay_grid(level *l, const double lo[3], const double hi[3], double wide)
{
    /* More than a few cells per sphere would cost memory and time for nothing. */
    double most = 4. * l->n + 64, count;
    for (;; wide *= 1.26) {
        count = 1;
        for (int a = 0; a < 3; a++) count *= fmax(1, floor((hi[a] - lo[a]) / wide));
        if (count <= most) break;
    }
    for (int a = 0; a < 3; a++) {
        l->origin[a] = lo[a];
        l->cells[a] = (int)fmax(1, floor((hi[a] - lo[a]) / wide));
        l->per_width[a] = hi[a] > lo[a] ? l->cells[a] / (hi[a] - lo[a]) : 0;
    }
    l->first = calloc(cells_of(l) + 2, sizeof *l->first);
    return l->first ? DEM_OK : DEM_NO_MEMORY;
}

/* Number, largest radius and grid of every level. */
static dem_status lay_grids(levels *g)
{
    double lo[LEVELS][3], hi[LEVELS][3];
    for (size_t i = 0; i < g->n; i++) {
        const double *x = g->pos[i];
        int at = level_of(g, x[3]);
        level *l = &g->level[at];
        for (int a = 0; a < 3; a++) {
            lo[at][a] = l->n ? fmin(lo[at][a], x[a]) : x[a];
            hi[at][a] = l->n ? fmax(hi[at][a], x[a]) : x[a];
        }
        l->radius = fmax(l->radius, x[3]);
        l->n++;
    }
    for (int at = 0; at < LEVELS; at++) {
        level *l = &g->level[at];
        if (!l->n) continue;
        for (int a = 0; a < 3; a++) {
            if (!g->periodic[a]) continue;
            lo[at][a] = g->lo[a];
            hi[at][a] = g->lo[a] + g->length[a];
        }
        if (lay_grid(l, lo[at], hi[at], 2 * l->radius + g->skin)) return DEM_NO_MEMORY;
    }
    return DEM_OK;
}

dem_status levels_init(levels *g, const double lo[3], const double hi[3], const int periodic[3],
                       size_t n, const double (*pos)[4], double skin)
{
    memset(g, 0, sizeof *g);
    for (int a = 0; a < 3; a++) {
        g->lo[a] = lo[a];
        g->length[a] = hi[a] - lo[a];
        g->periodic[a] = periodic[a];
    }
    g->n = n;
    g->pos = pos;
    g->skin = skin;
    g->smallest = INFINITY;
    for (size_t i = 0; i < n; i++) g->smallest = fmin(g->smallest, pos[i][3]);
    g->sphere = malloc((n + 1) * sizeof *g->sphere);
    if (!g->sphere || lay_grids(g)) {
        levels_free(g);
        return DEM_NO_MEMORY;
    }
    /* Counting sort: first[c + 1] runs from the begin of the cell c to its end. */
    for (size_t i = 0; i < n; i++) {
        level *l = &g->level[level_of(g, pos[i][3])];
        l->first[cell_of(l, pos[i]) + 2]++;
    }
    uint32_t begin = 0;
    for (level *l = g->level; l < g->level + LEVELS; l++) {
        if (!l->n) continue;
        l->first[0] = l->first[1] = begin;
        for (size_t c = 2; c < cells_of(l) + 2; c++) l->first[c] += l->first[c - 1];
        begin += l->n;
    }
    for (size_t i = 0; i < n; i++) {
        level *l = &g->level[level_of(g, pos[i][3])];
        g->sphere[l->first[cell_of(l, pos[i]) + 1]++] = (uint32_t)i;
    }
    return DEM_OK;
}

void levels_free(levels *g)
{
    for (int at = 0; at < LEVELS; at++) free(g->level[at].first);
    free(g->sphere);
    memset(g, 0, sizeof *g);
}

/* The cells of a level along a that reach to within `reach` of x: from *from on, their number.
 * Those beyond the last go on at the other side of a periodic domain. */
static int stretch(const levels *g, const level *l, int a, double x, double reach, int *from)
{
    int m = l->cells[a];
    if (!g->periodic[a]) {
        *from = cell_along(l, a, x - reach);
        return cell_along(l, a, x + reach) - *from + 1;
    }
    double begin = floor((x - reach - l->origin[a]) * l->per_width[a]);
    double end = floor((x + reach - l->origin[a]) * l->per_width[a]);
    if (end - begin + 1 >= m) {
        *from = 0;
        return m;
    }
    *from = (int)(begin - m * floor(begin / m));
    return (int)(end - begin) + 1;
}

typedef struct search {
    levels *g;
    uint32_t i;
    int own; /* its own level: only what comes after it */
    levels_visit *visit;
    void *context;
} search;

static int look_into(const search *s, uint32_t begin, uint32_t end)
{
    levels *g = s->g;
    const double *xi = g->pos[s->i];
    for (uint32_t k = begin; k < end; k++) {
        uint32_t j = g->sphere[k];
        if (s->own && j <= s->i) continue;
        const double *xj = g->pos[j];
        double d[3], d2 = 0, reach = xi[3] + g->skin + xj[3];
        for (int a = 0; a < 3; a++) {
            d[a] = xi[a] - xj[a];
            if (g->periodic[a]) d[a] -= g->length[a] * rint(d[a] / g->length[a]);
            d2 += d[a] * d[a];
        }
        g->checks++;
        if (!(d2 < reach * reach)) continue;
        int end_it = s->visit(s->context, s->i, j, d, d2);
        if (end_it) return end_it;
    }
    return 0;
}

static int look_on(const search *s, const level *l)
{
    const double *x = s->g->pos[s->i];
    int from[3], count[3];
    for (int a = 0; a < 3; a++)
        count[a] = stretch(s->g, l, a, x[a], x[3] + l->radius + s->g->skin, &from[a]);
    for (int z = 0; z < count[2]; z++)
        for (int y = 0; y < count[1]; y++)
            for (int k = 0; k < count[0]; k++) {
                int cz = (from[2] + z) % l->cells[2], cy = (from[1] + y) % l->cells[1],
                    cx = (from[0] + k) % l->cells[0];
                size_t c = ((size_t)cz * (size_t)l->cells[1] + (size_t)cy) * (size_t)l->cells[0] +
                           (size_t)cx;
                int end_it = look_into(s, l->first[c], l->first[c + 1]);
                if (end_it) return end_it;
            }
    return 0;
}

int levels_partners(levels *g, uint32_t i, levels_visit *visit, void *context)
{
    int own = level_of(g, g->pos[i][3]), end_it = 0;
    for (int at = own; at < LEVELS && !end_it; at++) {
        if (!g->level[at].n) continue;
        const search s = {g, i, at == own, visit, context};
        end_it = look_on(&s, &g->level[at]);
    }
    return end_it;
}
