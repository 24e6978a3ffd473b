/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_particles.c - particles, their columns and the neighbour list in a restart file.
 *
 * Rows are in the order of the ids. A particle whose material has got another density keeps its
 * size and changes its mass in that proportion; else the mass is the saved one to the last bit.
 */
#include "restart.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LENGTH(table) (sizeof table / sizeof *table)

/* Of the records of the store (particles.h): `width` numbers from `from` on. */
typedef struct column {
    const char *set, *units;
    size_t slot;
    int stride, from, width;
} column;

#define STORE(member) offsetof(particles, member)

static const column COLUMN[] = {
    {"particles/velocity", "m/s", STORE(vel), 8, 0, 3},
    {"particles/angularVelocity", "rad/s", STORE(vel), 8, 4, 3},
    {"particles/force", "N", STORE(last), 3, 0, 3},
    {"particles/impulse", "N s", STORE(impulse), 3, 0, 3},
};
static const column MASS = {"particles/mass", "kg", STORE(mass), 1, 0, 1};
static const column RADIUS = {"particles/radius", "m", STORE(radius), 1, 0, 1};
static const column POSITION = {"particles/position", "m", STORE(pos), 4, 0, 3};
static const column BUILT = {"particles/builtPosition", "m", STORE(built), 4, 0, 3};
static const column OUTSIDE = {"particles/outsideForce", "SI", STORE(outside), 8, 0, 8};

/* ---- particles ------------------------------------------------------------------------------- */

/* `to_store`: from the rows of `data`, [n][width], into the store, else the other way. */
static void copy_column(const restart_job *job, const column *c, double *data, int to_store)
{
    double *array = *(double **)(void *)((char *)&job->sim->particles + c->slot);
    const size_t bytes = (size_t)c->width * sizeof *data;
    for (size_t k = 0; k < job->n; k++) {
        const size_t row = job->row ? job->row[k] : k;
        double *there = array + row * (size_t)c->stride + c->from;
        double *here = data + k * (size_t)c->width;
        memcpy(to_store ? there : here, to_store ? here : there, bytes);
    }
}

static void save_column(restart_job *job, const column *c)
{
    double *data = malloc((job->n + 1) * (size_t)c->width * sizeof *data);
    if (data) copy_column(job, c, data, 0);
    restart_put_rows(job, c->set, RESTART_REAL, c->width, data, c->units);
}

static double *load_column(restart_job *job, const column *c, int to_store)
{
    double *data = restart_fetch(job, c->set, RESTART_REAL, c->width);
    if (data && to_store) copy_column(job, c, data, 1);
    return data;
}

/* Without a list the order in the store follows from nothing else; snapshots have it. The places of
 * a rank come after those of the ranks before. */
static void save_places(restart_job *job)
{
    const int64_t before = sum_before(job->sim, (int64_t)job->n);
    int64_t *place = malloc((job->n + 1) * sizeof *place);
    for (size_t k = 0; k < job->n && place; k++) place[k] = before + job->row[k];
    restart_put_rows(job, "particles/place", RESTART_WHOLE, 1, place, "-");
}

typedef struct by_place {
    int64_t place;
    uint32_t row;
} by_place;

static int compare_places(const void *a, const void *b)
{
    const int64_t x = ((const by_place *)a)->place, y = ((const by_place *)b)->place;
    return (x > y) - (x < y);
}

/* order[k] of the particles, in the order of ids so far, comes k-th, and there[order[k]] is k. */
static void order_places(restart_job *job, const int64_t *place, uint32_t *order, uint32_t *there)
{
    by_place *all = restart_room(job, job->n * sizeof *all);
    for (size_t k = 0; k < job->n && all; k++) all[k] = (by_place){place[k], (uint32_t)k};
    if (job->n && all) qsort(all, job->n, sizeof *all, compare_places);
    for (size_t k = 0; k < job->n && all; k++) {
        const int64_t at = all[k].place;
        if (at < 0 || (uint64_t)at >= job->slab.total || (k > 0 && at == all[k - 1].place)) {
            restart_refuse(job->file, "particle %lld is at place %lld of %zu",
                           (long long)job->id[all[k].row], (long long)at, (size_t)job->slab.total);
            return;
        }
        order[k] = all[k].row;
        there[all[k].row] = (uint32_t)k;
    }
}

/* Put the particles in the order in which they were. */
static dem_status take_places(restart_job *job)
{
    dem_sim *sim = job->sim;
    particles *p = &sim->particles;
    const int64_t *place = restart_fetch(job, "particles/place", RESTART_WHOLE, 1);
    const size_t n = job->n + p->n_ghost; /* ghosts stay behind them */
    uint32_t *order = restart_room(job, n * sizeof *order);
    uint32_t *there = restart_room(job, n * sizeof *there);
    if (place && order && there) order_places(job, place, order, there);
    if (job->file->f.failed) return DEM_IO;
    for (size_t k = job->n; k < n; k++) order[k] = there[k] = (uint32_t)k;
    contacts_renumber(&sim->contacts, there);
    walls_renumber(&sim->walls, there);
    if (sim->ranks > 1) halo_follow(sim, there);
    return particles_permute(p, order) ? no_memory(sim) : DEM_OK;
}

void restart_save_particles(restart_job *job)
{
    const particles *p = &job->sim->particles;
    for (int c = 0; c < 2; c++) {
        int64_t *whole = malloc((job->n + 1) * sizeof *whole);
        for (size_t k = 0; k < job->n && whole; k++)
            whole[k] = c ? p->material[job->row[k]] : p->id[job->row[k]];
        restart_put_rows(job, c ? "particles/material" : "particles/id", RESTART_WHOLE, 1, whole,
                         "-");
    }
    save_column(job, &RADIUS);
    save_column(job, &MASS);
    save_column(job, &POSITION);
    if (job->sim->list.valid)
        save_column(job, &BUILT);
    else
        save_places(job);
    if (job->sim->outside) save_column(job, &OUTSIDE);
    for (size_t c = 0; c < LENGTH(COLUMN); c++) save_column(job, &COLUMN[c]);
}

/* A particle of the file can be one here. */
static void check_row(restart_job *job, size_t k, int64_t material, double radius, double mass,
                      const double x[3])
{
    const long long id = (long long)job->slab_id[k];
    if (k > 0 && job->slab_id[k] <= job->slab_id[k - 1])
        restart_refuse(job->file, "particle id %lld is out of order", id);
    else if (material < 0 || (uint64_t)material >= job->n_material)
        restart_refuse(job->file, "particle %lld: no material %lld", id, (long long)material);
    else if (job->material[material] < 0)
        restart_refuse(job->file,
                       "material %.*s, that of particle %lld, is none of this simulation's",
                       DEM_NAME, job->material_name[material], id);
    else if (!(radius > 0) || !(mass > 0) || !isfinite(radius + mass + x[0] + x[1] + x[2]))
        restart_refuse(job->file, "particle %lld: radius, mass or position is no such number", id);
}

/* What decides whether and where a particle can be. */
typedef struct slab {
    int64_t *id, *material;
    double *radius, *mass;
    double (*x)[3], (*built)[3]; /* built: NULL without a list */
} slab;

static double *slab_column(restart_job *job, const column *c)
{
    return restart_slab(job->file, c->set, RESTART_REAL, c->width, &job->slab);
}

static void read_slab(restart_job *job, slab *s)
{
    restart_file *f = job->file;
    size_t one = 1;
    job->slab.total = RESTART_ANY;
    job->slab_id = s->id = restart_slab(f, "particles/id", RESTART_WHOLE, 1, &job->slab);
    s->material = restart_slab(f, "particles/material", RESTART_WHOLE, 1, &job->slab);
    s->radius = slab_column(job, &RADIUS);
    s->mass = slab_column(job, &MASS);
    s->x = (double(*)[3])slab_column(job, &POSITION);
    const int64_t *listed = restart_get(f, "state/listed", RESTART_WHOLE, 1, &one);
    s->built = listed && *listed ? (double(*)[3])slab_column(job, &BUILT) : NULL;
    for (size_t k = 0; k < job->slab.n && !f->f.failed; k++) {
        check_row(job, k, s->material[k], s->radius[k], s->mass[k], s->x[k]);
        const double *b = s->built ? s->built[k] : s->x[k];
        if (!isfinite(b[0] + b[1] + b[2]))
            restart_refuse(f, "particle %lld: its position in the list is no such number",
                           (long long)s->id[k]);
    }
}

void restart_load_particles(restart_job *job)
{
    particles *p = &job->sim->particles;
    h5file *f = &job->file->f;
    slab s;
    read_slab(job, &s);
    if (!h5file_agree(f)) return;
    /* Where the list was built is where a particle's owner was found. */
    restart_plan_loading(job, (const double(*)[3])(s.built ? s.built : s.x), s.radius);
    if (!h5file_agree(f)) return;
    if (job->sim->ranks > 1) { /* the rank asked for an owner needs the ids yet */
        int64_t *copy = restart_room(job, (job->slab.n + 1) * sizeof *copy);
        if (copy) memcpy(copy, s.id, job->slab.n * sizeof *copy);
        job->slab_id = copy;
    }
    job->id = restart_bring(job, s.id, 1);
    const int64_t *material = restart_bring(job, s.material, 1);
    const double *radius = restart_bring(job, s.radius, 1), *mass = restart_bring(job, s.mass, 1);
    const double(*x)[3] = restart_bring(job, s.x, 3);
    if (s.built) restart_drop(job->file, s.built);
    if (!f->failed && job->n > NEIGHBOUR_MASK)
        restart_refuse(job->file, "has %zu particles for one rank, at most %u go on it", job->n,
                       (unsigned)NEIGHBOUR_MASK);
    else if (!f->failed && particles_reserve(p, job->n))
        restart_refuse(job->file, "out of memory with %zu particles", job->n);
    if (!h5file_agree(f)) return;
    for (size_t k = 0; k < job->n; k++)
        particles_append(p, x[k], NULL, NULL, radius[k], mass[k] * job->heavier[material[k]],
                         job->material[material[k]], job->id[k]);
    for (size_t c = 0; c < LENGTH(COLUMN); c++) load_column(job, &COLUMN[c], 1);
    size_t one = 1;
    const int64_t *outside = restart_get(job->file, "state/outside", RESTART_WHOLE, 1, &one);
    if (!h5file_agree(f)) return;
    if (!*outside) return;
    if (particles_open_outside(&job->sim->particles)) restart_no_memory(job);
    if (h5file_agree(f)) load_column(job, &OUTSIDE, 1);
}

/* ---- attached columns, numbers of the caller ------------------------------------------------- */

void restart_save_columns(restart_job *job)
{
    const particles *p = &job->sim->particles;
    for (const field *f = p->field + p->n_fixed; f < p->field + p->n_field; f++) {
        const int width = (int)(f->size / sizeof(double));
        char set[2 * DEM_NAME];
        snprintf(set, sizeof set, "columns/%s", f->name);
        if (!f->name[0] || strchr(f->name, '/') || restart_has(job->file, set)) {
            h5file_fail(&job->file->f, f->name, "no name for a column, or there are two of it");
            return;
        }
        double *data = malloc((job->n + 1) * f->size);
        for (size_t k = 0; k < job->n && data; k++)
            memcpy(data + k * (size_t)width, (const char *)f->data + job->row[k] * f->size,
                   f->size);
        restart_put_rows(job, set, RESTART_REAL, width, data, "SI");
    }
}

void restart_load_columns(restart_job *job)
{
    particles *p = &job->sim->particles;
    size_t n;
    char(*name)[DEM_NAME];
    int *width;
    restart_list(job->file, "columns", &n, &name, &width);
    if (!h5file_agree(&job->file->f)) return;
    for (size_t c = 0; c < n; c++) {
        char set[2 * DEM_NAME];
        snprintf(set, sizeof set, "columns/%s", name[c]);
        const double *data = restart_fetch(job, set, RESTART_REAL, width[c]);
        const int handle = data ? particles_attach(p, name[c], width[c]) : -1;
        if (data && handle < 0) restart_refuse(job->file, "out of memory");
        if (!h5file_agree(&job->file->f)) return;
        if (job->n)
            memcpy(particles_column(p, handle), data, job->n * sizeof *data * (size_t)width[c]);
        p->field[p->n_fixed + (size_t)handle].restored = 1;
    }
}

/* ---- the list ---------------------------------------------------------------------------------
 */

/* Ghosts, as a step makes them, and the histories with all. */
static dem_status find_partners(restart_job *job)
{
    dem_sim *sim = job->sim;
    dem_status status = DEM_OK;
    if (sim->ranks > 1) status = halo_make(sim, sim->largest_radius + sim->list.skin);
    return status ? status : agree(sim, restart_link_contacts(job));
}

/* Build the list as it was, from where the particles were then. */
static dem_status build_again(restart_job *job, double *built, double *now)
{
    dem_sim *sim = job->sim;
    neighbour *list = &sim->list;
    const double moved = list->moved;
    copy_column(job, &POSITION, built, 1);
    dem_status status = find_partners(job);
    if (!status) status = agree(sim, list_pairs(sim));
    if (status) return status;
    list->moved = moved;
    job->row = list->place;
    copy_column(job, &POSITION, now, 1);
    job->row = NULL;
    if (sim->ranks > 1) halo_refresh(sim);
    sim->walls.slack = .5 * list->skin;
    if (walls_list(&sim->walls, &sim->particles, .5 * list->skin + moved, list->place))
        status = no_memory(sim);
    return agree(sim, status);
}

dem_status restart_list_again(restart_job *job)
{
    dem_sim *sim = job->sim;
    h5file *f = &job->file->f;
    if (!job->slab.total) {
        sim->list.valid = 0;
        return DEM_OK;
    }
    if (sim->list.valid) {
        double *built = load_column(job, &BUILT, 0), *now = load_column(job, &POSITION, 0);
        return h5file_agree(f) ? build_again(job, built, now) : DEM_IO;
    }
    if (sim->ranks > 1) neighbour_wrap(&sim->list, &sim->particles);
    const dem_status status = find_partners(job);
    return status ? status : agree(sim, take_places(job));
}
