/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * dem.c - life cycle of a simulation: made from parameters, looked at, freed.
 */
#include "check.h"
#include "dem_internal.h"
#include "force.h"
#include "insert.h"
#include "restart.h"
#include "snapshot.h"
#include "time_step.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

dem_status fail(dem_sim *sim, dem_status status, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(sim->message, sizeof sim->message, format, list);
    va_end(list);
    return status;
}

dem_status no_memory(dem_sim *sim)
{
    return fail(sim, DEM_NO_MEMORY, "out of memory with %zu particles", sim->particles.n);
}

/* ---- life cycle ------------------------------------------------------------------------------ */

dem_param dem_param_default(void)
{
    dem_param p;
    memset(&p, 0, sizeof p);
    p.law = DEM_LINEAR;
    p.steps_per_period = 20; /* thesis, section 2.1.1(3) */
    p.skin = .15;
    p.imbalance = 1.1;
    return p;
}

/* Materials and the table of their coefficients. */
static dem_status copy_materials(dem_sim *sim, const dem_param *param)
{
    size_t n = param->n_material, pairs = n * n;
    sim->n_material = (int)n;
    sim->material = malloc((n + 1) * sizeof *sim->material);
    sim->pair = malloc((pairs + 1) * sizeof *sim->pair);
    sim->table = malloc((pairs + 1) * sizeof *sim->table);
    sim->resistance = malloc((pairs + 1) * sizeof *sim->resistance);
    sim->smallest_mass = malloc((n + 1) * sizeof *sim->smallest_mass);
    sim->smallest_radius = malloc((n + 1) * sizeof *sim->smallest_radius);
    if (!sim->material || !sim->pair || !sim->table || !sim->resistance || !sim->smallest_mass ||
        !sim->smallest_radius)
        return no_memory(sim);
    if (n) memcpy(sim->material, param->material, n * sizeof *sim->material);
    if (n) memcpy(sim->pair, param->pair, pairs * sizeof *sim->pair);
    for (size_t a = 0; a < n; a++) {
        sim->smallest_mass[a] = sim->smallest_radius[a] = INFINITY;
        for (size_t b = 0; b < n; b++)
            sim->table[a * n + b] = coefficient_of_pair(
                param->law, &param->material[a], &param->material[b], &param->pair[a * n + b]);
    }
    for (size_t k = 0; k < pairs; k++) sim->resistance[k] = resistance_of_pair(&param->pair[k]);
    return DEM_OK;
}

/* Models beyond the plain contact law. */
static void choose_extras(dem_sim *sim, const dem_param *param)
{
    sim->extras = (extras){.law = param->law,
                           .rolling = param->rolling,
                           .cohesion = param->cohesion,
                           .balance = param->balance != 0,
                           .table = sim->resistance};
    sim->any_extra = param->rolling || param->cohesion || param->balance;
    sim->contacts.rolls = param->rolling == DEM_ROLLING_EPSD;
    sim->balance.on = param->balance != 0;
}

static dem_status copy_param(dem_sim *sim, const dem_param *param)
{
    memcpy(sim->lo, param->lo, sizeof sim->lo);
    memcpy(sim->hi, param->hi, sizeof sim->hi);
    memcpy(sim->periodic, param->periodic, sizeof sim->periodic);
    memcpy(sim->gravity, param->gravity, sizeof sim->gravity);
    sim->law = param->law;
    sim->steps_per_period = param->steps_per_period;
    sim->time_step = param->time_step;
    sim->impact_speed = param->impact_speed;
    sim->skin = param->skin;
    sim->imbalance = param->imbalance;
    sim->fixed_step = param->fixed_step;
    neighbour_init(&sim->list, sim->lo, sim->hi, sim->periodic, sim->ranks > 1);
    dem_status status = copy_materials(sim, param);
    if (status) return status;
    choose_extras(sim, param);
    sim->progress = (sdf_progress){.call = param->progress, .context = param->progress_context};
    sim->sdf_cache = param->sdf_cache ? strdup(param->sdf_cache) : NULL;
    if (param->sdf_cache && !sim->sdf_cache) return no_memory(sim);
    if (walls_init(&sim->walls, param->n_wall, param->wall, sim->lo, sim->hi) ||
        particles_init(&sim->particles))
        return no_memory(sim);
    return DEM_OK;
}

static dem_status run_insertion(dem_sim *sim, const dem_insertion *ins)
{
    const dem_view view = dem_particles(sim);
    const insert_place place = {.lo = sim->lo,
                                .hi = sim->hi,
                                .periodic = sim->periodic,
                                .n_old = view.n,
                                .x_old = view.x,
                                .r_old = view.radius,
                                .id_old = view.id,
                                .n_material = (size_t)sim->n_material,
                                .material = sim->material,
                                .sim = sim};
    arrivals a;
    dem_status status = insert_particles(ins, &place, &a, sim->message, sizeof sim->message);
    if (!status) /* every rank hands over its share */
        status = dem_add(sim, a.n, (const double(*)[3])a.x, (const double(*)[3])a.v,
                         (const double(*)[3])a.omega, a.radius, a.material, NULL);
    arrivals_free(&a);
    return status;
}

/* A simulation of these ranks, empty; NULL on all of them if one has no memory. */
static dem_sim *new_sim(MPI_Comm comm)
{
    dem_sim *sim = calloc(1, sizeof *sim);
    int all = sim != NULL;
    MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, comm);
    if (!all) {
        free(sim);
        return NULL;
    }
    MPI_Comm_rank(comm, &sim->rank);
    MPI_Comm_size(comm, &sim->ranks);
    MPI_Comm_dup(comm, &sim->comm);
    const int vectors = force_vectors();
    MPI_Allreduce(&vectors, &sim->vectors, 1, MPI_INT, MPI_MIN, sim->comm);
    sim->report.imbalance = 1;
    return sim;
}

dem_status dem_new(MPI_Comm comm, const dem_param *param, dem_sim **out)
{
    dem_sim *sim = *out = new_sim(comm);
    if (!sim) return DEM_NO_MEMORY;
    dem_status status = check_param(sim, param);
    if (!status) status = copy_param(sim, param);
    status = agree(sim, status);
    if (!status) status = agree(sim, domain_init(sim));
    if (!status) status = walls_sample_for(sim, param);
    for (size_t k = 0; k < param->n_insertion && !status && !param->restart; k++)
        status = run_insertion(sim, &param->insertion[k]);
    if (!status) status = feeders_init(sim, param);
    if (!status) status = outlets_init(sim, param);
    if (!status && param->restart) status = restart_read(sim, param->restart);
    if (!status) status = check_cohesion(sim);
    if (!status && sim->fixed_step > 0) status = check_fixed_step(sim);
    if (status) return status;
    /* Regions of insertions have done their duty. */
    for (size_t k = 0; k < param->n_insertion; k++)
        if (param->insertion[k].region) dem_sdf_free(param->insertion[k].region);
    sim->progress.call = NULL; /* what it tells may not outlive this call */
    sim->owns_shapes = 1;
    return DEM_OK;
}

void dem_free(dem_sim *sim)
{
    if (!sim) return;
    particles_free(&sim->particles);
    halo_free(&sim->halo);
    domain_free(&sim->domain);
    neighbour_free(&sim->list);
    contacts_free(&sim->contacts);
    walls_free(&sim->walls, sim->owns_shapes);
    feeders_free(&sim->feeders, sim->owns_shapes);
    outlets_free(&sim->outlets, sim->owns_shapes);
    for (size_t k = 0; k < sim->n_kept; k++) free(sim->kept[k].value);
    free(sim->kept);
    free(sim->sdf_cache);
    free(sim->material);
    free(sim->pair);
    free(sim->table);
    free(sim->resistance);
    balance_free(&sim->balance);
    free(sim->smallest_mass);
    free(sim->smallest_radius);
    if (sim->comm != MPI_COMM_NULL) MPI_Comm_free(&sim->comm);
    free(sim);
}

const char *dem_message(const dem_sim *sim)
{
    return sim ? sim->message : "out of memory";
}

/* ---- what there is to see -------------------------------------------------------------------- */

dem_limits dem_time_limits(const dem_sim *sim)
{
    return time_limits(sim);
}

void dem_pair_limits(const dem_sim *sim, int a, int b, double *contact, double *rayleigh)
{
    *contact = *rayleigh = INFINITY;
    if (a < 0 || b < 0 || a >= sim->n_material || b >= sim->n_material) return;
    pair_limits(sim, a, b, contact, rayleigh);
}

dem_report dem_last_report(const dem_sim *sim)
{
    return sim->report;
}

dem_status dem_write_snapshot(dem_sim *sim, const char *directory, const char *name)
{
    dem_view view = dem_particles(sim);
    return snapshot_write(sim->comm, &view, sim->material, sim->time, directory, name, sim->message,
                          sizeof sim->message);
}
