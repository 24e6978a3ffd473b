/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demCells.c - linked cells in tiles: their order, their neighbours, and the list made with them.
 *
 * Grids around the width of a tile and several tiles wide, with and without periodic sides, whole
 * and with planes left out, against neighbours and pairs found by looking at all.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <gsl/gsl_rng.h>

#include "../../src/demC/cells.h"
#include "../../src/demC/neighbour.h"

enum { T = CELLS_TILE };

/* Cells of width 1 from 0 on: the centres of those whose planes are kept. */
typedef struct site {
    int size[3], kept[3], plane[3][3 * T];
    size_t n;
    double (*centre)[4];
} site;

static site site_of(const int size[3], gsl_rng *rng)
{
    site s = {.n = 1};
    for (int a = 0; a < 3; a++) {
        s.size[a] = size[a];
        for (int p = 0; p < size[a]; p++)
            if (!rng || p == 0 || gsl_rng_uniform(rng) < .6) s.plane[a][s.kept[a]++] = p;
        s.n *= (size_t)s.kept[a];
    }
    s.centre = malloc(s.n * sizeof *s.centre);
    size_t n = 0;
    for (int z = 0; z < s.kept[2]; z++)
        for (int y = 0; y < s.kept[1]; y++)
            for (int x = 0; x < s.kept[0]; x++, n++) {
                const int at[3] = {x, y, z};
                for (int a = 0; a < 3; a++) s.centre[n][a] = s.plane[a][at[a]] + .5;
                s.centre[n][3] = .5;
            }
    return s;
}

static void lay(cells *g, const site *s, int mask)
{
    const int periodic[3] = {mask & 1, mask >> 1 & 1, mask >> 2};
    extent all = {.n = s->size[0] * s->size[1] * s->size[2]};
    for (int a = 0; a < 3; a++) all.hi[a] = s->size[a];
    assert_int_equal(
        cells_lay(g, all.lo, all.hi, periodic, &all, 1, (const double(*)[4])s->centre, s->n),
        DEM_OK);
    assert_int_equal(g->n, s->n);
}

/* Number in the grid of the cell `at` of another that has fewer planes. */
static uint32_t number_in(const cells *g, const cells *part, const int at[3])
{
    double x[3];
    for (int a = 0; a < 3; a++) x[a] = part->plane[a][at[a]] + .5;
    return cells_of(g, x);
}

/* The walk meets every cell once, by its number, and begins anew; whoever leaves planes out has the
 * others in the same order. */
static void check_order(const cells *whole, const cells *part)
{
    int at[3] = {0, 0, 0};
    int64_t last = -1;
    for (uint32_t c = 0; c < part->n; c++, cells_next(part, at)) {
        assert_int_equal(number_in(part, part, at), c);
        const int64_t number = number_in(whole, part, at);
        assert_true(number > last);
        last = number;
    }
    assert_true(at[0] == 0 && at[1] == 0 && at[2] == 0);
}

static int adjacent(const cells *g, const int p[3], const int q[3])
{
    for (int a = 0; a < 3; a++) {
        const int d = abs(g->plane[a][p[a]] - g->plane[a][q[a]]), m = g->planes[a];
        if (d > 1 && !(g->periodic[a] && d == m - 1)) return 0;
    }
    return 1;
}

/* Every two neighbours are met from the lower one, once; each cell is its own neighbour. */
static void check_neighbours(const cells *g)
{
    int(*place)[3] = malloc(g->n * sizeof *place), at[3] = {0, 0, 0}, inner;
    uint8_t *met = malloc(g->n);
    for (size_t c = 0; c < g->n; c++, cells_next(g, at)) memcpy(place[c], at, sizeof at);
    for (size_t c = 0; c < g->n; c++) {
        uint32_t behind[27];
        const int n = cells_behind(g, place[c], behind, &inner);
        memset(met, 0, g->n);
        for (int k = 0; k < n; k++) met[behind[k]]++;
        int side = 0;
        for (int a = 0; a < 3; a++) {
            const int p = g->plane[a][place[c][a]];
            side |= g->periodic[a] && (p == 0 || p == g->planes[a] - 1);
        }
        assert_false(inner && side);
        for (size_t o = 0; o < g->n; o++)
            assert_int_equal(met[o], o >= c && adjacent(g, place[c], place[o]));
    }
    free(place);
    free(met);
}

static void tiles_of_every_width(void **state)
{
    (void)state;
    static const int size[][3] = {{1, 1, 1},         {2, 2, 2},     {T - 1, T, 3},
                                  {T + 1, T - 1, 2}, {2 * T, T, 3}, {2 * T + 1, 2 * T - 1, 2},
                                  {3 * T, 5, 4},     {3, 3 * T, 1}, {3 * T, 2 * T + 3, 3}};
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (size_t k = 0; k < sizeof size / sizeof *size; k++)
        for (int mask = 0; mask < 8; mask++) {
            site all = site_of(size[k], NULL), some = site_of(size[k], rng);
            cells whole = {0}, part = {0};
            lay(&whole, &all, mask);
            lay(&part, &some, mask);
            check_order(&whole, &whole);
            check_order(&whole, &part);
            check_neighbours(&part);
            if (mask == 0 || mask == 7) check_neighbours(&whole);
            cells_free(&whole);
            cells_free(&part);
            free(all.centre);
            free(some.centre);
        }
    gsl_rng_free(rng);
}

/* Spheres of radius .5 at random in a box some tiles wide: the pairs of the list are those within
 * the range, each in the row of the one that comes first. */
static void pairs_across_tiles(void **state)
{
    (void)state;
    enum { N = 4000 };
    const double lo[3] = {0, 0, 0}, hi[3] = {2.6 * T, 3.3 * T, 5}, skin = .15, range = 1 + skin;
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int mask = 0; mask < 8; mask++) {
        const int periodic[3] = {mask & 1, mask >> 1 & 1, mask >> 2};
        particles p;
        neighbour list;
        assert_int_equal(particles_init(&p), DEM_OK);
        assert_int_equal(particles_reserve(&p, N), DEM_OK);
        neighbour_init(&list, lo, hi, periodic, 0);
        list.skin = skin;
        for (int i = 0; i < N; i++) {
            double x[3];
            for (int a = 0; a < 3; a++) x[a] = hi[a] * gsl_rng_uniform(rng);
            particles_append(&p, x, lo, lo, .5, 1, 0, i);
        }
        const extent all = neighbour_extent(&p);
        assert_int_equal(neighbour_sort(&list, &p, &all, range), DEM_OK);
        assert_int_equal(neighbour_fill(&list, &p, 0), DEM_OK);
        assert_true(list.grid.planes[0] > 2 * T && list.grid.planes[1] > 2 * T);
        size_t pairs = 0;
        for (uint32_t i = 0; i < N; i++)
            for (uint32_t j = i + 1; j < N; j++) {
                double d2 = 0;
                for (int a = 0; a < 3; a++) {
                    double d = p.pos[i][a] - p.pos[j][a];
                    if (periodic[a]) d -= hi[a] * nearbyint(d / hi[a]);
                    d2 += d * d;
                }
                if (d2 >= range * range) continue;
                pairs++;
                assert_true(neighbour_find(&list, i, j) < list.row[i + 1]);
            }
        assert_true(pairs > N);
        assert_int_equal(list.row[N], pairs);
        particles_free(&p);
        neighbour_free(&list);
    }
    gsl_rng_free(rng);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_of_every_width),
        cmocka_unit_test(pairs_across_tiles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
