/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sdf_surface.c - walls and regions from STL files: a surface of triangles as a shape.
 *
 * Until it is sampled the distance is exact, by search among the triangles (surface_search.c).
 * Sampled (band.c), it is the trilinear interpolant, which has an error of order h^2 times
 * curvature on smooth faces, none on flat ones, and of order h within a cell of an edge. Beyond the
 * band, a part is at its width and makes no contact; deep in the solid the triangles are asked
 * again.
 */
#include "band.h"
#include "dem_internal.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

dem_stl dem_stl_default(void)
{
    return (dem_stl){.scale = 1., .feature_angle = .7};
}

dem_sdf *dem_sdf_stl(const dem_stl *stl, char *message, size_t size)
{
    soup soup;
    const char *wrong = !(stl->scale > 0.) || !isfinite(stl->scale) ? "scale must be positive"
                        : !(stl->spacing >= 0.) || !isfinite(stl->spacing)
                            ? "the spacing of samples must not be negative"
                        : !(stl->feature_angle > 0.) || stl->feature_angle > PI * (1. + 1e-12)
                            ? "the feature angle must be in (0, pi]"
                            : NULL;
    if (size > 0) message[0] = '\0';
    if (wrong != NULL) {
        snprintf(message, size, "%s: %s", stl->path, wrong);
        return NULL;
    }
    surface *surface = NULL;
    if (stl_read(stl->path, stl->scale, &soup, message, size) == 0)
        surface = surface_new(&soup, stl->path, stl->inside, stl->mend, stl->feature_angle, message,
                              size);
    soup_free(&soup);
    if (surface == NULL) return NULL;
    dem_sdf *s = sdf_new(SURFACE, surface->parts);
    if (s == NULL) {
        surface_free(surface);
        snprintf(message, size, "%s: out of memory", stl->path);
        return NULL;
    }
    s->surface = surface;
    s->sign = stl->inside ? -1. : 1.;
    s->spacing = stl->spacing;
    return s;
}

void sdf_free_surface(dem_sdf *s)
{
    surface_free(s->surface);
    band_free(s->band);
}

/* Samples taken before are void: the sides of creases have changed. */
int sdf_turn_surface(dem_sdf *s)
{
    surface *turned = surface_turned(s->surface);
    if (turned == NULL) return -1;
    sdf_free_surface(s);
    s->surface = turned;
    s->band = NULL;
    s->sign = -s->sign;
    s->parts = turned->parts;
    return 0;
}

/* Off all bricks. The gradient is that of the whole surface where a particle might be lost in the
 * solid, so that it is pushed out at the nearest place. */
static double eval_beyond(const dem_sdf *s, int part, const double x[3], double g[3])
{
    int nearest;
    if (s->surface->mended || !band_is_free(s->band, x, s->sign > 0.)) {
        const double phi = surface_distance(s->surface, x, g, &nearest);
        if (phi < 0.) return part < 0 || part == nearest ? phi : SDF_HIDDEN;
    }
    g[0] = g[1] = 0.;
    g[2] = 1.;
    return s->band->width;
}

/* Smallest over the parts that have samples at x. */
static double eval_all(const dem_sdf *s, const double x[3], double g[3])
{
    double least = SDF_HIDDEN, phi, gradient[3];
    for (int p = 0; p < s->parts; p++)
        if (band_eval(s->band, p, x, &phi, gradient, NULL) > 0 && phi < least) {
            least = phi;
            memcpy(g, gradient, sizeof gradient);
        }
    return least < SDF_HIDDEN ? least : eval_beyond(s, -1, x, g);
}

double sdf_eval_surface(const dem_sdf *s, int part, const double x[3], double g[3], uint32_t *hint)
{
    int hidden;
    double phi;
    if (s->band == NULL) {
        if (part < 0) return surface_distance(s->surface, x, g, &part);
        phi = surface_eval(s->surface, part, x, g, &hidden);
        return hidden ? SDF_HIDDEN : phi;
    }
    if (part < 0) return eval_all(s, x, g);
    const int found = band_eval(s->band, part, x, &phi, g, hint);
    return found > 0 ? phi : found < 0 ? SDF_HIDDEN : eval_beyond(s, part, x, g);
}

double sdf_distance_surface(const dem_sdf *s, const double x[3])
{
    double g[3];
    return sdf_eval_surface(s, -1, x, g, NULL);
}

/* Hidden parts are near, too: their nearest point tells, whoever answers there. */
int sdf_near_surface(const dem_sdf *s, int part, const double x[3], double reach)
{
    const surface_node *all = &s->surface->node[s->surface->root[part]];
    double d2 = 0.;
    for (int k = 0; k < 3; k++) {
        const double d = fmax(fmax(all->lo[k] - x[k], x[k] - all->hi[k]), 0.);
        d2 += d * d;
    }
    if (!(reach > 0.) || d2 >= reach * reach) return reach > 0. ? 0 : 1;
    if (s->band != NULL && reach <= s->band->width) {
        double phi, g[3];
        const int found = band_eval(s->band, part, x, &phi, g, NULL);
        if (found == 0) return 0;
        if (found > 0) return phi < reach + .25 * s->band->spacing; /* its error at edges */
    }
    surface_hit hit = {.d2 = reach * reach};
    return surface_nearest(s->surface, part, x, &hit);
}

void sdf_bounds_surface(const dem_sdf *s, double lo[3], double hi[3])
{
    memcpy(lo, s->surface->lo, sizeof s->surface->lo);
    memcpy(hi, s->surface->hi, sizeof s->surface->hi);
}

size_t sdf_memory_surface(const dem_sdf *s)
{
    return surface_memory(s->surface) + (s->band != NULL ? band_memory(s->band) : 0);
}

dem_status sdf_sample_surface(dem_sdf *s, double spacing, double width, const char *cache,
                              const sdf_progress *progress, char *message, size_t size)
{
    if (s->band != NULL) return DEM_OK;
    if (s->spacing > 0.) spacing = s->spacing;
    if (!(spacing > 0.) || !(width > 0.) || !isfinite(spacing) || !isfinite(width)) {
        snprintf(message, size, "cannot sample a surface every %g m to a distance of %g m", spacing,
                 width);
        return DEM_BAD_ARGUMENT;
    }
    dem_status status = DEM_OK;
    /* The cache is the business of one rank: what the others do must not depend on files. */
    const int first = progress == NULL || progress->sim == NULL || progress->sim->rank == 0;
    if (cache != NULL && first)
        s->band = band_read(s->surface, spacing, width, cache, message, size);
    if (cache != NULL)
        s->band = band_share(s->band, s->surface, spacing, width, progress, &status, message, size);
    if (s->band != NULL || status) return status;
    char why[256] = "";
    s->band = band_new(s->surface, spacing, width, progress, why, sizeof why);
    if (s->band == NULL) {
        snprintf(message, size, "%s", why);
        return DEM_NO_MEMORY;
    }
    if (cache != NULL && first) band_write(s->band, s->surface, cache, message, size);
    return DEM_OK;
}
