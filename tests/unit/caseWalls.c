/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseWalls.c - walls of demProperties: motion, shapes of shapes, surfaces of triangles.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseDem.h"
#include "near.h"

static const char *const moving = DEM_MATERIALS
    "insertion { bed { type random; number 50; material glass; diameter .003;\n"
    "region { type box; min (0 0 0); max (.1 .2 .2); } } }\n"
    "walls { drum { material steel;\n"
    "shape { type cylinder; point1 (.05 0 .2); point2 (.05 .2 .2); radius .09; inside yes; }\n"
    "motion { type rotation; axis (0 2 0); origin (.05 0 .2); rpm 45; begin 1; end 5; ramp .5; }\n"
    "}\n"
    "lid { material steel; shape { type plane; point (0 0 .4); normal (0 0 -1); }\n"
    "centre (.01 .02 .03);\n"
    "motion\n"
    "(\n"
    "{ type translation; velocity (0 0 -.1); end 2; }\n"
    "{ type oscillation; amplitude (0 .002 0); frequency 15; phase 90; }\n"
    "{ type rocking; axis (1 0 0); origin (0 .1 .4); amplitude 3; frequency 2; }\n"
    "{ type table; rows ( (0 0 0 0 0 0 0) (1 .01 0 0 0 90 0) (3 0 0 0 0 0 0) ); }\n"
    "); } }\n";

static void motions(void **unused)
{
    (void)unused;
    const double pi = 3.14159265358979323846;
    fixture f = fixture_new();
    case_dem dem;
    read_dem(&f, moving, &dem);
    assert_clean(f.errors);
    const dem_wall *drum = dem.param.wall, *lid = drum + 1;
    assert_int_equal(drum->n_motion, 1);
    const dem_motion *m = drum->motion;
    assert_int_equal(m->kind, DEM_ROTATION);
    assert_near(m->rate, 1.5 * pi, 1e-14);
    assert_near(m->vector[1], 2, 0);
    assert_near(m->begin, 1, 0);
    assert_near(m->end, 5, 0);
    assert_near(m->ramp, .5, 0);
    assert_near(drum->centre[0], .05, 0); /* on the axis */
    assert_near(drum->centre[2], .2, 0);
    assert_near(lid->centre[1], .02, 0);
    assert_int_equal(lid->n_motion, 4);
    m = lid->motion;
    assert_int_equal(m[0].kind, DEM_TRANSLATION);
    assert_near(m[0].vector[2], -.1, 0);
    assert_near(m[0].begin, 0, 0);
    assert_near(m[0].end, 2, 0);
    assert_int_equal(m[1].kind, DEM_OSCILLATION);
    assert_near(m[1].vector[1], .002, 0);
    assert_near(m[1].frequency, 15, 0);
    assert_near(m[1].phase, .5 * pi, 1e-15);
    assert_true(isinf(m[1].end));
    assert_int_equal(m[2].kind, DEM_ROCKING);
    assert_near(m[2].amplitude, pi / 60, 1e-15);
    assert_near(m[2].phase, 0, 0);
    assert_int_equal(m[3].kind, DEM_TABLE);
    assert_int_equal(m[3].n, 3);
    assert_near(m[3].time[2], 3, 0);
    assert_near(m[3].shift[1][0], .01, 0);
    assert_near(m[3].turn[1][1], .5 * pi, 1e-15);
    case_dem_free(&dem, 1);
    fixture_free(&f);
}

/* A table in a file, without rotation. */
static void motion_file(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    put_file(&f, "constant/lift", "2\n(\n(0 0 0 0)\n(.5 0 0 .1)\n)\n");
    char *text = replaced(moving, "rows ( (0 0 0 0 0 0 0) (1 .01 0 0 0 90 0) (3 0 0 0 0 0 0) )",
                          "file \"lift\"");
    read_dem(&f, text, &dem);
    assert_clean(f.errors);
    const dem_motion *m = &dem.param.wall[1].motion[3];
    assert_int_equal(m->n, 2);
    assert_near(m->shift[1][2], .1, 0);
    assert_null(m->turn);
    case_dem_free(&dem, 1);
    shell("rm %s/constant/lift%s", f.directory, "");
    read_dem(&f, text, &dem);
    assert_says(f.errors, "constant/lift: the file cannot be read");
    case_dem_free(&dem, 1);
    free(text);
    fixture_free(&f);
}

static void refused_motions(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    refused_in(&f, moving, "type rotation", "type rotating",
               "demProperties:13: walls.drum.motion.type: found 'rotating'; accepted: translation, "
               "rotation, oscillation, rocking, table; did you mean 'rotation'?");
    refused_in(&f, moving, "rpm 45; ", "",
               "walls.drum.motion.rate: missing, and so is rpm; accepted: either rate in rad/s or "
               "rpm in 1/min");
    refused_in(&f, moving, "rpm 45", "rpm 45; rate 2", "given beside rate");
    refused_in(&f, moving, "axis (0 2 0)", "axis (0 0 0)", "motion.axis: found (0 0 0)");
    refused_in(&f, moving, "begin 1; end 5", "begin 5; end 1", "accepted: after begin, 5 s");
    refused_in(&f, moving, "ramp .5", "ramp -1", "accepted: a number >= 0 in s");
    refused_in(&f, moving, "velocity (0 0 -.1)", "rate 3",
               "walls.lid.motion[0].rate: unknown key; accepted: type, begin, end, velocity, ramp");
    refused_in(&f, moving, "frequency 15", "frequency 0",
               "motion[1].frequency: found '0'; accepted: a number > 0 in Hz");
    refused_in(&f, moving, "(3 0 0 0 0 0 0)", "(1 0 0 0 0 0 0)",
               "the time of row 2, counted from 0, is 1 s, not above that of the row before, 1 s");
    refused_in(&f, moving, "rows ( (0 0 0 0 0 0 0) (1 .01 0 0 0 90 0) (3 0 0 0 0 0 0) )",
               "rows ( (0 0 0) (1 0 0) )",
               "motion[3].rows: found rows of 3 numbers; accepted: two or more rows (t x y z)");
    refused_in(&f, moving, "motion { type rotation", "motion ( ); ignored { type rotation",
               "walls.drum.motion: accepted: a dictionary { type ...; } or a list of such");
    refused_in(&f, moving, "centre (.01 .02 .03)", "center (.01 .02 .03)",
               "did you mean 'centre'?");
    fixture_free(&f);
}

/* A box of twelve triangles with corners (0 0 0) and (a b c), as an ASCII file. */
static void put_box(const fixture *f, const char *name, double a, double b, double c)
{
    static const int quad[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    char text[8192];
    size_t n = (size_t)snprintf(text, sizeof text, "solid box\n");
    for (int t = 0; t < 12; t++) {
        const int *q = quad[t / 2], corner[3] = {q[0], q[1 + t % 2], q[2 + t % 2]};
        n += (size_t)snprintf(text + n, sizeof text - n, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3; k++)
            n += (size_t)snprintf(text + n, sizeof text - n, "vertex %g %g %g\n",
                                  corner[k] & 1 ? a : 0, corner[k] & 2 ? b : 0,
                                  corner[k] & 4 ? c : 0);
        n += (size_t)snprintf(text + n, sizeof text - n, "endloop\nendfacet\n");
    }
    snprintf(text + n, sizeof text - n, "endsolid box\n");
    put_file(f, name, text);
}

#define BED                                                                                        \
    "insertion { bed { type random; number 50; material glass; diameter .003;\n"                   \
    "region { type box; min (.01 .01 .01); max (.09 .19 .2); } } }\n"

/* The vessel as a surface in millimetres, shifted by (0 0 10) mm. */
static const char *const triangles =
    DEM_MATERIALS BED "walls { vessel { material steel; shape { type stl; file \"vessel.stl\";\n"
                      "scale .001; inside yes; translate (0 0 .01); } } }\n";

static void surfaces(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    shell("mkdir %s/constant/triSurface%s", f.directory, "");
    put_box(&f, "constant/triSurface/vessel.stl", 100, 200, 380);
    read_dem(&f, triangles, &dem);
    assert_clean(f.errors);
    assert_string_equal(case_notes_text(f.errors), "");
    const dem_wall *wall = dem.param.wall;
    assert_int_equal(dem_sdf_parts(wall->shape), 6);
    assert_near(dem_sdf_distance(wall->shape, (double[]){.05, .1, .012}), .002, 1e-9);
    assert_near(dem_sdf_distance(wall->shape, (double[]){.05, .1, .388}), .002, 1e-9);
    assert_near(wall->centre[2], .2, 1e-9); /* its middle */
    assert_non_null(dem.param.sdf_cache);
    assert_non_null(strstr(dem.param.sdf_cache, "/constant/sdf"));
    char *lines = case_describe_walls(&dem, "* ");
    assert_non_null(strstr(lines, "* vessel           of steel, 6 faces, (0 0 0.01) to (0.1 0.2 "
                                  "0.39) m"));
    free(lines);
    case_dem_free(&dem, 1);
    char *none = replaced(triangles, "walls {", "sdf { cache none; } walls {");
    read_dem(&f, none, &dem);
    assert_clean(f.errors);
    assert_null(dem.param.sdf_cache);
    case_dem_free(&dem, 1);
    free(none);
    char *top = replaced(triangles, "vessel.stl", "constant/triSurface/vessel.stl");
    read_dem(&f, top, &dem);
    assert_clean(f.errors);
    case_dem_free(&dem, 1);
    free(top);
    fixture_free(&f);
}

static void refused_surfaces(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    shell("mkdir %s/constant/triSurface%s", f.directory, "");
    refused_in(&f, triangles, "yes", "yes", "demProperties:11: walls.vessel.shape.file: ");
    refused_in(&f, triangles, "yes", "yes", "constant/triSurface/vessel.stl: cannot be opened");
    put_box(&f, "constant/triSurface/vessel.stl", 100, 200, 400);
    refused_in(&f, triangles, "translate (0 0 .01)", "translate (0 0)", "accepted: a vector");
    refused_in(&f, triangles, "scale .001; ", "",
               "walls.vessel.shape.file: the surface in vessel.stl extends over 100 x 200 x 400 m, "
               "the domain over 0.1 x 0.2 x 0.4 m; is the file in millimetres? then: scale 0.001");
    refused_in(&f, triangles, "scale .001", "scale 1e-6",
               "extends over 0.0001 x 0.0002 x 0.0004 m, the domain over 0.1 x 0.2 x 0.4 m, and it "
               "is smaller than a particle; is its scale too small?");
    refused_in(&f, triangles, "scale .001", "scale 0",
               "walls.vessel.shape.scale: found '0'; accepted: a number > 0");
    refused_in(&f, triangles, "scale .001", "scale .001; featureAngle 200",
               "accepted: a number > 0 and <= 180 in degrees");
    refused_in(&f, triangles, "scale .001", "scale .001; spacing .002",
               "sampled at a spacing of 0.002 m, it is too coarse for particles of 0.003 m");
    refused_in(&f, triangles, "scale .001", "scale .001; sampling 3", "sampling: unknown key");
    fixture_free(&f);
}

/* A plate with a hole, turned by 90 degrees about y and shifted: where it is solid. */
static void shapes_of_shapes(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    const char *const text = DEM_MATERIALS
        "insertion { bed { type random; number 50; material glass; diameter .003;\n"
        "region { type intersection; shapes (\n"
        "{ type box; min (0 0 0); max (.1 .2 .15); }\n"
        "{ type complement; shape { type cylinder; point1 (.05 .1 0); point2 (.05 .1 1); radius "
        ".04; } } ); } } }\n"
        "walls { plate { material steel; shape { type intersection; shapes (\n"
        "{ type box; min (-.1 -.1 0); max (.1 .1 .01); }\n"
        "{ type complement; shape { type cylinder; point1 (0 0 -1); point2 (0 0 1); radius .03; } "
        "} );\n"
        "rotate { axis (0 3 0); angle 90; } translate (.05 .1 .2); } }\n"
        "pair { material steel; shape { type union; shapes (\n"
        "{ type sphere; centre (0 0 0); radius 1; scale .01; translate (.02 .02 .3); }\n"
        "{ type sphere; centre (.08 .02 .3); radius .01; } ); } } }\n";
    read_dem(&f, text, &dem);
    assert_clean(f.errors);
    /* turned: z becomes x, x becomes -z. The plate lies in x from .05 to .06. */
    const dem_sdf *plate = dem.param.wall[0].shape, *pair = dem.param.wall[1].shape;
    assert_near(dem_sdf_distance(plate, (double[]){.055, .16, .24}), -.005, 1e-9);
    assert_near(dem_sdf_distance(plate, (double[]){.047, .16, .24}), .003, 1e-9);
    assert_near(dem_sdf_distance(plate, (double[]){.055, .1, .2}), .03, 1e-9);
    assert_near(dem_sdf_distance(pair, (double[]){.02, .02, .313}), .003, 1e-9);
    assert_near(dem_sdf_distance(pair, (double[]){.08, .02, .285}), .005, 1e-9);
    const dem_insertion *bed = dem.param.insertion;
    assert_true(dem_sdf_distance(bed->region, (double[]){.05, .1, .1}) < 0);
    assert_near(dem_sdf_distance(bed->region, (double[]){.05, .145, .1}), .005, 1e-9);
    assert_near(bed->hi[2], .15, 0);
    case_dem_free(&dem, 1);

    refused_in(
        &f, text, "type intersection; shapes (\n{ type box; min (-.1",
        "type intersecton; shapes (\n{ type box; min (-.1",
        "walls.plate.shape.type: found 'intersecton'; accepted: plane, box, sphere, "
        "cylinder, cone, stl, union, intersection, complement; did you mean 'intersection'?");
    refused_in(&f, text, "type union; shapes", "type union; shape", "did you mean 'shapes'?");
    refused_in(&f, text, "angle 90;", "", "walls.plate.shape.rotate.angle: missing");
    refused_in(&f, text, "axis (0 3 0)", "axis (0 0 0)", "found (0 0 0); accepted: a direction");
    refused_in(&f, text, "scale .01", "scale -1", "pair.shape.shapes[0].scale: found '-1'");
    refused_in(&f, text, "{ type box; min (0 0 0); max (.1 .2 .15); }",
               "{ type plane; point (0 0 0); normal (0 0 1); }",
               "region.shapes[0].type: found 'plane'");
    refused_in(&f, text, "max (.1 .2 .15)", "max (.1 .2 .5)",
               "insertion.bed.region: the region reaches from 0 to 0.5 m in z");
    refused_in(&f, text, "min (0 0 0); max (.1 .2 .15); }",
               "min (0 0 0); max (.1 .2 .15); rotate { axis (0 0 1); angle 30; } }",
               "insertion.bed.region: the region reaches from ");
    fixture_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motions),          cmocka_unit_test(motion_file),
        cmocka_unit_test(refused_motions),  cmocka_unit_test(surfaces),
        cmocka_unit_test(refused_surfaces), cmocka_unit_test(shapes_of_shapes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
