/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demFeedSides.c - feeders and outlets at periodic sides; feeders when the clock is set.
 *
 * A particle that has crossed a periodic side keeps its place beyond it until the neighbour list is
 * made again: outlets must know where it is all the same, and feeders must see those on the other
 * side of the period as neighbours. A region that reaches beyond a side goes on at the other.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "dem.h"
#include "near.h"

static const dem_material GLASS = {
    .name = "glass", .density = 2470, .youngs_modulus = 5e7, .poisson_ratio = .23};
static const dem_pair PAIR = {
    .restitution = .83, .friction = .31, .stiffness = 900, .stiffness_ratio = .7};

static const double LO[3] = {-.2, -.1, -.1}, HI[3] = {.3, .15, .13};

static dem_param periodic_space(void)
{
    dem_param p = dem_param_default();
    memcpy(p.lo, LO, sizeof p.lo);
    memcpy(p.hi, HI, sizeof p.hi);
    for (int a = 0; a < 3; a++) p.periodic[a] = 1;
    p.n_material = 1;
    p.material = &GLASS;
    p.pair = &PAIR;
    return p;
}

static dem_sim *start(const dem_param *p)
{
    dem_sim *sim;
    if (dem_new(MPI_COMM_SELF, p, &sim)) fail_msg("%s", dem_message(sim));
    return sim;
}

static void go(dem_sim *sim, double dt, int substeps)
{
    if (dem_advance(sim, dt, substeps)) fail_msg("%s", dem_message(sim));
}

/* An outlet just inside of one side; particles come to it through the other side, so slowly that no
 * list is made on the way. */
static void outlet_behind_a_side(void **unused)
{
    (void)unused;
    for (int side = 0; side < 6; side++) {
        const int a = side / 2, upper = side % 2;
        double lo[3] = {-1, -1, -1}, hi[3] = {1, 1, 1};
        if (upper)
            lo[a] = HI[a] - .02;
        else
            hi[a] = LO[a] + .02;
        dem_param p = periodic_space();
        dem_outlet o = {"exit", dem_sdf_box(lo, hi, 1), 0, INFINITY};
        p.n_outlet = 1;
        p.outlet = &o;
        p.skin = .8;
        dem_sim *sim = start(&p);
        double x[1][3] = {{.07, .02, -.01}}, v[1][3] = {{0}};
        const double radius = .01;
        const int material = 0;
        x[0][a] = upper ? LO[a] + 1e-3 : HI[a] - 1e-3; /* on the other side of the period */
        v[0][a] = upper ? -.1 : .1;
        assert_int_equal(dem_add(sim, 1, (const double(*)[3])x, (const double(*)[3])v, NULL,
                                 &radius, &material, NULL),
                         DEM_OK);
        int64_t gone;
        double mass;
        go(sim, 8e-3, 4); /* a fifth of a millimetre before the side */
        dem_removed(sim, 0, &gone, &mass);
        assert_int_equal(gone, 0);
        go(sim, 4e-3, 4); /* as much behind it */
        dem_removed(sim, 0, &gone, &mass);
        assert_int_equal(gone, 1);
        assert_near(mass, 4. / 3 * acos(-1.) * 1e-6 * 2470, 1e-15);
        assert_int_equal(dem_particles(sim).n, 0);
        dem_free(sim);
    }
}

/* Distance of two places, over periodic sides. */
static double apart(const double x[3], const double y[3])
{
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        const double length = HI[a] - LO[a], d = x[a] - y[a];
        const double near = d - length * rint(d / length);
        sum += near * near;
    }
    return sqrt(sum);
}

/* Spheres are fed about the corner of the period, where others rest on all sides of it already. */
static void feeder_over_the_corner(void **unused)
{
    (void)unused;
    const double d = .009;
    const dem_species s = {0, {.kind = DEM_SIZE_EQUAL, .mean = d}, 1};
    dem_param p = periodic_space();
    dem_feeder f = {.name = "inlet",
                    .n_species = 1,
                    .species = &s,
                    .mass = INFINITY,
                    .number = 130,
                    .number_rate = 1e7,
                    .end = INFINITY,
                    .seed = 8712};
    for (int a = 0; a < 3; a++) {
        f.lo[a] = HI[a] - .031;
        f.hi[a] = HI[a] + .037;
    }
    f.region = dem_sdf_box(f.lo, f.hi, 1);
    f.angular_velocity[0] = 1.7;
    f.angular_velocity[2] = -.3;
    p.n_feeder = 1;
    p.feeder = &f;
    dem_sim *sim = start(&p);
    enum { RESTING = 8 };
    double x[RESTING][3], radius[RESTING];
    int material[RESTING] = {0};
    for (int i = 0; i < RESTING; i++) {
        radius[i] = .013;
        for (int a = 0; a < 3; a++) x[i][a] = i >> a & 1 ? LO[a] + .0161 : HI[a] - .0149;
    }
    assert_int_equal(
        dem_add(sim, RESTING, (const double(*)[3])x, NULL, NULL, radius, material, NULL), DEM_OK);
    for (int n = 0; n < 20; n++) go(sim, 1e-6, 1);
    const dem_view v = dem_particles(sim);
    assert_true(v.n > RESTING + 40);
    int quarter[8] = {0};
    double nearest = INFINITY;
    for (size_t i = 0; i < v.n; i++) {
        for (int a = 0; a < 3; a++) assert_true(v.x[i][a] >= LO[a] && v.x[i][a] < HI[a]);
        for (size_t j = 0; j < i; j++)
            nearest = fmin(nearest, apart(v.x[i], v.x[j]) / (v.radius[i] + v.radius[j]));
        if (v.radius[i] > d) continue;
        quarter[(v.x[i][0] < .1) + 2 * (v.x[i][1] < 0) + 4 * (v.x[i][2] < 0)]++;
        assert_near(v.omega[i][0], 1.7, 1e-3);
        assert_near(v.omega[i][1], 0, 1e-3);
        assert_near(v.omega[i][2], -.3, 1e-3);
    }
    print_message("%d fed, nearest two at %.6f of the sum of their radii\n", (int)(v.n - RESTING),
                  nearest);
    assert_true(nearest > 1 - 1e-9);
    for (int k = 0; k < 8; k++) assert_true(quarter[k] > 0);
    dem_free(sim);
}

/* What was due before the clock is set stays due, what the jump leaves out is not. */
static void clock_set(void **unused)
{
    (void)unused;
    const dem_species s = {0, {.kind = DEM_SIZE_EQUAL, .mean = .004}, 1};
    const double mass = acos(-1.) / 6 * 64e-9 * 2470;
    for (int by_mass = 0; by_mass < 2; by_mass++) {
        dem_param p = periodic_space();
        dem_feeder f = {.name = "inlet",
                        .n_species = 1,
                        .species = &s,
                        .mass = INFINITY,
                        .number = -1,
                        .number_rate = by_mass ? 0 : 100,
                        .mass_rate = by_mass ? 100 * mass : 0,
                        .end = INFINITY,
                        .seed = 12};
        f.region = dem_sdf_box(LO, HI, 1);
        memcpy(f.lo, LO, sizeof f.lo);
        memcpy(f.hi, HI, sizeof f.hi);
        p.n_feeder = 1;
        p.feeder = &f;
        dem_sim *sim = start(&p);
        go(sim, .505, 0);
        dem_set_time(sim, 3);
        go(sim, .505, 0);
        int64_t fed;
        double sum, waiting;
        dem_fed(sim, 0, &fed, &sum, &waiting);
        assert_near((double)fed, 101, 1);
        assert_near(sum / (double)fed, mass, 1e-12 * mass);
        dem_free(sim);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(outlet_behind_a_side),
                                       cmocka_unit_test(feeder_over_the_corner),
                                       cmocka_unit_test(clock_set)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
