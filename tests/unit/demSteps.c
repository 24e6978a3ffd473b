/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demSteps.c - limits on the time step: of every pair of materials, of rolling, of walls; refusals.
 *
 * Linear: 2 pi sqrt(m/k)/Omega. Hertz: 2 T/Omega with T = 2.868 (m^2/(R E*^2 v))^(1/5), Hertz's
 * time in its other form. Stability of symplectic Euler: an oscillator s^2, c is stable up to
 * (sqrt(c^2 + 4 s^2) - c)/s^2.
 */
#include "demRig.h"

#include <stdio.h>

static const double R = 1.3e-3, r2 = 2.9e-3;

/* A small sphere of material 0, a larger one of material 1 that is twice as dense. */
static void two_kinds(rig *r)
{
    r->material[1].density = 5000;
    rig_start(r);
    const double x[2][3] = {{0, 0, .1}, {0, .1, .1}}, radius[2] = {R, r2};
    const int material[2] = {0, 1};
    assert_int_equal(dem_add(r->sim, 2, (const double(*)[3])x, NULL, NULL, radius, material, NULL),
                     DEM_OK);
}

static double hertz_period(double m, double radius, double E, double v)
{
    /* 2.943275 (15/16)^(2/5) */
    return 2 * 2.8682656 * pow(m * m / (radius * E * E * v), .2);
}

static void of_pairs(void **state)
{
    (void)state;
    const double m = sphere_mass(R, 2500), m2 = sphere_mass(r2, 5000), k[3] = {900, 2300, 4100};
    rig r;
    double contact, rayleigh;
    rig_init(&r, DEM_LINEAR, .5);
    rig_pairs(&r, .8, .3, k[0], .7);
    r.pair[1].stiffness = r.pair[2].stiffness = k[1];
    r.pair[3].stiffness = k[2];
    two_kinds(&r);
    dem_pair_limits(r.sim, 0, 0, &contact, &rayleigh);
    assert_close(contact, 2 * M_PI * sqrt(m / k[0]) / 20, 1e-12);
    assert_true(isinf(rayleigh));
    dem_pair_limits(r.sim, 1, 0, &contact, &rayleigh);
    assert_close(contact, 2 * M_PI * sqrt(m / k[1]) / 20, 1e-12);
    dem_pair_limits(r.sim, 1, 1, &contact, &rayleigh);
    assert_close(contact, 2 * M_PI * sqrt(m2 / k[2]) / 20, 1e-12);
    assert_close(dem_time_limits(r.sim).contact, 2 * M_PI * sqrt(m / k[1]) / 20, 1e-12);
    dem_free(r.sim);

    /* Hertz: effective quantities of unequal partners, and of a wall */
    const double E[2] = {3e7, 8e7}, nu = .3, v = .9;
    rig_init(&r, DEM_HERTZ, .5);
    rig_hertz(&r, E[0], nu, 2500);
    r.material[1].youngs_modulus = E[1];
    rig_pairs(&r, .8, .3, 1, 1);
    r.param.impact_speed = v;
    two_kinds(&r);
    double both = 1 / ((1 - nu * nu) / E[0] + (1 - nu * nu) / E[1]);
    dem_pair_limits(r.sim, 0, 1, &contact, &rayleigh);
    report("Hertz, unequal partners, s", contact,
           hertz_period(m * m2 / (m + m2), R * r2 / (R + r2), both, v) / 20);
    assert_close(contact, hertz_period(m * m2 / (m + m2), R * r2 / (R + r2), both, v) / 20, 1e-6);
    double G = E[1] / (2 * (1 + nu)),
           other = .2 * M_PI * r2 * sqrt(5000 / G) / (.1631 * nu + .8766);
    double first = .2 * M_PI * R * sqrt(2500 * 2 * (1 + nu) / E[0]) / (.1631 * nu + .8766);
    assert_close(rayleigh, fmin(first, other), 1e-12);
    dem_free(r.sim);

    /* Only those that are there count: no particle and no wall of material 1. */
    rig_init(&r, DEM_LINEAR, .5);
    rig_pairs(&r, .8, .3, k[0], .7);
    r.pair[1].stiffness = r.pair[2].stiffness = k[2];
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .1, 0, 0, 0);
    dem_pair_limits(r.sim, 0, 1, &contact, &rayleigh);
    assert_true(isinf(contact) && isinf(rayleigh));
    dem_free(r.sim);
}

/* Stable just below the bound of the closed form, refused above it; a contact at the bound is. */
static void stability(void **state)
{
    (void)state;
    const double m = sphere_mass(R, 2500), k = 700, share[] = {.999, 1.001};
    for (int c = 0; c < 2; c++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .5);
        rig_pairs(&r, .7, 0, k, 1);
        rig_floor(&r);
        rig_start(&r);
        rig_ball(&r, R, 0, 0, .1, 0, 0, 0);
        double ratio = -log(.7) / sqrt(M_PI * M_PI + log(.7) * log(.7)); /* of critical damping */
        /* two of them, of half the mass */
        double bound = 2 * sqrt(.5 * m / k) * (sqrt(1 + ratio * ratio) - ratio);
        dem_status status = dem_advance(r.sim, 10 * share[c] * bound, 10);
        assert_int_equal(status, c ? DEM_BAD_ARGUMENT : DEM_OK);
        if (c) {
            assert_non_null(strstr(dem_message(r.sim), "contacts of grain and grain are unstable"));
            assert_non_null(strstr(dem_message(r.sim), "at least 11 sub-steps"));
        }
        dem_free(r.sim);
    }
    /* The bound itself: a sphere that sits in a spring, no dashpot. Kicked, it stays below and
     * flies off above. */
    for (int c = 0; c < 2; c++) {
        double h = share[c] * 2 * sqrt(m / k), x = 0, v = 1e-3, most = 0;
        for (int n = 0; n < 4000; n++) {
            v -= h * k * x / m;
            x += h * v;
            most = fmax(most, fabs(v));
        }
        assert_true(c ? most > 1 : most < 1);
    }
    /* Damped nearly to nothing, spheres with six contacts need less than a twentieth. */
    rig r;
    rig_init(&r, DEM_LINEAR, .5);
    rig_pairs(&r, .02, .5, k, 1);
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .1, 0, 0, 0);
    double ratio = -log(.02) / sqrt(M_PI * M_PI + log(.02) * log(.02));
    double s = sqrt(10 * k / (.5 * m)), part = ratio * sqrt(10);
    double bound = 2 / s * (sqrt(1 + part * part) - part);
    assert_close(dem_time_limits(r.sim).contact, .9 * bound, 1e-9);
    assert_true(.9 * bound < 2 * M_PI * sqrt(m / k) / 20);
    dem_free(r.sim);
}

static void rolling(void **state)
{
    (void)state;
    const double m = sphere_mass(R, 2500), k = 700, mu = .8, eta = .4;
    rig r;
    rig_init(&r, DEM_LINEAR, .5);
    rig_pairs(&r, .9, .3, k, 1);
    for (int p = 0; p < 4; p++) {
        r.pair[p].rolling_friction = mu;
        r.pair[p].rolling_damping = eta;
    }
    r.param.rolling = DEM_ROLLING_EPSD;
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .1, 0, 0, 0);
    double I = .2 * m * R * R, kr = 2.25 * k * mu * mu * .25 * R * R, z = eta * sqrt(3.5);
    double expected = 2 * M_PI * sqrt(I / kr) * (sqrt(1 + z * z) - z) / 20;
    assert_close(dem_time_limits(r.sim).contact, expected, 1e-9);
    dem_free(r.sim);
}

static dem_status start_fixed(rig *r, double step)
{
    r->param.fixed_step = step;
    r->param.n_material = 2;
    r->param.material = r->material;
    r->param.pair = r->pair;
    r->param.wall = r->wall;
    static const double x[1][3] = {{0, 0, .1}};
    static dem_insertion one;
    one =
        (dem_insertion){.name = "one", .kind = DEM_INSERT_LIST, .n = 1, .x = x, .diameter = 2 * R};
    r->param.insertion = &one;
    r->param.n_insertion = 1;
    return dem_new(MPI_COMM_SELF, &r->param, &r->sim);
}

static void fixed(void **state)
{
    (void)state;
    const double m = sphere_mass(R, 2500), k = 700;
    for (int c = 0; c < 2; c++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .5);
        rig_pairs(&r, .8, .2, k, 1);
        r.pair[1].stiffness = r.pair[2].stiffness = 3 * k;
        rig_floor(&r);
        double limit = 2 * M_PI * sqrt(m / (3 * k)) / 20;
        dem_status status = start_fixed(&r, limit * (c ? 1.01 : .8));
        assert_int_equal(status, c ? DEM_BAD_ARGUMENT : DEM_OK);
        if (c) {
            char text[64];
            snprintf(text, sizeof text, "contact limit %g s of grain and steel", limit);
            assert_non_null(strstr(dem_message(r.sim), text));
            assert_non_null(strstr(dem_message(r.sim), "fix a smaller one"));
            dem_sdf_free(r.wall[0].shape);
        } else {
            rig_advance(&r, limit * 80, 0);
            assert_int_equal(dem_last_report(r.sim).substeps, 100);
            assert_true(dem_time_limits(r.sim).step == limit * .8);
            /* a smaller sphere comes: now it is too large */
            rig_ball(&r, .5 * R, .1, 0, .1, 0, 0, 0);
            assert_int_equal(dem_advance(r.sim, limit, 0), DEM_BAD_ARGUMENT);
        }
        dem_free(r.sim);
    }
    /* A wall that moves by more than a tenth of the radius. */
    rig r;
    rig_init(&r, DEM_LINEAR, .5);
    rig_pairs(&r, .8, .2, k, 1);
    rig_floor(&r);
    dem_motion motion = dem_motion_default();
    motion.kind = DEM_TRANSLATION;
    motion.vector[0] = 3;
    r.wall[0].motion = &motion;
    r.wall[0].n_motion = 1;
    double limit = .1 * R / 3;
    assert_true(limit < 2 * M_PI * sqrt(m / k) / 20);
    assert_int_equal(start_fixed(&r, limit * 1.01), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "above the wall limit"));
    dem_sdf_free(r.wall[0].shape);
    dem_free(r.sim);
    r.param.n_wall = 0;
    rig_floor(&r);
    r.wall[0].motion = &motion;
    assert_int_equal(start_fixed(&r, 0), DEM_OK);
    assert_close(dem_time_limits(r.sim).wall, limit, 1e-9);
    assert_close(dem_time_limits(r.sim).step, limit, 1e-9);
    dem_free(r.sim);
}

/* Half the skin at the speed of the fastest. */
static void skin(void **state)
{
    (void)state;
    rig r;
    rig_init(&r, DEM_LINEAR, .5);
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .1, .3, 0, .4);
    assert_close(dem_time_limits(r.sim).skin, .5 * .15 * 2 * R / .5, 1e-12);
    dem_free(r.sim);
}

/* A plate that comes with 4.3 m/s counts like a ball of that speed: Galilei. */
static void coming_wall(void **state)
{
    (void)state;
    const double m = sphere_mass(R, 2500), E = 3e7, nu = .3, v = 4.3;
    rig r;
    rig_init(&r, DEM_HERTZ, .5);
    rig_hertz(&r, E, nu, 2500);
    rig_pairs(&r, 1, 0, 1, 1);
    rig_floor(&r);
    dem_motion motion = dem_motion_default();
    motion.kind = DEM_TRANSLATION;
    motion.vector[2] = v;
    r.wall[0].n_motion = 1;
    r.wall[0].motion = &motion;
    memset(r.param.gravity, 0, sizeof r.param.gravity);
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .1, 0, 0, 0);
    assert_close(dem_time_limits(r.sim).contact, hertz_period(m, R, E / (1 - nu * nu), 2 * v) / 20,
                 1e-6);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(of_pairs), cmocka_unit_test(stability),
                                       cmocka_unit_test(rolling),  cmocka_unit_test(fixed),
                                       cmocka_unit_test(skin),     cmocka_unit_test(coming_wall)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
