/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * check_geometry.c - surfaces of triangles against domain and particles; feeders and outlets
 * against the domain and each other; what is to be filled against the walls.
 *
 * An STL file does not say its unit. Most are in millimetres, and one read as metres is a thousand
 * times too large: far beyond what a wall can have to do with the domain. The bounds here are wide,
 * so that only such mistakes are met.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>

/* A wall may reach beyond its domain, but not by so much. */
#define LARGEST_WALL 100
/* And may be a small thing in it, of which this is said. */
#define SMALL_WALL .01
/* Samples per smallest diameter below which a surface is too coarse for its particles: contacts
 * reach over some hundredths of a radius, curvature over a radius. */
#define COARSEST_SPACING .5

static double largest(const double extent[3])
{
    return fmax(extent[0], fmax(extent[1], extent[2]));
}

/* Smallest diameter of all particles that are made; INFINITY when there are none. */
static double smallest_particle(const dem_param *param)
{
    double least = INFINITY;
    for (size_t i = 0; i < param->n_insertion; i++) {
        const dem_insertion *in = &param->insertion[i];
        least =
            fmin(least, in->n_species ? least_diameter(in->n_species, in->species) : in->diameter);
    }
    for (size_t i = 0; i < param->n_feeder; i++)
        least = fmin(least, least_diameter(param->feeder[i].n_species, param->feeder[i].species));
    return least;
}

/* 1 with an error when the surface cannot be meant as it is. */
static int check_extent(const surface *s, const double domain[3], double d, case_errors *errors)
{
    const double size = largest(s->extent), room = largest(domain);
    const char *hint = NULL;
    if (size > LARGEST_WALL * room)
        hint = "is the file in millimetres? then: scale 0.001";
    else if (size < d)
        hint = "is its scale too small?";
    if (hint)
        case_error(errors, s->at.file, s->at.line,
                   "%s: the surface in %s extends over %g x %g x %g m, the domain over %g x %g x "
                   "%g m%s; %s",
                   s->key, s->name, s->extent[0], s->extent[1], s->extent[2], domain[0], domain[1],
                   domain[2], size < d ? ", and it is smaller than a particle" : "", hint);
    else if (size < SMALL_WALL * room)
        case_note(errors, s->at.file, s->at.line,
                  "%s: the surface in %s extends over %g x %g x %g m only, in a domain of %g x %g "
                  "x %g m: is its scale right?",
                  s->key, s->name, s->extent[0], s->extent[1], s->extent[2], domain[0], domain[1],
                  domain[2]);
    return hint != NULL;
}

int check_surfaces(const case_dem *dem, case_errors *errors)
{
    const particle_storage *storage = dem->storage;
    const dem_param *param = &dem->param;
    const double d = smallest_particle(param);
    double domain[3];
    int refused = 0;
    for (int a = 0; a < 3; a++) domain[a] = param->hi[a] - param->lo[a];
    for (const surface *s = storage->surfaces; s; s = s->next) {
        refused += check_extent(s, domain, isfinite(d) ? d : 0, errors);
        if (s->samples && s->spacing > COARSEST_SPACING * d)
            case_error(errors, s->at.file, s->at.line,
                       "%s: sampled at a spacing of %g m, it is too coarse for particles of %g m; "
                       "accepted: at most %g of the smallest diameter, a quarter is usual",
                       s->key, s->spacing, d, COARSEST_SPACING);
    }
    return refused;
}

/* ---- the side of a wall ------------------------------------------------------------------------
 */

enum { LEVELS = 6 }; /* halvings of a box in search of a common point */

/* 1: the wall is at its own place when the run starts, at time 0. */
static int starts_unmoved(const dem_wall *wall)
{
    for (size_t m = 0; m < wall->n_motion; m++)
        if (wall->motion[m].kind != DEM_TRANSLATION && wall->motion[m].kind != DEM_ROTATION)
            return 0;
    return 1;
}

/* A region wholly in the solid of a wall. The engine would not notice in each case: what lies deep
 * in a sampled wall is beyond its samples. */
static void check_side(const dem_param *param, const dem_sdf *region, const double lo[3],
                       const double hi[3], int at_start, const place *at, const char *key,
                       case_errors *errors)
{
    for (size_t w = 0; w < param->n_wall; w++) {
        const dem_wall *wall = &param->wall[w];
        const dem_sdf *both[2] = {region, wall->shape};
        if (!wall->shape || has_room(2, both, lo, hi, LEVELS)) continue;
        if (wall->n_motion == 0 || (at_start && starts_unmoved(wall)))
            case_error(errors, at->file, at->line,
                       "%s: lies wholly in the solid of the wall '%s'; is its 'inside' wrong?", key,
                       wall->name);
        else
            case_note(errors, at->file, at->line,
                      "%s: lies wholly in the solid of the wall '%s' where that is before it "
                      "moves; is its 'inside' wrong?",
                      key, wall->name);
    }
}

void check_sides(const case_dem *dem, case_errors *errors)
{
    const particle_storage *storage = dem->storage;
    const dem_param *param = &dem->param;
    char key[128];
    for (size_t i = 0; i < param->n_insertion; i++) {
        const dem_insertion *in = &param->insertion[i];
        if (!in->region) continue;
        snprintf(key, sizeof key, "insertion.%s.region", in->name);
        check_side(param, in->region, in->lo, in->hi, 1, &storage->insertion[i], key, errors);
    }
    for (size_t f = 0; f < param->n_feeder; f++) {
        const dem_feeder *feeder = &param->feeder[f];
        if (!feeder->region) continue;
        snprintf(key, sizeof key, "feeders.%s.region", feeder->name);
        check_side(param, feeder->region, feeder->lo, feeder->hi, 0, &storage->feeder[f], key,
                   errors);
    }
}

/* ---- feeders and outlets --------------------------------------------------------------------- */

/* A particle must not cross it between two looks. */
static void check_depth(const dem_outlet *outlet, const place *at, double d, case_errors *errors)
{
    double lo[3], hi[3], depth = INFINITY;
    dem_sdf_bounds(outlet->region, lo, hi);
    for (int a = 0; a < 3; a++) depth = fmin(depth, hi[a] - lo[a]);
    if (depth < d && isfinite(d))
        case_note(errors, at->file, at->line,
                  "outlets.%s.region: only %g m deep, less than a particle of %g m: fast ones may "
                  "pass through it",
                  outlet->name, depth, d);
}

void check_feeds(const case_dem *dem, case_errors *errors)
{
    const particle_storage *storage = dem->storage;
    const dem_param *param = &dem->param;
    const double d = smallest_particle(param);
    for (size_t o = 0; o < param->n_outlet; o++) {
        const dem_outlet *outlet = &param->outlet[o];
        if (!outlet->region) continue;
        const dem_sdf *both[2] = {outlet->region};
        const place *at = &storage->outlet[o];
        check_depth(outlet, at, d, errors);
        if (!has_room(1, both, param->lo, param->hi, LEVELS))
            case_error(errors, at->file, at->line,
                       "outlets.%s.region: lies outside the domain, (%g %g %g) to (%g %g %g) m",
                       outlet->name, param->lo[0], param->lo[1], param->lo[2], param->hi[0],
                       param->hi[1], param->hi[2]);
        for (size_t f = 0; f < param->n_feeder; f++) {
            const dem_feeder *feeder = &param->feeder[f];
            both[1] = feeder->region;
            if (!feeder->region || feeder->end <= outlet->begin || outlet->end <= feeder->begin)
                continue;
            if (has_room(2, both, feeder->lo, feeder->hi, LEVELS))
                case_error(errors, at->file, at->line,
                           "outlets.%s.region: overlaps the region of the feeder '%s', whose "
                           "particles it would take at once",
                           outlet->name, feeder->name);
        }
    }
}
