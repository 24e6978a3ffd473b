/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiMAC - particles in a fluid on a staggered grid, without OpenFOAM.
 *
 * Reads the case that felmiFoam reads, as far as its mesh is one box of equal cells, and writes
 * fields in the same format. Without constant/demProperties the fluid flows alone. The time step
 * is shortened so that output falls on whole steps; with adjustTimeStep it follows maxCo.
 *
 * References: as in mac.h and phase.h.
 */
#include "arguments.h"
#include "banner.h"
#include "coupling.h"
#include "fields.h"
#include "log.h"
#include "message.h"
#include "progress.h"
#include "settings.h"

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char PROGRAM[] = "felmiMAC";
static const char HELP[] =
    "felmiMAC: particles in a fluid on a staggered grid\n\n"
    "usage: felmiMAC [-case <dir>] [-help] [-version]\n\n"
    "  -case <dir>  directory of the case, default: the current one\n"
    "  -help        this text\n"
    "  -version     version number\n\n"
    "reads    system/{blockMeshDict,controlDict,fvSolution}, 0/{U,p},\n"
    "         constant/{transportProperties,g}, and for particles\n"
    "         constant/{demProperties,couplingProperties}\n"
    "writes   <time>/{U,p,voidfraction,Us}, dem/<time>.h5 and dem/particles.xmf,\n"
    "         postProcessing/felmiMAC/solver.csv and postProcessing/ledger/ledger.csv\n";

typedef struct run {
    mac_case c;
    int owned; /* the engine has taken the walls' shapes */
    mac_coupled coupled;
    progress progress; /* of sampling the walls */
    FILE *series;
    double time, dt, next_write;
    int warned; /* of a Courant number above 1 */
    double began;
    char message[1024];
} run;

/* ---- reading and building -------------------------------------------------------------------- */

static int read_case(run *r, const char *directory)
{
    case_errors *errors = case_errors_new();
    mac_case_read(directory, &r->c, errors);
    const int count = message_case(PROGRAM, errors);
    case_errors_free(errors);
    return count ? -1 : 0;
}

static int build(run *r)
{
    mac_case *c = &r->c;
    char ledger[4200];
    snprintf(ledger, sizeof ledger, "%s/postProcessing/ledger", c->directory);
    r->owned = c->particles; /* phase_new hands the shapes to the engine */
    progress_follow(&r->progress, &c->dem.param);
    if (mac_coupled_new(&r->coupled, &c->flow, c->particles ? &c->dem.param : NULL, &c->coupling,
                        ledger, r->message, sizeof r->message))
        return -1;
    mac_start(r->coupled.fluid, (const double(*)[3])c->U);
    r->time = c->control.start_time;
    /* Once: feeders keep to a schedule of their own from here on. */
    if (c->particles) dem_set_time(phase_engine(r->coupled.particles), r->time);
    r->dt = fmin(c->control.delta_t, c->control.max_delta_t);
    r->next_write = r->time + c->control.write_interval;
    r->series = mac_series_open(c, r->message, sizeof r->message);
    return r->series ? 0 : -1;
}

/* ---- time ------------------------------------------------------------------------------------ */

/* The step to take now: the wanted one, shortened so that whole steps meet the next output. */
static double next_step(run *r)
{
    const case_control *control = &r->c.control;
    if (control->adjust_time_step) {
        double convective, viscous;
        mac_limits(r->coupled.fluid, &convective, &viscous);
        /* growth by a fifth a step at most, as OpenFOAM's setDeltaT has it */
        r->dt = fmin(fmin(1.2 * r->dt, control->max_co * convective), viscous);
        r->dt = fmin(r->dt, control->max_delta_t);
    }
    double left = fmin(r->next_write, control->end_time) - r->time;
    return left / ceil(left / r->dt * (1 - 1e-9));
}

/* Whether `time` has been reached, up to rounding of a sum of steps. */
static int reached(double time, double goal, double dt)
{
    return time > goal - 1e-6 * dt;
}

static int write(run *r)
{
    char name[32];
    mac_time_name(&r->c, r->time, name, sizeof name);
    if (r->time > r->c.control.start_time && /* the start's files are the user's own */
        mac_write_fields(&r->c, &r->coupled, r->time, r->message, sizeof r->message))
        return -1;
    if (!r->coupled.particles) return 0;
    dem_sim *engine = phase_engine(r->coupled.particles);
    char folder[4200];
    snprintf(folder, sizeof folder, "%s/dem", r->c.directory);
    if (dem_write_snapshot(engine, folder, name) == DEM_OK) return 0;
    snprintf(r->message, sizeof r->message, "%s", dem_message(engine));
    return -1;
}

/* Convection is explicit. A little above Courant number 1 implicit drag and upwind differences may
 * still damp what grows. At 50 a disturbance grows a hundredfold in a step (explicit upwind: by
 * 2 Co - 1), so what is computed is no flow and will not become one. */
#define HOPELESS_COURANT 50

static int check_courant(run *r, double dt)
{
    const double courant = r->coupled.fluid->report.courant;
    if (!(courant <= HOPELESS_COURANT)) {
        snprintf(r->message, sizeof r->message,
                 "the Courant number has grown to %g with a step of %g s: convection is explicit, "
                 "stable up to 1, and beyond %d the velocities are those of an instability; "
                 "accepted: a smaller deltaT, or adjustTimeStep yes with maxCo",
                 courant, dt, HOPELESS_COURANT);
        return -1;
    }
    if (r->warned || courant <= 1) return 0;
    r->warned = 1;
    printf("Warning: the Courant number is %g; explicit convection is stable up to 1. A smaller "
           "deltaT, or adjustTimeStep yes with maxCo, is safer.\n",
           courant);
    return 0;
}

/* A step that fails after one with a Courant number above 1 has most likely failed because of it.
 */
static void blame_courant(run *r)
{
    const double courant = r->coupled.fluid->report.courant;
    const size_t used = strlen(r->message);
    if (courant > 1)
        snprintf(r->message + used, sizeof r->message - used,
                 "; the last Courant number was %g, and explicit convection is stable up to 1",
                 courant);
}

static int step(run *r)
{
    const case_control *control = &r->c.control;
    double dt = next_step(r);
    if (mac_coupled_step(&r->coupled, dt, r->message, sizeof r->message)) {
        blame_courant(r);
        return -1;
    }
    r->time += dt;
    int end = reached(r->time, control->end_time, dt);
    int output = end || reached(r->time, r->next_write, dt);
    if (output) r->time = end ? control->end_time : r->next_write;
    mac_log_step(&r->c, &r->coupled, r->time, dt, MPI_Wtime() - r->began);
    if (mac_series_write(r->series, &r->c, &r->coupled, r->time, dt)) {
        snprintf(r->message, sizeof r->message, "solver.csv could not be written");
        return -1;
    }
    if (check_courant(r, dt)) return -1;
    if (!output) return 0;
    r->next_write += control->write_interval;
    return write(r);
}

/* ---- the run --------------------------------------------------------------------------------- */

static int solve(const char *directory)
{
    run r = {.time = 0};
    int failed = read_case(&r, directory);
    if (!failed) {
        mac_log_case(&r.c);
        failed = build(&r);
    }
    if (!failed) {
        mac_log_limits(&r.c, &r.coupled, r.dt);
        r.began = MPI_Wtime();
        failed = write(&r);
    }
    while (!failed && r.time < r.c.control.end_time) failed = step(&r);
    /* the ledger's messages begin with the time */
    if (failed && r.message[0] && strncmp(r.message, "time ", 5) == 0)
        message_stop(PROGRAM, "%s", r.message);
    else if (failed && r.message[0])
        message_stop(PROGRAM, "time %g s: %s", r.time, r.message);
    if (!failed) printf("\nEnd: %.1f s of wall clock\n", MPI_Wtime() - r.began);
    if (r.series) fclose(r.series);
    mac_coupled_free(&r.coupled);
    mac_case_free(&r.c, !r.owned);
    return failed ? 1 : 0;
}

int main(int argc, char **argv)
{
    int status = 0, ranks;
    const char *directory = arguments_read(argc, argv, PROGRAM, HELP, &status);
    if (!directory) return status;
    MPI_Init(&argc, &argv);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (ranks > 1) {
        message_stop(PROGRAM, "runs on one rank for now, not on %d: start it without mpirun",
                     ranks);
        status = 1;
    } else {
        banner_program(PROGRAM, directory);
        status = solve(directory);
    }
    MPI_Finalize();
    return status;
}
