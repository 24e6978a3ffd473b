/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseMesh.c - a blockMeshDict as one box: forms that mean the same, and what is refused.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseFixture.h"
#include "near.h"

static const char *const plain =
    "scale 0.001;\n"
    "vertices ((-7.5 -75 0) (7.5 -75 0) (7.5 75 0) (-7.5 75 0)\n"
    "          (-7.5 -75 450) (7.5 -75 450) (7.5 75 450) (-7.5 75 450));\n"
    "blocks (hex (0 1 2 3 4 5 6 7) (2 30 90) simpleGrading (1 1 1));\n"
    "edges ();\n"
    "boundary\n"
    "(\n"
    "top { type patch; faces ((4 5 6 7)); }\n"
    "bottom { type patch; faces ((0 3 2 1)); }\n"
    "walls { type wall; faces ((0 1 5 4) (2 3 7 6)); }\n"
    "frontAndBack { type symmetryPlane; faces ((1 2 6 5) (3 0 4 7)); }\n"
    ");\n";

static case_mesh read_text(const char *text, case_errors **errors)
{
    case_mesh mesh;
    fixture f = fixture_new();
    put_file(&f, "system/blockMeshDict", text);
    case_read_mesh(f.directory, &mesh, f.errors);
    *errors = f.errors;
    f.errors = case_errors_new();
    fixture_free(&f);
    return mesh;
}

static void assert_is_bed(const char *text)
{
    static const char *const name[] = {"frontAndBack", "frontAndBack", "walls",
                                       "walls",        "bottom",       "top"};
    static const case_patch_type type[] = {CASE_SYMMETRY, CASE_SYMMETRY, CASE_WALL,
                                           CASE_WALL,     CASE_PATCH,    CASE_PATCH};
    static const double lo[] = {-.0075, -.075, 0}, hi[] = {.0075, .075, .45};
    static const int cells[] = {2, 30, 90};
    case_errors *errors;
    case_mesh mesh = read_text(text, &errors);
    assert_clean(errors);
    for (int a = 0; a < 3; a++) {
        assert_int_equal(mesh.cells[a], cells[a]);
        assert_near(mesh.lo[a], lo[a], 1e-16);
        assert_near(mesh.hi[a], hi[a], 1e-16);
        assert_near(mesh.spacing[a], (hi[a] - lo[a]) / cells[a], 1e-16);
    }
    for (int side = 0; side < 6; side++) {
        assert_string_equal(mesh.side[side].patch, name[side]);
        assert_int_equal(mesh.side[side].type, type[side]);
    }
    case_errors_free(errors);
}

static void assert_variant_is_bed(const char *old, const char *new)
{
    char *text = replaced(plain, old, new);
    assert_is_bed(text);
    free(text);
}

static void assert_variant_says(const char *old, const char *new, const char *part)
{
    case_errors *errors;
    char *text = replaced(plain, old, new);
    read_text(text, &errors);
    assert_says(errors, part);
    free(text);
    case_errors_free(errors);
}

static void same_box(void **unused)
{
    (void)unused;
    assert_is_bed(plain);
    assert_variant_is_bed("scale", "convertToMeters");
    assert_variant_is_bed("(2 30 90) simpleGrading (1 1 1)",
                          "bed (2 30 90) edgeGrading (1 1 1 1 1 1 1 1 1 1 1 1)");
    assert_variant_is_bed("(hex (0", "1 (hex 8 (0");
    assert_variant_is_bed("vertices ((", "vertices 8 ((");
    assert_variant_is_bed("((4 5 6 7))", "((7 4 5 6))");
    assert_variant_is_bed("((4 5 6 7))", "((0 5))"); /* block and face */
    char *text = replaced(plain, "boundary", "defaultPatch { name top; type patch; } boundary");
    char *other = replaced(text, "top { type patch; faces ((4 5 6 7)); }", "");
    assert_is_bed(other);
    free(text);
    free(other);
}

/* Vertices in another order: only the order in the hex counts. Here reversed. */
static void permuted_vertices(void **unused)
{
    (void)unused;
    assert_is_bed(
        "scale 0.001; vertices ((-7.5 75 450) (7.5 75 450) (7.5 -75 450) (-7.5 -75 450)"
        " (-7.5 75 0) (7.5 75 0) (7.5 -75 0) (-7.5 -75 0));"
        "blocks (hex (7 6 5 4 3 2 1 0) (2 30 90) simpleGrading (1 1 1));"
        "patches (patch top ((0 1 2 3)) patch bottom ((4 5 6 7)) wall walls ((7 6 2 3) (5 4 0 1))"
        " symmetry frontAndBack ((6 5 1 2) (7 4 0 3))); mergePatchPairs ();");
}

static void refused_blocks(void **unused)
{
    (void)unused;
    const char *const axes = "not those of a box whose first, second and third axis are x, y and z";
    assert_variant_says("(0 1 2 3 4 5 6 7)", "(1 2 3 0 5 6 7 4)", axes);
    assert_variant_says("(0 1 2 3 4 5 6 7)", "(4 5 6 7 0 1 2 3)", "points backwards");
    assert_variant_says("(7.5 75 450)", "(7.6 75 450)", axes);
    assert_variant_says("4 5 6 7) (2", "4 5 6 8) (2", "a vertex that is not there");
    assert_variant_says("4 5 6 7) (2", "4 5 6) (2", "has not 8 vertices");
    assert_variant_says("(2 30 90)", "(2 0 90)", "whole and at least 1");
    assert_variant_says("(2 30 90)", "(2 30.5 90)", "whole and at least 1");
    assert_variant_says("(2 30 90)", "(2000 30000 90000)", "more than 2147483647 cells");
    assert_variant_says("(1 1 1)", "(1 2 1)", "the cells are not all equal");
    assert_variant_says("(1 1 1));",
                        "(1 1 1) hex (0 1 2 3 4 5 6 7) (2 3 9) simpleGrading (1 1 1));",
                        "more than one block");
    assert_variant_says("edges ()", "edges (arc 0 1 (0 -80 0))",
                        "blockMeshDict:5: edges: accepted: an empty");
    assert_variant_says("scale 0.001", "scale 0", "scale: found '0'; accepted: a number > 0");
    assert_variant_says("scale 0.001", "scael 0.001", "scael: unknown key; did you mean 'scale'?");
    assert_variant_says("(-7.5 -75 0)", "(-7.5 -75)", "vertices: accepted: a list of points");
    assert_variant_says("vertices", "vertixes", "vertices: missing");
}

static void refused_patches(void **unused)
{
    (void)unused;
    assert_variant_says(
        "((0 3 2 1))", "((0 3 2 1) (4 5 6 7))",
        "blockMeshDict:9: side +z of the box is in two patches: 'top' (line 8) and 'bottom'");
    assert_variant_says("((0 3 2 1))", "()", "side -z of the box is in no patch");
    assert_variant_says("((0 3 2 1))", "((0 3 2 5))", "patch 'bottom': its face 0 is not a side");
    assert_variant_says("type wall", "type wal",
                        "walls.type: found 'wal'; accepted: patch, wall, symmetry, "
                        "empty, cyclic, symmetryPlane; did you mean 'wall'?");
    assert_variant_says("type wall; faces ((0 1 5 4) (2 3 7 6))", "type wall",
                        "walls.faces: missing");
    assert_variant_says("bottom {", "top {", "a second patch 'top'");
    assert_variant_says("bottom { type patch", "bottom { type cyclic",
                        "only one of them is cyclic");
    assert_variant_says("type symmetryPlane", "type empty",
                        "there are 2 cells across it; accepted: 1");
}

static void missing_file(void **unused)
{
    (void)unused;
    case_mesh mesh;
    fixture f = fixture_new();
    case_read_mesh(f.directory, &mesh, f.errors);
    assert_says(f.errors, "system/blockMeshDict: the file cannot be read");
    assert_int_equal(mesh.cells[0], 0);
    fixture_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_box),       cmocka_unit_test(permuted_vertices),
        cmocka_unit_test(refused_blocks), cmocka_unit_test(refused_patches),
        cmocka_unit_test(missing_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
