/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * STL files, good and bad: each fault is named, with its place.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "near.h"
#include "stlFixture.h"

static dem_sdf *load(const char *path, int inside, int mend, char message[256])
{
    dem_stl stl = dem_stl_default();
    stl.path = path;
    stl.inside = inside;
    stl.mend = mend;
    return dem_sdf_stl(&stl, message, 256);
}

static void refused(const char *path, const char *why)
{
    char message[256];
    dem_sdf *s = load(path, 0, 0, message);
    assert_null(s);
    if (strstr(message, why) == NULL || strstr(message, path) == NULL) {
        print_error("message: %s\nwanted: %s\n", message, why);
        fail();
    }
    remove(path);
}

static void write_text(const char *path, const char *text, size_t n)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(text, 1, n, f), n);
    assert_int_equal(fclose(f), 0);
}

static void test_bad_files(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68};
    const char *path = scratch_path("bad.stl");
    body b = box_body(lo, hi, 1);
    refused(path, "cannot be opened: No such file");
    write_text(path, "", 0);
    refused(path, "the file is empty");
    write_text(path, "solid x\nendsolid x\n", 19);
    refused(path, "no triangle");
    write_text(path, "hello", 5);
    refused(path, "neither ASCII STL");

    write_binary(&b, path, "solid, says the header");
    assert_int_equal(truncate(path, 84 + 50 * 7 + 13), 0);
    refused(path, "cut short: its header promises 12 triangles (684 bytes), the file holds 7");
    const float nan = NAN;
    write_binary(&b, path, "");
    FILE *f = fopen(path, "r+b");
    assert_non_null(f);
    fseek(f, 84 + 50 * 4 + 12 + 4 * 5, SEEK_SET);
    fwrite(&nan, sizeof nan, 1, f);
    fclose(f);
    refused(path, "triangle 4 (byte 316): coordinate nan");
    const char *text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 inf 0\n";
    write_text(path, text, strlen(text));
    refused(path, "line 5, triangle 0: coordinate \"inf\"");
    text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0,5 0\n";
    write_text(path, text, strlen(text));
    refused(path, "line 5: expected \"coordinate\", found \"0,5\"");
    write_text(path, text, 60);
    refused(path, "line 5: the file ends where");

    body flat = box_body(lo, hi, 1);
    for (int k = 0; k < 3; k++) flat.x[5][2][k] = .5 * (flat.x[5][0][k] + flat.x[5][1][k]);
    write_ascii(&flat, path);
    refused(path, "1 of 12 triangles have no area, the first is number 5 at (");
    body_free(&flat);

    b.n--;
    write_ascii(&b, path);
    refused(path, "not closed: 3 edges, the first at (");
    b.n++;
    double swapped[3];
    memcpy(swapped, b.x[2][0], sizeof swapped);
    memcpy(b.x[2][0], b.x[2][1], sizeof swapped);
    memcpy(b.x[2][1], swapped, sizeof swapped);
    write_ascii(&b, path);
    refused(path, "not oriented: at 3 edges, the first at (");
    body_free(&b);

    const double hi2[3] = {.9, .7, .68}, lo2[3] = {.47, .33, -.55};
    b = box_body(lo, hi, 1);
    body c = box_body(lo2, hi2, 1); /* touches along an edge */
    for (size_t i = 0; i < c.n; i++) add_triangle(&b, c.x[i][0], c.x[i][1], c.x[i][2]);
    write_ascii(&b, path);
    char message[256];
    dem_sdf *s = load(path, 0, 1, message);
    assert_non_null(s); /* mend takes it */
    const double x[3] = {.5, .4, .1};
    assert_near(dem_sdf_distance(s, x), -.03, 1e-12);
    dem_sdf_free(s);
    refused(path, "not a simple surface: 1 edges, the first at (");
    body_free(&b);
    body_free(&c);
}

static void test_good_files(void **state)
{
    (void)state;
    char message[256];
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68}, x[3] = {.87, .63, .68};
    const char *path = scratch_path("good.stl");
    body b = box_body(lo, hi, 2);
    write_binary(&b, path, "solid of a writer that ignores the convention");
    dem_sdf *s = load(path, 0, 0, message);
    assert_non_null(s);
    assert_string_equal(message, "");
    assert_near(dem_sdf_distance(s, x), .5, 1e-7); /* single precision */
    double low[3], high[3];
    dem_sdf_bounds(s, low, high);
    for (int k = 0; k < 3; k++) {
        assert_near(low[k], lo[k], 1e-7);
        assert_near(high[k], hi[k], 1e-7);
    }
    dem_sdf_free(s);

    /* Two solids in a file, other case and blanks; inside out; in millimetres. */
    FILE *f = fopen(path, "w");
    for (int part = 0; part < 2; part++) {
        fprintf(f, "SOLID \tpart %d\r\n", part);
        for (size_t i = part ? 0 : 7; i < (part ? 7 : b.n); i++) {
            fprintf(f, "Facet Normal 0 nan 1\r\n\tOUTER LOOP\r\n");
            for (int v = 2; v >= 0; v--)
                fprintf(f, "vertex %.17g %.17e\r\n\r\n%.17g\r\n", 1e3 * b.x[i][v][0],
                        1e3 * b.x[i][v][1], 1e3 * b.x[i][v][2]);
            fprintf(f, "endLoop\r\nendFacet\r\n");
        }
        fprintf(f, "EndSolid part %d\r\n", part);
    }
    fclose(f);
    dem_stl stl = dem_stl_default();
    stl.path = path;
    stl.scale = 1e-3;
    s = dem_sdf_stl(&stl, message, sizeof message);
    assert_non_null(s);
    assert_non_null(strstr(message, "inside out"));
    assert_near(dem_sdf_distance(s, x), .5, 1e-14);
    dem_sdf_free(s);
    stl.scale = 0.;
    assert_null(dem_sdf_stl(&stl, message, sizeof message));
    assert_non_null(strstr(message, "scale"));
    stl.scale = 1.;
    stl.feature_angle = 3.2;
    assert_null(dem_sdf_stl(&stl, message, sizeof message));
    assert_non_null(strstr(message, "feature angle"));
    remove(path);
    body_free(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bad_files),
        cmocka_unit_test(test_good_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
