/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * neighbour.c - the Verlet list of pairs that may touch before the next rebuild.
 *
 * Equal spheres: cells (cells.h) are as wide as the range, 2 r_max + skin, or wider where the
 * domain is nearly empty. A pair of cells is visited from the lower one, so that all candidates of
 * a row are particles behind it in memory. Verlet, Phys. Rev. 159 (1967) 98,
 * doi:10.1103/PhysRev.159.98.
 *
 * On several ranks pairs are found among positions copied into the order of the rows, as if there
 * were one rank with those particles, and named by particle afterwards.
 *
 * Many sizes: levels.h finds the pairs in an order of its own; two stable counting sorts, by j and
 * then by i, put them into rows.
 */
#include "neighbour.h"

#include "levels.h"
#include "periodic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct range {
    uint32_t begin, end;
} range;

void neighbour_init(neighbour *list, const double lo[3], const double hi[3], const int periodic[3],
                    int shared)
{
    memset(list, 0, sizeof *list);
    list->shared = shared;
    for (int a = 0; a < 3; a++) {
        list->lo[a] = lo[a];
        list->hi[a] = hi[a];
        list->periodic[a] = periodic[a] != 0;
        list->any_periodic |= list->periodic[a];
    }
    for (int image = 0; image < 27; image++) {
        const int step[3] = {image % 3 - 1, image / 3 % 3 - 1, image / 9 - 1};
        for (int a = 0; a < 3; a++)
            list->shift[image][a] = list->periodic[a] ? step[a] * (hi[a] - lo[a]) : 0;
    }
}

void neighbour_free(neighbour *list)
{
    cells_free(&list->grid);
    free(list->slot);
    free(list->row_of);
    free(list->sorted);
    free(list->own);
    free(list->cell_first);
    free(list->cell);
    free(list->order);
    free(list->place);
    free(list->row);
    free(list->entry);
    free(list->pair);
    memset(list, 0, sizeof *list);
}

static int grow(void *slot, size_t bytes)
{
    void *grown = realloc(*(void **)slot, bytes ? bytes : 1);
    if (!grown) return 0;
    *(void **)slot = grown;
    return 1;
}

static dem_status reserve(neighbour *list, size_t n)
{
    if (list->row_capacity >= n + 1) return DEM_OK;
    size_t room = n + n / 2 + 1;
    if (!grow(&list->cell, room * sizeof *list->cell) ||
        !grow(&list->order, room * sizeof *list->order) ||
        !grow(&list->place, room * sizeof *list->place) ||
        !grow(&list->row, room * sizeof *list->row))
        return DEM_NO_MEMORY;
    if (list->shared && (!grow(&list->slot, room * sizeof *list->slot) ||
                         !grow(&list->row_of, room * sizeof *list->row_of) ||
                         !grow(&list->sorted, room * sizeof *list->sorted) ||
                         !grow(&list->own, room * sizeof *list->own)))
        return DEM_NO_MEMORY;
    list->row_capacity = room;
    return DEM_OK;
}

static dem_status reserve_cells(neighbour *list, size_t n)
{
    if (n + 2 <= list->cell_capacity) return DEM_OK;
    if (!grow(&list->cell_first, (n + 2) * sizeof *list->cell_first)) return DEM_NO_MEMORY;
    list->cell_capacity = n + 2;
    return DEM_OK;
}

void neighbour_wrap(const neighbour *list, particles *p)
{
    for (size_t i = 0; i < p->n && list->any_periodic; i++)
        wrap_into(p->pos[i], list->lo, list->hi, list->periodic);
}

extent neighbour_extent(const particles *p)
{
    extent e = {.n = (double)p->n};
    for (int a = 0; a < 3; a++) {
        double lo = INFINITY, hi = -INFINITY;
        for (size_t i = 0; i < p->n; i++) {
            double x = p->pos[i][a];
            lo = x < lo ? x : lo;
            hi = x > hi ? x : hi;
        }
        e.lo[a] = lo;
        e.hi[a] = hi;
    }
    return e;
}

/* Counting sort by cell, then by id within each cell: a few particles, so by insertion. */
static void sort_order(neighbour *list, const particles *p, size_t n)
{
    uint32_t *first = list->cell_first;
    const size_t n_cell = list->grid.n;
    memset(first, 0, (n_cell + 2) * sizeof *first);
    for (size_t i = 0; i < n; i++) first[list->cell[i] + 2]++;
    for (size_t c = 2; c < n_cell + 2; c++) first[c] += first[c - 1];
    for (size_t i = 0; i < n; i++) list->order[first[list->cell[i] + 1]++] = (uint32_t)i;
    for (size_t c = 0; c < n_cell; c++)
        for (uint32_t k = first[c] + 1; k < first[c + 1]; k++) {
            uint32_t moving = list->order[k], to = k;
            for (; to > first[c] && p->id[list->order[to - 1]] > p->id[moving]; to--)
                list->order[to] = list->order[to - 1];
            list->order[to] = moving;
        }
}

/* Own particles in front, ghosts behind; order[] becomes that of the particles. */
static void part_ghosts(neighbour *list, const particles *p)
{
    uint32_t own = 0, ghost = (uint32_t)p->n;
    for (size_t r = 0; r < list->n_row; r++) {
        const uint32_t old = list->order[r];
        list->own[r] = old < p->n;
        list->slot[r] = list->own[r] ? own++ : ghost++;
        list->place[old] = list->slot[r];
    }
    for (size_t old = 0; old < list->n_row; old++) list->order[list->place[old]] = (uint32_t)old;
    for (size_t r = 0; r < list->n_row; r++) list->row_of[list->slot[r]] = (uint32_t)r;
}

dem_status neighbour_sort(neighbour *list, particles *p, const extent *all, double reach)
{
    const size_t n = p->n + p->n_ghost;
    list->n_row = n;
    if (reserve(list, n)) return DEM_NO_MEMORY;
    if (cells_lay(&list->grid, list->lo, list->hi, list->periodic, all, reach,
                  (const double(*)[4])p->pos, n) ||
        reserve_cells(list, list->grid.n))
        return DEM_NO_MEMORY;
    for (size_t i = 0; i < n; i++) list->cell[i] = cells_of(&list->grid, p->pos[i]);
    sort_order(list, p, n);
    if (list->shared)
        part_ghosts(list, p);
    else
        for (size_t i = 0; i < n; i++) list->place[list->order[i]] = (uint32_t)i;
    int sorted = 1;
    for (size_t i = 0; i < n; i++) sorted &= list->order[i] == i;
    if (!sorted && particles_permute(p, list->order)) return DEM_NO_MEMORY;
    for (size_t r = 0; r < n && list->shared; r++)
        memcpy(list->sorted[r], p->pos[list->slot[r]], sizeof *list->sorted);
    return DEM_OK;
}

/* Ranges of rows in a cell and in its neighbours behind it. */
static int candidates(const neighbour *list, const int at[3], range *out, int *inner)
{
    uint32_t cell[27];
    const int cells = cells_behind(&list->grid, at, cell, inner);
    int n = 0;
    for (int k = 0; k < cells; k++) {
        const range r = {list->cell_first[cell[k]], list->cell_first[cell[k] + 1]};
        if (r.begin == r.end) continue;
        if (n && out[n - 1].end == r.begin)
            out[n - 1].end = r.end;
        else
            out[n++] = r;
    }
    return n;
}

static uint32_t nearest_image(const neighbour *list, double d[3])
{
    static const int weight[3] = {1, 3, 9};
    int image = NEIGHBOUR_HOME;
    for (int a = 0; a < 3; a++) {
        if (!list->periodic[a]) continue;
        double half = .5 * (list->hi[a] - list->lo[a]);
        int step = d[a] > half ? 1 : d[a] < -half ? -1 : 0;
        d[a] -= step * 2 * half;
        image += step * weight[a];
    }
    return (uint32_t)image;
}

/* Partners of the row i among the rows begin..end-1; returns the new end of the row. */
static inline __attribute__((always_inline)) size_t fill_row(neighbour *list,
                                                             const double (*pos)[4], uint32_t i,
                                                             range r, size_t at, uint32_t home,
                                                             int periodic, int shared)
{
    const double *xi = pos[i];
    const double reach = xi[3] + list->skin;
    const int own = shared ? list->own[i] : 1;
    for (uint32_t j = r.begin; j < r.end; j++) {
        const double *xj = pos[j];
        double d[3] = {xi[0] - xj[0], xi[1] - xj[1], xi[2] - xj[2]};
        const uint32_t image = periodic ? nearest_image(list, d) : home;
        const double s = reach + xj[3];
        const int near = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < s * s;
        list->entry[at] = j | image << NEIGHBOUR_BITS;
        at += (size_t)(shared ? near & (own | list->own[j]) : near);
    }
    return at;
}

/* inner: no candidate is beyond a periodic side, so that partners are what they are themselves. */
static size_t fill_range(neighbour *list, const double (*pos)[4], uint32_t i, range r, size_t at,
                         int inner)
{
    const uint32_t home = list->any_periodic ? NEIGHBOUR_HOME : 0;
    if (list->shared)
        return inner ? fill_row(list, pos, i, r, at, home, 0, 1)
                     : fill_row(list, pos, i, r, at, home, 1, 1);
    return inner ? fill_row(list, pos, i, r, at, home, 0, 0)
                 : fill_row(list, pos, i, r, at, home, 1, 0);
}

/* Room for `need` entries. */
static dem_status reserve_entries(neighbour *list, size_t need)
{
    if (need <= list->entry_capacity) return DEM_OK;
    size_t room = need + need / 2;
    if (!grow(&list->entry, room * sizeof *list->entry)) return DEM_NO_MEMORY;
    list->entry_capacity = room;
    return DEM_OK;
}

static dem_status fill_even(neighbour *list, const double (*pos)[4])
{
    size_t at = 0;
    int cell[3] = {0, 0, 0};
    range r[27];
    for (size_t c = 0; c < list->grid.n; c++, cells_next(&list->grid, cell)) {
        uint32_t begin = list->cell_first[c], end = list->cell_first[c + 1];
        if (begin == end) continue;
        int inner, n = candidates(list, cell, r, &inner);
        size_t most = 0;
        for (int k = 0; k < n; k++) most += r[k].end - r[k].begin;
        size_t need = at + most * (end - begin) + NEIGHBOUR_SPARE;
        if (reserve_entries(list, need)) return DEM_NO_MEMORY;
        list->checks += most * (end - begin);
        for (uint32_t i = begin; i < end; i++) {
            list->row[i] = at;
            /* One range begins with the cell itself: only what comes after i counts. */
            for (int k = 0; k < n; k++) {
                range part = r[k];
                if (part.begin <= i && i < part.end) part.begin = i + 1;
                at = fill_range(list, pos, i, part, at, inner);
            }
        }
    }
    list->row[list->n_row] = at;
    return DEM_OK;
}

/* ---- many sizes ------------------------------------------------------------------------------ */

typedef struct finding {
    neighbour *list;
    const double (*pos)[4];
    size_t n; /* pairs so far */
} finding;

/* The lower row of a pair goes first, the other as an entry of it. */
static int keep_pair(void *context, uint32_t i, uint32_t j, const double d[3], double d2)
{
    (void)d;
    (void)d2;
    finding *f = context;
    neighbour *list = f->list;
    if (list->shared && !list->own[i] && !list->own[j]) return DEM_OK;
    if (f->n == list->pair_capacity) {
        size_t room = 2 * f->n + 1024;
        if (!grow(&list->pair, room * sizeof *list->pair)) return DEM_NO_MEMORY;
        list->pair_capacity = room;
    }
    const double *low = f->pos[i < j ? i : j], *high = f->pos[i < j ? j : i];
    double apart[3] = {low[0] - high[0], low[1] - high[1], low[2] - high[2]};
    uint32_t image = list->any_periodic ? nearest_image(list, apart) : 0;
    list->pair[f->n][0] = i < j ? i : j;
    list->pair[f->n++][1] = (i < j ? j : i) | image << NEIGHBOUR_BITS;
    return DEM_OK;
}

/* row[k]: where the pairs with k = key & NEIGHBOUR_MASK begin after a stable sort by that key. */
static void count_pairs(neighbour *list, size_t n, size_t pairs, int key)
{
    memset(list->row, 0, (n + 1) * sizeof *list->row);
    for (size_t k = 0; k < pairs; k++) list->row[(list->pair[k][key] & NEIGHBOUR_MASK) + 1]++;
    for (size_t i = 0; i < n; i++) list->row[i + 1] += list->row[i];
}

static dem_status pairs_to_rows(neighbour *list, size_t n, size_t pairs)
{
    uint32_t(*by_j)[2] = malloc((pairs + 1) * sizeof *by_j);
    if (!by_j || reserve_entries(list, pairs + NEIGHBOUR_SPARE)) {
        free(by_j);
        return DEM_NO_MEMORY;
    }
    count_pairs(list, n, pairs, 1);
    for (size_t k = 0; k < pairs; k++)
        memcpy(by_j[list->row[list->pair[k][1] & NEIGHBOUR_MASK]++], list->pair[k], sizeof *by_j);
    count_pairs(list, n, pairs, 0);
    for (size_t k = 0; k < pairs; k++) list->entry[list->row[by_j[k][0]]++] = by_j[k][1];
    /* Each begin has run on to its end, the begin of the next row. */
    memmove(list->row + 1, list->row, n * sizeof *list->row);
    list->row[0] = 0;
    free(by_j);
    return DEM_OK;
}

static dem_status fill_uneven(neighbour *list, const double (*pos)[4])
{
    levels g;
    dem_status status =
        levels_init(&g, list->lo, list->hi, list->periodic, list->n_row, pos, list->skin);
    if (status) return status;
    finding f = {list, pos, 0};
    for (size_t i = 0; i < list->n_row && !status; i++)
        status = (dem_status)levels_partners(&g, (uint32_t)i, keep_pair, &f);
    list->checks = g.checks;
    levels_free(&g);
    return status ? status : pairs_to_rows(list, list->n_row, f.n);
}

/* ---- the list ---------------------------------------------------------------------------------
 */

/* From rows to particles. */
static void name_particles(neighbour *list, size_t entries)
{
    for (size_t k = 0; k < entries; k++) {
        const uint32_t entry = list->entry[k];
        list->entry[k] = list->slot[entry & NEIGHBOUR_MASK] | (entry & ~NEIGHBOUR_MASK);
    }
}

dem_status neighbour_fill(neighbour *list, particles *p, int uneven)
{
    const double(*pos)[4] = (const double(*)[4])(list->shared ? list->sorted : p->pos);
    list->checks = 0;
    list->ascending = uneven;
    dem_status status = uneven ? fill_uneven(list, pos) : fill_even(list, pos);
    if (!status) status = reserve_entries(list, list->row[list->n_row] + NEIGHBOUR_SPARE);
    if (status) return status;
    size_t at = list->row[list->n_row];
    if (list->shared) name_particles(list, at);
    memset(list->entry + at, 0, NEIGHBOUR_SPARE * sizeof *list->entry);
    if (p->n) memcpy(p->built, p->pos, p->n * sizeof *p->pos);
    list->moved = 0;
    list->valid = 1;
    return DEM_OK;
}

size_t neighbour_find(const neighbour *list, uint32_t i, uint32_t j)
{
    const uint32_t first = neighbour_row(list, i), second = neighbour_row(list, j);
    size_t k = list->row[first], end = list->row[first + 1];
    if (!list->ascending) {
        while (k < end && (list->entry[k] & NEIGHBOUR_MASK) != j) k++;
        return k;
    }
    /* The row of a large sphere is long: halve it. */
    for (size_t behind = end; k < behind;) {
        size_t middle = k + (behind - k) / 2;
        if (neighbour_row(list, list->entry[middle] & NEIGHBOUR_MASK) < second)
            k = middle + 1;
        else
            behind = middle;
    }
    return k < end && (list->entry[k] & NEIGHBOUR_MASK) == j ? k : end;
}

typedef struct search {
    const neighbour *list;
    size_t n; /* particles of this rank */
    neighbour_visit *visit;
    void *context;
} search;

static int visit_cell(void *context, uint32_t cell)
{
    const search *s = context;
    const uint32_t *first = s->list->cell_first;
    int end_it = 0;
    for (uint32_t r = first[cell]; r < first[cell + 1] && !end_it; r++) {
        const uint32_t i = neighbour_slot(s->list, r);
        if (i < s->n) end_it = s->visit(s->context, i);
    }
    return end_it;
}

int neighbour_near(const neighbour *list, const particles *p, const double lo[3],
                   const double hi[3], neighbour_visit *visit, void *context)
{
    int end_it = 0;
    for (size_t i = 0; i < p->n && !list->valid && !end_it; i++)
        end_it = visit(context, (uint32_t)i);
    if (!list->valid) return end_it;
    /* Cells know where particles were when the list was built. */
    const double skin = list->skin, from[3] = {lo[0] - skin, lo[1] - skin, lo[2] - skin};
    const double to[3] = {hi[0] + skin, hi[1] + skin, hi[2] + skin};
    search s = {list, p->n, visit, context};
    return cells_in_box(&list->grid, from, to, visit_cell, &s);
}

double neighbour_displacement(const particles *p)
{
    double most = 0;
    for (size_t i = 0; i < p->n; i++) {
        const double *x = p->pos[i], *b = p->built[i];
        double dx = x[0] - b[0], dy = x[1] - b[1], dz = x[2] - b[2];
        double d2 = dx * dx + dy * dy + dz * dz;
        most = d2 > most ? d2 : most;
    }
    return sqrt(most);
}
