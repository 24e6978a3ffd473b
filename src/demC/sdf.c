/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sdf.c - walls and regions as exact signed distance functions of simple shapes.
 *
 * phi(x) is the distance to the surface, positive where particles may be; its gradient is a unit
 * vector wherever phi is differentiable, and a one-sided limit of it (still of unit length)
 * elsewhere: on an edge, an axis or a medial surface.
 *
 * A solid seen from outside is one part: the distance to the whole surface, so that an edge or a
 * corner is felt once, from its own direction. A container (`inside`) is the intersection of
 * convex half-spaces and has one part for each smooth face, so that a particle in a corner feels
 * each face with a contact of its own. Because the container is convex, a face continued beyond
 * its edges never reaches into it, and the smallest part is the exact distance everywhere within;
 * out of an edge of the container, deep in the solid, it is a lower bound of the depth.
 *
 * Bodies of revolution are worked in their meridian half-plane (z along the axis, s >= 0 off it):
 *
 *     solid             polygon (0,0) (r0,0) (r1,h) (0,h): nearest of three segments, sign by side
 *     container         side line, two discs, each as a half-plane
 *     open frustum      the bare segment (r0,0)-(r1,h)
 *
 * The open frustum is a sheet without thickness: a funnel or, with r0 = r1, a tube. It has two
 * free rims, hence no inside in the strict sense: any sign would have to jump somewhere beyond a
 * rim, where particles pass. So its distance is the unsigned one, which is continuous
 * everywhere: the sheet pushes back from both of its sides, and a rim is a sharp ring felt from all
 * around, not an endless cone. `inside` then only says to which side a centre is pushed that lies
 * exactly on the sheet. (A sheet holds particles whose overlap stays below their radius.)
 *
 * Reference for distance functions and their gradients: Osher & Fedkiw, Level Set Methods and
 * Dynamic Implicit Surfaces, Springer (2003), ch. 2, doi:10.1007/b98879. For their use as DEM
 * walls: Shigeto & Sakai, Chem. Eng. J. 231 (2013) 464, doi:10.1016/j.cej.2013.07.073.
 */
#include "band.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out = a / |a|; the length, or 0 when it is not a positive finite number. hypot: no overflow. */
static double normalise(const double a[3], double out[3])
{
    const double length = hypot(hypot(a[0], a[1]), a[2]);
    if (!(length > 0.) || !isfinite(length)) return 0.;
    for (int i = 0; i < 3; i++) out[i] = a[i] / length;
    return length;
}

static int all_finite(const double a[3])
{
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]);
}

dem_sdf *sdf_new(sdf_kind kind, int parts)
{
    dem_sdf *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    s->kind = kind;
    s->parts = parts;
    s->sign = 1.;
    return s;
}

/* ---- constructors ---------------------------------------------------------------------------- */

dem_sdf *dem_sdf_plane(const double point[3], const double normal[3])
{
    double n[3];
    if (!all_finite(point) || normalise(normal, n) == 0.) return NULL;
    dem_sdf *s = sdf_new(PLANE, 1);
    if (s == NULL) return NULL;
    for (int i = 0; i < 3; i++) {
        s->p[i] = point[i];
        s->axis[i] = n[i];
    }
    return s;
}

dem_sdf *dem_sdf_box(const double lo[3], const double hi[3], int inside)
{
    for (int i = 0; i < 3; i++)
        if (!isfinite(lo[i]) || !isfinite(hi[i]) || !(hi[i] > lo[i])) return NULL;
    dem_sdf *s = inside ? sdf_new(BOX_INSIDE, 6) : sdf_new(BOX, 1);
    if (s == NULL) return NULL;
    for (int i = 0; i < 3; i++) {
        s->p[i] = lo[i];
        s->q[i] = hi[i];
    }
    return s;
}

dem_sdf *dem_sdf_sphere(const double centre[3], double radius, int inside)
{
    if (!all_finite(centre) || !isfinite(radius) || !(radius > 0.)) return NULL;
    dem_sdf *s = sdf_new(SPHERE, 1);
    if (s == NULL) return NULL;
    for (int i = 0; i < 3; i++) s->p[i] = centre[i];
    s->r0 = radius;
    s->sign = inside ? -1. : 1.;
    return s;
}

/* A shape of revolution about p0 -> p1. NULL when its axis or radii are degenerate. */
static dem_sdf *revolved_new(const double p0[3], const double p1[3], double r0, double r1,
                             sdf_kind kind, int inside)
{
    double axis[3];
    const double d[3] = {p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]};
    const double h = normalise(d, axis);
    if (!all_finite(p0) || h == 0. || !isfinite(r0) || !isfinite(r1)) return NULL;
    if (r0 < 0. || r1 < 0. || !(r0 + r1 > 0.)) return NULL;
    dem_sdf *s = sdf_new(kind, kind == REVOLVED_INSIDE ? 3 : 1);
    if (s == NULL) return NULL;

    /* Gram-Schmidt on the coordinate axis that is farthest from the axis of the shape. */
    int least = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(axis[i]) < fabs(axis[least])) least = i;
    double across[3];
    for (int i = 0; i < 3; i++) across[i] = (i == least) - axis[least] * axis[i];
    normalise(across, s->across);

    const double slant = hypot(h, r1 - r0);
    for (int i = 0; i < 3; i++) {
        s->p[i] = p0[i];
        s->axis[i] = axis[i];
    }
    s->r0 = r0;
    s->r1 = r1;
    s->h = h;
    s->ns = h / slant;
    s->nz = (r0 - r1) / slant;
    s->sign = inside ? -1. : 1.;
    return s;
}

dem_sdf *dem_sdf_cylinder(const double p0[3], const double p1[3], double radius, int closed,
                          int inside)
{
    const sdf_kind kind = !closed ? TUBE : inside ? REVOLVED_INSIDE : REVOLVED;
    return revolved_new(p0, p1, radius, radius, kind, inside);
}

dem_sdf *dem_sdf_cone(const double p0[3], const double p1[3], double r0, double r1, int closed,
                      int inside)
{
    const sdf_kind kind = !closed ? SHEET : inside ? REVOLVED_INSIDE : REVOLVED;
    return revolved_new(p0, p1, r0, r1, kind, inside);
}

/* Solid and free space change places: a solid becomes the container of the same surface. */
int sdf_turn_simple(dem_sdf *s)
{
    switch (s->kind) {
    case PLANE:
        for (int i = 0; i < 3; i++) s->axis[i] = -s->axis[i];
        break;
    case BOX:
        s->kind = BOX_INSIDE;
        s->parts = 6;
        break;
    case BOX_INSIDE:
        s->kind = BOX;
        s->parts = 1;
        break;
    case REVOLVED:
        s->kind = REVOLVED_INSIDE;
        s->parts = 3;
        break;
    case REVOLVED_INSIDE:
        s->kind = REVOLVED;
        s->parts = 1;
        break;
    default:
        s->sign = -s->sign;
        break;
    }
    return 0;
}

void dem_sdf_free(dem_sdf *sdf)
{
    if (sdf == NULL) return;
    for (size_t k = 0; k < sdf->n; k++) dem_sdf_free(sdf->member[k]);
    if (sdf->kind == SURFACE) sdf_free_surface(sdf);
    free(sdf->member);
    free(sdf->box);
    free(sdf);
}

/* ---- shapes bounded by planes ---------------------------------------------------------------- */

static double eval_plane(const dem_sdf *s, const double x[3], double g[3])
{
    const double d[3] = {x[0] - s->p[0], x[1] - s->p[1], x[2] - s->p[2]};
    for (int i = 0; i < 3; i++) g[i] = s->axis[i];
    return dot(d, s->axis);
}

/* Face `part` of a box seen from within: -x, +x, -y, +y, -z, +z. */
static double eval_face(const dem_sdf *s, int part, const double x[3], double g[3])
{
    const int a = part / 2, upper = part % 2;
    for (int i = 0; i < 3; i++) g[i] = 0.;
    g[a] = upper ? -1. : 1.;
    return upper ? s->q[a] - x[a] : x[a] - s->p[a];
}

/* A solid box: outside, the distance to the nearest face, edge or corner; within, minus the
 * distance to the nearest face. */
static double eval_box(const dem_sdf *s, const double x[3], double g[3])
{
    double excess[3], sum = 0.;
    int deepest = 0;
    for (int i = 0; i < 3; i++) {
        const double below = s->p[i] - x[i], above = x[i] - s->q[i];
        const int upper = above > below;
        const double e = upper ? above : below;
        excess[i] = e;
        g[i] = upper ? 1. : -1.;
        if (e > 0.) sum += e * e;
        if (e > excess[deepest]) deepest = i;
    }
    if (sum > 0.) {
        const double distance = sqrt(sum);
        for (int i = 0; i < 3; i++) g[i] *= fmax(excess[i], 0.) / distance;
        return distance;
    }
    for (int i = 0; i < 3; i++)
        if (i != deepest) g[i] = 0.;
    return excess[deepest];
}

/* ---- round shapes ---------------------------------------------------------------------------- */

static double eval_sphere(const dem_sdf *s, const double x[3], double g[3])
{
    const double d[3] = {x[0] - s->p[0], x[1] - s->p[1], x[2] - s->p[2]};
    const double distance = sqrt(dot(d, d));
    if (distance > 0.) {
        for (int i = 0; i < 3; i++) g[i] = s->sign * d[i] / distance;
    } else {
        g[0] = s->sign; /* any direction is as good at the centre */
        g[1] = g[2] = 0.;
    }
    return s->sign * (distance - s->r0);
}

/* A distance in the meridian plane with its gradient. */
typedef struct meridian {
    double phi, gs, gz;
} meridian;

/* Nearest point of the segment a -> b; `depth` is the distance off its line along (ns, nz). */
typedef struct foot {
    double distance, depth; /* depth: signed by the side */
    double s, z;            /* from the foot to the point, when the foot is an end */
    int on_end;
} foot;

static foot nearest(double s, double z, double as, double az, double bs, double bz, double ns,
                    double nz)
{
    const double ts = bs - as, tz = bz - az, length2 = ts * ts + tz * tz;
    const double t = length2 > 0. ? ((s - as) * ts + (z - az) * tz) / length2 : 0.;
    foot f = {.depth = (s - as) * ns + (z - az) * nz};
    if (t > 0. && t < 1.) {
        f.distance = fabs(f.depth);
        return f;
    }
    f.on_end = 1;
    f.s = s - (t > 0. ? bs : as);
    f.z = z - (t > 0. ? bz : az);
    f.distance = hypot(f.s, f.z);
    return f;
}

/* From the nearest foot to phi and gradient: from the corner outwards, or the face's normal, which
 * is used as it is rather than as (x - foot)/distance: that loses digits close to the surface. */
static meridian from_foot(const foot *f, double ns, double nz, double sign)
{
    if (f->on_end && f->distance > 0.)
        return (meridian){sign * f->distance, sign * f->s / f->distance, sign * f->z / f->distance};
    return (meridian){sign * f->distance, ns, nz};
}

/* Solid frustum: the nearest of bottom disc, side and top disc. */
static meridian eval_solid(const dem_sdf *c, double s, double z)
{
    const foot bottom = nearest(s, z, 0., 0., c->r0, 0., 0., -1.);
    const foot side = nearest(s, z, c->r0, 0., c->r1, c->h, c->ns, c->nz);
    const foot top = nearest(s, z, 0., c->h, c->r1, c->h, 0., 1.);
    const int within = bottom.depth < 0. && side.depth < 0. && top.depth < 0.;
    const double sign = within ? -1. : 1.;
    if (side.distance <= bottom.distance && side.distance <= top.distance && !side.on_end)
        return from_foot(&side, c->ns, c->nz, sign);
    /* On a shared corner the discs answer: their ends at the rim are the side's ends, and on the
     * axis, the other end, the way to the foot is the normal anyhow. */
    const int lower = bottom.distance <= top.distance;
    return from_foot(lower ? &bottom : &top, 0., lower ? -1. : 1., sign);
}

static meridian eval_sheet(const dem_sdf *c, double s, double z)
{
    const foot f = nearest(s, z, c->r0, 0., c->r1, c->h, c->ns, c->nz);
    if (f.on_end && f.distance > 0.) return from_foot(&f, c->ns, c->nz, 1.);
    const double side = f.depth > 0. ? 1. : f.depth < 0. ? -1. : c->sign;
    return (meridian){f.distance, side * c->ns, side * c->nz};
}

/* A closed container: side, bottom, top, each a half-plane. */
static meridian eval_container(const dem_sdf *c, int part, double s, double z)
{
    if (part == 1) return (meridian){z, 0., 1.};
    if (part == 2) return (meridian){c->h - z, 0., -1.};
    return (meridian){-(s - c->r0) * c->ns - z * c->nz, -c->ns, -c->nz};
}

static double eval_round(const dem_sdf *c, int part, const double x[3], double g[3])
{
    const double d[3] = {x[0] - c->p[0], x[1] - c->p[1], x[2] - c->p[2]};
    const double z = dot(d, c->axis);
    double off[3];
    for (int i = 0; i < 3; i++) off[i] = d[i] - z * c->axis[i];
    const double s = sqrt(dot(off, off));
    for (int i = 0; i < 3; i++) off[i] = s > 0. ? off[i] / s : c->across[i];

    meridian m;
    switch (c->kind) {
    case REVOLVED:
        m = eval_solid(c, s, z);
        break;
    case SHEET:
        m = eval_sheet(c, s, z);
        break;
    case REVOLVED_INSIDE:
        m = eval_container(c, part, s, z);
        break;
    default:
        m = (meridian){c->sign * (s - c->r0), c->sign, 0.};
        break; /* endless tube */
    }
    for (int i = 0; i < 3; i++) g[i] = m.gs * off[i] + m.gz * c->axis[i];
    return m.phi;
}

/* ---- bounds ---------------------------------------------------------------------------------- */

/* A plane has bounds only along a coordinate axis that is its normal, and an endless tube only
 * across one that is its axis. A disc of radius r reaches r sqrt(1 - a_i^2) along i. */
void sdf_bounds_simple(const dem_sdf *s, double lo[3], double hi[3])
{
    for (int i = 0; i < 3; i++) {
        const double reach = sqrt(fmax(0., 1. - s->axis[i] * s->axis[i]));
        switch (s->kind) {
        case PLANE:
            lo[i] = fabs(s->axis[i]) == 1. ? s->p[i] : -INFINITY;
            hi[i] = fabs(s->axis[i]) == 1. ? s->p[i] : INFINITY;
            break;
        case BOX:
        case BOX_INSIDE:
            lo[i] = s->p[i];
            hi[i] = s->q[i];
            break;
        case SPHERE:
            lo[i] = s->p[i] - s->r0;
            hi[i] = s->p[i] + s->r0;
            break;
        case TUBE:
            lo[i] = s->axis[i] == 0. ? s->p[i] - s->r0 : -INFINITY;
            hi[i] = s->axis[i] == 0. ? s->p[i] + s->r0 : INFINITY;
            break;
        default: { /* two discs and what is between them */
            const double top = s->p[i] + s->h * s->axis[i];
            lo[i] = fmin(s->p[i] - s->r0 * reach, top - s->r1 * reach);
            hi[i] = fmax(s->p[i] + s->r0 * reach, top + s->r1 * reach);
        }
        }
    }
}

void dem_sdf_bounds(const dem_sdf *sdf, double lo[3], double hi[3])
{
    if (sdf->kind == SURFACE)
        sdf_bounds_surface(sdf, lo, hi);
    else if (sdf->n > 0)
        sdf_bounds_combined(sdf, lo, hi);
    else
        sdf_bounds_simple(sdf, lo, hi);
}

size_t dem_sdf_memory(const dem_sdf *sdf)
{
    size_t sum = sizeof *sdf + sdf->n * sizeof *sdf->member;
    if (sdf->box != NULL) sum += sdf->n * sizeof *sdf->box;
    for (size_t k = 0; k < sdf->n; k++) sum += dem_sdf_memory(sdf->member[k]);
    return sdf->kind == SURFACE ? sum + sdf_memory_surface(sdf) : sum;
}

/* ---- evaluation ------------------------------------------------------------------------------ */

int dem_sdf_parts(const dem_sdf *sdf)
{
    return sdf->parts;
}

double dem_sdf_eval(const dem_sdf *sdf, int part, const double x[3], double gradient[3])
{
    switch (sdf->kind) {
    case PLANE:
        return eval_plane(sdf, x, gradient);
    case BOX:
        return eval_box(sdf, x, gradient);
    case BOX_INSIDE:
        return eval_face(sdf, part, x, gradient);
    case SPHERE:
        return eval_sphere(sdf, x, gradient);
    case SURFACE:
        return sdf_eval_surface(sdf, part, x, gradient, NULL);
    case UNION:
    case INTERSECTION:
    case TRANSFORM:
        return sdf_eval_combined(sdf, part, x, gradient);
    default:
        return eval_round(sdf, part, x, gradient);
    }
}

double sdf_eval_again(const dem_sdf *sdf, int part, const double x[3], double gradient[3],
                      uint32_t *hint)
{
    return sdf->kind == SURFACE ? sdf_eval_surface(sdf, part, x, gradient, hint)
                                : dem_sdf_eval(sdf, part, x, gradient);
}

void sdf_fetch(const dem_sdf *sdf, const double x[3], uint32_t hint)
{
    if (sdf->kind == SURFACE && sdf->band) band_fetch(sdf->band, x, hint);
}

double dem_sdf_distance(const dem_sdf *sdf, const double x[3])
{
    if (sdf->kind == SURFACE) return sdf_distance_surface(sdf, x);
    if (sdf->n > 0) return sdf_distance_combined(sdf, x);
    double least = DBL_MAX, gradient[3];
    for (int part = 0; part < sdf->parts; part++)
        least = fmin(least, dem_sdf_eval(sdf, part, x, gradient));
    return least;
}

int sdf_near(const dem_sdf *sdf, int part, const double x[3], double reach)
{
    double gradient[3];
    if (sdf->kind == SURFACE) return sdf_near_surface(sdf, part, x, reach);
    if (sdf->n > 0) return sdf_near_combined(sdf, part, x, reach);
    return dem_sdf_eval(sdf, part, x, gradient) < reach;
}
