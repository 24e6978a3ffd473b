/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * add.c - particles that the caller adds: dem_add.
 *
 * On several ranks each may give any of them. They are checked where they are given, numbered in
 * the order of the ranks and sent to the ranks that own their places; there, with those present and
 * what is near beyond the part of a rank, it is seen whether two overlap too far. Only then are
 * they let in, so that an error leaves everything as it was.
 */
#include "check.h"
#include "dem_internal.h"
#include "periodic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- ids ------------------------------------------------------------------------------------- */

static int by_id(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* The ids of this rank, those present and n new ones, to the ranks that look after them, which have
 * all that could be the same. */
static dem_status send_ids(dem_sim *sim, size_t n, const int64_t *id, parcel *in)
{
    const particles *p = &sim->particles;
    const size_t all = p->n + n;
    int64_t *out = malloc((all + 1) * sizeof *out);
    int *rank = malloc((all + 1) * sizeof *rank);
    size_t *first = NULL, *place = NULL;
    dem_status status = out && rank ? DEM_OK : no_memory(sim);
    for (size_t i = 0; i < all && !status; i++)
        rank[i] = (int)((uint64_t)(i < p->n ? p->id[i] : id[i - p->n]) % (uint64_t)sim->ranks);
    if (!status) status = order_by_rank(sim, all, rank, &first, &place);
    for (size_t i = 0; i < all && !status; i++) out[place[i]] = i < p->n ? p->id[i] : id[i - p->n];
    status = send_blocks(sim, status, first, out, sizeof *out, in);
    free(first), free(place), free(rank), free(out);
    return status;
}

/* Ids, the present ones and the new, of all ranks, must differ. */
static dem_status check_ids(dem_sim *sim, size_t n, const int64_t *id)
{
    parcel in;
    dem_status status = send_ids(sim, n, id, &in);
    if (!status) {
        const int64_t *all = in.data;
        if (in.n) qsort(in.data, in.n, sizeof *all, by_id);
        size_t k = 1;
        while (k < in.n && all[k] != all[k - 1]) k++;
        if (k < in.n)
            status =
                fail(sim, DEM_BAD_ARGUMENT, "particle id %lld is given twice", (long long)all[k]);
    }
    parcel_free(&in);
    return agree(sim, status);
}

/* ---- to their ranks -------------------------------------------------------------------------- */

/* One on its way to the rank that owns its place. */
typedef struct newcomer {
    double x[3], v[3], omega[3], radius;
    int64_t id, label; /* label: see check_overlaps */
    int material;
} newcomer;

/* What dem_add got, or what came of it to this rank. */
typedef struct newcomers {
    size_t n;
    const double (*x)[3], (*v)[3], (*omega)[3];
    const double *radius;
    const int *material;
    const int64_t *id;
    int64_t *label;
    void *room; /* of what came */
} newcomers;

static dem_status check_each(dem_sim *sim, const newcomers *a)
{
    dem_status status = DEM_OK;
    for (size_t i = 0; i < a->n && !status; i++)
        status = check_particle(sim, i, a->x[i], a->v ? a->v[i] : NULL,
                                a->omega ? a->omega[i] : NULL, a->radius[i], a->material[i]);
    return agree(sim, status);
}

/* Numbers for those that have none, on from the largest, in the order of the ranks. */
static int64_t *number_ids(const dem_sim *sim, const newcomers *a)
{
    int64_t *id = malloc((a->n + 1) * sizeof *id);
    const int64_t first = sim->particles.next_id + sum_before(sim, (int64_t)a->n);
    for (size_t i = 0; i < a->n && id; i++) id[i] = a->id ? a->id[i] : first + (int64_t)i;
    return id;
}

/* Space is divided by those who come first. */
static dem_status divide_first(dem_sim *sim, const newcomers *a)
{
    if (sim->domain.divided) return DEM_OK;
    double(*pos)[4] = calloc(a->n + 1, sizeof *pos);
    dem_status status = agree(sim, pos ? DEM_OK : no_memory(sim));
    for (size_t i = 0; i < a->n && !status; i++) memcpy(pos[i], a->x[i], sizeof *a->x);
    if (!status) status = domain_divide(sim, a->n, (const double(*)[4])pos, NULL);
    free(pos);
    return status;
}

/* To name one that is to be added: its place in what the rank gave, and the rank. */
static int64_t label_of(const dem_sim *sim, size_t i)
{
    return -1 - ((int64_t)sim->rank << LABEL_BITS | (int64_t)i);
}

static void pack_newcomer(const dem_sim *sim, const newcomers *a, size_t i, const int64_t *id,
                          newcomer *c)
{
    memset(c, 0, sizeof *c);
    memcpy(c->x, a->x[i], sizeof c->x);
    if (a->v) memcpy(c->v, a->v[i], sizeof c->v);
    if (a->omega) memcpy(c->omega, a->omega[i], sizeof c->omega);
    c->radius = a->radius[i];
    c->material = a->material[i];
    c->id = id[i];
    c->label = label_of(sim, i);
}

/* Arrays of what came. */
static dem_status unpack_newcomers(dem_sim *sim, const parcel *in, newcomers *a)
{
    const newcomer *c = in->data;
    const size_t n = in->n;
    double *real = malloc((10 * n + 1) * sizeof *real);
    int64_t *whole = malloc((2 * n + 1) * sizeof *whole);
    int *material = malloc((n + 1) * sizeof *material);
    memset(a, 0, sizeof *a);
    if (!real || !whole || !material) {
        free(real), free(whole), free(material);
        return no_memory(sim);
    }
    double(*x)[3] = (double(*)[3])real, (*v)[3] = x + n, (*omega)[3] = v + n;
    for (size_t i = 0; i < n; i++) {
        memcpy(x[i], c[i].x, sizeof *x);
        memcpy(v[i], c[i].v, sizeof *v);
        memcpy(omega[i], c[i].omega, sizeof *omega);
        real[9 * n + i] = c[i].radius;
        material[i] = c[i].material;
        whole[i] = c[i].id;
        whole[n + i] = c[i].label;
    }
    *a = (newcomers){n,
                     (const double(*)[3])x,
                     (const double(*)[3])v,
                     (const double(*)[3])omega,
                     real + 9 * n,
                     material,
                     whole,
                     whole + n,
                     real};
    return DEM_OK;
}

static void free_newcomers(newcomers *a)
{
    if (!a->room) return;
    free((void *)(uintptr_t)a->material);
    free((void *)(uintptr_t)a->id);
    free(a->room);
}

/* To the ranks that own their places. */
static dem_status send_newcomers(dem_sim *sim, newcomers *a, const int64_t *id)
{
    parcel in = {0};
    newcomer *out = malloc((a->n + 1) * sizeof *out);
    int *owner = malloc((a->n + 1) * sizeof *owner);
    size_t *first = NULL, *place = NULL;
    dem_status status = out && owner ? DEM_OK : no_memory(sim);
    for (size_t i = 0; i < a->n && !status; i++) {
        double x[3];
        memcpy(x, a->x[i], sizeof x);
        wrap_into(x, sim->lo, sim->hi, sim->periodic); /* where it will be found */
        owner[i] = domain_owner(sim, x);
    }
    if (!status) status = order_by_rank(sim, a->n, owner, &first, &place);
    for (size_t i = 0; i < a->n && !status; i++) pack_newcomer(sim, a, i, id, &out[place[i]]);
    status = send_blocks(sim, status, first, out, sizeof *out, &in);
    if (!status) status = agree(sim, unpack_newcomers(sim, &in, a));
    parcel_free(&in);
    free(first), free(place), free(owner), free(out);
    return status;
}

dem_status dem_add(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                   const double (*omega)[3], const double *radius, const int *material,
                   const int64_t *id)
{
    int64_t all = (int64_t)n;
    sum_counts(sim, &all, 1);
    if (!all) return DEM_OK;
    newcomers a = {n, x, v, omega, radius, material, id, NULL, NULL};
    dem_status status = check_each(sim, &a);
    if (status) return status;
    double size[2] = {sim->largest_radius, sim->total ? -sim->smallest_any : -INFINITY},
           overlap = 0;
    for (size_t i = 0; i < n; i++) {
        size[0] = fmax(size[0], radius[i]);
        size[1] = fmax(size[1], -radius[i]);
    }
    max_reals(sim, size, 2);
    status = check_range(sim, size[0]);
    int64_t *numbers = number_ids(sim, &a);
    status = agree(sim, numbers || status ? status : no_memory(sim));
    if (!status) status = check_ids(sim, n, numbers);
    if (!status) status = walls_sample(sim, -2 * size[1], 2 * size[0]);
    if (!status && sim->ranks > 1) {
        status = divide_first(sim, &a);
        if (!status) status = send_newcomers(sim, &a, numbers);
    }
    if (!status) status = check_overlaps(sim, a.n, a.x, a.radius, a.label, size[0], &overlap);
    if (!status)
        status = admit_particles(sim, a.n, a.x, a.v, a.omega, a.radius, a.material,
                                 a.room ? a.id : numbers);
    free_newcomers(&a);
    free(numbers);
    if (status) return status;
    sim->overlap = overlap;
    particles_publish(&sim->particles, sim->lo, sim->hi, sim->periodic);
    return DEM_OK;
}
