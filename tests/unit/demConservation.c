/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demConservation.c - momentum, angular momentum, energy and the impulse of the outside force.
 */
#include "demRig.h"

#include <gsl/gsl_rng.h>
#include <stdlib.h>

enum { MANY = 200 };

/* A loose cloud of spinning spheres of many sizes that flies together. */
static void add_cloud(rig *r, gsl_rng *rng, size_t n, double R, double width, double speed)
{
    double(*x)[3] = malloc(n * sizeof *x), (*v)[3] = malloc(n * sizeof *v);
    double(*w)[3] = malloc(n * sizeof *w), *radius = malloc(n * sizeof *radius);
    int *material = malloc(n * sizeof *material);
    for (size_t i = 0; i < n; i++) {
        radius[i] = R * (.4 + .6 * gsl_rng_uniform(rng));
        material[i] = (int)gsl_rng_uniform_int(rng, 2);
        for (int tries = 0, clear = 0; !clear; tries++) {
            assert_true(tries < 100000);
            for (int a = 0; a < 3; a++) x[i][a] = width * (gsl_rng_uniform(rng) - .5);
            clear = 1;
            for (size_t j = 0; j < i && clear; j++) {
                double d2 = 0, s = radius[i] + radius[j];
                for (int a = 0; a < 3; a++) d2 += (x[i][a] - x[j][a]) * (x[i][a] - x[j][a]);
                clear = d2 > s * s;
            }
        }
        for (int a = 0; a < 3; a++) {
            v[i][a] = -speed * x[i][a] / width + .2 * speed * (gsl_rng_uniform(rng) - .5);
            w[i][a] = speed / R * (gsl_rng_uniform(rng) - .5);
        }
    }
    dem_status status = dem_add(r->sim, n, (const double(*)[3])x, (const double(*)[3])v,
                                (const double(*)[3])w, radius, material, NULL);
    if (status) fail_msg("%s", dem_message(r->sim));
    free(x);
    free(v);
    free(w);
    free(radius);
    free(material);
}

/* Models: 0 the plain law, 1 rolling of constant torque, 2 elastic-plastic, 3 that with cohesion.
 */
static void start_cloud(rig *r, dem_law law, double R, double e, int models)
{
    /* Stiffness so that time is the same for all sizes: about 1e-5 s a step. */
    double m = sphere_mass(.4 * R, 1700), size = R / 2.2e-3;
    rig_init(r, law, 60 * R);
    rig_hertz(r, 3e7 * size * size, .31, 2500);
    r->material[1].youngs_modulus = 2e7 * size * size;
    r->material[1].density = 1700;
    rig_pairs(r, e, .43, m * 1e9, .7);
    r->pair[1].friction = r->pair[2].friction = .17;
    r->param.rolling = models ? DEM_ROLLING_CONSTANT + (models > 1) : DEM_ROLLING_NONE;
    r->param.cohesion = models > 2 ? DEM_COHESION_SJKR : DEM_COHESION_NONE;
    for (int p = 0; p < 4; p++) {
        r->pair[p].rolling_friction = .23;
        r->pair[p].rolling_damping = .4;
        r->pair[p].cohesion = .03 * m * 1e9 / R;
    }
    rig_start(r);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    add_cloud(r, rng, MANY, R, 14 * R, 200 * R);
    gsl_rng_free(rng);
}

static void angular_momentum(const dem_view *p, double L[3], double *size)
{
    L[0] = L[1] = L[2] = *size = 0;
    for (size_t i = 0; i < p->n; i++) {
        const double *x = p->x[i], *v = p->v[i], *w = p->omega[i], m = p->mass[i];
        double I = .4 * m * p->radius[i] * p->radius[i];
        double l[3] = {m * (x[1] * v[2] - x[2] * v[1]) + I * w[0],
                       m * (x[2] * v[0] - x[0] * v[2]) + I * w[1],
                       m * (x[0] * v[1] - x[1] * v[0]) + I * w[2]};
        for (int a = 0; a < 3; a++) {
            L[a] += l[a];
            *size += fabs(l[a]);
        }
    }
}

static double momentum_size(const dem_view *p)
{
    double size = 0;
    for (size_t i = 0; i < p->n; i++)
        for (int a = 0; a < 3; a++) size += p->mass[i] * fabs(p->v[i][a]);
    return size;
}

static void momentum_kept(void **state)
{
    (void)state;
    const double radius[] = {10e-6, 2.2e-3, .5};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int run = 0; run < 12; run++) {
            int k = run % 3, models = run / 3;
            rig r;
            start_cloud(&r, (dem_law)law, radius[k], .6, models);
            dem_view p = dem_particles(r.sim);
            double L0[3], L1[3], size_L, size_p = momentum_size(&p), P0[3] = {0};
            angular_momentum(&p, L0, &size_L);
            for (size_t i = 0; i < p.n; i++)
                for (int a = 0; a < 3; a++) P0[a] += p.mass[i] * p.v[i][a];
            int64_t most = 0;
            for (int s = 0; s < 50; s++) {
                rig_advance(&r, 1e-3, 0);
                int64_t c = dem_last_report(r.sim).contacts;
                most = c > most ? c : most;
            }
            assert_true(most > MANY / 20); /* they did meet */
            p = dem_particles(r.sim);
            angular_momentum(&p, L1, &size_L);
            dem_report rep = dem_last_report(r.sim);
            double dp = 0, dL = 0;
            for (int a = 0; a < 3; a++) {
                dp = fmax(dp, fabs(rep.momentum[a] - P0[a]) / size_p);
                dL = fmax(dL, fabs(L1[a] - L0[a]) / size_L);
            }
            print_message(
                "%s, models %d, R %g m, up to %d contacts: momentum kept to %.1e, angular to "
                "%.1e\n",
                law == DEM_LINEAR ? "Linear" : "Hertz", models, radius[k], (int)most, dp, dL);
            for (int a = 0; a < 3; a++) {
                assert_within(rep.momentum[a], P0[a], 1e-13 * size_p);
                assert_within(L1[a], L0[a], 1e-12 * size_L);
            }
            dem_free(r.sim);
        }
}

/* Elastic and smooth: the energy between contacts stays. Otherwise it never rises. */
static void energy_falls(void **state)
{
    (void)state;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int elastic = 0; elastic < 2; elastic++) {
            rig r;
            const double R = 2.2e-3;
            rig_init(&r, (dem_law)law, 300 * R);
            rig_hertz(&r, 3e7, .31, 2500);
            r.material[1].youngs_modulus = 2e7; /* half of the particles are of it */
            rig_pairs(&r, elastic ? 1 : .8, elastic ? 0 : .43, 5e3, .7);
            r.param.steps_per_period = 100;
            rig_start(&r);
            gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
            add_cloud(&r, rng, MANY, R, 14 * R, 200 * R);
            gsl_rng_free(rng);
            rig_advance(&r, 1e-9, 1);
            dem_report rep = dem_last_report(r.sim);
            double start = rep.kinetic_energy + rep.rotational_energy, least = start;
            int64_t met = 0;
            for (int s = 0; s < 80; s++) {
                rig_advance(&r, 1e-3, 0);
                rep = dem_last_report(r.sim);
                double now = rep.kinetic_energy + rep.rotational_energy;
                met += rep.contacts;
                /* Energy in springs comes back: a little may be there now that was not before. */
                if (!elastic) assert_true(now < least * 1.02);
                least = fmin(least, now);
            }
            assert_true(met > MANY);
            if (elastic) {
                /* The cloud has dispersed: nothing is left in springs. */
                rig_advance(&r, .1, 0);
                rep = dem_last_report(r.sim);
                report("Energy of an elastic cloud after over before",
                       (rep.kinetic_energy + rep.rotational_energy) / start, 1);
                assert_close(rep.kinetic_energy + rep.rotational_energy, start, 2e-3);
            } else
                assert_true(least < .8 * start);
            dem_free(r.sim);
        }
}

/* A random outside force on every particle, of the stiffness k dt/m; returns the momentum. */
static void push_all(rig *r, gsl_rng *rng, double stiffness, double inertia, double dt,
                     double momentum[3])
{
    static double f[MANY][3], k[MANY], w[MANY][3], M[MANY];
    dem_view p = dem_particles(r->sim);
    memset(momentum, 0, 3 * sizeof *momentum);
    for (size_t i = 0; i < p.n; i++) {
        for (int a = 0; a < 3; a++) {
            f[i][a] = p.mass[i] * 7 * (gsl_rng_uniform(rng) - .5);
            w[i][a] = gsl_rng_uniform(rng) - .3;
            momentum[a] += p.mass[i] * p.v[i][a];
        }
        k[i] = stiffness * p.mass[i] / dt;
        M[i] = inertia * p.mass[i];
    }
    assert_int_equal(
        dem_set_outside_force(r->sim, (const double(*)[3])f, k, (const double(*)[3])w, M), DEM_OK);
}

/* What was gained is what walls, gravity and the outside force gave. */
static void check_balance(const rig *r, const double before[3], double dt)
{
    dem_view p = dem_particles(r->sim);
    dem_report rep = dem_last_report(r->sim);
    double force[3], gain[3] = {0}, size = momentum_size(&p); /* of what was exchanged */
    dem_wall_force(r->sim, 0, force);
    for (size_t i = 0; i < p.n; i++)
        for (int a = 0; a < 3; a++) gain[a] += p.impulse[i][a];
    for (int a = 0; a < 3; a++) size += fabs(rep.wall_impulse[a]) + fabs(rep.gravity_impulse[a]);
    for (int a = 0; a < 3; a++) {
        assert_within(gain[a], rep.outside_impulse[a], 1e-15 * size);
        assert_within(-force[a] * dt, rep.wall_impulse[a], 1e-13 * size);
        assert_within(rep.momentum[a] - before[a],
                      rep.wall_impulse[a] + rep.gravity_impulse[a] + gain[a], 1e-13 * size);
    }
}

/* m dv = contact + gravity + outside impulse for all of them, whatever k dt/m. */
static void impulse_identity(void **state)
{
    (void)state;
    const double stiff[] = {0, 1e-2, 1, 1e3};
    for (int c = 0; c < 4; c++) {
        rig r;
        const double R = 1.3e-3, dt = 1e-3;
        rig_init(&r, DEM_LINEAR, 20 * R);
        rig_pairs(&r, .7, .3, 800, .8);
        r.param.gravity[1] = 2.385;
        r.param.gravity[2] = -9.81;
        r.wall[0].shape = dem_sdf_box((const double[3]){-10 * R, -10 * R, -10 * R},
                                      (const double[3]){10 * R, 10 * R, 10 * R}, 1);
        r.param.n_wall = 1;
        rig_start(&r);
        gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
        add_cloud(&r, rng, MANY, R, 14 * R, 200 * R);
        for (int s = 0; s < 20; s++) {
            double before[3];
            push_all(&r, rng, stiff[c], c % 2 ? .4 : 0, dt, before);
            rig_advance(&r, dt, 0);
            check_balance(&r, before, dt);
        }
        gsl_rng_free(rng);
        dem_free(r.sim);
    }
}

/* One particle: v' follows the implicit formula, and J is dt (f + k (w - v')) - M (v' - v). */
static void implicit_formula(void **state)
{
    (void)state;
    rig r;
    const double R = 1e-3, dt = 2.7e-4, m = sphere_mass(R, 2500);
    rig_init(&r, DEM_LINEAR, 1);
    r.param.gravity[0] = 3.1;
    rig_start(&r);
    rig_ball(&r, R, 0, 0, 0, .83, -.2, .41);
    const double f[1][3] = {{2e-5, -1e-5, 7e-6}}, w[1][3] = {{1.9, .6, -.4}};
    const double k[1] = {3 * m / dt}, M[1] = {.7 * m}, v[3] = {.83, -.2, .41};
    assert_int_equal(dem_set_outside_force(r.sim, f, k, w, M), DEM_OK);
    rig_advance(&r, dt, 1);
    dem_view p = dem_particles(r.sim);
    for (int a = 0; a < 3; a++) {
        double now = ((m + M[0]) * v[a] + dt * (m * (a ? 0 : 3.1) + f[0][a] + k[0] * w[0][a])) /
                     (m + M[0] + k[0] * dt);
        assert_close(p.v[0][a], now, 1e-14);
        assert_close(p.impulse[0][a], dt * (f[0][a] + k[0] * (w[0][a] - now)) - M[0] * (now - v[a]),
                     1e-12);
    }
    /* Switched off, it is gone. */
    assert_int_equal(dem_set_outside_force(r.sim, NULL, NULL, NULL, NULL), DEM_OK);
    double before = p.v[0][1];
    rig_advance(&r, dt, 3);
    p = dem_particles(r.sim);
    assert_true(p.v[0][1] == before && p.impulse[0][1] == 0);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(momentum_kept), cmocka_unit_test(energy_falls),
        cmocka_unit_test(impulse_identity), cmocka_unit_test(implicit_formula)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
