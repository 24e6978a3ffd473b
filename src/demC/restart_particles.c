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
    if (data)
        copy_column(job, c, data, 0);
    else
        h5file_fail(&job->file->f, c->set, "out of memory");
    if (data) restart_put_here(job, c->set, RESTART_REAL, job->n, c->width, data, c->units);
    free(data);
}

static double *load_column(restart_job *job, const column *c, int to_store)
{
    double *data = restart_get(job->file, c->set, RESTART_REAL, c->width, &job->n);
    if (data && to_store) copy_column(job, c, data, 1);
    return data;
}

/* Without a list the order in the store follows from nothing else; snapshots have it. */
static void save_places(restart_job *job)
{
    int64_t *place = malloc((job->n + 1) * sizeof *place);
    for (size_t k = 0; k < job->n && place; k++) place[k] = job->row[k];
    if (place)
        restart_put_here(job, "particles/place", RESTART_WHOLE, job->n, 1, place, "-");
    else
        h5file_fail(&job->file->f, "particles/place", "out of memory");
    free(place);
}

/* Put the particles, in the order of ids so far, where they were. */
static dem_status take_places(restart_job *job)
{
    const int64_t *place = restart_get(job->file, "particles/place", RESTART_WHOLE, 1, &job->n);
    uint32_t *order = restart_room(job, job->n * sizeof *order);
    uint32_t *there = restart_room(job, job->n * sizeof *there);
    if (!place || !order || !there) return DEM_IO;
    for (size_t k = 0; k < job->n; k++) order[k] = UINT32_MAX;
    for (size_t k = 0; k < job->n; k++) {
        const uint64_t to = (uint64_t)place[k];
        if (to >= job->n || order[to] != UINT32_MAX)
            return restart_refuse(job->file, "particle %lld is at place %lld of %zu",
                                  (long long)job->id[k], (long long)place[k], job->n);
        order[to] = (uint32_t)k;
        there[k] = (uint32_t)to;
    }
    contacts_renumber(&job->sim->contacts, there);
    walls_renumber(&job->sim->walls, there);
    return particles_permute(&job->sim->particles, order) ? no_memory(job->sim) : DEM_OK;
}

void restart_save_particles(restart_job *job)
{
    const particles *p = &job->sim->particles;
    int64_t *whole = malloc((job->n + 1) * sizeof *whole);
    if (!whole) {
        h5file_fail(&job->file->f, "write", "out of memory");
        return;
    }
    for (size_t k = 0; k < job->n; k++) whole[k] = p->id[job->row[k]];
    restart_put_here(job, "particles/id", RESTART_WHOLE, job->n, 1, whole, "-");
    for (size_t k = 0; k < job->n; k++) whole[k] = p->material[job->row[k]];
    restart_put_here(job, "particles/material", RESTART_WHOLE, job->n, 1, whole, "-");
    free(whole);
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
    const long long id = (long long)job->id[k];
    if (k > 0 && job->id[k] <= job->id[k - 1])
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

void restart_load_particles(restart_job *job)
{
    particles *p = &job->sim->particles;
    restart_file *f = job->file;
    job->n = RESTART_ANY;
    job->id = restart_get(f, "particles/id", RESTART_WHOLE, 1, &job->n);
    const int64_t *material = restart_get(f, "particles/material", RESTART_WHOLE, 1, &job->n);
    const double *radius = load_column(job, &RADIUS, 0), *mass = load_column(job, &MASS, 0);
    const double(*x)[3] = (const double(*)[3])load_column(job, &POSITION, 0);
    if (!f->f.failed && job->n > NEIGHBOUR_MASK)
        restart_refuse(f, "has %zu particles, at most %u go on one rank", job->n,
                       (unsigned)NEIGHBOUR_MASK);
    for (size_t k = 0; k < job->n && !f->f.failed; k++)
        check_row(job, k, material[k], radius[k], mass[k], x[k]);
    if (f->f.failed) return;
    if (particles_reserve(p, job->n)) {
        restart_refuse(f, "out of memory with %zu particles", job->n);
        return;
    }
    for (size_t k = 0; k < job->n; k++)
        particles_append(p, x[k], NULL, NULL, radius[k], mass[k] * job->heavier[material[k]],
                         job->material[material[k]], job->id[k]);
    for (size_t c = 0; c < LENGTH(COLUMN); c++) load_column(job, &COLUMN[c], 1);
    size_t one = 1;
    const int64_t *outside = restart_get(f, "state/outside", RESTART_WHOLE, 1, &one);
    if (!outside || !*outside) return;
    if (particles_open_outside(&job->sim->particles))
        restart_refuse(job->file, "out of memory with %zu particles", job->n);
    else
        load_column(job, &OUTSIDE, 1);
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
        if (data)
            restart_put_here(job, set, RESTART_REAL, job->n, width, data, "SI");
        else
            h5file_fail(&job->file->f, set, "out of memory");
        free(data);
    }
}

void restart_load_columns(restart_job *job)
{
    particles *p = &job->sim->particles;
    size_t n;
    char(*name)[DEM_NAME];
    int *width;
    restart_list(job->file, "columns", &n, &name, &width);
    for (size_t c = 0; c < n; c++) {
        char set[2 * DEM_NAME];
        snprintf(set, sizeof set, "columns/%s", name[c]);
        const double *data = restart_get(job->file, set, RESTART_REAL, width[c], &job->n);
        const int handle = data ? particles_attach(p, name[c], width[c]) : -1;
        if (data && handle < 0) restart_refuse(job->file, "out of memory");
        if (handle < 0) return;
        if (job->n)
            memcpy(particles_column(p, handle), data, job->n * sizeof *data * (size_t)width[c]);
        p->field[p->n_fixed + (size_t)handle].restored = 1;
    }
}

/* ---- the list ---------------------------------------------------------------------------------
 */

/* Build the list as it was, from where the particles were then. */
dem_status restart_list_again(restart_job *job)
{
    dem_sim *sim = job->sim;
    particles *p = &sim->particles;
    neighbour *list = &sim->list;
    if (!job->n) {
        list->valid = 0;
        return DEM_OK;
    }
    if (!list->valid) return take_places(job);
    double *built = load_column(job, &BUILT, 0), *now = load_column(job, &POSITION, 0);
    if (!built || !now) return DEM_IO;
    const double moved = list->moved;
    copy_column(job, &POSITION, built, 1);
    int uneven;
    const double reach = list_reach(sim, &uneven);
    sim->walls.slack = .5 * list->skin;
    const extent all = neighbour_extent(p);
    if (neighbour_sort(list, p, &all, reach) || neighbour_fill(list, p, uneven) ||
        contacts_restore(&sim->contacts, list))
        return no_memory(sim);
    list->moved = moved;
    job->row = list->place;
    copy_column(job, &POSITION, now, 1);
    job->row = NULL;
    if (walls_list(&sim->walls, p, .5 * list->skin + moved, list->place)) return no_memory(sim);
    return DEM_OK;
}
