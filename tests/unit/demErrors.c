/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demErrors.c - what the engine refuses, and what it says.
 */
#include "demRig.h"

#include <stdio.h>

static void prepare(rig *r, dem_law law)
{
    rig_init(r, law, 1);
    rig_hertz(r, 1e8, .3, 2500);
    r->param.n_material = 2;
    r->param.material = r->material;
    r->param.pair = r->pair;
    r->param.wall = r->wall;
}

static void refused(rig *r, const char *words)
{
    dem_sim *sim = NULL;
    assert_int_equal(dem_new(MPI_COMM_SELF, &r->param, &sim), DEM_BAD_ARGUMENT);
    if (!strstr(dem_message(sim), words))
        fail_msg("message is \"%s\", expected it to contain \"%s\"", dem_message(sim), words);
    dem_free(sim);
}

static void bad_parameters(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    r.param.lo[1] = 2;
    refused(&r, "domain: lo 2 must be below hi 1 in direction y");
    prepare(&r, DEM_LINEAR);
    r.param.gravity[2] = NAN;
    refused(&r, "gravity: component z");
    prepare(&r, (dem_law)7);
    refused(&r, "contact law 7");
    prepare(&r, DEM_LINEAR);
    r.param.steps_per_period = 3;
    refused(&r, "steps per period 3 must be above pi");
    prepare(&r, DEM_LINEAR);
    r.param.time_step = -1e-5;
    refused(&r, "time step -1e-05 s must be >= 0");
    prepare(&r, DEM_HERTZ);
    r.param.impact_speed = -2;
    refused(&r, "impact speed -2");
    prepare(&r, DEM_LINEAR);
    r.param.skin = 0;
    refused(&r, "skin 0 must be > 0");
    prepare(&r, DEM_LINEAR);
    r.material[0].density = -2500;
    refused(&r, "material grain: density -2500 kg/m3 must be > 0");
    prepare(&r, DEM_HERTZ);
    r.material[0].youngs_modulus = 0;
    refused(&r, "material grain: Young's modulus 0 Pa must be > 0");
    prepare(&r, DEM_HERTZ);
    r.material[1].poisson_ratio = .51;
    refused(&r, "material rigid: Poisson's ratio 0.51 must be in (-1, .5]");
}

static void bad_pairs(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    r.pair[0].restitution = 0;
    refused(&r, "contact grain-grain: restitution 0 must be in (0, 1]");
    prepare(&r, DEM_LINEAR);
    r.pair[0].restitution = 1.01;
    refused(&r, "restitution 1.01");
    prepare(&r, DEM_LINEAR);
    r.pair[0].friction = -.1;
    refused(&r, "friction -0.1 must be >= 0");
    prepare(&r, DEM_LINEAR);
    r.pair[3].stiffness = 0;
    refused(&r, "contact rigid-rigid: stiffness 0 N/m must be > 0");
    prepare(&r, DEM_LINEAR);
    r.pair[0].stiffness_ratio = -1;
    refused(&r, "stiffness ratio -1");
    prepare(&r, DEM_LINEAR);
    r.pair[1].friction = .3;
    refused(&r, "contact grain-rigid differs from contact rigid-grain");
    prepare(&r, DEM_LINEAR);
    strcpy(r.wall[0].name, "vessel");
    r.param.n_wall = 1;
    refused(&r, "wall vessel has no shape");
    dem_insertion ins = {.name = "bed", .material = 2, .diameter = 1e-3};
    prepare(&r, DEM_LINEAR);
    r.param.insertion = &ins;
    r.param.n_insertion = 1;
    refused(&r, "insertion bed: material 2 is none of the 2");
    ins.material = 0;
    ins.diameter = 0;
    refused(&r, "insertion bed: diameter 0 m must be > 0");
}

static void bad_particles(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    rig_start(&r);
    double x[2][3] = {{0, 0, 0}, {0, .5, 0}}, v[2][3] = {{0}}, radius[2] = {1e-3, 1e-3};
    int material[2] = {0, 0};
    int64_t id[2] = {4, 4};
#define ADD()                                                                                      \
    dem_add(r.sim, 2, (const double(*)[3])x, (const double(*)[3])v, NULL, radius, material, id)
    assert_int_equal(ADD(), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "particle id 4 is given twice"));
    id[1] = 9;
    x[1][1] = 1.5;
    assert_int_equal(ADD(), DEM_LOST);
    assert_non_null(strstr(dem_message(r.sim), "outside the domain: y from -1 to 1"));
    x[1][1] = .5;
    v[1][0] = INFINITY;
    assert_int_equal(ADD(), DEM_NAN);
    v[1][0] = 0;
    radius[0] = -1;
    assert_int_equal(ADD(), DEM_BAD_ARGUMENT);
    radius[0] = 1e-3;
    material[1] = 2;
    assert_int_equal(ADD(), DEM_BAD_ARGUMENT);
    material[1] = 0;
    assert_int_equal(dem_particles(r.sim).n, 0);
    assert_int_equal(ADD(), DEM_OK);
    assert_int_equal(ADD(), DEM_BAD_ARGUMENT); /* ids are there already */
    assert_int_equal(dem_particles(r.sim).n, 2);

    double f[2][3] = {{0}}, k[2] = {0, -1}, w[2][3] = {{0}};
    assert_int_equal(
        dem_set_outside_force(r.sim, (const double(*)[3])f, k, (const double(*)[3])w, NULL),
        DEM_BAD_ARGUMENT);
    assert_int_equal(dem_advance(r.sim, 0, 1), DEM_BAD_ARGUMENT);
    assert_int_equal(dem_advance(r.sim, NAN, 1), DEM_BAD_ARGUMENT);
    assert_int_equal(dem_advance(r.sim, 1, -1), DEM_BAD_ARGUMENT);
    dem_free(r.sim);
}

static void lost_particle(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    r.param.gravity[2] = -9.81;
    rig_start(&r);
    rig_ball(&r, .01, 0, 0, 0, 0, 0, 0);
    rig_ball(&r, .01, 0, .5, 0, 3, 0, 0);
    double weight = -9.81 * sphere_mass(.01, 2500);
    dem_status status = DEM_OK;
    for (int s = 0; s < 4000 && !status; s++) status = dem_advance(r.sim, 1e-4, 1);
    assert_int_equal(status, DEM_LOST);
    assert_within(dem_time(r.sim), 1. / 3, 1.01e-4); /* found at the end of the call it left in */
    char force[64];
    snprintf(force, sizeof force, "last force (0 0 %g)", weight);
    assert_non_null(strstr(dem_message(r.sim), "particle 1 has left the domain"));
    assert_non_null(strstr(dem_message(r.sim), "position (1.0"));
    assert_non_null(strstr(dem_message(r.sim), force));
    dem_free(r.sim);
}

/* Two spheres at one place: the message names both and says where; nothing is added. */
static void too_deep(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    r.param.periodic[0] = 1;
    rig_start(&r);
    double x[3][3] = {{.5, 0, 0}, {0, .25, 0}, {0, .25, 0}}, radius[3] = {.01, .01, .01};
    const int material[3] = {0};
    const int64_t id[1] = {77};
#define PLACE(n, id) dem_add(r.sim, n, (const double(*)[3])x, NULL, NULL, radius, material, id)
    assert_int_equal(PLACE(3, NULL), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "particle 2 to be added at (0 0.25 0), radius 0.01 "
                                               "m, and particle 1 to be added at (0 0.25 0)"));
    assert_non_null(
        strstr(dem_message(r.sim), "by 2 times the smaller radius, must be at most 1.5"));
    assert_int_equal(dem_particles(r.sim).n, 0);
    x[2][1] += .00501; /* a little more than half a radius */
    assert_int_equal(PLACE(3, NULL), DEM_OK);
    rig_advance(&r, 1e-4, 0);
    /* With one that is there already, across the periodic side. */
    x[0][0] = .999;
    x[0][2] = .3;
    assert_int_equal(PLACE(1, id), DEM_OK);
    x[0][0] = -.999;
    assert_int_equal(PLACE(1, NULL), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "particle 0 to be added at (-0.999 0 0.3)"));
    assert_non_null(strstr(dem_message(r.sim), "and particle 77 at (0.999 0 0.3)"));
    x[0][0] = -.9912; /* a small one wholly within a large one */
    radius[0] = 1e-4;
    assert_int_equal(PLACE(1, NULL), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "overlap by 3 times"));
    assert_int_equal(dem_particles(r.sim).n, 4);
    dem_free(r.sim);
    /* a list of positions in the parameters */
    prepare(&r, DEM_HERTZ);
    x[0][1] = .25;
    x[0][0] = x[0][2] = 0;
    x[2][1] = .5;
    const dem_insertion ins = {.name = "bed",
                               .kind = DEM_INSERT_LIST,
                               .n = 3,
                               .diameter = .02,
                               .x = (const double(*)[3])x};
    r.param.insertion = &ins;
    r.param.n_insertion = 1;
    refused(&r, "particle 1 to be added at (0 0.25 0), radius 0.01 m, and particle 0 to be added");
}

/* However slowly it leaves: the list, built before, would hold for long. */
static void lost_slowly(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    r.param.periodic[1] = 1;
    rig_start(&r);
    rig_ball(&r, .01, 1 - 1.5e-6, 0, 0, 1e-2, 0, 0);
    rig_ball(&r, .01, 0, 1 - 1e-7, 0, 0, 1e-2, 0); /* comes in again at the other side */
    rig_advance(&r, 1e-4, 10);
    assert_int_equal(dem_advance(r.sim, 1e-4, 10), DEM_LOST);
    assert_non_null(strstr(dem_message(r.sim), "particle 0 has left the domain at time 0.0002"));
    assert_non_null(strstr(dem_message(r.sim), "velocity (0.01 0 0)"));
    dem_free(r.sim);
}

static void not_a_number(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_LINEAR);
    rig_start(&r);
    rig_ball(&r, .001, .3, 0, 0, 0, 0, 0);
    rig_ball(&r, .001, 0, .5, 0, 0, 0, 0);
    const double f[2][3] = {{0}, {0, 1e308, 0}}, k[2] = {0}, w[2][3] = {{0}};
    assert_int_equal(dem_set_outside_force(r.sim, f, k, w, NULL), DEM_OK);
    assert_int_equal(dem_advance(r.sim, 5e-5, 1), DEM_NAN);
    assert_non_null(strstr(dem_message(r.sim), "has a state that is not finite"));
    assert_non_null(strstr(dem_message(r.sim), "particle 1"));
    dem_free(r.sim);
}

/* Nothing to do is done without complaint. */
static void no_particles(void **state)
{
    (void)state;
    rig r;
    prepare(&r, DEM_HERTZ);
    rig_start(&r);
    assert_true(isinf(dem_time_limits(r.sim).step));
    rig_advance(&r, .5, 0);
    assert_true(dem_time(r.sim) == .5);
    dem_report rep = dem_last_report(r.sim);
    assert_true(rep.particles == 0 && rep.contacts == 0 && rep.kinetic_energy == 0);
    dem_set_time(r.sim, 3);
    assert_true(dem_time(r.sim) == 3);
    dem_free(r.sim);
}

/* ---- the time step ------------------------------------------------------------------------------
 */

static void time_step(void **state)
{
    (void)state;
    rig r;
    const double R = 1.3e-3, rho = 2500, k = 830, m = sphere_mass(R, rho);
    prepare(&r, DEM_LINEAR);
    rig_pairs(&r, .9, .1, k, 1);
    r.pair[1].stiffness = r.pair[2].stiffness = 4 * k;
    rig_start(&r);
    rig_ball(&r, R, 0, 0, 0, 0, 0, 0);
    assert_close(dem_time_limits(r.sim).contact, 2 * M_PI * sqrt(m / k) / 20, 1e-12);
    dem_free(r.sim);
    /* A wall of the stiffer material halves it; the user's own limit may be smaller still. */
    prepare(&r, DEM_LINEAR);
    rig_pairs(&r, .9, .1, k, 1);
    r.pair[1].stiffness = r.pair[2].stiffness = 4 * k;
    rig_floor(&r);
    r.param.time_step = 3e-6;
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .5, 0, 0, 0);
    dem_limits l = dem_time_limits(r.sim);
    assert_close(l.contact, M_PI * sqrt(m / k) / 20, 1e-12);
    assert_true(l.step == 3e-6 && l.user == 3e-6 && isinf(l.rayleigh));
    rig_advance(&r, 3e-5, 0);
    assert_int_equal(dem_last_report(r.sim).substeps, 10);
    rig_advance(&r, 3.1e-5, 0);
    assert_int_equal(dem_last_report(r.sim).substeps, 11);
    dem_free(r.sim);
    /* Hertz: 2.87 (m^2/(R E^2 v))^(1/5) for the pair, twice the speed of the fastest. */
    prepare(&r, DEM_HERTZ);
    rig_start(&r);
    double shear = 1e8 / 2.6, E = 1e8 / (2 * (1 - .09));
    rig_ball(&r, R, 0, 0, 0, 0, 0, 0);
    assert_close(dem_time_limits(r.sim).rayleigh,
                 .2 * M_PI * R * sqrt(rho / shear) / (.1631 * .3 + .8766), 1e-12);
    assert_true(dem_time_limits(r.sim).step == dem_time_limits(r.sim).rayleigh);
    rig_ball(&r, R, 0, .1, 0, .8, 0, .6);
    double t = 2.87 * pow(.25 * m * m / (.5 * R * E * E * 2), .2);
    assert_close(dem_time_limits(r.sim).contact, 2 * t / 20, 1e-3);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_parameters), cmocka_unit_test(bad_pairs),
        cmocka_unit_test(bad_particles),  cmocka_unit_test(lost_particle),
        cmocka_unit_test(lost_slowly),    cmocka_unit_test(too_deep),
        cmocka_unit_test(not_a_number),   cmocka_unit_test(no_particles),
        cmocka_unit_test(time_step)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
