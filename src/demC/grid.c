/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * grid.c - linked cells that spheres of any sizes enter one by one: grid.h.
 *
 * A sphere that looks for others of the level l visits the cells within its radius, the largest of
 * l and the reserve: at most three in a row where l has spheres as large as itself or larger.
 */
#include "grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int level_of(const grid *g, double radius)
{
    const int l = ilogb(radius / g->smallest);
    return l < 0 ? 0 : l < GRID_LEVELS ? l : GRID_LEVELS - 1;
}

static size_t cells_of(const grid_level *l)
{
    return (size_t)l->cells[0] * (size_t)l->cells[1] * (size_t)l->cells[2];
}

/* Cells at least `reach` wide, and not many more of them than there are spheres. */
static dem_status lay_cells(const grid *g, grid_level *l, double reach, size_t n)
{
    const double volume = g->length[0] * g->length[1] * g->length[2];
    const double width = fmax(reach, cbrt(volume / (4. * (double)n + 1000.)));
    for (int k = 0; k < 3; k++) {
        l->cells[k] = (int)fmax(1., floor(g->length[k] / width));
        l->per_m[k] = l->cells[k] / g->length[k];
    }
    l->head = malloc(cells_of(l) * sizeof *l->head);
    return l->head ? DEM_OK : DEM_NO_MEMORY;
}

dem_status grid_init(grid *g, const double lo[3], const double hi[3], const int periodic[3],
                     double smallest, double largest, size_t n, double reserve)
{
    *g = (grid){.reserve = reserve, .smallest = smallest};
    for (int k = 0; k < 3; k++) {
        g->lo[k] = lo[k];
        g->length[k] = hi[k] - lo[k];
        g->periodic[k] = periodic[k];
    }
    for (int l = 0; l <= level_of(g, largest); l++) {
        g->level[l].radius = l < GRID_LEVELS - 1 ? fmin(largest, ldexp(smallest, l + 1)) : largest;
        if (lay_cells(g, &g->level[l], 2 * g->level[l].radius + reserve, n)) {
            grid_free(g);
            return DEM_NO_MEMORY;
        }
    }
    grid_clear(g);
    return DEM_OK;
}

dem_status grid_reserve(grid *g, size_t n, const double (*x)[3], const double *r)
{
    g->x = x;
    g->r = r;
    if (g->next && n <= g->capacity) return DEM_OK;
    const size_t room = n + n / 2 + 1;
    int *grown = realloc(g->next, room * sizeof *grown);
    if (!grown) return DEM_NO_MEMORY;
    g->next = grown;
    g->capacity = room;
    return DEM_OK;
}

void grid_free(grid *g)
{
    for (int l = 0; l < GRID_LEVELS; l++) free(g->level[l].head);
    free(g->next);
    memset(g, 0, sizeof *g);
}

void grid_clear(grid *g)
{
    for (grid_level *l = g->level; l < g->level + GRID_LEVELS; l++) {
        for (size_t c = 0; l->head && c < cells_of(l); c++) l->head[c] = -1;
        l->n = 0;
    }
}

static int cell_along(const grid *g, const grid_level *l, int k, double x)
{
    double t = x - g->lo[k];
    if (g->periodic[k]) t -= g->length[k] * floor(t / g->length[k]);
    const double c = t * l->per_m[k];
    return c <= 0. ? 0 : c >= l->cells[k] - 1 ? l->cells[k] - 1 : (int)c;
}

void grid_enter(grid *g, size_t i)
{
    grid_level *l = &g->level[level_of(g, g->r[i])];
    const size_t a = (size_t)cell_along(g, l, 0, g->x[i][0]),
                 b = (size_t)cell_along(g, l, 1, g->x[i][1]),
                 c = (size_t)cell_along(g, l, 2, g->x[i][2]);
    int *head = &l->head[(c * (size_t)l->cells[1] + b) * (size_t)l->cells[0] + a];
    g->next[i] = *head;
    *head = (int)i;
    l->n++;
}

/* The cells along k that reach to within `reach` of x: from *from on, their number. */
static int stretch(const grid *g, const grid_level *l, int k, double x, double reach, int *from)
{
    if (!g->periodic[k]) {
        *from = cell_along(g, l, k, x - reach);
        return cell_along(g, l, k, x + reach) - *from + 1;
    }
    const int m = l->cells[k];
    const double t = x - g->lo[k] - g->length[k] * floor((x - g->lo[k]) / g->length[k]);
    const double begin = floor((t - reach) * l->per_m[k]), end = floor((t + reach) * l->per_m[k]);
    *from = 0;
    if (end - begin + 1 >= m) return m;
    *from = (int)(begin - m * floor(begin / m));
    return (int)(end - begin) + 1;
}

static int search_level(const grid *g, const grid_level *l, const double x[3], double reach,
                        grid_visitor *visit, void *context)
{
    int from[3], count[3];
    for (int k = 0; k < 3; k++) count[k] = stretch(g, l, k, x[k], reach, &from[k]);
    for (int c = 0; c < count[2]; c++)
        for (int b = 0; b < count[1]; b++)
            for (int a = 0; a < count[0]; a++) {
                const size_t cz = (size_t)((from[2] + c) % l->cells[2]),
                             cy = (size_t)((from[1] + b) % l->cells[1]),
                             cx = (size_t)((from[0] + a) % l->cells[0]);
                const size_t cell = (cz * (size_t)l->cells[1] + cy) * (size_t)l->cells[0] + cx;
                for (int j = l->head[cell]; j >= 0; j = g->next[j]) {
                    const int end_it = visit(context, j);
                    if (end_it) return end_it;
                }
            }
    return 0;
}

int grid_search(const grid *g, const double x[3], double radius, grid_visitor *visit, void *context)
{
    int end_it = 0;
    for (const grid_level *l = g->level; l < g->level + GRID_LEVELS && !end_it; l++)
        if (l->n > 0)
            end_it = search_level(g, l, x, radius + l->radius + g->reserve, visit, context);
    return end_it;
}
