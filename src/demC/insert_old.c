/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert_old.c - the spheres that new ones have to keep clear of.
 *
 * Every rank shows the others what it has near the place where particles are to come. In the order
 * of their ids they are the same on any number of ranks, and with them what is made of them.
 */
#include "insert.h"

#include "dem_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct sphere {
    double x[3], r;
    int64_t id;
} sphere;

static int by_id(const void *left, const void *right)
{
    const sphere *a = left, *b = right;
    return (a->id > b->id) - (a->id < b->id);
}

/* Whether it, or an image of it, comes within `reach` of the box. */
static int is_near(const insert_place *place, const double x[3], const double low[3],
                   const double high[3], double reach)
{
    for (int a = 0; a < 3; a++) {
        const double length = place->hi[a] - place->lo[a];
        double d = x[a] - .5 * (low[a] + high[a]);
        if (place->periodic[a]) d -= length * rint(d / length);
        if (!(fabs(d) <= .5 * (high[a] - low[a]) + reach)) return 0;
    }
    return 1;
}

/* This rank's own; NULL when out of memory. */
static sphere *find_own(const insert_place *place, const double low[3], const double high[3],
                        double diameter, size_t *n)
{
    sphere *own = calloc(place->n_old + 1, sizeof *own);
    *n = 0;
    for (size_t i = 0; i < place->n_old && own; i++) {
        const double r = place->r_old[i];
        if (!is_near(place, place->x_old[i], low, high, r + .5 * diameter)) continue;
        sphere *s = &own[(*n)++];
        memcpy(s->x, place->x_old[i], sizeof s->x);
        s->r = r;
        s->id = place->id_old ? place->id_old[i] : (int64_t)i;
    }
    return own;
}

/* Sorted, into arrays. */
static dem_status unpack(sphere *all, size_t n, old_spheres *old)
{
    old->x = malloc(n * sizeof *old->x + 1);
    old->r = malloc(n * sizeof *old->r + 1);
    if (!old->x || !old->r) return DEM_NO_MEMORY;
    if (n) qsort(all, n, sizeof *all, by_id);
    for (size_t i = 0; i < n; i++) {
        memcpy(old->x[i], all[i].x, sizeof *old->x);
        old->r[i] = all[i].r;
    }
    old->n = n;
    return DEM_OK;
}

dem_status old_gather(const insert_place *place, dem_status status, const double low[3],
                      const double high[3], double diameter, old_spheres *old)
{
    dem_sim *sim = place->sim;
    size_t n = 0;
    memset(old, 0, sizeof *old);
    sphere *own = status ? NULL : find_own(place, low, high, diameter, &n);
    if (!status && !own) status = sim ? no_memory(sim) : DEM_NO_MEMORY;
    if (!sim || sim->ranks == 1) {
        if (!status) status = unpack(own, n, old);
    } else {
        parcel all;
        status = share_blocks(sim, status, n, own, sizeof *own, &all);
        if (!status) status = agree(sim, unpack(all.data, all.n, old) ? no_memory(sim) : DEM_OK);
        parcel_free(&all);
    }
    free(own);
    return status;
}

void old_free(old_spheres *old)
{
    free(old->x);
    free(old->r);
    memset(old, 0, sizeof *old);
}
