/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demGravity.c - particles under gravity: bouncing, stacked, slipping into rolling.
 *
 * The cases DEM01, DEM03 and DEM04 of the MFiX verification manual (National Energy Technology
 * Laboratory), after Garg et al., Powder Technol. 220 (2012) 122,
 * doi:10.1016/j.powtec.2011.09.019. References are the closed forms of a sphere on a linear spring
 * and dashpot, evaluated independently; for the stack, the same three linear contacts integrated by
 * GSL to 1e-10.
 */
#include "demRig.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

static const double g = 9.80665;

typedef struct bounce {
    double e, leaves, speed, lowest, apex;
} bounce;

static void bounce_case(bounce b)
{
    rig r;
    const double R = .1, dt = 1e-6;
    rig_init(&r, DEM_LINEAR, 2);
    r.material[0].density = 2600;
    r.param.gravity[2] = -g;
    rig_pairs(&r, b.e, 0, 1e4, 1);
    rig_floor(&r);
    rig_start(&r);
    rig_ball(&r, R, 0, 0, .5, 0, 0, 0);
    double first = 0, leaves = 0, left = 0, speed = 0, lowest = 1, apex = 0;
    int touched = 0;
    for (int s = 0; s < 900000 && !(leaves && speed < 0); s++) {
        rig_advance(&r, dt, 1);
        dem_view p = dem_particles(r.sim);
        int touches = dem_last_report(r.sim).wall_contacts > 0;
        if (touches && !touched) first = dem_time(r.sim);
        if (touched && !touches && !leaves) {
            leaves = dem_time(r.sim);
            left = p.v[0][2];
        }
        touched = touches;
        lowest = fmin(lowest, p.x[0][2]);
        speed = leaves ? p.v[0][2] : 0;
        if (leaves) apex = fmax(apex, p.x[0][2]);
    }
    print_message("Bouncing sphere, e %g\n", b.e);
    report("    touches at, s", first, .285617);
    report("    leaves at, s", leaves, b.leaves);
    report("    leaves with, m/s", left, b.speed);
    report("    lowest height, m", lowest, b.lowest);
    report("    apex, m", apex, b.apex);
    assert_close(first, .285617, 1e-3);
    assert_close(left, b.speed, 1e-3);
    assert_close(leaves, b.leaves, 1e-3);
    /* The overlap reaches nearly R: compare it, not what is left. */
    assert_close(R - lowest, R - b.lowest, 1e-3);
    assert_close(apex, b.apex, 1e-3);
    dem_free(r.sim);
}

static void bouncing_sphere(void **state)
{
    (void)state;
    bounce_case((bounce){.9, .397435, 2.475443, .001624, .412432});
    bounce_case((bounce){.7, .399498, 1.821535, .012500, .269170});
}

/* ---- two spheres stacked between floor and lid ----------------------------------------------- */

/* Floor-1, 1-2, 2-lid. Linear: k d + eta v; Hertz: K d^1.5 + sqrt5 B sqrt(m K) d^.25 v. */
typedef struct stack {
    dem_law law;
    double R, lid, k[3], eta[3], m[2];
} stack;

static int stack_motion(double t, const double y[], double dy[], void *data)
{
    (void)t;
    const stack *s = data;
    const double overlap[3] = {s->R - y[0], 2 * s->R - (y[1] - y[0]), s->R - (s->lid - y[1])};
    const double rate[3] = {-y[2], y[2] - y[3], y[3]};
    double f[3];
    for (int c = 0; c < 3; c++) {
        const double d = fmax(overlap[c], 0), root = s->law == DEM_HERTZ ? sqrt(d) : 1;
        f[c] = d > 0 ? s->k[c] * root * d + s->eta[c] * sqrt(root) * rate[c] : 0;
    }
    dy[0] = y[2];
    dy[1] = y[3];
    dy[2] = (f[0] - f[1]) / s->m[0] - g;
    dy[3] = (f[1] - f[2]) / s->m[1] - g;
    return GSL_SUCCESS;
}

static double dashpot(dem_law law, double e, double m, double k)
{
    const double l = -log(e);
    return (law == DEM_HERTZ ? sqrt(5) : 2) * l * sqrt(m * k / (M_PI * M_PI + l * l));
}

/* As published: R 5e-4 m, k 1000, 1200, 1000 N/m. For other sizes with the same overlaps under
 * gravity; Hertz as stiff as these springs at the first overlap, a tenth of R. */
static stack stack_init(rig *r, dem_law law, double R, double e)
{
    const double rho[2] = {2e4, 1e4}, nu = .29, k = 1e3 * pow(R / 5e-4, 2);
    stack s = {.law = law, .R = R, .lid = 3.6 * R, .k = {k, 1.2 * k, k}};
    rig_init(r, law, 200 * R);
    for (int i = 0; i < 2; i++) {
        s.m[i] = sphere_mass(R, rho[i]);
        r->material[i].density = rho[i];
        r->material[i].poisson_ratio = nu;
        r->material[i].youngs_modulus = (1 + .6 * i) * k / R * 6;
    }
    rig_pairs(r, e, 0, k, 1);
    r->pair[1].stiffness = r->pair[2].stiffness = s.k[1]; /* sphere 1 - sphere 2 */
    if (law == DEM_HERTZ) {
        const double own = .5 / (1 - nu * nu), E[2] = {6 * k / R, 1.6 * 6 * k / R};
        s.k[0] = 4. / 3 * own * E[0] * sqrt(R);
        s.k[1] = 4. / 3 * 2 * own * E[0] * E[1] / (E[0] + E[1]) * sqrt(.5 * R);
        s.k[2] = 4. / 3 * own * E[1] * sqrt(R);
    }
    s.eta[0] = dashpot(law, e, s.m[0], s.k[0]);
    s.eta[1] = dashpot(law, e, s.m[0] * s.m[1] / (s.m[0] + s.m[1]), s.k[1]);
    s.eta[2] = dashpot(law, e, s.m[1], s.k[2]);
    return s;
}

/* Largest distance from GSL's path over R. */
static double stack_case(dem_law law, double R, double e)
{
    rig r;
    stack s = stack_init(&r, law, R, e);
    r.param.gravity[2] = -g;
    rig_floor(&r);
    /* The floor is of the material of 1, the lid of that of 2. */
    r.wall[0].material = 0;
    r.wall[1].shape = dem_sdf_plane((const double[3]){0, 0, s.lid}, (const double[3]){0, 0, -1});
    r.wall[1].material = 1;
    strcpy(r.wall[1].name, "lid");
    r.param.n_wall = 2;
    rig_start(&r);
    const double x[2][3] = {{0, 0, .25 * s.lid}, {0, 0, .75 * s.lid}}, radius[2] = {R, R};
    const int material[2] = {0, 1};
    assert_int_equal(dem_add(r.sim, 2, x, NULL, NULL, radius, material, NULL), DEM_OK);

    const double dt = 2e-4 * sqrt(R / 5e-4);
    double y[4] = {x[0][2], x[1][2], 0, 0}, t = 0, worst = 0;
    gsl_odeiv2_system system = {stack_motion, NULL, 4, &s};
    gsl_odeiv2_driver *d =
        gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-4 * dt, 2e-11 * R, 1e-10);
    for (int k = 1; k <= 40; k++) {
        rig_advance(&r, dt, 8000);
        assert_int_equal(gsl_odeiv2_driver_apply(d, &t, k * dt, y), GSL_SUCCESS);
        dem_view p = dem_particles(r.sim);
        int one = p.material[0] == 0 ? 0 : 1;
        worst = fmax(worst, fmax(fabs(p.x[one][2] - y[0]), fabs(p.x[1 - one][2] - y[1])) / R);
    }
    /* The stack has moved by more than the overlaps it began with. */
    assert_true(fabs(y[1] - x[1][2]) + fabs(y[0] - x[0][2]) > .02 * R);
    gsl_odeiv2_driver_free(d);
    dem_free(r.sim);
    return worst;
}

static void stacked_spheres(void **state)
{
    (void)state;
    const double radius[] = {10e-6, 5e-4, .5}, e[] = {.83, .4};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        double worst = 0;
        for (int k = 0; k < 6; k++)
            worst = fmax(worst, stack_case((dem_law)law, radius[k / 2], e[k % 2]));
        report(law == DEM_LINEAR ? "Stacked spheres, linear, largest distance from the path over R"
                                 : "Stacked spheres, Hertz, largest distance from the path over R",
               worst, 0);
        assert_true(worst < 1e-3);
    }
}

/* The lower of the two alone, dropped from five radii: the first three bounces. */
static double drop_case(double R, double e)
{
    rig r;
    stack s = stack_init(&r, DEM_HERTZ, R, e);
    r.param.gravity[2] = -g;
    rig_floor(&r);
    r.wall[0].material = 0;
    rig_start(&r);
    rig_ball(&r, R, 0, 0, 5 * R, 0, 0, 0);
    s.lid = INFINITY;
    const double dt = .05 * sqrt(R / g);
    double y[4] = {5 * R, 1e4 * R, 0, 0}, t = 0, worst = 0, lowest = R;
    int bounces = 0;
    gsl_odeiv2_system system = {stack_motion, NULL, 4, &s};
    gsl_odeiv2_driver *d =
        gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-4 * dt, 1e-11 * R, 1e-12);
    for (int k = 1; bounces < 3; k++) {
        const double falls = y[2];
        rig_advance(&r, dt, 4000);
        assert_int_equal(gsl_odeiv2_driver_apply(d, &t, k * dt, y), GSL_SUCCESS);
        worst = fmax(worst, fabs(dem_particles(r.sim).x[0][2] - y[0]) / R);
        lowest = fmin(lowest, y[0]);
        bounces += falls < 0 && y[2] > 0;
    }
    assert_true(lowest < .995 * R);
    gsl_odeiv2_driver_free(d);
    dem_free(r.sim);
    return worst;
}

static void bouncing_hertz(void **state)
{
    (void)state;
    const double radius[] = {10e-6, 1.3e-3, .5}, e[] = {1, .7};
    double worst = 0;
    for (int k = 0; k < 6; k++) worst = fmax(worst, drop_case(radius[k / 2], e[k % 2]));
    report("Bouncing sphere, Hertz, largest distance from the path over R", worst, 0);
    assert_true(worst < 1e-3);
}

/* Under their own weight, at rest: the pair carries one weight, the floor two. */
static void stack_at_rest(void **state)
{
    (void)state;
    rig r;
    const double R = 2.1e-3, k = 800, m = sphere_mass(R, 2500);
    rig_init(&r, DEM_LINEAR, .1);
    r.param.gravity[2] = -g;
    rig_pairs(&r, .2, .3, k, 1);
    rig_floor(&r);
    rig_start(&r);
    rig_ball(&r, R, 0, 0, R, 0, 0, 0);
    rig_ball(&r, R, 0, 0, 3 * R, 0, 0, 0);
    rig_advance(&r, .5, 0);
    dem_view p = dem_particles(r.sim);
    report("Stack at rest, overlap with the floor, m", R - p.x[0][2], 2 * m * g / k);
    assert_close(R - p.x[0][2], 2 * m * g / k, 1e-9);
    assert_close(2 * R - (p.x[1][2] - p.x[0][2]), m * g / k, 1e-9);
    double force[3];
    rig_advance(&r, 1e-2, 0);
    dem_wall_force(r.sim, 0, force);
    report("Stack at rest, force on the floor, N", force[2], -2 * m * g);
    assert_close(force[2], -2 * m * g, 1e-9);
    dem_free(r.sim);
}

/* ---- a ball slipping on a plane -------------------------------------------------------------- */

static void slipping_ball(void **state)
{
    (void)state;
    const double radius[] = {10e-6, 2.5e-3, .5}, mu[] = {.1, .37, .92};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int k = 0; k < 3; k++) {
            rig r;
            const double R = radius[k], u0 = 1.9 * sqrt(g * R), m = sphere_mass(R, 2500);
            rig_init(&r, (dem_law)law, 1000 * R);
            rig_hertz(&r, 2e5 * 2500 * g * R, .3, 2500);
            r.param.gravity[2] = -g;
            r.param.impact_speed = 4 * sqrt(g * R);
            rig_pairs(&r, .6, mu[k], 1e5 * m * g / R, 1);
            rig_floor(&r);
            rig_start(&r);
            /* At the height where the floor carries it. */
            double E = 2e5 * 2500 * g * R / (1 - .09);
            double sink =
                law == DEM_LINEAR ? 1e-5 * R : pow(m * g / (4. / 3 * E * sqrt(R)), 2. / 3);
            rig_ball(&r, R, 0, 0, R - sink, u0, 0, 0);
            double rolls = 2. / 7 * u0 / (mu[k] * g), dt = rolls / 1000, slip;
            double since = 0;
            for (int s = 0; s < 3000; s++) {
                rig_advance(&r, dt, 0);
                dem_view p = dem_particles(r.sim);
                slip = p.v[0][0] - R * p.omega[0][1];
                if (slip < 1e-3 * u0 && since == 0) since = dem_time(r.sim);
            }
            dem_view p = dem_particles(r.sim);
            print_message("Slipping ball, %s, R %g m, mu %g\n",
                          law == DEM_LINEAR ? "linear" : "Hertz", R, mu[k]);
            report("    rolls from mu g t/u0", since * mu[k] * g / u0, 2. / 7);
            report("    then u/u0", p.v[0][0] / u0, 5. / 7);
            report("    and R omega/u0", R * p.omega[0][1] / u0, 5. / 7);
            assert_close(since, rolls, 5e-3);
            assert_close(p.v[0][0], 5. / 7 * u0, 5e-3);
            assert_close(R * p.omega[0][1], 5. / 7 * u0, 5e-3);
            dem_free(r.sim);
        }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bouncing_sphere), cmocka_unit_test(stacked_spheres),
        cmocka_unit_test(bouncing_hertz), cmocka_unit_test(stack_at_rest),
        cmocka_unit_test(slipping_ball)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
