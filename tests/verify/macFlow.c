/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * macFlow.c - felmiMAC without particles against closed forms and published numbers.
 *
 * Channel flow between resting walls (Poiseuille) and with a moving wall (Couette with pressure
 * gradient): u = -G/(2 mu) y (H - y) + U y/H. Taylor-Green vortices in a periodic box: energy
 * exp(-4 nu t). Lid-driven cavity at Re 100: U. Ghia, K. N. Ghia & C. T. Shin, J. Comput. Phys. 48
 * (1982) 387, doi:10.1016/0021-9991(82)90058-4. Hydrostatics.
 */
#include "mac.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>

static const double pi = 3.14159265358979323846;

static mac_param box(int nx, int ny, int nz, double lx, double ly, double lz)
{
    mac_param p = mac_param_default();
    int n[3] = {nx, ny, nz};
    double l[3] = {lx, ly, lz};
    for (int d = 0; d < 3; d++) {
        p.n[d] = n[d];
        p.h[d] = l[d] / n[d];
    }
    return p;
}

static void all_sides(mac_param *p, mac_normal normal, mac_tangent tangent)
{
    for (int s = 0; s < 6; s++) {
        p->side[s].normal = normal;
        p->side[s].tangent = tangent;
    }
}

static void step(mac *m, double dt)
{
    if (mac_step(m, dt)) fail_msg("%s", m->message);
}

/* ---- channel --------------------------------------------------------------------------------- */

/* L2 error of the steady profile over that of the profile itself; dp over the length .2 m. */
static double channel_error(int ny, double dp, double wall_speed, double *largest)
{
    const double L = 0.2, H = 0.01, mu = 1e-3;
    mac_param p = box(4, ny, 1, L, H, 0.01);
    all_sides(&p, MAC_PRESCRIBED, MAC_FREE);
    p.side[0].normal = p.side[1].normal = MAC_OPEN;
    p.side[0].pressure = dp;
    p.side[2].tangent = p.side[3].tangent = MAC_FIXED;
    p.side[3].velocity[0] = wall_speed;
    p.mu = mu;
    p.convection = MAC_CENTRAL;
    mac *m = mac_new(&p);
    assert_non_null(m);
    double h = p.h[1], dt = 0.2 * h * h / mu, end = 0.25; /* decay exp(-pi^2 nu t/H^2) = 2e-11 */
    for (double t = 0; t < end; t += dt) step(m, dt);
    double error = 0, norm = 0;
    *largest = 0;
    for (int j = 1; j <= ny; j++) {
        double y = (j - 0.5) * h, u = m->u[0][mac_at(&m->grid, 3, j, 1)];
        double exact = dp / L / (2 * mu) * y * (H - y) + wall_speed * y / H;
        error += (u - exact) * (u - exact);
        norm += exact * exact;
        *largest = fmax(*largest, u);
    }
    mac_free(m);
    return sqrt(error / norm);
}

static void poiseuille(void **state)
{
    (void)state;
    double umax, coarse = channel_error(10, 240, 0, &umax), fine = channel_error(20, 240, 0, &umax);
    print_message("Poiseuille: L2 errors %.4e %.4e, ratio %.4f, largest u %.4f m/s\n", coarse, fine,
                  coarse / fine, umax);
    assert_true(fabs(coarse / fine - 4) < 0.05);
    assert_true(fabs(umax / 15 - 1) < 5e-3);
}

static void couette(void **state)
{
    (void)state;
    double umax, coarse = channel_error(8, -37.3, 1.7, &umax),
                 fine = channel_error(16, -37.3, 1.7, &umax);
    print_message("Couette with pressure gradient: L2 errors %.4e %.4e, ratio %.4f\n", coarse, fine,
                  coarse / fine);
    assert_true(fabs(coarse / fine - 4) < 0.05);
    assert_true(fine < 1e-2);
}

/* ---- Taylor-Green ---------------------------------------------------------------------------- */

/* L2 error of the velocity at time `end`; energy ratio to the start. */
static double taylor_green(int n, double nu, double end, double *energy)
{
    mac_param p = box(n, n, 1, 2 * pi, 2 * pi, 1);
    all_sides(&p, MAC_CYCLIC, MAC_FREE);
    p.mu = nu;
    p.convection = MAC_CENTRAL;
    p.tolerance = 1e-11;
    mac *m = mac_new(&p);
    assert_non_null(m);
    double h = p.h[0], start = 0;
    for (int j = 1; j <= n; j++)
        for (int i = 1; i <= n; i++) {
            size_t q = mac_at(&m->grid, i, j, 1);
            m->u[0][q] = cos((i - 1) * h) * sin((j - 0.5) * h);
            m->u[1][q] = -sin((i - 0.5) * h) * cos((j - 1) * h);
            start += m->u[0][q] * m->u[0][q] + m->u[1][q] * m->u[1][q];
        }
    int steps = (int)(end / (0.02 * h * h)) + 1; /* the time error, of first order, goes as h2 */
    double dt = end / steps, error = 0, finish = 0;
    for (int t = 0; t < steps; t++) step(m, dt);
    double decay = exp(-2 * nu * end);
    for (int j = 1; j <= n; j++)
        for (int i = 1; i <= n; i++) {
            size_t q = mac_at(&m->grid, i, j, 1);
            double u = cos((i - 1) * h) * sin((j - 0.5) * h) * decay;
            double v = -sin((i - 0.5) * h) * cos((j - 1) * h) * decay;
            error += pow(m->u[0][q] - u, 2) + pow(m->u[1][q] - v, 2);
            finish += m->u[0][q] * m->u[0][q] + m->u[1][q] * m->u[1][q];
        }
    *energy = finish / start;
    mac_free(m);
    return sqrt(error / (2 * n * n));
}

static void taylor_green_vortices(void **state)
{
    (void)state;
    const double nu = 0.137, end = 0.83;
    double e16, e32, coarse = taylor_green(16, nu, end, &e16),
                     fine = taylor_green(32, nu, end, &e32);
    double exact = exp(-4 * nu * end);
    print_message("Taylor-Green: L2 errors %.4e %.4e, ratio %.4f; energy %.6f, exact %.6f\n",
                  coarse, fine, coarse / fine, e32, exact);
    assert_true(coarse / fine > 3.8 && coarse / fine < 4.3);
    assert_true(fabs(e32 / exact - 1) < 3e-3);
}

/* ---- limits ---------------------------------------------------------------------------------- */

/* One thin layer of cells between two walls, h across: the shear of both walls slows a layer at the
 * rate 4 nu/h^2, and at the announced limit that decays instead of growing. */
static void layer_between_walls(void **state)
{
    (void)state;
    const double h = 0.0021, u0 = 0.37;
    mac_param p = box(6, 1, 5, 0.07, h, 0.06);
    all_sides(&p, MAC_CYCLIC, MAC_FREE);
    p.side[2].normal = p.side[3].normal = MAC_PRESCRIBED;
    p.side[2].tangent = p.side[3].tangent = MAC_FIXED;
    p.mu = 0.0137;
    mac *m = mac_new(&p);
    assert_non_null(m);
    double U[30][3] = {{0}}, convective, viscous;
    for (int c = 0; c < 30; c++) U[c][0] = u0;
    mac_start(m, (const double(*)[3])U);
    mac_limits(m, &convective, &viscous);
    const double exact = h * h * m->param.rho / (2 * p.mu); /* beyond it the layer oscillates up */
    print_message("layer between walls: viscous limit %.4e s, growth beyond %.4e s\n", viscous,
                  exact);
    assert_true(viscous < exact);
    for (int i = 0; i < 100; i++) step(m, 0.99 * viscous);
    assert_true(fabs(m->u[0][mac_at(&m->grid, 3, 1, 3)]) < 1e-9 * u0);
    mac_free(m);
}

/* ---- lid-driven cavity ----------------------------------------------------------------------- */

static int read_profile(const char *name, double (*row)[2], int most)
{
    char path[512];
    snprintf(path, sizeof path, "%s/tests/verify/data/%s", FELMI_SOURCE_DIR, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    int n = 0;
    char line[128];
    while (fgets(line, sizeof line, file))
        if (n < most && sscanf(line, "%lf,%lf", &row[n][0], &row[n][1]) == 2) n++;
    fclose(file);
    return n;
}

/* Largest difference to the table, over the speed of the lid. c: component, along the mid line. */
static double compare(const mac *m, const char *name, int c)
{
    const mac_grid *g = &m->grid;
    double row[32][2], worst = 0;
    int n = read_profile(name, row, 32), d = 1 - c, mid = g->n[c] / 2 + 1;
    assert_true(n > 10);
    for (int r = 0; r < n; r++) {
        double at = row[r][0] / g->h[d] + 0.5; /* in cell indices */
        int low = (int)at;
        double w = at - low, value[2];
        for (int s = 0; s < 2; s++) {
            int i[3] = {0, 0, 1};
            i[c] = mid;
            i[d] = low + s;
            value[s] = m->u[c][mac_at(g, i[0], i[1], i[2])];
        }
        worst = fmax(worst, fabs((1 - w) * value[0] + w * value[1] - row[r][1]));
    }
    return worst;
}

static void lid_driven_cavity(void **state)
{
    (void)state;
    mac_param p = box(64, 64, 1, 1, 1, 1);
    all_sides(&p, MAC_PRESCRIBED, MAC_FIXED);
    p.side[4].tangent = p.side[5].tangent = MAC_FREE;
    p.side[3].velocity[0] = 1;
    p.mu = 0.01;
    mac *m = mac_new(&p);
    assert_non_null(m);
    double dt = 5e-3, change = 1;
    int steps = 0;
    double *before = malloc(m->grid.size * sizeof *before);
    while (change > 1e-6 && steps < 6000) {
        for (size_t q = 0; q < m->grid.size; q++) before[q] = m->u[0][q];
        step(m, dt);
        change = 0;
        for (size_t q = 0; q < m->grid.size; q++)
            change = fmax(change, fabs(m->u[0][q] - before[q]) / dt);
        steps++;
        if (steps * dt < 5) change = 1;
    }
    free(before);
    double u = compare(m, "ghia_u_Re100.csv", 0), v = compare(m, "ghia_v_Re100.csv", 1);
    print_message("Cavity Re 100, 64 x 64: %d steps, largest difference to Ghia u %.4f v %.4f\n",
                  steps, u, v);
    mac_free(m);
    assert_true(change <= 1e-6);
    assert_true(u < 0.01 && v < 0.01);
}

/* ---- at rest --------------------------------------------------------------------------------- */

static void hydrostatics(void **state)
{
    (void)state;
    mac_param p = box(3, 5, 17, 0.03, 0.05, 0.34);
    all_sides(&p, MAC_PRESCRIBED, MAC_FIXED);
    p.side[5].normal = MAC_OPEN;
    p.side[5].tangent = MAC_INFLOW_FIXED;
    p.side[5].pressure = 311.7;
    p.rho = 998.2;
    p.mu = 1e-3;
    p.gravity[2] = -9.81;
    p.tolerance = 1e-13;
    mac *m = mac_new(&p);
    assert_non_null(m);
    double eps[3 * 5 * 17];
    for (int c = 0; c < 3 * 5 * 17; c++) eps[c] = 0.4 + 0.6 * ((c * 7919) % 101) / 101.0;
    mac_set_cells(m, eps, 1, &m->eps);
    mac_set_cells(m, eps, 1, &m->eps_old);
    for (int t = 0; t < 3; t++) step(m, 0.0123);
    double speed = 0, error = 0;
    for (int k = 1; k <= 17; k++)
        for (int j = 1; j <= 5; j++)
            for (int i = 1; i <= 3; i++) {
                size_t q = mac_at(&m->grid, i, j, k);
                double exact = 311.7 + 998.2 * 9.81 * (0.34 - (k - 0.5) * 0.02);
                for (int d = 0; d < 3; d++) speed = fmax(speed, fabs(m->u[d][q]));
                error = fmax(error, fabs(m->p[q] / exact - 1));
            }
    double bottom = mac_side_pressure(m, 4) / (311.7 + 998.2 * 9.81 * 0.34) - 1;
    print_message("Hydrostatics: largest speed %.2e m/s, pressure error %.2e, at the bottom %.2e\n",
                  speed, error, bottom);
    mac_free(m);
    assert_true(speed < 1e-11);
    assert_true(error < 1e-12);
    assert_true(fabs(bottom) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(poiseuille),
        cmocka_unit_test(couette),
        cmocka_unit_test(taylor_green_vortices),
        cmocka_unit_test(layer_between_walls),
        cmocka_unit_test(lid_driven_cavity),
        cmocka_unit_test(hydrostatics),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
