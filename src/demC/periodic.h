/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * periodic.h - positions brought into the domain, everywhere with the same bits.
 */
#ifndef PERIODIC_H
#define PERIODIC_H

#include <math.h>

/* x in a periodic direction from lo to hi: lo belongs to it, hi does not. */
static inline double wrap_along(double x, double lo, double hi)
{
    const double inside = x - floor((x - lo) / (hi - lo)) * (hi - lo);
    return inside < hi ? inside : lo; /* a step below lo rounds to hi */
}

static inline void wrap_into(double x[3], const double lo[3], const double hi[3],
                             const int periodic[3])
{
    for (int a = 0; a < 3; a++)
        if (periodic[a]) x[a] = wrap_along(x[a], lo[a], hi[a]);
}

#endif
