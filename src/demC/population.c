/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * population.c - who is there: views of the particles, adding and removing them, columns, the
 * outside force.
 *
 * Whatever adds or takes particles ends with take_stock(), which knows the smallest and largest,
 * whether all are alike, and the speed none exceeds: what the loops and the time step go by.
 */
#include "check.h"
#include "dem_internal.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

dem_view dem_particles(const dem_sim *sim)
{
    const particles *p = &sim->particles;
    return (dem_view){p->revision,
                      p->n,
                      p->id,
                      (const double(*)[3])p->x,
                      (const double(*)[3])p->v,
                      (const double(*)[3])p->omega,
                      p->radius,
                      p->mass,
                      p->material,
                      (const double(*)[3])p->last,
                      (const double(*)[3])p->impulse};
}

static int by_id(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* Ids, the present ones and the new, must differ. */
static dem_status check_ids(dem_sim *sim, size_t n, const int64_t *id)
{
    const particles *p = &sim->particles;
    int64_t *all = malloc((p->n + n + 1) * sizeof *all), twice = 0;
    if (!all) return no_memory(sim);
    if (p->n) memcpy(all, p->id, p->n * sizeof *all);
    memcpy(all + p->n, id, n * sizeof *all);
    qsort(all, p->n + n, sizeof *all, by_id);
    size_t k = 1;
    while (k < p->n + n && all[k] != all[k - 1]) k++;
    int unique = k >= p->n + n;
    if (!unique) twice = all[k];
    free(all);
    return unique
               ? DEM_OK
               : fail(sim, DEM_BAD_ARGUMENT, "particle id %lld is given twice", (long long)twice);
}

double mass_of_sphere(const dem_sim *sim, double radius, int material)
{
    return 4. / 3 * M_PI * radius * radius * radius * sim->material[material].density;
}

/* The radius that half of the particles, present and new, do not exceed. */
static dem_status median_of(dem_sim *sim, size_t n, const double *radius, double *median)
{
    const particles *p = &sim->particles;
    double *all = malloc((p->n + n) * sizeof *all);
    if (!all) return no_memory(sim);
    if (p->n) memcpy(all, p->radius, p->n * sizeof *all);
    if (n) memcpy(all + p->n, radius, n * sizeof *all);
    *median = gsl_stats_median(all, 1, p->n + n);
    free(all);
    return DEM_OK;
}

/* Particles that feeders have yet to bring: they set the time step from the beginning. */
static void look_ahead(dem_sim *sim)
{
    sim->coming_radius = sim->coming_speed = 0;
    for (const feeder *f = sim->feeders.feeder; f < sim->feeders.feeder + sim->feeders.n; f++) {
        if (!feeder_goes_on(sim, f)) continue;
        const double *v = f->given.velocity;
        const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        sim->coming_radius = fmax(sim->coming_radius, .5 * f->mixture.largest);
        sim->coming_speed = fmax(sim->coming_speed, speed + 3 * f->given.velocity_spread);
        for (size_t k = 0; k < f->mixture.n; k++) {
            const int m = f->mixture.material[k];
            const double r = .5 * f->mixture.size[k].lo;
            sim->smallest_radius[m] = fmin(sim->smallest_radius[m], r);
            sim->smallest_mass[m] = fmin(sim->smallest_mass[m], mass_of_sphere(sim, r, m));
        }
    }
}

void take_stock(dem_sim *sim)
{
    const particles *p = &sim->particles;
    tally mass = {0, 0};
    sim->largest_radius = sim->speed = 0;
    sim->smallest_any = p->n ? p->radius[0] : 0;
    sim->uniform = 1;
    for (int a = 0; a < sim->n_material; a++)
        sim->smallest_mass[a] = sim->smallest_radius[a] = INFINITY;
    for (size_t i = 0; i < p->n; i++) {
        int m = p->material[i];
        double r = p->radius[i];
        const double *v = p->vel[i];
        sim->largest_radius = fmax(sim->largest_radius, r);
        sim->smallest_any = fmin(sim->smallest_any, r);
        sim->smallest_radius[m] = fmin(sim->smallest_radius[m], r);
        sim->smallest_mass[m] = fmin(sim->smallest_mass[m], p->mass[i]);
        sim->uniform &= m == p->material[0] && r == p->radius[0] && p->mass[i] == p->mass[0];
        sim->speed = fmax(sim->speed, sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
        tally_add(&mass, p->mass[i]);
    }
    sim->mass = tally_total(&mass);
    look_ahead(sim);
}

/* Particles are about to come or go: what refers to rows of the store is saved. */
static dem_status prepare_change(dem_sim *sim)
{
    balance_changing(sim);
    if (sim->list.valid && contacts_save(&sim->contacts, &sim->list)) return no_memory(sim);
    sim->list.valid = 0;
    return DEM_OK;
}

dem_status admit_particles(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                           const double (*omega)[3], const double *radius, const int *material,
                           const int64_t *id)
{
    particles *p = &sim->particles;
    if (p->n + n > NEIGHBOUR_MASK)
        return fail(sim, DEM_BAD_ARGUMENT, "%zu particles on one rank, at most %u", p->n + n,
                    (unsigned)NEIGHBOUR_MASK);
    double median = 0;
    dem_status status = median_of(sim, n, radius, &median);
    if (!status && particles_reserve(p, p->n + n)) status = no_memory(sim);
    if (!status) status = prepare_change(sim);
    if (status) return status;
    for (size_t i = 0; i < n; i++) {
        particles_append(p, x[i], v ? v[i] : NULL, omega ? omega[i] : NULL, radius[i],
                         mass_of_sphere(sim, radius[i], material[i]), material[i],
                         id ? id[i] : p->next_id);
        balance_supply(sim, p->n - 1, 1);
    }
    sim->median_radius = median;
    take_stock(sim);
    return DEM_OK;
}

/* What leaves with the particle in row i. */
static void book_leaving(dem_sim *sim, size_t i)
{
    particles *p = &sim->particles;
    dem_report *r = &sim->report;
    r->removed++;
    r->removed_mass += p->mass[i];
    for (int a = 0; a < 3; a++) {
        r->removed_momentum[a] += p->mass[i] * p->vel[i][a];
        r->removed_impulse[a] += p->gain[i][a];
    }
    particles_count_removed(p, i);
    balance_supply(sim, i, -1);
}

dem_status remove_particles(dem_sim *sim, const uint8_t *gone)
{
    particles *p = &sim->particles;
    uint32_t *order = malloc((p->n + 1) * sizeof *order),
             *place = malloc((p->n + 1) * sizeof *place);
    dem_status status = order && place ? prepare_change(sim) : no_memory(sim);
    size_t kept = 0;
    for (size_t i = 0; i < p->n && !status; i++) {
        place[i] = gone[i] ? UINT32_MAX : (uint32_t)kept;
        if (gone[i])
            book_leaving(sim, i);
        else
            order[kept++] = (uint32_t)i;
    }
    if (!status) {
        contacts_renumber(&sim->contacts, place);
        walls_renumber(&sim->walls, place);
        if (particles_keep(p, order, kept)) status = no_memory(sim);
    }
    if (!status && kept) status = median_of(sim, 0, NULL, &sim->median_radius);
    take_stock(sim);
    free(order);
    free(place);
    return status;
}

dem_status dem_add(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                   const double (*omega)[3], const double *radius, const int *material,
                   const int64_t *id)
{
    if (!n) return DEM_OK;
    double largest = sim->largest_radius, overlap = 0;
    double smallest = sim->particles.n ? sim->smallest_any : INFINITY;
    for (size_t i = 0; i < n; i++) {
        dem_status status = check_particle(sim, i, x[i], v ? v[i] : NULL, omega ? omega[i] : NULL,
                                           radius[i], material[i]);
        if (status) return status;
        largest = fmax(largest, radius[i]);
        smallest = fmin(smallest, radius[i]);
    }
    dem_status status = check_range(sim, largest);
    if (!status && id) status = check_ids(sim, n, id);
    if (!status) status = walls_sample(sim, 2 * smallest, 2 * largest);
    if (!status) status = check_overlaps(sim, n, x, radius, &overlap);
    if (!status) status = admit_particles(sim, n, x, v, omega, radius, material, id);
    if (status) return status;
    sim->overlap = overlap;
    particles_publish(&sim->particles, sim->lo, sim->hi, sim->periodic);
    return DEM_OK;
}

int dem_attach(dem_sim *sim, const char *name, int width)
{
    return width > 0 ? particles_attach(&sim->particles, name, width) : -1;
}

double *dem_column(dem_sim *sim, int handle)
{
    return particles_column(&sim->particles, handle);
}

int dem_column_restored(const dem_sim *sim, int handle)
{
    const particles *p = &sim->particles;
    const size_t f = p->n_fixed + (size_t)handle;
    return handle >= 0 && f < p->n_field && p->field[f].restored != 0;
}

void dem_removed_column(const dem_sim *sim, int handle, double *sum)
{
    const particles *p = &sim->particles;
    const size_t f = p->n_fixed + (size_t)handle;
    if (handle >= 0 && f < p->n_field) memcpy(sum, p->field[f].removed, p->field[f].size);
}

dem_status dem_set_outside_force(dem_sim *sim, const double (*f)[3], const double *k,
                                 const double (*w)[3], const double *M)
{
    particles *p = &sim->particles;
    sim->outside = f && k && w;
    for (size_t i = 0; i < p->n && sim->outside; i++) {
        double *o = p->outside[i];
        for (int a = 0; a < 3; a++) {
            o[a] = f[i][a];
            o[4 + a] = w[i][a];
        }
        o[3] = k[i];
        o[7] = M ? M[i] : 0;
        double sum = 0;
        for (int a = 0; a < 8; a++) sum += o[a] * 0;
        if (sum != 0 || o[3] < 0 || o[7] < 0)
            return fail(sim, sum != 0 ? DEM_NAN : DEM_BAD_ARGUMENT,
                        "outside force on particle %lld: f (%g %g %g) and w (%g %g %g) must be "
                        "finite, k %g and M %g also >= 0",
                        (long long)p->id[i], o[0], o[1], o[2], o[4], o[5], o[6], o[3], o[7]);
    }
    return DEM_OK;
}
