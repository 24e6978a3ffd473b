/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert.c - the particles that an insertion creates: positions, velocities, sizes, materials.
 *
 * Random: packing.c, in the region given by its signed distance function; spheres lie wholly within
 * the region and its bounding box. Of several species or of a distribution of sizes (size.c),
 * particles are drawn until their number is reached, or until their own volumes come as near to the
 * solid fraction as one particle allows, and placed from the largest to the smallest. Where the
 * bounding box covers a whole periodic direction, the region is taken to go on through that side:
 * its flat faces there and its box do not bound it, so that a periodic cell fills evenly. Lattice:
 * the points lo + (i + 1/2) spacing within the region (insert_lattice.c). List: the given points.
 *
 * The seed alone decides: its 64 bits are mixed (splitmix64: Steele, Lea & Flood, OOPSLA 2014,
 * doi:10.1145/2660193.2660195) down to the 32 that seed GSL's Mersenne twister, a generator of
 * its own for each insertion, so that one insertion does not change the next.
 *
 * Several ranks: of a lattice or a list each makes a share; a random packing every rank makes as a
 * whole, with the same random numbers, and keeps a share of it.
 */
#include "insert.h"

#include "dem_internal.h"
#include "size.h"

#include <gsl/gsl_randist.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

/* One call's arguments and results. */
typedef struct job {
    const dem_insertion *ins;
    const dem_material *materials;
    size_t n_material;
    packing_room room;
    const insert_place *place;
    old_spheres old;
    int rank, ranks;
    int agreed; /* all ranks know of the failure */
    gsl_rng *rng;
    arrivals *made;
    size_t n; /* of them */
    char *message;
    size_t size;
} job;

__attribute__((format(printf, 2, 3))) static dem_status refuse(job *j, const char *format, ...)
{
    const int used = snprintf(j->message, j->size, "insertion %s: ", j->ins->name);
    va_list arguments;
    va_start(arguments, format);
    if (used >= 0 && (size_t)used < j->size)
        vsnprintf(j->message + used, j->size - (size_t)used, format, arguments);
    va_end(arguments);
    return DEM_BAD_ARGUMENT;
}

static dem_status out_of_memory(job *j)
{
    refuse(j, "out of memory");
    return DEM_NO_MEMORY;
}

/* ---- random ---------------------------------------------------------------------------------- */

static double sphere_volume(double diameter)
{
    return PI / 6. * diameter * diameter * diameter;
}

/* Room for n particles in all; alike ones are filled in. */
static dem_status reserve(job *j, size_t n)
{
    const dem_status status = arrivals_reserve(j->made, n);
    if (status) return out_of_memory(j);
    for (size_t i = 0; i < n && j->ins->n_species == 0; i++) {
        j->made->radius[i] = .5 * j->ins->diameter;
        j->made->material[i] = j->ins->material;
    }
    return DEM_OK;
}

/* The particles that those in the box from low to high have to keep clear of. */
static dem_status gather(job *j, dem_status status, const double low[3], const double high[3],
                         double diameter)
{
    const int well = !status;
    status = old_gather(j->place, status, low, high, diameter, &j->old);
    j->agreed = status != DEM_OK;
    return well && status == DEM_NO_MEMORY ? out_of_memory(j) : status;
}

static dem_status find_room(job *j, double diameter)
{
    char reason[256];
    const packing_room domain = j->room;
    const dem_status status =
        packing_find_room(&j->room, j->ins->region, j->ins->lo, j->ins->hi, domain.lo, domain.hi,
                          domain.periodic, diameter, reason, sizeof reason);
    return gather(j, status ? refuse(j, "%s", reason) : DEM_OK, j->room.low, j->room.high,
                  diameter);
}

static dem_status check_amount(job *j)
{
    const dem_insertion *ins = j->ins;
    if (ins->number < 0 && !(ins->solid_fraction >= 0. && ins->solid_fraction < 1.))
        return refuse(j, "solid fraction %g is not in [0, 1)", ins->solid_fraction);
    return DEM_OK;
}

static dem_status find_number(job *j, double volume, size_t *n)
{
    const dem_insertion *ins = j->ins;
    const double wanted = ins->number >= 0
                              ? (double)ins->number
                              : rint(ins->solid_fraction * volume / sphere_volume(ins->diameter));
    /* Kepler's bound for any packing, pi/sqrt(18) (Hales, Ann. Math. 162 (2005) 1065). */
    const double fraction = wanted * sphere_volume(ins->diameter) / volume;
    if (wanted > 0. && !(fraction <= PI / sqrt(18.)))
        return refuse(
            j,
            "%.0f particles of diameter %g m are %.4g of the region's %g m3; no packing of "
            "equal spheres exceeds .7405",
            wanted, ins->diameter, fraction, volume);
    *n = (size_t)wanted;
    return DEM_OK;
}

/* All n spheres, or as many of them as `placed` says. */
static dem_status pack(job *j, size_t n, int64_t *placed, double *overlap)
{
    const dem_status status =
        packing_random(&j->room, n, j->made->radius, j->old.n, (const double(*)[3])j->old.x,
                       j->old.r, j->rng, j->place->sim, j->made->x, placed, overlap);
    j->agreed = status != DEM_OK;
    if (status == DEM_NO_MEMORY) return out_of_memory(j);
    if (status != DEM_OK) return refuse(j, "%zu particles are too many for one rank", n);
    return DEM_OK;
}

/* Say how many would have found room. The packing that failed holds as many spheres that are
 * smaller by the largest overlap; of the right size, about as many fewer as their volume is
 * larger. That number is tried, so that what is said is what was done. */
static dem_status refuse_crowd(job *j, double volume, int64_t placed, double overlap)
{
    const double share = sphere_volume(j->ins->diameter) / volume;
    const double shrunk = 1. - overlap;
    const size_t fewer = (size_t)((double)j->n * shrunk * shrunk * shrunk);
    int64_t found = 0;
    if (fewer < j->n && pack(j, fewer, &found, &overlap) == DEM_OK && found > placed)
        placed = found;
    return refuse(j,
                  "%zu particles of diameter %g m (solid fraction %.3f of the region's %g m3) do "
                  "not fit: %lld could be placed without overlap (%.3f); random packings end near "
                  ".63 in wide regions, earlier in narrow ones",
                  j->n, j->ins->diameter, (double)j->n * share, volume, (long long)placed,
                  (double)placed * share);
}

static dem_status place_alike(job *j)
{
    double overlap;
    int64_t placed;
    dem_status status = find_room(j, j->ins->diameter);
    if (status == DEM_OK) status = check_amount(j);
    const double volume =
        status ? 0.
               : insert_region_volume(j->ins->region, j->room.low, j->room.high, j->room.filled);
    if (status == DEM_OK) status = find_number(j, volume, &j->n);
    if (status == DEM_OK) status = reserve(j, j->n);
    if (status != DEM_OK || j->n == 0) return status;
    status = pack(j, j->n, &placed, &overlap);
    if (status != DEM_OK) return status;
    if (placed < 0)
        return refuse(j, "the region has no room for a particle of diameter %g m",
                      j->ins->diameter);
    return placed < (int64_t)j->n ? refuse_crowd(j, volume, placed, overlap) : DEM_OK;
}

/* ---- random, of several sizes ---------------------------------------------------------------- */

typedef struct ball {
    double radius;
    int material;
    size_t turn;
} ball;

static int large_first(const void *left, const void *right)
{
    const ball *a = left, *b = right;
    if (a->radius != b->radius) return a->radius > b->radius ? -1 : 1;
    return (a->turn > b->turn) - (a->turn < b->turn);
}

/* Draw particles until their number or the wanted volume is reached. */
static dem_status draw_balls(job *j, mixture *m, double wanted, ball **balls, double *volume)
{
    size_t capacity = 0;
    *volume = 0.;
    for (j->n = 0; j->ins->number < 0 || (int64_t)j->n < j->ins->number; j->n++) {
        if (j->n == capacity) {
            capacity = 2 * capacity + 1024;
            ball *grown = realloc(*balls, capacity * sizeof *grown);
            if (grown == NULL) return out_of_memory(j);
            *balls = grown;
        }
        double diameter;
        ball *b = &(*balls)[j->n];
        mixture_draw(m, j->rng, &diameter, &b->material);
        b->radius = .5 * diameter;
        b->turn = j->n;
        const double v = sphere_volume(diameter);
        if (j->ins->number < 0 && *volume + .5 * v > wanted) break;
        *volume += v;
    }
    return DEM_OK;
}

static dem_status place_balls(job *j, ball *balls, double solid, double volume)
{
    double overlap;
    int64_t placed;
    if (j->n == 0) return DEM_OK;
    qsort(balls, j->n, sizeof *balls, large_first);
    dem_status status = reserve(j, j->n);
    for (size_t i = 0; i < j->n && status == DEM_OK; i++) {
        j->made->radius[i] = balls[i].radius;
        j->made->material[i] = balls[i].material;
    }
    if (status == DEM_OK) status = pack(j, j->n, &placed, &overlap);
    if (status != DEM_OK) return status;
    if (placed < 0)
        return refuse(j, "the region has no room for a particle of diameter %g m",
                      2. * balls[0].radius);
    if (placed < (int64_t)j->n)
        return refuse(j,
                      "%zu particles of diameters %g to %g m (solid fraction %.3f of the region's "
                      "%g m3) do not fit: %lld of them could be placed without overlap",
                      j->n, 2. * balls[j->n - 1].radius, 2. * balls[0].radius, solid / volume,
                      volume, (long long)placed);
    return DEM_OK;
}

/* Drawing as many takes all memory before it fails. */
static dem_status check_volume(job *j, const mixture *m, double volume, double wanted)
{
    const double number = j->ins->number >= 0 ? (double)j->ins->number : wanted / m->volume;
    if (number * m->volume > volume)
        return refuse(j,
                      "%.0f particles of mean volume %g m3 have more volume than the region, %g m3",
                      number, m->volume, volume);
    if (number > 2e9) return refuse(j, "%.3g particles are too many for one rank", number);
    return DEM_OK;
}

static dem_status place_mixture(job *j, mixture *m)
{
    dem_status status = find_room(j, m->largest);
    if (status == DEM_OK) status = check_amount(j);
    if (status != DEM_OK) return status;
    const double volume =
        insert_region_volume(j->ins->region, j->room.low, j->room.high, j->room.filled);
    const double wanted = j->ins->number < 0 ? j->ins->solid_fraction * volume : INFINITY;
    ball *balls = NULL;
    double solid;
    status = check_volume(j, m, volume, wanted);
    mixture_start(m, j->rng);
    if (status == DEM_OK) status = draw_balls(j, m, wanted, &balls, &solid);
    if (status == DEM_OK) status = place_balls(j, balls, solid, volume);
    free(balls);
    return status;
}

static dem_status place_random(job *j)
{
    const dem_insertion *ins = j->ins;
    if (ins->n_species == 0) return place_alike(j);
    mixture m;
    char reason[256];
    const dem_status status = mixture_init(&m, ins->n_species, ins->species, ins->share_by_mass,
                                           j->n_material, j->materials, reason, sizeof reason);
    if (status == DEM_NO_MEMORY) return out_of_memory(j);
    if (status != DEM_OK) return refuse(j, "%s", reason);
    const dem_status placed = place_mixture(j, &m);
    mixture_free(&m);
    return placed;
}

/* ---- lattice and list ------------------------------------------------------------------------ */

static dem_status lay_lattice(job *j, lattice *l)
{
    const dem_insertion *ins = j->ins;
    for (int a = 0; a < 3; a++)
        if (!(ins->spacing[a] > 0.))
            return refuse(j, "spacing %g m is not positive", ins->spacing[a]);
    if (lattice_lay(l, ins))
        return refuse(j, "a spacing of (%g %g %g) m makes more than 1e9 particles", ins->spacing[0],
                      ins->spacing[1], ins->spacing[2]);
    return DEM_OK;
}

static dem_status check_point(job *j, const lattice *l, size_t p, const grid *old)
{
    const double *x = j->made->x[j->n], diameter = j->ins->diameter;
    for (int a = 0; a < 3; a++)
        if (!j->room.periodic[a] && (x[a] < j->room.lo[a] || x[a] > j->room.hi[a]))
            return refuse(j, "lattice point (%g %g %g) m lies outside the domain", x[0], x[1],
                          x[2]);
    if (!lattice_crowded(l, &j->room, p, diameter) &&
        !(j->old.n && packing_overlaps(&j->room, old, x, .5 * diameter, 1e-9)))
        return DEM_OK;
    return refuse(
        j,
        "the particle at lattice point (%g %g %g) m, diameter %g m, overlaps with another "
        "one: the spacing is too small or the place is taken",
        x[0], x[1], x[2], diameter);
}

/* This rank's share of the points. */
static dem_status place_points(job *j, const lattice *l, const grid *old)
{
    const size_t from = slice(l->n, j->rank, j->ranks), to = slice(l->n, j->rank + 1, j->ranks);
    dem_status status = reserve(j, to - from);
    for (size_t p = from; p < to && status == DEM_OK; p++) {
        if (!lattice_point(l, p, j->made->x[j->n])) continue;
        status = check_point(j, l, p, old);
        j->n++;
    }
    return status;
}

static dem_status place_lattice(job *j)
{
    const dem_insertion *ins = j->ins;
    lattice l = {.n = 0};
    grid old = {.smallest = 0};
    dem_status status = lay_lattice(j, &l);
    status = gather(j, status, ins->lo, ins->hi, ins->diameter);
    if (status == DEM_OK)
        status = packing_fixed(&j->room, j->old.n, (const double(*)[3])j->old.x, j->old.r,
                               ins->diameter, &old)
                     ? out_of_memory(j)
                     : DEM_OK;
    if (status == DEM_OK) status = place_points(j, &l, &old);
    grid_free(&old);
    return status;
}

static dem_status place_list(job *j)
{
    const size_t from = slice(j->ins->n, j->rank, j->ranks);
    const size_t to = slice(j->ins->n, j->rank + 1, j->ranks);
    const dem_status status = reserve(j, to - from);
    if (status != DEM_OK || to == from) return status;
    j->n = to - from;
    memcpy(j->made->x, j->ins->x + from, j->n * sizeof *j->made->x);
    return DEM_OK;
}

/* ---- public ---------------------------------------------------------------------------------- */

gsl_rng *insert_generator(uint64_t seed)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    if (rng == NULL) return NULL;
    uint64_t z = seed + 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    gsl_rng_set(rng, (unsigned long)(z & 0xffffffffu));
    return rng;
}

dem_status arrivals_reserve(arrivals *a, size_t n)
{
    if (n <= a->capacity) return DEM_OK;
    const size_t room = n + n / 2;
    double(*x)[3] = realloc(a->x, room * sizeof *x);
    if (x) a->x = x;
    double(*v)[3] = realloc(a->v, room * sizeof *v);
    if (v) a->v = v;
    double(*omega)[3] = realloc(a->omega, room * sizeof *omega);
    if (omega) a->omega = omega;
    double *radius = realloc(a->radius, room * sizeof *radius);
    if (radius) a->radius = radius;
    int *material = realloc(a->material, room * sizeof *material);
    if (material) a->material = material;
    if (!x || !v || !omega || !radius || !material) return DEM_NO_MEMORY;
    a->capacity = room;
    return DEM_OK;
}

void arrivals_free(arrivals *a)
{
    free(a->x);
    free(a->v);
    free(a->omega);
    free(a->radius);
    free(a->material);
    memset(a, 0, sizeof *a);
}

static void wrap(job *j)
{
    for (int a = 0; a < 3; a++) {
        if (!j->room.periodic[a]) continue;
        const double lo = j->room.lo[a], length = j->room.hi[a] - lo;
        for (size_t i = 0; i < j->n; i++) {
            double *x = &j->made->x[i][a];
            *x -= length * floor((*x - lo) / length);
            if (*x >= j->room.hi[a]) *x = lo; /* a step below lo rounds to hi */
        }
    }
}

/* Of what all ranks have made, this one's share. */
static void keep_share(job *j)
{
    const size_t from = slice(j->n, j->rank, j->ranks), to = slice(j->n, j->rank + 1, j->ranks);
    arrivals *m = j->made;
    j->n = to - from;
    if (from == 0 || j->n == 0) return;
    memmove(m->x, m->x + from, j->n * sizeof *m->x);
    memmove(m->radius, m->radius + from, j->n * sizeof *m->radius);
    memmove(m->material, m->material + from, j->n * sizeof *m->material);
}

static dem_status place_all(job *j)
{
    const dem_insertion *ins = j->ins;
    if (ins->kind != DEM_INSERT_LIST && ins->region == NULL) return refuse(j, "has no region");
    if (ins->n_species > 0 && ins->kind != DEM_INSERT_RANDOM)
        return refuse(j, "only a random insertion may have several species or sizes");
    if (ins->n_species == 0 && !(ins->diameter > 0.))
        return refuse(j, "diameter %g m is not positive", ins->diameter);
    switch (ins->kind) {
    case DEM_INSERT_RANDOM: {
        const dem_status status = place_random(j);
        if (status == DEM_OK) keep_share(j);
        return status;
    }
    case DEM_INSERT_LATTICE:
        return place_lattice(j);
    case DEM_INSERT_LIST:
        return place_list(j);
    default:
        return refuse(j, "unknown kind %d", (int)ins->kind);
    }
}

/* The random numbers are one sequence over the particles of all ranks. */
static void set_velocities(job *j, int64_t before)
{
    const dem_insertion *ins = j->ins;
    double unused[3];
    for (int64_t i = 0; i < before && ins->velocity_spread > 0.; i++)
        insert_velocity(j->rng, ins->velocity, ins->velocity_spread, unused);
    for (size_t i = 0; i < j->n; i++) {
        insert_velocity(j->rng, ins->velocity, ins->velocity_spread, j->made->v[i]);
        memcpy(j->made->omega[i], ins->angular_velocity, sizeof *j->made->omega);
    }
}

static dem_status run(job *j)
{
    dem_sim *sim = j->place->sim;
    dem_status status = place_all(j);
    if (sim && !j->agreed) status = agree(sim, status);
    if (status != DEM_OK) return status;
    wrap(j);
    set_velocities(j, sim ? sum_before(sim, (int64_t)j->n) : 0);
    j->made->n = j->n;
    return DEM_OK;
}

void insert_velocity(const gsl_rng *rng, const double mean[3], double spread, double v[3])
{
    for (int a = 0; a < 3; a++) v[a] = mean[a] + (spread > 0. ? gsl_ran_gaussian(rng, spread) : 0.);
}

dem_status insert_particles(const dem_insertion *ins, const insert_place *place, arrivals *made,
                            char *message, size_t size)
{
    job j = {.ins = ins,
             .materials = place->material,
             .n_material = place->n_material,
             .place = place,
             .rank = place->sim ? place->sim->rank : 0,
             .ranks = place->sim ? place->sim->ranks : 1,
             .made = made,
             .message = message,
             .size = size};
    j.room.region = ins->region;
    memcpy(j.room.lo, place->lo, sizeof j.room.lo);
    memcpy(j.room.hi, place->hi, sizeof j.room.hi);
    memcpy(j.room.periodic, place->periodic, sizeof j.room.periodic);
    if (size > 0) message[0] = '\0';
    memset(made, 0, sizeof *made);
    j.rng = insert_generator(ins->seed);
    dem_status status = j.rng ? DEM_OK : out_of_memory(&j);
    if (place->sim) status = agree(place->sim, status);
    if (status == DEM_OK) status = run(&j);
    if (j.rng) gsl_rng_free(j.rng);
    old_free(&j.old);
    if (status != DEM_OK) arrivals_free(made);
    return status;
}
