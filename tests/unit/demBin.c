/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demBin.c - a bin of thick sheets from triangles, as drawing programs write them.
 *
 * Its inner walls hang together round the rim, where the surface bends away. They must be felt
 * apart all the same: a ball in the corner of two of them and the floor comes to rest as in a box
 * of planes, and what meets the rim, now an edge between parts, keeps its energy.
 */
#include "demRig.h"
#include "stlFixture.h"

#include <gsl/gsl_rng.h>

static const double inner = .1, thick = .01, radius = .004;

static void add_quad(body *b, double x[4][3])
{
    add_triangle(b, x[0], x[1], x[2]);
    add_triangle(b, x[0], x[2], x[3]);
}

/* Sides of a square tube from z0 to z1, the rim on it, and the two floors. */
static body bin_body(void)
{
    body b = {0, 0, NULL};
    const double at[2][2] = {{0, inner}, {-thick, inner + thick}}, z[2] = {0, -thick};
    const int corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int k = 0; k < 4; k++) {
        double p[2][2][2]; /* inner, outer; this corner, the next; x, y */
        for (int c = 0; c < 2; c++)
            for (int n = 0; n < 2; n++)
                for (int a = 0; a < 2; a++) p[c][n][a] = at[c][corner[(k + n) % 4][a]];
        for (int c = 0; c < 2; c++) {
            const double *f = p[c][!c], *t = p[c][c]; /* anticlockwise from the free side */
            add_quad(&b, (double[4][3]){{f[0], f[1], z[c]},
                                        {t[0], t[1], z[c]},
                                        {t[0], t[1], inner},
                                        {f[0], f[1], inner}});
        }
        add_quad(&b, (double[4][3]){{p[1][0][0], p[1][0][1], inner},
                                    {p[1][1][0], p[1][1][1], inner},
                                    {p[0][1][0], p[0][1][1], inner},
                                    {p[0][0][0], p[0][0][1], inner}});
    }
    for (int c = 0; c < 2; c++) {
        double q[4][3];
        for (int k = 0; k < 4; k++) {
            const int *at_k = corner[c ? 3 - k : k];
            q[k][0] = at[c][at_k[0]];
            q[k][1] = at[c][at_k[1]];
            q[k][2] = z[c];
        }
        add_quad(&b, q);
    }
    return b;
}

static void put_bin(rig *r)
{
    dem_wall *w = &r->wall[r->param.n_wall++];
    strcpy(w->name, "bin");
    body b = bin_body();
    w->shape = stl_shape(&b, 0);
    body_free(&b);
    w->material = 1;
}

static void rests_in_the_corner(void **state)
{
    (void)state;
    rig r;
    rig_init(&r, DEM_LINEAR, .3);
    rig_pairs(&r, .3, .3, 1000, 1);
    for (int a = 0; a < 3; a++) r.param.gravity[a] = -5;
    put_bin(&r);
    rig_start(&r);
    rig_ball(&r, radius, radius + .002, radius + .0025, radius + .003, 0, 0, 0);
    rig_advance(&r, 1, 0);
    assert_int_equal(dem_last_report(r.sim).wall_contacts, 3);
    assert_within(dem_last_report(r.sim).speed, 0, 1e-12);
    double force[3], weight = 5 * sphere_mass(radius, 2500);
    dem_wall_force(r.sim, 0, force);
    for (int a = 0; a < 3; a++) assert_close(force[a], -weight, 1e-9);
    dem_free(r.sim);
}

/* Balls thrown at the rim from all sides above, one after the other. */
static void keeps_energy_at_the_rim(void **state)
{
    (void)state;
    rig r;
    rig_init(&r, DEM_LINEAR, .3);
    rig_pairs(&r, 1, 0, 20000, 1);
    r.param.steps_per_period = 60;
    put_bin(&r);
    /* takes each ball before the next */
    const double lo[3] = {-.3, -.3, -.3}, hi[3] = {.3, .3, .3};
    dem_outlet outlet = {.name = "end", .begin = 1, .end = INFINITY};
    outlet.region = dem_sdf_box(lo, hi, 1);
    r.param.n_outlet = 1;
    r.param.outlet = &outlet;
    rig_start(&r);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    int met = 0;
    double worst = 0;
    for (int throw = 0; throw < 300; throw ++) {
        const int side = (int)gsl_rng_uniform_int(rng, 4), a = side / 2;
        double at[3] = {0, 0, inner}, d[3];
        at[a] = (side % 2 ? inner : 0) + .012 * (gsl_rng_uniform(rng) - .5);
        at[1 - a] = inner * gsl_rng_uniform(rng);
        const double c = .2 + .8 * gsl_rng_uniform(rng), turn = 2 * M_PI * gsl_rng_uniform(rng);
        d[0] = sqrt(1 - c * c) * cos(turn);
        d[1] = sqrt(1 - c * c) * sin(turn);
        d[2] = c;
        dem_set_time(r.sim, 0);
        rig_ball(&r, radius, at[0] + .03 * d[0], at[1] + .03 * d[1], at[2] + .03 * d[2], -d[0],
                 -d[1], -d[2]);
        rig_advance(&r, .06, 0);
        const double *v = dem_particles(r.sim).v[0];
        met += fabs(v[0] + d[0]) + fabs(v[1] + d[1]) + fabs(v[2] + d[2]) > 1e-6;
        worst = fmax(worst, fabs(dem_last_report(r.sim).speed - 1));
        dem_set_time(r.sim, 2);
        rig_advance(&r, 1e-6, 0);
        assert_int_equal(dem_particles(r.sim).n, 0);
    }
    print_message("%d of 300 hit, speed off by at most %.2g\n", met, worst);
    assert_true(met > 200);
    assert_within(worst, 0, .02);
    gsl_rng_free(rng);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(rests_in_the_corner),
                                       cmocka_unit_test(keeps_energy_at_the_rim)};
    MPI_Init(&argc, &argv);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
