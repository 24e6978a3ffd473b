/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * halo.c - ghosts: copies of the particles of other ranks that are near this rank's part.
 *
 * Two particles i and j are a pair of the neighbour list when |x_i - x_j| < r_i + r_j + skin. The
 * rank of j must know i then: i is sent to every rank whose part comes within r_i + r_max + skin of
 * x_i, itself or an image. Both ranks so have the pair and compute it, with the same bits, and
 * nothing need be sent back. A particle is a ghost of a rank once at most: images are a matter of
 * the list, as they are on one rank.
 *
 * Ghosts live from one rebuild of the list to the next; in between positions, velocities and spins,
 * nine numbers, follow in every step (halo_refresh).
 */
#include "halo.h"

#include "dem_internal.h"

#include <stdlib.h>
#include <string.h>

typedef struct ghost_record {
    double pos[4], vel[8];
    int64_t id;
    int material;
} ghost_record;

enum { TAG = 2 };

void halo_free(halo *h)
{
    free(h->first);
    free(h->send);
    free(h->from);
    free(h->ghost);
    free(h->out);
    free(h->in);
    free(h->request);
    memset(h, 0, sizeof *h);
}

/* Who goes where, one after the other. */
typedef struct trips {
    size_t n, capacity;
    uint32_t *i;
    int *rank;
} trips;

static void trips_free(trips *t)
{
    free(t->i);
    free(t->rank);
}

static dem_status reserve_trips(dem_sim *sim, trips *t, size_t n)
{
    if (n <= t->capacity) return DEM_OK;
    const size_t room = 2 * n + 256;
    uint32_t *i = realloc(t->i, room * sizeof *i);
    if (i) t->i = i;
    int *rank = realloc(t->rank, room * sizeof *rank);
    if (rank) t->rank = rank;
    if (!i || !rank) return no_memory(sim);
    t->capacity = room;
    return DEM_OK;
}

static dem_status find_trips(dem_sim *sim, size_t n, const double (*pos)[4], double reach, trips *t)
{
    for (size_t i = 0; i < n; i++) {
        const size_t near = (size_t)domain_near(sim, pos[i], pos[i][3] + reach);
        const dem_status status = reserve_trips(sim, t, t->n + near);
        if (status) return status;
        for (size_t k = 0; k < near; k++) {
            t->i[t->n] = (uint32_t)i;
            t->rank[t->n++] = sim->domain.near[k];
        }
    }
    return DEM_OK;
}

/* The trips by rank, and what is sent on each. */
static dem_status pack(dem_sim *sim, const trips *t, ghost_record **out)
{
    halo *h = &sim->halo;
    const particles *p = &sim->particles;
    size_t *place;
    dem_status status = order_by_rank(sim, t->n, t->rank, &h->first, &place);
    h->send = malloc((t->n + 1) * sizeof *h->send);
    h->out = malloc((t->n + 1) * sizeof *h->out);
    h->request = malloc(2 * (size_t)sim->ranks * sizeof *h->request);
    *out = calloc(t->n + 1, sizeof **out);
    if (!h->send || !h->out || !h->request || !*out) status = no_memory(sim);
    for (size_t k = 0; k < t->n && !status; k++) {
        const uint32_t i = t->i[k];
        ghost_record *g = &(*out)[place[k]];
        h->send[place[k]] = i;
        memcpy(g->pos, p->pos[i], sizeof g->pos);
        memcpy(g->vel, p->vel[i], sizeof g->vel);
        g->id = p->id[i];
        g->material = p->material[i];
    }
    free(place);
    return status;
}

static dem_status unpack(dem_sim *sim, const parcel *in)
{
    halo *h = &sim->halo;
    particles *p = &sim->particles;
    h->ghost = malloc((in->n + 1) * sizeof *h->ghost);
    h->in = malloc((in->n + 1) * sizeof *h->in);
    if (!h->ghost || !h->in || particles_reserve(p, p->n + in->n)) return no_memory(sim);
    if (p->n + in->n > NEIGHBOUR_MASK)
        return fail(sim, DEM_BAD_ARGUMENT, "%zu particles and %zu ghosts on one rank, at most %u",
                    p->n, in->n, (unsigned)NEIGHBOUR_MASK);
    const ghost_record *g = in->data;
    for (size_t k = 0; k < in->n; k++) {
        const size_t i = p->n + k;
        memcpy(p->pos[i], g[k].pos, sizeof *p->pos);
        memcpy(p->vel[i], g[k].vel, sizeof *p->vel);
        p->id[i] = g[k].id;
        p->material[i] = g[k].material;
        h->ghost[k] = (uint32_t)i;
    }
    p->n_ghost = in->n;
    return DEM_OK;
}

dem_status halo_make(dem_sim *sim, double reach)
{
    halo *h = &sim->halo;
    trips t = {0};
    parcel in;
    ghost_record *out = NULL;
    halo_free(h);
    sim->particles.n_ghost = 0;
    dem_status status =
        find_trips(sim, sim->particles.n, (const double(*)[4])sim->particles.pos, reach, &t);
    if (!status) status = pack(sim, &t, &out);
    status = send_blocks(sim, status, h->first, out, sizeof *out, &in);
    if (!status) status = agree(sim, unpack(sim, &in));
    if (!status) {
        h->from = in.first;
        in.first = NULL;
    }
    parcel_free(&in);
    free(out);
    trips_free(&t);
    return status;
}

void halo_follow(dem_sim *sim, const uint32_t *place)
{
    halo *h = &sim->halo;
    for (size_t k = 0; k < h->first[sim->ranks]; k++) h->send[k] = place[h->send[k]];
    for (size_t k = 0; k < h->from[sim->ranks]; k++) h->ghost[k] = place[h->ghost[k]];
}

/* Who is sent lies here and there in memory: soon it is the turn of that one. */
static void fetch_ahead(const particles *p, uint32_t i)
{
    __builtin_prefetch(p->pos[i]);
    __builtin_prefetch(p->vel[i]);
}

void halo_refresh(dem_sim *sim)
{
    enum { AHEAD = 16 };
    const size_t sent = sim->halo.first[sim->ranks];
    halo *h = &sim->halo;
    particles *p = &sim->particles;
    int n = 0;
    for (int r = 0; r < sim->ranks; r++) {
        const size_t count = h->from[r + 1] - h->from[r];
        if (count)
            MPI_Irecv(h->in[h->from[r]], (int)(9 * count), MPI_DOUBLE, r, TAG, sim->comm,
                      &h->request[n++]);
    }
    for (int r = 0; r < sim->ranks; r++) {
        const size_t begin = h->first[r], end = h->first[r + 1];
        for (size_t k = begin; k < end; k++) {
            const uint32_t i = h->send[k];
            if (k + AHEAD < sent) fetch_ahead(p, h->send[k + AHEAD]);
            memcpy(h->out[k], p->pos[i], 3 * sizeof(double));
            memcpy(h->out[k] + 3, p->vel[i], 3 * sizeof(double));
            memcpy(h->out[k] + 6, p->vel[i] + 4, 3 * sizeof(double));
        }
        if (end > begin)
            MPI_Isend(h->out[begin], (int)(9 * (end - begin)), MPI_DOUBLE, r, TAG, sim->comm,
                      &h->request[n++]);
    }
    MPI_Waitall(n, h->request, MPI_STATUSES_IGNORE);
    for (size_t k = 0; k < h->from[sim->ranks]; k++) {
        const uint32_t i = h->ghost[k];
        memcpy(p->pos[i], h->in[k], 3 * sizeof(double));
        memcpy(p->vel[i], h->in[k] + 3, 3 * sizeof(double));
        memcpy(p->vel[i] + 4, h->in[k] + 6, 3 * sizeof(double));
    }
}

/* ---- spheres that are looked at once --------------------------------------------------------- */

typedef struct sphere_record {
    double pos[4];
    int64_t label;
} sphere_record;

static dem_status pack_spheres(dem_sim *sim, const trips *t, const double (*pos)[4],
                               const int64_t *label, size_t **first, sphere_record **out)
{
    size_t *place;
    dem_status status = order_by_rank(sim, t->n, t->rank, first, &place);
    *out = malloc((t->n + 1) * sizeof **out);
    if (!*out) status = no_memory(sim);
    for (size_t k = 0; k < t->n && !status; k++) {
        sphere_record *s = &(*out)[place[k]];
        memcpy(s->pos, pos[t->i[k]], sizeof s->pos);
        s->label = label[t->i[k]];
    }
    free(place);
    return status;
}

static dem_status append_spheres(dem_sim *sim, const parcel *in, size_t *n, double (**pos)[4],
                                 int64_t **label)
{
    const sphere_record *s = in->data;
    double(*more)[4] = realloc(*pos, (*n + in->n + 1) * sizeof *more);
    if (more) *pos = more;
    int64_t *labels = realloc(*label, (*n + in->n + 1) * sizeof *labels);
    if (labels) *label = labels;
    if (!more || !labels) return no_memory(sim);
    for (size_t k = 0; k < in->n; k++) {
        memcpy((*pos)[*n], s[k].pos, sizeof **pos);
        (*label)[(*n)++] = s[k].label;
    }
    return DEM_OK;
}

dem_status halo_spheres(dem_sim *sim, dem_status status, double reach, size_t *n, double (**pos)[4],
                        int64_t **label)
{
    if (sim->ranks == 1) return status;
    trips t = {0};
    parcel in;
    size_t *first = NULL;
    sphere_record *out = NULL;
    const double(*own)[4] = (const double(*)[4])(*pos);
    if (!status) status = find_trips(sim, *n, own, reach, &t);
    if (!status) status = pack_spheres(sim, &t, own, *label, &first, &out);
    status = send_blocks(sim, status, first, out, sizeof *out, &in);
    if (!status) status = append_spheres(sim, &in, n, pos, label);
    parcel_free(&in);
    free(first), free(out);
    trips_free(&t);
    return agree(sim, status);
}
