/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingForce.c - prediction and settlement of the fluid's force, component by component.
 *
 * What the pair does over time is measured in tests/verify/couplingTwoVelocity.c.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "cpl.h"
#include "near.h"

enum { N = 2 };

/* One particle in a liquid, one in a gas-like state; ugly numbers. */
static const double eps[N] = {.43, .97}, kappa[N] = {2.385e-4, 7.1e-5}, V[N] = {5.2e-10, 4.1e-10};
static const double mass[N] = {1.3e-6, 1.1e-6};
static const double L[N][3] = {{1e-5, -2e-5, 3e-5}, {4e-6, 5e-6, -6e-6}};
static const double C[N][3] = {{7e-9, 8e-9, -9e-9}, {-1e-9, 2e-9, 3e-9}};
static const double a[N][3] = {{.7, -1.9, 4.3}, {.3, .2, .1}};

static void prediction(void **unused)
{
    (void)unused;
    const double dt = 2.7e-4, rho = 998;
    cpl_param param = cpl_param_default();
    param.carry_gain = .37;
    double f[N][3], k[N], M[N];
    cpl_predict(&param, N, dt, rho, eps, kappa, V, mass, L, C, a, f, k, M);
    /* rho V (1-e)/(e m) is .53 for the first and .0115 for the second: only the first has M. */
    const double inertia[N] = {rho * V[0] * .57 / .43, 0};
    for (int p = 0; p < N; p++) {
        assert_near(k[p], kappa[p] / (eps[p] * eps[p]), 1e-16);
        assert_near(M[p], inertia[p], 1e-20);
        for (int c = 0; c < 3; c++)
            assert_near(f[p][c], L[p][c] + .37 * C[p][c] / dt + inertia[p] * a[p][c], 1e-18);
    }
    param.scheme = CPL_EXPLICIT;
    cpl_predict(&param, N, dt, rho, eps, kappa, V, mass, L, C, a, f, k, M);
    for (int p = 0; p < N; p++) {
        assert_true(k[p] == 0 && M[p] == 0);
        for (int c = 0; c < 3; c++) assert_near(f[p][c], L[p][c] + .37 * C[p][c] / dt, 1e-18);
    }
}

/* What was exactly predicted leaves nothing carried; what was not is carried to the last digit. */
static void settlement(void **unused)
{
    (void)unused;
    const double dt = 2.7e-4;
    const double u[N][3] = {{.31, .2, -.4}, {1.1, 0, 2.1}}, v[N][3] = {{.1, .25, .3}, {1, 1, 1}};
    const double gradient[N][3] = {{-9790, 120, 3}, {-11.9, 5, 7}};
    double J[N][3], force[N][3], carried[N][3];
    for (int p = 0; p < N; p++)
        for (int c = 0; c < 3; c++) {
            carried[p][c] = C[p][c];
            J[p][c] = p == 0
                          ? C[p][c] + dt * (kappa[p] * (u[p][c] - v[p][c]) - V[p] * gradient[p][c])
                          : 2e-9;
        }
    cpl_settle(N, dt, kappa, V, u, v, gradient, (const double(*)[3])J, force, carried);
    for (int c = 0; c < 3; c++) {
        assert_near(carried[0][c], 0, 1e-22);
        for (int p = 0; p < N; p++)
            assert_near(force[p][c], kappa[p] * (u[p][c] - v[p][c]) - V[p] * gradient[p][c], 1e-18);
        assert_near(carried[1][c], C[1][c] + dt * force[1][c] - 2e-9, 1e-22);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prediction),
        cmocka_unit_test(settlement),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
