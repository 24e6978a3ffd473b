/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * population.c - who is there: views of the particles, those that come and go, columns, the outside
 * force.
 *
 * Whatever adds or takes particles ends with take_stock(), which knows the smallest and largest,
 * whether all are alike, and the speed none exceeds: what the loops and the time step go by. All of
 * it is of all ranks, by smallest, largest and counts: no number that depends on how particles are
 * divided among ranks.
 */
#include "check.h"
#include "dem_internal.h"

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

double mass_of_sphere(const dem_sim *sim, double radius, int material)
{
    return 4. / 3 * M_PI * radius * radius * radius * sim->material[material].density;
}

/* The radius that half of the particles do not exceed: to a 64th part of an octave, by counting, so
 * that it costs one look at each and is the same on any number of ranks. Of spheres of one size it
 * is theirs. */
static double find_median(const dem_sim *sim)
{
    enum { SHIFT = 46, BINS = 64 * 32 }; /* of the bits of a double all but 6 of its mantissa */
    const particles *p = &sim->particles;
    if (!(sim->largest_radius > sim->smallest_any)) return sim->largest_radius;
    int64_t count[BINS] = {0}, so_far = 0;
    uint64_t least, bits;
    memcpy(&least, &sim->smallest_any, sizeof least);
    least >>= SHIFT;
    for (size_t i = 0; i < p->n; i++) {
        memcpy(&bits, &p->radius[i], sizeof bits);
        const uint64_t bin = (bits >> SHIFT) - least;
        count[bin < BINS ? bin : BINS - 1]++;
    }
    sum_counts(sim, count, BINS);
    uint64_t bin = 0;
    while (bin < BINS - 1 && 2 * (so_far += count[bin]) < sim->total) bin++;
    bits = (least + bin) << SHIFT | (uint64_t)1 << (SHIFT - 1);
    double median;
    memcpy(&median, &bits, sizeof median);
    return fmin(fmax(median, sim->smallest_any), sim->largest_radius);
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

/* Largest values over all ranks; of what the smallest is asked for, negative. */
typedef struct stock {
    double radius, speed, mass, material;
    double less_radius, less_mass, less_material;
} stock;

static stock look_at_own(dem_sim *sim)
{
    const particles *p = &sim->particles;
    stock s = {0, 0, 0, -1, -INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < p->n; i++) {
        const int m = p->material[i];
        const double r = p->radius[i], mass = p->mass[i], *v = p->vel[i];
        s.radius = fmax(s.radius, r);
        s.less_radius = fmax(s.less_radius, -r);
        s.mass = fmax(s.mass, mass);
        s.less_mass = fmax(s.less_mass, -mass);
        s.material = fmax(s.material, m);
        s.less_material = fmax(s.less_material, -m);
        s.speed = fmax(s.speed, sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
        sim->smallest_radius[m] = fmin(sim->smallest_radius[m], r);
        sim->smallest_mass[m] = fmin(sim->smallest_mass[m], mass);
    }
    max_reals(sim, &s.radius, (int)(sizeof s / sizeof s.radius));
    min_reals(sim, sim->smallest_radius, sim->n_material);
    min_reals(sim, sim->smallest_mass, sim->n_material);
    return s;
}

static double total_mass(const dem_sim *sim)
{
    const particles *p = &sim->particles;
    tally mass = {0, 0};
    for (size_t i = 0; i < p->n; i++) tally_add(&mass, p->mass[i]);
    double sum[2] = {mass.sum, mass.lost};
    sum_reals(sim, sum, 2);
    return sum[0] + sum[1];
}

void take_stock(dem_sim *sim)
{
    for (int a = 0; a < sim->n_material; a++)
        sim->smallest_mass[a] = sim->smallest_radius[a] = INFINITY;
    const stock s = look_at_own(sim);
    sim->total = (int64_t)sim->particles.n;
    sum_counts(sim, &sim->total, 1);
    sim->largest_radius = s.radius;
    sim->smallest_any = sim->total ? -s.less_radius : 0;
    sim->speed = s.speed;
    sim->one_material = s.material == -s.less_material;
    sim->the_material = s.material > 0 ? (int)s.material : 0;
    sim->uniform = sim->one_material && s.radius == -s.less_radius && s.mass == -s.less_mass;
    sim->uniform_mass = s.mass;
    if (sim->total) sim->median_radius = find_median(sim);
    sim->mass = total_mass(sim);
    look_ahead(sim);
}

static int by_id(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* Particles are about to come or go: what refers to rows of the store is saved. */
static dem_status prepare_change(dem_sim *sim)
{
    if (sim->list.valid && contacts_save(&sim->contacts, &sim->list)) return no_memory(sim);
    sim->list.valid = 0;
    return DEM_OK;
}

/* Ghosts give n rows in front of them to particles that come; saved contacts know them yet. */
static dem_status make_way(dem_sim *sim, size_t n)
{
    particles *p = &sim->particles;
    if (!p->n_ghost || !n) return DEM_OK;
    uint32_t *place = malloc((p->n + p->n_ghost) * sizeof *place);
    if (!place) return no_memory(sim);
    for (size_t i = 0; i < p->n + p->n_ghost; i++) place[i] = (uint32_t)(i < p->n ? i : i + n);
    contacts_renumber(&sim->contacts, place);
    particles_push_ghosts(p, n);
    free(place);
    return DEM_OK;
}

dem_status admit_particles(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                           const double (*omega)[3], const double *radius, const int *material,
                           const int64_t *id)
{
    particles *p = &sim->particles;
    dem_status status = DEM_OK;
    balance_changing(sim);
    if (p->n + n > NEIGHBOUR_MASK)
        status = fail(sim, DEM_BAD_ARGUMENT, "%zu particles on one rank, at most %u", p->n + n,
                      (unsigned)NEIGHBOUR_MASK);
    if (!status && particles_reserve(p, p->n + p->n_ghost + n)) status = no_memory(sim);
    status = agree(sim, status);
    if (status) return status;
    status = prepare_change(sim);
    if (!status) status = make_way(sim, n);
    status = agree(sim, status);
    if (status) return status;
    for (size_t i = 0; i < n; i++) {
        particles_append(p, x[i], v ? v[i] : NULL, omega ? omega[i] : NULL, radius[i],
                         mass_of_sphere(sim, radius[i], material[i]), material[i],
                         id ? id[i] : p->next_id);
        balance_supply(sim, p->n - 1, 1);
    }
    max_counts(sim, &p->next_id, 1);
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
        r->removed_impulse[a] += p->impulse[i][a];
    }
    particles_count_removed(p, i);
    balance_supply(sim, i, -1);
}

/* Ghosts whose owners have removed them: after the flags of own particles in `gone`. */
static dem_status flag_ghosts(dem_sim *sim, dem_status status, uint8_t *gone)
{
    const particles *p = &sim->particles;
    if (sim->ranks == 1) return status;
    parcel in = {0};
    size_t n = 0;
    int64_t *id = malloc((p->n + 1) * sizeof *id);
    if (!status && !id) status = no_memory(sim);
    for (size_t i = 0; i < p->n && !status; i++)
        if (gone[i]) id[n++] = p->id[i];
    status = share_blocks(sim, status, n, id, sizeof *id, &in);
    if (!status && in.n) qsort(in.data, in.n, sizeof *id, by_id);
    for (size_t i = p->n; i < p->n + p->n_ghost && !status; i++)
        gone[i] = in.n && bsearch(&p->id[i], in.data, in.n, sizeof *id, by_id) != NULL;
    parcel_free(&in);
    free(id);
    return status;
}

dem_status remove_particles(dem_sim *sim, const uint8_t *gone)
{
    particles *p = &sim->particles;
    const size_t n = p->n, rows = n + p->n_ghost;
    uint32_t *order = malloc((rows + 1) * sizeof *order),
             *place = malloc((rows + 1) * sizeof *place);
    uint8_t *goes = calloc(rows + 1, sizeof *goes);
    dem_status status = order && place && goes ? DEM_OK : no_memory(sim);
    balance_changing(sim);
    if (!status && n) memcpy(goes, gone, n);
    status = flag_ghosts(sim, status, goes);
    if (!status) status = prepare_change(sim);
    size_t kept = 0, k = 0;
    for (size_t i = 0; i < rows && !status; i++) {
        place[i] = goes[i] ? UINT32_MAX : (uint32_t)k;
        if (goes[i] && i < n) book_leaving(sim, i);
        if (!goes[i]) order[k++] = (uint32_t)i;
        kept += i < n && !goes[i];
    }
    if (!status) {
        contacts_renumber(&sim->contacts, place);
        walls_renumber(&sim->walls, place);
        p->n_ghost = k - kept;
        if (k < rows && particles_keep(p, order, kept)) status = no_memory(sim);
    }
    status = agree(sim, status);
    if (!status) take_stock(sim);
    free(order);
    free(place);
    free(goes);
    return status;
}

int dem_attach(dem_sim *sim, const char *name, int width)
{
    particles *p = &sim->particles;
    const int handle = width > 0 ? particles_attach(p, name, width) : -1;
    dem_status status = DEM_OK;
    if (handle < 0)
        status = fail(sim, DEM_NO_MEMORY,
                      "column %s of width %d: out of memory, or it has another width in the "
                      "restart file",
                      name, width);
    if (!agree(sim, status)) return handle;
    if (handle >= 0) particles_detach(p, handle); /* that of another rank failed */
    return -1;
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
    int64_t outside = sim->outside; /* a rank without particles may have nothing to hand over */
    max_counts(sim, &outside, 1);
    const int given = sim->outside;
    sim->outside = outside != 0;
    dem_status status = DEM_OK;
    if (outside && particles_open_outside(p)) status = no_memory(sim);
    if (outside && !given && !status && p->n) memset(p->outside, 0, p->n * sizeof *p->outside);
    for (size_t i = 0; i < p->n && given && !status; i++) {
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
            status = fail(sim, sum != 0 ? DEM_NAN : DEM_BAD_ARGUMENT,
                          "outside force on particle %lld: f (%g %g %g) and w (%g %g %g) must be "
                          "finite, k %g and M %g also >= 0",
                          (long long)p->id[i], o[0], o[1], o[2], o[4], o[5], o[6], o[3], o[7]);
    }
    return agree(sim, status);
}
