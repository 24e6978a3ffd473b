/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * record.c - time series in <case>/postProcessing.
 *
 *     particles.csv   number, contacts, overlap, largest speed, energies, momentum, centre of mass,
 *                     potential energy -sum m g.x (its zero is at the origin)
 *     wallForces.csv  force of the particles on each wall, mean over the step (.x .y .z), its
 *                     torque about the wall's centre (.torque), and for walls that move where
 *                     they are: x = place + R x_start, R as a rotation vector (.turn, up to pi)
 *
 * First row: names, the wall's name before .x .y .z; SI units, told in a comment above. Rows are
 * flushed as they are written, so that a run can be watched.
 */
#include "felmiDEM.h"
#include "message.h"

#include <errno.h>
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct record {
    FILE *particles, *walls; /* on the first rank */
    double gravity[3];
};

static const char PARTICLES[] =
    "# s,-,-,-,-,m/s,J,J,J,kg m/s,kg m/s,kg m/s,m,m,m\n"
    "time,particles,contacts,wallContacts,overlap,speed,kineticEnergy,rotationalEnergy,"
    "potentialEnergy,momentum.x,momentum.y,momentum.z,centre.x,centre.y,centre.z\n";

/* Units and names of the columns. */
static void name_walls(FILE *f, const dem_sim *sim)
{
    static const char *const what[] = {"", ".torque", ".place", ".turn"};
    static const char *const unit[] = {"N", "N m", "m", "rad"};
    for (int row = 0; row < 2; row++) {
        fputs(row ? "\ntime" : "# s", f);
        for (size_t w = 0; w < dem_walls(sim); w++)
            for (int k = 0; k < (dem_wall_moves(sim, w) ? 4 : 2); k++)
                for (int a = 0; a < 3; a++) {
                    if (row)
                        fprintf(f, ",%s%s.%c", dem_wall_name(sim, w), what[k], "xyz"[a]);
                    else
                        fprintf(f, ",%s", unit[k]);
                }
    }
    fputs("\n", f);
}

record *record_new(const char *directory, const dem_sim *sim, const double gravity[3], double from)
{
    record *r = calloc(1, sizeof *r);
    if (r == NULL) {
        message_stop("felmiDEM", "out of memory");
        return NULL;
    }
    memcpy(r->gravity, gravity, sizeof r->gravity);
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (rank > 0) return r;
    r->particles = series_open(directory, "particles.csv", PARTICLES, from);
    if (r->particles != NULL && dem_walls(sim) > 0) {
        char *head = head_of(name_walls, sim);
        if (head != NULL) r->walls = series_open(directory, "wallForces.csv", head, from);
        free(head);
    }
    if (r->particles == NULL || (r->walls == NULL && dem_walls(sim) > 0)) {
        record_free(r);
        return NULL;
    }
    return r;
}

/* What the report does not have: the centre of mass and the potential energy. */
static void write_particles(record *r, const dem_sim *sim)
{
    const dem_view view = dem_particles(sim);
    const dem_report report = dem_last_report(sim);
    double sum[4] = {0.}, potential = 0.;
    for (size_t i = 0; i < view.n; i++) {
        for (int k = 0; k < 3; k++) sum[k] += view.mass[i] * view.x[i][k];
        sum[3] += view.mass[i];
    }
    sum_over_ranks(sum, 4);
    if (r->particles == NULL) return;
    const double *moment = sum, mass = sum[3];
    for (int k = 0; k < 3; k++) potential -= r->gravity[k] * moment[k];
    fprintf(r->particles, "%.12g,%lld,%lld,%lld,%.6g,%.10g,%.12g,%.12g,%.12g", dem_time(sim),
            (long long)report.particles, (long long)report.contacts,
            (long long)report.wall_contacts, report.overlap, report.speed, report.kinetic_energy,
            report.rotational_energy, potential);
    for (int k = 0; k < 3; k++) fprintf(r->particles, ",%.12g", report.momentum[k]);
    for (int k = 0; k < 3; k++) fprintf(r->particles, ",%.12g", mass > 0. ? moment[k] / mass : 0.);
    fputs("\n", r->particles);
}

/* Rotation vector of a rotation matrix, by the unit quaternion q0 + q: of its four squares the
 * largest is taken, so that no digits are lost (Shepperd, J. Guid. Control 1 (1978) 223,
 * doi:10.2514/3.55767b). */
static void rotation_vector(const double R[9], double turn[3])
{
    const double square[4] = {1. + R[0] + R[4] + R[8], 1. + R[0] - R[4] - R[8],
                              1. - R[0] + R[4] - R[8], 1. - R[0] - R[4] + R[8]};
    int most = 0;
    for (int k = 1; k < 4; k++)
        if (square[k] > square[most]) most = k;
    const double off[3] = {R[7] - R[5], R[2] - R[6], R[3] - R[1]};
    double q0 = square[0], q[3] = {off[0], off[1], off[2]};
    if (most > 0) {
        const int i = most - 1, j = (i + 1) % 3, k = (i + 2) % 3;
        q0 = off[i];
        q[i] = square[most];
        q[j] = R[3 * i + j] + R[3 * j + i];
        q[k] = R[3 * i + k] + R[3 * k + i];
    }
    if (q0 < 0.) { /* the same rotation the shorter way */
        q0 = -q0;
        for (int k = 0; k < 3; k++) q[k] = -q[k];
    }
    const double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    const double angle = 2. * atan2(size, q0);
    for (int k = 0; k < 3; k++) turn[k] = size > 0. ? angle * q[k] / size + 0. : 0.;
}

static void write_wall(FILE *f, const dem_sim *sim, size_t w)
{
    double force[3], torque[3], place[3], R[9], turn[3];
    dem_wall_force(sim, w, force);
    dem_wall_torque(sim, w, torque);
    fprintf(f, ",%.10g,%.10g,%.10g", force[0], force[1], force[2]);
    fprintf(f, ",%.10g,%.10g,%.10g", torque[0], torque[1], torque[2]);
    if (!dem_wall_moves(sim, w)) return;
    dem_wall_place(sim, w, place, R);
    rotation_vector(R, turn);
    fprintf(f, ",%.10g,%.10g,%.10g", place[0], place[1], place[2]);
    fprintf(f, ",%.10g,%.10g,%.10g", turn[0], turn[1], turn[2]);
}

int record_write(record *r, const dem_sim *sim)
{
    write_particles(r, sim);
    if (r->particles == NULL) return 0;
    int bad = fflush(r->particles) != 0;
    if (r->walls != NULL) {
        fprintf(r->walls, "%.12g", dem_time(sim));
        for (size_t w = 0; w < dem_walls(sim); w++) write_wall(r->walls, sim, w);
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
