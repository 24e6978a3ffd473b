/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Feeders and outlets: rates, windows and limits, independence of how the caller divides time, no
 * overlap with particles and walls, debt of a full region, balances of mass and momentum, history
 * and columns of those that stay, refusals.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dem.h"
#include "near.h"

static const double PI = 3.14159265358979323846;
static const dem_material GLASS = {"glass", 2470, 5e7, .23};
static const dem_pair PAIR = {
    .restitution = .83, .friction = .31, .stiffness = 900, .stiffness_ratio = .7};

/* A box without walls, lo to hi. */
static dem_param space(const double lo[3], const double hi[3])
{
    dem_param p = dem_param_default();
    memcpy(p.lo, lo, sizeof p.lo);
    memcpy(p.hi, hi, sizeof p.hi);
    p.n_material = 1;
    p.material = &GLASS;
    p.pair = &PAIR;
    return p;
}

static dem_species equal(double d)
{
    return (dem_species){0, {.kind = DEM_SIZE_EQUAL, .mean = d}, 1};
}

static dem_feeder feeder_in(const double lo[3], const double hi[3], const dem_species *species)
{
    dem_feeder f = {.name = "inlet",
                    .n_species = 1,
                    .species = species,
                    .mass = INFINITY,
                    .number = -1,
                    .end = INFINITY,
                    .seed = 8712};
    f.region = dem_sdf_box(lo, hi, 1);
    memcpy(f.lo, lo, sizeof f.lo);
    memcpy(f.hi, hi, sizeof f.hi);
    return f;
}

static dem_outlet outlet_in(const double lo[3], const double hi[3])
{
    return (dem_outlet){"exit", dem_sdf_box(lo, hi, 1), -1e9, INFINITY};
}

static dem_sim *start(const dem_param *p)
{
    dem_sim *sim;
    const dem_status status = dem_new(MPI_COMM_WORLD, p, &sim);
    if (status) fail_msg("%s", dem_message(sim));
    return sim;
}

static void go(dem_sim *sim, double dt, int substeps)
{
    const dem_status status = dem_advance(sim, dt, substeps);
    if (status) fail_msg("%s", dem_message(sim));
}

static double fed_mass(const dem_sim *sim)
{
    int64_t n;
    double mass, waiting;
    dem_fed(sim, 0, &n, &mass, &waiting);
    return mass;
}

static double sphere(double d)
{
    return PI / 6 * d * d * d * GLASS.density;
}

/* ---- feeding --------------------------------------------------------------------------------- */

static const double LO[3] = {-.13, -.11, -.4}, HI[3] = {.17, .19, .6};
static const double FLO[3] = {-.05, -.07, .41}, FHI[3] = {.09, .11, .55};

/* The sum fed never exceeds rate * time and lacks at most a particle and an interval of it, for a
 * minute of one by one as for a shower; in all exactly the limits. */
static void rate(void **unused)
{
    (void)unused;
    const double largest = sphere(.0113);
    dem_species s = {
        0,
        {.kind = DEM_SIZE_NORMAL, .mean = .0071, .deviation = .0017, .lo = .0043, .hi = .0113},
        1};
    for (int k = 0; k < 3; k++) {
        const double per_s[3] = {.0213, .0871, 1.31};
        dem_param p = space(LO, HI);
        dem_feeder f = feeder_in(FLO, FHI, &s);
        f.mass_rate = per_s[k];
        f.begin = .0173;
        f.end = k == 2 ? .2177 : INFINITY;
        f.velocity[2] = -.77;
        f.velocity_spread = .02;
        const dem_outlet o = outlet_in((double[3]){-1, -1, -.4}, (double[3]){1, 1, -.2});
        p.n_feeder = p.n_outlet = 1;
        p.feeder = &f;
        p.outlet = &o;
        dem_sim *sim = start(&p);
        assert_int_equal(dem_particles(sim).n, 0);
        /* t_clear/8 and the longest time between single particles */
        const double interval = fmax(.14 / .77 / 8 * 1.1, sphere(.0113) / per_s[k]);
        for (int n = 1; n <= 60; n++) {
            go(sim, .0053, 0);
            const double open = fmin(dem_time(sim), f.end) - f.begin, due = per_s[k] * open;
            const double mass = fed_mass(sim);
            assert_true(mass <= fmax(due, 0) + 1e-9 * largest);
            if (dem_time(sim) < f.end)
                assert_true(mass >= due - per_s[k] * interval - 1.001 * largest);
            if (k == 2 && dem_time(sim) > f.end + .001) assert_near(mass, due, largest);
        }
        const dem_report r = dem_last_report(sim);
        int64_t gone;
        double taken;
        dem_removed(sim, 0, &gone, &taken);
        assert_near((r.mass + taken) / fed_mass(sim), 1, 1e-13);
        dem_free(sim);
    }
}

/* Whatever pieces the caller advances by, the same particles come at the same moments. */
static void pieces(void **unused)
{
    (void)unused;
    dem_species s = {0, {.kind = DEM_SIZE_UNIFORM, .lo = .004, .hi = .009}, 1};
    const int cut[3] = {1, 10, 237};
    static double x[3][4000][3], r[3][4000];
    size_t n[3];
    for (int k = 0; k < 3; k++) {
        dem_param p = space(LO, HI);
        dem_feeder f = feeder_in(FLO, FHI, &s);
        f.number_rate = 2311.7;
        f.velocity[2] = -2.3;
        p.n_feeder = 1;
        p.feeder = &f;
        dem_sim *sim = start(&p);
        for (int c = 0; c < cut[k]; c++) go(sim, .237 / cut[k], 2370 / cut[k]);
        const dem_view v = dem_particles(sim);
        n[k] = v.n;
        assert_true(v.n > 400 && v.n < 4000);
        for (size_t i = 0; i < v.n; i++) {
            memcpy(x[k][v.id[i]], v.x[i], sizeof *v.x);
            r[k][v.id[i]] = v.radius[i];
        }
        dem_free(sim);
    }
    for (int k = 1; k < 3; k++) {
        assert_int_equal(n[k], n[0]);
        assert_memory_equal(r[k], r[0], n[0] * sizeof **r);
        for (size_t i = 0; i < n[0]; i++)
            for (int a = 0; a < 3; a++) assert_near(x[k][i][a], x[0][i][a], 1e-12);
    }
}

/* How much of the smaller radius any two spheres overlap by, across periodic sides. */
static double deepest(const dem_sim *sim, const double length[3])
{
    const dem_view v = dem_particles(sim);
    double most = 0;
    for (size_t i = 0; i < v.n; i++)
        for (size_t j = 0; j < i; j++) {
            double d2 = 0;
            for (int a = 0; a < 3; a++) {
                double d = v.x[i][a] - v.x[j][a];
                if (length[a] > 0) d -= length[a] * rint(d / length[a]);
                d2 += d * d;
            }
            const double apart = v.radius[i] + v.radius[j] - sqrt(d2);
            most = fmax(most, apart / fmin(v.radius[i], v.radius[j]));
        }
    return most;
}

/* A region across periodic sides, wide sizes, a paddle within it: nobody overlaps anybody, and the
 * region fills until it is full; what is due then waits, and comes when there is room again. */
static void full_region(void **unused)
{
    (void)unused;
    const double flo[3] = {.09, .14, .4}, fhi[3] = {.21, .25, .5}; /* sticks out at x and y */
    const double blade_lo[3] = {.11, -.1, .44}, blade_hi[3] = {.16, .3, .46};
    dem_species s = {0, {.kind = DEM_SIZE_UNIFORM, .by_mass = 1, .lo = .007, .hi = .028}, 1};
    dem_param p = space(LO, HI);
    p.periodic[0] = p.periodic[1] = 1;
    dem_motion turn = dem_motion_default();
    turn.kind = DEM_TRANSLATION;
    turn.vector[0] = .3;
    dem_wall blade = {.name = "blade", .shape = dem_sdf_box(blade_lo, blade_hi, 0)};
    blade.n_motion = 1;
    blade.motion = &turn;
    dem_feeder f = feeder_in(flo, fhi, &s);
    f.mass_rate = 61;
    dem_outlet o = outlet_in((double[3]){-1, -1, .3}, (double[3]){1, 1, .7});
    o.begin = .0501;
    p.n_wall = p.n_feeder = p.n_outlet = 1;
    p.wall = &blade;
    p.feeder = &f;
    p.outlet = &o;
    dem_sim *sim = start(&p);
    const double length[3] = {HI[0] - LO[0], HI[1] - LO[1], 0};
    int64_t n;
    double mass, waiting;
    go(sim, .02, 1000);
    dem_fed(sim, 0, &n, &mass, &waiting);
    const dem_view v = dem_particles(sim);
    assert_true(v.n > 30 && (int64_t)v.n == n);
    assert_true(deepest(sim, length) <= 0);
    assert_int_equal(dem_last_report(sim).wall_contacts, 0);
    int beyond = 0;
    for (size_t i = 0; i < v.n; i++) {
        assert_true(v.x[i][2] >= .4 + v.radius[i] && v.x[i][2] <= .5 - v.radius[i]);
        beyond += v.x[i][0] < 0 || v.x[i][1] < 0;
    }
    assert_true(beyond > 5); /* some are on the other side of the period */
    assert_true(waiting > 0);
    assert_near(mass + waiting, 61 * .02, .03);
    go(sim, .03, 1000); /* full: next to nothing more finds a place */
    assert_true(fed_mass(sim) < 1.3 * mass);
    go(sim, .001, 50); /* the outlet has cleared the region */
    assert_int_equal(dem_particles(sim).n, 0);
    mass = fed_mass(sim);
    go(sim, .001, 50);
    assert_true(fed_mass(sim) > mass + .2);
    dem_free(sim);
}

/* Species by share: of number at any moment, of mass in the mean; limits in all. */
static void species(void **unused)
{
    (void)unused;
    for (int by_mass = 0; by_mass < 2; by_mass++) {
        dem_species s[2] = {equal(.005), equal(.0093)};
        s[0].share = 3;
        s[1].share = 5;
        dem_param p = space(LO, HI);
        dem_feeder f = feeder_in(FLO, FHI, s);
        f.n_species = 2;
        f.share_by_mass = by_mass;
        f.number_rate = 5e4;
        f.number = 1911;
        f.velocity[2] = -15;
        p.n_feeder = 1;
        p.feeder = &f;
        dem_sim *sim = start(&p);
        /* until the limit is reached the species set the time step, then those who are there */
        const double m = sphere(.005);
        assert_near(dem_time_limits(sim).contact / (2 * PI * sqrt(m / 900) / 20), 1, 1e-12);
        go(sim, .048, 0);
        const dem_view v = dem_particles(sim);
        assert_int_equal(v.n, 1911);
        double number[2] = {0}, mass[2] = {0};
        for (size_t i = 0; i < v.n; i++) {
            number[v.radius[i] > .003] += 1;
            mass[v.radius[i] > .003] += v.mass[i];
        }
        const double *share = by_mass ? mass : number;
        assert_near(share[0] / (share[0] + share[1]), 3. / 8, by_mass ? .004 : .002);
        dem_free(sim);
    }
    dem_species one = equal(.0061);
    dem_param p = space(LO, HI);
    dem_feeder f = feeder_in(FLO, FHI, &one);
    f.mass_rate = 2;
    f.mass = 7.001 * sphere(.0061);
    f.velocity[2] = -5;
    p.n_feeder = 1;
    p.feeder = &f;
    dem_sim *sim = start(&p);
    go(sim, .05, 0);
    assert_int_equal(dem_particles(sim).n, 7);
    go(sim, .01, 0);
    assert_true(isfinite(dem_time_limits(sim).contact));
    dem_free(sim);
}

/* ---- outlets --------------------------------------------------------------------------------- */

/* Twelve thousand particles through a box with walls and gravity: mass and momentum of every step
 * close to rounding, and in the end nobody is there. */
static void balances(void **unused)
{
    (void)unused;
    dem_species s = {0, {.kind = DEM_SIZE_LOGNORMAL, .mean = .006, .deviation = .2}, 1};
    dem_param p = space(LO, HI);
    p.gravity[2] = -9.81;
    dem_feeder f = feeder_in(FLO, FHI, &s);
    f.number_rate = 27000;
    f.number = 12000;
    f.velocity[2] = -6.1;
    f.velocity_spread = .9;
    const double top[3] = {.02, .04, -.05};
    dem_wall w = {.name = "ball", .shape = dem_sdf_sphere(top, .06, 0)};
    /* the bottom, and beyond the sides: who bounces off falls out of the domain else */
    dem_sdf *around[2] = {dem_sdf_box((double[3]){-1, -1, -1}, (double[3]){1, 1, -.3}, 1),
                          dem_sdf_complement(dem_sdf_box((double[3]){-.11, -.09, -2},
                                                         (double[3]){.15, .17, .58}, 1))};
    dem_outlet o[2] = {{"bottom", around[0], 0, INFINITY}, {"sides", around[1], 0, INFINITY}};
    p.n_feeder = p.n_wall = 1;
    p.n_outlet = 2;
    p.feeder = &f;
    p.wall = &w;
    p.outlet = o;
    p.balance = 1;
    dem_sim *sim = start(&p);
    dem_report before = dem_last_report(sim);
    double worst = 0;
    for (int n = 0; n < 120; n++) {
        go(sim, .0101, 150);
        const dem_report r = dem_last_report(sim);
        const double scale = fmax(r.mass, 1e-3) * 6;
        assert_near(r.mass, before.mass + r.fed_mass - r.removed_mass, 1e-13 * fmax(r.mass, .01));
        assert_int_equal(r.particles, before.particles + r.fed - r.removed);
        for (int a = 0; a < 3; a++)
            worst =
                fmax(worst, fabs(r.momentum[a] - before.momentum[a] - r.gravity_impulse[a] -
                                 r.wall_impulse[a] - r.fed_momentum[a] + r.removed_momentum[a]) /
                                scale);
        before = r;
    }
    assert_true(worst < 1e-12);
    /* energy came with particles and gravity, and left with particles but for what contacts took */
    const dem_energy e = before.energy;
    assert_true(e.supply < -.1 * e.gravity);
    assert_true(fabs(e.residual) < -.01 * e.supply);
    double taken[2], waiting, mass;
    int64_t gone[2], fed;
    for (size_t k = 0; k < 2; k++) dem_removed(sim, k, &gone[k], &taken[k]);
    dem_fed(sim, 0, &fed, &mass, &waiting);
    assert_int_equal(fed, 12000);
    assert_int_equal(gone[0] + gone[1], 12000);
    assert_true(gone[0] > 100 && gone[1] > 100);
    assert_int_equal(dem_particles(sim).n, 0);
    assert_near((taken[0] + taken[1]) / mass, 1, 1e-13);
    assert_string_equal(dem_outlet_name(sim, 1), "sides");
    assert_true(isinf(dem_time_limits(sim).contact));
    dem_free(sim);
}

/* Three spheres lie on a slope below the angle of friction, held by tangential springs, the last
 * two touching; when outlets take those that came first, the others do not notice. */
static void history(void **unused)
{
    (void)unused;
    const double x[5][3] = {{-.06, 0, .0098},
                            {-.03, .05, .0099},
                            {.03, 0, .00995},
                            {.0499, 0, .00995},
                            {-.06, .0199, .0098}};
    const double r[5] = {.01, .01, .01, .01, .01}, zero[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    const int material[5] = {0};
    double end[2][2][3], omega[2][2][3];
    for (int k = 0; k < 2; k++) {
        dem_param p = space(LO, HI);
        p.gravity[0] = 2.1;
        p.gravity[2] = -9.3;
        dem_wall w = {.name = "slope", .shape = dem_sdf_plane(zero, up)};
        p.n_wall = 1;
        p.wall = &w;
        dem_outlet o = outlet_in((double[3]){-.13, -.1, -.1}, (double[3]){.002, .1, .1});
        o.begin = .0123;
        p.n_outlet = 1;
        p.outlet = &o;
        dem_sim *sim = start(&p);
        const size_t first = k ? 2 : 0, count = k ? 2 : 5;
        const int64_t id[5] = {11, 7, 3, 5, 2};
        assert_int_equal(dem_add(sim, count, x + first, NULL, NULL, r, material, id + first),
                         DEM_OK);
        const int column = dem_attach(sim, "label", 2);
        dem_view v = dem_particles(sim);
        for (size_t i = 0; i < v.n; i++) dem_column(sim, column)[2 * i + 1] = 10. * (double)v.id[i];
        const uint64_t revision = v.revision;
        for (int n = 0; n < 20; n++) go(sim, .002, 97);
        v = dem_particles(sim);
        assert_int_equal(v.n, 2);
        assert_true(k || v.revision != revision);
        for (size_t i = 0; i < 2; i++) {
            const int q = v.id[i] == 5;
            assert_true(v.id[i] == 3 || q);
            assert_true(dem_column(sim, column)[2 * i + 1] == 10. * (double)v.id[i]);
            memcpy(end[k][q], v.x[i], sizeof *v.x);
            memcpy(omega[k][q], v.omega[i], sizeof *v.omega);
        }
        dem_free(sim);
    }
    for (int q = 0; q < 2; q++)
        for (int a = 0; a < 3; a++) {
            assert_near(end[0][q][a], end[1][q][a], 1e-13);
            assert_near(omega[0][q][a], omega[1][q][a], 1e-9);
        }
}

/* What leaves takes its columns and its impulse along, and both are told. */
static void leaving(void **unused)
{
    (void)unused;
    const double x[3][3] = {{0, 0, .1}, {.05, 0, .1}, {.1, .05, .1}};
    const double v[3][3] = {{0, 0, -2.2}, {0, 0, 1.1}, {.3, 0, -2.4}}, r[3] = {.003, .004, .005};
    const int material[3] = {0};
    dem_param p = space(LO, HI);
    dem_outlet o = outlet_in((double[3]){-.2, -.2, -.3}, (double[3]){.3, .3, 0});
    p.n_outlet = 1;
    p.outlet = &o;
    dem_sim *sim = start(&p);
    assert_int_equal(dem_add(sim, 3, x, v, NULL, r, material, NULL), DEM_OK);
    const int column = dem_attach(sim, "load", 2);
    double f[3][3], w[3][3] = {{0}}, k[3] = {0}, sum[2], expected[2] = {0}, impulse = 0;
    dem_view now = dem_particles(sim);
    for (int i = 0; i < 3; i++) {
        f[i][0] = 1e-3 * (1 + (double)now.id[i]);
        f[i][1] = f[i][2] = 0;
        dem_column(sim, column)[2 * i] = 1.7 + (double)now.id[i];
        dem_column(sim, column)[2 * i + 1] = -.3 * (double)now.id[i];
        if (now.id[i] == 1) continue;
        expected[0] += 1.7 + (double)now.id[i];
        expected[1] -= .3 * (double)now.id[i];
        impulse += .05 * f[i][0];
    }
    assert_int_equal(
        dem_set_outside_force(sim, (const double(*)[3])f, k, (const double(*)[3])w, NULL), DEM_OK);
    go(sim, .05, 120);
    const dem_report report = dem_last_report(sim);
    assert_int_equal(report.removed, 2);
    assert_int_equal(report.particles, 1);
    assert_int_equal(dem_particles(sim).id[0], 1);
    dem_removed_column(sim, column, sum);
    assert_near(sum[0], expected[0], 1e-14);
    assert_near(sum[1], expected[1], 1e-14);
    /* it had gone before the end */
    const double brought = .3 * 4. / 3 * PI * 1.25e-7 * GLASS.density;
    assert_near((report.removed_momentum[0] - brought) / report.removed_impulse[0], 1, 1e-12);
    assert_true(report.removed_impulse[0] < impulse && report.removed_impulse[0] > .8 * impulse);
    assert_near((report.outside_impulse[0] - report.removed_impulse[0]) / (.05 * 2e-3), 1, 1e-12);
    go(sim, .001, 3);
    dem_removed_column(sim, column, sum);
    assert_near(sum[0], 0, 0);
    assert_near(dem_last_report(sim).removed_impulse[0], 0, 0);
    dem_free(sim);
}

/* ---- refusals -------------------------------------------------------------------------------- */

static void refused(const dem_feeder *f, const dem_outlet *o, const char *text)
{
    dem_param p = space(LO, HI);
    p.n_feeder = f != NULL;
    p.feeder = f;
    p.n_outlet = o != NULL;
    p.outlet = o;
    dem_sim *sim;
    assert_int_equal(dem_new(MPI_COMM_WORLD, &p, &sim), DEM_BAD_ARGUMENT);
    if (!strstr(dem_message(sim), text)) fail_msg("'%s' not in '%s'", text, dem_message(sim));
    dem_free(sim);
}

static void refusals(void **unused)
{
    (void)unused;
    dem_species s = equal(.01);
    dem_feeder good = feeder_in(FLO, FHI, &s), f = good;
    refused(&f, NULL, "feeder inlet: mass rate 0 kg/s and number rate 0 1/s");
    f.mass_rate = f.number_rate = 1;
    refused(&f, NULL, "one must be > 0");
    good.number_rate = 3;
    f = good;
    f.begin = 2;
    f.end = 1;
    refused(&f, NULL, "begins at 2 s, ends at 1 s");
    f = good;
    f.lo[0] = 1;
    f.hi[0] = 2;
    refused(&f, NULL, "feeder inlet: the region lies outside the domain (x from 1 to 2 m)");
    f = good;
    f.n_species = 0;
    refused(&f, NULL, "no species");
    f = good;
    f.number = 0;
    refused(&f, NULL, "number in all 0");
    f = good;
    f.mass = -1;
    refused(&f, NULL, "mass in all -1 kg");
    f = good;
    f.velocity_spread = -.1;
    refused(&f, NULL, "velocity spread -0.1");
    f = good;
    s.size.mean = .15;
    refused(&f, NULL, "no room for its largest particle, diameter 0.15 m");
    s = equal(.01);
    s.material = 1;
    refused(&f, NULL, "species 1: material 1 is none of the 1");
    s = equal(.01);
    s.share = 0;
    refused(&f, NULL, "species 1: share 0");
    s = (dem_species){
        0, {.kind = DEM_SIZE_NORMAL, .mean = .01, .deviation = .002, .lo = .02, .hi = .01}, 1};
    refused(&f, NULL, "0 < smallest < largest");
    dem_sdf_free(good.region);
    dem_outlet o = outlet_in((double[3]){1, 1, 1}, (double[3]){2, 2, 2});
    refused(NULL, &o, "outlet exit: the region lies outside the domain");
    o.end = -2e9;
    refused(NULL, &o, "outlet exit: begins at");
    dem_sdf_free(o.region);
    o.region = NULL;
    refused(NULL, &o, "outlet exit has no region");
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rate),    cmocka_unit_test(pieces),   cmocka_unit_test(full_region),
        cmocka_unit_test(species), cmocka_unit_test(balances), cmocka_unit_test(history),
        cmocka_unit_test(leaving), cmocka_unit_test(refusals),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
