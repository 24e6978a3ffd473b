/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Signed distance functions of the wall shapes.
 *
 * Independent of sdf.c: every surface is sampled densely from its parametric form, which bounds the
 * distance from above and, with the spacing of the samples, from below; the sign comes from the
 * shape's inequalities; the gradient from central differences. Query points are random, so edges,
 * corners and the far field are all met. Shapes are tilted, off the origin and of ugly size.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <gsl/gsl_rng.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dem.h"
#include "near.h"

static const double PI = 3.14159265358979323846;

enum { SAMPLES = 160000, QUERIES = 300 };

/* A surface given by its points, with the solid's inequality. */
typedef struct surface {
    double (*x)[3];
    size_t n;
    double spacing; /* no point of the surface is farther than this from a sample */
} surface;

static void add_point(surface *s, const double x[3])
{
    memcpy(s->x[s->n++], x, sizeof *s->x);
}

static surface surface_new(size_t capacity)
{
    surface s = {.x = malloc(capacity * sizeof *s.x)};
    assert_non_null(s.x);
    return s;
}

static double brute_distance(const surface *s, const double x[3])
{
    double least = INFINITY;
    for (size_t i = 0; i < s->n; i++) {
        double d2 = 0.;
        for (int k = 0; k < 3; k++) d2 += (x[k] - s->x[i][k]) * (x[k] - s->x[i][k]);
        if (d2 < least) least = d2;
    }
    return sqrt(least);
}

static void check_gradient(const dem_sdf *sdf, int part, const double x[3])
{
    double g[3], unused[3], moved[3];
    const double h = 1e-6;
    dem_sdf_eval(sdf, part, x, g);
    assert_near(g[0] * g[0] + g[1] * g[1] + g[2] * g[2], 1., 1e-12);
    for (int k = 0; k < 3; k++) {
        memcpy(moved, x, sizeof moved);
        moved[k] = x[k] + h;
        const double up = dem_sdf_eval(sdf, part, moved, unused);
        moved[k] = x[k] - h;
        const double down = dem_sdf_eval(sdf, part, moved, unused);
        assert_near(g[k], (up - down) / (2. * h), 1e-5);
    }
}

/* Compare with the samples at random points of the box [-reach, reach]^3 about c; `solid` tells
 * whether a point lies within the solid, NULL for a sheet. Only points where the sign says that
 * phi is exact (`both_sides`: there, too). */
static void check_shape(dem_sdf *sdf, const surface *s, const double c[3], double reach,
                        int (*solid)(const double x[3]), int both_sides)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, 20471);
    int compared = 0, kinks = 0;
    for (int q = 0; q < QUERIES; q++) {
        double x[3], smooth = 1.;
        for (int k = 0; k < 3; k++) x[k] = c[k] + reach * (2. * gsl_rng_uniform(rng) - 1.);
        const double phi = dem_sdf_distance(sdf, x);
        if (solid != NULL) assert_true((phi < 0.) == (solid(x) != 0));
        if (solid == NULL) assert_true(phi >= 0.);
        const double brute = brute_distance(s, x);
        assert_true(fabs(phi) <= brute + 1e-12);
        if (both_sides || phi > 0.) {
            /* Pythagoras: the nearest sample is at most `spacing` off the foot point. */
            assert_true(brute <= hypot(fabs(phi), s->spacing) + s->spacing * s->spacing);
            compared++;
        }
        for (int part = 0; part < dem_sdf_parts(sdf); part++) {
            /* Central differences are meaningless where the nearest feature changes. */
            double a[3], b[3], step[3];
            dem_sdf_eval(sdf, part, x, a);
            for (int k = 0; k < 3; k++) step[k] = x[k] + 3e-6;
            dem_sdf_eval(sdf, part, step, b);
            smooth = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            if (smooth > 1. - 1e-6)
                check_gradient(sdf, part, x);
            else
                kinks++;
        }
    }
    assert_true(compared > QUERIES / 60);
    assert_true(kinks < QUERIES / 20);
    gsl_rng_free(rng);
    dem_sdf_free(sdf);
}

/* ---- plane, sphere, box ---------------------------------------------------------------------- */

static void test_plane(void **state)
{
    (void)state;
    const double p[3] = {.31, -.27, 1.9}, n[3] = {2., -1., 2.};
    dem_sdf *s = dem_sdf_plane(p, n);
    double g[3];
    /* Foot point p + 0.385 n/3 + something within the plane (1, 2, 0) (0, 2, 1). */
    const double x[3] = {.31 + .385 * 2. / 3. + .7, -.27 - .385 / 3. + 1.4 - .6,
                         1.9 + .385 * 2. / 3. - .3};
    assert_int_equal(dem_sdf_parts(s), 1);
    assert_near(dem_sdf_eval(s, 0, x, g), .385, 1e-14);
    assert_near(g[0], 2. / 3., 1e-15);
    assert_near(g[1], -1. / 3., 1e-15);
    assert_near(g[2], 2. / 3., 1e-15);
    const double below[3] = {.31 - 2., -.27 + 1., 1.9 - 2.};
    assert_near(dem_sdf_distance(s, below), -3., 1e-14);
    dem_sdf_free(s);
}

static const double CENTRE[3] = {.213, -.471, .884};
static const double RADIUS = .738;

static int in_ball(const double x[3])
{
    double d2 = 0.;
    for (int k = 0; k < 3; k++) d2 += (x[k] - CENTRE[k]) * (x[k] - CENTRE[k]);
    return d2 < RADIUS * RADIUS;
}

static int out_of_ball(const double x[3])
{
    return !in_ball(x);
}

static void test_sphere(void **state)
{
    (void)state;
    surface s = surface_new(SAMPLES);
    for (int i = 0; i < SAMPLES; i++) { /* Fibonacci points: even to about sqrt(4 pi/N) */
        const double z = 1. - (2. * i + 1.) / SAMPLES, a = i * PI * (3. - sqrt(5.));
        const double w = sqrt(1. - z * z);
        add_point(&s, (double[3]){CENTRE[0] + RADIUS * w * cos(a), CENTRE[1] + RADIUS * w * sin(a),
                                  CENTRE[2] + RADIUS * z});
    }
    s.spacing = RADIUS * sqrt(4. * PI / SAMPLES);
    check_shape(dem_sdf_sphere(CENTRE, RADIUS, 0), &s, CENTRE, 1.3, in_ball, 1);
    check_shape(dem_sdf_sphere(CENTRE, RADIUS, 1), &s, CENTRE, 1.3, out_of_ball, 1);
    free(s.x);
}

static const double LO[3] = {-.31, .12, -.55}, HI[3] = {.47, .93, .68};

static int in_box(const double x[3])
{
    int in = 1;
    for (int k = 0; k < 3; k++) in &= x[k] > LO[k] && x[k] < HI[k];
    return in;
}

static int out_of_box(const double x[3])
{
    return !in_box(x);
}

static void test_box(void **state)
{
    (void)state;
    enum { M = 150 };
    surface s = surface_new(6 * M * M);
    double longest = 0.;
    for (int k = 0; k < 3; k++) longest = fmax(longest, HI[k] - LO[k]);
    for (int face = 0; face < 6; face++)
        for (int i = 0; i < M * M; i++) {
            const int a = face / 2, b = (a + 1) % 3, c = (a + 2) % 3;
            double x[3];
            x[a] = face % 2 ? HI[a] : LO[a];
            x[b] = LO[b] + (HI[b] - LO[b]) * (i % M) / (M - 1);
            x[c] = LO[c] + (HI[c] - LO[c]) * (i / M) / (M - 1);
            add_point(&s, x);
        }
    s.spacing = longest / (M - 1);
    const double centre[3] = {.1, .5, .1};
    check_shape(dem_sdf_box(LO, HI, 0), &s, centre, 1., in_box, 1);
    check_shape(dem_sdf_box(LO, HI, 1), &s, centre, 1., out_of_box, 0);
    free(s.x);

    /* A corner from outside is felt once, from its own direction; from within three faces are. */
    dem_sdf *solid = dem_sdf_box(LO, HI, 0), *vessel = dem_sdf_box(LO, HI, 1);
    const double out[3] = {HI[0] + .02, HI[1] + .03, HI[2] + .06};
    const double in[3] = {HI[0] - .02, HI[1] - .03, HI[2] - .06};
    double g[3], normal[6][3];
    assert_near(dem_sdf_eval(solid, 0, out, g), .07, 1e-15);
    assert_near(g[0], 2. / 7., 1e-12);
    assert_near(g[1], 3. / 7., 1e-12);
    assert_near(g[2], 6. / 7., 1e-12);
    assert_int_equal(dem_sdf_parts(vessel), 6);
    int near = 0;
    for (int part = 0; part < 6; part++) near += dem_sdf_eval(vessel, part, in, normal[part]) < .1;
    assert_int_equal(near, 3);
    assert_near(dem_sdf_distance(vessel, in), .02, 1e-15);
    dem_sdf_free(solid);
    dem_sdf_free(vessel);
}

/* ---- shapes of revolution -------------------------------------------------------------------- */

static const double P0[3] = {.21, -.13, .37}, P1[3] = {.61, .47, 1.27};
static double r_at_0, r_at_1;

/* Height along the axis and distance off it, by the cross product (sdf.c projects). */
static void meridian_of(const double x[3], double *s, double *z, double *h)
{
    double a[3], d[3], cross[3];
    double length2 = 0., along = 0.;
    for (int k = 0; k < 3; k++) {
        a[k] = P1[k] - P0[k];
        d[k] = x[k] - P0[k];
        length2 += a[k] * a[k];
        along += a[k] * d[k];
    }
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        cross[k] = a[i] * d[j] - a[j] * d[i];
    }
    *h = sqrt(length2);
    *z = along / *h;
    *s = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]) / *h;
}

static int in_frustum(const double x[3])
{
    double s, z, h;
    meridian_of(x, &s, &z, &h);
    return z > 0. && z < h && s < r_at_0 + (r_at_1 - r_at_0) * z / h;
}

static int out_of_frustum(const double x[3])
{
    return !in_frustum(x);
}

static int in_tube(const double x[3])
{
    double s, z, h;
    meridian_of(x, &s, &z, &h);
    return s < r_at_0;
}

static int out_of_tube(const double x[3])
{
    return !in_tube(x);
}

/* Revolve the segment (s0,z0)-(s1,z1), z in units of the axis. */
static void revolve(surface *surface, double s0, double z0, double s1, double z1, int rows,
                    int columns)
{
    double a[3], b[3], c[3], length = 0.;
    for (int k = 0; k < 3; k++) a[k] = P1[k] - P0[k];
    const double helper[3] = {.3, -.8, .1};
    for (int k = 0; k < 3; k++)
        b[k] = a[(k + 1) % 3] * helper[(k + 2) % 3] - a[(k + 2) % 3] * helper[(k + 1) % 3];
    for (int k = 0; k < 3; k++) length += b[k] * b[k];
    for (int k = 0; k < 3; k++) b[k] /= sqrt(length);
    length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int k = 0; k < 3; k++)
        c[k] = (a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]) / length;
    for (int i = 0; i < rows; i++) {
        const double t = (double)i / (rows - 1), s = s0 + (s1 - s0) * t, z = z0 + (z1 - z0) * t;
        for (int j = 0; j < columns; j++) {
            const double angle = 2. * PI * (j + .5 * (i % 2)) / columns;
            double x[3];
            for (int k = 0; k < 3; k++)
                x[k] = P0[k] + z * a[k] + s * (b[k] * cos(angle) + c[k] * sin(angle));
            add_point(surface, x);
        }
    }
    const double step = hypot(s1 - s0, (z1 - z0) * length) / (rows - 1);
    const double arc = 2. * PI * fmax(s0, s1) / columns;
    surface->spacing = fmax(surface->spacing, hypot(step, arc));
}

static void check_frustum(double r0, double r1)
{
    enum { ROWS = 150, COLUMNS = 400 };
    const double middle[3] = {.41, .17, .82};
    r_at_0 = r0;
    r_at_1 = r1;
    surface sheet = surface_new(ROWS * COLUMNS), closed = surface_new(3 * ROWS * COLUMNS);
    revolve(&sheet, r0, 0., r1, 1., ROWS, COLUMNS);
    revolve(&closed, r0, 0., r1, 1., ROWS, COLUMNS);
    revolve(&closed, 0., 0., r0, 0., ROWS, COLUMNS);
    revolve(&closed, 0., 1., r1, 1., ROWS, COLUMNS);
    check_shape(dem_sdf_cone(P0, P1, r0, r1, 1, 0), &closed, middle, 1.4, in_frustum, 1);
    check_shape(dem_sdf_cone(P0, P1, r0, r1, 1, 1), &closed, middle, .9, out_of_frustum, 0);
    check_shape(dem_sdf_cone(P0, P1, r0, r1, 0, 0), &sheet, middle, 1.4, NULL, 1);
    check_shape(dem_sdf_cone(P0, P1, r0, r1, 0, 1), &sheet, middle, 1.4, NULL, 1);
    free(sheet.x);
    free(closed.x);
}

static void test_cone(void **state)
{
    (void)state;
    check_frustum(.283, .641);
    check_frustum(.617, .094);
    check_frustum(.518, 0.); /* to its tip */
    check_frustum(.437, .437);
}

static void test_cylinder(void **state)
{
    (void)state;
    enum { ROWS = 900, COLUMNS = 400 };
    const double middle[3] = {.41, .17, .82};
    r_at_0 = r_at_1 = .437;
    surface endless = surface_new(ROWS * COLUMNS);
    revolve(&endless, r_at_0, -3., r_at_0, 4., ROWS, COLUMNS);
    check_shape(dem_sdf_cylinder(P0, P1, r_at_0, 0, 0), &endless, middle, 1.4, in_tube, 1);
    check_shape(dem_sdf_cylinder(P0, P1, r_at_0, 0, 1), &endless, middle, 1.4, out_of_tube, 1);
    free(endless.x);

    /* The closed one is the frustum of equal radii, which test_cone measures. */
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int inside = 0; inside < 2; inside++) {
        dem_sdf *a = dem_sdf_cylinder(P0, P1, .437, 1, inside);
        dem_sdf *b = dem_sdf_cone(P0, P1, .437, .437, 1, inside);
        for (int q = 0; q < QUERIES; q++) {
            double x[3];
            for (int k = 0; k < 3; k++) x[k] = 3. * gsl_rng_uniform(rng) - 1.;
            assert_true(dem_sdf_distance(a, x) == dem_sdf_distance(b, x));
        }
        dem_sdf_free(a);
        dem_sdf_free(b);
    }
    gsl_rng_free(rng);
}

/* A funnel holds from within, has an edge at its orifice, and nothing beyond it. */
static void test_funnel(void **state)
{
    (void)state;
    const double low[3] = {0., 0., 0.}, high[3] = {0., 0., .4};
    dem_sdf *s = dem_sdf_cone(low, high, .1, .5, 0, 1); /* 45 degrees */
    double g[3];
    const double within[3] = {.29, 0., .21};
    assert_near(dem_sdf_eval(s, 0, within, g), .02 / sqrt(2.), 1e-14);
    assert_near(g[0], -sqrt(.5), 1e-14);
    assert_near(g[2], sqrt(.5), 1e-14);
    const double orifice[3] = {0., 0., 0.};
    assert_near(dem_sdf_distance(s, orifice), .1, 1e-14);
    /* Below: distance to the rim, where the endless cone would have its tip at z = -.1. */
    const double below[3] = {0., .06, -.03};
    assert_near(dem_sdf_eval(s, 0, below, g), .05, 1e-14);
    assert_near(g[1], -.8, 1e-13);
    assert_near(g[2], -.6, 1e-13);
    /* Exactly on the sheet a centre is pushed to the side that `inside` names. */
    const double on[3] = {0., .25, .15};
    dem_sdf *cone = dem_sdf_cone(low, high, .1, .5, 0, 0);
    assert_near(dem_sdf_eval(s, 0, on, g), 0., 1e-16);
    dem_sdf_free(cone);
    dem_sdf_free(s);
}

/* On axes, edges and centres the gradient is still a unit vector. */
static void test_singular_points(void **state)
{
    (void)state;
    const double o[3] = {0., 0., 0.}, e[3] = {0., 0., 1.}, top[3] = {0., 0., 1.};
    const double rim[3] = {.5, 0., 0.}, edge[3] = {HI[0], HI[1], .1}, mid[3] = {0., 0., .5};
    dem_sdf *shape[] = {dem_sdf_sphere(o, .7, 0),
                        dem_sdf_cylinder(o, e, .5, 0, 1),
                        dem_sdf_cylinder(o, e, .5, 1, 0),
                        dem_sdf_cylinder(o, e, .5, 1, 1),
                        dem_sdf_cone(o, e, .5, 0., 1, 0),
                        dem_sdf_cone(o, e, .5, .2, 0, 1),
                        dem_sdf_box(LO, HI, 0)};
    const double *point[] = {o, top, rim, edge, mid};
    for (size_t s = 0; s < sizeof shape / sizeof *shape; s++) {
        for (size_t p = 0; p < sizeof point / sizeof *point; p++)
            for (int part = 0; part < dem_sdf_parts(shape[s]); part++) {
                double g[3];
                assert_true(isfinite(dem_sdf_eval(shape[s], part, point[p], g)));
                assert_near(g[0] * g[0] + g[1] * g[1] + g[2] * g[2], 1., 1e-12);
            }
        dem_sdf_free(shape[s]);
    }
}

static void test_refused(void **state)
{
    (void)state;
    const double o[3] = {0., 0., 0.}, e[3] = {0., 0., 1.}, bad[3] = {0., NAN, 1.};
    assert_null(dem_sdf_plane(o, o));
    assert_null(dem_sdf_plane(o, bad));
    assert_null(dem_sdf_box(HI, LO, 1));
    assert_null(dem_sdf_box(o, e, 0));
    assert_null(dem_sdf_sphere(o, 0., 1));
    assert_null(dem_sdf_sphere(bad, 1., 1));
    assert_null(dem_sdf_cylinder(o, o, 1., 1, 1));
    assert_null(dem_sdf_cylinder(o, e, -1., 1, 1));
    assert_null(dem_sdf_cone(o, e, 0., 0., 1, 1));
    assert_null(dem_sdf_cone(o, e, -.1, 1., 1, 1));
    assert_null(dem_sdf_cone(o, e, INFINITY, 1., 1, 1));
    dem_sdf_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plane),
        cmocka_unit_test(test_sphere),
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_cone),
        cmocka_unit_test(test_cylinder),
        cmocka_unit_test(test_funnel),
        cmocka_unit_test(test_singular_points),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
