/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingColumn.c - a density wave in a settling suspension: the same growth whatever the step.
 *
 * Uniform suspensions are unstable to density waves; a run that is stable in time must show that
 * growth, no more and no less, however stiff the drag. A periodic column of cells is closed, so
 * that continuity gives the fluid velocity of each cell, e u + (1-e) v = 0, and momentum its
 * pressure gradient; rounding apart nothing but the coupling in time depends on the step. The
 * amplitude of the void fraction's first harmonic is followed over a settling path of six
 * diameters, in steps of at most a tenth of a diameter and with k dt/m from .1 to 100.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <cmocka.h>

#include "near.h"
#include "phaseBox.h"

enum { CELLS = 4 };

static const double pi = 3.14159265358979323846;

/* Slip at which drag carries the weight: kappa(s) s = e (m - rho V) g. */
static double steady_slip(const phase_box *b, double V)
{
    double lo = 0, hi = 1;
    for (int i = 0; i < 200; i++) {
        const double s = .5 * (lo + hi);
        if (cpl_drag(b->coupling.drag, b->eps, s, b->d, b->rho, b->mu) * s >
            b->eps * (b->density - b->rho) * V * 9.81)
            hi = s;
        else
            lo = s;
    }
    return lo;
}

static double first_harmonic(const phase_box *b)
{
    const double *e = phase_voidage(b->phase);
    return hypot(e[0] - e[2], e[1] - e[3]) / 2;
}

/* The flow solver of the column, for z; across it there is no motion. */
static void step(phase_box *b, double dt, double u[CELLS][3])
{
    if (phase_advance(b->phase, dt)) fail_msg("%s", phase_message(b->phase));
    assert_int_equal(phase_drag(b->phase, (const double(*)[3])u), 0);
    const double *K = phase_K(b->phase), *e = phase_voidage(b->phase);
    const double(*S)[3] = phase_S(b->phase), (*Us)[3] = phase_Us(b->phase);
    double gradient[CELLS][3] = {{0}}, drag[3] = {0}, pressure[3] = {0};
    for (int c = 0; c < CELLS; c++) {
        const double volume = b->mesh.volume[c], old = u[c][2];
        u[c][2] = -(1 - e[c]) * Us[c][2] / e[c];
        gradient[c][2] =
            b->rho * (b->gravity[2] - (u[c][2] - old) / dt) - (K[c] * u[c][2] - S[c][2]) / e[c];
        for (int a = 0; a < 3; a++) {
            drag[a] += volume * (K[c] * u[c][a] - S[c][a]);
            pressure[a] -= volume * (1 - e[c]) * gradient[c][a];
        }
    }
    if (phase_settle(b->phase, (const double(*)[3])u, (const double(*)[3])gradient, NULL, drag,
                     pressure))
        fail_msg("%s", phase_message(b->phase));
    assert_near(phase_last_report(b->phase).ledger_residual, 0, 1e-12);
}

/* Logarithm of the growth of the wave while the suspension settles by six diameters. */
static double growth(phase_box b, double stiffness)
{
    const double V = pi / 6 * pow(b.d, 3), m = V * b.density, slip = steady_slip(&b, V);
    const double dt = stiffness * m / cpl_drag(b.coupling.drag, b.eps, slip, b.d, b.rho, b.mu);
    const double path = dt * slip / b.d;
    const int steps = (int)lround(6 / path);
    b.stiffness = m * pow(6 * 2 * pi / (20 * dt), 2); /* about six sub-steps */
    assert_int_equal(phase_box_new(&b), 0);
    double u[CELLS][3] = {{0}};
    const double before = first_harmonic(&b);
    for (int i = 0; i < steps; i++) step(&b, dt, u);
    const double result = log(first_harmonic(&b) / before);
    print_message("k dt/m %-4g  %5d steps of %.2g d  ln growth %.4f\n", stiffness, steps, path,
                  result);
    phase_box_free(&b);
    return result;
}

static void same_growth(const phase_box *b, const double *stiffness, int n)
{
    const double gentle = growth(*b, stiffness[0]);
    assert_true(gentle > .2); /* it does grow, and not beyond the linear range */
    assert_true(gentle < 6);
    for (int i = 1; i < n; i++) assert_near(growth(*b, stiffness[i]) / gentle, 1, .06);
}

static phase_box column(double eps, double density, double rho, double mu, double d)
{
    return (phase_box){.eps = eps,
                       .d = d,
                       .density = density,
                       .rho = rho,
                       .mu = mu,
                       .gravity = {0, 0, -9.81},
                       .cells = {1, 1, CELLS},
                       .wave = 2e-4 * d,
                       .coupling = {.map = CPL_DIVIDED_CUBE,
                                    .packing_limit = .75,
                                    .drag = CPL_DI_FELICE,
                                    .carry_gain = .5,
                                    .added_mass_above = .1,
                                    .ledger_tolerance = 1e-9}};
}

static void gas(void **unused)
{
    (void)unused;
    const phase_box b = column(.55, 2400, 1.2, 1.8e-5, 2e-5);
    same_growth(&b, (const double[3]){.1, .3, 1}, 3);
}

static void water(void **unused)
{
    (void)unused;
    const phase_box b = column(.45, 2600, 1000, 1e-3, 1e-4);
    same_growth(&b, (const double[3]){2, 10, 100}, 3);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(gas), cmocka_unit_test(water)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
