/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sum.h - compensated summation, so that a balance over a million particles closes to rounding.
 *
 * Neumaier's variant of Kahan's sum: the error is of the order of one rounding of the result plus
 * one of the sum of magnitudes squared, whatever the number of terms.
 * A. Neumaier, Z. angew. Math. Mech. 54 (1974) 39, doi:10.1002/zamm.19740540106.
 */
#ifndef CPL_SUM_H
#define CPL_SUM_H

#include <math.h>

typedef struct cpl_sum {
    double sum, lost;
} cpl_sum;

static inline void cpl_add(cpl_sum *s, double x)
{
    const double t = s->sum + x;
    s->lost += fabs(s->sum) >= fabs(x) ? (s->sum - t) + x : (x - t) + s->sum;
    s->sum = t;
}

static inline double cpl_total(const cpl_sum *s)
{
    return s->sum + s->lost;
}

#endif
