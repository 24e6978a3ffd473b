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

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A contact, with the ids of the partners, or of the particle, the wall and the part. */
typedef struct history {
    int64_t key[3];
    double spring[4], rolling[4];
} history;

static int by_key(const void *a, const void *b)
{
    const history *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->key[k] != y->key[k]) return x->key[k] < y->key[k] ? -1 : 1;
    return 0;
}

/* Datasets <group>/spring and rolling, and the keys under their names. */
static void put_histories(restart_job *job, const char *group, const char *const key[3],
                          history *all, size_t n)
{
    char set[2 * DEM_NAME];
    if (n) qsort(all, n, sizeof *all, by_key);
    int64_t *whole = malloc((n + 1) * sizeof *whole);
    double(*real)[4] = malloc((n + 1) * sizeof *real);
    for (int c = 0; c < 3 && key[c] && whole; c++) {
        for (size_t k = 0; k < n; k++) whole[k] = all[k].key[c];
        snprintf(set, sizeof set, "%s/%s", group, key[c]);
        restart_put_here(job, set, RESTART_WHOLE, n, 1, whole, "-");
    }
    for (int c = 0; c < 1 + (job->sim->contacts.rolls != 0) && real; c++) {
        for (size_t k = 0; k < n; k++)
            memcpy(real[k], c ? all[k].rolling : all[k].spring, sizeof *real);
        snprintf(set, sizeof set, "%s/%s", group, c ? "rolling" : "spring");
        restart_put_here(job, set, RESTART_REAL, n, 4, real, c ? "N m, m" : "N, m");
    }
    if (!whole || !real) h5file_fail(&job->file->f, group, "out of memory");
    free(whole);
    free(real);
}

/* The same back; NULL in error. */
static history *get_histories(restart_job *job, const char *group, const char *const key[3],
                              size_t *n)
{
    char set[2 * DEM_NAME];
    *n = RESTART_ANY;
    history *all = NULL;
    for (int c = 0; c < 3 && key[c]; c++) {
        snprintf(set, sizeof set, "%s/%s", group, key[c]);
        const int64_t *whole = restart_get(job->file, set, RESTART_WHOLE, 1, n);
        if (!all && whole) all = restart_room(job, *n * sizeof *all);
        for (size_t k = 0; k < *n && whole && all; k++) all[k].key[c] = whole[k];
    }
    for (int c = 0; c < 1 + (job->sim->contacts.rolls != 0); c++) {
        snprintf(set, sizeof set, "%s/%s", group, c ? "rolling" : "spring");
        const double(*real)[4] = restart_get(job->file, set, RESTART_REAL, 4, n);
        for (size_t k = 0; k < *n && real && all; k++)
            memcpy(c ? all[k].rolling : all[k].spring, real[k], sizeof *real);
    }
    return job->file->f.failed ? NULL : all;
}

/* ---- between particles ----------------------------------------------------------------------- */

static const char *const PAIR[3] = {"first", "second", NULL};

void restart_save_contacts(restart_job *job)
{
    const particles *p = &job->sim->particles;
    contacts *c = &job->sim->contacts;
    int failed = 0;
    /* Without a list that holds they are saved already. */
    if (job->sim->list.valid && contacts_save(c, &job->sim->list)) failed = 1;
    history *all = failed ? NULL : calloc(c->n + 1, sizeof *all);
    if (!all) {
        h5file_fail(&job->file->f, "contacts", "out of memory");
        return;
    }
    for (size_t k = 0; k < c->n; k++) {
        const saved_contact s = contacts_get(c, k);
        const int64_t i = p->id[s.i], j = p->id[s.j];
        const double sign = i < j ? 1 : -1;
        history *h = &all[k];
        h->key[0] = i < j ? i : j;
        h->key[1] = i < j ? j : i;
        for (int a = 0; a < 4; a++) {
            h->spring[a] = (a < 3 ? sign : 1) * s.spring[a];
            if (c->rolls) h->rolling[a] = (a < 3 ? sign : 1) * s.rolling[a];
        }
    }
    put_histories(job, "contacts", PAIR, all, c->n);
    free(all);
}

void restart_load_contacts(restart_job *job)
{
    contacts *c = &job->sim->contacts;
    size_t n;
    const history *all = get_histories(job, "contacts", PAIR, &n);
    if (!all) return;
    c->n = 0;
    for (size_t k = 0; k < n; k++) {
        const size_t i = restart_find(job, all[k].key[0]), j = restart_find(job, all[k].key[1]);
        if (i == job->n || j == job->n || i >= j) {
            restart_refuse(job->file, "contact %zu is between particles %lld and %lld", k,
                           (long long)all[k].key[0], (long long)all[k].key[1]);
            return;
        }
        saved_contact s = {.i = (uint32_t)i, .j = (uint32_t)j};
        memcpy(s.spring, all[k].spring, sizeof s.spring);
        memcpy(s.rolling, all[k].rolling, sizeof s.rolling);
        if (contacts_append(c, &s)) {
            restart_refuse(job->file, "out of memory with %zu contacts", n);
            return;
        }
    }
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
    if (!all) {
        h5file_fail(&job->file->f, "wallContacts", "out of memory");
        return;
    }
    for (const wall_entry *e = w->entry; e < w->entry + w->n_entry; e++) {
        if (!e->touch) continue;
        history *h = &all[n++];
        h->key[0] = job->sim->particles.id[e->particle];
        h->key[1] = e->wall;
        h->key[2] = e->part;
        memcpy(h->spring, e->spring, sizeof h->spring);
        memcpy(h->rolling, e->rolling, sizeof h->rolling);
    }
    put_histories(job, "wallContacts", AT_WALL, all, n);
    free(all);
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
    const history *all = get_histories(job, "wallContacts", AT_WALL, &n);
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
        const size_t i = restart_find(job, key[0]);
        if (i == job->n || key[1] < 0 || (uint64_t)key[1] >= n_wall || key[2] < 0) {
            restart_refuse(job->file, "contact %zu with a wall is of particle %lld and wall %lld",
                           k, (long long)key[0], (long long)key[1]);
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
