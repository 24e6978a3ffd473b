/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sdf.h - what a shape consists of; for the files that make shapes and for those that walk walls.
 *
 * A shape is a tree. Its leaves are the simple shapes (sdf.c) and surfaces of triangles
 * (sdf_surface.c), its branches unions, intersections and transforms (sdf_combine.c). Complements
 * are carried down to the leaves when they are made, so that none is left.
 *
 * The solid of every shape is the union of the solids of its parts; each part is felt with a
 * contact of its own. A part may be hidden at x: the foot of the perpendicular from x lies within
 * or upon a part that answers there. dem_sdf_eval then returns SDF_HIDDEN, which makes no contact.
 */
#ifndef SDF_H
#define SDF_H

#include "dem.h"

#define SDF_HIDDEN 1e30 /* m: farther than anything, yet squares and sums of it are finite */

struct surface;
struct band;
struct dem_sim;

typedef enum sdf_kind {
    PLANE,
    BOX,
    BOX_INSIDE,
    SPHERE,
    REVOLVED,
    REVOLVED_INSIDE,
    TUBE,
    SHEET,
    SURFACE,
    UNION,
    INTERSECTION,
    TRANSFORM
} sdf_kind;

struct dem_sdf {
    sdf_kind kind;
    int parts;
    double sign;       /* SPHERE, TUBE, SHEET: +1 particles outside, -1 inside */
    double p[3], q[3]; /* PLANE, SPHERE, round shapes: p; BOX*: lower and upper corner */
    double axis[3];    /* normal or axis, unit */
    double across[3];  /* any unit vector normal to the axis: direction used on the axis */
    double r0, r1, h;  /* radii at z = 0 and z = h */
    double ns, nz;     /* unit normal of the side in the meridian plane, pointing off the axis */

    size_t n;                        /* UNION, INTERSECTION, TRANSFORM (1): members */
    dem_sdf **member;                /* [n], owned */
    double (*box)[6];                /* UNION: [n], lower and upper corner of members */
    double turn[9], shift[3], scale; /* TRANSFORM: x = scale turn x_member + shift */

    struct surface *surface; /* SURFACE: triangles, owned */
    struct band *band;       /* SURFACE: its samples, owned, or NULL: exact */
    double spacing;          /* SURFACE: wanted, m, or 0 */
};

/* A new shape of nothing but its kind and number of parts, or NULL. */
dem_sdf *sdf_new(sdf_kind kind, int parts);
/* dem_sdf_eval() for who comes back to about the same place: hint is 0 at first and then left
 * alone. */
double sdf_eval_again(const dem_sdf *sdf, int part, const double x[3], double gradient[3],
                      uint32_t *hint);

/* Ask memory for what that will read. */
void sdf_fetch(const dem_sdf *sdf, const double x[3], uint32_t hint);

/**
 * Whether part `part` may come to be felt by a sphere about x whose radius and coming motion add up
 * to `reach`. Cheap, and on the safe side: hidden parts count, too, as they may come into view by
 * that motion. Use it for lists that live for a while, and dem_sdf_eval for what is now.
 */
int sdf_near(const dem_sdf *sdf, int part, const double x[3], double reach);

/* Progress of long work: `done` goes from 0 to 1. */
typedef struct sdf_progress {
    void (*call)(void *context, const char *what, double done); /* or NULL */
    void *context;
    struct dem_sim *sim; /* whose ranks share the work, or NULL: this one alone */
} sdf_progress;

/**
 * Sample the triangle surfaces within the shape; the analytic shapes stay exact. spacing: of the
 * samples where the surface itself does not ask for another, m; width: distances up to it must be
 * right (largest radius + skin), m. cache: directory that keeps the samples, made when missing, or
 * NULL. DEM_OK with a text in `message` is a note (a cache that was damaged or could not be
 * written; on the rank that looked after it, the first). Shapes that are sampled already are left
 * alone. Collective over the ranks of progress->sim.
 */
dem_status sdf_sample(dem_sdf *sdf, double spacing, double width, const char *cache,
                      const sdf_progress *progress, char *message, size_t size);

/* What dem_sdf_eval and the like come down to, by kind. */
double sdf_eval_combined(const dem_sdf *sdf, int part, const double x[3], double g[3]);
double sdf_eval_surface(const dem_sdf *sdf, int part, const double x[3], double g[3],
                        uint32_t *hint);
double sdf_distance_combined(const dem_sdf *sdf, const double x[3]);
double sdf_distance_surface(const dem_sdf *sdf, const double x[3]);
int sdf_near_combined(const dem_sdf *sdf, int part, const double x[3], double reach);
int sdf_near_surface(const dem_sdf *sdf, int part, const double x[3], double reach);
void sdf_bounds_simple(const dem_sdf *sdf, double lo[3], double hi[3]);
void sdf_bounds_combined(const dem_sdf *sdf, double lo[3], double hi[3]);
void sdf_bounds_surface(const dem_sdf *sdf, double lo[3], double hi[3]);
size_t sdf_memory_surface(const dem_sdf *sdf);
/* Turn solid and free space about, in place; 0, or -1: out of memory. */
int sdf_turn_simple(dem_sdf *sdf);
int sdf_turn_surface(dem_sdf *sdf);
void sdf_free_surface(dem_sdf *sdf);
dem_status sdf_sample_surface(dem_sdf *sdf, double spacing, double width, const char *cache,
                              const sdf_progress *progress, char *message, size_t size);
/* Parts of a branch by its members; 0: more than can be handled. */
int sdf_count_parts(const dem_sdf *sdf);
/* How far the distances of the shape may be off the true ones, m; 0 where they are exact. */
double sdf_fuzz(const dem_sdf *sdf);

#endif
