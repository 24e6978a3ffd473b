/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Creation of particles: no overlap (every pair is looked at), bounds, numbers, randomness against
 * the statistics of independent points and of hard spheres, reproducibility, refusals.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dem.h"
#include "insert.h"
#include "near.h"

static const double PI = 3.14159265358979323846;

typedef struct cloud {
    arrivals made;
    double (*x)[3], (*v)[3]; /* of them */
    size_t n;
    dem_status status;
    char message[512];
} cloud;

static const dem_material MATERIAL[2] = {{.name = "glass", .density = 2470},
                                         {.name = "steel", .density = 7830}};

static const int NEVER[3] = {0, 0, 0}, ALWAYS[3] = {1, 1, 1};

static cloud create(const dem_insertion *ins, const double lo[3], const double hi[3],
                    const int periodic[3], const cloud *old, const double *r_old)
{
    cloud c;
    const insert_place place = {.lo = lo,
                                .hi = hi,
                                .periodic = periodic,
                                .n_old = old ? old->n : 0,
                                .x_old = old ? (const double(*)[3])old->x : NULL,
                                .r_old = r_old,
                                .n_material = 2,
                                .material = MATERIAL};
    c.status = insert_particles(ins, &place, &c.made, c.message, sizeof c.message);
    c.x = c.made.x;
    c.v = c.made.v;
    c.n = c.made.n;
    return c;
}

static void cloud_free(cloud *c)
{
    arrivals_free(&c->made);
}

/* Smallest distance of two centres, every pair, over all images. */
static double nearest_pair(const cloud *a, const cloud *b, const double lo[3], const double hi[3],
                           const int periodic[3])
{
    double least = INFINITY;
    for (size_t i = 0; i < a->n; i++)
        for (size_t j = a == b ? i + 1 : 0; j < b->n; j++) {
            double d2 = 0.;
            for (int k = 0; k < 3; k++) {
                double d = fabs(a->x[i][k] - b->x[j][k]);
                if (periodic[k]) d = fmin(d, hi[k] - lo[k] - d);
                d2 += d * d;
            }
            least = fmin(least, d2);
        }
    return sqrt(least);
}

static dem_insertion random_in(dem_sdf *region, const double lo[3], const double hi[3], double d,
                               double solid_fraction, uint64_t seed)
{
    dem_insertion ins = {.name = "bed", .kind = DEM_INSERT_RANDOM, .region = region};
    memcpy(ins.lo, lo, sizeof ins.lo);
    memcpy(ins.hi, hi, sizeof ins.hi);
    ins.number = -1;
    ins.solid_fraction = solid_fraction;
    ins.diameter = d;
    ins.seed = seed;
    return ins;
}

/* ---- random ---------------------------------------------------------------------------------- */

/* Loose and dense, walls and periodic sides, off the origin. */
static void test_no_overlap(void **state)
{
    (void)state;
    const double lo[3] = {-.7, .2, 1.1}, hi[3] = {.5, 1.3, 2.2}, d = .0837;
    const double volume = 1.2 * 1.1 * 1.1;
    const double fraction[] = {.05, .31, .47, .53};
    for (int f = 0; f < 4; f++)
        for (int p = 0; p < 2; p++) {
            dem_sdf *box = dem_sdf_box(lo, hi, 1);
            const dem_insertion ins = random_in(box, lo, hi, d, fraction[f], 11 + (uint64_t)f);
            cloud c = create(&ins, lo, hi, p ? ALWAYS : NEVER, NULL, NULL);
            assert_string_equal(c.message, "");
            assert_int_equal(c.status, DEM_OK);
            assert_int_equal(c.n, lround(fraction[f] * volume / (PI / 6. * d * d * d)));
            assert_true(nearest_pair(&c, &c, lo, hi, p ? ALWAYS : NEVER) >= d);
            int beyond = 0;
            for (size_t i = 0; i < c.n; i++) {
                assert_true(dem_sdf_distance(box, c.x[i]) >= (p ? 0. : .5 * d));
                beyond += dem_sdf_distance(box, c.x[i]) < .5 * d;
            }
            /* A periodic cell is filled through its sides, evenly: count centres in the skin. */
            if (p) {
                const double share = 1. - (1.2 - d) * (1.1 - d) * (1.1 - d) / volume;
                assert_near(beyond, share * (double)c.n, 5. * sqrt(share * (double)c.n));
            }
            cloud_free(&c);
            dem_sdf_free(box);
        }
}

/* Round region: the volume comes from the quadrature. */
static void test_round_region(void **state)
{
    (void)state;
    const double p0[3] = {.1, .2, 0.}, p1[3] = {.1, .2, .7}, r = .31, d = .041;
    const double lo[3] = {-.21, -.11, 0.}, hi[3] = {.41, .51, .7};
    const double dlo[3] = {-1., -1., -1.}, dhi[3] = {1., 1., 1.};
    dem_sdf *region = dem_sdf_cylinder(p0, p1, r, 1, 1);
    const dem_insertion ins = random_in(region, lo, hi, d, .5, 7);
    cloud c = create(&ins, dlo, dhi, NEVER, NULL, NULL);
    assert_string_equal(c.message, "");
    const double exact = .5 * PI * r * r * .7 / (PI / 6. * d * d * d);
    assert_near((double)c.n, exact, 1. + 1e-4 * exact);
    assert_true(nearest_pair(&c, &c, dlo, dhi, NEVER) >= d);
    for (size_t i = 0; i < c.n; i++) {
        assert_true(hypot(c.x[i][0] - .1, c.x[i][1] - .2) <= r - .5 * d);
        assert_true(c.x[i][2] >= .5 * d && c.x[i][2] <= .7 - .5 * d);
    }
    cloud_free(&c);
    dem_sdf_free(region);
}

static void test_volume(void **state)
{
    (void)state;
    const int none[3] = {0, 0, 0}, skip_z[3] = {0, 0, 1};
    const double c[3] = {.3, -.2, .5}, r = .441, lo[3] = {-.15, -.65, .05}, hi[3] = {.75, .25, .95};
    dem_sdf *ball = dem_sdf_sphere(c, r, 1);
    const double exact = 4. / 3. * PI * r * r * r;
    assert_near(insert_region_volume(ball, lo, hi, none) / exact, 1., 2e-5);
    dem_sdf_free(ball);

    const double p0[3] = {0., 0., -.1}, p1[3] = {0., 0., .7};
    const double clo[3] = {-.6, -.6, -.1}, chi[3] = {.6, .6, .7};
    dem_sdf *cone = dem_sdf_cone(p0, p1, .2, .6, 1, 1);
    const double frustum = PI / 3. * .8 * (.04 + .12 + .36);
    assert_near(insert_region_volume(cone, clo, chi, none) / frustum, 1., 1e-4);
    dem_sdf_free(cone);

    /* A tilted plane cuts a box exactly into halves by symmetry. */
    const double normal[3] = {.3, -.5, .9}, mid[3] = {.3, -.2, .5};
    dem_sdf *plane = dem_sdf_plane(mid, normal);
    assert_near(insert_region_volume(plane, lo, hi, none), .5 * .9 * .9 * .9, 1e-9);
    dem_sdf_free(plane);

    const double blo[3] = {-.1, -.4, .3}, bhi[3] = {.5, .1, .6};
    dem_sdf *box = dem_sdf_box(blo, bhi, 1);
    assert_near(insert_region_volume(box, blo, bhi, none), .6 * .5 * .3, 1e-14);
    assert_near(insert_region_volume(box, lo, hi, none), .6 * .5 * .3, 1e-5);
    assert_near(insert_region_volume(box, lo, hi, skip_z), .6 * .5 * .9, 3e-5);
    dem_sdf_free(box);
}

/* Loose spheres are uniform: counts in 4^3 equal blocks follow chi square with 63 degrees of
 * freedom (mean 63, deviation 11.2), far from the 0 of a lattice. Exclusion at a fraction of .002
 * narrows the counts by the compressibility factor 1/(1 + 8 phi) only. */
static void test_uniform(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.};
    double count[64] = {0}, chi2 = 0.;
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    dem_insertion ins = random_in(box, lo, hi, .0113, 0., 91);
    ins.number = 3200;
    cloud c = create(&ins, lo, hi, ALWAYS, NULL, NULL);
    assert_int_equal(c.n, 3200);
    for (size_t i = 0; i < c.n; i++)
        count[(int)(4. * c.x[i][0]) + 4 * (int)(4. * c.x[i][1]) + 16 * (int)(4. * c.x[i][2])]++;
    for (int b = 0; b < 64; b++) chi2 += (count[b] - 50.) * (count[b] - 50.) / 50.;
    assert_true(chi2 > 63. - 4. * 11.2 && chi2 < 63. + 4. * 11.2);
    cloud_free(&c);
    dem_sdf_free(box);
}

/* A dense packing is disordered: its pair correlation has decayed to within a few per cent of 1 at
 * four diameters, and shows no lattice: bond directions are isotropic, <n_x^4> = 1/5 (a cubic
 * lattice along the axes has 1/3, a face-centred one 1/6 by its own axes). */
static void test_dense_is_random(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.}, d = .07;
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    const dem_insertion ins = random_in(box, lo, hi, d, .55, 5);
    cloud c = create(&ins, lo, hi, ALWAYS, NULL, NULL);
    assert_int_equal(c.status, DEM_OK);
    assert_true(nearest_pair(&c, &c, lo, hi, ALWAYS) >= d);
    double fourth = 0., bonds = 0., shell = 0.;
    const double inner = 4. * d, outer = 4.5 * d;
    for (size_t i = 0; i < c.n; i++)
        for (size_t j = 0; j < c.n; j++) {
            if (i == j) continue;
            double n[3], r2 = 0.;
            for (int k = 0; k < 3; k++) {
                n[k] = c.x[i][k] - c.x[j][k];
                n[k] -= rint(n[k]);
                r2 += n[k] * n[k];
            }
            shell += r2 >= inner * inner && r2 < outer * outer;
            if (r2 > 1.2 * 1.2 * d * d) continue;
            bonds += 3.;
            for (int k = 0; k < 3; k++) fourth += n[k] * n[k] * n[k] * n[k] / (r2 * r2);
        }
    assert_true(bonds > 3. * 4. * (double)c.n);
    assert_near(fourth / bonds, .2, .01);
    const double expected =
        (double)(c.n * (c.n - 1)) * 4. / 3. * PI * (pow(outer, 3) - pow(inner, 3));
    assert_near(shell / expected, 1., .03);
    cloud_free(&c);
    dem_sdf_free(box);
}

static void test_reproducible(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.};
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    dem_insertion ins = random_in(box, lo, hi, .11, .45, 12345678901234567u);
    ins.velocity_spread = .3;
    cloud a = create(&ins, lo, hi, NEVER, NULL, NULL), b = create(&ins, lo, hi, NEVER, NULL, NULL);
    ins.seed += (uint64_t)1 << 40; /* all bits of the seed count */
    cloud c = create(&ins, lo, hi, NEVER, NULL, NULL);
    assert_true(a.n > 100 && a.n == b.n && a.n == c.n);
    assert_memory_equal(a.x, b.x, a.n * sizeof *a.x);
    assert_memory_equal(a.v, b.v, a.n * sizeof *a.v);
    assert_true(memcmp(a.x, c.x, a.n * sizeof *a.x) != 0);
    cloud_free(&a);
    cloud_free(&b);
    cloud_free(&c);
    dem_sdf_free(box);
}

static void test_respects_others(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., .8, .9};
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    dem_insertion ins = random_in(box, lo, hi, .19, 0., 3);
    ins.number = 30;
    cloud large = create(&ins, lo, hi, ALWAYS, NULL, NULL);
    assert_int_equal(large.n, 30);
    double r[30];
    for (int i = 0; i < 30; i++) r[i] = .5 * .19;
    ins = random_in(box, lo, hi, .05, .38, 4);
    cloud small = create(&ins, lo, hi, ALWAYS, &large, r);
    assert_string_equal(small.message, "");
    assert_int_equal(small.n, lround(.38 * .72 / (PI / 6. * .05 * .05 * .05)));
    assert_true(nearest_pair(&small, &small, lo, hi, ALWAYS) >= .05);
    assert_true(nearest_pair(&small, &large, lo, hi, ALWAYS) >= .5 * (.05 + .19));
    cloud_free(&small);
    cloud_free(&large);
    dem_sdf_free(box);
}

static void test_velocity(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.}, mean[3] = {.31, -1.7, 2.2};
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    dem_insertion ins = random_in(box, lo, hi, .011, 0., 17);
    ins.number = 8000;
    memcpy(ins.velocity, mean, sizeof mean);
    ins.velocity_spread = .42;
    cloud c = create(&ins, lo, hi, NEVER, NULL, NULL);
    for (int k = 0; k < 3; k++) {
        double m = 0., m2 = 0., m4 = 0.;
        for (size_t i = 0; i < c.n; i++) m += c.v[i][k] / 8000.;
        for (size_t i = 0; i < c.n; i++) {
            m2 += pow(c.v[i][k] - m, 2) / 8000.;
            m4 += pow(c.v[i][k] - m, 4) / 8000.;
        }
        /* four standard errors; the fourth moment of a normal distribution is 3 s^4 */
        assert_near(m, mean[k], 4. * .42 / sqrt(8000.));
        assert_near(sqrt(m2), .42, 4. * .42 / sqrt(2. * 8000.));
        assert_near(m4 / (m2 * m2), 3., 4. * sqrt(24. / 8000.));
    }
    cloud_free(&c);
    dem_sdf_free(box);
}

/* ---- several sizes --------------------------------------------------------------------------- */

/* Of two spheres of the cloud, how much nearer they are than touching, of that; every pair. */
static double overlap_of(const cloud *c, const double lo[3], const double hi[3],
                         const int periodic[3])
{
    double most = -INFINITY;
    for (size_t i = 0; i < c->n; i++)
        for (size_t j = 0; j < i; j++) {
            double d2 = 0.;
            for (int k = 0; k < 3; k++) {
                double d = fabs(c->x[i][k] - c->x[j][k]);
                if (periodic[k]) d = fmin(d, hi[k] - lo[k] - d);
                d2 += d * d;
            }
            most = fmax(most, 1. - sqrt(d2) / (c->made.radius[i] + c->made.radius[j]));
        }
    return most;
}

/* Glass of a narrow distribution and steel of a wide one by mass, loose and dense: the fraction is
 * that of the volumes there, to half a particle; shares hold; nobody overlaps. */
static void test_mixture(void **state)
{
    (void)state;
    const double lo[3] = {-.3, .2, 1.1}, hi[3] = {.5, .9, 1.8}, fraction[3] = {.07, .42, .51};
    const dem_species species[2] = {
        {0, {.kind = DEM_SIZE_NORMAL, .mean = .08, .deviation = .006, .lo = .06, .hi = .1}, 3.},
        {1, {.kind = DEM_SIZE_UNIFORM, .by_mass = 1, .lo = .02, .hi = .1}, 2.}};
    for (int f = 0; f < 3; f++)
        for (int by_mass = 0; by_mass < 2; by_mass++) {
            dem_sdf *box = dem_sdf_box(lo, hi, 1);
            dem_insertion ins = random_in(box, lo, hi, 0., fraction[f], 5);
            ins.n_species = 2;
            ins.species = species;
            ins.share_by_mass = by_mass;
            const int *periodic = f == 1 ? ALWAYS : NEVER;
            cloud c = create(&ins, lo, hi, periodic, NULL, NULL), again;
            assert_string_equal(c.message, "");
            double solid = 0., amount[2] = {0};
            for (size_t i = 0; i < c.n; i++) {
                const double r = c.made.radius[i], volume = 4. / 3. * PI * r * r * r;
                solid += volume;
                amount[c.made.material[i]] +=
                    by_mass ? volume * MATERIAL[c.made.material[i]].density : 1.;
                if (!periodic[0]) assert_true(dem_sdf_distance(box, c.x[i]) >= r);
            }
            assert_near(solid, fraction[f] * .8 * .7 * .7, PI / 12. * 1e-3);
            /* by mass some ten large ones of steel decide */
            assert_near(amount[0] / (amount[0] + amount[1]), .6, by_mass ? .12 : .04);
            assert_true(overlap_of(&c, lo, hi, periodic) <= 0.);
            again = create(&ins, lo, hi, periodic, NULL, NULL);
            assert_memory_equal(c.x, again.x, c.n * sizeof *c.x);
            assert_memory_equal(c.made.radius, again.made.radius, c.n * sizeof *c.made.radius);
            cloud_free(&again);
            cloud_free(&c);
            dem_sdf_free(box);
        }
}

/* Ninety large spheres and 12000 of a fifteenth of their size among them: with one grid for
 * all of them the cells of the large ones would hold crowds. */
static void test_sizes_apart(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.};
    const dem_species species[2] = {{0, {.kind = DEM_SIZE_EQUAL, .mean = .2}, 90.},
                                    {1, {.kind = DEM_SIZE_EQUAL, .mean = .0137}, 12000.}};
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    dem_insertion ins = random_in(box, lo, hi, 0., 0., 5);
    ins.n_species = 2;
    ins.species = species;
    ins.number = 12090;
    ins.velocity[0] = 1.3;
    cloud c = create(&ins, lo, hi, ALWAYS, NULL, NULL);
    assert_string_equal(c.message, "");
    assert_int_equal(c.n, 12090);
    size_t large = 0;
    for (size_t i = 0; i < c.n; i++) large += c.made.material[i] == 0;
    assert_in_range(large, 88, 92);
    /* all pairs with a large one; the small ones among each other by a sample */
    double most = -INFINITY;
    for (size_t i = 0; i < c.n; i += i < large ? 1 : 97)
        for (size_t j = 0; j < c.n; j++) {
            if (j == i) continue;
            double d2 = 0.;
            for (int k = 0; k < 3; k++) {
                double d = fabs(c.x[i][k] - c.x[j][k]);
                d = fmin(d, 1. - d);
                d2 += d * d;
            }
            most = fmax(most, 1. - sqrt(d2) / (c.made.radius[i] + c.made.radius[j]));
        }
    assert_true(most <= 0.);
    assert_true(c.v[3][0] == 1.3);
    cloud_free(&c);
    dem_sdf_free(box);
}

/* ---- lattice and list ------------------------------------------------------------------------ */

/* The bed of Goldschmidt, Beetstra & Kuipers, as the DPMFoam tutorial of OpenFOAM sets it up:
 * 24 750 spheres. */
static void test_lattice(void **state)
{
    (void)state;
    const double lo[3] = {-.0075, -.075, 0.}, hi[3] = {.0075, .075, .297};
    const double top[3] = {.0075, .075, .45};
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    dem_insertion ins = random_in(box, lo, hi, .0025, 0., 0);
    ins.kind = DEM_INSERT_LATTICE;
    for (int k = 0; k < 3; k++) ins.spacing[k] = .003;
    cloud c = create(&ins, lo, top, NEVER, NULL, NULL);
    assert_int_equal(c.n, 24750);
    for (int k = 0; k < 3; k++) assert_near(c.x[0][k], lo[k] + .0015, 1e-15);
    double high = 0.;
    for (size_t i = 0; i < c.n; i++) high = fmax(high, c.x[i][2]);
    assert_near(high, .2955, 1e-12);
    cloud_free(&c);

    ins.spacing[1] = .0025; /* touching is no overlap */
    c = create(&ins, lo, top, NEVER, NULL, NULL);
    assert_int_equal(c.n, 5 * 60 * 99);
    cloud_free(&c);
    ins.spacing[1] = .0024;
    c = create(&ins, lo, top, NEVER, NULL, NULL);
    assert_int_equal(c.status, DEM_BAD_ARGUMENT);
    assert_non_null(strstr(c.message, "overlaps"));
    dem_sdf_free(box);

    /* Centres only need to be within a round region. */
    const double zero[3] = {0., 0., 0.}, blo[3] = {-1., -1., -1.}, bhi[3] = {1., 1., 1.};
    dem_sdf *ball = dem_sdf_sphere(zero, 1., 1);
    ins = random_in(ball, blo, bhi, .1, 0., 0);
    ins.kind = DEM_INSERT_LATTICE;
    for (int k = 0; k < 3; k++) ins.spacing[k] = .125;
    c = create(&ins, blo, bhi, NEVER, NULL, NULL);
    size_t expected = 0;
    for (int i = 0; i < 16 * 16 * 16; i++) {
        const int a = 2 * (i % 16) - 15, b = 2 * (i / 16 % 16) - 15, e = 2 * (i / 256) - 15;
        expected += a * a + b * b + e * e <= 256;
    }
    assert_int_equal(c.n, expected);
    cloud_free(&c);
    dem_sdf_free(ball);
}

static void test_list(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.};
    const double x[2][3] = {{.1, .2, .3}, {1.25, .5, -.125}};
    dem_insertion ins = {.name = "pair", .kind = DEM_INSERT_LIST, .n = 2, .x = x, .diameter = .9};
    ins.velocity[1] = -.7;
    const int periodic[3] = {1, 0, 1};
    cloud c = create(&ins, lo, hi, periodic, NULL, NULL);
    assert_int_equal(c.n, 2);
    assert_memory_equal(c.x[0], x[0], sizeof x[0]);
    assert_near(c.x[1][0], .25, 1e-15); /* wrapped into the domain */
    assert_near(c.x[1][2], .875, 1e-15);
    assert_near(c.v[1][1], -.7, 0.);
    cloud_free(&c);
    ins.n = 0;
    c = create(&ins, lo, hi, periodic, NULL, NULL);
    assert_int_equal(c.status, DEM_OK);
    assert_null(c.x);
}

/* ---- refusals -------------------------------------------------------------------------------- */

static void refused(const dem_insertion *ins, const double lo[3], const double hi[3],
                    const int periodic[3], const char *text)
{
    cloud c = create(ins, lo, hi, periodic, NULL, NULL);
    assert_int_equal(c.status, DEM_BAD_ARGUMENT);
    assert_null(c.x);
    assert_null(c.v);
    assert_int_equal(c.n, 0);
    assert_non_null(strstr(c.message, "insertion bed: "));
    if (strstr(c.message, text) == NULL) fail_msg("'%s' not in '%s'", text, c.message);
}

static void test_refused(void **state)
{
    (void)state;
    const double lo[3] = {0., 0., 0.}, hi[3] = {1., 1., 1.}, beyond[3] = {1.5, 1., 1.};
    dem_sdf *box = dem_sdf_box(lo, hi, 1);
    const dem_insertion good = random_in(box, lo, hi, .1, .1, 1);
    dem_insertion ins = good;
    ins.solid_fraction = .69;
    refused(&ins, lo, hi, NEVER, "could be placed without overlap");
    ins.solid_fraction = .76;
    refused(&ins, lo, hi, NEVER, "no packing of equal spheres");
    ins.solid_fraction = 1.2;
    refused(&ins, lo, hi, NEVER, "solid fraction 1.2 is not in [0, 1)");
    ins = good;
    ins.diameter = -.1;
    refused(&ins, lo, hi, NEVER, "diameter -0.1 m is not positive");
    ins.diameter = 1.1;
    ins.number = 1;
    refused(&ins, lo, hi, NEVER, "no room for a particle of diameter 1.1 m");
    refused(&ins, lo, hi, ALWAYS, "touches itself");
    ins = good;
    memcpy(ins.lo, beyond, sizeof ins.lo);
    ins.hi[0] = 2.;
    refused(&ins, lo, hi, NEVER, "lies outside the domain");
    ins = good;
    ins.kind = DEM_INSERT_LATTICE;
    refused(&ins, lo, hi, NEVER, "spacing 0 m is not positive");
    for (int k = 0; k < 3; k++) ins.spacing[k] = 1e-5;
    refused(&ins, lo, hi, NEVER, "more than 1e9 particles");
    for (int k = 0; k < 3; k++) ins.spacing[k] = .2;
    refused(&ins, lo, (const double[3]){.5, 1., 1.}, NEVER, "lies outside the domain");
    const dem_species wide = {0, {.kind = DEM_SIZE_UNIFORM, .lo = .03, .hi = .09}, 1.};
    dem_species bad = wide;
    ins = good;
    ins.n_species = 1;
    ins.species = &wide;
    ins.solid_fraction = .73;
    bad.size.lo = .08;
    ins.species = &bad;
    refused(&ins, lo, hi, NEVER, "of them could be placed without overlap");
    ins.species = &wide;
    ins.number = 20000;
    refused(&ins, lo, hi, NEVER, "have more volume than the region");
    ins.number = 3;
    ins.kind = DEM_INSERT_LATTICE;
    refused(&ins, lo, hi, NEVER, "only a random insertion");
    ins.kind = DEM_INSERT_RANDOM;
    ins.species = &bad;
    bad.size.lo = .1;
    refused(&ins, lo, hi, NEVER, "species 1: smallest diameter 0.1 m and largest 0.09 m");
    bad.size.lo = .03;
    bad.size.hi = 1.3;
    refused(&ins, lo, hi, ALWAYS, "a particle of diameter 1.3 m touches itself");
    bad.material = 2;
    refused(&ins, lo, hi, NEVER, "species 1: material 2 is none of the 2");
    ins = good;
    ins.region = NULL;
    refused(&ins, lo, hi, NEVER, "no region");
    dem_sdf_free(box);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_overlap),      cmocka_unit_test(test_round_region),
        cmocka_unit_test(test_volume),          cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_dense_is_random), cmocka_unit_test(test_reproducible),
        cmocka_unit_test(test_respects_others), cmocka_unit_test(test_velocity),
        cmocka_unit_test(test_lattice),         cmocka_unit_test(test_list),
        cmocka_unit_test(test_refused),         cmocka_unit_test(test_mixture),
        cmocka_unit_test(test_sizes_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
