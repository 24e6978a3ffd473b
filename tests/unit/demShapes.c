/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Shapes of shapes: union, intersection, complement, transform.
 *
 * Distances to edges and corners are compared with closed forms (a lens of two balls, a ball cut
 * by planes, a wedge) and with the smallest over points strewn on edge curves; seams and corners
 * of unions by what a rolling sphere feels.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <gsl/gsl_rng.h>

#include "near.h"
#include "sdf.h"
#include "stlFixture.h"

static dem_sdf *both(dem_sdf *a, dem_sdf *b)
{
    dem_sdf *member[2] = {a, b};
    return dem_sdf_intersection(2, member);
}

static dem_sdf *either(dem_sdf *a, dem_sdf *b)
{
    dem_sdf *member[2] = {a, b};
    return dem_sdf_union(2, member);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Sum over the parts of stiffness 1 times overlap times gradient, as the walls do; how many. */
static int force(const dem_sdf *s, const double x[3], double r, double f[3])
{
    int felt = 0;
    f[0] = f[1] = f[2] = 0.;
    for (int p = 0; p < dem_sdf_parts(s); p++) {
        double g[3];
        const double phi = dem_sdf_eval(s, p, x, g);
        if (!(phi < r)) continue;
        assert_true(sdf_near(s, p, x, r));
        felt++;
        for (int k = 0; k < 3; k++) f[k] += (r - phi) * g[k];
    }
    return felt;
}

/* ---- union ----------------------------------------------------------------------------------- */

/* Two flush boxes are one floor: a sphere that rolls over the seam feels nothing of it. */
static void check_seam(dem_sdf *floor, double angle, const double shift[3], const double axis[3])
{
    dem_sdf *s = dem_sdf_transform(floor, 1., axis, angle, shift);
    dem_sdf *one =
        dem_sdf_transform(dem_sdf_box((double[3]){-1., -1., -.5}, (double[3]){1.3, 1., .1}, 0), 1.,
                          axis, angle, shift);
    double step = 0.;
    for (int i = -2000; i <= 2000; i++) {
        /* finer towards the seam at x = .3 */
        const double t = i / 2000., y[3] = {.3 + .2 * t * t * t, .17 + .01 * t, .1 + .0492};
        double x[3], f[3], g[3];
        for (int k = 0; k < 3; k++) { /* to where the shape was put */
            x[k] = shift[k];
            for (int j = 0; j < 3; j++) x[k] += s->turn[3 * k + j] * y[j];
        }
        assert_int_equal(force(s, x, .05, f), 1);
        assert_int_equal(force(one, x, .05, g), 1);
        for (int k = 0; k < 3; k++) step = fmax(step, fabs(f[k] - g[k]) / .0008);
    }
    report("force over the seam of two boxes against that on one", step, 0.);
    assert_true(step < 2e-7); /* the feet of the two are one point to 1e-7 of the distance */
    dem_sdf_free(s);
    dem_sdf_free(one);
}

static void test_seam(void **state)
{
    (void)state;
    const double a[3] = {-1., -1., -.5}, b[3] = {.3, 1., .1}, c[3] = {.3, -1., -.5},
                 d[3] = {1.3, 1., .1}, zero[3] = {0, 0, 0}, shift[3] = {.7, -1.1, .4},
                 axis[3] = {.3, -.9, .5};
    check_seam(either(dem_sdf_box(a, b, 0), dem_sdf_box(c, d, 0)), 0., zero, axis);
    check_seam(either(dem_sdf_box(c, d, 0), dem_sdf_box(a, b, 0)), .83, shift, axis);
    /* overlapping ones, and ones of triangles */
    const double e[3] = {.1, -1., -.5};
    check_seam(either(dem_sdf_box(a, b, 0), dem_sdf_box(e, d, 0)), .83, shift, axis);
    body p = box_body(a, b, 2), q = box_body(c, d, 1);
    check_seam(either(stl_shape(&p, 0), stl_shape(&q, 0)), .83, shift, axis);
    body_free(&p);
    body_free(&q);
}

/* Floor and wall: both are felt in the corner, one away from it, none twice. */
static void test_corner(void **state)
{
    (void)state;
    const double a[3] = {-1., -1., -.5}, b[3] = {1., 1., .1}, c[3] = {.5, -1., .1},
                 d[3] = {1., 1., .7};
    dem_sdf *s = either(dem_sdf_box(a, b, 0), dem_sdf_box(c, d, 0));
    double f[3];
    const double corner[3] = {.5 - .048, .2, .1 + .047}, flat[3] = {.1, .2, .147},
                 up[3] = {.452, .1, .4}, top[3] = {.53, .1, .748};
    assert_int_equal(force(s, corner, .05, f), 2);
    assert_near(f[0], -.002, 1e-15);
    assert_near(f[2], .003, 1e-15);
    assert_int_equal(force(s, flat, .05, f), 1);
    assert_near(f[2], .003, 1e-15);
    assert_int_equal(force(s, up, .05, f), 1);
    assert_near(f[0], -.002, 1e-15);
    assert_int_equal(force(s, top, .05, f), 1);
    assert_near(f[2], .002, 1e-15);
    /* what a motion of .05 brings into view is near */
    const double beyond[3] = {.47, .1, .73};
    assert_true(sdf_near(s, 1, beyond, .1));
    /* the signed distance of the whole */
    const double within[3] = {.7, .2, .15};
    assert_near(dem_sdf_distance(s, corner), .047, 1e-15);
    assert_true(dem_sdf_distance(s, within) < 0.);
    dem_sdf_free(s);
}

/* Two balls: the distance is the smaller one, and the waist is felt by both. */
static void test_balls(void **state)
{
    (void)state;
    const double a[3] = {-.3, 0, 0}, b[3] = {.4, 0, 0};
    dem_sdf *s = either(dem_sdf_sphere(a, .5, 0), dem_sdf_sphere(b, .4, 0));
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int q = 0; q < 2000; q++) {
        double x[3], g[3], least = INFINITY;
        for (int k = 0; k < 3; k++) x[k] = 2. * (gsl_rng_uniform(rng) - .5);
        const double da = hypot(hypot(x[0] - a[0], x[1]), x[2]) - .5,
                     db = hypot(hypot(x[0] - b[0], x[1]), x[2]) - .4;
        assert_near(dem_sdf_distance(s, x), fmin(da, db), 1e-14);
        for (int p = 0; p < 2; p++) least = fmin(least, dem_sdf_eval(s, p, x, g));
        if (fmin(da, db) > 0.) assert_near(least, fmin(da, db), 1e-14);
    }
    /* crossing circle: x^2 - (x - .7)^2 = .09 about a */
    const double along = (.25 - .16 + .49) / 1.4, off = sqrt(.25 - along * along);
    const double waist[3] = {-.3 + along, off + .05, 0};
    double f[3];
    assert_int_equal(force(s, waist, .06, f), 2);
    gsl_rng_free(rng);
    dem_sdf_free(s);
}

/* ---- intersection ---------------------------------------------------------------------------- */

/* A lens of two balls: outside of its rim the distance is to a circle. */
static void test_lens(void **state)
{
    (void)state;
    const double a[3] = {-.3, 0, 0}, b[3] = {.4, 0, 0};
    const double along = (.36 - .25 + .49) / 1.4, rim = sqrt(.36 - along * along);
    dem_sdf *s = both(dem_sdf_sphere(a, .6, 0), dem_sdf_sphere(b, .5, 0));
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    double worst = 0.;
    int on_rim = 0;
    for (int q = 0; q < 5000; q++) {
        double x[3], g[3];
        for (int k = 0; k < 3; k++) x[k] = 3. * (gsl_rng_uniform(rng) - .5);
        const double z = x[0] + .3, w = hypot(x[1], x[2]);
        const double da = hypot(z, w) - .6, db = hypot(z - .7, w) - .5;
        const double phi = dem_sdf_eval(s, 0, x, g);
        /* feet on the balls, in the meridian plane, and whether they are within the other ball */
        const double fa = hypot(z * .6 / (da + .6) - .7, w * .6 / (da + .6)),
                     fb = hypot(.7 + (z - .7) * .5 / (db + .5), w * .5 / (db + .5));
        double expected = hypot(z - along, w - rim);
        if (da < 0. && db < 0.)
            expected = fmax(da, db);
        else if (da > 0. && fa < .5)
            expected = da;
        else if (db > 0. && fb < .6)
            expected = db;
        else
            on_rim++;
        worst = fmax(worst, fabs(phi - expected));
        assert_near(dot(g, g), 1., 1e-12);
        for (int k = 0; k < 3; k++) x[k] -= phi * g[k];
        assert_near(dem_sdf_distance(s, x), 0., 1e-10);
    }
    report("distance to a lens, worst of 5000", worst, 0.);
    assert_true(on_rim > 1000);
    assert_true(worst < 1e-11);
    gsl_rng_free(rng);
    dem_sdf_free(s);
}

/* A box made of six half-spaces, turned; a ball with a corner cut out of it by De Morgan. */
static void test_planes(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68}, shift[3] = {.1, .2, -.1},
                 axis[3] = {.3, -.9, .5};
    dem_sdf *face[6];
    for (int f = 0; f < 6; f++) {
        double n[3] = {0, 0, 0};
        n[f / 2] = f % 2 ? 1. : -1.;
        face[f] = dem_sdf_plane(f % 2 ? hi : lo, n);
    }
    dem_sdf *s = dem_sdf_transform(dem_sdf_intersection(6, face), 1.7, axis, .83, shift);
    dem_sdf *box = dem_sdf_transform(dem_sdf_box(lo, hi, 0), 1.7, axis, .83, shift);
    dem_sdf *vessel = dem_sdf_transform(dem_sdf_box(lo, hi, 1), 1.7, axis, .83, shift);
    assert_int_equal(dem_sdf_parts(s), 1);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    double worst = 0.;
    for (int turned = 0; turned < 2; turned++) {
        for (int q = 0; q < 3000; q++) {
            double x[3], g[3], h[3];
            for (int k = 0; k < 3; k++) x[k] = 4. * (gsl_rng_uniform(rng) - .5);
            if (turned == 0) {
                const double phi = dem_sdf_eval(s, 0, x, g), expected = dem_sdf_eval(box, 0, x, h);
                worst = fmax(worst, fabs(phi - expected));
                for (int k = 0; k < 3 && phi > 0.; k++) assert_near(g[k], h[k], 1e-9);
                continue;
            }
            for (int p = 0; p < 6; p++)
                worst = fmax(worst, fabs(dem_sdf_eval(s, p, x, g) - dem_sdf_eval(vessel, p, x, h)));
        }
        if (turned) break;
        s = dem_sdf_complement(s);
        assert_int_equal(dem_sdf_parts(s), 6);
        /* a union hides feet that are within others: look at the free side only */
        for (int q = 0; q < 3000; q++) {
            double x[3], g[3], h[3];
            for (int k = 0; k < 3; k++) x[k] = 4. * (gsl_rng_uniform(rng) - .5);
            if (dem_sdf_distance(vessel, x) < 0.) continue;
            assert_near(dem_sdf_distance(s, x), dem_sdf_distance(vessel, x), 1e-13);
            double f[3], expected[3];
            assert_int_equal(force(s, x, .2, f), force(vessel, x, .2, expected));
            for (int k = 0; k < 3; k++) assert_near(f[k], expected[k], 1e-13);
            (void)g, (void)h;
        }
        break;
    }
    report("box of six planes against a box", worst, 0.);
    assert_true(worst < 1e-12);
    double low[3], high[3], low2[3], high2[3];
    dem_sdf_bounds(box, low, high);
    dem_sdf_bounds(vessel, low2, high2);
    for (int k = 0; k < 3; k++) {
        assert_near(low[k], low2[k], 1e-15);
        assert_true(high[k] > low[k] && high[k] - low[k] < 1.7 * 1.7);
    }
    gsl_rng_free(rng);
    dem_sdf_free(s);
    dem_sdf_free(box);
    dem_sdf_free(vessel);
}

/* A cylinder cut aslant: its edge is an ellipse, whose nearest point a strewn curve tells. */
static void test_ellipse(void **state)
{
    (void)state;
    const double lo[3] = {0, 0, 0}, hi[3] = {0, 0, 1.}, at[3] = {0, 0, .6}, n[3] = {.6, 0, .8};
    dem_sdf *s = both(dem_sdf_cylinder(lo, hi, .3, 1, 0), dem_sdf_plane(at, n));
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    enum { POINTS = 4000 };
    double worst = 0.;
    int edge = 0;
    for (int q = 0; q < 1500; q++) {
        double x[3], g[3], least = INFINITY;
        for (int k = 0; k < 3; k++) x[k] = 1.4 * (gsl_rng_uniform(rng) - .5);
        x[2] += .7;
        const double phi = dem_sdf_eval(s, 0, x, g);
        const double w = hypot(x[0], x[1]), height = .6 * x[0] + .8 * (x[2] - .6);
        /* nearest of the slanted face, the side and the curve between them */
        double foot[3] = {x[0] - .6 * height, x[1], x[2] - .8 * height};
        if (hypot(foot[0], foot[1]) < .3 && height > 0.) least = height;
        if (w > .3 && .6 * x[0] * .3 / w + .8 * (x[2] - .6) < 0. && x[2] > 0.) least = w - .3;
        if (least == INFINITY && x[2] > .3) {
            for (int i = 0; i < POINTS; i++) {
                const double a = 2. * acos(-1.) * i / POINTS;
                const double p[3] = {.3 * cos(a), .3 * sin(a), .6 - .75 * .3 * cos(a)};
                least = fmin(least, hypot(hypot(x[0] - p[0], x[1] - p[1]), x[2] - p[2]));
            }
            if (w < .3 && height < 0.) continue; /* within */
            edge++;
            /* the curve's points are off by half a step at most: .5 (2.4e-4)^2 / least */
            assert_true(phi <= least + 1e-12);
            assert_true(least - phi < 1e-7 / fmax(least, .01));
            worst = fmax(worst, least - phi);
        } else if (least < INFINITY) {
            assert_near(phi, least, 1e-12);
        }
    }
    report("edge of a cylinder cut aslant, against points on it", worst, 0.);
    assert_true(edge > 200);
    gsl_rng_free(rng);
    dem_sdf_free(s);
}

/* A bowl: half a hollow ball with a thick wall. Solid, hollow and rim are all felt as they are. */
static void test_bowl(void **state)
{
    (void)state;
    const double o[3] = {0, 0, 0}, up[3] = {0, 0, 1.};
    dem_sdf *member[3] = {dem_sdf_sphere(o, .5, 0), dem_sdf_complement(dem_sdf_sphere(o, .4, 0)),
                          dem_sdf_plane(o, up)};
    dem_sdf *s = dem_sdf_intersection(3, member);
    const double inside[3] = {.1, 0, -.2}, rim[3] = {.45, 0, .02}, outer[3] = {0, .3, -.6},
                 above[3] = {.33, 0, .05}, solid[3] = {0, 0, -.47};
    double g[3];
    assert_near(dem_sdf_eval(s, 0, inside, g), .4 - hypot(.1, .2), 1e-14);
    assert_near(dem_sdf_eval(s, 0, rim, g), .02, 1e-14);
    assert_near(dem_sdf_eval(s, 0, outer, g), hypot(.3, .6) - .5, 1e-14);
    assert_near(dem_sdf_eval(s, 0, above, g), hypot(.07, .05), 1e-12);
    assert_near(g[0], -.07 / hypot(.07, .05), 1e-10);
    assert_near(dem_sdf_eval(s, 0, solid, g), -.03, 1e-14);
    double lo[3], hi[3];
    dem_sdf_bounds(s, lo, hi);
    assert_near(lo[2], -.5, 1e-15);
    assert_near(hi[2], 0., 1e-15);
    dem_sdf_free(s);
}

/* ---- transform, refusal ---------------------------------------------------------------------- */

static void test_transform(void **state)
{
    (void)state;
    const double o[3] = {0, 0, 0}, z[3] = {0, 0, 2.}, shift[3] = {1.1, -.3, .4};
    const double lo[3] = {0, 0, 0}, hi[3] = {.1, .2, .3};
    /* a quarter turn about z takes x to y */
    dem_sdf *s = dem_sdf_transform(dem_sdf_box(lo, hi, 0), 2., z, acos(0.), shift);
    const double x[3] = {1.1 - .2, -.3 + .1, .4 + .6 + .07};
    double g[3], low[3], high[3];
    assert_near(dem_sdf_eval(s, 0, x, g), .07, 1e-15);
    assert_near(g[2], 1., 1e-15);
    const double y[3] = {1.1 - .2, -.3 + .2 + .06, .4 + .3};
    assert_near(dem_sdf_eval(s, 0, y, g), .06, 1e-15);
    assert_near(g[1], 1., 1e-15);
    dem_sdf_bounds(s, low, high);
    assert_near(low[0], .7, 1e-15);
    assert_near(high[0], 1.1, 1e-15);
    assert_near(high[1], -.1, 1e-15);
    assert_near(high[2], 1., 1e-15);
    dem_sdf_free(s);
    assert_null(dem_sdf_transform(dem_sdf_box(lo, hi, 0), 0., z, 0., shift));
    assert_null(dem_sdf_transform(dem_sdf_box(lo, hi, 0), 1., o, 1., shift));
    assert_null(dem_sdf_transform(NULL, 1., z, 1., shift));
    s = dem_sdf_transform(dem_sdf_box(lo, hi, 0), 1., o, 0., shift);
    assert_non_null(s);
    dem_sdf_free(s);
}

static void test_refused(void **state)
{
    (void)state;
    const double o[3] = {0, 0, 0};
    assert_null(dem_sdf_union(0, NULL));
    assert_null(dem_sdf_intersection(0, NULL));
    assert_null(dem_sdf_complement(NULL));
    assert_null(either(dem_sdf_sphere(o, 1., 0), NULL));
    assert_null(both(NULL, dem_sdf_sphere(o, 1., 0)));
    /* complements undo themselves */
    const double lo[3] = {0, 0, 0}, hi[3] = {.1, .2, .3};
    dem_sdf *s =
        either(dem_sdf_box(lo, hi, 0), both(dem_sdf_sphere(o, 1., 0), dem_sdf_plane(o, hi)));
    dem_sdf *t = dem_sdf_complement(dem_sdf_complement(
        either(dem_sdf_box(lo, hi, 0), both(dem_sdf_sphere(o, 1., 0), dem_sdf_plane(o, hi)))));
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int q = 0; q < 500; q++) {
        double x[3];
        for (int k = 0; k < 3; k++) x[k] = 3. * (gsl_rng_uniform(rng) - .5);
        assert_true(dem_sdf_distance(s, x) == dem_sdf_distance(t, x));
    }
    assert_true(dem_sdf_memory(s) > 5 * sizeof(dem_sdf));
    gsl_rng_free(rng);
    dem_sdf_free(s);
    dem_sdf_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_seam),    cmocka_unit_test(test_corner),
        cmocka_unit_test(test_balls),   cmocka_unit_test(test_lens),
        cmocka_unit_test(test_planes),  cmocka_unit_test(test_ellipse),
        cmocka_unit_test(test_bowl),    cmocka_unit_test(test_transform),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
