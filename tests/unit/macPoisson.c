/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * macPoisson.c - the pressure solver: its preconditioner is symmetric and positive, it solves
 * boxes of any size, open, closed and periodic, and its iterations do not grow with the mesh.
 */
#include "poisson.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

/* Reproducible numbers in (0, 1): Knuth's multiplier, MMIX. */
static uint64_t seed;
static double number(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return ((double)(seed >> 11) + 0.5) / 9007199254740992.0;
}

typedef struct problem {
    int n[3];
    double h[3];
    int periodic[3];
    int open; /* pressure given at the top */
    mac_cycle cycle;
} problem;

static size_t at(const mac_level *l, int i, int j, int k)
{
    return (size_t)i + (size_t)j * l->stride[1] + (size_t)k * l->stride[2];
}

/* A bed with a wavy surface and a bubble: void fraction .35-.5 and a drag factor down to 1e-3
 * inside it, both random from cell to cell, 1 outside. */
static void bed(const problem *q, mac_poisson *ps)
{
    mac_level *l = &ps->mg.level[0];
    double *eps = malloc(l->size * sizeof *eps), *alpha = malloc(l->size * sizeof *alpha);
    double **c = mac_poisson_coefficients(ps);
    for (int k = 0; k <= q->n[2] + 1; k++)
        for (int j = 0; j <= q->n[1] + 1; j++)
            for (int i = 0; i <= q->n[0] + 1; i++) {
                double y = (j - 0.5) / q->n[1], z = (k - 0.5) / q->n[2];
                int inside = z < 0.5 + 0.1 * sin(7 * y) &&
                             (y - 0.5) * (y - 0.5) + (z - 0.25) * (z - 0.25) > 0.01;
                size_t m = at(l, i, j, k);
                eps[m] = inside ? 0.35 + 0.15 * number() : 1;
                alpha[m] = inside ? 1 / (1 + 1000 * (0.5 + number())) : 1;
            }
    for (int d = 0; d < 3; d++) {
        mac_level_wrap(l, eps);
        mac_level_wrap(l, alpha);
        int last[3] = {q->n[0], q->n[1], q->n[2]};
        last[d]++;
        for (int k = 1; k <= last[2]; k++)
            for (int j = 1; j <= last[1]; j++)
                for (int i = 1; i <= last[0]; i++) {
                    int here[3] = {i, j, k};
                    size_t m = at(l, i, j, k), s = l->stride[d];
                    double value =
                        (eps[m] + eps[m - s]) / 2 / (0.5 / alpha[m] + 0.5 / alpha[m - s]);
                    value /= q->h[d] * q->h[d];
                    if (!q->periodic[d] && here[d] == 1) value = 0;
                    if (!q->periodic[d] && here[d] == q->n[d] + 1)
                        value = d == 2 && q->open ? 2 * value : 0;
                    if (q->periodic[d] && q->n[d] == 1) value = 0;
                    c[d][m] = value;
                }
    }
    free(eps);
    free(alpha);
    mac_poisson_assemble(ps);
}

static void random_field(const mac_level *l, double *x)
{
    double sum = 0;
    for (int k = 1; k <= l->n[2]; k++)
        for (int j = 1; j <= l->n[1]; j++)
            for (int i = 1; i <= l->n[0]; i++) sum += x[at(l, i, j, k)] = number() - 0.5;
    sum /= (double)l->n[0] * l->n[1] * l->n[2];
    for (int k = 1; k <= l->n[2]; k++) /* zero mean: also right for a closed box */
        for (int j = 1; j <= l->n[1]; j++)
            for (int i = 1; i <= l->n[0]; i++) x[at(l, i, j, k)] -= sum;
}

static double dot(const mac_level *l, const double *x, const double *y)
{
    double sum = 0;
    for (int k = 1; k <= l->n[2]; k++)
        for (int j = 1; j <= l->n[1]; j++)
            for (int i = 1; i <= l->n[0]; i++) sum += x[at(l, i, j, k)] * y[at(l, i, j, k)];
    return sum;
}

static void start(const problem *q, mac_poisson *ps)
{
    assert_int_equal(mac_poisson_init(ps, q->n, q->h, q->periodic, q->cycle, 1e-8, 100), 0);
    seed = 20260118;
    bed(q, ps);
}

static const problem problems[] = {
    {{8, 8, 8}, {1, 1, 1}, {0, 0, 0}, 1, MAC_W_CYCLE},
    {{30, 15, 90}, {1, 1.3, 0.7}, {0, 0, 0}, 1, MAC_W_CYCLE},
    {{2, 30, 90}, {7.5, 5, 5}, {0, 0, 0}, 1, MAC_W_CYCLE},
    {{2, 30, 90}, {7.5, 5, 5}, {0, 0, 0}, 1, MAC_V_CYCLE},
    {{1, 7, 13}, {1, 1, 1}, {0, 0, 0}, 0, MAC_V_CYCLE},
    {{1, 1, 37}, {1, 1, 1}, {0, 0, 0}, 1, MAC_V_CYCLE},
    {{3, 3, 3}, {1, 1, 1}, {0, 0, 0}, 0, MAC_W_CYCLE},
    {{16, 12, 20}, {1, 1, 1}, {1, 1, 0}, 1, MAC_W_CYCLE},
    {{16, 12, 20}, {1, 1, 1}, {1, 1, 1}, 0, MAC_W_CYCLE},
    {{15, 9, 21}, {1, 1, 1}, {1, 1, 1}, 0, MAC_V_CYCLE},
    {{2, 1, 5}, {1, 1, 1}, {1, 1, 1}, 0, MAC_V_CYCLE},
    {{24, 24, 24}, {1, 4, 0.25}, {0, 1, 0}, 0, MAC_W_CYCLE},
};

static void symmetric_preconditioner(void **state)
{
    (void)state;
    for (size_t t = 0; t < sizeof problems / sizeof *problems; t++) {
        mac_poisson ps;
        start(&problems[t], &ps);
        mac_level *l = &ps.mg.level[0];
        double *x = calloc(l->size, sizeof *x), *y = calloc(l->size, sizeof *y);
        random_field(l, x);
        random_field(l, y);
        memcpy(l->b, x, l->size * sizeof *x);
        mac_multigrid_apply(&ps.mg);
        double yMx = dot(l, y, l->x), xMx = dot(l, x, l->x);
        memcpy(l->b, y, l->size * sizeof *y);
        mac_multigrid_apply(&ps.mg);
        double xMy = dot(l, x, l->x), yMy = dot(l, y, l->x);
        if (!(xMx > 0 && yMy > 0)) fail_msg("problem %zu: not positive", t);
        if (!(fabs(xMy - yMx) <= 1e-12 * sqrt(xMx * yMy)))
            fail_msg("problem %zu: not symmetric, %.15g and %.15g", t, xMy, yMx);
        free(x);
        free(y);
        mac_poisson_free(&ps);
    }
}

/* A chosen pressure is found again, up to a constant where none is given. */
static void chosen_solution(void **state)
{
    (void)state;
    for (size_t t = 0; t < sizeof problems / sizeof *problems; t++) {
        mac_poisson ps;
        start(&problems[t], &ps);
        ps.tolerance = 1e-13;
        mac_level *l = &ps.mg.level[0];
        double *x = calloc(l->size, sizeof *x);
        random_field(l, x);
        mac_poisson_multiply(&ps, x, ps.b);
        mac_poisson_status status = mac_poisson_solve(&ps, 0);
        double worst = 0;
        for (int k = 1; k <= l->n[2]; k++)
            for (int j = 1; j <= l->n[1]; j++)
                for (int i = 1; i <= l->n[0]; i++)
                    worst = fmax(worst, fabs(ps.x[at(l, i, j, k)] - x[at(l, i, j, k)]));
        print_message("%2d x %2d x %2d: %d iterations to 1e-13, error %.1e\n", l->n[0], l->n[1],
                      l->n[2], ps.iterations, worst);
        assert_int_equal(status, MAC_SOLVED);
        assert_int_equal(ps.singular, !problems[t].open);
        assert_true(worst < 1e-8);
        free(x);
        mac_poisson_free(&ps);
    }
}

static int iterations(int n, mac_cycle cycle)
{
    const problem q = {{n, n, n}, {1.0 / n, 1.0 / n, 1.0 / n}, {0, 0, 0}, 1, cycle};
    mac_poisson ps;
    start(&q, &ps);
    random_field(&ps.mg.level[0], ps.b);
    for (int j = 1; j <= n; j++) /* and an inflow through the bottom */
        for (int i = 1; i <= n; i++) ps.b[at(&ps.mg.level[0], i, j, 1)] += 10;
    assert_int_equal(mac_poisson_solve(&ps, 0), MAC_SOLVED);
    int count = ps.iterations;
    mac_poisson_free(&ps);
    return count;
}

static void iterations_do_not_grow(void **state)
{
    (void)state;
    for (int cycle = MAC_V_CYCLE; cycle <= MAC_W_CYCLE; cycle++) {
        int coarse = iterations(32, (mac_cycle)cycle), medium = iterations(64, (mac_cycle)cycle);
        int fine = iterations(128, (mac_cycle)cycle);
        print_message("%c-cycle, iterations to 1e-8: %d at 32^3, %d at 64^3, %d at 128^3\n",
                      " VW"[cycle], coarse, medium, fine);
        assert_true(medium <= coarse + 2);
        assert_true(fine <= coarse + 2);
        assert_true(fine <= 30);
    }
}

static void trouble_is_reported(void **state)
{
    (void)state;
    mac_poisson ps;
    start(&problems[1], &ps);
    mac_level *l = &ps.mg.level[0];
    random_field(l, ps.b);
    ps.max_iterations = 2;
    assert_int_equal(mac_poisson_solve(&ps, 0), MAC_NOT_CONVERGED);
    assert_true(ps.residual > 1e-8);
    assert_int_equal(mac_poisson_solve(&ps, 1e3), MAC_SOLVED); /* nothing to solve */
    assert_int_equal(ps.iterations, 0);
    ps.b[at(l, 3, 4, 5)] = NAN;
    assert_int_equal(mac_poisson_solve(&ps, 0), MAC_NOT_FINITE);
    mac_poisson_free(&ps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(symmetric_preconditioner),
        cmocka_unit_test(chosen_solution),
        cmocka_unit_test(iterations_do_not_grow),
        cmocka_unit_test(trouble_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
