/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demBalance.c - the balance of energy and angular momentum, term by term and as a whole.
 *
 * Closed forms for one sphere: a dashpot takes (1 - e^2) m v^2/2 of an impact; sliding takes 2/7 of
 * m v^2/2 until it rolls, rolling resistance the other 5/7; a spring holds m v^2/2 when the sphere
 * has stopped. As a whole: what is left over goes to nothing with the step.
 */
#include "demRig.h"

#include <gsl/gsl_rng.h>
#include <stdlib.h>

static const double g = 9.81;

static void start(rig *r, dem_law law, double R, double e, double mu)
{
    double m = sphere_mass(R, 2385);
    rig_init(r, law, 300 * R);
    rig_hertz(r, 2e10 * R, .27, 2385);
    r->material[1].youngs_modulus = 4e10 * R;
    rig_pairs(r, e, mu, 2e4 * m * g / R, .8);
    r->param.balance = 1;
}

static double total(dem_energy e)
{
    return fabs(e.supply) + fabs(e.gravity) + fabs(e.walls) + fabs(e.outside);
}

static void impact(void **state)
{
    (void)state;
    const double R = 2.2e-3, v = .7, e = .6, m = sphere_mass(R, 2385), before = .5 * m * v * v;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        rig r;
        start(&r, (dem_law)law, R, e, 0);
        r.param.steps_per_period = 2000;
        rig_floor(&r);
        rig_start(&r);
        rig_ball(&r, R, 0, 0, 1.001 * R, 0, 0, -v);
        double most = 0;
        dem_energy now;
        for (int n = 0; n < 400; n++) {
            rig_advance(&r, 1e-5, 0);
            now = dem_last_report(r.sim).energy;
            most = fmax(most, now.elastic);
        }
        report("Lost in the dashpot, J", now.damping, (1 - e * e) * before);
        assert_close(now.damping, (1 - e * e) * before, 2e-3);
        assert_close(now.supply, before, 1e-14);
        assert_true(now.elastic == 0 && now.sliding == 0 && now.rolling == 0 && now.walls == 0);
        assert_within(now.residual, 0, 1e-3 * before);
        assert_true(most > .6 * before && most < .9 * before);
        dem_free(r.sim);
        /* elastic: all of it is in the spring once */
        start(&r, (dem_law)law, R, 1, 0);
        r.param.steps_per_period = 2000;
        rig_floor(&r);
        rig_start(&r);
        rig_ball(&r, R, 0, 0, 1.0001 * R, 0, 0, -v);
        most = 0;
        for (int n = 0; n < 2000; n++) {
            rig_advance(&r, 1e-6, 0);
            most = fmax(most, dem_last_report(r.sim).energy.elastic);
        }
        report("Largest energy of the spring, J", most, before);
        assert_close(most, before, 2e-3);
        dem_free(r.sim);
    }
}

/* Slides, rolls, stops; falls and rests. */
static void on_the_floor(void **state)
{
    (void)state;
    const double R = 1.3e-3, u = .31, m = sphere_mass(R, 2385), before = .5 * m * u * u;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int kind = 0; kind < 3; kind++) {
            rig r;
            start(&r, (dem_law)law, R, .5, .3);
            for (int p = 0; p < 4; p++) {
                r.pair[p].rolling_friction = .1;
                r.pair[p].rolling_damping = .5;
            }
            r.param.rolling = (dem_rolling)kind;
            r.param.gravity[2] = -g;
            rig_floor(&r);
            rig_start(&r);
            double K = 4. / 3 * R * 1e10 * 4 / 3 / (1 - .27 * .27) * sqrt(R);
            double sunk = law ? pow(m * g / K, 2. / 3) : R / 2e4;
            rig_ball(&r, R, 0, 0, R - sunk, u, 0, 0);
            rig_advance(&r, 2 * u / (7 * .3 * g) * 1.3, 0);
            dem_energy now = dem_last_report(r.sim).energy;
            /* The surfaces slide for u/(g (7/2 mu - 5/2 mu_r)), evenly slower. */
            double part = .3 / (3.5 * .3 - 2.5 * (kind ? .1 : 0));
            report("Lost by sliding, J", now.sliding, part * before);
            assert_close(now.sliding, part * before, kind == DEM_ROLLING_EPSD ? 2e-2 : 5e-3);
            rig_advance(&r, .5, 0);
            now = dem_last_report(r.sim).energy;
            assert_within(now.residual, 0, 2e-3 * before);
            if (kind) {
                report("Lost altogether, J", now.sliding + now.rolling + now.damping, before);
                assert_close(now.sliding + now.rolling + now.damping, before, 5e-3);
                assert_true(now.rolling > .5 * before);
            } else
                assert_close(now.rotational / now.kinetic, .4, 1e-2);
            dem_free(r.sim);
        }
}

/* ---- many ------------------------------------------------------------------------------------ */

enum { MANY = 90 };

static void pour(rig *r, double R, double speed)
{
    double x[MANY][3], v[MANY][3], w[MANY][3], radius[MANY];
    int material[MANY];
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int i = 0; i < MANY; i++) {
        int at[3] = {i % 4, i / 4 % 4, i / 16};
        radius[i] = R * (.6 + .4 * gsl_rng_uniform(rng));
        material[i] = i % 2;
        for (int a = 0; a < 3; a++) {
            x[i][a] = 2.05 * R * (at[a] - (a < 2 ? 1.5 : -.6));
            v[i][a] = speed * (gsl_rng_uniform(rng) - .5);
            w[i][a] = speed / R * (gsl_rng_uniform(rng) - .5);
        }
    }
    gsl_rng_free(rng);
    if (dem_add(r->sim, MANY, (const double(*)[3])x, (const double(*)[3])v, (const double(*)[3])w,
                radius, material, NULL))
        fail_msg("%s", dem_message(r->sim));
}

static void angular_check(const rig *r, const double before[3], double *worst)
{
    dem_report rep = dem_last_report(r->sim);
    dem_view p = dem_particles(r->sim);
    double size = 0;
    for (size_t i = 0; i < p.n; i++)
        for (int a = 0; a < 3; a++)
            size += p.mass[i] * (fabs(p.v[i][a]) + p.radius[i] * fabs(p.omega[i][a])) * 8e-3;
    for (int a = 0; a < 3; a++) size += fabs(rep.gravity_angular[a]) + fabs(rep.wall_angular[a]);
    for (int a = 0; a < 3; a++) {
        double gain = rep.wall_angular[a] + rep.gravity_angular[a] + rep.outside_angular[a];
        *worst = fmax(*worst, fabs(rep.angular_momentum[a] - before[a] - gain) / size);
    }
}

/* A box with a bottom that shakes, everything switched on; returns the residual over the energy
 * brought in. */
static double shaken(dem_law law, dem_rolling rolling, int cohesive, double steps, double *angular)
{
    const double R = 1.1e-3, side = 4.3 * R;
    rig r;
    start(&r, law, R, .55, .35);
    for (int p = 0; p < 4; p++) {
        r.pair[p].rolling_friction = .15;
        r.pair[p].rolling_damping = .3;
        r.pair[p].cohesion = cohesive ? 1e4 : 0;
    }
    r.pair[3].friction = .2;
    r.param.rolling = rolling;
    r.param.cohesion = cohesive ? DEM_COHESION_SJKR : DEM_COHESION_NONE;
    r.param.gravity[2] = -g;
    r.param.gravity[0] = 1.7;
    r.param.steps_per_period = steps;
    r.wall[0].shape = dem_sdf_box((const double[3]){-side, -side, -30 * R},
                                  (const double[3]){side, side, 40 * R}, 1);
    r.wall[0].material = 1;
    r.param.n_wall = 1;
    rig_floor(&r);
    dem_motion motion[2] = {dem_motion_default(), dem_motion_default()};
    motion[0].kind = DEM_OSCILLATION;
    motion[0].vector[2] = .6 * R;
    motion[0].frequency = 31;
    motion[1].kind = DEM_ROTATION;
    motion[1].vector[2] = 1;
    motion[1].rate = 23;
    r.wall[1].motion = motion;
    r.wall[1].n_motion = 2;
    rig_start(&r);
    pour(&r, R, .6);
    dem_report rep = dem_last_report(r.sim);
    double most = 0, before[3] = {0};
    for (int n = 0; n < 28; n++) {
        if (n) memcpy(before, rep.angular_momentum, sizeof before);
        if (n == 20) { /* one more, that is not at rest */
            rig_ball(&r, R, 0, 0, 29 * R, .2, .1, -.4);
            dem_view p = dem_particles(r.sim);
            for (size_t i = 0; i < p.n; i++)
                if (p.id[i] == MANY) {
                    const double *x = p.x[i], *v = p.v[i];
                    before[0] += p.mass[i] * (x[1] * v[2] - x[2] * v[1]);
                    before[1] += p.mass[i] * (x[2] * v[0] - x[0] * v[2]);
                    before[2] += p.mass[i] * (x[0] * v[1] - x[1] * v[0]);
                }
        }
        dem_view p = dem_particles(r.sim);
        static double f[MANY + 1][3], k[MANY + 1], w[MANY + 1][3];
        for (size_t i = 0; i < p.n; i++) {
            k[i] = p.mass[i] * 3;
            f[i][1] = p.mass[i] * 1.3;
            w[i][0] = .2;
        }
        assert_int_equal(
            dem_set_outside_force(r.sim, (const double(*)[3])f, k, (const double(*)[3])w, NULL),
            DEM_OK);
        rig_advance(&r, 5e-3, 0);
        rep = dem_last_report(r.sim);
        if (n) angular_check(&r, before, angular);
        most = fmax(most, fabs(rep.energy.residual) / total(rep.energy));
    }
    const dem_energy *e = &rep.energy;
    if (steps == 20)
        print_message(
            "    kinetic %.2e spin %.2e elastic %.2e gravity %.2e outside %.2e walls %.2e "
            "damping %.2e sliding %.2e rolling %.2e supply %.2e\n",
            e->kinetic, e->rotational, e->elastic, e->gravity, e->outside, e->walls, e->damping,
            e->sliding, e->rolling, e->supply);
    dem_free(r.sim);
    return most;
}

static void closes(void **state)
{
    (void)state;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int k = 0; k < 3; k++) {
            double angular = 0;
            double coarse = shaken((dem_law)law, (dem_rolling)k, k > 0, 20, &angular);
            double fine = shaken((dem_law)law, (dem_rolling)k, k > 0, 80, &angular);
            print_message("%s, rolling model %d: residual over energy brought in %.1e, with a "
                          "quarter of the step %.1e; angular momentum %.1e\n",
                          law ? "Hertz" : "linear", k, coarse, fine, angular);
            assert_true(fine < .5 * coarse);
            assert_true(angular < 1e-12);
        }
}

/* A bed at rest loses its lower half to an outlet, springs and all, and the rest falls. */
static void taken_out(void **state)
{
    (void)state;
    const double R = 1.1e-3, side = 4.3 * R;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        rig r;
        start(&r, (dem_law)law, R, .55, .35);
        r.param.gravity[2] = -g;
        r.wall[0].shape = dem_sdf_box((const double[3]){-side, -side, 0},
                                      (const double[3]){side, side, 40 * R}, 1);
        r.wall[0].material = 1;
        r.param.n_wall = 1;
        dem_outlet hatch = {.name = "hatch",
                            .region = dem_sdf_box((const double[3]){-side, -side, -R},
                                                  (const double[3]){side, side, 2.5 * R}, 1),
                            .begin = .20005,
                            .end = .2002};
        r.param.outlet = &hatch;
        r.param.n_outlet = 1;
        rig_start(&r);
        pour(&r, R, .6);
        rig_advance(&r, .2, 0);
        dem_energy full = dem_last_report(r.sim).energy;
        rig_advance(&r, 1e-4, 0);
        dem_report now = dem_last_report(r.sim);
        assert_true(now.removed > 10 && now.particles > 10);
        /* what was in the springs of the taken ones is booked with them */
        assert_within(now.energy.residual, full.residual, .2 * full.elastic);
        rig_advance(&r, .1, 0);
        now = dem_last_report(r.sim);
        print_message("%s: %.1e J in springs before; residual over energy turned over %.1e, %.1e\n",
                      law ? "Hertz" : "linear", full.elastic, full.residual / total(full),
                      now.energy.residual / total(now.energy));
        assert_within(now.energy.residual, 0, 1.2e-2 * (total(full) + total(now.energy)));
        dem_free(r.sim);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(impact), cmocka_unit_test(on_the_floor),
                                       cmocka_unit_test(closes), cmocka_unit_test(taken_out)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
