/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * books.c - what came, what went and what is left, in <case>/postProcessing.
 *
 *     massBalance.csv       with feeders or outlets: number, mass and waiting mass of each feeder,
 *                           number and mass of each outlet, since the start; number and mass in the
 *                           domain; residual = in the domain - at the start - fed + removed
 *     energy.csv            with balance: the terms of dem_energy
 *     angularMomentum.csv   with balance: of the particles about the origin, and what walls,
 *                           gravity and outside force gave since the row before
 *
 * The sums over particles are compensated (tally.h), so that the residual of the mass shows what is
 * missing and not how many there are.
 */
#include "felmiDEM.h"
#include "message.h"
#include "tally.h"

#include <errno.h>
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct books {
    FILE *mass, *energy, *angular; /* on the first rank */
    int has_mass;                  /* something comes or goes */
    double mass_at_start;          /* kg */
};

static double mass_in_domain(const dem_sim *sim)
{
    const dem_view view = dem_particles(sim);
    tally sum = {0};
    for (size_t i = 0; i < view.n; i++) tally_add(&sum, view.mass[i]);
    double both[2] = {sum.sum, sum.lost};
    sum_over_ranks(both, 2);
    return both[0] + both[1];
}

/* ---- headers --------------------------------------------------------------------------------- */

static void head_mass(FILE *f, const dem_sim *sim)
{
    fputs("# s", f);
    for (size_t i = 0; i < dem_feeders(sim); i++) fputs(",-,kg,kg", f);
    for (size_t i = 0; i < dem_outlets(sim); i++) fputs(",-,kg", f);
    fputs(",-,kg,kg\ntime", f);
    for (size_t i = 0; i < dem_feeders(sim); i++) {
        const char *name = dem_feeder_name(sim, i);
        fprintf(f, ",%s.number,%s.mass,%s.waiting", name, name, name);
    }
    for (size_t i = 0; i < dem_outlets(sim); i++) {
        const char *name = dem_outlet_name(sim, i);
        fprintf(f, ",%s.number,%s.mass", name, name);
    }
    fputs(",domain.number,domain.mass,residual\n", f);
}

static const char ENERGY[] = "# s,J,J,J,J,J,J,J,J,J,J,J\n"
                             "time,kinetic,rotational,elastic,gravity,outside,walls,damping,"
                             "sliding,rolling,supply,residual\n";
static const char ANGULAR[] =
    "# s and kg m2/s\n"
    "time,particles.x,particles.y,particles.z,walls.x,walls.y,walls.z,gravity.x,gravity.y,"
    "gravity.z,outside.x,outside.y,outside.z\n";

books *books_new(const char *directory, dem_sim *sim, int balance, double from)
{
    const int mass = dem_feeders(sim) + dem_outlets(sim) > 0;
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    /* The start is that of the first run: a restart file brings its mass along. */
    double start;
    dem_status kept = DEM_OK;
    if (dem_kept(sim, "massAtStart", 1, &start) == 0) {
        start = mass_in_domain(sim);
        kept = dem_keep(sim, "massAtStart", 1, &start);
    }
    books *b = calloc(1, sizeof *b);
    if (b == NULL || kept != DEM_OK) {
        message_stop("felmiDEM", "out of memory");
        free(b);
        return NULL;
    }
    b->has_mass = mass;
    b->mass_at_start = start;
    if (rank > 0) return b;
    if (mass) {
        char *head = head_of(head_mass, sim);
        if (head != NULL) b->mass = series_open(directory, "massBalance.csv", head, from);
        free(head);
    }
    if (balance) b->energy = series_open(directory, "energy.csv", ENERGY, from);
    if (balance) b->angular = series_open(directory, "angularMomentum.csv", ANGULAR, from);
    if ((mass && b->mass == NULL) || (balance && (b->energy == NULL || b->angular == NULL))) {
        books_free(b);
        return NULL;
    }
    return b;
}

/* ---- rows ------------------------------------------------------------------------------------ */

static void write_mass(books *b, const dem_sim *sim, double present)
{
    double fed = 0., removed = 0.;
    fprintf(b->mass, "%.12g", dem_time(sim));
    for (size_t i = 0; i < dem_feeders(sim); i++) {
        int64_t number;
        double mass, waiting;
        dem_fed(sim, i, &number, &mass, &waiting);
        fprintf(b->mass, ",%lld,%.15g,%.9g", (long long)number, mass, waiting);
        fed += mass;
    }
    for (size_t i = 0; i < dem_outlets(sim); i++) {
        int64_t number;
        double mass;
        dem_removed(sim, i, &number, &mass);
        fprintf(b->mass, ",%lld,%.15g", (long long)number, mass);
        removed += mass;
    }
    fprintf(b->mass, ",%lld,%.15g,%.3g\n", (long long)dem_last_report(sim).particles, present,
            (present - b->mass_at_start) - (fed - removed));
}

static void write_vector(FILE *f, const double v[3])
{
    fprintf(f, ",%.12g,%.12g,%.12g", v[0], v[1], v[2]);
}

static void write_balance(books *b, const dem_sim *sim)
{
    const dem_report r = dem_last_report(sim);
    const dem_energy *e = &r.energy;
    const double terms[] = {e->kinetic, e->rotational, e->elastic, e->gravity, e->outside, e->walls,
                            e->damping, e->sliding,    e->rolling, e->supply,  e->residual};
    fprintf(b->energy, "%.12g", dem_time(sim));
    for (size_t i = 0; i < sizeof terms / sizeof *terms; i++)
        fprintf(b->energy, ",%.12g", terms[i]);
    fputs("\n", b->energy);
    fprintf(b->angular, "%.12g", dem_time(sim));
    write_vector(b->angular, r.angular_momentum);
    write_vector(b->angular, r.wall_angular);
    write_vector(b->angular, r.gravity_angular);
    write_vector(b->angular, r.outside_angular);
    fputs("\n", b->angular);
}

int books_write(books *b, const dem_sim *sim)
{
    int bad = 0;
    const double present = b->has_mass ? mass_in_domain(sim) : 0.;
    if (b->mass != NULL) {
        write_mass(b, sim, present);
        bad |= fflush(b->mass) != 0;
    }
    if (b->energy != NULL) {
        write_balance(b, sim);
        bad |= fflush(b->energy) != 0 || fflush(b->angular) != 0;
    }
    if (bad) message_stop("felmiDEM", "cannot write postProcessing: %s", strerror(errno));
    return bad ? -1 : 0;
}

void books_free(books *b)
{
    if (b == NULL) return;
    if (b->mass != NULL) fclose(b->mass);
    if (b->energy != NULL) fclose(b->energy);
    if (b->angular != NULL) fclose(b->angular);
    free(b);
}
