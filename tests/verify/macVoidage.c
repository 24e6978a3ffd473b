/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * macVoidage.c - felmiMAC with a given void fraction and drag: what must hold exactly.
 *
 * A uniform velocity stays uniform while the void fraction moves with it; the volume flux through a
 * step of the void fraction is constant; the mean flux of a periodic box is held, with the pressure
 * gradient of resistances in parallel and in series; a prescribed drag's pressure drop times area
 * is the force on the particles; fluid momentum changes by what the forces give it.
 */
#include "mac.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static mac_param box(int nx, int ny, int nz, double lx, double ly, double lz)
{
    mac_param p = mac_param_default();
    int n[3] = {nx, ny, nz};
    double l[3] = {lx, ly, lz};
    for (int d = 0; d < 3; d++) {
        p.n[d] = n[d];
        p.h[d] = l[d] / n[d];
    }
    for (int s = 0; s < 6; s++) p.side[s].normal = MAC_CYCLIC;
    p.tolerance = 1e-13;
    return p;
}

static void step(mac *m, double dt)
{
    if (mac_step(m, dt)) fail_msg("%s", m->message);
}

/* Void fraction carried by the velocity U for one step, as continuity of the scheme has it:
 * (new - old)/dt + div(new_f U) = 0 with new_f the mean of two cells; by iteration. */
static void carry(const mac *m, const double *old, double *new, const double U[3], double dt)
{
    const mac_grid *g = &m->grid;
    double change = 1;
    memcpy(new, old, g->size * sizeof *new);
    while (change > 1e-16) {
        change = 0;
        mac_fill_copy(g, new, -1);
        for (int k = 1; k <= g->n[2]; k++)
            for (int j = 1; j <= g->n[1]; j++)
                for (int i = 1; i <= g->n[0]; i++) {
                    size_t q = mac_at(g, i, j, k);
                    double value = old[q];
                    for (int d = 0; d < 3; d++)
                        value -= dt * U[d] / g->h[d] * 0.5 *
                                 (new[q + g->stride[d]] - new[q - g->stride[d]]);
                    double next = 0.5 * (new[q] + value);
                    change = fmax(change, fabs(next - new[q]));
                    new[q] = next;
                }
    }
    mac_fill_copy(g, new, -1);
}

static void uniform_velocity_through_a_moving_step(void **state)
{
    (void)state;
    const double U[3] = {1.37, -0.61, 0.83}, dt = 2.1e-3;
    for (int scheme = MAC_HYBRID; scheme <= MAC_CENTRAL; scheme++) {
        mac_param p = box(12, 10, 8, 0.12, 0.11, 0.1);
        p.rho = 1.2;
        p.mu = 1.8e-5;
        p.convection = (mac_convection)scheme;
        mac *m = mac_new(&p);
        assert_non_null(m);
        for (size_t q = 0; q < m->grid.size; q++)
            for (int d = 0; d < 3; d++) m->u[d][q] = U[d];
        for (int k = 1; k <= 8; k++)
            for (int j = 1; j <= 10; j++)
                for (int i = 1; i <= 12; i++)
                    m->eps[mac_at(&m->grid, i, j, k)] = i < 6 && k < 5 ? 0.42 : 0.95;
        mac_fill_copy(&m->grid, m->eps, -1);
        double worst = 0;
        for (int t = 0; t < 12; t++) {
            memcpy(m->eps_old, m->eps, m->grid.size * sizeof(double));
            carry(m, m->eps_old, m->eps, U, dt);
            step(m, dt);
            for (int k = 1; k <= 8; k++)
                for (int j = 1; j <= 10; j++)
                    for (int i = 1; i <= 12; i++)
                        for (int d = 0; d < 3; d++)
                            worst = fmax(worst, fabs(m->u[d][mac_at(&m->grid, i, j, k)] - U[d]));
        }
        print_message("Uniform velocity, scheme %d: largest change %.2e m/s\n", scheme, worst);
        mac_free(m);
        assert_true(worst < 1e-12);
    }
}

/* Upward flow through a layer: eps u is the inlet's everywhere. */
static void constant_flux_through_a_step(void **state)
{
    (void)state;
    mac_param p = box(2, 3, 20, 0.02, 0.03, 0.2);
    for (int s = 0; s < 6; s++) p.side[s].normal = MAC_PRESCRIBED;
    p.side[4].velocity[2] = 0.731;
    p.side[4].superficial = 1;
    p.side[5].normal = MAC_OPEN;
    p.rho = 1.2;
    p.mu = 1.8e-5;
    mac *m = mac_new(&p);
    assert_non_null(m);
    for (int k = 1; k <= 20; k++)
        for (int j = 1; j <= 3; j++)
            for (int i = 1; i <= 2; i++) {
                size_t q = mac_at(&m->grid, i, j, k);
                m->eps[q] = m->eps_old[q] = k < 9 ? 0.4 : 1;
                m->K[q] = k < 9 ? 2345.6 : 0;
            }
    mac_fill_copy(&m->grid, m->eps, -1);
    mac_fill_copy(&m->grid, m->eps_old, -1);
    mac_fill_copy(&m->grid, m->K, -1);
    double worst = 0;
    for (int t = 0; t < 200; t++) {
        step(m, 1e-3);
        worst = 0;
        for (int k = 1; k <= 21; k++) {
            size_t q = mac_at(&m->grid, 1, 2, k);
            double flux = mac_face(m->eps, q, m->grid.stride[2]) * m->u[2][q];
            worst = fmax(worst, fabs(flux / 0.731 - 1));
        }
    }
    double cells[120][3], tensor[120][9], gradient[120][3], drag[3], pressure[3];
    mac_exchange(m, cells, tensor, gradient, drag, pressure);
    double drop = (mac_side_pressure(m, 4) - mac_side_pressure(m, 5)) * 0.02 * 0.03;
    double inflow = 1.2 * 0.731 * 0.731 / 0.4 * 6e-4, outflow = 1.2 * 0.731 * 0.731 * 6e-4;
    double total = drag[2] + pressure[2];
    print_message("Step of the void fraction: flux off by %.2e; dp A %.12g N, force on particles "
                  "%.12g N, momentum inflow %.3g N\n",
                  worst, drop, total, inflow - outflow);
    mac_free(m);
    assert_true(worst < 1e-12);
    assert_true(fabs((drop + inflow - outflow) / total - 1) < 1e-9);
    /* resistance K q/eps^2 of the layer, to its very end; inertia is about 1 Pa */
    double resistance = 0.08 * 0.731 * 2345.6 / (0.4 * 0.4);
    assert_true(fabs(drop / 6e-4 / resistance - 1) < 5e-3);
}

static void held_flux(void **state)
{
    (void)state;
    for (int along = 0; along < 2; along++) { /* layers in parallel to the flow, in series */
        mac_param p = box(9, 6, 4, 0.09, 0.06, 0.04);
        p.rho = along ? 1e-7 : 1.2; /* in series convection must be negligible */
        p.hold_flux[0] = p.hold_flux[2] = 1;
        p.mean_flux[0] = 0.317;
        p.mean_flux[2] = -0.021;
        mac *m = mac_new(&p);
        assert_non_null(m);
        double eps[9], K[9], sum = 0;
        int layers = along ? 9 : 6;
        for (int l = 0; l < layers; l++) {
            eps[l] = 0.4 + 0.05 * ((l * 5) % 7);
            K[l] = 1000.0 + 731.0 * ((l * 4) % 9);
        }
        for (int k = 1; k <= 4; k++)
            for (int j = 1; j <= 6; j++)
                for (int i = 1; i <= 9; i++) {
                    size_t q = mac_at(&m->grid, i, j, k);
                    m->eps[q] = m->eps_old[q] = eps[(along ? i : j) - 1];
                    m->K[q] = K[(along ? i : j) - 1];
                }
        mac_fill_copy(&m->grid, m->eps, -1);
        mac_fill_copy(&m->grid, m->eps_old, -1);
        mac_fill_copy(&m->grid, m->K, -1);
        for (int t = 0; t < 60; t++) step(m, 0.1);
        for (int l = 0; l < layers; l++) {
            int b = (l + layers - 1) % layers;
            double series = K[l] / (eps[l] * eps[l]) + K[b] / (eps[b] * eps[b]); /* of a face */
            sum += (along ? series / 2 : eps[l] * eps[l] / K[l]) / layers;
        }
        double exact = -0.317 * (along ? sum : 1 / sum), mean = 0, across = 0;
        for (int k = 1; k <= 4; k++)
            for (int j = 1; j <= 6; j++)
                for (int i = 1; i <= 9; i++) {
                    size_t q = mac_at(&m->grid, i, j, k);
                    mean += mac_face(m->eps, q, 1) * m->u[0][q] / 216;
                    across += mac_face(m->eps, q, m->grid.stride[2]) * m->u[2][q] / 216;
                }
        print_message("Held flux, layers %s: %.15g m/s, gradient %.12g Pa/m, exact %.12g\n",
                      along ? "in series" : "in parallel", mean, m->report.gradient[0], exact);
        double found = m->report.gradient[0];
        mac_free(m);
        assert_true(fabs(mean / 0.317 - 1) < 1e-12);
        assert_true(fabs(across / -0.021 - 1) < 1e-12);
        assert_true(fabs(found / exact - 1) < (along ? 1e-6 : 1e-11));
    }
}

/* In a periodic box fluid momentum changes by gravity, drag and pressure on the solid only. */
static void fluid_momentum(void **state)
{
    (void)state;
    mac_param p = box(8, 6, 10, 0.08, 0.06, 0.1);
    p.rho = 1.2;
    p.mu = 1.8e-3;
    p.gravity[2] = -9.81;
    mac *m = mac_new(&p);
    assert_non_null(m);
    const mac_grid *g = &m->grid;
    double dt = 1e-3;
    uint64_t seed = 11;
    for (int k = 1; k <= 10; k++)
        for (int j = 1; j <= 6; j++)
            for (int i = 1; i <= 8; i++) {
                size_t q = mac_at(g, i, j, k);
                seed = seed * 6364136223846793005u + 1442695040888963407u;
                double r = (double)(seed >> 11) / 9007199254740992.0;
                m->eps[q] = 0.4 + 0.5 * r;
                m->K[q] = 1e4 * (1 - r);
                m->S[0][q] = 400 * r;
                m->S[2][q] = -900 * r * r;
                m->u[1][q] = 3 * r;
            }
    double *fields[4] = {m->eps, m->K, m->S[0], m->S[2]};
    for (int f = 0; f < 4; f++) mac_fill_copy(g, fields[f], -1);
    memcpy(m->eps_old, m->eps, g->size * sizeof(double));
    mac_fill_velocity(m);
    double before[3] = {0}, worst = 0;
    for (int t = 0; t < 5; t++) {
        double after[3] = {0}, weight = 0, u[480][3], tensor[480][9], dp[480][3], drag[3],
               pressure[3];
        step(m, dt);
        for (int k = 1; k <= 10; k++)
            for (int j = 1; j <= 6; j++)
                for (int i = 1; i <= 8; i++) {
                    size_t q = mac_at(g, i, j, k);
                    weight += 1.2 * -9.81 * mac_face(m->eps, q, g->stride[2]) * g->volume;
                    for (int d = 0; d < 3; d++)
                        after[d] +=
                            1.2 * mac_face(m->eps, q, g->stride[d]) * m->u[d][q] * g->volume;
                }
        mac_exchange(m, u, tensor, dp, drag, pressure);
        for (int d = 0; t > 0 && d < 3; d++) {
            /* -eps grad p on the fluid is (1 - eps) grad p, since p is periodic */
            double given = -drag[d] - pressure[d] + (d == 2 ? weight : 0);
            double size = fabs(drag[d]) + fabs(pressure[d]) + fabs(after[d] / dt) + 1e-6;
            worst = fmax(worst, fabs((after[d] - before[d]) / dt - given) / size);
        }
        memcpy(before, after, sizeof before);
    }
    print_message("Fluid momentum: largest relative residual %.2e\n", worst);
    mac_free(m);
    assert_true(worst < 1e-12);
}

/* What is not finite stops the step and is named. */
static void blown_up_solution(void **state)
{
    (void)state;
    mac_param p = box(3, 4, 5, 0.03, 0.04, 0.05);
    p.rho = 1.2;
    mac *m = mac_new(&p);
    assert_non_null(m);
    step(m, 1e-3);
    m->K[mac_at(&m->grid, 2, 3, 4)] = NAN;
    assert_int_equal(mac_step(m, 1e-3), -1);
    print_message("%s\n", m->message);
    assert_non_null(strstr(m->message, "drag coefficient in cell (1 2 3)"));
    mac_free(m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uniform_velocity_through_a_moving_step),
        cmocka_unit_test(constant_flux_through_a_step),
        cmocka_unit_test(held_flux),
        cmocka_unit_test(fluid_momentum),
        cmocka_unit_test(blown_up_solution),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
