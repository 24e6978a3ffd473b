/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * region.c - where particles are made or taken away: the inside of a shape.
 */
#include "particles.h"

#include <math.h>
#include <string.h>

/* |grad phi| <= 1, so phi is below zero all over a box if it is below minus the half diagonal at
 * the centre. */
static int search(size_t n, const dem_sdf *const *shape, const double centre[3],
                  const double half[3], int level)
{
    const double reach = sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);
    double phi = INFINITY;
    for (size_t i = 0; i < n; i++) phi = fmin(phi, dem_sdf_distance(shape[i], centre));
    if (phi > 0) return 1;
    if (phi < -reach || level == 0) return 0;
    const double quarter[3] = {.5 * half[0], .5 * half[1], .5 * half[2]};
    for (int octant = 0; octant < 8; octant++) {
        double at[3];
        for (int a = 0; a < 3; a++)
            at[a] = centre[a] + (octant >> a & 1 ? quarter[a] : -quarter[a]);
        if (search(n, shape, at, quarter, level - 1)) return 1;
    }
    return 0;
}

int has_room(size_t n, const dem_sdf *const *shape, const double lo[3], const double hi[3],
             int level)
{
    double centre[3], half[3];
    for (int a = 0; a < 3; a++) {
        centre[a] = .5 * (lo[a] + hi[a]);
        half[a] = .5 * (hi[a] - lo[a]);
    }
    return search(n, shape, centre, half, level);
}

/* Does the region really reach beyond the domain in direction a, on its lower or upper side? The
 * box of a shape of shapes may be larger than the shape. */
static int reaches(const dem_sdf *region, const extent *box, const dem_param *param, int a,
                   int above)
{
    enum { LEVELS = 6 };
    double lo[3], hi[3];
    if (!box->loose) return 1;
    for (int b = 0; b < 3; b++) { /* what is not bounded is looked at for one domain more */
        const double far = param->hi[b] - param->lo[b];
        lo[b] = fmax(box->lo[b], param->lo[b] - far);
        hi[b] = fmin(box->hi[b], param->hi[b] + far);
    }
    if (above)
        lo[a] = param->hi[a];
    else
        hi[a] = param->lo[a];
    return has_room(1, &region, lo, hi, LEVELS);
}

static void check_within(particle_reader *reader, const case_dict *dict, const dem_sdf *region,
                         extent *box)
{
    const dem_param *param = reader->param;
    for (int a = 0; a < 3; a++) {
        const double slack = 1e-9 * (param->hi[a] - param->lo[a]); /* one number in two files */
        const int below = box->lo[a] < param->lo[a] - slack && reaches(region, box, param, a, 0);
        const int above = box->hi[a] > param->hi[a] + slack && reaches(region, box, param, a, 1);
        const char *key = above ? "max" : "min";
        if (below || above)
            key_error(reader->errors, dict, case_has(dict, key) ? key : "",
                      "the region reaches from %g to %g m in %c, beyond the %s, %g to %g m",
                      box->lo[a], box->hi[a], "xyz"[a], reader -> mesh ? "mesh" : "domain",
                      param->lo[a], param->hi[a]);
    }
    for (int a = 0; a < 3 && box->loose; a++) {
        box->lo[a] = fmax(box->lo[a], param->lo[a]);
        box->hi[a] = fmin(box->hi[a], param->hi[a]);
    }
}

dem_sdf *read_region(particle_reader *reader, const case_dict *dict, int within, double lo[3],
                     double hi[3])
{
    const case_dict *region = case_sub(dict, "region", 1, reader->errors);
    extent box = {{NAN, NAN, NAN}, {NAN, NAN, NAN}, 0};
    dem_sdf *sdf = region ? read_shape(reader, region, 1, &box) : NULL;
    if (sdf && within) check_within(reader, region, sdf, &box);
    memcpy(lo, box.lo, sizeof box.lo);
    memcpy(hi, box.hi, sizeof box.hi);
    return sdf;
}
