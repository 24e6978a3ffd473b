/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demLevels.c - pairs of spheres of very different sizes: each found once, at linear cost.
 *
 * Cost is counted, not timed: distances computed and entries of the list, per sphere.
 */
/* Before the test library, whose `fail` is a macro. */
#include "dem_internal.h"
#include "levels.h"

#include "demRig.h"

#include <gsl/gsl_rng.h>
#include <stdlib.h>

/* ---- against all pairs ----------------------------------------------------------------------- */

enum { MANY = 700 };

static unsigned char seen[MANY][MANY];

static int mark(void *context, uint32_t i, uint32_t j, const double d[3], double d2)
{
    (void)d;
    (void)d2;
    (void)context;
    if (i == j || seen[i][j]) fail_msg("pair %u %u is found twice", i, j);
    seen[i][j] = seen[j][i] = 1;
    return 0;
}

/* Radii 1 to 20, overlapping freely; sizes in turn, so that levels are as mixed as they can be. */
static void every_pair(const double length[3], int mask, double skin, double ratio)
{
    static double pos[MANY][4];
    const double lo[3] = {-3, 5, 0}, hi[3] = {lo[0] + length[0], lo[1] + length[1], length[2]};
    const int periodic[3] = {mask & 1, mask >> 1 & 1, mask >> 2 & 1};
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int i = 0; i < MANY; i++) {
        for (int a = 0; a < 3; a++) pos[i][a] = lo[a] + length[a] * gsl_rng_uniform(rng);
        pos[i][3] = pow(ratio, (i % 50) / 49.);
    }
    gsl_rng_free(rng);
    memset(seen, 0, sizeof seen);
    levels g;
    assert_int_equal(levels_init(&g, lo, hi, periodic, MANY, (const double(*)[4])pos, skin), 0);
    for (uint32_t i = 0; i < MANY; i++) assert_int_equal(levels_partners(&g, i, mark, NULL), 0);
    int near = 0;
    for (int i = 0; i < MANY; i++)
        for (int j = 0; j < i; j++) {
            double d2 = 0, reach = pos[i][3] + pos[j][3] + skin;
            for (int a = 0; a < 3; a++) {
                double d = fabs(pos[i][a] - pos[j][a]);
                if (periodic[a]) d = fmin(d, length[a] - d);
                d2 += d * d;
            }
            int expected = d2 < reach * reach;
            near += expected;
            if (seen[i][j] != expected)
                fail_msg("pair %d %d of radii %g %g: found %d, expected %d", i, j, pos[i][3],
                         pos[j][3], seen[i][j], expected);
        }
    assert_true(near > MANY / 4 && near < MANY * MANY / 4);
    levels_free(&g);
}

static void all_pairs(void **state)
{
    (void)state;
    const double cube[3] = {120, 120, 120}, slab[3] = {700, 90, 85}, tight[3] = {82, 160, 300};
    for (int mask = 0; mask < 8; mask++)
        for (int k = 0; k < 2; k++) {
            every_pair(cube, mask, k, 20);
            every_pair(slab, mask, k, 20);
            every_pair(tight, mask, k, 20);
            every_pair((const double[3]){20, 16, 12}, mask, .1 * k, 1.5);
        }
}

/* ---- cost ------------------------------------------------------------------------------------ */

/* A lattice of m^3 small spheres, a tenth apart, and `large` ones of `ratio` times their size on
 * top: distances and entries per sphere for a list. */
static void cost(int m, int large, double ratio, double *checks, double *entries)
{
    rig r;
    const double R = 1e-3, h = 2.1 * R;
    double height = m * h;
    rig_init(&r, DEM_LINEAR, height + 2 * ratio * R * (large + 1));
    rig_start(&r);
    size_t n = 0, most = (size_t)(m * m * m + large);
    double(*x)[3] = malloc(most * sizeof *x), *radius = malloc(most * sizeof *radius);
    int *material = calloc(most, sizeof *material);
    for (int c = 0; c < m * m * m; c++, n++) {
        x[n][0] = (c % m + .5) * h;
        x[n][1] = (c / m % m + .5) * h;
        x[n][2] = (c / m / m + .5) * h;
        radius[n] = R;
    }
    for (int c = 0; c < large; c++, n++) {
        x[n][0] = 2.02 * ratio * R * c;
        x[n][1] = 0;
        x[n][2] = height + ratio * R;
        radius[n] = ratio * R;
    }
    assert_int_equal(dem_add(r.sim, n, (const double(*)[3])x, NULL, NULL, radius, material, NULL),
                     DEM_OK);
    rig_advance(&r, 1e-6, 1);
    *checks = (double)r.sim->list.checks / (double)n;
    *entries = (double)r.sim->list.row[n] / (double)n;
    dem_free(r.sim);
    free(x);
    free(radius);
    free(material);
}

/* Equal spheres set the measure. One that is larger, or some, must not multiply the work. */
static void linear_cost(void **state)
{
    (void)state;
    const int side[] = {14, 28};
    const struct {
        int large;
        double ratio;
    } mix[] = {{1, 1.9}, {1, 2.1}, {1, 20}, {1, 300}, {5, 20}};
    for (int s = 0; s < 2; s++) {
        double checks, entries, c, e;
        cost(side[s], 0, 1, &checks, &entries);
        print_message("%d equal spheres: %.1f distances, %.2f entries each\n",
                      side[s] * side[s] * side[s], checks, entries);
        assert_true(entries > 2);
        for (size_t k = 0; k < sizeof mix / sizeof *mix; k++) {
            cost(side[s], mix[k].large, mix[k].ratio, &c, &e);
            print_message("    and %d of %g times their size: %.1f, %.2f\n", mix[k].large,
                          mix[k].ratio, c, e);
            assert_true(c < 8 * checks);
            assert_true(e < 1.5 * entries + mix[k].large);
        }
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_pairs), cmocka_unit_test(linear_cost)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
