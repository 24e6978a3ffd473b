/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * poisson.c - conjugate gradients with a multigrid preconditioner M:
 *     z = M r;  a = (z.r)/(s.As);  x += a s;  r -= a A s;  s = z + (z'.r')/(z.r) s
 * stopped at |r| <= tolerance |b|. A start from a good guess thus pays: the measure does not
 * depend on it. In a singular system (no side of given pressure) constants are taken out of b and
 * of the iterates, which keeps the method in the space where A is definite.
 *
 * Reference: O. Tatebe, NASA CP-3224 (1993) 621 (multigrid preconditioned conjugate gradients);
 * Y. Mori, doctoral thesis, University of Tokyo (2021), eqs 171-176 (corrected).
 */
#include "poisson.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int mac_poisson_init(mac_poisson *ps, const int n[3], const double h[3], const int periodic[3],
                     mac_cycle cycle, double tolerance, int max_iterations)
{
    memset(ps, 0, sizeof *ps);
    ps->tolerance = tolerance;
    ps->max_iterations = max_iterations;
    if (mac_multigrid_init(&ps->mg, n, h, periodic, cycle)) return -1;
    size_t size = ps->mg.level[0].size;
    double **array[4] = {&ps->x, &ps->s, &ps->q, &ps->b};
    for (int a = 0; a < 4; a++) {
        *array[a] = calloc(size, sizeof **array[a]);
        if (!*array[a]) {
            mac_poisson_free(ps);
            return -1;
        }
    }
    return 0;
}

void mac_poisson_free(mac_poisson *ps)
{
    mac_multigrid_free(&ps->mg);
    free(ps->x);
    free(ps->s);
    free(ps->q);
    free(ps->b);
    memset(ps, 0, sizeof *ps);
}

double **mac_poisson_coefficients(mac_poisson *ps)
{
    return ps->mg.level[0].c;
}

void mac_poisson_assemble(mac_poisson *ps)
{
    mac_level *l = &ps->mg.level[0];
    double given = 0; /* coefficients of sides of given value */
    for (int d = 0; d < 3; d++) {
        int a = (d + 1) % 3, b = (d + 2) % 3;
        for (int q = 1; q <= l->n[b]; q++)
            for (int p = 1; p <= l->n[a]; p++) {
                double *low =
                    l->c[d] + (size_t)p * l->stride[a] + (size_t)q * l->stride[b] + l->stride[d];
                double *high = low + (size_t)l->n[d] * l->stride[d];
                if (l->periodic[d])
                    *high = *low;
                else
                    given += *low + *high;
            }
    }
    ps->singular = !(given > 0);
    mac_multigrid_assemble(&ps->mg);
}

/* ---- vectors: interior cells only ------------------------------------------------------------ */

#define FOR_ROWS(l, row)                                                                           \
    for (int k_ = 1; k_ <= (l)->n[2]; k_++)                                                        \
        for (int j_ = 1; j_ <= (l)->n[1]; j_++)                                                    \
            for (size_t row = (size_t)j_ * (l)->stride[1] + (size_t)k_ * (l)->stride[2],           \
                        once_ = 1;                                                                 \
                 once_; once_ = 0)

static double dot(const mac_level *l, const double *x, const double *y)
{
    double sum = 0;
    FOR_ROWS(l, row)
    {
        double part = 0;
        for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) part += x[m] * y[m];
        sum += part;
    }
    return sum;
}

static void remove_mean(const mac_level *l, double *x)
{
    double sum = 0, count = (double)l->n[0] * l->n[1] * l->n[2];
    FOR_ROWS(l, row)
    for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) sum += x[m];
    sum /= count;
    FOR_ROWS(l, row)
    for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) x[m] -= sum;
}

/* y = A x, returns x.y. */
static double multiply(const mac_level *l, double *xs, double *ys)
{
    size_t s1 = l->stride[1], s2 = l->stride[2];
    const double *restrict cx = l->c[0], *restrict cy = l->c[1], *restrict cz = l->c[2];
    mac_level_wrap(l, xs);
    const double *restrict x = xs;
    double *restrict y = ys;
    double sum = 0;
    FOR_ROWS(l, row)
    {
        double part = 0;
        for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) {
            double v = x[m];
            double a = cx[m] * (v - x[m - 1]) + cx[m + 1] * (v - x[m + 1]) +
                       cy[m] * (v - x[m - s1]) + cy[m + s1] * (v - x[m + s1]) +
                       cz[m] * (v - x[m - s2]) + cz[m + s2] * (v - x[m + s2]);
            y[m] = a;
            part += a * v;
        }
        sum += part;
    }
    return sum;
}

void mac_poisson_multiply(mac_poisson *ps, double *x, double *y)
{
    multiply(&ps->mg.level[0], x, y);
}

/* x += a s, r -= a q; returns r.r. */
static double advance(const mac_level *l, double a, double *restrict x, const double *restrict s,
                      double *restrict r, const double *restrict q)
{
    double sum = 0;
    FOR_ROWS(l, row)
    {
        double part = 0;
        for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) {
            x[m] += a * s[m];
            double v = r[m] - a * q[m];
            r[m] = v;
            part += v * v;
        }
        sum += part;
    }
    return sum;
}

/* ---- solver ---------------------------------------------------------------------------------- */

/* The residual lives in the preconditioner's right-hand side, its result in level[0].x. */
mac_poisson_status mac_poisson_solve(mac_poisson *ps, double floor)
{
    mac_level *l = &ps->mg.level[0];
    double *r = l->b, *z = l->x;
    double count = (double)l->n[0] * l->n[1] * l->n[2];
    if (ps->singular) {
        remove_mean(l, ps->b);
        remove_mean(l, ps->x);
    }
    double scale = sqrt(dot(l, ps->b, ps->b));
    ps->iterations = 0;
    ps->residual = 0;
    if (!isfinite(scale)) return MAC_NOT_FINITE;
    if (scale <= floor * sqrt(count)) {
        memset(ps->x, 0, l->size * sizeof *ps->x);
        return MAC_SOLVED;
    }
    multiply(l, ps->x, ps->q);
    memcpy(r, ps->b, l->size * sizeof *r);
    FOR_ROWS(l, row)
    for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) r[m] -= ps->q[m];
    double rr = dot(l, r, r), zr_old = 0;
    while (sqrt(rr) > ps->tolerance * scale) {
        if (!isfinite(rr)) return MAC_NOT_FINITE;
        if (ps->iterations == ps->max_iterations) {
            ps->residual = sqrt(rr) / scale;
            return MAC_NOT_CONVERGED;
        }
        mac_multigrid_apply(&ps->mg);
        if (ps->singular) remove_mean(l, z);
        double zr = dot(l, z, r), beta = ps->iterations ? zr / zr_old : 0;
        FOR_ROWS(l, row)
        for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) ps->s[m] = z[m] + beta * ps->s[m];
        double sq = multiply(l, ps->s, ps->q);
        rr = advance(l, zr / sq, ps->x, ps->s, r, ps->q);
        zr_old = zr;
        ps->iterations++;
    }
    ps->residual = sqrt(rr) / scale;
    return MAC_SOLVED;
}
