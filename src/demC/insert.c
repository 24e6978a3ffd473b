/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert.c - positions and velocities of the particles that an insertion creates.
 *
 * Random: packing.c, in the region given by its signed distance function; spheres lie wholly within
 * the region and its bounding box. Where the bounding box covers a whole periodic direction, the
 * region is taken to go on through that side: its flat faces there and its box do not bound it, so
 * that a periodic cell fills evenly. Lattice: the points lo + (i + 1/2) spacing within the region.
 * List: the given points.
 *
 * The seed alone decides: its 64 bits are mixed (splitmix64: Steele, Lea & Flood, OOPSLA 2014,
 * doi:10.1145/2660193.2660195) down to the 32 that seed GSL's Mersenne twister, a generator of
 * its own for each insertion, so that one insertion does not change the next.
 */
#include "insert.h"
#include "packing.h"

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
    packing_room room;
    size_t n_old;
    const double (*x_old)[3];
    const double *r_old;
    gsl_rng *rng;
    double (*x)[3];
    size_t n;
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

static dem_status no_memory(job *j)
{
    refuse(j, "out of memory");
    return DEM_NO_MEMORY;
}

/* ---- volume of a region ---------------------------------------------------------------------- */

enum { DEEPEST = 8 }; /* levels of the octree */

/* Volume share of a box, half widths w, on the positive side of the plane phi + g.(x - centre) = 0:
 * the chance that phi + sum g_a w_a t_a > 0 with t_a uniform in (-1, 1), by the closed form of
 * the sum of uniform variables (inclusion and exclusion over the corners). */
static double plane_share(double phi, const double g[3], const double w[3])
{
    double e[3], largest = 0., corner = phi, divisor = 1.;
    int n = 0;
    for (int a = 0; a < 3; a++) largest = fmax(largest, fabs(g[a]) * w[a]);
    for (int a = 0; a < 3; a++) {
        const double width = fabs(g[a]) * w[a];
        if (width <= 1e-4 * largest) continue; /* a plane across this axis: cancellation */
        e[n++] = 2. * width;
        corner += width;
        divisor *= n * 2. * width;
    }
    if (n == 0) return phi > 0. ? 1. : 0.;
    double sum = 0.;
    for (int bits = 0; bits < 1 << n; bits++) {
        double value = corner, sign = 1.;
        for (int a = 0; a < n; a++)
            if (bits >> a & 1) {
                value -= e[a];
                sign = -sign;
            }
        if (value > 0.) sum += sign * pow(value, n);
    }
    return fmin(fmax(sum / divisor, 0.), 1.);
}

static double box_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                         const int skip[3], int level)
{
    double centre[3], w[3], g[3], nearest_g[3] = {1., 0., 0.}, phi = INFINITY;
    for (int a = 0; a < 3; a++) {
        centre[a] = .5 * (lo[a] + hi[a]);
        w[a] = .5 * (hi[a] - lo[a]);
    }
    const double volume = 8. * w[0] * w[1] * w[2];
    for (int part = 0; part < dem_sdf_parts(region); part++) {
        const double value = dem_sdf_eval(region, part, centre, g);
        int open = 0;
        for (int a = 0; a < 3; a++) open |= skip[a] && fabs(g[a]) > 1. - 1e-12;
        if (open || value >= phi) continue;
        phi = value;
        memcpy(nearest_g, g, sizeof g);
    }
    /* phi changes by no more than the distance: such a box is not cut. */
    if (fabs(phi) >= sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])) return phi > 0. ? volume : 0.;
    if (level == DEEPEST) return volume * plane_share(phi, nearest_g, w);
    double sum = 0.;
    for (int octant = 0; octant < 8; octant++) {
        double low[3], high[3];
        for (int a = 0; a < 3; a++) {
            low[a] = octant >> a & 1 ? centre[a] : lo[a];
            high[a] = octant >> a & 1 ? hi[a] : centre[a];
        }
        sum += box_volume(region, low, high, skip, level + 1);
    }
    return sum;
}

double insert_region_volume(const dem_sdf *region, const double lo[3], const double hi[3],
                            const int skip[3])
{
    for (int a = 0; a < 3; a++)
        if (!(hi[a] > lo[a])) return 0.;
    return box_volume(region, lo, hi, skip, 0);
}

/* ---- random ---------------------------------------------------------------------------------- */

static double sphere_volume(double diameter)
{
    return PI / 6. * diameter * diameter * diameter;
}

/* Room of a random insertion: bounding box cut to the domain, sides open where it wraps. */
static dem_status find_room(job *j)
{
    const dem_insertion *ins = j->ins;
    packing_room *room = &j->room;
    for (int a = 0; a < 3; a++) {
        const double length = room->hi[a] - room->lo[a];
        const double slack = 1e-9 * length; /* the same bound written in two files */
        room->low[a] = ins->lo[a];
        room->high[a] = ins->hi[a];
        room->filled[a] = room->periodic[a] && ins->hi[a] - ins->lo[a] >= length - slack;
        if (room->filled[a] || !room->periodic[a]) {
            room->low[a] = room->filled[a] ? room->lo[a] : fmax(ins->lo[a], room->lo[a]);
            room->high[a] = room->filled[a] ? room->hi[a] : fmin(ins->hi[a], room->hi[a]);
        }
        if (room->periodic[a] && length < ins->diameter)
            return refuse(j, "a particle of diameter %g m touches itself across the period %g m",
                          ins->diameter, length);
        if (!(room->high[a] > room->low[a]))
            return refuse(j, "the region lies outside the domain (%c from %g to %g m)", "xyz"[a],
                          ins -> lo[a], ins -> hi[a]);
    }
    return DEM_OK;
}

static dem_status find_number(job *j, double *volume, size_t *n)
{
    const dem_insertion *ins = j->ins;
    *volume = insert_region_volume(ins->region, j->room.low, j->room.high, j->room.filled);
    if (ins->number < 0 && !(ins->solid_fraction >= 0. && ins->solid_fraction < 1.))
        return refuse(j, "solid fraction %g is not in [0, 1)", ins->solid_fraction);
    const double wanted = ins->number >= 0
                              ? (double)ins->number
                              : rint(ins->solid_fraction * *volume / sphere_volume(ins->diameter));
    /* Kepler's bound for any packing, pi/sqrt(18) (Hales, Ann. Math. 162 (2005) 1065). */
    const double fraction = wanted * sphere_volume(ins->diameter) / *volume;
    if (wanted > 0. && !(fraction <= PI / sqrt(18.)))
        return refuse(
            j,
            "%.0f particles of diameter %g m are %.4g of the region's %g m3; no packing of "
            "equal spheres exceeds .7405",
            wanted, ins->diameter, fraction, *volume);
    *n = (size_t)wanted;
    return DEM_OK;
}

/* All n spheres, or as many of them as `placed` says. */
static dem_status pack(job *j, size_t n, int64_t *placed, double *overlap)
{
    const dem_status status = packing_random(&j->room, .5 * j->ins->diameter, n, j->n_old, j->x_old,
                                             j->r_old, j->rng, j->x, placed, overlap);
    if (status == DEM_NO_MEMORY) return no_memory(j);
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

static dem_status place_random(job *j)
{
    double volume, overlap;
    int64_t placed;
    dem_status status = find_room(j);
    if (status == DEM_OK) status = find_number(j, &volume, &j->n);
    if (status != DEM_OK || j->n == 0) return status;
    j->x = malloc(j->n * sizeof *j->x);
    if (j->x == NULL) return no_memory(j);
    status = pack(j, j->n, &placed, &overlap);
    if (status != DEM_OK) return status;
    if (placed < 0)
        return refuse(j, "the region has no room for a particle of diameter %g m",
                      j->ins->diameter);
    return placed < (int64_t)j->n ? refuse_crowd(j, volume, placed, overlap) : DEM_OK;
}

/* ---- lattice and list ------------------------------------------------------------------------ */

/* Points per direction; a last one on the bound itself is not lost to rounding. */
static dem_status count_lattice(job *j, size_t count[3])
{
    const dem_insertion *ins = j->ins;
    double total = 1.;
    for (int a = 0; a < 3; a++) {
        if (!(ins->spacing[a] > 0.))
            return refuse(j, "spacing %g m is not positive", ins->spacing[a]);
        const double n = floor((ins->hi[a] - ins->lo[a]) / ins->spacing[a] + .5 + 1e-9);
        total *= fmax(n, 0.);
        if (!(total < 1e9))
            return refuse(j, "a spacing of (%g %g %g) m makes more than 1e9 particles",
                          ins->spacing[0], ins->spacing[1], ins->spacing[2]);
        count[a] = (size_t)fmax(n, 0.);
    }
    return DEM_OK;
}

static dem_status check_lattice(job *j)
{
    const double radius = .5 * j->ins->diameter;
    for (size_t i = 0; i < j->n; i++)
        for (int a = 0; a < 3; a++)
            if (!j->room.periodic[a] && (j->x[i][a] < j->room.lo[a] || j->x[i][a] > j->room.hi[a]))
                return refuse(j, "lattice point (%g %g %g) m lies outside the domain", j->x[i][0],
                              j->x[i][1], j->x[i][2]);
    size_t first;
    /* A spacing of just one diameter is good, whatever rounding makes of it. */
    const dem_status status =
        packing_first_overlap(&j->room, radius, j->n, (const double(*)[3])j->x, j->n_old, j->x_old,
                              j->r_old, 1e-9, &first);
    if (status == DEM_NO_MEMORY) return no_memory(j);
    if (status != DEM_OK) return refuse(j, "%zu particles are too many for one rank", j->n);
    if (first < j->n)
        return refuse(j,
                      "the particle at lattice point (%g %g %g) m, diameter %g m, overlaps with "
                      "another one: the spacing is too small or the place is taken",
                      j->x[first][0], j->x[first][1], j->x[first][2], j->ins->diameter);
    return DEM_OK;
}

static dem_status place_lattice(job *j)
{
    const dem_insertion *ins = j->ins;
    size_t count[3];
    dem_status status = count_lattice(j, count);
    const size_t total = status == DEM_OK ? count[0] * count[1] * count[2] : 0;
    if (total == 0) return status;
    j->x = malloc(total * sizeof *j->x);
    if (j->x == NULL) return no_memory(j);
    for (size_t p = 0; p < total; p++) {
        const size_t index[3] = {p % count[0], p / count[0] % count[1], p / (count[0] * count[1])};
        double *x = j->x[j->n];
        for (int a = 0; a < 3; a++) x[a] = ins->lo[a] + ((double)index[a] + .5) * ins->spacing[a];
        const double slack = 1e-9 * fmin(fmin(ins->spacing[0], ins->spacing[1]), ins->spacing[2]);
        if (dem_sdf_distance(ins->region, x) >= -slack) j->n++;
    }
    return check_lattice(j);
}

static dem_status place_list(job *j)
{
    if (j->ins->n == 0) return DEM_OK;
    j->x = malloc(j->ins->n * sizeof *j->x);
    if (j->x == NULL) return no_memory(j);
    memcpy(j->x, j->ins->x, j->ins->n * sizeof *j->x);
    j->n = j->ins->n;
    return DEM_OK;
}

/* ---- public ---------------------------------------------------------------------------------- */

static unsigned long mix(uint64_t seed)
{
    uint64_t z = seed + 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return (unsigned long)(z & 0xffffffffu);
}

static void wrap(job *j)
{
    for (int a = 0; a < 3; a++) {
        if (!j->room.periodic[a]) continue;
        const double lo = j->room.lo[a], length = j->room.hi[a] - lo;
        for (size_t i = 0; i < j->n; i++) {
            double *x = &j->x[i][a];
            *x -= length * floor((*x - lo) / length);
            if (*x >= j->room.hi[a]) *x = lo; /* a step below lo rounds to hi */
        }
    }
}

static dem_status run(job *j, double (**v)[3])
{
    const dem_insertion *ins = j->ins;
    dem_status status;
    if (ins->kind != DEM_INSERT_LIST && ins->region == NULL) return refuse(j, "has no region");
    if (!(ins->diameter > 0.)) return refuse(j, "diameter %g m is not positive", ins->diameter);
    switch (ins->kind) {
    case DEM_INSERT_RANDOM:
        status = place_random(j);
        break;
    case DEM_INSERT_LATTICE:
        status = place_lattice(j);
        break;
    case DEM_INSERT_LIST:
        status = place_list(j);
        break;
    default:
        return refuse(j, "unknown kind %d", (int)ins->kind);
    }
    if (status != DEM_OK || j->n == 0) return status;
    wrap(j);
    *v = malloc(j->n * sizeof **v);
    if (*v == NULL) return no_memory(j);
    for (size_t i = 0; i < j->n; i++)
        for (int a = 0; a < 3; a++)
            (*v)[i][a] =
                ins->velocity[a] +
                (ins->velocity_spread > 0. ? gsl_ran_gaussian(j->rng, ins->velocity_spread) : 0.);
    return DEM_OK;
}

dem_status insert_positions(const dem_insertion *ins, const double lo[3], const double hi[3],
                            const int periodic[3], size_t n_old, const double (*x_old)[3],
                            const double *r_old, double (**x)[3], double (**v)[3], size_t *n,
                            char *message, size_t size)
{
    job j = {.ins = ins, .n_old = n_old, .x_old = x_old, .r_old = r_old, .message = message};
    j.size = size;
    j.room.region = ins->region;
    memcpy(j.room.lo, lo, sizeof j.room.lo);
    memcpy(j.room.hi, hi, sizeof j.room.hi);
    memcpy(j.room.periodic, periodic, sizeof j.room.periodic);
    if (size > 0) message[0] = '\0';
    *x = *v = NULL;
    *n = 0;
    j.rng = gsl_rng_alloc(gsl_rng_mt19937);
    if (j.rng == NULL) return no_memory(&j);
    gsl_rng_set(j.rng, mix(ins->seed));
    const dem_status status = run(&j, v);
    gsl_rng_free(j.rng);
    if (status != DEM_OK || j.n == 0) {
        free(j.x);
        free(*v);
        *v = NULL;
        return status;
    }
    *x = j.x;
    *n = j.n;
    return DEM_OK;
}
