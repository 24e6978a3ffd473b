/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall_sample.c - when the triangle surfaces of walls are sampled, and how finely.
 *
 * Spacing: a quarter of the smallest diameter (Shigeto & Sakai, Chem. Eng. J. 231 (2013) 464,
 * doi:10.1016/j.cej.2013.07.073), unless the surface asks for another. Distances must be right as
 * far as the list of particles near walls looks: largest radius, margin and slack.
 *
 * All sizes that insertions and feeds announce are known in dem_new; whoever adds others, larger
 * than the band covers or less than half as large as the smallest so far, has the walls sampled
 * again. Between half and the whole the samples stay as they are: sizes that come in ever smaller
 * would have them made again and again.
 *
 * The ranks share the work and all get the same samples (band_make.c); the sizes that decide are
 * those of all ranks. The first one tells of the progress, and reads and writes the cache.
 */
#include "band.h"
#include "dem_internal.h"
#include "size.h"

#include <math.h>

static int has_surface(const dem_sdf *s)
{
    int found = s->kind == SURFACE;
    for (size_t k = 0; k < s->n && !found; k++) found = has_surface(s->member[k]);
    return found;
}

static void forget_samples(dem_sdf *s)
{
    for (size_t k = 0; k < s->n; k++) forget_samples(s->member[k]);
    if (s->band) band_free(s->band);
    s->band = NULL;
}

dem_status walls_sample(dem_sim *sim, double smallest, double largest)
{
    walls *w = &sim->walls;
    double spacing = .25 * smallest;
    /* Half the skin each for the particle, where it was when only this list was made again, and
     * the wall; the skin goes with a diameter that is no larger. */
    double width = .5 * largest + 1.5 * sim->skin * largest;
    if (!(smallest > 0) || !isfinite(largest)) return DEM_OK;
    if (w->sampled_width >= width && w->sampled_spacing <= 2 * spacing) return DEM_OK;
    return walls_sample_at(sim, spacing, width);
}

dem_status walls_sample_at(dem_sim *sim, double spacing, double width)
{
    walls *w = &sim->walls;
    if (w->sampled_width >= width && w->sampled_spacing <= spacing) return DEM_OK;
    sdf_progress work = sim->progress;
    work.sim = sim;
    if (sim->rank > 0) work.call = NULL;
    w->sampled_width = fmax(w->sampled_width, width);
    w->sampled_spacing = w->sampled_spacing > 0 ? fmin(w->sampled_spacing, spacing) : spacing;
    for (size_t k = 0; k < w->n; k++) {
        dem_sdf *shape = w->wall[k].shape;
        if (!has_surface(shape)) continue;
        char text[sizeof sim->message] = "";
        forget_samples(shape);
        dem_status status = sdf_sample(shape, w->sampled_spacing, w->sampled_width, sim->sdf_cache,
                                       &work, text, sizeof text);
        if (status || text[0])
            fail(sim, status, "wall %s: %.400s", w->wall[k].name, text[0] ? text : "out of memory");
        if (status) {
            w->sampled_width = 0; /* not to be relied upon */
            return status;
        }
    }
    return DEM_OK;
}

static void widen(double d0, double d1, double *smallest, double *largest)
{
    *smallest = fmin(*smallest, d0);
    *largest = fmax(*largest, d1);
}

static void widen_by_species(size_t n, const dem_species *s, double *smallest, double *largest)
{
    for (size_t k = 0; k < n; k++) {
        double lo, hi;
        size_range(&s[k].size, &lo, &hi);
        widen(lo, hi, smallest, largest);
    }
}

dem_status walls_sample_for(dem_sim *sim, const dem_param *param)
{
    double smallest = INFINITY, largest = 0;
    for (size_t k = 0; k < param->n_insertion; k++) {
        const dem_insertion *i = &param->insertion[k];
        if (i->n_species)
            widen_by_species(i->n_species, i->species, &smallest, &largest);
        else
            widen(i->diameter, i->diameter, &smallest, &largest);
    }
    for (size_t k = 0; k < param->n_feeder; k++)
        widen_by_species(param->feeder[k].n_species, param->feeder[k].species, &smallest, &largest);
    return largest > 0 ? walls_sample(sim, smallest, largest) : DEM_OK;
}
