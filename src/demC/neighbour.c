/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * neighbour.c - linked cells and the Verlet list of pairs that may touch before the next rebuild.
 *
 * Equal spheres: cells are as wide as the range, 2 r_max + skin, or wider where the domain is
 * nearly empty. Cells
 * are numbered with x fastest and a pair of cells is visited from the lower one, so that all
 * candidates of a row are particles behind it in memory. Verlet, Phys. Rev. 159 (1967) 98,
 * doi:10.1103/PhysRev.159.98; Hockney & Eastwood, Computer Simulation Using Particles (1988) ch. 8.
 *
 * Many sizes: levels.h finds the pairs in an order of its own; two stable counting sorts, by j and
 * then by i, put them into rows.
 */
#include "neighbour.h"

#include "levels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct range {
    uint32_t begin, end;
} range;

void neighbour_init(neighbour *list, const double lo[3], const double hi[3], const int periodic[3])
{
    memset(list, 0, sizeof *list);
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
    list->row_capacity = room;
    return DEM_OK;
}

/* Bring positions into the box in periodic directions. */
static void wrap(const neighbour *list, particles *p)
{
    for (int a = 0; a < 3; a++) {
        if (!list->periodic[a]) continue;
        double lo = list->lo[a], length = list->hi[a] - lo;
        for (size_t i = 0; i < p->n; i++) {
            double x = p->pos[i][a] - floor((p->pos[i][a] - lo) / length) * length;
            p->pos[i][a] = x < list->hi[a] ? x : lo;
        }
    }
}

/* The grid covers the particles (the domain in periodic directions). */
static dem_status lay_grid(neighbour *list, const particles *p, double reach)
{
    double extent[3];
    for (int a = 0; a < 3; a++) {
        double lo = list->lo[a], hi = list->hi[a];
        if (!list->periodic[a] && p->n) {
            lo = hi = p->pos[0][a];
            for (size_t i = 1; i < p->n; i++) {
                double x = p->pos[i][a];
                lo = x < lo ? x : lo;
                hi = x > hi ? x : hi;
            }
        }
        list->origin[a] = lo;
        extent[a] = hi - lo;
    }
    /* More than a few cells per particle would cost memory and time for nothing. */
    double most = 4. * (double)p->n + 64, wide = reach, count;
    for (;; wide *= 1.26) {
        count = 1;
        for (int a = 0; a < 3; a++) count *= fmax(1, floor(extent[a] / wide));
        if (count <= most) break;
    }
    list->n_cell = 1;
    for (int a = 0; a < 3; a++) {
        list->cells[a] = (int)fmax(1, floor(extent[a] / wide));
        list->per_width[a] = extent[a] > 0 ? list->cells[a] / extent[a] : 0;
        list->n_cell *= (size_t)list->cells[a];
    }
    if (list->n_cell + 2 > list->cell_capacity) {
        if (!grow(&list->cell_first, (list->n_cell + 2) * sizeof *list->cell_first))
            return DEM_NO_MEMORY;
        list->cell_capacity = list->n_cell + 2;
    }
    return DEM_OK;
}

static uint32_t cell_of(const neighbour *list, const double x[3])
{
    int c[3];
    for (int a = 0; a < 3; a++) {
        c[a] = (int)((x[a] - list->origin[a]) * list->per_width[a]);
        if (c[a] > list->cells[a] - 1) c[a] = list->cells[a] - 1;
        if (c[a] < 0) c[a] = 0;
    }
    return (uint32_t)((c[2] * list->cells[1] + c[1]) * list->cells[0] + c[0]);
}

/* Counting sort by cell, then by id within each cell: a few particles, so by insertion. */
static void sort_order(neighbour *list, const particles *p)
{
    uint32_t *first = list->cell_first;
    memset(first, 0, (list->n_cell + 2) * sizeof *first);
    for (size_t i = 0; i < p->n; i++) first[list->cell[i] + 2]++;
    for (size_t c = 2; c < list->n_cell + 2; c++) first[c] += first[c - 1];
    for (size_t i = 0; i < p->n; i++) list->order[first[list->cell[i] + 1]++] = (uint32_t)i;
    for (size_t c = 0; c < list->n_cell; c++)
        for (uint32_t k = first[c] + 1; k < first[c + 1]; k++) {
            uint32_t moving = list->order[k], to = k;
            for (; to > first[c] && p->id[list->order[to - 1]] > p->id[moving]; to--)
                list->order[to] = list->order[to - 1];
            list->order[to] = moving;
        }
}

dem_status neighbour_sort(neighbour *list, particles *p, double reach)
{
    wrap(list, p);
    return neighbour_sort_again(list, p, reach);
}

dem_status neighbour_sort_again(neighbour *list, particles *p, double reach)
{
    dem_status status = reserve(list, p->n);
    if (status) return status;
    if ((status = lay_grid(list, p, reach))) return status;
    for (size_t i = 0; i < p->n; i++) list->cell[i] = cell_of(list, p->pos[i]);
    sort_order(list, p);
    int sorted = 1;
    for (size_t i = 0; i < p->n; i++) {
        list->place[list->order[i]] = (uint32_t)i;
        sorted &= list->order[i] == i;
    }
    return sorted ? DEM_OK : particles_permute(p, list->order);
}

/* Ranges of particles in the cell c and in those of its neighbours that come after it. */
static int candidates(const neighbour *list, size_t c, range *out)
{
    const int *m = list->cells;
    int at[3] = {(int)(c % (size_t)m[0]), (int)(c / (size_t)m[0] % (size_t)m[1]),
                 (int)(c / (size_t)m[0] / (size_t)m[1])};
    int from[3], to[3], n = 0;
    for (int a = 0; a < 3; a++) {
        /* With one or two cells in a periodic direction some neighbours are the same cell. */
        from[a] = list->periodic[a] ? (m[a] > 2 ? -1 : 0) : (at[a] > 0 ? -1 : 0);
        to[a] = list->periodic[a] ? (m[a] > 1 ? 1 : 0) : (at[a] < m[a] - 1 ? 1 : 0);
    }
    for (int z = from[2]; z <= to[2]; z++)
        for (int y = from[1]; y <= to[1]; y++)
            for (int x = from[0]; x <= to[0]; x++) {
                int cx = (at[0] + x + m[0]) % m[0], cy = (at[1] + y + m[1]) % m[1],
                    cz = (at[2] + z + m[2]) % m[2];
                size_t other = ((size_t)cz * (size_t)m[1] + (size_t)cy) * (size_t)m[0] + (size_t)cx;
                if (other < c) continue;
                range r = {list->cell_first[other], list->cell_first[other + 1]};
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

/* Partners of i among the particles begin..end-1; returns the new end of the row. */
static size_t fill_row(neighbour *list, const particles *p, size_t i, range r, size_t at)
{
    const double *xi = p->pos[i];
    double reach = xi[3] + list->skin;
    if (!list->any_periodic) {
        for (uint32_t j = r.begin; j < r.end; j++) {
            const double *xj = p->pos[j];
            double dx = xi[0] - xj[0], dy = xi[1] - xj[1], dz = xi[2] - xj[2];
            double s = reach + xj[3];
            list->entry[at] = j;
            at += dx * dx + dy * dy + dz * dz < s * s;
        }
        return at;
    }
    for (uint32_t j = r.begin; j < r.end; j++) {
        const double *xj = p->pos[j];
        double d[3] = {xi[0] - xj[0], xi[1] - xj[1], xi[2] - xj[2]};
        uint32_t image = nearest_image(list, d);
        double s = reach + xj[3];
        list->entry[at] = j | image << NEIGHBOUR_BITS;
        at += d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < s * s;
    }
    return at;
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

static dem_status fill_even(neighbour *list, const particles *p)
{
    size_t at = 0;
    range r[27];
    for (size_t c = 0; c < list->n_cell; c++) {
        uint32_t begin = list->cell_first[c], end = list->cell_first[c + 1];
        if (begin == end) continue;
        int n = candidates(list, c, r);
        size_t most = 0;
        for (int k = 0; k < n; k++) most += r[k].end - r[k].begin;
        size_t need = at + most * (end - begin) + NEIGHBOUR_SPARE;
        if (reserve_entries(list, need)) return DEM_NO_MEMORY;
        list->checks += most * (end - begin);
        for (uint32_t i = begin; i < end; i++) {
            list->row[i] = at;
            /* The first range begins with the cell itself: only what comes after i counts. */
            for (int k = 0; k < n; k++) {
                range part = r[k];
                if (part.begin <= i && i < part.end) part.begin = i + 1;
                at = fill_row(list, p, i, part, at);
            }
        }
    }
    list->row[p->n] = at;
    return DEM_OK;
}

/* ---- many sizes ------------------------------------------------------------------------------ */

typedef struct finding {
    neighbour *list;
    const particles *p;
    size_t n; /* pairs so far */
} finding;

/* The lower index of a pair goes first, the other as an entry of its row. */
static int keep_pair(void *context, uint32_t i, uint32_t j, const double d[3], double d2)
{
    (void)d;
    (void)d2;
    finding *f = context;
    neighbour *list = f->list;
    if (f->n == list->pair_capacity) {
        size_t room = 2 * f->n + 1024;
        if (!grow(&list->pair, room * sizeof *list->pair)) return DEM_NO_MEMORY;
        list->pair_capacity = room;
    }
    const double *low = f->p->pos[i < j ? i : j], *high = f->p->pos[i < j ? j : i];
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

static dem_status fill_uneven(neighbour *list, const particles *p)
{
    levels g;
    dem_status status = levels_init(&g, list->lo, list->hi, list->periodic, p->n,
                                    (const double(*)[4])p->pos, list->skin);
    if (status) return status;
    finding f = {list, p, 0};
    for (size_t i = 0; i < p->n && !status; i++)
        status = (dem_status)levels_partners(&g, (uint32_t)i, keep_pair, &f);
    list->checks = g.checks;
    levels_free(&g);
    return status ? status : pairs_to_rows(list, p->n, f.n);
}

size_t neighbour_find(const neighbour *list, uint32_t i, uint32_t j)
{
    size_t k = list->row[i], end = list->row[i + 1];
    if (!list->ascending) {
        while (k < end && (list->entry[k] & NEIGHBOUR_MASK) != j) k++;
        return k;
    }
    /* The row of a large sphere is long: halve it. */
    for (size_t behind = end; k < behind;) {
        size_t middle = k + (behind - k) / 2;
        if ((list->entry[middle] & NEIGHBOUR_MASK) < j)
            k = middle + 1;
        else
            behind = middle;
    }
    return k < end && (list->entry[k] & NEIGHBOUR_MASK) == j ? k : end;
}

dem_status neighbour_fill(neighbour *list, particles *p, int uneven)
{
    list->checks = 0;
    list->ascending = uneven;
    dem_status status = uneven ? fill_uneven(list, p) : fill_even(list, p);
    if (status) return status;
    size_t at = list->row[p->n];
    if (list->entry) memset(list->entry + at, 0, NEIGHBOUR_SPARE * sizeof *list->entry);
    if (p->n) memcpy(p->built, p->pos, p->n * sizeof *p->pos);
    list->moved = 0;
    list->valid = 1;
    return DEM_OK;
}

/* The cells along a that cover lo..hi: from *from on, their number. */
static int stretch(const neighbour *list, int a, double lo, double hi, int *from)
{
    const int m = list->cells[a];
    const double begin = floor((lo - list->origin[a]) * list->per_width[a]);
    const double end = floor((hi - list->origin[a]) * list->per_width[a]);
    *from = 0;
    if (!list->periodic[a]) {
        *from = (int)fmin(fmax(begin, 0), m - 1);
        return (int)fmin(fmax(end, 0), m - 1) - *from + 1;
    }
    if (end - begin + 1 >= m) return m;
    *from = (int)(begin - m * floor(begin / m));
    return (int)(end - begin) + 1;
}

int neighbour_near(const neighbour *list, const particles *p, const double lo[3],
                   const double hi[3], neighbour_visit *visit, void *context)
{
    int from[3], count[3], end_it = 0;
    if (!list->valid) {
        for (size_t i = 0; i < p->n && !end_it; i++) end_it = visit(context, (uint32_t)i);
        return end_it;
    }
    /* Cells know where particles were when the list was built. */
    for (int a = 0; a < 3; a++)
        count[a] = stretch(list, a, lo[a] - list->skin, hi[a] + list->skin, &from[a]);
    for (int k = 0; k < count[0] * count[1] * count[2] && !end_it; k++) {
        const size_t x = (size_t)((from[0] + k % count[0]) % list->cells[0]),
                     y = (size_t)((from[1] + k / count[0] % count[1]) % list->cells[1]),
                     z = (size_t)((from[2] + k / count[0] / count[1]) % list->cells[2]);
        const size_t c = (z * (size_t)list->cells[1] + y) * (size_t)list->cells[0] + x;
        for (uint32_t i = list->cell_first[c]; i < list->cell_first[c + 1] && !end_it; i++)
            end_it = visit(context, i);
    }
    return end_it;
}

int neighbour_holds(neighbour *list, const particles *p, double speed_dt)
{
    if (!list->valid) return 0;
    /* Sum of the largest steps: an upper bound that costs nothing. Only when it is used up is the
     * largest displacement looked for. A rebuild is due a little early, at .9 of skin/2, so that
     * the search is not repeated in every one of the last steps. */
    list->moved += speed_dt;
    if (list->moved < .5 * list->skin) return 1;
    double most = 0;
    for (size_t i = 0; i < p->n; i++) {
        const double *x = p->pos[i], *b = p->built[i];
        double dx = x[0] - b[0], dy = x[1] - b[1], dz = x[2] - b[2];
        double d2 = dx * dx + dy * dy + dz * dz;
        most = d2 > most ? d2 : most;
    }
    list->moved = sqrt(most);
    return list->moved < .45 * list->skin;
}
