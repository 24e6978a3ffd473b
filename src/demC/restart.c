/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart.c - the state of a simulation in a file, and back.
 *
 * What the state is stands in tables: SCALAR of the simulation, COLUMN of the particles
 * (restart_particles.c), and CHAPTER, the functions that save and load what has a form of its own.
 * What follows from parameters (coefficients, shapes, motions, rates) is not state: a restart takes
 * it from the parameters it is given, so that they may be changed.
 *
 * Bit for bit. The order in which forces are summed is that of the particles in the store, which
 * the neighbour list decides when it is built, from the positions and ids of that moment; and when
 * it is built next depends on how far particles have moved since. So the positions of the build are
 * saved with those of now; loading builds the list from them, as it was, and then puts the
 * particles where they are. If the list no longer held when the state was saved, after particles
 * came or went, the next step builds it, here as there. The list of particles near walls has no say
 * in any sum and is made anew.
 *
 * On any number of ranks. Particles are in the order of their ids, contacts in that of the pair of
 * ids with the springs turned to act on the lower one, wall contacts by id and the name of the
 * wall: nothing refers to a place in memory, nor to a rank. Every rank writes and reads an even
 * share (restart_rows.c).
 *
 *     /state    SCALAR                         /particles, /columns   COLUMN, attached columns
 *     /model    law, rolling, periodic, domain /contacts, /wallContacts, /walls   histories
 *     /balance  sums of energies               /feeders, /outlets     what has come and gone
 *     /materials                               /kept                  numbers of the caller
 */
#include "restart.h"

#include "check.h"
#include "report.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REAL(set, units, member)                                                                   \
    {                                                                                              \
        set, units, RECORD_REAL, offsetof(dem_sim, member)                                         \
    }
#define PART(set, units, member)                                                                   \
    {                                                                                              \
        set, units, RECORD_PART, offsetof(dem_sim, member)                                         \
    }
#define LONG(set, member)                                                                          \
    {                                                                                              \
        set, "-", RECORD_INT64, offsetof(dem_sim, member)                                          \
    }
#define WHOLE(set, member)                                                                         \
    {                                                                                              \
        set, "-", RECORD_INT, offsetof(dem_sim, member)                                            \
    }
#define LENGTH(table) (sizeof table / sizeof *table)

static const restart_record SCALAR[] = {
    REAL("state/time", "s", time),
    LONG("state/nextId", particles.next_id),
    REAL("state/speed", "m/s", speed),
    REAL("state/overlap", "-", overlap),
    REAL("state/medianRadius", "m", median_radius),
    REAL("state/mass", "kg", mass),
    WHOLE("state/outside", outside),
    WHOLE("state/listed", list.valid),
    REAL("state/skin", "m", list.skin),
    REAL("state/moved", "m", list.moved),
    REAL("state/step", "s", report.step),
    REAL("state/heldStep", "s", held_step),
    WHOLE("state/substeps", report.substeps),
    LONG("state/rebuilds", report.rebuilds),
    LONG("state/contacts", report.contacts),
    LONG("state/wallContacts", report.wall_contacts),
    REAL("state/reportedOverlap", "-", report.overlap),
    WHOLE("balance/on", balance.on),
    PART("balance/gravity", "J", balance.gravity),
    PART("balance/outside", "J", balance.outside),
    PART("balance/walls", "J", balance.walls),
    PART("balance/damping", "J", balance.damping),
    PART("balance/sliding", "J", balance.sliding),
    PART("balance/rolling", "J", balance.rolling),
    PART("balance/supply", "J", balance.supply),
    PART("balance/tangential", "J", balance.tangential),
    PART("balance/turned", "J", balance.turned),
    WHOLE("balance/changed", balance.changed),
    PART("balance/elastic", "J", balance.elastic),
};

/* ---- tools ----------------------------------------------------------------------------------- */

void *restart_room(restart_job *job, size_t bytes)
{
    return restart_hold(job->file, bytes);
}

void restart_put_here(restart_job *job, const char *set, restart_kind kind, size_t n, int width,
                      const void *data, const char *units)
{
    const h5rows rows = {job->sim->rank == 0 ? n : 0, 0, n}; /* the first rank writes it */
    restart_put(job->file, set, kind, rows, width, data, units);
}

static int holds_real(const restart_record *r)
{
    return r->type == RECORD_REAL || r->type == RECORD_PART || r->type == RECORD_LIMIT;
}

/* Whether a value of a file can be the member. Counts leave room to go on. */
static int can_be(const restart_record *r, const void *value)
{
    double real;
    int64_t whole;
    memcpy(&real, value, sizeof real);
    memcpy(&whole, value, sizeof whole);
    switch (r->type) {
    case RECORD_REAL:
    case RECORD_PART:
        return isfinite(real);
    case RECORD_LIMIT:
        return !isnan(real);
    case RECORD_INT64:
        return whole >= INT64_MIN / 2 && whole <= INT64_MAX / 2;
    default:
        return whole >= INT_MIN && whole <= INT_MAX;
    }
}

void restart_put_records(restart_job *job, const restart_record *table, size_t n_table,
                         const void *base, size_t stride, size_t n)
{
    double *real = malloc((n + 1) * sizeof *real);
    int64_t *whole = malloc((n + 1) * sizeof *whole);
    if (!real || !whole) restart_no_memory(job);
    const int good = h5file_agree(&job->file->f);
    for (size_t t = 0; t < n_table && good; t++) {
        const restart_record *r = &table[t];
        const int is_real = holds_real(r);
        for (size_t k = 0; k < n; k++) {
            const char *member = (const char *)base + k * stride + r->at;
            if (is_real)
                memcpy(&real[k], member, sizeof *real);
            else if (r->type == RECORD_INT64)
                memcpy(&whole[k], member, sizeof *whole);
            else
                whole[k] = *(const int *)(const void *)member;
        }
        if (r->type == RECORD_PART) sum_reals(job->sim, real, (int)n);
        restart_put_here(job, r->set, is_real ? RESTART_REAL : RESTART_WHOLE, n, 1,
                         is_real ? (void *)real : (void *)whole, r->units);
    }
    free(real);
    free(whole);
}

void restart_get_records(restart_job *job, const restart_record *table, size_t n_table, void *base,
                         size_t stride, size_t n, const size_t *place)
{
    for (size_t t = 0; t < n_table; t++) {
        const restart_record *r = &table[t];
        const char *data =
            restart_get(job->file, r->set, holds_real(r) ? RESTART_REAL : RESTART_WHOLE, 1, &n);
        for (size_t k = 0; k < n && data; k++) {
            if (place && place[k] == SIZE_MAX) continue;
            char *member = (char *)base + (place ? place[k] : k) * stride + r->at;
            const char *value = data + 8 * k;
            if (!can_be(r, value))
                restart_refuse(job->file, "row %zu of dataset %s is no such number", k, r->set);
            else if (r->type == RECORD_INT)
                *(int *)(void *)member = (int)*(const int64_t *)(const void *)value;
            else if (r->type == RECORD_PART && job->sim->rank > 0)
                memset(member, 0, sizeof(double));
            else
                memcpy(member, value, 8);
        }
    }
}

size_t *restart_match(restart_job *job, const char *set, size_t n, const char *names, size_t stride,
                      size_t *rows)
{
    *rows = RESTART_ANY;
    const char(*found)[DEM_NAME] = restart_get(job->file, set, RESTART_TEXT, 1, rows);
    size_t *place = found ? restart_room(job, *rows * sizeof *place) : NULL;
    unsigned char *taken = restart_room(job, n);
    for (size_t k = 0; place && taken && k < *rows; k++) {
        size_t i = 0; /* names that occur twice are taken in their order */
        while (i < n && (taken[i] || strncmp(found[k], names + i * stride, DEM_NAME) != 0)) i++;
        place[k] = i < n ? i : SIZE_MAX;
        if (i < n) taken[i] = 1;
    }
    return place;
}

size_t restart_find(const int64_t *all, size_t n, int64_t id)
{
    size_t low = 0, high = n;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (all[middle] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low < n && all[low] == id ? low : n;
}

/* ---- what must agree ------------------------------------------------------------------------- */

static const char *const LAW[] = {[DEM_LINEAR] = "linear", [DEM_HERTZ] = "hertz"};
static const char *const ROLLING[] = {
    [DEM_ROLLING_NONE] = "none", [DEM_ROLLING_CONSTANT] = "constant", [DEM_ROLLING_EPSD] = "epsd"};

static void save_model(restart_job *job)
{
    const dem_sim *sim = job->sim;
    char law[2][DEM_NAME] = {{0}};
    strcpy(law[0], LAW[sim->law]);
    strcpy(law[1], ROLLING[sim->extras.rolling]);
    restart_put_here(job, "model/law", RESTART_TEXT, 1, 1, law[0], "-");
    restart_put_here(job, "model/rolling", RESTART_TEXT, 1, 1, law[1], "-");
    const int64_t periodic[3] = {sim->periodic[0] != 0, sim->periodic[1] != 0,
                                 sim->periodic[2] != 0};
    double box[6];
    memcpy(box, sim->lo, sizeof sim->lo);
    memcpy(box + 3, sim->hi, sizeof sim->hi);
    restart_put_here(job, "model/periodic", RESTART_WHOLE, 1, 3, periodic, "-");
    restart_put_here(job, "model/domain", RESTART_REAL, 1, 6, box, "m");
    const size_t n = (size_t)sim->n_material;
    char(*name)[DEM_NAME] = calloc(n + 1, sizeof *name);
    double *density = calloc(n + 1, sizeof *density);
    for (size_t k = 0; k < n && name && density; k++) {
        snprintf(name[k], sizeof *name, "%s", sim->material[k].name);
        density[k] = sim->material[k].density;
    }
    if (!name || !density) h5file_fail(&job->file->f, "write", "out of memory");
    restart_put_here(job, "materials/name", RESTART_TEXT, n, 1, name, "-");
    restart_put_here(job, "materials/density", RESTART_REAL, n, 1, density, "kg/m3");
    free(name);
    free(density);
}

static void load_law(restart_job *job, const char *set, const char *what, const char *here)
{
    size_t one = 1;
    const char *there = restart_get(job->file, set, RESTART_TEXT, 1, &one);
    if (there && strncmp(there, here, DEM_NAME) != 0)
        restart_refuse(job->file, "its %s is %.*s, that of this simulation %s", what, DEM_NAME,
                       there, here);
}

static void load_model(restart_job *job)
{
    const dem_sim *sim = job->sim;
    size_t one = 1;
    load_law(job, "model/law", "contact law", LAW[sim->law]);
    load_law(job, "model/rolling", "rolling resistance", ROLLING[sim->extras.rolling]);
    const int64_t *periodic = restart_get(job->file, "model/periodic", RESTART_WHOLE, 3, &one);
    const double *box = restart_get(job->file, "model/domain", RESTART_REAL, 6, &one);
    for (int a = 0; a < 3 && periodic && box; a++) {
        const int here = sim->periodic[a] != 0;
        if (here != (periodic[a] != 0))
            restart_refuse(job->file, "direction %c is %speriodic there, here it is%s", "xyz"[a],
                           here ? "not " : "", here ? "" : " not");
        else if (here && (box[a] != sim->lo[a] || box[3 + a] != sim->hi[a]))
            restart_refuse(job->file,
                           "the periodic sides %c were at %.9g and %.9g m, not %.9g and "
                           "%.9g",
                           "xyz"[a], box[a], box[3 + a], sim -> lo[a], sim -> hi[a]);
    }
    size_t rows;
    const char *names = sim->n_material ? sim->material[0].name : "";
    const size_t *place = restart_match(job, "materials/name", (size_t)sim->n_material, names,
                                        sizeof *sim->material, &rows);
    const double *density = restart_get(job->file, "materials/density", RESTART_REAL, 1, &rows);
    job->material = restart_room(job, rows * sizeof *job->material);
    job->heavier = restart_room(job, rows * sizeof *job->heavier);
    if (job->file->f.failed) return;
    job->n_material = rows;
    job->material_name = restart_get(job->file, "materials/name", RESTART_TEXT, 1, &rows);
    for (size_t k = 0; k < rows; k++) {
        job->material[k] = place[k] == SIZE_MAX ? -1 : (int)place[k];
        job->heavier[k] = place[k] == SIZE_MAX ? 1 : sim->material[place[k]].density / density[k];
    }
}

/* ---- numbers of the caller ------------------------------------------------------------------- */

static int kept_by_name(const void *a, const void *b)
{
    return strcmp(((const kept_numbers *)a)->name, ((const kept_numbers *)b)->name);
}

static dem_status keep_here(dem_sim *sim, const char *name, size_t n, const double *value)
{
    if (!name[0] || strlen(name) >= DEM_NAME || strchr(name, '/'))
        return fail(sim, DEM_BAD_ARGUMENT, "'%s' is no name for numbers to keep", name);
    size_t at = 0;
    while (at < sim->n_kept && strcmp(sim->kept[at].name, name) != 0) at++;
    kept_numbers *more = at < sim->n_kept ? sim->kept : realloc(sim->kept, (at + 1) * sizeof *more);
    double *copy = malloc((n + 1) * sizeof *copy);
    if (more) sim->kept = more;
    if (!more || !copy) {
        free(copy);
        return no_memory(sim);
    }
    if (n) memcpy(copy, value, n * sizeof *copy);
    if (at < sim->n_kept)
        free(more[at].value);
    else
        sim->n_kept++;
    snprintf(more[at].name, sizeof more[at].name, "%s", name);
    more[at].n = n;
    more[at].value = copy;
    qsort(more, sim->n_kept, sizeof *more, kept_by_name); /* as they come from a file */
    return DEM_OK;
}

dem_status dem_keep(dem_sim *sim, const char *name, size_t n, const double *value)
{
    return agree(sim, keep_here(sim, name, n, value));
}

size_t dem_kept(const dem_sim *sim, const char *name, size_t n, double *value)
{
    for (size_t k = 0; k < sim->n_kept; k++)
        if (strcmp(sim->kept[k].name, name) == 0) {
            const size_t count = sim->kept[k].n < n ? sim->kept[k].n : n;
            if (count) memcpy(value, sim->kept[k].value, count * sizeof *value);
            return sim->kept[k].n;
        }
    return 0;
}

static void save_kept(restart_job *job)
{
    for (size_t n = 0; n < job->sim->n_kept; n++) {
        const kept_numbers *k = &job->sim->kept[n];
        char set[2 * DEM_NAME];
        snprintf(set, sizeof set, "kept/%s", k->name);
        restart_put_here(job, set, RESTART_REAL, k->n, 1, k->value, "SI");
    }
}

static void load_kept(restart_job *job)
{
    size_t n;
    char(*name)[DEM_NAME];
    int *width;
    restart_list(job->file, "kept", &n, &name, &width);
    for (size_t k = 0; k < n; k++) {
        char set[2 * DEM_NAME];
        size_t rows = RESTART_ANY;
        snprintf(set, sizeof set, "kept/%s", name[k]);
        const double *value = restart_get(job->file, set, RESTART_REAL, 1, &rows);
        if (value && keep_here(job->sim, name[k], rows, value))
            restart_refuse(job->file, "out of memory");
    }
}

/* ---- the whole ------------------------------------------------------------------------------- */

static void save_scalars(restart_job *job)
{
    restart_put_records(job, SCALAR, LENGTH(SCALAR), job->sim, sizeof *job->sim, 1);
}

typedef struct chapter {
    void (*save)(restart_job *job), (*load)(restart_job *job);
} chapter;

/* In this order: the first must agree, histories refer to particles. Scalars are loaded at last
 * (settle), for the others change some of them. */
static const chapter CHAPTER[] = {
    {save_scalars, NULL},
    {save_model, load_model},
    {restart_save_particles, restart_load_particles},
    {restart_save_columns, restart_load_columns},
    {restart_save_contacts, restart_load_contacts},
    {restart_save_walls, restart_load_walls},
    {restart_save_flow, restart_load_flow},
    {save_kept, load_kept},
};

/* No less than the file will take: numbers of a particle and of contacts, and the small datasets,
 * each with some 600 bytes of description. */
static size_t bytes_of(dem_sim *sim)
{
    const particles *p = &sim->particles;
    const walls *w = &sim->walls;
    size_t sets = LENGTH(SCALAR) + 80 + sim->n_kept, row = 30 * 8;
    for (size_t f = p->n_fixed; f < p->n_field; f++, sets++) row += p->field[f].size;
    size_t here = p->n * row + sim->contacts.n * 10 * 8 + w->n_entry * 11 * 8;
    sum_counts(sim, (int64_t *)&here, 1);
    here += (size_t)sim->n_material * (DEM_NAME + 8) + w->n * (DEM_NAME + 7 * 8);
    const feeders *f = &sim->feeders;
    if (f->n) here += f->n * (DEM_NAME + 32 * 8 + gsl_rng_size(f->feeder[0].rng));
    here += sim->outlets.n * (DEM_NAME + 8 * 8);
    for (size_t k = 0; k < sim->n_kept; k++) here += sim->kept[k].n * sizeof(double);
    return here + sets * 1024 + 65536;
}

dem_status dem_write_restart(dem_sim *sim, const char *directory, const char *name, int keep)
{
    restart_file file;
    restart_job job = {.sim = sim, .file = &file};
    contacts *c = &sim->contacts;
    /* Without a list that holds they are saved already. */
    dem_status status = sim->list.valid && contacts_save(c, &sim->list) ? no_memory(sim) : DEM_OK;
    status = agree(sim, status);
    if (status) return status;
    restart_create(&file, sim->comm, directory, name, bytes_of(sim), sim->message,
                   sizeof sim->message);
    if (h5file_agree(&file.f)) restart_plan_saving(&job);
    int good = h5file_agree(&file.f);
    for (size_t k = 0; k < LENGTH(CHAPTER) && good; k++) {
        CHAPTER[k].save(&job);
        good = h5file_agree(&file.f);
    }
    free(job.row);
    free(job.bound);
    restart_route_free(&job.route);
    return restart_finish(&file, directory, sim->time, (int64_t)job.slab.total, keep);
}

/* Everything is in its place: scalars, the list, and what is worked out from them. */
static dem_status settle(restart_job *job)
{
    dem_sim *sim = job->sim;
    const int balanced = sim->balance.on;
    dem_status status = check_range(sim, sim->largest_radius);
    if (status) return status;
    restart_get_records(job, SCALAR, LENGTH(SCALAR), sim, sizeof *sim, 1, NULL);
    if (!h5file_agree(&job->file->f)) return DEM_IO;
    walls_move(&sim->walls, sim->time, 0);
    status = restart_list_again(job);
    if (status) return status;
    particles_publish(&sim->particles, sim->lo, sim->hi, sim->periodic);
    report_sums(sim);
    const int was_balanced = sim->balance.on;
    sim->balance.on = balanced;
    balance_report(sim);
    /* A balance that begins now begins with what there is. */
    if (balanced && !was_balanced) {
        if (sim->rank == 0) sim->balance.supply += sim->report.energy.residual;
        balance_report(sim);
    }
    return agree(sim, check_inside(sim));
}

/* Part by part, as long as all ranks are well. */
static dem_status load(restart_job *job)
{
    dem_sim *sim = job->sim;
    h5file *f = &job->file->f;
    size_t one = 1;
    dem_status status = DEM_OK;
    /* As finely as they were: forces depend on the samples. */
    const double *sampled = restart_get(job->file, "walls/sampled", RESTART_REAL, 2, &one);
    if (!h5file_agree(f)) return DEM_IO;
    if (sampled[0] > 0) status = walls_sample_at(sim, sampled[0], sampled[1]);
    for (size_t k = 0; k < LENGTH(CHAPTER) && !status; k++) {
        if (CHAPTER[k].load) CHAPTER[k].load(job);
        if (!h5file_agree(f)) return DEM_IO;
    }
    if (status) return status;
    take_stock(sim);
    status = settle(job);
    return status ? status : h5file_agree(f) ? DEM_OK : DEM_IO;
}

dem_status restart_read(dem_sim *sim, const char *path)
{
    restart_file file;
    restart_job job = {.sim = sim, .file = &file};
    char note[sizeof sim->message]; /* what the making of walls had to say */
    memcpy(note, sim->message, sizeof note);
    dem_status status = restart_open(&file, sim->comm, path, sim->message, sizeof sim->message);
    if (!status) status = load(&job);
    restart_route_free(&job.route);
    restart_close(&file);
    if (!status && !sim->message[0]) memcpy(sim->message, note, sizeof note);
    return status;
}
