/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiDEM - particles alone: drums, hoppers, mixers, packings, without a fluid.
 *
 * Reads the case that felmiFoam and felmiMAC read (system/controlDict, constant/demProperties,
 * constant/g). The domain is that of demProperties, or the box of blockMeshDict when there is
 * one. deltaT is the interval of the log and the time series; the engine divides it into equal
 * sub-steps of its own. deltaT is shortened so that output falls on whole steps (plan.c).
 *
 * On several ranks (mpirun) every rank reads the case; the first one decides what to go on from,
 * writes log and series, and moves files of earlier runs away. Where one rank fails, all stop.
 *
 * A run goes on from <case>/restart/<time>.h5 where startFrom finds one, to the last bit as if it
 * had not been interrupted, if the case has not been changed.
 *
 * References: as in dem.h.
 */
#include "felmiDEM.h"
#include "arguments.h"
#include "banner.h"
#include "message.h"
#include "progress.h"
#include "restarts.h"

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char PROGRAM[] = "felmiDEM";
static const char HELP[] =
    "felmiDEM: particles alone\n\n"
    "usage: felmiDEM [-case <dir>] [-help] [-version]\n"
    "       mpirun -np <ranks> felmiDEM [-case <dir>]\n\n"
    "  -case <dir>  directory of the case, default: the current one\n"
    "  -help        this text\n"
    "  -version     version number\n\n"
    "reads    system/controlDict, constant/demProperties, constant/g;\n"
    "         system/blockMeshDict if there is one, for the domain;\n"
    "         restart/<time>.h5 if startFrom finds one to go on from\n"
    "writes   dem/<time>.h5 and dem/particles.xmf (open it in ParaView),\n"
    "         postProcessing/particles.csv, wallForces.csv; with feeders or\n"
    "         outlets massBalance.csv; with balance energy.csv and\n"
    "         angularMomentum.csv;\n"
    "         restart/<time>.h5\n";

/* Everything of one run. */
typedef struct run {
    const char *directory;
    case_control control;
    case_dem dem;
    plan plan;
    dem_sim *sim;
    int owned; /* the simulation has the walls' shapes */
    record *record;
    books *books;
    progress progress;
    char snapshots[4096], restarts[4096];
    int rank, ranks;
    double began; /* wall clock, s */
    shares shares;
} run;

long long count_particles(const dem_sim *sim)
{
    long long n = (long long)dem_particles(sim).n;
    MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPI_LONG_LONG, MPI_SUM, MPI_COMM_WORLD);
    return n;
}

void sum_over_ranks(double *x, int n)
{
    MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
}

/* ---- reading --------------------------------------------------------------------------------- */

/* 0, or 1 with all that is wrong with the case on stderr. */
static int read_case(run *r)
{
    case_errors *errors = case_errors_new();
    const int meshed = case_file_exists(r->directory, "system/blockMeshDict") ||
                       case_file_exists(r->directory, "constant/polyMesh/blockMeshDict");
    case_mesh mesh;
    double gravity[3];
    case_read_run(r->directory, &r->control, errors);
    if (meshed) case_read_mesh(r->directory, &mesh, errors);
    case_read_gravity(r->directory, gravity, errors);
    case_dict *dict = case_read_file(r->directory, "constant/demProperties", errors);
    if (dict != NULL) {
        case_read_dem(dict, r->directory, meshed ? &mesh : NULL, gravity, &r->dem, errors);
        /* No fluid, so cells may be smaller than particles: the mesh is only a box here. */
        if (case_errors_count(errors) == 0) case_check(&r->control, NULL, &r->dem, NULL, errors);
    }
    const int bad = message_agree(message_case(PROGRAM, errors) > 0);
    if (bad && dict != NULL) case_dem_free(&r->dem, 1);
    case_dict_free(dict);
    case_errors_free(errors);
    /* Whatever the others have seen of the directories: one decides. */
    MPI_Bcast(&r->control, sizeof r->control, MPI_BYTE, 0, MPI_COMM_WORLD);
    return bad;
}

/* ---- output ---------------------------------------------------------------------------------- */

static void name_time(const run *r, char name[32])
{
    case_time_name(&r->control, dem_time(r->sim), .01 * r->plan.delta_t, name, 32);
}

/* As all that asks the engine, the same on every rank. */
static int told(run *r, dem_status status)
{
    if (status != DEM_OK) message_stop(PROGRAM, "%s", dem_message(r->sim));
    return status != DEM_OK;
}

static int write_snapshot(run *r)
{
    char name[32];
    const double begin = MPI_Wtime();
    name_time(r, name);
    const int failed = told(r, dem_write_snapshot(r->sim, r->snapshots, name));
    r->shares.output += MPI_Wtime() - begin;
    return failed;
}

static int write_restart(run *r)
{
    char name[32];
    const double begin = MPI_Wtime();
    name_time(r, name);
    const int keep = r->control.restart_keep;
    const int failed = told(r, dem_write_restart(r->sim, r->restarts, name, keep));
    r->shares.output += MPI_Wtime() - begin;
    return failed;
}

/* What has come and gone since the start, where anything can. */
static void print_traffic(const dem_sim *sim)
{
    int64_t fed = 0, removed = 0, number;
    double mass, waiting, owed = 0.;
    for (size_t i = 0; i < dem_feeders(sim); i++) {
        dem_fed(sim, i, &number, &mass, &waiting);
        fed += number;
        owed += waiting;
    }
    for (size_t i = 0; i < dem_outlets(sim); i++) {
        dem_removed(sim, i, &number, &mass);
        removed += number;
    }
    if (dem_feeders(sim) > 0) printf("  fed %lld", (long long)fed);
    if (owed > 0.) printf(" (%.3g kg wait)", owed);
    if (dem_outlets(sim) > 0) printf("  removed %lld", (long long)removed);
}

static void print_step(const run *r, long step, double seconds)
{
    const dem_report report = dem_last_report(r->sim);
    const double elapsed = MPI_Wtime() - r->began;
    const long done = step - r->plan.first;
    const long left = lrint(elapsed / (double)done * (double)(r->plan.steps - step));
    printf("Time = %.*g s  particles %lld", r->control.time_precision + 2, dem_time(r->sim),
           (long long)report.particles);
    print_traffic(r->sim);
    printf("  substeps %d  contacts %lld + %lld wall  overlap %.2g%%  Ekin %.4g J  "
           "[dem %.3g ms",
           report.substeps, (long long)report.contacts, (long long)report.wall_contacts,
           100. * report.overlap, report.kinetic_energy, 1e3 * seconds);
    if (r->ranks > 1)
        printf(", exchange %.0f%%, imbalance %.2f", 100. * report.seconds_exchange / seconds,
               report.imbalance);
    printf("]  left %ld:%02ld:%02ld\n", left / 3600, left / 60 % 60, left % 60);
    fflush(stdout);
}

/* ---- the run --------------------------------------------------------------------------------- */

static int make_engine(run *r)
{
    char path[sizeof r->restarts + CASE_NAME];
    const int again = r->control.restart[0] != '\0';
    snprintf(path, sizeof path, "%s/%s", r->restarts, r->control.restart);
    r->dem.param.restart = again ? path : NULL;
    progress_follow(&r->progress, &r->dem.param);
    if (dem_new(MPI_COMM_WORLD, &r->dem.param, &r->sim) != DEM_OK) {
        message_stop(PROGRAM, "%s", r->sim ? dem_message(r->sim) : "out of memory");
        if (again) restarts_tell_older(PROGRAM, r->directory, &r->control);
        return 1;
    }
    r->owned = 1;
    const long long particles = count_particles(r->sim);
    if (*dem_message(r->sim) != '\0') printf("\n%s\n", dem_message(r->sim));
    if (!again) dem_set_time(r->sim, r->control.start_time);
    if (again)
        printf("\nGo on from restart/%s, time %.12g s, with %lld particles\n", r->control.restart,
               dem_time(r->sim), particles);
    else
        printf("\nCreated %lld particles\n", particles);
    return 0;
}

static int start(run *r)
{
    const int again = r->control.restart[0] != '\0';
    snprintf(r->snapshots, sizeof r->snapshots, "%s/dem", r->directory);
    snprintf(r->restarts, sizeof r->restarts, "%s/restart", r->directory);
    start_case(&r->dem, &r->control);
    if (make_engine(r) != 0) return 1;
    int failed = r->rank == 0 && restarts_set_aside(PROGRAM, r->directory, &r->control) != 0;
    if (message_agree(failed)) return 1;
    const double now = dem_time(r->sim);
    double origin = now;
    if (again) dem_kept(r->sim, "timeOrigin", 1, &origin);
    if (now >= r->control.end_time) {
        puts("endTime has been reached: nothing is left to do");
        return 0;
    }
    r->plan = plan_of(&r->control, origin, now);
    dem_keep(r->sim, "timeOrigin", 1, &r->plan.origin);
    start_time_step(&r->dem, r->sim, r->plan.delta_t);
    r->record = record_new(r->directory, r->sim, r->dem.param.gravity, again ? now : NAN);
    if (message_agree(r->record == NULL)) return 1;
    r->books = books_new(r->directory, r->sim, r->dem.param.balance, again ? now : NAN);
    if (message_agree(r->books == NULL)) return 1;
    return write_snapshot(r);
}

static int advance(run *r, long step)
{
    const plan *p = &r->plan;
    const double before = MPI_Wtime(), time = plan_time(p, step);
    if (dem_advance(r->sim, time - dem_time(r->sim), 0) != DEM_OK) {
        message_stop(PROGRAM, "at time %.9g s: %s", dem_time(r->sim), dem_message(r->sim));
        return 1;
    }
    dem_set_time(r->sim, time); /* no rounding adds up */
    const double seconds = MPI_Wtime() - before;
    const dem_report report = dem_last_report(r->sim);
    shares_add(&r->shares, &report, seconds);
    print_step(r, step, seconds);
    const int recorded = record_write(r->record, r->sim), booked = books_write(r->books, r->sim);
    if (message_agree(recorded != 0 || booked != 0)) return 1;
    const int last = step == p->steps;
    if ((step % p->per_output == 0 || last) && write_snapshot(r) != 0) return 1;
    const int restart = p->per_restart > 0 && (step % p->per_restart == 0 || last);
    return restart ? write_restart(r) : 0;
}

static int solve(run *r)
{
    int failed = read_case(r);
    if (failed) return failed;
    failed = start(r);
    r->began = MPI_Wtime();
    for (long step = r->plan.first + 1; step <= r->plan.steps && !failed; step++)
        failed = advance(r, step);
    const double all = MPI_Wtime() - r->began;
    if (!failed && r->plan.steps > r->plan.first) {
        const dem_report report = dem_last_report(r->sim);
        shares_print(&r->shares, all, &report);
    }
    if (!failed) printf("\nEnd: %.1f s of wall clock\n", all);
    record_free(r->record);
    books_free(r->books);
    case_dem_free(&r->dem, !r->owned);
    dem_free(r->sim);
    return failed;
}

int main(int argc, char **argv)
{
    run r = {.directory = NULL};
    int status = 1;
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &r.rank);
    MPI_Comm_size(MPI_COMM_WORLD, &r.ranks);
    if (message_agree(message_first_rank_speaks() != 0) == 0) {
        r.directory = arguments_read(argc, argv, PROGRAM, HELP, &status);
        if (r.directory != NULL) {
            banner_program(PROGRAM, r.directory);
            status = solve(&r);
        }
    }
    MPI_Finalize();
    return status;
}
