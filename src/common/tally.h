/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * tally.h - a sum that keeps its rounding errors apart, so that a million terms close a balance.
 *
 * Knuth's two-sum finds the error of every addition exactly; as if summed in twice the precision.
 * Ogita, Rump & Oishi, SIAM J. Sci. Comput. 26 (2005) 1955, doi:10.1137/030601818.
 */
#ifndef TALLY_H
#define TALLY_H

typedef struct tally {
    double sum, lost;
} tally;

static inline void tally_add(tally *t, double x)
{
    const double sum = t->sum + x, part = sum - t->sum;
    t->lost += (t->sum - (sum - part)) + (x - part);
    t->sum = sum;
}

static inline double tally_total(const tally *t)
{
    return t->sum + t->lost;
}

#endif
