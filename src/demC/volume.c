/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * volume.c - the volume of a region given by its signed distance function.
 *
 * An octree over the box: what the distance shows to lie on one side counts whole or not at all,
 * and the smallest boxes count by the plane of the distance function at their centre.
 */
#include "insert.h"

#include <math.h>
#include <string.h>

enum { DEEPEST = 8 }; /* levels of the octree */

/* Volume share of a box, half widths w, on the positive side of the plane phi + g.(x - centre) = 0:
 * the chance that phi + sum g_a w_a t_a > 0 with t_a uniform in (-1, 1), by the closed form of
 * the sum of uniform variables (inclusion and exclusion over the corners). */
static double plane_share(double phi, const double g[3], const double w[3])
{
    double e[3], largest = 0., corner = phi, divisor = 1.;
    int n = 0;
    for (int a = 0; a < 3; a++) largest = fmax(largest, fabs(g[a]) * w[a]);
    for (int a = 0; a < 3; a++) {
        const double width = fabs(g[a]) * w[a];
        if (width <= 1e-4 * largest) continue; /* a plane across this axis: cancellation */
        e[n++] = 2. * width;
        corner += width;
        divisor *= n * 2. * width;
    }
    if (n == 0) return phi > 0. ? 1. : 0.;
    double sum = 0.;
    for (int bits = 0; bits < 1 << n; bits++) {
        double value = corner, sign = 1.;
        for (int a = 0; a < n; a++)
            if (bits >> a & 1) {
                value -= e[a];
                sign = -sign;
            }
        if (value > 0.) sum += sign * pow(value, n);
    }
    return fmin(fmax(sum / divisor, 0.), 1.);
}

static double box_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                         const int skip[3], int level)
{
    double centre[3], w[3], g[3], nearest_g[3] = {1., 0., 0.}, phi = INFINITY;
    for (int a = 0; a < 3; a++) {
        centre[a] = .5 * (lo[a] + hi[a]);
        w[a] = .5 * (hi[a] - lo[a]);
    }
    const double volume = 8. * w[0] * w[1] * w[2];
    for (int part = 0; part < dem_sdf_parts(region); part++) {
        const double value = dem_sdf_eval(region, part, centre, g);
        int open = 0;
        for (int a = 0; a < 3; a++) open |= skip[a] && fabs(g[a]) > 1. - 1e-12;
        if (open || value >= phi) continue;
        phi = value;
        memcpy(nearest_g, g, sizeof g);
    }
    /* phi changes by no more than the distance: such a box is not cut. */
    if (fabs(phi) >= sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])) return phi > 0. ? volume : 0.;
    if (level == DEEPEST) return volume * plane_share(phi, nearest_g, w);
    double sum = 0.;
    for (int octant = 0; octant < 8; octant++) {
        double low[3], high[3];
        for (int a = 0; a < 3; a++) {
            low[a] = octant >> a & 1 ? centre[a] : lo[a];
            high[a] = octant >> a & 1 ? hi[a] : centre[a];
        }
        sum += box_volume(region, low, high, skip, level + 1);
    }
    return sum;
}

double insert_region_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                            const int skip[3])
{
    for (int a = 0; a < 3; a++)
        if (!(hi[a] > lo[a])) return 0.;
    return box_volume(region, lo, hi, skip, 0);
}
