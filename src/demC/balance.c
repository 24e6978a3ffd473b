/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * balance.c - the balance of energy and of angular momentum, kept when param.balance is set.
 *
 * In a step of symplectic Euler the force F changes the kinetic energy by F (v + v')/2 dt exactly,
 * the torque T that of rotation by T (w + w')/2 dt. Works of gravity, of the outside force and of
 * dashpots, friction and rolling resistance are therefore taken with the mean of the velocities
 * before and after the step, and are exact. The force loops sort the forces that lose energy by
 * cause for every particle; that at a wall its surface moves with the velocity u, is put right
 * there: what is lost is F (v - u), and F u is work of the wall.
 *
 * What is left is how far the change of a spring's energy is from the work it did: the error of
 * the time integration, which goes with dt and within a contact swings to and fro rather than
 * piles up. It is the residual.
 *
 * The springs of contacts that end are lost with them: what tangential and rolling springs held
 * after the last step, less what those contacts that live on held, is added to the losses.
 *
 * Angular momentum about the origin changes in a step by dt (x F + T) with x before it moves,
 * exactly, since x' - x is parallel to v'.
 *
 * On several ranks each has the sums of its own particles. What a pair of two ranks holds and loses
 * is halved between them. Only the sums over all ranks mean something: particles take what their
 * springs hold along when they go from one to another, and it is not booked there.
 */
#include "balance.h"

#include "dem_internal.h"

#include <stdlib.h>
#include <string.h>

void balance_free(balance *b)
{
    free(b->damped);
    free(b->slid);
    free(b->rolled);
    free(b->before);
    memset(b, 0, sizeof *b);
}

static dem_status reserve(balance *b, size_t n)
{
    if (n <= b->capacity) return DEM_OK;
    size_t room = n + n / 2;
    free(b->damped);
    free(b->slid);
    free(b->rolled);
    free(b->before);
    b->damped = malloc(room * sizeof *b->damped);
    b->slid = malloc(room * sizeof *b->slid);
    b->rolled = malloc(room * sizeof *b->rolled);
    b->before = malloc(room * sizeof *b->before);
    b->capacity = 0;
    if (!b->damped || !b->slid || !b->rolled || !b->before) return DEM_NO_MEMORY;
    b->capacity = room;
    return DEM_OK;
}

/* ---- springs --------------------------------------------------------------------------------- */

/* Of particle i and the partner in the entry k of the list; `contact`: how many touched before. */
static double pair_energy(const dem_sim *sim, size_t i, size_t k, size_t *contact,
                          spring_energy *sum)
{
    const particles *p = &sim->particles;
    uint32_t entry = sim->list.entry[k], j = entry & NEIGHBOUR_MASK;
    const double *xi = p->pos[i], *xj = p->pos[j], *shift = sim->list.shift[NEIGHBOUR_HOME];
    if (sim->list.any_periodic) shift = sim->list.shift[entry >> NEIGHBOUR_BITS];
    size_t pair = (size_t)(p->material[i] * sim->n_material + p->material[j]);
    double d2 = 0, ri = xi[3], rj = xj[3], radius = ri * rj / (ri + rj);
    /* The other half is with the rank of the other one. */
    const double share = i < p->n && j < p->n ? 1 : .5;
    for (int a = 0; a < 3; a++) {
        double d = xi[a] - xj[a] - shift[a];
        d2 += d * d;
    }
    if (sim->contacts.touch[k]) {
        const size_t at = contacts_at(&sim->contacts, (*contact)++);
        const double *t = sim->contacts.spring[at];
        const double *m = sim->contacts.rolls ? sim->contacts.rolling[at] : NULL;
        spring_energy s = {0};
        add_springs(sim->law, sim->table[pair], sim->extras.table[pair], radius, t, m, &s);
        sum->tangential += share * s.tangential;
        sum->turned += share * s.turned;
    }
    double overlap = ri + rj - sqrt(d2);
    if (!(overlap > 0)) return 0;
    double a = sim->law == DEM_HERTZ ? sqrt(radius * overlap) : 1, held;
    held = normal_energy(sim->law, sim->table[pair].normal * a, overlap);
    if (sim->extras.cohesion == DEM_COHESION_SJKR)
        held -= sim->extras.table[pair].cohesion * lens_volume(ri, rj, sqrt(d2));
    return share * held;
}

/* Of all springs, where particles and history are now. */
static double elastic(const dem_sim *sim, spring_energy *s)
{
    *s = (spring_energy){0};
    double sum = 0;
    const neighbour *list = &sim->list;
    size_t contact = 0;
    for (size_t r = 0; r < list->n_row; r++) {
        const size_t i = neighbour_slot(list, (uint32_t)r);
        for (size_t k = list->row[r]; k < list->row[r + 1]; k++)
            sum += pair_energy(sim, i, k, &contact, s);
    }
    sum +=
        walls_elastic(&sim->walls, &sim->particles, sim->table, sim->n_material, &sim->extras, s);
    return sum + s->tangential + s->turned;
}

/* The same while the ghosts are where they were in the last sum of forces. Collective. */
static double elastic_now(dem_sim *sim)
{
    spring_energy s;
    if (!sim->list.valid || !sim->total) return 0;
    if (sim->ranks > 1) halo_refresh(sim);
    return elastic(sim, &s);
}

/* ---- particles that come and go -------------------------------------------------------------- */

void balance_changing(dem_sim *sim)
{
    balance *b = &sim->balance;
    if (!b->on || b->changed) return;
    b->elastic = elastic_now(sim);
    b->changed = 1;
}

void balance_supply(dem_sim *sim, size_t row, int sign)
{
    if (!sim->balance.on) return;
    const double *v = sim->particles.vel[row], *w = v + 4;
    double energy = .5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / v[3] +
                    .5 * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) / w[3];
    sim->balance.supply += sign * energy;
}

/* ---- a step ---------------------------------------------------------------------------------- */

dem_status balance_open(dem_sim *sim)
{
    balance *b = &sim->balance;
    /* The loops book for ghosts, too; nobody reads it. */
    const size_t n = sim->particles.n + sim->particles.n_ghost;
    if (reserve(b, n + 1)) return no_memory(sim);
    memset(b->damped, 0, n * sizeof *b->damped);
    memset(b->slid, 0, n * sizeof *b->slid);
    memset(b->rolled, 0, n * sizeof *b->rolled);
    if (!b->changed) return DEM_OK;
    spring_energy s;
    b->supply += elastic(sim, &s) - b->elastic;
    b->tangential = s.tangential;
    b->turned = s.turned;
    b->changed = 0;
    return DEM_OK;
}

void balance_springs(balance *b, const spring_energy *pairs, const spring_energy *walls)
{
    b->sliding += b->tangential - pairs->tangential_old - walls->tangential_old;
    b->rolling += b->turned - pairs->turned_old - walls->turned_old;
    b->sliding += pairs->slid + walls->slid;
    b->rolling += pairs->rolled + walls->rolled;
    b->tangential = pairs->tangential + walls->tangential;
    b->turned = pairs->turned + walls->turned;
}

void balance_summed(dem_sim *sim)
{
    const particles *p = &sim->particles;
    for (size_t i = 0; i < p->n; i++) {
        double *before = sim->balance.before[i];
        memcpy(before, p->pos[i], 3 * sizeof *before);
        memcpy(before + 3, p->vel[i], 3 * sizeof *before);
        memcpy(before + 6, p->vel[i] + 4, 3 * sizeof *before);
        memcpy(before + 9, p->impulse[i], 3 * sizeof *before);
    }
}

/* sum += scale x f */
static void add_cross(double sum[3], double scale, const double x[3], const double f[3])
{
    sum[0] += scale * (x[1] * f[2] - x[2] * f[1]);
    sum[1] += scale * (x[2] * f[0] - x[0] * f[2]);
    sum[2] += scale * (x[0] * f[1] - x[1] * f[0]);
}

void balance_moved(dem_sim *sim, double dt)
{
    const particles *p = &sim->particles;
    balance *b = &sim->balance;
    for (size_t i = 0; i < p->n; i++) {
        const double *before = b->before[i], *now = p->vel[i];
        double gain[3];
        for (int a = 0; a < 3; a++) {
            double v = .5 * (before[3 + a] + now[a]), w = .5 * (before[6 + a] + now[4 + a]);
            gain[a] = p->impulse[i][a] - before[9 + a];
            b->gravity += dt * p->mass[i] * sim->gravity[a] * v;
            b->outside += gain[a] * v;
            b->damping -= dt * (b->damped[i][a] * v + b->damped[i][3 + a] * w);
            b->sliding -= dt * (b->slid[i][a] * v + b->slid[i][3 + a] * w);
            b->rolling -= dt * b->rolled[i][a] * w;
        }
        add_cross(b->gravity_angular, dt * p->mass[i], before, sim->gravity);
        add_cross(b->outside_angular, 1, before, gain);
    }
}

/* ---- an advance ------------------------------------------------------------------------------ */

void balance_clear(dem_sim *sim)
{
    balance *b = &sim->balance;
    memset(b->gravity_angular, 0, sizeof b->gravity_angular);
    memset(b->outside_angular, 0, sizeof b->outside_angular);
    memset(b->wall_angular, 0, sizeof b->wall_angular);
}

static void angular_momentum(const particles *p, double L[3])
{
    L[0] = L[1] = L[2] = 0;
    for (size_t i = 0; i < p->n; i++) {
        add_cross(L, p->mass[i], p->pos[i], p->vel[i]);
        for (int a = 0; a < 3; a++) L[a] += p->vel[i][4 + a] / p->vel[i][7];
    }
}

/* What is summed over the ranks: nothing but doubles. */
typedef struct part {
    dem_energy energy;
    double momentum[3], wall[3], gravity[3], outside[3]; /* angular */
} part;

void balance_report(dem_sim *sim)
{
    balance *b = &sim->balance;
    dem_report *r = &sim->report;
    if (!b->on) return;
    if (b->changed && !sim->total) { /* the last has left, and took what springs held */
        b->supply -= b->elastic;
        b->elastic = b->tangential = b->turned = 0;
        b->changed = 0;
    }
    part sum = {.energy = {.elastic = b->changed ? b->elastic : elastic_now(sim),
                           .gravity = b->gravity,
                           .outside = b->outside,
                           .walls = b->walls,
                           .damping = b->damping,
                           .sliding = b->sliding,
                           .rolling = b->rolling,
                           .supply = b->supply}};
    angular_momentum(&sim->particles, sum.momentum);
    memcpy(sum.wall, b->wall_angular, sizeof sum.wall);
    memcpy(sum.gravity, b->gravity_angular, sizeof sum.gravity);
    memcpy(sum.outside, b->outside_angular, sizeof sum.outside);
    sum_reals(sim, (double *)&sum, sizeof sum / sizeof(double));
    dem_energy *e = &r->energy;
    *e = sum.energy;
    e->kinetic = r->kinetic_energy; /* sums over all ranks already */
    e->rotational = r->rotational_energy;
    e->residual = e->kinetic + e->rotational + e->elastic - e->gravity - e->outside - e->walls -
                  e->supply + e->damping + e->sliding + e->rolling;
    memcpy(r->angular_momentum, sum.momentum, sizeof sum.momentum);
    memcpy(r->wall_angular, sum.wall, sizeof sum.wall);
    memcpy(r->gravity_angular, sum.gravity, sizeof sum.gravity);
    memcpy(r->outside_angular, sum.outside, sizeof sum.outside);
}
