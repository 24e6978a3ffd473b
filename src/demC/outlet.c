/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * outlet.c - regions that take the particles whose centres get into them.
 *
 * They are looked at whenever the neighbour list is about to be rebuilt, before a particle beyond
 * the domain would count as lost, and at the end of every dem_advance. In between a particle moves
 * by less than half the skin, so that none crosses a region that is wider than that unseen. Where
 * two outlets overlap the first one takes. Whom an outlet takes is out of the sums and lists at
 * once: what left with it is in the report. Each rank looks at its own particles; what an outlet
 * has taken from all of them, every rank knows.
 */
#include "outlet.h"

#include "dem_internal.h"
#include "periodic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static dem_status check_outlet(dem_sim *sim, const outlet *o)
{
    const char *name = o->given.name;
    if (!(o->given.begin < o->given.end))
        return fail(sim, DEM_BAD_ARGUMENT, "outlet %s: begins at %g s, ends at %g s", name,
                    o->given.begin, o->given.end);
    for (int a = 0; a < 3; a++)
        if (!sim->periodic[a] && (o->hi[a] < sim->lo[a] || o->lo[a] > sim->hi[a]))
            return fail(sim, DEM_BAD_ARGUMENT,
                        "outlet %s: the region lies outside the domain (%c from %g to %g m)", name,
                        "xyz"[a], o -> lo[a], o -> hi[a]);
    return DEM_OK;
}

/* Box of the region: that of its surface, unless it is what lies around that. */
static void find_box(outlet *o)
{
    const dem_sdf *region = o->given.region;
    dem_sdf_bounds(region, o->lo, o->hi);
    int around = 0;
    for (int side = 0; side < 6; side++) {
        const int a = side / 2;
        const double bound = side % 2 ? o->hi[a] : o->lo[a];
        if (!isfinite(bound)) continue;
        double x[3];
        for (int b = 0; b < 3; b++) x[b] = isfinite(o->lo[b]) ? o->lo[b] : 0;
        x[a] = bound + (side % 2 ? 1 : -1) * (1 + fabs(bound));
        around |= dem_sdf_distance(region, x) > 0;
    }
    for (int a = 0; a < 3 && around; a++) {
        o->lo[a] = -INFINITY;
        o->hi[a] = INFINITY;
    }
}

dem_status outlets_init(dem_sim *sim, const dem_param *param)
{
    outlets *all = &sim->outlets;
    if (!param->n_outlet) return DEM_OK;
    all->outlet = calloc(param->n_outlet, sizeof *all->outlet);
    dem_status status = all->outlet ? DEM_OK : no_memory(sim);
    for (size_t k = 0; k < param->n_outlet && !status; k++) {
        outlet *o = &all->outlet[all->n++];
        o->given = param->outlet[k];
        if (!o->given.region)
            status = fail(sim, DEM_BAD_ARGUMENT, "outlet %s has no region", o->given.name);
        if (!status) find_box(o);
        if (!status) status = check_outlet(sim, o);
    }
    return agree(sim, status);
}

void outlets_free(outlets *o, int free_regions)
{
    for (size_t k = 0; free_regions && k < o->n; k++) dem_sdf_free(o->outlet[k].given.region);
    free(o->outlet);
    memset(o, 0, sizeof *o);
}

static int holds(const outlet *o, const double x[3])
{
    for (int a = 0; a < 3; a++)
        if (x[a] < o->lo[a] || x[a] > o->hi[a]) return 0;
    return dem_sdf_distance(o->given.region, x) >= 0;
}

/* The outlet that takes a particle at x, or NULL. */
static outlet *taker(dem_sim *sim, const double pos[4])
{
    double x[3];
    memcpy(x, pos, sizeof x);
    wrap_into(x, sim->lo, sim->hi, sim->periodic);
    for (outlet *o = sim->outlets.outlet; o < sim->outlets.outlet + sim->outlets.n; o++)
        if (sim->time >= o->given.begin && sim->time < o->given.end && holds(o, x)) return o;
    return NULL;
}

/* Of this rank's particles, who goes, and what goes with them by outlet. */
static void find_gone(dem_sim *sim, uint8_t *gone, int64_t *number, tally *mass)
{
    const particles *p = &sim->particles;
    for (size_t i = 0; i < p->n; i++) {
        const outlet *o = taker(sim, p->pos[i]);
        if (!o) continue;
        gone[i] = 1;
        number[o - sim->outlets.outlet]++;
        tally_add(&mass[o - sim->outlets.outlet], p->mass[i]);
    }
}

/* What all ranks lose. number[n] is how many of them have failed. */
static dem_status book_gone(dem_sim *sim, dem_status status, int64_t *number, const tally *mass)
{
    outlets *all = &sim->outlets;
    parcel in;
    if (number[all->n]) return agree(sim, status);
    status = share_blocks(sim, status, all->n, mass, sizeof *mass, &in);
    const tally *part = in.data;
    for (size_t k = 0; k < in.n && !status; k++) {
        tally *sum = &all->outlet[k % all->n].mass;
        tally_add(sum, part[k].sum);
        tally_add(sum, part[k].lost);
    }
    for (size_t k = 0; k < all->n && !status; k++) all->outlet[k].number += number[k];
    parcel_free(&in);
    return status;
}

dem_status outlets_take(dem_sim *sim)
{
    const size_t n = sim->outlets.n;
    if (!n || !sim->total) return DEM_OK;
    uint8_t *gone = calloc(sim->particles.n + 1, 1);
    int64_t number[n + 1], taken = 0;
    tally mass[n];
    memset(number, 0, sizeof number);
    memset(mass, 0, sizeof mass);
    dem_status status = gone ? DEM_OK : no_memory(sim);
    if (gone) find_gone(sim, gone, number, mass);
    number[n] = status != DEM_OK;
    sum_counts(sim, number, (int)n + 1);
    for (size_t k = 0; k <= n; k++) taken += number[k];
    if (taken) status = book_gone(sim, status, number, mass);
    if (taken && !status) status = remove_particles(sim, gone);
    free(gone);
    return status;
}

/* ---- public ---------------------------------------------------------------------------------- */

size_t dem_outlets(const dem_sim *sim)
{
    return sim->outlets.n;
}

const char *dem_outlet_name(const dem_sim *sim, size_t outlet)
{
    return outlet < sim->outlets.n ? sim->outlets.outlet[outlet].given.name : "";
}

void dem_removed(const dem_sim *sim, size_t outlet, int64_t *number, double *mass)
{
    const int there = outlet < sim->outlets.n;
    *number = there ? sim->outlets.outlet[outlet].number : 0;
    *mass = there ? tally_total(&sim->outlets.outlet[outlet].mass) : 0;
}
