/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * feed.c - particles that enter during the run at a given rate.
 *
 * A feeder has moments of its own, begin + k interval and at last its end, so that what enters, and
 * where, does not depend on how the caller divides time; it feeds at the start of the first step
 * that does not begin before a moment. What is due then is rate * (moment - begin), by mass or by
 * number. Particles are drawn one after the other (size.c); the next one enters when with it no
 * more than what is due has come. So the sum keeps to the rate within one particle's mass, for any
 * length of time.
 *
 * The interval is the larger of
 *
 *     1/(number per s)       one particle at a time, and
 *     t_clear/8              of the time in which particles leave the region's box, by their
 * velocity and gravity
 *
 * often enough for an even stream, and seldom enough that the lists are not rebuilt more often than
 * the motion asks for anyway.
 *
 * A particle enters where a uniformly drawn centre is at least its radius away from the bounds of
 * the region and from every wall and touches no other particle. If ATTEMPTS draws find no place the
 * region is full: the particle stays the next one, and it and what else is due waits for the next
 * moment. Only particles near the region are looked at.
 *
 * On several ranks each has all feeders with the same random numbers. They show each other their
 * particles near the region, so that all see the same crowd, draw the same places and book the same
 * arrivals: number, mass and momentum fed are sums over all ranks on every one of them. A particle
 * that enters is admitted by the rank that owns its place; its id is the same on any number of
 * ranks.
 */
#include "feed.h"

#include "check.h"
#include "dem_internal.h"
#include "insert.h"
#include "periodic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* At a solid fraction of .3 one draw in a few hundred finds a place for a sphere of equal size
 * (packing.c); no feed gets denser. */
enum { ATTEMPTS = 400 };
/* Draws for a centre in the region: less than 1e-4 of its box is no region to feed through. */
enum { DRAWS = 100000 };
static const double PARTS = 8;    /* moments while a particle crosses the region */
static const double EARLY = 1e-3; /* of a step: rounding of times must not cost one */
static const double WHOLE = 1e-9; /* of a particle: rounding of rate * time neither */

/* ---- setting up ------------------------------------------------------------------------------ */

static double rate_of(const feeder *f)
{
    return f->given.mass_rate > 0 ? f->given.mass_rate : f->given.number_rate;
}

static dem_status check_feeder(dem_sim *sim, const dem_feeder *g)
{
    if (!g->region) return fail(sim, DEM_BAD_ARGUMENT, "feeder %s has no region", g->name);
    if (!(g->mass_rate >= 0) || !(g->number_rate >= 0) || !isfinite(g->mass_rate) ||
        !isfinite(g->number_rate) || (g->mass_rate > 0) == (g->number_rate > 0))
        return fail(sim, DEM_BAD_ARGUMENT,
                    "feeder %s: mass rate %g kg/s and number rate %g 1/s: one must be > 0, the "
                    "other 0",
                    g->name, g->mass_rate, g->number_rate);
    if (!isfinite(g->begin) || !(g->begin < g->end))
        return fail(sim, DEM_BAD_ARGUMENT, "feeder %s: begins at %g s, ends at %g s", g->name,
                    g->begin, g->end);
    if (!(g->mass > 0))
        return fail(sim, DEM_BAD_ARGUMENT, "feeder %s: mass in all %g kg must be > 0", g->name,
                    g->mass);
    if (g->number == 0 || g->number < -1)
        return fail(sim, DEM_BAD_ARGUMENT,
                    "feeder %s: number in all %lld must be > 0, or -1 for no limit", g->name,
                    (long long)g->number);
    for (int a = 0; a < 3; a++)
        if (!isfinite(g->velocity[a]) || !isfinite(g->angular_velocity[a]))
            return fail(sim, DEM_BAD_ARGUMENT, "feeder %s: velocity must be finite", g->name);
    if (!(g->velocity_spread >= 0) || !isfinite(g->velocity_spread))
        return fail(sim, DEM_BAD_ARGUMENT, "feeder %s: velocity spread %g m/s must be >= 0",
                    g->name, g->velocity_spread);
    return DEM_OK;
}

/* Time in which a particle that starts at the speed s >= 0 under the pull a passes the length, s.
 */
static double passing_time(double s, double a, double length)
{
    const double turn = s * s + 2 * a * length;
    if (turn >= 0) return 2 * length / (s + sqrt(turn));
    /* It comes back, and leaves by where it came from. */
    return (s + sqrt(s * s - 2 * a * length)) / -a;
}

/* Time in which a particle that enters leaves the box of the region, s. */
static double crossing_time(const dem_sim *sim, const feeder *f)
{
    double least = INFINITY;
    for (int a = 0; a < 3; a++) {
        const double v = f->given.velocity[a], g = sim->gravity[a];
        const double speed = fabs(v) + f->given.velocity_spread;
        const double pull = v * g < 0 ? -fabs(g) : fabs(g);
        if (speed > 0 || pull != 0)
            least = fmin(least, passing_time(speed, pull, f->room.high[a] - f->room.low[a]));
    }
    return least;
}

static void draw_next(feeder *f)
{
    mixture_draw(&f->mixture, f->rng, &f->diameter, &f->material);
}

/* Room, mixture and generator; the region has place for the largest particle. */
static dem_status prepare(dem_sim *sim, feeder *f)
{
    const dem_feeder *g = &f->given;
    char reason[256];
    dem_status status = mixture_init(&f->mixture, g->n_species, g->species, g->share_by_mass,
                                     (size_t)sim->n_material, sim->material, reason, sizeof reason);
    if (!status)
        status = packing_find_room(&f->room, g->region, g->lo, g->hi, sim->lo, sim->hi,
                                   sim->periodic, f->mixture.largest, reason, sizeof reason);
    if (status) return fail(sim, status, "feeder %s: %s", g->name, reason);
    f->given.species = NULL; /* of the caller; the mixture has what it needs */
    f->rng = insert_generator(g->seed);
    if (!f->rng) return no_memory(sim);
    gsl_rng *trial = gsl_rng_clone(f->rng);
    double x[3];
    if (!trial) return no_memory(sim);
    const int found = packing_draw(&f->room, .5 * f->mixture.largest, DRAWS, trial, x);
    gsl_rng_free(trial);
    if (!found)
        return fail(sim, DEM_BAD_ARGUMENT,
                    "feeder %s: the region has no room for its largest particle, diameter %g m",
                    g->name, f->mixture.largest);
    status = check_range(sim, .5 * f->mixture.largest);
    if (status) return status;
    mixture_start(&f->mixture, f->rng);
    draw_next(f);
    const double every = (g->mass_rate > 0 ? f->mixture.mass : 1) / rate_of(f);
    const double clear = crossing_time(sim, f) / PARTS;
    f->interval = isfinite(clear) ? fmax(every, clear) : every;
    return DEM_OK;
}

dem_status feeders_init(dem_sim *sim, const dem_param *param)
{
    feeders *all = &sim->feeders;
    if (!param->n_feeder) return DEM_OK;
    all->feeder = calloc(param->n_feeder, sizeof *all->feeder);
    dem_status status = all->feeder ? DEM_OK : no_memory(sim);
    for (size_t k = 0; k < param->n_feeder && !status; k++) {
        feeder *f = &all->feeder[all->n++];
        f->given = param->feeder[k];
        status = check_feeder(sim, &f->given);
        if (!status) status = prepare(sim, f);
        f->origin = fmax(f->given.begin, sim->time);
    }
    status = agree(sim, status);
    if (!status) take_stock(sim);
    return status;
}

void feeders_free(feeders *f, int free_regions)
{
    for (size_t k = 0; k < f->n; k++) {
        feeder *one = &f->feeder[k];
        if (free_regions) dem_sdf_free(one->given.region);
        mixture_free(&one->mixture);
        if (one->rng) gsl_rng_free(one->rng);
    }
    free(f->feeder);
    memset(f, 0, sizeof *f);
}

/* ---- what is due ----------------------------------------------------------------------------- */

double feeder_due(const feeder *f)
{
    const double moment = fmin(f->origin + f->moment * f->interval, f->given.end);
    return f->before + rate_of(f) * fmax(0, moment - f->origin);
}

/* The next particle is within what the feeder gives in all. If it is not, the feed is over: a
 * smaller one does not jump ahead. */
static int next_is_allowed(const dem_sim *sim, const feeder *f)
{
    const double mass = mass_of_sphere(sim, .5 * f->diameter, f->material);
    if (f->given.number >= 0 && f->number >= f->given.number) return 0;
    return tally_total(&f->mass) + mass <= f->given.mass + WHOLE * mass;
}

static int next_is_due(const dem_sim *sim, const feeder *f)
{
    const double mass = mass_of_sphere(sim, .5 * f->diameter, f->material);
    if (!next_is_allowed(sim, f)) return 0;
    if (f->given.mass_rate > 0) return tally_total(&f->mass) + mass <= feeder_due(f) + WHOLE * mass;
    return (double)f->number + 1 <= feeder_due(f) + WHOLE;
}

/* kg that are due and have not come. */
static double debt(const feeder *f)
{
    if (f->given.mass_rate > 0)
        return fmax(0, fmin(feeder_due(f), f->given.mass) - tally_total(&f->mass));
    double due = floor(feeder_due(f) + WHOLE);
    if (f->given.number >= 0) due = fmin(due, (double)f->given.number);
    return fmax(0, due - (double)f->number) * f->mixture.mass;
}

int feeder_goes_on(const dem_sim *sim, const feeder *f)
{
    return f->origin + f->moment * f->interval < f->given.end && next_is_allowed(sim, f);
}

void feeders_set_time(dem_sim *sim, double time)
{
    for (feeder *f = sim->feeders.feeder; f < sim->feeders.feeder + sim->feeders.n; f++) {
        f->before = feeder_due(f);
        f->origin = fmax(f->given.begin, time);
        f->moment = 0;
    }
}

/* Whether a moment has come since the last time: the latest one counts. */
static int moment_comes(feeder *f, double time, double dt)
{
    const double now = time + EARLY * dt;
    if (now < f->origin) return 0;
    const double past = floor((fmin(now, f->given.end) - f->origin) / f->interval);
    /* The end is a moment too: the one behind the last. */
    const double moment = now >= f->given.end ? past + 1 : past;
    if (moment <= f->moment) return 0;
    f->moment = moment;
    return 1;
}

/* ---- where there is place -------------------------------------------------------------------- */

/* The spheres near the region, and those that enter. */
typedef struct crowd {
    grid grid;
    size_t n, capacity;
    double (*x)[3];
    double *r;
} crowd;

static void crowd_free(crowd *c)
{
    grid_free(&c->grid);
    free(c->x);
    free(c->r);
}

static dem_status crowd_append(crowd *c, const double x[3], double r)
{
    if (c->n == c->capacity) {
        c->capacity = 2 * c->capacity + 256;
        double(*more_x)[3] = realloc(c->x, c->capacity * sizeof *more_x);
        if (more_x) c->x = more_x;
        double *more_r = realloc(c->r, c->capacity * sizeof *more_r);
        if (more_r) c->r = more_r;
        if (!more_x || !more_r) return DEM_NO_MEMORY;
    }
    memcpy(c->x[c->n], x, sizeof *c->x);
    c->r[c->n++] = r;
    return DEM_OK;
}

typedef struct gathering {
    const dem_sim *sim;
    const feeder *feeder;
    crowd *crowd;
} gathering;

/* Take the particle i, at its image nearest to the region, if it can touch one in there. */
static int gather_near(void *context, uint32_t i)
{
    const gathering *g = context;
    const packing_room *room = &g->feeder->room;
    const double *pos = g->sim->particles.pos[i];
    const double reach = pos[3] + .5 * g->feeder->mixture.largest;
    double x[3];
    for (int a = 0; a < 3; a++) {
        const double length = room->hi[a] - room->lo[a];
        const double middle = .5 * (room->low[a] + room->high[a]);
        x[a] = pos[a];
        if (room->periodic[a]) x[a] -= length * rint((x[a] - middle) / length);
        /* Where region and reach go round the whole period every particle is near. */
        const int round = room->periodic[a] && room->high[a] - room->low[a] + 2 * reach >= length;
        if (!round && (x[a] < room->low[a] - reach || x[a] > room->high[a] + reach)) return 0;
    }
    return crowd_append(g->crowd, x, pos[3]);
}

/* A grid over the region; over the whole period where particles meet round it. */
static dem_status lay_grid(const dem_sim *sim, const feeder *f, crowd *c)
{
    const packing_room *room = &f->room;
    double lo[3], hi[3], small = .5 * f->mixture.smallest, large = .5 * f->mixture.largest;
    int periodic[3];
    for (size_t i = 0; i < c->n; i++) {
        small = fmin(small, c->r[i]);
        large = fmax(large, c->r[i]);
    }
    for (int a = 0; a < 3; a++) {
        periodic[a] = sim->periodic[a] &&
                      room->high[a] - room->low[a] + 4 * large >= room->hi[a] - room->lo[a];
        lo[a] = periodic[a] ? room->lo[a] : room->low[a];
        hi[a] = periodic[a] ? room->hi[a] : room->high[a];
    }
    return grid_init(&c->grid, lo, hi, periodic, small, large, c->n, 0);
}

/* All that any rank has near the region. */
static dem_status show_each_other(dem_sim *sim, dem_status status, crowd *c)
{
    if (sim->ranks == 1) return status;
    parcel all;
    double(*own)[4] = malloc((c->n + 1) * sizeof *own);
    if (!status && !own) status = no_memory(sim);
    for (size_t i = 0; i < c->n && !status; i++) {
        memcpy(own[i], c->x[i], sizeof *c->x);
        own[i][3] = c->r[i];
    }
    status = share_blocks(sim, status, c->n, own, sizeof *own, &all);
    const double(*sphere)[4] = all.data;
    c->n = 0;
    for (size_t i = 0; i < all.n && !status; i++)
        if (crowd_append(c, sphere[i], sphere[i][3])) status = no_memory(sim);
    parcel_free(&all);
    free(own);
    return status;
}

static dem_status gather(dem_sim *sim, const feeder *f, crowd *c)
{
    gathering g = {sim, f, c};
    const double reach = .5 * f->mixture.largest + sim->largest_radius;
    double low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = f->room.low[a] - reach;
        high[a] = f->room.high[a] + reach;
    }
    int bad = neighbour_near(&sim->list, &sim->particles, low, high, gather_near, &g);
    dem_status status = show_each_other(sim, bad ? no_memory(sim) : DEM_OK, c);
    if (status) return status;
    bad = lay_grid(sim, f, c) || grid_reserve(&c->grid, c->n, (const double(*)[3])c->x, c->r);
    for (size_t i = 0; i < c->n && !bad; i++) grid_enter(&c->grid, i);
    return bad ? no_memory(sim) : DEM_OK;
}

static int clear_of_walls(const dem_sim *sim, const double x[3], double radius)
{
    const double pos[1][4] = {{x[0], x[1], x[2], radius}};
    return walls_overlap(&sim->walls, 1, pos) <= 0;
}

static int find_place(const dem_sim *sim, const feeder *f, const crowd *c, double x[3])
{
    const double radius = .5 * f->diameter;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        if (!packing_draw(&f->room, radius, DRAWS, f->rng, x)) return 0;
        if (packing_overlaps(&f->room, &c->grid, x, radius, packing_apart)) continue;
        if (clear_of_walls(sim, x, radius)) return 1;
    }
    return 0;
}

/* ---- feeding --------------------------------------------------------------------------------- */

/* Book the next particle as one that enters at x, and draw the one after it. */
static dem_status enter(dem_sim *sim, feeder *f, crowd *c, const double x[3], arrivals *in)
{
    dem_report *r = &sim->report;
    const double mass = mass_of_sphere(sim, .5 * f->diameter, f->material);
    if (arrivals_reserve(in, in->n + 1) || crowd_append(c, x, .5 * f->diameter) ||
        grid_reserve(&c->grid, c->n, (const double(*)[3])c->x, c->r))
        return no_memory(sim);
    grid_enter(&c->grid, c->n - 1);
    const size_t i = in->n++;
    memcpy(in->x[i], x, sizeof *in->x);
    wrap_into(in->x[i], sim->lo, sim->hi, sim->periodic);
    insert_velocity(f->rng, f->given.velocity, f->given.velocity_spread, in->v[i]);
    memcpy(in->omega[i], f->given.angular_velocity, sizeof *in->omega);
    in->radius[i] = .5 * f->diameter;
    in->material[i] = f->material;
    f->number++;
    tally_add(&f->mass, mass);
    r->fed++;
    r->fed_mass += mass;
    for (int a = 0; a < 3; a++) r->fed_momentum[a] += mass * in->v[i][a];
    draw_next(f);
    return DEM_OK;
}

/* Space that has not been divided yet is divided by those who come first. */
static dem_status divide(dem_sim *sim, const arrivals *in)
{
    if (sim->ranks == 1 || sim->domain.divided) return DEM_OK;
    const size_t from = slice(in->n, sim->rank, sim->ranks);
    const size_t to = slice(in->n, sim->rank + 1, sim->ranks);
    double(*pos)[4] = calloc(to - from + 1, sizeof *pos);
    dem_status status = agree(sim, pos ? DEM_OK : no_memory(sim));
    for (size_t i = from; i < to && !status; i++) memcpy(pos[i - from], in->x[i], sizeof *in->x);
    if (!status) status = domain_divide(sim, to - from, (const double(*)[4])pos, NULL);
    free(pos);
    return status;
}

/* Every rank admits those whose places it owns. */
static dem_status admit(dem_sim *sim, arrivals *in)
{
    dem_status status = divide(sim, in);
    int64_t *id = malloc(in->n * sizeof *id);
    status = agree(sim, status || id ? status : no_memory(sim));
    size_t mine = 0;
    for (size_t i = 0; i < in->n && !status; i++) {
        if (sim->ranks > 1 && domain_owner(sim, in->x[i]) != sim->rank) continue;
        memmove(in->x[mine], in->x[i], sizeof *in->x);
        memmove(in->v[mine], in->v[i], sizeof *in->v);
        memmove(in->omega[mine], in->omega[i], sizeof *in->omega);
        in->radius[mine] = in->radius[i];
        in->material[mine] = in->material[i];
        id[mine++] = sim->particles.next_id + (int64_t)i;
    }
    if (!status)
        status = admit_particles(sim, mine, (const double(*)[3])in->x, (const double(*)[3])in->v,
                                 (const double(*)[3])in->omega, in->radius, in->material, id);
    free(id);
    return status;
}

static dem_status feed(dem_sim *sim, feeder *f)
{
    crowd c = {.n = 0};
    arrivals in = {.n = 0};
    double x[3];
    dem_status status = gather(sim, f, &c);
    while (!status && next_is_due(sim, f) && find_place(sim, f, &c, x))
        status = enter(sim, f, &c, x, &in);
    f->waiting = next_is_due(sim, f) ? debt(f) : 0;
    status = agree(sim, status);
    if (!status && in.n) status = admit(sim, &in);
    crowd_free(&c);
    arrivals_free(&in);
    return status;
}

dem_status feeders_feed(dem_sim *sim, double dt)
{
    dem_status status = DEM_OK;
    for (size_t k = 0; k < sim->feeders.n && !status; k++) {
        feeder *f = &sim->feeders.feeder[k];
        if (!feeder_goes_on(sim, f) || !moment_comes(f, sim->time, dt)) continue;
        if (next_is_due(sim, f)) status = feed(sim, f);
        /* What will not come need not set the time step. */
        if (!status && !feeder_goes_on(sim, f)) take_stock(sim);
    }
    return status;
}

/* ---- public ---------------------------------------------------------------------------------- */

size_t dem_feeders(const dem_sim *sim)
{
    return sim->feeders.n;
}

const char *dem_feeder_name(const dem_sim *sim, size_t feeder)
{
    return feeder < sim->feeders.n ? sim->feeders.feeder[feeder].given.name : "";
}

void dem_fed(const dem_sim *sim, size_t feeder, int64_t *number, double *mass, double *waiting)
{
    const int there = feeder < sim->feeders.n;
    *number = there ? sim->feeders.feeder[feeder].number : 0;
    *mass = there ? tally_total(&sim->feeders.feeder[feeder].mass) : 0;
    *waiting = there ? sim->feeders.feeder[feeder].waiting : 0;
}
