/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingDrag.c - drag laws against published numbers, closed forms and limits.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "cpl.h"
#include "near.h"

static const double pi = 3.14159265358979323846;

/* beta = kappa (1-e)/V of two-fluid models, kg/m3/s */
static double beta(cpl_drag_law law, double e, double slip, double d, double rho, double mu)
{
    return cpl_drag(law, e, slip, d, rho, mu) * (1 - e) / (pi / 6 * d * d * d);
}

/* d 1 mm, air; rho u d/mu = 1000 and 1: values computed apart from this project. */
static void ergun_wen_yu_table(void **unused)
{
    (void)unused;
    const double d = 1e-3, rho = 1.2, mu = 1.8e-5, u = mu / (rho * d);
    const double e[3] = {.4, .4, .85}, re[3] = {1000, 1, 1000}, table[3] = {2.133e4, 2449, 1229};
    const double digits[3] = {3e-4, 3e-4, 5e-4}; /* of the table */
    for (int i = 0; i < 3; i++) {
        const double found = beta(CPL_ERGUN_WEN_YU, e[i], re[i] * u, d, rho, mu);
        report("Drag of Ergun and Wen & Yu, beta, kg/m3/s", found, table[i]);
        assert_near(found / table[i], 1, digits[i]);
    }
}

/* Ergun's pressure gradient of a fixed bed, in the superficial velocity, is (beta/e) u. */
static void ergun_pressure_drop(void **unused)
{
    (void)unused;
    const double d = 2.5e-3, rho = 1.205, mu = 1.82e-5, e = .413, superficial = .83;
    const double gradient = 150 * pow(1 - e, 2) * mu * superficial / (e * e * e * d * d) +
                            1.75 * (1 - e) * rho * superficial * superficial / (e * e * e * d);
    const double u = superficial / e;
    const double b = beta(CPL_ERGUN_WEN_YU, e, u, d, rho, mu);
    report("Ergun, pressure gradient of a bed, Pa/m", b / e * u, gradient);
    assert_near(b / e * u / gradient, 1, 1e-13);
}

/* Minimum fluidisation of glass in air: buoyant weight = drag / e, 1.228 m/s superficial. */
static void minimum_fluidisation(void **unused)
{
    (void)unused;
    const double d = 2.5e-3, rho_p = 2526, rho = 1.2, mu = 1.8e-5, e = .4, g = 9.81;
    double lo = 0, hi = 10;
    for (int i = 0; i < 60; i++) {
        const double u = .5 * (lo + hi);
        const double up = beta(CPL_ERGUN_WEN_YU, e, u / e, d, rho, mu) * u / (e * e);
        if (up > (1 - e) * (rho_p - rho) * g)
            hi = u;
        else
            lo = u;
    }
    report("Minimum fluidisation, m/s", lo, 1.228);
    assert_near(lo, 1.228, .005 * 1.228);
}

static void rest_is_finite(void **unused)
{
    (void)unused;
    const double d = 3.1e-4, rho = 998, mu = 1.1e-3, V = pi / 6 * d * d * d;
    /* Stokes; Wen & Yu 18 mu e^-2.65/d^2; Ergun's viscous term; Di Felice 4.8^2/24 of Stokes */
    assert_near(cpl_drag(CPL_SCHILLER_NAUMANN, .5, 0, d, rho, mu) / (3 * pi * mu * d), 1, 1e-14);
    assert_near(cpl_drag(CPL_ERGUN_WEN_YU, .9, 0, d, rho, mu) /
                    (18 * mu * pow(.9, -2.65) / (d * d) * V),
                1, 1e-14);
    assert_near(cpl_drag(CPL_ERGUN_WEN_YU, .5, 0, d, rho, mu) / (150 * .5 * mu / (.5 * d * d) * V),
                1, 1e-14);
    assert_near(cpl_drag(CPL_DI_FELICE, .6, 0, d, rho, mu) /
                    (3 * pi * mu * d * (4.8 * 4.8 / 24) * pow(.6, 1 - 3.7)),
                1, 1e-14);
    assert_true(cpl_drag(CPL_DRAG_NONE, .6, 3, d, rho, mu) == 0);
    for (int law = CPL_ERGUN_WEN_YU; law <= CPL_SCHILLER_NAUMANN; law++)
        for (double e = .25; e <= 1; e += .15) {
            const double still = cpl_drag((cpl_drag_law)law, e, 0, d, rho, mu);
            const double slow = cpl_drag((cpl_drag_law)law, e, 1e-12, d, rho, mu);
            assert_true(isfinite(still) && still > 0);
            assert_near(slow / still, 1, 1e-5);
        }
}

/* C_D at Re = 1: 24 (1 + .15) and (.63 + 4.8)^2; at Re = 5000 .44; a lone sphere, e = 1. */
static void drag_coefficients(void **unused)
{
    (void)unused;
    const double d = 2.3e-3, rho = 1.19, mu = 1.85e-5, unit = mu / (rho * d);
    const double re[3] = {1, 100, 5000};
    const double schiller[3] = {27.6, 24. / 100 * (1 + .15 * 23.65919696), .44};
    for (int i = 0; i < 3; i++) {
        const double u = re[i] * unit, area = pi / 4 * d * d;
        const double per = .5 * rho * area * u; /* kappa of C_D = 1 */
        const double felice = pow(.63 + 4.8 / sqrt(re[i]), 2);
        print_message("Re %g, ", re[i]);
        report("C_D of Schiller & Naumann", cpl_drag(CPL_SCHILLER_NAUMANN, .7, u, d, rho, mu) / per,
               schiller[i]);
        print_message("Re %g, ", re[i]);
        report("C_D of Di Felice", cpl_drag(CPL_DI_FELICE, 1, u, d, rho, mu) / per, felice);
        assert_near(cpl_drag(CPL_SCHILLER_NAUMANN, .7, u, d, rho, mu) / per, schiller[i], 1e-8);
        assert_near(cpl_drag(CPL_ERGUN_WEN_YU, 1, u, d, rho, mu) / per, schiller[i], 1e-8);
        assert_near(cpl_drag(CPL_DI_FELICE, 1, u, d, rho, mu) / per / felice, 1, 1e-12);
    }
}

/* chi is 3.05 at Re = 10^1.5; with the shared pressure gradient the exponent of e is 2 - chi. */
static void di_felice_voidage(void **unused)
{
    (void)unused;
    const double d = 1.7e-3, rho = 1.19, mu = 1.85e-5, re = pow(10, 1.5);
    for (double e = .35; e < 1; e += .11) {
        const double u = re * mu / (e * rho * d), felice = pow(.63 + 4.8 / sqrt(re), 2);
        const double expected = felice * .5 * rho * pi / 4 * d * d * u * pow(e, 2 - 3.05);
        assert_near(cpl_drag(CPL_DI_FELICE, e, u, d, rho, mu) / expected, 1, 1e-12);
    }
    /* In a dense bed both laws describe the same experiments: within 10 % of each other. The
     * exponent 1 - chi would be 2.5 times too large here. */
    for (double u = 1e-3; u < 30; u *= 3) {
        const double ratio = cpl_drag(CPL_DI_FELICE, .4, u, d, rho, mu) /
                             cpl_drag(CPL_ERGUN_WEN_YU, .4, u, d, rho, mu);
        assert_near(ratio, 1, .1);
    }
}

/* MFiX DEM06: d 100 um, 2000 kg/m3, gas of 1.2 kg/m3 rising at .40 m/s; terminal velocity
 * -.05740169 m/s: drag of the slip against weight less buoyancy. */
static void terminal_velocity(void **unused)
{
    (void)unused;
    const double d = 100e-6, rho = 1.2, mu = 1.8e-5, g = 9.80665, V = pi / 6 * d * d * d;
    double lo = 0, hi = 10;
    for (int i = 0; i < 60; i++) {
        const double u = .5 * (lo + hi);
        if (cpl_drag(CPL_SCHILLER_NAUMANN, 1, u, d, rho, mu) * u > V * (2000 - rho) * g)
            hi = u;
        else
            lo = u;
    }
    report("Terminal velocity of DEM06, m/s", .40 - lo, -.05740169);
    assert_near(.40 - lo, -.05740169, 1e-8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ergun_wen_yu_table),   cmocka_unit_test(ergun_pressure_drop),
        cmocka_unit_test(minimum_fluidisation), cmocka_unit_test(rest_is_finite),
        cmocka_unit_test(drag_coefficients),    cmocka_unit_test(di_felice_voidage),
        cmocka_unit_test(terminal_velocity),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
