/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * report.c - sums over the particles for dem_last_report.
 *
 * Plain sums in the order of the particles; the error of a balance formed from them is that of
 * some sqrt(n) roundings.
 */
#include "report.h"

#include <math.h>
#include <string.h>

void report_sums(dem_sim *sim)
{
    const particles *p = &sim->particles;
    dem_report *r = &sim->report;
    double kinetic = 0, rotational = 0, fastest = 0, mass = 0;
    double momentum[3] = {0}, gain[3] = {0};
    for (size_t i = 0; i < p->n; i++) {
        const double *v = p->vel[i], *w = v + 4;
        double v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        double w2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        fastest = v2 > fastest ? v2 : fastest;
        kinetic += .5 * p->mass[i] * v2;
        rotational += .5 * w2 / w[3];
        mass += p->mass[i];
        for (int a = 0; a < 3; a++) {
            momentum[a] += p->mass[i] * v[a];
            gain[a] += p->impulse[i][a];
        }
    }
    double sum[9] = {kinetic,     rotational, mass,    momentum[0], momentum[1],
                     momentum[2], gain[0],    gain[1], gain[2]};
    sum_reals(sim, sum, 9);
    max_reals(sim, &fastest, 1);
    r->particles = sim->total;
    r->kinetic_energy = sum[0];
    r->rotational_energy = sum[1];
    r->mass = sum[2];
    r->speed = sqrt(fastest);
    for (int a = 0; a < 3; a++) {
        r->momentum[a] = sum[3 + a];
        r->outside_impulse[a] = sum[6 + a];
    }
}

static void gather_wall_loads(dem_sim *sim)
{
    for (wall_body *b = sim->walls.body; b < sim->walls.body + sim->walls.n; b++)
        sum_reals(sim, b->mean, 6);
}

void report_gather(dem_sim *sim)
{
    dem_report *r = &sim->report;
    int64_t count[] = {r->contacts, r->wall_contacts, r->removed, (int64_t)sim->particles.n_ghost};
    double sum[10] = {r->removed_mass};
    double most[] = {r->seconds_force, r->seconds_neighbour, r->seconds_exchange, r->seconds_other};
    memcpy(sum + 1, r->wall_impulse, sizeof r->wall_impulse);
    memcpy(sum + 4, r->removed_momentum, sizeof r->removed_momentum);
    memcpy(sum + 7, r->removed_impulse, sizeof r->removed_impulse);
    sum_counts(sim, count, 4);
    sum_reals(sim, sum, 10);
    max_reals(sim, most, 4);
    r->contacts = count[0];
    r->wall_contacts = count[1];
    r->removed = count[2];
    r->ghosts = count[3];
    r->removed_mass = sum[0];
    memcpy(r->wall_impulse, sum + 1, sizeof r->wall_impulse);
    memcpy(r->removed_momentum, sum + 4, sizeof r->removed_momentum);
    memcpy(r->removed_impulse, sum + 7, sizeof r->removed_impulse);
    for (int a = 0; a < 3; a++) r->outside_impulse[a] += r->removed_impulse[a];
    r->seconds_force = most[0];
    r->seconds_neighbour = most[1];
    r->seconds_exchange = most[2];
    r->seconds_other = most[3];
    gather_wall_loads(sim);
}
