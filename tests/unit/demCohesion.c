/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demCohesion.c - SJKR cohesion: equilibrium, pull-off, energy, refusals.
 *
 * With Hertz's spring K sqrt(R) d^1.5 and the attraction kappa A(d), A the area of the circle in
 * which two spheres, or a sphere and a plane, intersect. For two spheres A follows here from
 * Heron's formula for the triangle of the two radii and the distance: its height is the circle's
 * radius. GSL finds the overlap of rest and the largest force that the contact bears.
 */
#include "demRig.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_min.h>
#include <gsl/gsl_roots.h>

static const double E = 6e6, nu = .32, kappa = 2.2e5, rho = 1900;

/* The partner's radius 0: a plane, whose own stiffness is infinite. */
typedef struct partners {
    double a, b;
} partners;

static double net_force(double d, void *context)
{
    const partners *p = context;
    double E_star = E / (1 - nu * nu) / (p->b > 0 ? 2 : 1), R, area;
    if (p->b > 0) {
        double c = p->a + p->b - d, s = .5 * (p->a + p->b + c);
        double triangle = sqrt(s * (s - p->a) * (s - p->b) * (s - c)), height = 2 * triangle / c;
        R = p->a * p->b / (p->a + p->b);
        area = M_PI * height * height;
    } else {
        R = p->a;
        area = M_PI * (p->a * p->a - (p->a - d) * (p->a - d));
    }
    return 4. / 3 * E_star * sqrt(R) * pow(d, 1.5) - kappa * area;
}

static double rest_overlap(partners *p)
{
    gsl_function f = {net_force, p};
    gsl_root_fsolver *solver = gsl_root_fsolver_alloc(gsl_root_fsolver_brent);
    gsl_root_fsolver_set(solver, &f, 1e-6 * p->a, .5 * p->a);
    for (int n = 0; n < 100; n++) gsl_root_fsolver_iterate(solver);
    double root = gsl_root_fsolver_root(solver);
    gsl_root_fsolver_free(solver);
    return root;
}

/* -net_force at its largest */
static double pull_off(partners *p)
{
    gsl_function f = {net_force, p};
    gsl_min_fminimizer *solver = gsl_min_fminimizer_alloc(gsl_min_fminimizer_brent);
    double rest = rest_overlap(p);
    gsl_min_fminimizer_set(solver, &f, .4 * rest, 1e-9 * rest, rest);
    for (int n = 0; n < 100; n++) gsl_min_fminimizer_iterate(solver);
    double force = -gsl_min_fminimizer_f_minimum(solver);
    gsl_min_fminimizer_free(solver);
    return force;
}

static void prepare(rig *r, double size, double e)
{
    rig_init(r, DEM_HERTZ, 300 * size);
    rig_hertz(r, E, nu, rho);
    rig_pairs(r, e, .3, 1, 1);
    for (int p = 0; p < 4; p++) r->pair[p].cohesion = kappa;
    r->param.cohesion = DEM_COHESION_SJKR;
    r->param.balance = 1;
    r->param.steps_per_period = 60;
}

static void add_two(rig *r, partners p, double overlap, double speed)
{
    const double x[2][3] = {{0, 0, p.a - (p.b > 0 ? 0 : overlap)}, {p.a + p.b - overlap, 0, p.a}};
    const double v[2][3] = {{0, 0, p.b > 0 ? 0 : -speed}, {-speed, 0, 0}}, radius[2] = {p.a, p.b};
    const int material[2] = {0, 0};
    if (dem_add(r->sim, p.b > 0 ? 2 : 1, x, v, NULL, radius, material, NULL))
        fail_msg("%s", dem_message(r->sim));
}

static const partners cases[] = {{1.1e-3, 1.1e-3}, {1.1e-3, .4e-3}, {1.1e-3, 0},
                                 {10e-6, 7e-6},    {.5, .5},        {.5, 0}};

static double overlap_now(const rig *r, partners p)
{
    dem_view w = dem_particles(r->sim);
    if (!(p.b > 0)) return p.a - w.x[0][2];
    double d2 = 0;
    for (int a = 0; a < 3; a++) d2 += (w.x[0][a] - w.x[1][a]) * (w.x[0][a] - w.x[1][a]);
    return p.a + p.b - sqrt(d2);
}

/* Damped, they come to rest where attraction and repulsion are equal. */
static void equilibrium(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        partners p = cases[k];
        double rest = rest_overlap(&p);
        rig r;
        prepare(&r, p.a, .2);
        if (!(p.b > 0)) rig_floor(&r);
        rig_start(&r);
        add_two(&r, p, .7 * rest, 0);
        double step = dem_time_limits(r.sim).step;
        rig_advance(&r, 6000 * step, 0);
        print_message("radii %g and %g m: ", p.a, p.b);
        report("overlap at rest, m", overlap_now(&r, p), rest);
        assert_close(overlap_now(&r, p), rest, 1e-6);
        dem_report rep = dem_last_report(r.sim);
        assert_true(rep.energy.elastic < 0 &&
                    fabs(rep.energy.kinetic) < -1e-9 * rep.energy.elastic);
        /* What the well is deep: the integral of the force, by Simpson's rule. */
        double depth = 0;
        const int parts = 2000;
        for (int n = 0; n <= parts; n++)
            depth += (n == 0 || n == parts ? 1
                      : n % 2              ? 4
                                           : 2) *
                     net_force(n * rest / parts, &p) * rest / (3 * parts);
        assert_close(rep.energy.elastic, depth, 1e-5);
        dem_free(r.sim);
    }
}

/* Without losses: they swing in the well for ever, or part as fast as they met. */
static void conserved(void **state)
{
    (void)state;
    for (size_t k = 0; k < 3; k++) {
        partners p = cases[k];
        double rest = rest_overlap(&p), least = 1, most = -1;
        rig r;
        prepare(&r, p.a, 1);
        r.param.steps_per_period = 200;
        if (!(p.b > 0)) rig_floor(&r);
        rig_start(&r);
        add_two(&r, p, .5 * rest, 0);
        double step = dem_time_limits(r.sim).step, well = 0;
        for (int n = 0; n < 800; n++) {
            rig_advance(&r, 3 * step, 3);
            dem_energy e = dem_last_report(r.sim).energy;
            least = fmin(least, e.kinetic + e.elastic);
            most = fmax(most, e.kinetic + e.elastic);
            well = fmin(well, e.elastic);
        }
        print_message("radii %g and %g m, 800 times: energy in the well within %.1e of its depth\n",
                      p.a, p.b, (most - least) / -well);
        assert_true(most - least < -2.5e-2 * well); /* to and fro within a swing, of first order */
        dem_energy e = dem_last_report(r.sim).energy;
        assert_true(fabs(e.damping) < -1e-9 * well && fabs(e.sliding) < -1e-9 * well);
        dem_free(r.sim);

        prepare(&r, p.a, 1);
        r.param.steps_per_period = 400;
        if (!(p.b > 0)) rig_floor(&r);
        rig_start(&r);
        add_two(&r, p, 0, .6);
        rig_advance(&r, 4000 * dem_time_limits(r.sim).step, 0);
        e = dem_last_report(r.sim).energy;
        assert_true(dem_last_report(r.sim).contacts + dem_last_report(r.sim).wall_contacts == 0);
        report("Energy after a sticky elastic impact, over before", e.kinetic / e.supply, 1);
        assert_close(e.kinetic, e.supply, 1e-3);
        dem_free(r.sim);
    }
}

/* A sphere on the floor holds against nearly the largest force, not against a little more. */
static void pulled(void **state)
{
    (void)state;
    const double share[] = {.99, 1.01};
    for (size_t k = 2; k < 6; k += 3)
        for (int c = 0; c < 2; c++) {
            partners p = cases[k];
            double most = pull_off(&p), rest = rest_overlap(&p);
            rig r;
            prepare(&r, p.a, .2);
            rig_floor(&r);
            rig_start(&r);
            add_two(&r, p, rest, 0);
            double step = dem_time_limits(r.sim).step;
            for (int n = 0; n < 400; n++) {
                const double f[1][3] = {{0, 0, share[c] * most * fmin(1, n / 300.)}};
                const double w[1][3] = {{0}}, none[1] = {0};
                assert_int_equal(dem_set_outside_force(r.sim, f, none, w, NULL), DEM_OK);
                rig_advance(&r, 60 * step, 60);
                if (!dem_last_report(r.sim).wall_contacts) break;
            }
            int holds = dem_last_report(r.sim).wall_contacts > 0;
            print_message("radius %g m, %g of the largest force %.4g N: %s\n", p.a, share[c], most,
                          holds ? "holds" : "lets go");
            assert_int_equal(holds, !c);
            dem_free(r.sim);
        }
}

/* A linear spring that the attraction overcomes is refused. */
static void too_soft(void **state)
{
    (void)state;
    const double R = 1.1e-3, k = 300;
    for (int c = 0; c < 2; c++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .1);
        rig_pairs(&r, .5, .2, k, 1);
        for (int p = 0; p < 4; p++)
            r.pair[p].cohesion = (c ? 1.02 : .98) * k / (M_PI * R); /* 2 pi kappa R/2 = k */
        r.param.cohesion = DEM_COHESION_SJKR;
        rig_start(&r);
        rig_ball(&r, R, 0, 0, 0, 0, 0, 0);
        assert_int_equal(dem_advance(r.sim, 1e-5, 0), c ? DEM_BAD_ARGUMENT : DEM_OK);
        if (c) assert_non_null(strstr(dem_message(r.sim), "contact grain-grain: cohesion"));
        dem_free(r.sim);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    gsl_set_error_handler_off();
    const struct CMUnitTest tests[] = {cmocka_unit_test(equilibrium), cmocka_unit_test(conserved),
                                       cmocka_unit_test(pulled), cmocka_unit_test(too_soft)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
