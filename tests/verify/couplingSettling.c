/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingSettling.c - spheres settling in a closed periodic box, through the whole particle phase.
 *
 * The box is one cell, so that the void fraction e stays what it is (a bed of several cells is
 * unstable to clustering, in nature too), and the flow solver is one line: with
 * no net volume flux u = -(1-e) v/e, and the fluid's momentum equation gives the pressure gradient
 *
 *     grad p = rho g - rho (u - u_old)/dt - (K u - S)/e.
 *
 * Whatever the step, the slip must come to the balance kappa(s) s = e (rho_p - rho) V g with the
 * drag law of the run, without growing oscillation, and every step the ledger closes. Engine,
 * prediction, sub-steps, map, drag and ledger are the real ones.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <cmocka.h>

#include "near.h"
#include "phaseBox.h"

typedef struct fluid {
    double u[3], gradient[3];
    double drag[3], pressure[3]; /* N, on the particles of the whole box */
} fluid;

/* The flow solver: continuity, then the pressure gradient from momentum. */
static void solve(const phase_box *b, double dt, fluid *f)
{
    const double e = phase_voidage(b->phase)[0], K = phase_K(b->phase)[0];
    const double *S = phase_S(b->phase)[0], *v = phase_Us(b->phase)[0];
    for (int a = 0; a < 3; a++) {
        const double old = f->u[a], volume = b->mesh.volume[0];
        f->u[a] = -(1 - e) * v[a] / e;
        f->gradient[a] = b->rho * (b->gravity[a] - (f->u[a] - old) / dt) - (K * f->u[a] - S[a]) / e;
        f->drag[a] = volume * (K * f->u[a] - S[a]);
        f->pressure[a] = -volume * (1 - e) * f->gradient[a];
    }
}

/* One coupled step, with a look at the books: exchange, carry, particle momentum, volume. */
static void advance(phase_box *b, double dt, fluid *f)
{
    if (phase_advance(b->phase, dt)) fail_msg("%s", phase_message(b->phase));
    assert_int_equal(phase_drag(b->phase, (const double(*)[3])f->u), 0);
    solve(b, dt, f);
    if (phase_settle(b->phase, (const double(*)[3])f->u, (const double(*)[3])f->gradient, NULL,
                     f->drag, f->pressure))
        fail_msg("%s", phase_message(b->phase));
    assert_near(phase_last_report(b->phase).ledger_residual, 0, 1e-12);
}

/* Slip at which drag carries the weight: kappa(s) s = e (m - rho V) g. */
static double steady_slip(const phase_box *b, double V)
{
    const double weight = b->eps * (b->density - b->rho) * V * 9.81;
    double lo = 0, hi = 1;
    for (int i = 0; i < 200; i++) {
        const double s = .5 * (lo + hi);
        if (cpl_drag(b->coupling.drag, b->eps, s, b->d, b->rho, b->mu) * s > weight)
            hi = s;
        else
            lo = s;
    }
    return lo;
}

typedef struct suspension {
    const char *name;
    double density, rho, mu, d;
} suspension;

static const suspension gas = {"gas", 2400, 1.2, 1.8e-5, 1.3e-4};
static const suspension water = {"water", 2600, 1000, 1e-3, 7e-4};
static const suspension buoyant = {"buoyant", 1100, 1000, 1e-3, 9e-4};

static void settle(const suspension *m, double eps, double stiffness)
{
    phase_box b = {.eps = eps,
                   .d = m->d,
                   .density = m->density,
                   .rho = m->rho,
                   .mu = m->mu,
                   .gravity = {0, 0, -9.81},
                   .cells = {1, 1, 1},
                   .coupling = cpl_param_default()};
    /* e = .8 is where the law of Ergun and Wen & Yu jumps: rounding would choose the branch. */
    b.coupling.drag = eps < .5 ? CPL_ERGUN_WEN_YU : CPL_DI_FELICE;
    const double V = 3.14159265358979323846 / 6 * pow(b.d, 3), mass = V * b.density;
    const double slip = steady_slip(&b, V);
    const double kappa = cpl_drag(b.coupling.drag, eps, slip, b.d, b.rho, b.mu);
    const double dt = stiffness * mass / kappa;
    /* About six sub-steps: 2 pi sqrt(m/k)/20 = dt/6. */
    b.stiffness = mass * pow(6 * 2 * 3.14159265358979323846 / (20 * dt), 2);
    assert_int_equal(phase_box_new(&b), 0);
    fluid f = {.u = {0, 0, 0}};
    const int steps = stiffness < .1 ? 900 : 200;
    double early = 0, late = 0, found = 0;
    for (int i = 0; i < steps; i++) {
        advance(&b, dt, &f);
        found = f.u[2] - phase_Us(b.phase)[0][2];
        const double error = fabs(found - slip);
        if (i < steps / 2)
            early = fmax(early, error);
        else
            late = fmax(late, error);
    }
    print_message("%-8s eps %.1f  k dt/m %-5g sub-steps %-3d slip %.6g (%.6g)  error %.1e early "
                  "%.1e late\n",
                  m->name, eps, stiffness, phase_last_report(b.phase).dem.substeps, found, slip,
                  early / slip, late / slip);
    assert_true(late <= early);
    assert_near(found / slip, 1, 1e-6);
    phase_box_free(&b);
}

static void all_mixtures(void **unused)
{
    (void)unused;
    const suspension *mixture[3] = {&gas, &water, &buoyant};
    const double eps[2] = {.4, .8}, stiffness[3] = {.01, 1, 100};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 3; k++) settle(mixture[i], eps[j], stiffness[k]);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_mixtures)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
