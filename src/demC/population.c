/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * population.c - who is there: views of the particles, adding them, columns, the outside force.
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

/* The radius that half of the particles, present and new, do not exceed. */
static dem_status median_of(dem_sim *sim, size_t n, const double *radius, double *median)
{
    const particles *p = &sim->particles;
    double *all = malloc((p->n + n) * sizeof *all);
    if (!all) return no_memory(sim);
    if (p->n) memcpy(all, p->radius, p->n * sizeof *all);
    memcpy(all + p->n, radius, n * sizeof *all);
    *median = gsl_stats_median(all, 1, p->n + n);
    free(all);
    return DEM_OK;
}

void take_stock(dem_sim *sim)
{
    const particles *p = &sim->particles;
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
    }
}

dem_status dem_add(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                   const double (*omega)[3], const double *radius, const int *material,
                   const int64_t *id)
{
    particles *p = &sim->particles;
    if (!n) return DEM_OK;
    double largest = sim->largest_radius;
    double smallest = p->n ? sim->smallest_any : INFINITY;
    for (size_t i = 0; i < n; i++) {
        dem_status status = check_particle(sim, i, x[i], v ? v[i] : NULL, omega ? omega[i] : NULL,
                                           radius[i], material[i]);
        if (status) return status;
        largest = fmax(largest, radius[i]);
        smallest = fmin(smallest, radius[i]);
    }
    if (p->n + n > NEIGHBOUR_MASK)
        return fail(sim, DEM_BAD_ARGUMENT, "%zu particles on one rank, at most %u", p->n + n,
                    (unsigned)NEIGHBOUR_MASK);
    dem_status status = check_range(sim, largest);
    if (!status && id) status = check_ids(sim, n, id);
    if (!status) status = walls_sample(sim, 2 * smallest, 2 * largest);
    double overlap = 0;
    if (!status) status = check_overlaps(sim, n, x, radius, &overlap);
    double median = 0;
    if (!status) status = median_of(sim, n, radius, &median);
    if (status) return status;
    if (particles_reserve(p, p->n + n)) return no_memory(sim);
    /* Histories refer to places in the list as it is. */
    if (sim->list.valid && contacts_save(&sim->contacts, &sim->list, p->n)) return no_memory(sim);
    for (size_t i = 0; i < n; i++) {
        double r = radius[i], density = sim->material[material[i]].density;
        particles_append(p, x[i], v ? v[i] : NULL, omega ? omega[i] : NULL, r,
                         4. / 3 * M_PI * r * r * r * density, material[i], id ? id[i] : p->next_id);
    }
    sim->list.valid = 0;
    sim->overlap = overlap;
    sim->median_radius = median;
    take_stock(sim);
    particles_publish(p, sim->lo, sim->hi, sim->periodic);
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
