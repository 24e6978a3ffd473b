/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * record.c - time series in <case>/postProcessing.
 *
 *     particles.csv    number, contacts, overlap, largest speed, energies, momentum, centre of
 * mass, potential energy -sum m g.x (its zero is at the origin) wallForces.csv   force of the
 * particles on each wall, mean over the step
 *
 * First row: names, the wall's name before .x .y .z; SI units, told in a comment above. Rows are
 * flushed as they are written, so that a run can be watched.
 */
#include "felmiDEM.h"
#include "message.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct record {
    FILE *particles, *walls;
    double gravity[3];
};

static FILE *open_csv(const char *directory, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/postProcessing", directory);
    if (mkdir(path, 0777) != 0 && errno != EEXIST) {
        message_stop("felmiDEM", "cannot create %s: %s", path, strerror(errno));
        return NULL;
    }
    snprintf(path, sizeof path, "%s/postProcessing/%s", directory, name);
    FILE *f = fopen(path, "w");
    if (f == NULL) message_stop("felmiDEM", "cannot write %s: %s", path, strerror(errno));
    return f;
}

record *record_new(const char *directory, const dem_sim *sim, const double gravity[3])
{
    record *r = calloc(1, sizeof *r);
    if (r == NULL) {
        message_stop("felmiDEM", "out of memory");
        return NULL;
    }
    memcpy(r->gravity, gravity, sizeof r->gravity);
    r->particles = open_csv(directory, "particles.csv");
    if (r->particles != NULL && dem_walls(sim) > 0)
        r->walls = open_csv(directory, "wallForces.csv");
    if (r->particles == NULL || (r->walls == NULL && dem_walls(sim) > 0)) {
        record_free(r);
        return NULL;
    }
    fputs("# s,-,-,-,-,m/s,J,J,J,kg m/s,kg m/s,kg m/s,m,m,m\n"
          "time,particles,contacts,wallContacts,overlap,speed,kineticEnergy,rotationalEnergy,"
          "potentialEnergy,momentum.x,momentum.y,momentum.z,centre.x,centre.y,centre.z\n",
          r->particles);
    if (r->walls != NULL) {
        fputs("# force of the particles on each wall, mean over the step\ntime", r->walls);
        for (size_t w = 0; w < dem_walls(sim); w++) {
            const char *name = dem_wall_name(sim, w);
            fprintf(r->walls, ",%s.x,%s.y,%s.z", name, name, name);
        }
        fputs("\n", r->walls);
    }
    return r;
}

/* What the report does not have: the centre of mass and the potential energy. */
static void write_particles(record *r, const dem_sim *sim)
{
    const dem_view view = dem_particles(sim);
    const dem_report report = dem_last_report(sim);
    double mass = 0., moment[3] = {0., 0., 0.}, potential = 0.;
    for (size_t i = 0; i < view.n; i++) {
        mass += view.mass[i];
        for (int k = 0; k < 3; k++) moment[k] += view.mass[i] * view.x[i][k];
    }
    for (int k = 0; k < 3; k++) potential -= r->gravity[k] * moment[k];
    fprintf(r->particles, "%.12g,%lld,%lld,%lld,%.6g,%.10g,%.12g,%.12g,%.12g", dem_time(sim),
            (long long)report.particles, (long long)report.contacts,
            (long long)report.wall_contacts, report.overlap, report.speed, report.kinetic_energy,
            report.rotational_energy, potential);
    for (int k = 0; k < 3; k++) fprintf(r->particles, ",%.12g", report.momentum[k]);
    for (int k = 0; k < 3; k++) fprintf(r->particles, ",%.12g", mass > 0. ? moment[k] / mass : 0.);
    fputs("\n", r->particles);
}

int record_write(record *r, const dem_sim *sim)
{
    write_particles(r, sim);
    int bad = fflush(r->particles) != 0;
    if (r->walls != NULL) {
        fprintf(r->walls, "%.12g", dem_time(sim));
        for (size_t w = 0; w < dem_walls(sim); w++) {
            double force[3];
            dem_wall_force(sim, w, force);
            fprintf(r->walls, ",%.10g,%.10g,%.10g", force[0], force[1], force[2]);
        }
        fputs("\n", r->walls);
        bad |= fflush(r->walls) != 0;
    }
    if (bad) message_stop("felmiDEM", "cannot write postProcessing: %s", strerror(errno));
    return bad ? -1 : 0;
}

void record_free(record *r)
{
    if (r == NULL) return;
    if (r->particles != NULL) fclose(r->particles);
    if (r->walls != NULL) fclose(r->walls);
    free(r);
}
