/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * advance.c - the time step: dem_advance.
 *
 * One step:
 *
 *     feeders          at moments of their own
 *     neighbour list   only when some particle has moved by half the skin: outlets take what is in
 *                      them, wrap, check that none is lost, particles to the ranks that own their
 *                      places, ghosts, sort by (cell, id), list, history of contacts carried over
 *     ghosts           follow their owners, in the other steps
 *     forces           pairs, then walls, at x and v of the step's beginning
 *     motion           symplectic Euler; impulse of the outside force; in one sweep with the forces
 *     agreement        the largest speed of all ranks, and that all are well
 *
 * After the last one: outlets again, and check again that no particle is lost, so that the caller
 * never sees one. Everything is allocated when particles come or go or the list is rebuilt; any
 * other step allocates nothing.
 */
#include "check.h"
#include "dem_internal.h"
#include "force.h"
#include "integrate.h"
#include "migrate.h"
#include "report.h"
#include "time_step.h"

#include <math.h>
#include <string.h>

/* ---- the list ---------------------------------------------------------------------------------
 */

/* What the cells of the list are laid for, m, and how it is filled. */
static double list_reach(const dem_sim *sim, int *uneven)
{
    /* With the largest radius for the skin or the cells, one large sphere would have crowds of
     * small ones in each other's lists. */
    *uneven = sim->largest_radius > 2 * sim->smallest_any;
    return 2 * (*uneven ? sim->median_radius : sim->largest_radius) + sim->list.skin;
}

/* Whether no particle can have moved by half the skin since the list was built. */
static int list_holds(dem_sim *sim)
{
    neighbour *list = &sim->list;
    if (!list->valid) return 0;
    /* Sum of the largest steps: an upper bound that costs nothing. Only when it is used up is the
     * largest displacement looked for. A rebuild is due a little early, at .9 of skin/2, so that
     * the search is not repeated in every one of the last steps. */
    list->moved += sim->speed * sim->report.step;
    if (list->moved < .5 * list->skin) return 1;
    list->moved = neighbour_displacement(&sim->particles);
    max_reals(sim, &list->moved, 1);
    return list->moved < .45 * list->skin;
}

/* Particles to their ranks, and the ghosts of this one. */
static dem_status exchange_particles(dem_sim *sim)
{
    const double begin = MPI_Wtime();
    const int64_t divisions = sim->report.divisions;
    dem_status status = domain_balance(sim);
    if (!status) status = migrate(sim, sim->largest_radius + sim->list.skin);
    const double took = MPI_Wtime() - begin;
    sim->report.seconds_exchange += took;
    if (sim->report.divisions == divisions) return status;
    sim->domain.cost = took;
    max_reals(sim, &sim->domain.cost, 1);
    return status;
}

dem_status list_pairs(dem_sim *sim)
{
    particles *p = &sim->particles;
    neighbour *list = &sim->list;
    int uneven;
    const double reach = list_reach(sim, &uneven);
    extent all = neighbour_extent(p);
    min_reals(sim, all.lo, 3);
    max_reals(sim, all.hi, 3);
    all.n = (double)sim->total;
    if (neighbour_sort(list, p, &all, reach)) return no_memory(sim);
    if (sim->ranks > 1) halo_follow(sim, list->place);
    return neighbour_fill(list, p, uneven) || contacts_restore(&sim->contacts, list)
               ? no_memory(sim)
               : DEM_OK;
}

/* List, histories and walls of the particles and ghosts that are here. */
static dem_status make_lists(dem_sim *sim)
{
    const dem_status status = list_pairs(sim);
    if (status) return status;
    const double margin = .5 * sim->list.skin;
    sim->walls.slack = margin;
    return walls_list(&sim->walls, &sim->particles, margin, sim->list.place) ? no_memory(sim)
                                                                             : DEM_OK;
}

static dem_status rebuild(dem_sim *sim)
{
    neighbour *list = &sim->list;
    dem_status status = outlets_take(sim);
    if (!status) status = check_inside(sim);
    if (!status) status = check_crossing(sim);
    /* After particles came or went the histories are saved already, and the list no longer fits. */
    if (!status && list->valid && contacts_save(&sim->contacts, list)) status = no_memory(sim);
    status = agree(sim, status);
    if (status || !sim->total) return status;
    neighbour_wrap(list, &sim->particles);
    list->skin = sim->skin * 2 * sim->median_radius;
    if (sim->ranks > 1) status = exchange_particles(sim);
    if (!status) status = agree(sim, make_lists(sim));
    if (status) list->valid = 0; /* nor are there ghosts */
    sim->report.rebuilds++;
    return status;
}

/* ---- forces and motion ------------------------------------------------------------------------
 */

/* Own particles in the first `rows` rows of the list, which are the first of the store; at least
 * `known`. */
static size_t own_among(const dem_sim *sim, size_t known, size_t begin, size_t rows)
{
    const neighbour *list = &sim->list;
    if (!list->slot) return rows;
    for (size_t r = begin; r < rows; r++)
        if (list->slot[r] < sim->particles.n) known = (size_t)list->slot[r] + 1;
    return known;
}

/* Forces and motion in one sweep: no pair of a later row has the particle of an earlier one, so
 * that each moves while what it needs is in the cache. The balance looks at all before and after.
 */
static dem_status sweep(dem_sim *sim, pair_forces *pairs, wall_forces *walls, motion *m)
{
    particles *p = &sim->particles;
    const size_t rows = sim->list.n_row, stretch = sim->balance.on ? rows : 1024;
    size_t moved = 0;
    /* What pairs with ghosts leave on them is the business of their owners. */
    if (p->n_ghost) memset(p->force[p->n], 0, p->n_ghost * sizeof *p->force);
    force_loop loop = forces_open(pairs, p, &sim->list, &sim->contacts);
    for (size_t begin = 0; begin < rows; begin += stretch) {
        const size_t end = begin + stretch < rows ? begin + stretch : rows;
        const size_t own = own_among(sim, moved, begin, end);
        forces_of_rows(&loop, begin, end);
        sum_wall_forces(walls, &sim->walls, p, own);
        if (sim->balance.on) balance_summed(sim);
        integrate(m, p, moved, own);
        moved = own;
    }
    return forces_close(&loop) ? no_memory(sim) : DEM_OK;
}

/* A step without particles. */
static dem_status idle(dem_sim *sim, double dt)
{
    dem_report *r = &sim->report;
    r->contacts = r->wall_contacts = 0;
    r->overlap = 0;
    r->step = dt;
    sim->time += dt;
    return DEM_OK;
}

/* The list holds, and ghosts are where their owners are. */
static dem_status bring_up_to_date(dem_sim *sim)
{
    if (!list_holds(sim)) return rebuild(sim);
    if (sim->ranks == 1) return DEM_OK;
    const double begin = MPI_Wtime();
    halo_refresh(sim);
    sim->report.seconds_exchange += MPI_Wtime() - begin;
    return DEM_OK;
}

/* Walls that have moved by their slack have their particles listed anew. */
static dem_status follow_walls(dem_sim *sim)
{
    if (walls_hold(&sim->walls)) return DEM_OK;
    /* The particles have their half skin yet to go, counted from where they were listed. */
    double margin = .5 * sim->list.skin + sim->list.moved;
    return walls_list(&sim->walls, &sim->particles, margin, NULL) ? no_memory(sim) : DEM_OK;
}

/* Forces and motion of this rank's particles; what goes wrong is told at the end of the step. */
static dem_status move_particles(dem_sim *sim, double dt, motion *m)
{
    dem_report *r = &sim->report;
    const double begin = MPI_Wtime();
    if (sim->balance.on && balance_open(sim)) return DEM_NO_MEMORY;
    pair_forces pairs = {.law = sim->law,
                         .vectors = sim->vectors,
                         .table = sim->table,
                         .n_material = sim->n_material,
                         .one_material = sim->one_material,
                         .uniform = sim->uniform,
                         .mass = sim->uniform_mass,
                         .radius = sim->largest_radius,
                         .only = sim->table[sim->the_material * (sim->n_material + 1)],
                         .dt = dt,
                         .extras = sim->any_extra ? &sim->extras : NULL,
                         .balance = sim->balance.on ? &sim->balance : NULL,
                         .survey = m->last};
    wall_forces walls = {.law = sim->law,
                         .table = sim->table,
                         .n_material = sim->n_material,
                         .dt = dt,
                         .extras = pairs.extras,
                         .balance = pairs.balance};
    if (sweep(sim, &pairs, &walls, m)) return DEM_NO_MEMORY;
    if (sim->balance.on) {
        balance_springs(&sim->balance, &pairs.springs, &walls.springs);
        balance_moved(sim, dt);
    }
    for (int a = 0; a < 3; a++) {
        r->wall_impulse[a] += dt * walls.on_particles[a];
        r->gravity_impulse[a] += dt * sim->mass * sim->gravity[a];
    }
    r->contacts = (int64_t)pairs.contacts;
    r->wall_contacts = (int64_t)walls.contacts;
    r->overlap = fmax(pairs.overlap, walls.overlap);
    const double took = MPI_Wtime() - begin;
    r->seconds_force += took;
    sim->domain.busy += took;
    return m->lost ? check_finite(sim) : DEM_OK;
}

/* That all ranks are well, and the speed that no particle of theirs exceeds. */
static dem_status close_step(dem_sim *sim, dem_status status, const motion *m)
{
    double most[4] = {m->most[0], m->most[1], m->most[2], status != DEM_OK};
    const double begin = MPI_Wtime();
    max_reals(sim, most, 4);
    if (sim->ranks > 1) sim->report.seconds_exchange += MPI_Wtime() - begin;
    if (most[3] > 0) return agree(sim, status);
    sim->speed = sqrt(most[0] + most[1] + most[2]);
    return DEM_OK;
}

/* ---- one step, and many ------------------------------------------------------------------------
 */

/* One step of the length dt. */
static dem_status step(dem_sim *sim, double dt, int last)
{
    dem_report *r = &sim->report;
    double begin = MPI_Wtime(), exchanged = r->seconds_exchange;
    walls_move(&sim->walls, sim->time, dt);
    dem_status status = feeders_feed(sim, dt);
    if (!status && sim->total) status = bring_up_to_date(sim);
    if (status) return status;
    if (!sim->total) return idle(sim, dt);
    status = follow_walls(sim);
    r->seconds_neighbour += MPI_Wtime() - begin - (r->seconds_exchange - exchanged);
    motion m = {.dt = dt, .outside = sim->outside, .last = last};
    memcpy(m.gravity, sim->gravity, sizeof m.gravity);
    if (!status) status = move_particles(sim, dt, &m);
    sim->time += dt;
    r->step = dt;
    return close_step(sim, status, &m);
}

static void clear_sums(dem_sim *sim)
{
    particles *p = &sim->particles;
    dem_report *r = &sim->report;
    memset(r->wall_impulse, 0, sizeof r->wall_impulse);
    memset(r->gravity_impulse, 0, sizeof r->gravity_impulse);
    memset(r->fed_momentum, 0, sizeof r->fed_momentum);
    memset(r->removed_momentum, 0, sizeof r->removed_momentum);
    memset(r->removed_impulse, 0, sizeof r->removed_impulse);
    r->fed = r->removed = 0;
    r->fed_mass = r->removed_mass = 0;
    particles_clear_removed(p);
    r->seconds_force = r->seconds_neighbour = r->seconds_exchange = r->seconds_other = 0;
    if (p->n) memset(p->impulse, 0, p->n * sizeof *p->impulse);
    walls_clear_loads(&sim->walls);
    balance_clear(sim);
}

static void set_clock(dem_sim *sim, double time)
{
    sim->time = time;
    walls_move(&sim->walls, time, 0);
}

/* What is asked for can be done, and is the same on all ranks. */
static dem_status check_advance(dem_sim *sim, double dt, int substeps)
{
    dem_status status = DEM_OK;
    if (!(dt > 0) || !isfinite(dt))
        status = fail(sim, DEM_BAD_ARGUMENT, "time step %g s must be > 0", dt);
    else if (substeps < 0)
        status = fail(sim, DEM_BAD_ARGUMENT, "%d sub-steps", substeps);
    status = agree(sim, status);
    if (status) return status;
    double most[4] = {dt, -dt, substeps, -substeps};
    max_reals(sim, most, 4);
    if (most[0] == -most[1] && most[2] == -most[3]) return DEM_OK;
    return fail(sim, DEM_BAD_ARGUMENT,
                "ranks were told different steps: %g to %g s, %g to %g sub-steps", -most[1],
                most[0], -most[3], most[2]);
}

dem_status dem_advance(dem_sim *sim, double dt, int substeps)
{
    dem_status status = check_advance(sim, dt, substeps);
    if (!status) status = choose_substeps(sim, dt, &substeps);
    if (status) return status;
    clear_sums(sim);
    double end = sim->time + dt;
    for (int s = 0; s < substeps && !status; s++)
        status = step(sim, dt / substeps, s == substeps - 1);
    if (status == DEM_NO_MEMORY) return status; /* there is no state to report on */
    if (!status) {
        set_clock(sim, end);
        max_reals(sim, &sim->report.overlap, 1);
        sim->overlap = sim->total ? sim->report.overlap : 0;
    }
    /* Both are done when the list is rebuilt; who is handed the particles must find all of them
     * inside. */
    if (!status) status = outlets_take(sim);
    if (!status) status = agree(sim, check_inside(sim));
    double begin = MPI_Wtime();
    sim->report.substeps = substeps;
    walls_average_loads(&sim->walls, substeps);
    particles_publish(&sim->particles, sim->lo, sim->hi, sim->periodic);
    report_sums(sim);
    balance_report(sim);
    sim->report.seconds_other += MPI_Wtime() - begin;
    report_gather(sim);
    return status;
}

double dem_time(const dem_sim *sim)
{
    return sim->time;
}

void dem_set_time(dem_sim *sim, double time)
{
    /* Who takes a rounding off the clock jumps over nothing. */
    if (!(fabs(time - sim->time) <= 1e-3 * sim->report.step)) feeders_set_time(sim, time);
    set_clock(sim, time);
}
