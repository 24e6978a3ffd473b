/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * report.c - sums over the particles for dem_last_report.
 *
 * Plain sums in the order of the particles; the error of a balance formed from them is that of
 * some sqrt(n) roundings.
 */
#include "report.h"

#include <math.h>

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
            gain[a] += p->gain[i][a];
        }
    }
    r->particles = (int64_t)p->n;
    r->kinetic_energy = kinetic;
    r->rotational_energy = rotational;
    r->mass = mass;
    r->speed = sqrt(fastest);
    for (int a = 0; a < 3; a++) {
        r->momentum[a] = momentum[a];
        r->outside_impulse[a] = gain[a] + r->removed_impulse[a];
    }
}
