/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_history.c - springs of contacts between particles and with walls, in a restart file.
 *
 * A spring between particles is that of the force on the one with the lower id; turning it about
 * changes its sign and nothing else, so that there and back it is the same to the last bit. A
 * spring at a wall is in the coordinates that the wall carries along, so that it needs no place of
 * the wall. Walls go by their names: one that is no more, or has another number of faces, leaves
 * its history behind.
 */
#include "restart.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int by_key(const void *a, const void *b)
{
    const history *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->key[k] != y->key[k]) return x->key[k] < y->key[k] ? -1 : 1;
    return 0;
}

static dem_status refuse_history(restart_job *job, const history *h, int ids)
{
    const long long first = (long long)h->key[0], second = (long long)h->key[1];
    if (ids == 2)
        return restart_refuse(job->file, "a contact is between particles %lld and %lld", first,
                              second);
    return restart_refuse(job->file, "a contact is of particle %lld with wall %lld", first, second);
}

/* Where histories go that are sorted by their first ids: to the slabs of these. */
static void find_slabs(restart_job *job, const history *all, size_t n, restart_route *route)
{
    const size_t ranks = (size_t)job->sim->ranks;
    route->first = calloc(ranks + 1, sizeof *route->first);
    if (!route->first) restart_no_memory(job);
    for (size_t r = 1; r <= ranks && route->first; r++) {
        size_t k = route->first[r - 1];
        while (k < n && (r == ranks || all[k].key[0] < job->bound[r])) k++;
        route->first[r] = k;
    }
}

/* To the ranks that write them, in the order of their keys; `all` is freed. */
static history *to_slabs(restart_job *job, history *all, size_t *n)
{
    restart_route route = {0};
    if (*n && all) qsort(all, *n, sizeof *all, by_key);
    if (job->sim->ranks == 1) return all;
    find_slabs(job, all, all ? *n : 0, &route);
    all = restart_send(job, &route, all, sizeof *all, n);
    restart_route_free(&route);
    if (all && *n) qsort(all, *n, sizeof *all, by_key);
    return all;
}

/* Datasets <group>/spring and rolling, and the keys under their names; `all` is freed. */
static void put_histories(restart_job *job, const char *group, const char *const key[3],
                          history *all, size_t n)
{
    char set[2 * DEM_NAME];
    if (!all) restart_no_memory(job);
    all = to_slabs(job, all, &n);
    const h5rows rows = h5file_rows(&job->file->f, all ? n : 0);
    int64_t *whole = malloc((n + 1) * sizeof *whole);
    double(*real)[4] = malloc((n + 1) * sizeof *real);
    if (!whole || !real) restart_no_memory(job);
    for (int c = 0; c < 3 && key[c]; c++) {
        for (size_t k = 0; k < rows.n && whole; k++) whole[k] = all[k].key[c];
        snprintf(set, sizeof set, "%s/%s", group, key[c]);
        restart_put(job->file, set, RESTART_WHOLE, rows, 1, whole, "-");
    }
    for (int c = 0; c < 1 + (job->sim->contacts.rolls != 0); c++) {
        for (size_t k = 0; k < rows.n && real; k++)
            memcpy(real[k], c ? all[k].rolling : all[k].spring, sizeof *real);
        snprintf(set, sizeof set, "%s/%s", group, c ? "rolling" : "spring");
        restart_put(job->file, set, RESTART_REAL, rows, 4, real, c ? "N m, m" : "N, m");
    }
    free(whole);
    free(real);
    free(all);
}

/* This rank's share of them; NULL in error. */
static history *read_histories(restart_job *job, const char *group, const char *const key[3],
                               size_t *n)
{
    char set[2 * DEM_NAME];
    h5rows rows = {.total = RESTART_ANY};
    history *all = NULL;
    for (int c = 0; c < 3 && key[c]; c++) {
        snprintf(set, sizeof set, "%s/%s", group, key[c]);
        int64_t *whole = restart_slab(job->file, set, RESTART_WHOLE, 1, &rows);
        if (c == 0) all = restart_room(job, rows.n * sizeof *all);
        for (size_t k = 0; k < rows.n && whole && all; k++) all[k].key[c] = whole[k];
        restart_drop(job->file, whole);
    }
    for (int c = 0; c < 1 + (job->sim->contacts.rolls != 0); c++) {
        snprintf(set, sizeof set, "%s/%s", group, c ? "rolling" : "spring");
        double(*real)[4] = restart_slab(job->file, set, RESTART_REAL, 4, &rows);
        for (size_t k = 0; k < rows.n && real && all; k++) {
            memcpy(c ? all[k].rolling : all[k].spring, real[k], sizeof *real);
            if (!isfinite(real[k][0] + real[k][1] + real[k][2] + real[k][3]))
                restart_refuse(job->file, "row %zu of dataset %s is no such number",
                               (size_t)rows.first + k, set);
        }
        restart_drop(job->file, real);
    }
    *n = rows.n;
    return job->file->f.failed ? NULL : all;
}

/* ---- to the owners --------------------------------------------------------------------------- */

/* The ranks that a history goes to, one or two: how many. */
typedef int destinations(restart_job *job, const history *h, int ids, uint32_t rank[2]);

/* To the ranks in whose slabs its ids are; */
static int to_known(restart_job *job, const history *h, int ids, uint32_t rank[2])
{
    for (int k = 0; k < ids; k++) rank[k] = (uint32_t)restart_slab_of(job, h->key[k]);
    return ids == 2 && rank[0] == rank[1] ? 1 : ids;
}

/* from there to the owners of those ids that are known here. */
static int to_owner(restart_job *job, const history *h, int ids, uint32_t rank[2])
{
    int n = 0;
    for (int k = 0; k < ids; k++) {
        if (restart_slab_of(job, h->key[k]) != job->sim->rank) continue;
        const size_t at = restart_find(job->slab_id, job->slab.n, h->key[k]);
        if (at == job->slab.n) {
            refuse_history(job, h, ids);
            return n;
        }
        if (n == 0 || rank[0] != job->owner[at]) rank[n++] = job->owner[at];
    }
    return n;
}

/* Copies of the n histories to where they belong; `all` is dropped. */
static history *spread(restart_job *job, history *all, size_t *n, int ids, destinations *where)
{
    uint32_t *to = malloc((2 * *n + 1) * sizeof *to), rank[2];
    uint32_t *from = malloc((2 * *n + 1) * sizeof *from);
    restart_route route = {0};
    size_t copies = 0;
    for (size_t k = 0; k < *n && all && to && from; k++) {
        const int count = where(job, &all[k], ids, rank);
        for (int c = 0; c < count; c++) {
            from[copies] = (uint32_t)k;
            to[copies++] = rank[c];
        }
    }
    history *out = malloc((copies + 1) * sizeof *out);
    if (to && from && out) route.first = restart_order_by_rank(job, copies, to);
    if (!route.first) restart_no_memory(job);
    for (size_t k = 0; k < copies && route.first; k++) out[to[k]] = all[from[k]];
    restart_drop(job->file, all);
    free(to);
    free(from);
    out = restart_send(job, &route, out, sizeof *out, n);
    restart_route_free(&route);
    return restart_adopt(job->file, out);
}

/* Those of this rank's particles, in the order of their keys; `ids`: how many of the keys are ids.
 * NULL in error. */
static history *get_histories(restart_job *job, const char *group, const char *const key[3],
                              int ids, size_t *n)
{
    history *all = read_histories(job, group, key, n);
    if (job->sim->ranks == 1) return all;
    if (!h5file_agree(&job->file->f)) return NULL;
    all = spread(job, all, n, ids, to_known);
    all = spread(job, all, n, ids, to_owner);
    if (!h5file_agree(&job->file->f)) return NULL;
    if (*n) qsort(all, *n, sizeof *all, by_key);
    /* Of two ways to the same owner it may have come both. */
    size_t kept = 0;
    for (size_t k = 0; k < *n; k++)
        if (k == 0 || by_key(&all[k], &all[k - 1]) != 0) all[kept++] = all[k];
    *n = kept;
    return all;
}

/* ---- between particles ----------------------------------------------------------------------- */

static const char *const PAIR[3] = {"first", "second", NULL};

void restart_save_contacts(restart_job *job)
{
    const particles *p = &job->sim->particles;
    const contacts *c = &job->sim->contacts;
    history *all = calloc(c->n + 1, sizeof *all);
    size_t n = 0;
    for (size_t k = 0; k < c->n && all; k++) {
        const saved_contact s = contacts_get(c, k);
        const int64_t i = p->id[s.i], j = p->id[s.j];
        /* Who owns one of two partners has the history: the owner of the lower id gives it. */
        if ((i < j ? s.i : s.j) >= p->n) continue;
        const double sign = i < j ? 1 : -1;
        history *h = &all[n++];
        h->key[0] = i < j ? i : j;
        h->key[1] = i < j ? j : i;
        for (int a = 0; a < 4; a++) {
            h->spring[a] = (a < 3 ? sign : 1) * s.spring[a];
            if (c->rolls) h->rolling[a] = (a < 3 ? sign : 1) * s.rolling[a];
        }
    }
    put_histories(job, "contacts", PAIR, all, n);
}

void restart_load_contacts(restart_job *job)
{
    job->contact = get_histories(job, "contacts", PAIR, 2, &job->n_contact);
}

typedef struct ghost {
    int64_t id;
    uint32_t row;
} ghost;

static int by_id(const void *a, const void *b)
{
    const int64_t x = ((const ghost *)a)->id, y = ((const ghost *)b)->id;
    return (x > y) - (x < y);
}

/* The row of a particle, own ones in the order of their ids, or UINT32_MAX. */
static uint32_t row_of(const restart_job *job, const ghost *ghosts, int64_t id)
{
    const size_t own = restart_find(job->id, job->n, id);
    if (own < job->n) return (uint32_t)own;
    const ghost key = {id, 0};
    const size_t n = job->sim->particles.n_ghost;
    const ghost *found = n ? bsearch(&key, ghosts, n, sizeof key, by_id) : NULL;
    return found ? found->row : UINT32_MAX;
}

dem_status restart_link_contacts(restart_job *job)
{
    const particles *p = &job->sim->particles;
    contacts *c = &job->sim->contacts;
    ghost *ghosts = restart_room(job, p->n_ghost * sizeof *ghosts);
    if (!ghosts) return DEM_IO;
    for (size_t g = 0; g < p->n_ghost; g++)
        ghosts[g] = (ghost){p->id[p->n + g], (uint32_t)(p->n + g)};
    if (p->n_ghost) qsort(ghosts, p->n_ghost, sizeof *ghosts, by_id);
    c->n = 0;
    for (size_t k = 0; k < job->n_contact; k++) {
        const history *h = &job->contact[k];
        saved_contact s = {.i = row_of(job, ghosts, h->key[0]),
                           .j = row_of(job, ghosts, h->key[1])};
        if (s.i == UINT32_MAX || s.j == UINT32_MAX || h->key[0] >= h->key[1])
            return refuse_history(job, h, 2);
        memcpy(s.spring, h->spring, sizeof s.spring);
        memcpy(s.rolling, h->rolling, sizeof s.rolling);
        if (contacts_append(c, &s)) return no_memory(job->sim);
    }
    return DEM_OK;
}

/* ---- with walls ------------------------------------------------------------------------------ */

static const char *const AT_WALL[3] = {"particle", "wall", "part"};

/* Names, parts and loads. */
static void save_wall_list(restart_job *job)
{
    const walls *w = &job->sim->walls;
    const double sampled[2] = {w->sampled_spacing, w->sampled_width};
    char(*name)[DEM_NAME] = calloc(w->n + 1, sizeof *name);
    int64_t *parts = calloc(w->n + 1, sizeof *parts);
    double(*load)[6] = calloc(w->n + 1, sizeof *load);
    for (size_t k = 0; k < w->n && name && parts && load; k++) {
        snprintf(name[k], sizeof *name, "%s", w->wall[k].name);
        parts[k] = dem_sdf_parts(w->wall[k].shape);
        memcpy(load[k], w->body[k].mean, sizeof *load);
    }
    if (!name || !parts || !load) h5file_fail(&job->file->f, "walls", "out of memory");
    restart_put_here(job, "walls/name", RESTART_TEXT, w->n, 1, name, "-");
    restart_put_here(job, "walls/parts", RESTART_WHOLE, w->n, 1, parts, "-");
    restart_put_here(job, "walls/load", RESTART_REAL, w->n, 6, load, "N, N m");
    restart_put_here(job, "walls/sampled", RESTART_REAL, 1, 2, sampled, "m");
    free(name);
    free(parts);
    free(load);
}

void restart_save_walls(restart_job *job)
{
    const walls *w = &job->sim->walls;
    history *all = calloc(w->n_entry + 1, sizeof *all);
    size_t n = 0;
    save_wall_list(job);
    for (const wall_entry *e = w->entry; e < w->entry + w->n_entry && all; e++) {
        if (!e->touch) continue;
        history *h = &all[n++];
        h->key[0] = job->sim->particles.id[e->particle];
        h->key[1] = e->wall;
        h->key[2] = e->part;
        memcpy(h->spring, e->spring, sizeof h->spring);
        memcpy(h->rolling, e->rolling, sizeof h->rolling);
    }
    put_histories(job, "wallContacts", AT_WALL, all, n);
}

/* Where the walls of the file are here: [*n], SIZE_MAX where history does not fit. */
static size_t *match_walls(restart_job *job, size_t *n)
{
    walls *w = &job->sim->walls;
    size_t *place =
        restart_match(job, "walls/name", w->n, w->n ? w->wall[0].name : "", sizeof *w->wall, n);
    const int64_t *parts = restart_get(job->file, "walls/parts", RESTART_WHOLE, 1, n);
    const double(*load)[6] = restart_get(job->file, "walls/load", RESTART_REAL, 6, n);
    if (!place || !parts || !load) return NULL;
    for (size_t k = 0; k < *n; k++) {
        if (place[k] == SIZE_MAX) continue;
        if (parts[k] != dem_sdf_parts(w->wall[place[k]].shape))
            place[k] = SIZE_MAX;
        else
            memcpy(w->body[place[k]].mean, load[k], sizeof *load);
    }
    return place;
}

void restart_load_walls(restart_job *job)
{
    walls *w = &job->sim->walls;
    size_t n_wall, n;
    const size_t *place = match_walls(job, &n_wall);
    const history *all = get_histories(job, "wallContacts", AT_WALL, 1, &n);
    if (!place || !all) return;
    free(w->entry);
    w->n_entry = w->capacity = 0;
    w->entry = calloc(n + 1, sizeof *w->entry);
    if (!w->entry) {
        restart_refuse(job->file, "out of memory with %zu contacts with walls", n);
        return;
    }
    w->capacity = n + 1;
    for (size_t k = 0; k < n; k++) {
        const int64_t *key = all[k].key;
        const size_t i = restart_find(job->id, job->n, key[0]);
        if (i == job->n || key[1] < 0 || (uint64_t)key[1] >= n_wall || key[2] < 0) {
            refuse_history(job, &all[k], 1);
            return;
        }
        const size_t wall = place[key[1]];
        if (wall == SIZE_MAX || key[2] >= dem_sdf_parts(w->wall[wall].shape)) continue;
        wall_entry *e = &w->entry[w->n_entry++];
        e->particle = (uint32_t)i;
        e->wall = (int)wall;
        e->part = (int)key[2];
        e->touch = 1;
        memcpy(e->spring, all[k].spring, sizeof e->spring);
        memcpy(e->rolling, all[k].rolling, sizeof e->rolling);
    }
}
