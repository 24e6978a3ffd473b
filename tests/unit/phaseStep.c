/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phaseStep.c - the particle phase: sources for the fluid, forces on particles, books and report.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <cmocka.h>

#include "near.h"
#include "phaseBox.h"

enum { CELLS = 8 };

static phase_box glass_in_air(void)
{
    return (phase_box){.eps = .62,
                       .d = 1.3e-3,
                       .density = 2520,
                       .rho = 1.19,
                       .mu = 1.82e-5,
                       .gravity = {0, 0, -9.81},
                       .velocity = {.21, -.13, .34},
                       .stiffness = 40,
                       .cells = {2, 2, 2},
                       .coupling = cpl_param_default()};
}

static void random_fields(double u[CELLS][3], double gradient[CELLS][3])
{
    srand(2385);
    for (int c = 0; c < CELLS; c++)
        for (int a = 0; a < 3; a++) {
            u[c][a] = 2. * rand() / RAND_MAX - .7;
            gradient[c][a] = 9e3 * rand() / RAND_MAX - 2e3;
        }
}

/* What a fluid with these fields loses, N. */
static void fluid_loses(const phase_box *b, const double u[CELLS][3],
                        const double gradient[CELLS][3], double drag[3], double pressure[3])
{
    const double *K = phase_K(b->phase), *eps = phase_voidage(b->phase);
    const double(*S)[3] = phase_S(b->phase);
    for (int a = 0; a < 3; a++) {
        drag[a] = pressure[a] = 0;
        for (int c = 0; c < CELLS; c++) {
            drag[a] += (K[c] * u[c][a] - S[c][a]) * b->mesh.volume[c];
            pressure[a] -= (1 - eps[c]) * gradient[c][a] * b->mesh.volume[c];
        }
    }
}

/* In a uniform lattice the sources are those of a mean particle: K = n kappa, S = K v. */
static void sources(void **unused)
{
    (void)unused;
    phase_box b = glass_in_air();
    assert_int_equal(phase_box_new(&b), 0);
    assert_int_equal(phase_advance(b.phase, 1e-5), 0);
    double U[CELLS][3];
    for (int c = 0; c < CELLS; c++) U[c][0] = 1.7, U[c][1] = -.4, U[c][2] = .9;
    assert_int_equal(phase_drag(b.phase, (const double(*)[3])U), 0);
    const dem_view p = dem_particles(phase_engine(b.phase));
    const double slip =
        sqrt(pow(1.7 - p.v[0][0], 2) + pow(-.4 - p.v[0][1], 2) + pow(.9 - p.v[0][2], 2));
    const double pi = 3.14159265358979323846, V = pi / 6 * pow(b.d, 3);
    const double K = (1 - b.eps) / V * cpl_drag(CPL_ERGUN_WEN_YU, b.eps, slip, b.d, b.rho, b.mu);
    for (int c = 0; c < CELLS; c++) {
        assert_near(phase_voidage(b.phase)[c], b.eps, 1e-12);
        assert_near(phase_voidage_before(b.phase)[c], b.eps, 1e-12);
        assert_near(phase_K(b.phase)[c] / K, 1, 1e-11);
        for (int a = 0; a < 3; a++) {
            assert_near(phase_S(b.phase)[c][a], K * p.v[0][a], 1e-11 * K);
            assert_near(phase_Us(b.phase)[c][a], p.v[0][a], 1e-12);
        }
    }
    assert_near(phase_last_report(b.phase).stiffness, K * 1e-5 / (b.rho * b.eps), 1e-9 * K);
    phase_box_free(&b);
}

/* Forces on the particles sum to what the cells lost; the books see a loss of 1e-6. */
static void exchange(void **unused)
{
    (void)unused;
    for (cpl_scheme scheme = CPL_SEMI_IMPLICIT; scheme <= CPL_EXPLICIT; scheme++) {
        phase_box b = glass_in_air();
        b.coupling.scheme = scheme;
        assert_int_equal(phase_box_new(&b), 0);
        double u[CELLS][3], gradient[CELLS][3], drag[3], pressure[3];
        random_fields(u, gradient);
        for (int step = 0; step < 3; step++) {
            assert_int_equal(phase_advance(b.phase, 1e-5), 0);
            assert_int_equal(phase_drag(b.phase, (const double(*)[3])u), 0);
            if (scheme == CPL_EXPLICIT)
                for (int c = 0; c < CELLS; c++) assert_true(phase_K(b.phase)[c] == 0);
            fluid_loses(&b, (const double(*)[3])u, (const double(*)[3])gradient, drag, pressure);
            if (step == 2) drag[1] *= 1 + 1e-4;
            const int status = phase_settle(b.phase, (const double(*)[3])u,
                                            (const double(*)[3])gradient, NULL, drag, pressure);
            if (step == 2) {
                assert_int_equal(status, DEM_IO + CPL_IMBALANCE);
                assert_non_null(strstr(phase_message(b.phase), "balance of exchange"));
                break;
            }
            assert_int_equal(status, 0);
            assert_true(phase_last_report(b.phase).ledger_residual < 1e-13);
            double sum[3] = {0}, size = 0;
            for (int i = 0; i < PHASE_BOX_N; i++)
                for (int a = 0; a < 3; a++) {
                    sum[a] += phase_force(b.phase)[i][a];
                    size += fabs(phase_force(b.phase)[i][a]);
                }
            for (int a = 0; a < 3; a++) assert_near(sum[a], drag[a] + pressure[a], 1e-13 * size);
        }
        phase_box_free(&b);
    }
}

/* The force of a particle when the solver's interpolation does not return unity. */
static void tensor(void **unused)
{
    (void)unused;
    phase_box b = glass_in_air();
    b.coupling.ledger_tolerance = 1e30; /* the books know nothing of this made-up solver */
    assert_int_equal(phase_box_new(&b), 0);
    assert_int_equal(phase_advance(b.phase, 1e-5), 0);
    double U[CELLS][3], still[CELLS][3] = {{0}}, T[CELLS][9];
    const double t[9] = {.9, .02, 0, -.03, 1.1, .05, 0, .04, 1.2};
    for (int c = 0; c < CELLS; c++) {
        U[c][0] = 1.7, U[c][1] = -.4, U[c][2] = .9;
        memcpy(T[c], t, sizeof t);
    }
    assert_int_equal(phase_drag(b.phase, (const double(*)[3])U), 0);
    const double *K = phase_K(b.phase);
    const double kappa = K[0] * b.mesh.volume[0] * CELLS / PHASE_BOX_N;
    assert_int_equal(phase_settle(b.phase, (const double(*)[3])U, (const double(*)[3])still,
                                  (const double(*)[9])T, still[0], still[0]),
                     0);
    const dem_view p = dem_particles(phase_engine(b.phase));
    for (int a = 0; a < 3; a++) {
        const double seen =
            t[3 * a] * p.v[5][0] + t[3 * a + 1] * p.v[5][1] + t[3 * a + 2] * p.v[5][2];
        assert_near(phase_force(b.phase)[5][a] / kappa, U[0][a] - seen, 1e-11);
    }
    phase_box_free(&b);
}

/* A particle added in mid-run has met no fluid yet and must do no harm. */
static void newcomer(void **unused)
{
    (void)unused;
    phase_box b = glass_in_air();
    assert_int_equal(phase_box_new(&b), 0);
    double u[CELLS][3], gradient[CELLS][3], drag[3], pressure[3];
    random_fields(u, gradient);
    for (int step = 0; step < 4; step++) {
        if (step == 2) {
            const double x[1][3] = {{.35 * b.period, .45 * b.period, .8 * b.period}};
            const double radius = .1 * b.d;
            const int material = 0;
            assert_int_equal(
                dem_add(phase_engine(b.phase), 1, x, NULL, NULL, &radius, &material, NULL), DEM_OK);
        }
        assert_int_equal(phase_advance(b.phase, 1e-6), 0);
        assert_int_equal(phase_drag(b.phase, (const double(*)[3])u), 0);
        fluid_loses(&b, (const double(*)[3])u, (const double(*)[3])gradient, drag, pressure);
        assert_int_equal(phase_settle(b.phase, (const double(*)[3])u, (const double(*)[3])gradient,
                                      NULL, drag, pressure),
                         0);
        assert_true(phase_last_report(b.phase).ledger_residual < 1e-12);
    }
    assert_int_equal(phase_last_report(b.phase).dem.particles, PHASE_BOX_N + 1);
    phase_box_free(&b);
}

/* Particles come and go while the box falls through a shower of fluid velocities: the books close
 * every step, in gas and in liquid, down to an empty box; nobody is thrown about. */
static void feeder_and_outlet(void **unused)
{
    (void)unused;
    for (int liquid = 0; liquid < 2; liquid++) {
        phase_box b = glass_in_air();
        if (liquid) b.rho = 998, b.mu = 1e-3;
        const double side = PERIODS * b.d * cbrt(4 * 3.14159265358979323846 / 6 / (1 - b.eps));
        const double low[3] = {0, 0, .7 * side}, top[3] = {side, side, side};
        const double floor[3] = {side, side, .3 * side}, zero[3] = {0, 0, 0};
        dem_species s = {0, {.kind = DEM_SIZE_UNIFORM, .lo = .3e-3, .hi = .7e-3}, 1};
        dem_feeder f = {.name = "inlet",
                        .n_species = 1,
                        .species = &s,
                        .number_rate = 3e4,
                        .begin = .0013,
                        .end = .006,
                        .mass = INFINITY,
                        .number = -1,
                        .seed = 3};
        f.region = dem_sdf_box(low, top, 1);
        memcpy(f.lo, low, sizeof low);
        memcpy(f.hi, top, sizeof top);
        f.velocity[2] = -.37;
        const dem_outlet o = {"exit", dem_sdf_box(zero, floor, 1), .0004, INFINITY};
        b.feeder = &f;
        b.outlet = &o;
        b.velocity[2] = -1.3;
        assert_int_equal(phase_box_new(&b), 0);
        double u[CELLS][3], gradient[CELLS][3] = {{0}}, drag[3], pressure[3], fastest = 0;
        random_fields(u, gradient);
        for (int c = 0; c < CELLS; c++) u[c][2] = -.2, memset(gradient[c], 0, sizeof *gradient);
        int64_t fed, removed;
        double mass, waiting;
        for (int step = 0; step < 400; step++) {
            const int status = phase_advance(b.phase, 1e-4);
            if (status) fail_msg("%s", phase_message(b.phase));
            assert_int_equal(phase_drag(b.phase, (const double(*)[3])u), 0);
            fluid_loses(&b, (const double(*)[3])u, (const double(*)[3])gradient, drag, pressure);
            const int settled = phase_settle(b.phase, (const double(*)[3])u,
                                             (const double(*)[3])gradient, NULL, drag, pressure);
            if (settled) fail_msg("%s", phase_message(b.phase));
            assert_true(phase_last_report(b.phase).ledger_residual < 1e-12);
            const dem_report r = phase_last_report(b.phase).dem;
            fastest = fmax(fastest, r.speed);
        }
        dem_fed(phase_engine(b.phase), 0, &fed, &mass, &waiting);
        dem_removed(phase_engine(b.phase), 0, &removed, &mass);
        assert_in_range(fed, 130, 142);
        assert_int_equal(phase_last_report(b.phase).dem.particles, PHASE_BOX_N + fed - removed);
        assert_int_equal(removed, PHASE_BOX_N + fed);
        assert_true(fastest < 1.6);
        phase_box_free(&b);
    }
}

/* Mean height is that of the lattice; gravity may point along any axis. */
static void height_and_log(void **unused)
{
    (void)unused;
    phase_box b = glass_in_air();
    memset(b.velocity, 0, sizeof b.velocity);
    b.gravity[2] = 0, b.gravity[0] = 9.81; /* down is +x */
    assert_int_equal(phase_box_new(&b), 0);
    double still[CELLS][3] = {{0}}, drag[3], pressure[3];
    assert_int_equal(phase_advance(b.phase, 1e-6), 0);
    assert_int_equal(phase_drag(b.phase, (const double(*)[3])still), 0);
    fluid_loses(&b, (const double(*)[3])still, (const double(*)[3])still, drag, pressure);
    assert_int_equal(phase_settle(b.phase, (const double(*)[3])still, (const double(*)[3])still,
                                  NULL, drag, pressure),
                     0);
    double mean = 0;
    for (int i = 0; i < PHASE_BOX_N; i++) mean += b.x[i][0] / PHASE_BOX_N;
    assert_near(phase_last_report(b.phase).height, 2 * (PERIODS * b.period - mean), 1e-9);
    char line[512];
    const int length = phase_log(b.phase, line, sizeof line, .0125, 1.0125, .31, .022, 2, .0025);
    assert_int_equal(length, (int)strlen(line));
    assert_non_null(strstr(line, "Time = 0.0125"));
    assert_non_null(strstr(line, "eps 0.620..0.620"));
    assert_non_null(strstr(line, "Co 0.31"));
    assert_non_null(strstr(line, "fluid 22.0 ms]"));
    assert_non_null(strstr(line, "left 0:03:20")); /* 2 s for .01 s, 1 s to go */
    phase_box_free(&b);
}

static void refuses(void **unused)
{
    (void)unused;
    phase_box b = glass_in_air();
    b.rho = 0;
    assert_int_not_equal(phase_box_new(&b), 0);
    assert_non_null(strstr(phase_message(b.phase), "density and viscosity"));
    phase_box_free(&b);
    b = glass_in_air();
    b.coupling.carry_gain = 1.2;
    assert_int_not_equal(phase_box_new(&b), 0);
    assert_non_null(strstr(phase_message(b.phase), "carry gain is 1.2"));
    phase_box_free(&b);
    b = glass_in_air();
    b.coupling.packing_limit = .3; /* less than the lattice holds */
    assert_int_equal(phase_box_new(&b), DEM_IO + CPL_FULL);
    phase_box_free(&b);
    b = glass_in_air();
    assert_int_equal(phase_box_new(&b), 0);
    assert_int_not_equal(phase_advance(b.phase, 0), 0);
    assert_non_null(strstr(phase_message(b.phase), "time step"));
    phase_box_free(&b);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sources),
        cmocka_unit_test(exchange),
        cmocka_unit_test(tensor),
        cmocka_unit_test(newcomer),
        cmocka_unit_test(feeder_and_outlet),
        cmocka_unit_test(height_and_log),
        cmocka_unit_test(refuses),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
