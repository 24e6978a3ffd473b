/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * macCoupled.c - felmiMAC with particles against closed forms and published numbers.
 *
 * One sphere in rising gas, case DEM06 of the MFiX verification manual: table of velocity and
 * position. Fixed bed: Ergun's pressure drop, S. Ergun, Chem. Eng. Prog. 48 (1952) 89, and the
 * pressure drop times area against the sum of the forces on the particles. Explicit drag: its
 * stability limit, and the semi-implicit scheme far beyond it. Settling in a closed periodic box.
 * Particles that must not move are heavy (1e12 kg/m3) and weightless.
 */
#include "coupling.h"

#include <math.h>
#include <mpi.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static const double pi = 3.14159265358979323846;

/* Equal spheres in a box, everything that mac_coupled_new wants. */
typedef struct rig {
    mac_param flow;
    dem_material material;
    dem_pair pair;
    dem_insertion insertion;
    dem_param dem;
    cpl_param coupling;
    double (*x)[3];
    mac_coupled c;
    char message[1024];
} rig;

/* A box of cells with cyclic sides; change it, give the spheres, then build. */
static void rig_box(rig *r, const int n[3], const double h[3])
{
    memset(r, 0, sizeof *r);
    r->flow = mac_param_default();
    r->coupling = cpl_param_default();
    r->dem = dem_param_default();
    for (int d = 0; d < 3; d++) {
        r->flow.n[d] = n[d];
        r->flow.h[d] = h[d];
        r->dem.hi[d] = n[d] * h[d];
    }
    for (int s = 0; s < 6; s++) r->flow.side[s].normal = MAC_CYCLIC;
    r->flow.tolerance = 1e-12;
    r->material = (dem_material){.name = "glass", .density = 1e12};
    r->pair =
        (dem_pair){.restitution = 0.9, .friction = 0.1, .stiffness = 1000, .stiffness_ratio = 1};
}

/* Spheres on a lattice of periods, `base` of them in each at the given fractions of a period. */
static void rig_lattice(rig *r, const int count[3], const double lo[3], double period, int base,
                        const double (*fraction)[3], double diameter)
{
    size_t n = (size_t)count[0] * (size_t)count[1] * (size_t)count[2] * (size_t)base, p = 0;
    r->x = malloc(n * sizeof *r->x);
    assert_non_null(r->x);
    for (int k = 0; k < count[2]; k++)
        for (int j = 0; j < count[1]; j++)
            for (int i = 0; i < count[0]; i++)
                for (int b = 0; b < base; b++, p++) {
                    int at[3] = {i, j, k};
                    for (int d = 0; d < 3; d++)
                        r->x[p][d] = lo[d] + (at[d] + fraction[b][d]) * period;
                }
    r->insertion = (dem_insertion){.name = "lattice",
                                   .kind = DEM_INSERT_LIST,
                                   .n = n,
                                   .x = (const double(*)[3])r->x,
                                   .diameter = diameter};
}

static const double simple_cubic[1][3] = {{0.5, 0.5, 0.5}};
static const double face_centred[4][3] = {
    {0.1, 0.2, 0.3}, {0.6, 0.7, 0.3}, {0.6, 0.2, 0.8}, {0.1, 0.7, 0.8}};

static void rig_build(rig *r)
{
    for (int d = 0; d < 3; d++) r->dem.periodic[d] = r->flow.side[2 * d].normal == MAC_CYCLIC;
    r->dem.law = DEM_LINEAR;
    r->dem.n_material = 1;
    r->dem.material = &r->material;
    r->dem.pair = &r->pair;
    r->dem.n_insertion = 1;
    r->dem.insertion = &r->insertion;
    if (mac_coupled_new(&r->c, &r->flow, &r->dem, &r->coupling, NULL, r->message,
                        sizeof r->message))
        fail_msg("%s", r->message);
}

static void rig_free(rig *r)
{
    mac_coupled_free(&r->c);
    free(r->x);
}

static void advance(rig *r, double dt)
{
    if (mac_coupled_step(&r->c, dt, r->message, sizeof r->message)) fail_msg("%s", r->message);
    double residual = phase_last_report(r->c.particles).ledger_residual;
    if (!(residual < 1e-12)) fail_msg("ledger residual %g", residual);
}

/* ---- one sphere in rising gas ---------------------------------------------------------------- */

static int read_table(const char *name, double (*row)[2], int most)
{
    char path[512], line[128];
    snprintf(path, sizeof path, "%s/tests/verify/data/%s", FELMI_SOURCE_DIR, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    int n = 0;
    while (fgets(line, sizeof line, file))
        if (n < most && sscanf(line, "%lf,%lf", &row[n][0], &row[n][1]) == 2) n++;
    fclose(file);
    return n;
}

static void sphere_in_rising_gas(void **state)
{
    (void)state;
    const int n[3] = {5, 5, 5}, one[3] = {1, 1, 1};
    const double h[3] = {0.02, 0.02, 0.02}, lo[3] = {0.04, 0.04, 0.0825};
    rig r;
    rig_box(&r, n, h);
    for (int s = 0; s < 6; s++) r.flow.side[s].normal = MAC_PRESCRIBED;
    r.flow.side[4].velocity[2] = 0.40;
    r.flow.side[5].normal = MAC_OPEN;
    r.flow.rho = 1.2;
    r.flow.mu = 1.8e-5;
    r.flow.gravity[2] = r.dem.gravity[2] = -9.80665;
    r.material.density = 2000;
    r.pair.stiffness = 0.1; /* no contact here; keeps the sub-steps few */
    r.coupling.drag = CPL_SCHILLER_NAUMANN;
    rig_lattice(&r, one, lo, 0.02, 1, simple_cubic, 1e-4);
    rig_build(&r);
    double(*gas)[3] = calloc(r.c.cells, sizeof *gas);
    for (size_t c = 0; c < r.c.cells; c++) gas[c][2] = 0.40;
    mac_start(r.c.fluid, (const double(*)[3])gas);
    free(gas);
    double v[64][2], x[64][2], worst_v = 0, worst_x = 0;
    int rows = read_table("mfix_dem06_vel.csv", v, 64);
    assert_int_equal(read_table("mfix_dem06_pos.csv", x, 64), rows);
    assert_true(rows > 30);
    for (int i = 1; i < rows; i++) {
        for (int s = 0; s < 40; s++) advance(&r, 2.5e-4);
        dem_view p = dem_particles(phase_engine(r.c.particles));
        worst_v = fmax(worst_v, fabs(p.v[0][2] / v[i][1] - 1));
        worst_x = fmax(worst_x, fabs(p.x[0][2] / x[i][1] - 1));
    }
    print_message("DEM06: velocity within %.3f %%, position within %.3f %% of the table\n",
                  100 * worst_v, 100 * worst_x);
    rig_free(&r);
    assert_true(worst_v < 5e-3);
    assert_true(worst_x < 5e-3);
}

/* ---- fixed bed ------------------------------------------------------------------------------- */

static double sum_of_forces(const rig *r, int d)
{
    size_t n = dem_particles(phase_engine(r->c.particles)).n;
    double sum = 0;
    for (size_t p = 0; p < n; p++) sum += phase_force(r->c.particles)[p][d];
    return sum;
}

/* Bed of 2.4 mm spheres, 8 x 8 x 24 on a lattice, two of them to a cell along each axis, between
 * empty ends; superficial velocity q upward. */
static void fixed_bed_at(double q)
{
    const int n[3] = {4, 4, 20}, count[3] = {8, 8, 24};
    const double h[3] = {0.005, 0.005, 0.005}, lo[3] = {0, 0, 0.02};
    const double spacing = 0.0025, d = 0.0024, rho = 1.2, mu = 1.8e-5;
    rig r;
    rig_box(&r, n, h);
    for (int s = 0; s < 6; s++) r.flow.side[s].normal = MAC_PRESCRIBED;
    r.flow.side[4].velocity[2] = q;
    r.flow.side[4].superficial = 1;
    r.flow.side[5].normal = MAC_OPEN;
    r.flow.rho = rho;
    r.flow.mu = mu;
    rig_lattice(&r, count, lo, spacing, 1, simple_cubic, d);
    rig_build(&r);
    double step = 0.4 * h[2] / (2.5 * q);
    for (int t = 0; t < 200; t++) advance(&r, step);
    const mac *m = r.c.fluid;
    double area = 16 * h[0] * h[1], length = 24 * spacing;
    double eps = 1 - 8 * 8 * 24 * pi / 6 * d * d * d / (area * length);
    double drop = mac_side_pressure(m, 4) - mac_side_pressure(m, 5);
    double ergun = length * (150 * pow(1 - eps, 2) / pow(eps, 3) * mu * q / (d * d) +
                             1.75 * (1 - eps) / pow(eps, 3) * rho * q * q / d);
    double force = sum_of_forces(&r, 2);
    print_message(
        "Fixed bed %.3g m/s, eps %.4f: drop %.8g Pa, Ergun %.8g (%+.3f %%); dp A over sum "
        "of forces - 1: %.1e\n",
        q, eps, drop, ergun, 100 * (drop / ergun - 1), drop * area / force - 1);
    rig_free(&r);
    assert_true(fabs(drop / ergun - 1) < 5e-3);
    assert_true(fabs(drop * area / force - 1) < 1e-9);
}

static void fixed_bed(void **state)
{
    (void)state;
    const double q[4] = {0.0731, 0.237, 0.713, 1.91};
    for (int i = 0; i < 4; i++) fixed_bed_at(q[i]);
}

/* ---- stability of the drag ------------------------------------------------------------------- */

/* A periodic bed of fixed spheres, fluid driven by its weight. The velocity starts 1 % off its
 * balance; how much of that is left after `steps` of `times` the explicit limit. */
static double disturbance_left(cpl_scheme scheme, double times, int steps)
{
    const int n[3] = {3, 2, 4}, count[3] = {6, 4, 8};
    const double h[3] = {0.005, 0.005, 0.005}, zero[3] = {0, 0, 0};
    const double spacing = 0.0025, d = 0.0024, rho = 1.2, mu = 1.8e-5, u = 0.83;
    double eps = 1 - 8 * pi / 6 * d * d * d / (h[0] * h[1] * h[2]);
    double kappa = cpl_drag(CPL_ERGUN_WEN_YU, eps, u, d, rho, mu);
    double K = kappa * 8 / (h[0] * h[1] * h[2]);
    /* twice the inertia over the slope of the drag, 2 rho eps/(d(K u)/du), of Ergun */
    double limit =
        d * d * rho * eps * eps / ((1 - eps) * (75 * (1 - eps) * mu + 1.75 * rho * eps * u * d));
    rig r;
    rig_box(&r, n, h);
    r.flow.rho = rho;
    r.flow.mu = mu;
    r.flow.gravity[0] = K * u / (eps * rho);
    r.coupling.scheme = scheme;
    rig_lattice(&r, count, zero, spacing, 1, simple_cubic, d);
    rig_build(&r);
    double(*start)[3] = calloc(r.c.cells, sizeof *start);
    for (size_t c = 0; c < r.c.cells; c++) start[c][0] = 1.01 * u;
    mac_start(r.c.fluid, (const double(*)[3])start);
    free(start);
    for (int t = 0; t < steps; t++) advance(&r, times * limit);
    double left = fabs(r.c.fluid->u[0][mac_at(&r.c.fluid->grid, 2, 2, 3)] / u - 1) / 0.01;
    rig_free(&r);
    return left;
}

static void stability_of_drag(void **state)
{
    (void)state;
    double below = disturbance_left(CPL_EXPLICIT, 0.95, 30);
    double above = disturbance_left(CPL_EXPLICIT, 1.05, 30);
    double implicit = disturbance_left(CPL_SEMI_IMPLICIT, 1000, 200);
    print_message("Drag: 1 %% off balance becomes %.3g, %.3g and %.3g %% (explicit at .95 and 1.05 "
                  "of its limit, semi-implicit at 1000)\n",
                  below, above, implicit);
    assert_true(below < 0.2);
    assert_true(above > 3);
    assert_true(implicit < 0.2);
}

/* ---- settling in a closed periodic box ------------------------------------------------------- */

typedef struct mixture {
    const char *name;
    double rho, mu, density, d;
} mixture;

/* Slip at which kappa(s) s = eps (rho_p - rho) V g. */
static double steady_slip(const mixture *x, cpl_drag_law law, double eps)
{
    double weight = eps * (x->density - x->rho) * pi / 6 * pow(x->d, 3) * 9.81, lo = 0, hi = 10;
    for (int i = 0; i < 200; i++) {
        double s = 0.5 * (lo + hi);
        if (cpl_drag(law, eps, s, x->d, x->rho, x->mu) * s > weight)
            hi = s;
        else
            lo = s;
    }
    return lo;
}

/* The box has several cells where the step allows it: both phases move through the mesh, and beyond
 * the limits of explicit convection and viscosity what rounding leaves of the symmetry would grow.
 * One cell has nothing to convect and takes any step. */
static void settle(const mixture *x, double eps, double stiffness)
{
    cpl_drag_law law = eps < 0.5 ? CPL_ERGUN_WEN_YU : CPL_DI_FELICE;
    double slip = steady_slip(x, law, eps), mass = x->density * pi / 6 * pow(x->d, 3);
    double kappa = cpl_drag(law, eps, slip, x->d, x->rho, x->mu), dt = stiffness * mass / kappa;
    double period = x->d * cbrt(4 * pi / 6 / (1 - eps));
    double viscous = x->rho * period * period / (12 * x->mu); /* limit of mac_limits */
    int many = slip * dt < 0.5 * period && dt < 0.5 * viscous;
    const int n[3] = {many ? 2 : 1, many ? 2 : 1, many ? 3 : 1};
    const int count[3] = {2, 2, many ? 3 : 2};
    const double zero[3] = {0, 0, 0}, across = many ? period : 2 * period;
    const double h[3] = {across, across, across};
    rig r;
    rig_box(&r, n, h);
    r.flow.rho = x->rho;
    r.flow.mu = x->mu;
    r.flow.gravity[2] = r.dem.gravity[2] = -9.81;
    for (int d = 0; d < 3; d++) r.flow.hold_flux[d] = 1;
    r.material.density = x->density;
    r.pair.stiffness = mass * pow(6 * 2 * pi / (20 * dt), 2); /* about six sub-steps */
    r.coupling.drag = law;
    rig_lattice(&r, count, zero, period, 4, face_centred, x->d);
    rig_build(&r);
    int steps = stiffness < 0.1 ? 900 : 100;
    double early = 0, late = 0, found = 0;
    for (int t = 0; t < steps; t++) {
        advance(&r, dt);
        const mac_grid *g = &r.c.fluid->grid;
        found = r.c.fluid->u[2][mac_at(g, 1, 1, 1)] - phase_Us(r.c.particles)[0][2];
        double error = fabs(found / slip - 1);
        if (t < steps / 2)
            early = fmax(early, error);
        else
            late = fmax(late, error);
    }
    print_message(
        "%-8s eps %.1f  k dt/m %-5g %2d cells, slip %.6g (%.6g), error %.1e early, %.1e late\n",
        x->name, eps, stiffness, (int)r.c.cells, found, slip, early, late);
    rig_free(&r);
    assert_true(late <= early);
    assert_true(fabs(found / slip - 1) < 1e-3);
}

static void settling(void **state)
{
    (void)state;
    static const mixture mixtures[3] = {{"gas", 1.2, 1.8e-5, 2400, 1.3e-4},
                                        {"water", 1000, 1e-3, 2600, 7e-4},
                                        {"buoyant", 1000, 1e-3, 1100, 9e-4}};
    const double stiffness[3] = {0.01, 1, 100};
    for (int x = 0; x < 3; x++)
        for (int e = 0; e < 2; e++)
            for (int s = 0; s < 3; s++) settle(&mixtures[x], e ? 0.8 : 0.4, stiffness[s]);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_in_rising_gas),
        cmocka_unit_test(fixed_bed),
        cmocka_unit_test(stability_of_drag),
        cmocka_unit_test(settling),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
