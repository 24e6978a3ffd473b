/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sdf_tree.c - making and unmaking of shapes of shapes, and boxes around them.
 *
 * What is evaluated, and how, is in sdf_combine.c. A branch keeps its members and what follows from
 * them: the number of its parts and, for a union, the boxes around the solids of its members, which
 * tell quickly that a member hides nothing.
 */
#include "sdf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- boxes ----------------------------------------------------------------------------------- */

/* Image of a box under a transform; infinite sides stay so unless their factor is 0. */
static void transform_box(const dem_sdf *s, double lo[3], double hi[3])
{
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        low[i] = high[i] = s->shift[i];
        for (int j = 0; j < 3; j++) {
            const double f = s->scale * s->turn[3 * i + j];
            if (f == 0.) continue;
            low[i] += f * (f > 0. ? lo[j] : hi[j]);
            high[i] += f * (f > 0. ? hi[j] : lo[j]);
        }
    }
    memcpy(lo, low, sizeof low);
    memcpy(hi, high, sizeof high);
}

/* Box around the solid, where dem_sdf_bounds has the surface: a container's solid has no end. */
static void solid_box(const dem_sdf *s, double lo[3], double hi[3])
{
    const int container = s->kind == BOX_INSIDE || s->kind == REVOLVED_INSIDE ||
                          (s->kind != SHEET && s->kind != PLANE && s->sign < 0.);
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        const int all = s->kind == INTERSECTION || container || s->kind == PLANE;
        lo[i] = all ? -INFINITY : INFINITY;
        hi[i] = -lo[i];
        if (s->kind == PLANE && s->axis[i] == 1.) hi[i] = s->p[i];
        if (s->kind == PLANE && s->axis[i] == -1.) lo[i] = s->p[i];
    }
    if (s->n == 0 && !container && s->kind != PLANE) dem_sdf_bounds(s, lo, hi);
    for (size_t k = 0; k < s->n; k++) {
        solid_box(s->member[k], low, high);
        for (int i = 0; i < 3; i++) {
            const int both = s->kind == INTERSECTION;
            lo[i] = both ? fmax(lo[i], low[i]) : fmin(lo[i], low[i]);
            hi[i] = both ? fmin(hi[i], high[i]) : fmax(hi[i], high[i]);
        }
    }
    if (s->kind == TRANSFORM) transform_box(s, lo, hi);
}

void sdf_bounds_combined(const dem_sdf *s, double lo[3], double hi[3])
{
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        lo[i] = INFINITY;
        hi[i] = -INFINITY;
    }
    for (size_t k = 0; k < s->n; k++) {
        dem_sdf_bounds(s->member[k], low, high);
        for (int i = 0; i < 3; i++) {
            lo[i] = fmin(lo[i], low[i]);
            hi[i] = fmax(hi[i], high[i]);
        }
    }
    if (s->kind == TRANSFORM) transform_box(s, lo, hi);
    if (s->kind != INTERSECTION) return;
    solid_box(s, low, high);
    for (int i = 0; i < 3; i++) {
        lo[i] = fmax(lo[i], low[i]);
        hi[i] = fmin(hi[i], high[i]);
    }
}

/* ---- branches -------------------------------------------------------------------------------- */

/* What follows from the members; 0, or -1: out of memory, or more than can be handled. */
static int settle(dem_sdf *s)
{
    free(s->box);
    s->box = NULL;
    s->sign = 1.;
    s->parts = sdf_count_parts(s);
    if (s->parts <= 0) return -1;
    if (s->kind != UNION) return 0;
    s->box = malloc(s->n * sizeof *s->box);
    if (s->box == NULL) return -1;
    for (size_t k = 0; k < s->n; k++) solid_box(s->member[k], s->box[k], s->box[k] + 3);
    return 0;
}

static dem_sdf *branch_new(sdf_kind kind, size_t n, dem_sdf *const *member)
{
    dem_sdf *s = sdf_new(kind, 0);
    dem_sdf **own = malloc((n ? n : 1) * sizeof(dem_sdf *));
    int bad = n == 0 || s == NULL || own == NULL;
    for (size_t k = 0; k < n; k++) bad |= member[k] == NULL;
    if (bad) {
        for (size_t k = 0; k < n; k++) dem_sdf_free(member[k]);
        free(own);
        free(s);
        return NULL;
    }
    memcpy(own, member, n * sizeof(dem_sdf *));
    s->member = own;
    s->n = n;
    return s;
}

static dem_sdf *finished(dem_sdf *s)
{
    if (s != NULL && settle(s) == 0) return s;
    dem_sdf_free(s);
    return NULL;
}

dem_sdf *dem_sdf_union(size_t n, dem_sdf *const *member)
{
    return finished(branch_new(UNION, n, member));
}

dem_sdf *dem_sdf_intersection(size_t n, dem_sdf *const *member)
{
    return finished(branch_new(INTERSECTION, n, member));
}

/* De Morgan, from the leaves up, as branches settle on what their members are. */
static int turn(dem_sdf *s)
{
    if (s->kind == SURFACE) return sdf_turn_surface(s);
    if (s->n == 0) return sdf_turn_simple(s);
    for (size_t k = 0; k < s->n; k++)
        if (turn(s->member[k])) return -1;
    if (s->kind != TRANSFORM) s->kind = s->kind == UNION ? INTERSECTION : UNION;
    return settle(s);
}

dem_sdf *dem_sdf_complement(dem_sdf *member)
{
    if (member == NULL || turn(member) == 0) return member;
    dem_sdf_free(member);
    return NULL;
}

/* Rotation matrix of an angle about a unit axis (Rodrigues). */
static void rotation(const double axis[3], double angle, double turn[9])
{
    const double c = cos(angle), s = sin(angle);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        turn[3 * i + i] = c + (1. - c) * axis[i] * axis[i];
        turn[3 * i + j] = (1. - c) * axis[i] * axis[j] - s * axis[k];
        turn[3 * i + k] = (1. - c) * axis[i] * axis[k] + s * axis[j];
    }
}

dem_sdf *dem_sdf_transform(dem_sdf *member, double scale, const double axis[3], double angle,
                           const double translation[3])
{
    double unit[3] = {0., 0., 1.};
    const double length = angle == 0. ? 1. : hypot(hypot(axis[0], axis[1]), axis[2]);
    int bad = !(scale > 0.) || !isfinite(scale) || !isfinite(angle);
    bad |= !(length > 0.) || !isfinite(length);
    for (int i = 0; i < 3; i++) bad |= !isfinite(translation[i]);
    dem_sdf *s = bad ? NULL : branch_new(TRANSFORM, 1, &member);
    if (bad) dem_sdf_free(member);
    if (s == NULL) return NULL;
    for (int i = 0; i < 3; i++) {
        if (angle != 0.) unit[i] = axis[i] / length;
        s->shift[i] = translation[i];
    }
    s->scale = scale;
    rotation(unit, angle, s->turn);
    return finished(s);
}

/* ---- sampling -------------------------------------------------------------------------------- */

/* Leaves what is in `message` unless there is something to say. */
static dem_status sample(dem_sdf *s, double spacing, double width, const char *cache,
                         const sdf_progress *progress, char *message, size_t size)
{
    if (s->kind == SURFACE)
        return sdf_sample_surface(s, spacing, width, cache, progress, message, size);
    const double scale = s->kind == TRANSFORM ? s->scale : 1.;
    dem_status status = DEM_OK;
    for (size_t k = 0; k < s->n && !status; k++)
        status =
            sample(s->member[k], spacing / scale, width / scale, cache, progress, message, size);
    return status;
}

dem_status sdf_sample(dem_sdf *s, double spacing, double width, const char *cache,
                      const sdf_progress *progress, char *message, size_t size)
{
    if (size > 0) message[0] = '\0';
    return sample(s, spacing, width, cache, progress, message, size);
}
