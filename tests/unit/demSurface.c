/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Surfaces of triangles: nearest point, side, parts.
 *
 * Distances are compared with the smallest over all triangles, each by a method of its own (a
 * minimisation over the three edges and the inside, not the regions of surface_search.c); sides
 * with the sum of all solid angles.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <gsl/gsl_rng.h>

#include "near.h"
#include "sdf.h"
#include "stlFixture.h"
#include "surface.h"

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double to_segment(const double x[3], const double p[3], const double q[3])
{
    double d[3], e[3], off[3];
    for (int k = 0; k < 3; k++) {
        d[k] = q[k] - p[k];
        e[k] = x[k] - p[k];
    }
    const double t = fmin(fmax(dot(d, e) / dot(d, d), 0.), 1.);
    for (int k = 0; k < 3; k++) off[k] = e[k] - t * d[k];
    return sqrt(dot(off, off));
}

static double to_triangle(const double x[3], double t[3][3])
{
    double a[3], b[3], n[3], e[3], least = INFINITY;
    int within = 1;
    for (int k = 0; k < 3; k++) {
        a[k] = t[1][k] - t[0][k];
        b[k] = t[2][k] - t[0][k];
    }
    cross(a, b, n);
    for (int v = 0; v < 3; v++) {
        double side[3], edge[3];
        least = fmin(least, to_segment(x, t[v], t[(v + 1) % 3]));
        for (int k = 0; k < 3; k++) {
            edge[k] = t[(v + 1) % 3][k] - t[v][k];
            e[k] = x[k] - t[v][k];
        }
        cross(edge, e, side);
        within &= dot(side, n) >= 0.;
    }
    return within ? fabs(dot(e, n)) / sqrt(dot(n, n)) : least;
}

static double brute_distance(const body *b, const double x[3])
{
    double least = INFINITY;
    for (size_t i = 0; i < b->n; i++) least = fmin(least, to_triangle(x, b->x[i]));
    return least;
}

static double brute_winding(const body *b, const double x[3])
{
    double sum = 0.;
    for (size_t i = 0; i < b->n; i++) {
        double e[3][3], l[3], n[3];
        for (int v = 0; v < 3; v++) {
            for (int k = 0; k < 3; k++) e[v][k] = b->x[i][v][k] - x[k];
            l[v] = sqrt(dot(e[v], e[v]));
        }
        cross(e[1], e[2], n);
        sum += 2. * atan2(dot(e[0], n), l[0] * l[1] * l[2] + dot(e[0], e[1]) * l[2] +
                                            dot(e[1], e[2]) * l[0] + dot(e[2], e[0]) * l[1]);
    }
    return sum / (4. * acos(-1.));
}

/* ---- distance -------------------------------------------------------------------------------- */

static void check_body(const body *b, double reach, const char *what)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    dem_sdf *out = stl_shape(b, 0), *in = stl_shape(b, 1);
    double worst = 0.;
    int inside = 0;
    for (int q = 0; q < 2000; q++) {
        double x[3], g[3], h[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++) x[k] = reach * (2. * gsl_rng_uniform(rng) - 1.);
        const double w = brute_winding(b, x), expected = brute_distance(b, x);
        const double phi = dem_sdf_distance(out, x);
        assert_near(fabs(w - rint(w)), 0., 1e-9);
        assert_true((phi < 0.) == (w > .5));
        inside += phi < 0.;
        worst = fmax(worst, fabs(fabs(phi) - expected));
        assert_near(dem_sdf_distance(in, x), -phi, 1e-13);
        /* parts that are felt: their smallest is the distance, none is negative in free space */
        for (int side = 0; side < 2; side++) {
            const dem_sdf *s = side ? in : out;
            double least = INFINITY;
            for (int p = 0; p < dem_sdf_parts(s); p++) {
                const double value = dem_sdf_eval(s, p, x, g);
                if (value < SDF_HIDDEN) assert_near(dot(g, g), 1., 1e-9);
                if (value < least) memcpy(h, g, sizeof h);
                least = fmin(least, value);
                if (value < SDF_HIDDEN) assert_true(sdf_near(s, p, x, fabs(value) + 1e-9));
            }
            assert_near(least, side ? -phi : phi, 1e-12);
            /* the foot is on the surface */
            for (int k = 0; k < 3; k++) g[k] = x[k] - least * h[k];
            assert_near(brute_distance(b, g), 0., 1e-9);
        }
    }
    report(what, worst, 0.);
    assert_true(inside > 100);
    assert_near(worst, 0., 1e-12);
    dem_sdf_free(out);
    dem_sdf_free(in);
    gsl_rng_free(rng);
}

static void test_nearest(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68}, o[3] = {.03, -.02, .05};
    body b = ball_body(o, .6, 7, .35);
    check_body(&b, .9, "distance to a rough ball, worst of 2000");
    body_free(&b);
    b = box_body(lo, hi, 3);
    move_body(&b, .83, o);
    check_body(&b, .9, "distance to a turned box, worst of 2000");
    body_free(&b);
    b = torus_body(.5, .23, 24, 16);
    check_body(&b, .8, "distance to a torus, worst of 2000");
    body_free(&b);
}

/* A plate with a smaller box on it, in one piece: an L in section along both directions. */
static body step_body(void)
{
    body b = {0, 0, NULL};
    const double x[4] = {-.6, -.2, .3, .6}, y[4] = {-.5, -.1, .25, .5}, z[3] = {-.2, .1, .5};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int up = i == 1 && j == 1;
            const double top = up ? z[2] : z[1];
            const double p[3] = {x[i], y[j], top}, q[3] = {x[i], y[j], z[0]};
            const double a[3] = {x[i + 1] - x[i], 0, 0}, c[3] = {0, y[j + 1] - y[j], 0};
            add_face(&b, p, a, c, 1);
            add_face(&b, q, c, a, 1);
            for (int side = 0; side < 4; side++) { /* outer walls, and those of the box */
                const int along = side / 2, upper = side % 2;
                const int rim = along ? (upper ? j == 2 : j == 0) : (upper ? i == 2 : i == 0);
                if (!rim && !up) continue;
                double r[3] = {x[i], y[j], rim ? z[0] : z[1]}, h[3] = {0, 0, 0};
                if (upper) r[along] = along ? y[j + 1] : x[i + 1];
                h[2] = rim ? z[1] - z[0] : z[2] - z[1];
                const double *edge = along ? a : c;
                if (upper != along)
                    add_face(&b, r, edge, h, 1);
                else
                    add_face(&b, r, h, edge, 1);
            }
        }
    return b;
}

static void test_parts(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68};
    body b = box_body(lo, hi, 2);
    dem_sdf *s = stl_shape(&b, 0);
    assert_int_equal(dem_sdf_parts(s), 1);
    s = dem_sdf_complement(s); /* a vessel */
    assert_int_equal(dem_sdf_parts(s), 6);
    dem_sdf_free(s);
    body_free(&b);

    /* A tube of many facets and two ends. */
    const double pi = acos(-1.);
    enum { FACETS = 32 };
    for (int i = 0; i < FACETS; i++) {
        const double c0 = .4 * cos(2 * pi * i / FACETS), s0 = .4 * sin(2 * pi * i / FACETS);
        const int j = (i + 1) % FACETS;
        const double c1 = .4 * cos(2 * pi * j / FACETS), s1 = .4 * sin(2 * pi * j / FACETS);
        const double p[4][3] = {{c0, s0, 0}, {c1, s1, 0}, {c1, s1, .7}, {c0, s0, .7}};
        const double bottom[3] = {0, 0, 0}, top[3] = {0, 0, .7};
        add_triangle(&b, p[0], p[1], p[2]);
        add_triangle(&b, p[0], p[2], p[3]);
        add_triangle(&b, bottom, p[1], p[0]);
        add_triangle(&b, top, p[3], p[2]);
    }
    s = stl_shape(&b, 1);
    assert_int_equal(dem_sdf_parts(s), 3);
    dem_sdf_free(s);
    body_free(&b);

    b = step_body(); /* the plate and the box on it, felt apart; from within: 5 + 6, less what ...
                      */
    check_body(&b, .8, "distance to a box on a plate, worst of 2000");
    s = stl_shape(&b, 0);
    assert_int_equal(dem_sdf_parts(s), 2);
    /* in the corner both are felt, each by its face */
    const double corner[3] = {.3 + .04, .07, .1 + .03};
    double g[2][3], phi[2];
    for (int p = 0; p < 2; p++) phi[p] = dem_sdf_eval(s, p, corner, g[p]);
    const int box = fabs(g[0][0]) > .5 ? 0 : 1;
    assert_near(phi[box], .04, 1e-14);
    assert_near(g[box][0], 1., 1e-14);
    assert_near(phi[1 - box], .03, 1e-14);
    assert_near(g[1 - box][2], 1., 1e-14);
    /* on the far side of the box the plate's part is hidden, and so is what is under it */
    const double top[3] = {.1, .05, .55};
    assert_near(dem_sdf_eval(s, box, top, g[0]), .05, 1e-14);
    assert_true(dem_sdf_eval(s, 1 - box, top, g[0]) == SDF_HIDDEN);
    dem_sdf_free(s);
    body_free(&b);
}

/* Energy of a ball of radius r at x, stiffness 1, and the sum of its overlaps. */
static double energy(const dem_sdf *s, const double x[3], double r, double *overlap)
{
    double sum = 0., g[3];
    *overlap = 0.;
    for (int p = 0; p < dem_sdf_parts(s); p++) {
        const double phi = dem_sdf_eval(s, p, x, g);
        if (!(phi < r)) continue;
        sum += .5 * (r - phi) * (r - phi);
        *overlap += r - phi;
    }
    return sum;
}

/* Parts come into view and go out of it where they do not touch: the energy of a ball that is led
 * about the corners, edges and creases of a box on a plate, seen from either side, has no steps. */
static void test_no_steps(void **state)
{
    (void)state;
    const double r = .05, move = 1e-8;
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    body b = step_body();
    for (int kind = 0; kind < 4; kind++) {
        dem_sdf *s = stl_shape(&b, kind % 2);
        char message[256];
        if (kind > 1)
            assert_int_equal(sdf_sample(s, .02, .09, NULL, NULL, message, sizeof message), DEM_OK);
        int touched = 0, twice = 0;
        double worst = 0.;
        for (int q = 0; q < 40000; q++) {
            double x[3], y[3], o1, o2, size = 0.;
            /* near the crease and the edges of the box */
            for (int k = 0; k < 3; k++) x[k] = 1.4 * (gsl_rng_uniform(rng) - .5);
            x[2] = -.25 + .8 * gsl_rng_uniform(rng);
            const double phi = dem_sdf_distance(s, x);
            if (phi < .03 || phi > r) continue;
            /* steps of all sizes, to cross borders, and a tiny one, to see what is there */
            for (int k = 0; k < 3; k++) {
                y[k] = x[k] + move * (2. * gsl_rng_uniform(rng) - 1.);
                size += fabs(y[k] - x[k]);
            }
            const double change = energy(s, y, r, &o2) - energy(s, x, r, &o1);
            touched++;
            twice += o1 > 1.5 * (r - phi);
            worst = fmax(worst, fabs(change) / (1.8 * size * fmax(o1, o2)));
        }
        /* bisect a way from each place to another one for the largest step of energy */
        double largest = 0.;
        for (int q = 0; q < 3000; q++) {
            double a[3], c[3], oa, oc;
            for (int k = 0; k < 3; k++) a[k] = 1.4 * (gsl_rng_uniform(rng) - .5);
            for (int k = 0; k < 3; k++) c[k] = a[k] + .02 * (gsl_rng_uniform(rng) - .5);
            if (dem_sdf_distance(s, a) < .03 || dem_sdf_distance(s, c) < .03) continue;
            double ea = energy(s, a, r, &oa), ec = energy(s, c, r, &oc);
            for (int i = 0; i < 30; i++) {
                double m[3], om;
                for (int k = 0; k < 3; k++) m[k] = .5 * (a[k] + c[k]);
                if (dem_sdf_distance(s, m) < .03) break;
                const double em = energy(s, m, r, &om);
                const int left = fabs(em - ea) > fabs(ec - em);
                memcpy(left ? c : a, m, sizeof m);
                *(left ? &ec : &ea) = em;
            }
            if (fabs(a[0] - c[0]) < 1e-9) largest = fmax(largest, fabs(ea - ec));
        }
        report(kind > 1 ? "largest step of energy / (.02 r), sampled"
                        : "largest step of energy / (.02 r)",
               largest / (.02 * r), 0.);
        assert_true(touched > 500 && twice > 3);
        assert_true(worst < 1.);
        assert_true(largest < 1e-9 * r);
        dem_sdf_free(s);
    }
    gsl_rng_free(rng);
    body_free(&b);
}

/* A wall thinner than a particle, between two rooms: the far room is not felt. */
static void test_thin_wall(void **state)
{
    (void)state;
    const double lo[3] = {0, 0, 0}, hi[3] = {.5, .5, .5}, lo2[3] = {.502, 0, 0},
                 hi2[3] = {1., .5, .5};
    body b = box_body(lo, hi, 1), c = box_body(lo2, hi2, 1);
    for (size_t i = 0; i < c.n; i++) add_triangle(&b, c.x[i][0], c.x[i][1], c.x[i][2]);
    dem_sdf *s = stl_shape(&b, 1);
    const double x[3] = {.47, .2, .24};
    double g[3], least = INFINITY;
    int felt = 0;
    assert_int_equal(dem_sdf_parts(s), 12);
    for (int p = 0; p < 12; p++) {
        const double phi = dem_sdf_eval(s, p, x, g);
        felt += phi < .05;
        least = fmin(least, phi);
    }
    assert_int_equal(felt, 1);
    assert_near(least, .03, 1e-15);
    dem_sdf_free(s);
    body_free(&b);
    body_free(&c);
}

/* Cutting triangles in 4 and 16 changes nothing, and nothing steps across their edges. */
static void test_refined(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68}, o[3] = {1.3, -.7, 2.1};
    dem_sdf *s[3];
    for (int level = 0; level < 3; level++) {
        body b = box_body(lo, hi, 1 << level);
        move_body(&b, .39, o);
        s[level] = stl_shape(&b, 0);
        body_free(&b);
    }
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    double worst = 0.;
    for (int q = 0; q < 3000; q++) {
        double x[3], g[3][3], phi[3];
        for (int k = 0; k < 3; k++) x[k] = o[k] + 1.6 * (gsl_rng_uniform(rng) - .5);
        for (int level = 0; level < 3; level++) phi[level] = dem_sdf_eval(s[level], 0, x, g[level]);
        /* within, on a medial plane, two faces are equally near */
        for (int level = 1; level < 3; level++) {
            worst = fmax(worst, fabs(phi[level] - phi[0]));
            for (int k = 0; k < 3 && phi[0] > 0.; k++)
                worst = fmax(worst, fabs(g[level][k] - g[0][k]));
        }
    }
    report("refining a turned box 4 and 16 times, worst change", worst, 0.);
    assert_true(worst < 1e-12);
    gsl_rng_free(rng);
    for (int level = 0; level < 3; level++) dem_sdf_free(s[level]);
}

/* ---- holes ----------------------------------------------------------------------------------- */

static dem_sdf *load(const char *path, int inside, int mend, char message[256])
{
    dem_stl stl = dem_stl_default();
    stl.path = path;
    stl.inside = inside;
    stl.mend = mend;
    return dem_sdf_stl(&stl, message, 256);
}

static void test_mended(void **state)
{
    (void)state;
    char message[256];
    const double o[3] = {.03, -.02, .05};
    body b = ball_body(o, .6, 9, .2);
    b.n -= 3; /* holes */
    const char *path = scratch_path("open.stl");
    write_ascii(&b, path);
    assert_null(load(path, 0, 0, message));
    assert_non_null(strstr(message, "not closed"));
    dem_sdf *out = load(path, 0, 1, message), *in = load(path, 1, 1, message);
    assert_non_null(out);
    assert_non_null(in);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    int inside = 0, compared = 0;
    double worst = 0.;
    for (int q = 0; q < 2000; q++) {
        double x[3];
        for (int k = 0; k < 3; k++) x[k] = 1.8 * (gsl_rng_uniform(rng) - .5);
        const double w = brute_winding(&b, x), phi = dem_sdf_distance(out, x);
        assert_near(fabs(phi), brute_distance(&b, x), 1e-12);
        worst = fmax(worst, fabs(surface_winding(out->surface, x) - w));
        if (fabs(w - .5) < .05) continue;
        compared++;
        inside += w > .5;
        assert_true((phi < 0.) == (w > .5));
        assert_true((dem_sdf_distance(in, x) < 0.) == (w < .5));
    }
    report("winding number by dipoles of far nodes", worst, 0.);
    assert_true(worst < .02);
    assert_true(inside > 200 && compared > 1900);
    gsl_rng_free(rng);
    dem_sdf_free(out);
    dem_sdf_free(in);
    remove(path);
    body_free(&b);
}

/* Next to the tip of a needle one of whose faces is cut in many: the side is told by normals that
 * are weighted by angles; by the number of triangles that face would outvote the others. */
static void test_needle(void **state)
{
    (void)state;
    enum { SLIVERS = 60 };
    const double tip[3] = {.02, .03, 1.}, a[3] = {-.1, -.1, 0.}, c[3] = {.1, -.1, 0.},
                 d[3] = {0., .12, 0.};
    body b = {0, 0, NULL};
    for (int i = 0; i < SLIVERS; i++) {
        double p[3], q[3];
        for (int k = 0; k < 3; k++) {
            p[k] = a[k] + (c[k] - a[k]) * i / SLIVERS;
            q[k] = a[k] + (c[k] - a[k]) * (i + 1) / SLIVERS;
        }
        add_triangle(&b, p, q, tip);
        add_triangle(&b, q, p, d);
    }
    add_triangle(&b, c, d, tip);
    add_triangle(&b, d, a, tip);
    assert_true(body_volume(&b) > 0.);
    dem_sdf *s = stl_shape(&b, 0);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    int beyond = 0;
    for (int q = 0; q < 4000; q++) {
        double x[3], to_a = 0., to_c = 0., to_d = 0., far = 0.;
        for (int k = 0; k < 3; k++) {
            const double u = 2. * gsl_rng_uniform(rng) - 1.;
            x[k] = tip[k] + .05 * u;
            far += .05 * u * .05 * u;
            to_a += u * (a[k] - tip[k]);
            to_c += u * (c[k] - tip[k]);
            to_d += u * (d[k] - tip[k]);
        }
        if (to_a > 0. || to_c > 0. || to_d > 0.) continue; /* nearer to an edge or a face */
        beyond++;
        assert_near(dem_sdf_distance(s, x), sqrt(far), 1e-14);
    }
    assert_true(beyond > 1000);
    gsl_rng_free(rng);
    dem_sdf_free(s);
    body_free(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nearest),   cmocka_unit_test(test_needle),
        cmocka_unit_test(test_parts),     cmocka_unit_test(test_no_steps),
        cmocka_unit_test(test_thin_wall), cmocka_unit_test(test_refined),
        cmocka_unit_test(test_mended),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
