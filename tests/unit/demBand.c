/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Surfaces sampled in a narrow band: gradient, enclosed volume, memory, refinement, cache.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <dirent.h>
#include <gsl/gsl_rng.h>

#include "band.h"
#include "near.h"
#include "stlFixture.h"

static void sample_shape(dem_sdf *s, double spacing, double width, const char *cache)
{
    char message[512];
    const dem_status status = sdf_sample(s, spacing, width, cache, NULL, message, sizeof message);
    if (status || message[0]) print_error("%s\n", message);
    assert_int_equal(status, DEM_OK);
    assert_string_equal(message, "");
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The gradient is that of the interpolant, to rounding, and the interpolant is near the truth. */
static void test_gradient(void **state)
{
    (void)state;
    const double o[3] = {.03, -.02, .05}, h = .02;
    body b = ball_body(o, .6, 7, .2);
    dem_sdf *s = stl_shape(&b, 0), *exact = stl_shape(&b, 0);
    sample_shape(s, h, .1, NULL);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    int compared = 0;
    double worst = 0., steepest = 0.;
    for (int q = 0; q < 20000; q++) {
        double x[3], g[3], unused[3];
        for (int k = 0; k < 3; k++) x[k] = 1.8 * (gsl_rng_uniform(rng) - .5);
        for (int p = 0; p < dem_sdf_parts(s); p++) {
            const double phi = dem_sdf_eval(s, p, x, g);
            if (!(fabs(phi) < .09)) continue;
            compared++;
            steepest = fmax(steepest, dot(g, g));
            for (int k = 0; k < 3; k++) {
                /* within a cell phi is linear along a coordinate: differences are exact */
                double y[3] = {x[0], x[1], x[2]}, t = (x[k] - s->band->origin[k]) / h;
                const double to = t - floor(t) < .5 ? .3 : -.3;
                y[k] += to * h;
                const double other = dem_sdf_eval(s, p, y, unused);
                if (other < SDF_HIDDEN) assert_near(g[k], (other - phi) / (to * h), 1e-11);
            }
        }
        const double phi = dem_sdf_distance(s, x), truth = dem_sdf_distance(exact, x);
        assert_true((phi < 0.) == (truth < 0.) || fabs(truth) < .5 * h);
        if (fabs(truth) < .09) worst = fmax(worst, fabs(phi - truth));
        if (fabs(truth) > .1) assert_true(fabs(phi) > .1 - .5 * h);
    }
    report("sampled distance of a rough ball / spacing", worst / h, 0.);
    assert_true(compared > 3000 && steepest < 1.8);
    assert_true(worst < .5 * h);
    gsl_rng_free(rng);
    dem_sdf_free(s);
    dem_sdf_free(exact);
    body_free(&b);
}

/* Volume where the samples say phi < 0, by cells that a plane cuts at the distance of their centre.
 */
static double enclosed(const dem_sdf *s, double step)
{
    double lo[3], hi[3], sum = 0.;
    dem_sdf_bounds(s, lo, hi);
    int n[3];
    for (int k = 0; k < 3; k++) n[k] = (int)ceil((hi[k] - lo[k]) / step) + 2;
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++)
            for (int k = 0; k < n[2]; k++) {
                const double x[3] = {lo[0] + (i - .5) * step, lo[1] + (j - .5) * step,
                                     lo[2] + (k - .5) * step};
                const double phi = dem_sdf_distance(s, x);
                sum += fmin(fmax(.5 - phi / step, 0.), 1.);
            }
    return sum * step * step * step;
}

static void check_volume(body *b, double spacing, double exact, const char *what)
{
    dem_sdf *s = stl_shape(b, 0);
    sample_shape(s, spacing, 3. * spacing, NULL);
    const double volume = enclosed(s, .8 * spacing), of_mesh = body_volume(b);
    report(what, volume, of_mesh);
    assert_near(of_mesh, exact, .005 * exact); /* the mesh is what it should be */
    assert_near(volume, of_mesh, .005 * of_mesh);
    dem_sdf_free(s);
    body_free(b);
}

static void test_volume(void **state)
{
    (void)state;
    const double pi = acos(-1.), o[3] = {.21, -.43, .17};
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68};
    body b = ball_body(o, .6, 40, 0.);
    check_volume(&b, .03, 4. / 3. * pi * .216, "volume in a sampled ball");
    b = torus_body(.5, .23, 90, 60);
    check_volume(&b, .025, 2. * pi * pi * .5 * .23 * .23, "volume in a sampled torus");
    b = box_body(lo, hi, 3);
    move_body(&b, .83, o);
    check_volume(&b, .03, .78 * .75 * 1.23, "volume in a sampled turned box");
}

/* Halving the spacing, and the width with it, takes four times the memory. */
static void test_memory(void **state)
{
    (void)state;
    const double o[3] = {.21, -.43, .17};
    double before = 0.;
    for (int level = 0; level < 3; level++) {
        body b = ball_body(o, .3, 12, .1);
        dem_sdf *s = stl_shape(&b, 0);
        const double h = .012 / (1 << level), bare = dem_sdf_memory(s);
        sample_shape(s, h, 3. * h, NULL);
        const double memory = dem_sdf_memory(s) - bare;
        if (level > 0) {
            report("memory of half the spacing by that of the whole", memory / before, 4.);
            assert_true(memory / before > 3.5 && memory / before < 4.6);
        }
        before = memory;
        dem_sdf_free(s);
        body_free(&b);
    }
}

/* Flat faces are exact, whatever the triangles; a vessel's too, up to its corners. */
static void test_flat(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68};
    const double zero[3] = {0, 0, 0}, axis[3] = {.3, -.9, .5};
    dem_sdf *s[3], *exact = dem_sdf_transform(dem_sdf_box(lo, hi, 1), 1., axis, .83, zero);
    for (int level = 0; level < 3; level++) {
        body b = box_body(lo, hi, 1 << level);
        move_body(&b, .83, zero);
        s[level] = stl_shape(&b, 1);
        assert_int_equal(dem_sdf_parts(s[level]), 6);
        sample_shape(s[level], .02, .1, NULL);
        body_free(&b);
    }
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    double worst = 0., off = 0.;
    int near = 0;
    for (int q = 0; q < 30000; q++) {
        double x[3], g[3];
        for (int k = 0; k < 3; k++) x[k] = 1.6 * (gsl_rng_uniform(rng) - .5);
        if (dem_sdf_distance(exact, x) < 0.) continue;
        double sorted[3][6], truth[6];
        for (int p = 0; p < 6; p++) truth[p] = dem_sdf_eval(exact, p, x, g);
        for (int level = 0; level < 3; level++)
            for (int p = 0; p < 6; p++) sorted[level][p] = dem_sdf_eval(s[level], p, x, g);
        for (int p = 0; p < 6; p++) {
            if (truth[p] > .09) continue;
            near++;
            double least = INFINITY; /* parts are in another order */
            for (int r = 0; r < 6; r++) least = fmin(least, fabs(sorted[0][r] - truth[p]));
            off = fmax(off, least);
            for (int level = 1; level < 3; level++) {
                least = INFINITY;
                for (int r = 0; r < 6; r++) least = fmin(least, fabs(sorted[level][r] - truth[p]));
                worst = fmax(worst, least);
            }
        }
    }
    report("faces of a sampled vessel against planes", off, 0.);
    report("the same refined 4 and 16 times", worst, 0.);
    print_message("%d faces near\n", near);
    assert_true(near > 2000);
    assert_true(off < 1e-13 && worst < 1e-13);
    gsl_rng_free(rng);
    for (int level = 0; level < 3; level++) dem_sdf_free(s[level]);
    dem_sdf_free(exact);
}

/* A mesh in millimetres read as metres does not eat the machine. */
static void test_units(void **state)
{
    (void)state;
    const double lo[3] = {0, 0, 0}, hi[3] = {4e5, 3e5, 7e5};
    char message[512];
    body b = box_body(lo, hi, 1);
    dem_sdf *s = stl_shape(&b, 1);
    assert_int_equal(sdf_sample(s, 2.5e-4, 2e-3, NULL, NULL, message, sizeof message),
                     DEM_NO_MEMORY);
    assert_non_null(strstr(message, "wrong units"));
    assert_int_equal(sdf_sample(s, 0., 2e-3, NULL, NULL, message, sizeof message),
                     DEM_BAD_ARGUMENT);
    dem_sdf_free(s);
    body_free(&b);
}

/* ---- cache ----------------------------------------------------------------------------------- */

/* Files in the directory: how many; the path of the last one. */
static int list(const char *directory, char path[1024])
{
    int n = 0;
    DIR *d = opendir(directory);
    if (d == NULL) return 0;
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        if (e->d_name[0] == '.') continue;
        n++;
        snprintf(path, 1024, "%s/%s", directory, e->d_name);
    }
    closedir(d);
    return n;
}

static int progress_calls;

static void count_progress(void *context, const char *what, double done)
{
    (void)context;
    assert_non_null(what);
    assert_true(done > 0. && done <= 1.);
    progress_calls++;
}

/* Sampled with the cache; whether samples were made anew, and the note. */
static dem_sdf *cached(const body *b, double spacing, const char *directory, int *made,
                       char message[512])
{
    dem_sdf *s = stl_shape(b, 0);
    const sdf_progress progress = {.call = count_progress};
    progress_calls = 0;
    assert_int_equal(sdf_sample(s, spacing, .08, directory, &progress, message, 512), DEM_OK);
    *made = progress_calls > 0;
    return s;
}

static void assert_same(const dem_sdf *s, const dem_sdf *t)
{
    assert_int_equal(s->band->n, t->band->n);
    assert_int_equal(s->band->n_side, t->band->n_side);
    assert_memory_equal(s->band->value, t->band->value, s->band->n * sizeof *s->band->value);
    assert_memory_equal(s->band->hidden, t->band->hidden, s->band->n * sizeof *s->band->hidden);
    assert_memory_equal(s->band->place, t->band->place, s->band->n * sizeof *s->band->place);
    assert_memory_equal(s->band->side, t->band->side, s->band->n_side * sizeof *s->band->side);
}

static void test_cache(void **state)
{
    (void)state;
    const double o[3] = {.03, -.02, .05};
    char directory[600], path[1024], message[512];
    int made;
    char base[512];
    snprintf(base, sizeof base, "%s", scratch_path("cache"));
    snprintf(directory, sizeof directory, "%s/of/shapes", base);
    body b = ball_body(o, .3, 6, .2);
    dem_sdf *first = cached(&b, .02, directory, &made, message);
    assert_true(made);
    assert_string_equal(message, "");
    assert_int_equal(list(directory, path), 1);
    dem_sdf *second = cached(&b, .02, directory, &made, message);
    assert_false(made);
    assert_string_equal(message, "");
    assert_same(first, second);
    dem_sdf_free(second);

    /* damage: a changed byte, at many places; the first half only; something else */
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    fseek(f, 0, SEEK_END);
    const long size = ftell(f);
    fclose(f);
    int noticed = 0;
    for (int kind = 0; kind < 24; kind++) {
        if (kind < 22) {
            f = fopen(path, "r+b");
            const long at = kind < 2 ? 3 : size / 22 * kind + 11;
            fseek(f, at, SEEK_SET);
            const int byte = fgetc(f);
            fseek(f, at, SEEK_SET);
            fputc(byte ^ 0x55, f);
            fclose(f);
        } else if (kind == 22) {
            assert_int_equal(truncate(path, size / 2), 0);
        } else {
            f = fopen(path, "wb");
            fputs("not HDF5", f);
            fclose(f);
        }
        second = cached(&b, .02, directory, &made, message);
        assert_same(first, second); /* whatever happened */
        assert_true(made == (message[0] != '\0'));
        if (made) assert_non_null(strstr(message, "made again"));
        noticed += made;
        dem_sdf_free(second);
        second = cached(&b, .02, directory, &made, message);
        assert_false(made); /* repaired */
        dem_sdf_free(second);
    }
    print_message("damage noticed in %d of 24 files, none believed\n", noticed);
    assert_true(noticed > 18);
    dem_sdf_free(first);

    first = cached(&b, .021, directory, &made, message);
    assert_true(made);
    assert_int_equal(list(directory, path), 2);
    dem_sdf_free(first);
    body_free(&b);
    b = ball_body(o, .3, 6, .2001);
    first = cached(&b, .02, directory, &made, message);
    assert_true(made);
    assert_int_equal(list(directory, path), 3);
    dem_sdf_free(first);
    body_free(&b);

    /* where it cannot be written there is a note, and the run goes on */
    snprintf(path, sizeof path, "%s/file", directory);
    f = fopen(path, "w");
    fclose(f);
    b = ball_body(o, .3, 6, .2);
    first = cached(&b, .02, path, &made, message);
    assert_true(made);
    assert_non_null(strstr(message, "samples not kept"));
    dem_sdf_free(first);
    body_free(&b);
    while (list(directory, path) > 0) assert_int_equal(remove(path), 0);
    assert_int_equal(rmdir(directory), 0);
    snprintf(directory, sizeof directory, "%s/of", base);
    assert_int_equal(rmdir(directory), 0);
    assert_int_equal(rmdir(base), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradient), cmocka_unit_test(test_volume),
        cmocka_unit_test(test_memory),   cmocka_unit_test(test_flat),
        cmocka_unit_test(test_units),    cmocka_unit_test(test_cache),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
