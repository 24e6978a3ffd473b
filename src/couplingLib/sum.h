/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sum.h - compensated summation, so that a balance over a million particles closes to rounding.
 *
 * The rounding error of every addition is found exactly by Knuth's branch-free two-sum and summed
 * apart: the result is as if summed in twice the precision, whatever the number of terms.
 * T. Ogita, S.M. Rump & S. Oishi, SIAM J. Sci. Comput. 26 (2005) 1955,
 * doi:10.1137/030601818 (Sum2).
 */
#ifndef CPL_SUM_H
#define CPL_SUM_H

typedef struct cpl_sum {
    double sum, lost;
} cpl_sum;

static inline void cpl_add(cpl_sum *s, double x)
{
    const double t = s->sum + x, part = t - s->sum;
    s->lost += (s->sum - (t - part)) + (x - part);
    s->sum = t;
}

static inline double cpl_total(const cpl_sum *s)
{
    return s->sum + s->lost;
}

#endif
