/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseFiles.c - controlDict, transportProperties and g; and the tutorial as it is shipped.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseFixture.h"
#include "near.h"

static const char *const control_text =
    "startFrom startTime; startTime .5; stopAt endTime; endTime 2; deltaT 5e-4;\n"
    "writeControl adjustableRunTime; writeInterval .1; timePrecision 8;\n"
    "adjustTimeStep no; maxCo .4; maxDeltaT 1e-3; libs (); functions { }\n";

static case_control control_of(fixture *f, const char *text)
{
    case_control control;
    put_file(f, "system/controlDict", text);
    case_read_control(f->directory, &control, f->errors);
    return control;
}

static void control_values(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_control c = control_of(&f, control_text);
    assert_clean(f.errors);
    assert_near(c.start_time, .5, 0);
    assert_near(c.end_time, 2, 0);
    assert_near(c.delta_t, 5e-4, 0);
    assert_near(c.write_interval, .1, 0);
    assert_near(c.max_co, .4, 0);
    assert_near(c.max_delta_t, 1e-3, 0);
    assert_int_equal(c.time_precision, 8);
    assert_false(c.adjust_time_step);
    c = control_of(&f, "endTime 2; deltaT .01; writeControl timeStep; writeInterval 20;");
    assert_clean(f.errors);
    assert_near(c.write_interval, .2, 1e-16);
    assert_near(c.start_time, 0, 0);
    assert_true(isinf(c.max_delta_t));
    shell("mkdir %s/0.75 %s/1e-3", f.directory, f.directory);
    c = control_of(&f, "startFrom latestTime; endTime 2; deltaT .01; writeInterval 20;");
    assert_near(c.start_time, .75, 0);
    c = control_of(&f, "startFrom firstTime; endTime 2; deltaT .01; writeInterval 20;");
    assert_near(c.start_time, 1e-3, 0);
    assert_clean(f.errors);
    fixture_free(&f);
}

/* Which restart file a run goes on from, and which are another run's. */
static void restart_files(void **unused)
{
    (void)unused;
    static const char *const at = "endTime 2; deltaT .01; writeInterval 20; startFrom ";
    char text[256], name[CASE_NAME];
    fixture f = fixture_new();
    snprintf(text, sizeof text, "%s latestTime;", at);
    case_control c = control_of(&f, text);
    assert_near(c.restart_interval, .2, 1e-16);
    assert_true(c.restart_write);
    assert_int_equal(c.restart_keep, 2);
    case_find_restart(f.directory, &c);
    assert_string_equal(c.restart, ""); /* there are none */
    assert_int_equal(case_set_restarts_aside(f.directory, &c), 0);

    /* Numbers, not texts: 10 is after 9. What is no number is let alone. */
    shell(
        "mkdir %s/restart && cd %s/restart && touch 9.h5 10.h5 0.25.h5 1e1x.h5 note.txt 11.h5.bak",
        f.directory, f.directory);
    case_find_restart(f.directory, &c);
    assert_string_equal(c.restart, "10.h5");
    assert_near(c.start_time, 10, 0);
    assert_int_equal(case_set_restarts_aside(f.directory, &c), 0);
    assert_near(case_restart_latest(f.directory, 9.99, name), 9, 0);
    assert_string_equal(name, "9.h5");
    assert_true(isnan(case_restart_latest(f.directory, .2, name)));

    snprintf(text, sizeof text, "%s startTime; startTime .25;", at);
    c = control_of(&f, text);
    case_find_restart(f.directory, &c);
    assert_string_equal(c.restart, "0.25.h5");
    assert_int_equal(case_set_restarts_aside(f.directory, &c), 2);
    shell("cd %s && test -f restart.old/9.h5 && test -f restart.old/10.h5 && "
          "test $(ls %s/restart | wc -l) = 4",
          f.directory, f.directory);
    snprintf(text, sizeof text, "%s startTime; startTime 0; restart { interval .3; keep 5; }", at);
    c = control_of(&f, text);
    assert_near(c.restart_interval, .3, 0);
    assert_int_equal(c.restart_keep, 5);
    case_find_restart(f.directory, &c);
    assert_string_equal(c.restart, "");
    assert_near(c.start_time, 0, 0);
    assert_int_equal(case_set_restarts_aside(f.directory, &c), 1); /* one set is kept */
    shell("cd %s && test \"$(echo restart.old/*)\" = restart.old/0.25.h5%s", f.directory, "");
    assert_clean(f.errors);
    control_of(&f, "startFrom startTime; startTime 0; endTime 2; deltaT .01; writeInterval 20;\n"
                   "restart { interval 0; kep 5; }");
    assert_says(f.errors, "restart.interval");
    assert_says(f.errors, "kep");
    fixture_free(&f);
}

static void assert_control_says(const char *old, const char *new, const char *part)
{
    fixture f = fixture_new();
    char *text = replaced(control_text, old, new);
    control_of(&f, text);
    assert_says(f.errors, part);
    free(text);
    fixture_free(&f);
}

/* One mistake, one message: an unknown kind of interval says nothing of the interval. */
static void one_message(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    control_of(&f, "startFrom startTime; startTime 0; endTime 2; deltaT .01;\n"
                   "writeControl clockTime; writeInterval .1;");
    assert_int_equal(case_errors_count(f.errors), 1);
    assert_says(f.errors, "controlDict:2: writeControl: found 'clockTime'");
    fixture_free(&f);
}

/* What felmiMAC and felmiDEM do not follow is said. */
static void notes_control(void **unused)
{
    (void)unused;
    static const char *const start = "startFrom startTime; startTime 0; endTime 2; deltaT .01;\n"
                                     "writeInterval 10; writePrecision 7;\n";
    static const char *const more[] = {"writeFormat binary;", "timeFormat fixed;", "purgeWrite 3;",
                                       "writeCompression on;"};
    for (int i = 0; i < 4; i++) {
        fixture f = fixture_new();
        char text[256];
        snprintf(text, sizeof text, "%s%s", start, "writeFormat ascii; writeCompression off;");
        case_control c = control_of(&f, text);
        assert_int_equal(c.write_precision, 7);
        assert_string_equal(case_notes_text(f.errors), "");
        snprintf(text, sizeof text, "%s%s", start, more[i]);
        control_of(&f, text);
        assert_clean(f.errors);
        assert_non_null(strstr(case_notes_text(f.errors), "controlDict:3: "));
        fixture_free(&f);
    }
    assert_control_says("libs ();", "writeFormat bianry;", "did you mean 'binary'?");
}

/* A name has as many digits as it needs to be told from the next. */
static void time_names(void **unused)
{
    (void)unused;
    const case_control control = {.time_precision = 6};
    char name[32];
    case_time_name(&control, .3 + 1e-17, 1e-6, name, sizeof name);
    assert_string_equal(name, "0.3");
    case_time_name(&control, 1.23456789, 1e-7, name, sizeof name);
    assert_string_equal(name, "1.2345679");
}

static void refused_control(void **unused)
{
    (void)unused;
    assert_control_says("deltaT 5e-4", "deltaT 0",
                        "system/controlDict:1: deltaT: found '0'; accepted: a number "
                        "> 0 in s");
    assert_control_says("endTime 2", "endTime .25",
                        "controlDict:1: endTime: found 0.25; accepted: a time after "
                        "the start, 0.5 s");
    assert_control_says("endTime 2", "endTime .5", "endTime: found 0.5; accepted");
    assert_control_says("; deltaT", "; deltat", "deltat: unknown key; did you mean 'deltaT'?");
    assert_control_says("stopAt endTime", "stopAt writeNow",
                        "stopAt: found 'writeNow'; accepted: endTime");
    assert_control_says("adjustableRunTime", "clockTime", "writeControl: found 'clockTime'");
    assert_control_says("writeInterval .1", "writeInterval -1", "writeInterval: found '-1'");
    assert_control_says("writeControl adjustableRunTime; writeInterval .1",
                        "writeControl timeStep; writeInterval 2.5", "writeInterval: found '2.5'");
    assert_control_says("adjustTimeStep no", "adjustTimeStep yes; writeControl timeStep",
                        "does not go with adjustTimeStep");
    assert_control_says("maxCo .4", "maxCo 0", "maxCo: found '0'");
    assert_control_says("startTime .5", "", "startTime: missing");
}

static void fluid(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_fluid fluid;
    put_file(&f, "constant/transportProperties",
             "transportModel Newtonian; rho rho [1 -3 0 0 0 0 0] 997; nu [0 2 -1 0 0 0 0] 8.9e-7;");
    case_read_fluid(f.directory, &fluid, f.errors);
    assert_clean(f.errors);
    assert_near(fluid.rho, 997, 0);
    assert_near(fluid.nu, 8.9e-7, 0);
    assert_near(fluid.gravity[2], 0, 0); /* no constant/g: weightless */
    put_file(&f, "constant/g", "dimensions [0 1 -2 0 0 0 0]; value (0 1 -9.81);");
    case_read_fluid(f.directory, &fluid, f.errors);
    assert_clean(f.errors);
    assert_near(fluid.gravity[2], -9.81, 0);
    put_file(&f, "constant/g", "value -9.81;");
    put_file(&f, "constant/transportProperties", "transportModel CrossPowerLaw; rho -1; nuu 3;");
    case_read_fluid(f.directory, &fluid, f.errors);
    assert_int_equal(case_errors_count(f.errors), 5);
    assert_says(f.errors, "transportModel: found 'CrossPowerLaw'; accepted: Newtonian");
    assert_says(f.errors, "rho: found '-1'; accepted: a number > 0 in kg/m3");
    assert_says(f.errors, "nuu: unknown key; did you mean 'nu'?");
    assert_says(f.errors, "nu: missing; accepted: a number > 0 in m2/s");
    assert_says(f.errors, "constant/g:1: value: found '-9.81'; accepted: a vector (x y z) in m/s2");
    fixture_free(&f);
}

/* The main case, whole: 24 750 particles in 2 x 30 x 90 cells. */
static void tutorial(void **unused)
{
    (void)unused;
    const char *const bed = FELMI_SOURCE_DIR "/tutorials/goldschmidtBed";
    case_errors *errors = case_errors_new();
    case_control control;
    case_mesh mesh;
    case_fluid fluid;
    case_dem dem;
    cpl_param coupling;
    case_read_control(bed, &control, errors);
    case_read_mesh(bed, &mesh, errors);
    case_read_fluid(bed, &fluid, errors);
    assert_clean(errors);
    case_dict *dict =
        case_dict_read(FELMI_SOURCE_DIR "/tutorials/goldschmidtBed/constant/demProperties", errors);
    assert_clean(errors);
    case_read_dem(dict, bed, &mesh, fluid.gravity, &dem, errors);
    case_dict_free(dict);
    dict = case_dict_read(FELMI_SOURCE_DIR "/tutorials/goldschmidtBed/constant/couplingProperties",
                          errors);
    assert_clean(errors);
    case_read_coupling(dict, &coupling, errors);
    case_dict_free(dict);
    case_check(&control, &mesh, &dem, &coupling, errors);
    assert_clean(errors);
    assert_string_equal(case_notes_text(errors), "");
    assert_int_equal(mesh.cells[0] * mesh.cells[1] * mesh.cells[2], 5400);
    assert_near(dem.param.insertion[0].diameter, .0025, 0);
    assert_near(dem.param.insertion[0].spacing[1], .003, 0);
    case_dem_free(&dem, 1);
    case_errors_free(errors);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(restart_files),   cmocka_unit_test(control_values),
        cmocka_unit_test(refused_control), cmocka_unit_test(one_message),
        cmocka_unit_test(notes_control),   cmocka_unit_test(time_names),
        cmocka_unit_test(fluid),           cmocka_unit_test(tutorial),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
