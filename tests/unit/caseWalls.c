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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motions),
        cmocka_unit_test(motion_file),
        cmocka_unit_test(refused_motions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
