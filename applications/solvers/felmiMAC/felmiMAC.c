/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiMAC - particles in a fluid on a staggered grid, without OpenFOAM.
 *
 * Reads the case that felmiFoam reads, as far as its mesh is one box of equal cells, and writes
 * fields in the same format. Without constant/demProperties the fluid flows alone. The time step
 * is shortened so that output falls on whole steps; with adjustTimeStep it follows maxCo.
 *
 * A run with particles goes on from <case>/restart/<time>.h5 where startFrom finds one, to the last
 * bit as if it had not been interrupted, if the case has not been changed (restart.c).
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
#include "restart.h"
#include "restarts.h"
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
    "         constant/{demProperties,couplingProperties};\n"
    "         restart/<time>.h5 if startFrom finds one to go on from\n"
    "writes   <time>/{U,p,voidfraction,Us}, dem/<time>.h5 and dem/particles.xmf,\n"
    "         postProcessing/felmiMAC/solver.csv and postProcessing/ledger/ledger.csv;\n"
    "         restart/<time>.h5 with particles and fluid\n";

typedef struct run {
    mac_case c;
    int owned; /* the engine has taken the walls' shapes */
    mac_coupled coupled;
    progress progress; /* of sampling the walls */
    FILE *series;
    mac_clock clock;
    int ready;  /* to take steps */
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

/* Fluid and time as they begin, or as they were. */
static int start(run *r, const char *restart)
{
    const case_control *control = &r->c.control;
    mac_clock *clock = &r->clock;
    dem_sim *engine = r->coupled.particles ? phase_engine(r->coupled.particles) : NULL;
    *clock = (mac_clock){.time = control->start_time,
                         .dt = fmin(control->delta_t, control->max_delta_t),
                         .next_write = control->start_time + control->write_interval,
                         .interval = control->write_interval};
    if (restart) {
        if (mac_restart_read(&r->coupled, clock, restart, r->message, sizeof r->message)) return -1;
        if (!control->adjust_time_step) clock->dt = fmin(control->delta_t, control->max_delta_t);
        printf("\nGo on from restart/%s, time %.12g s\n", control->restart, clock->time);
    } else {
        mac_start(r->coupled.fluid, (const double(*)[3])r->c.U);
        /* Once: feeders keep to a schedule of their own from here on. */
        if (engine) dem_set_time(engine, clock->time);
    }
    return engine ? restarts_set_aside(PROGRAM, r->c.directory, control) : 0;
}

static int build(run *r)
{
    mac_case *c = &r->c;
    char ledger[4200], file[4200];
    const char *restart = c->control.restart[0] ? file : NULL;
    snprintf(ledger, sizeof ledger, "%s/postProcessing/ledger", c->directory);
    snprintf(file, sizeof file, "%s/restart/%s", c->directory, c->control.restart);
    r->owned = c->particles; /* phase_new hands the shapes to the engine */
    progress_follow(&r->progress, &c->dem.param);
    c->dem.param.restart = restart;
    if (mac_coupled_new(&r->coupled, &c->flow, c->particles ? &c->dem.param : NULL, &c->coupling,
                        ledger, r->message, sizeof r->message) ||
        start(r, restart))
        return -1;
    r->series = mac_series_open(c, restart ? r->clock.time : NAN, r->message, sizeof r->message);
    if (!r->series) return -1;
    if (r->message[0]) printf("postProcessing/felmiMAC/solver.csv: %s\n", r->message);
    r->message[0] = '\0';
    return 0;
}

/* ---- time ------------------------------------------------------------------------------------ */

/* The step to take now: the wanted one, shortened so that whole steps meet the next output. */
static double next_step(run *r)
{
    const case_control *control = &r->c.control;
    mac_clock *clock = &r->clock;
    if (control->adjust_time_step) {
        double convective, viscous;
        mac_limits(r->coupled.fluid, &convective, &viscous);
        /* growth by a fifth a step at most, as OpenFOAM's setDeltaT has it */
        clock->dt = fmin(fmin(1.2 * clock->dt, control->max_co * convective), viscous);
        clock->dt = fmin(clock->dt, control->max_delta_t);
    }
    double left = fmin(clock->next_write, control->end_time) - clock->time;
    return left / ceil(left / clock->dt * (1 - 1e-9));
}

/* Whether `time` has been reached, up to rounding of a sum of steps. */
static int reached(double time, double goal, double dt)
{
    return time > goal - 1e-6 * dt;
}

static int write_snapshot(run *r)
{
    char name[32], folder[4200];
    if (!r->coupled.particles) return 0;
    dem_sim *engine = phase_engine(r->coupled.particles);
    mac_time_name(&r->c, r->clock.time, name, sizeof name);
    snprintf(folder, sizeof folder, "%s/dem", r->c.directory);
    if (dem_write_snapshot(engine, folder, name) == DEM_OK) return 0;
    snprintf(r->message, sizeof r->message, "%s", dem_message(engine));
    return -1;
}

static int write(run *r)
{
    return mac_write_fields(&r->c, &r->coupled, r->clock.time, r->message, sizeof r->message)
               ? -1
               : write_snapshot(r);
}

/* Restart files are due at the first step that reaches a multiple of their interval, and at the
 * end; the steps do not ask for them. */
static int restart_is_due(const run *r, double before, double dt)
{
    const case_control *control = &r->c.control;
    const double interval = control->restart_interval, slack = 1e-6 * dt;
    return r->coupled.particles && control->restart_write &&
           (r->clock.time >= control->end_time ||
            floor((r->clock.time + slack) / interval) > floor((before + slack) / interval));
}

static int write_restart(run *r)
{
    const case_control *control = &r->c.control;
    char name[32], folder[4200];
    snprintf(folder, sizeof folder, "%s/restart", r->c.directory);
    case_time_name(control, r->clock.time, .01 * control->delta_t, name, sizeof name);
    return mac_restart_write(&r->coupled, &r->clock, folder, name, control->restart_keep,
                             r->message, sizeof r->message);
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
    mac_clock *clock = &r->clock;
    const double dt = next_step(r), before = clock->time;
    if (mac_coupled_step(&r->coupled, dt, r->message, sizeof r->message)) {
        blame_courant(r);
        return -1;
    }
    clock->time += dt;
    const int end = reached(clock->time, control->end_time, dt);
    const int due = reached(clock->time, clock->next_write, dt);
    if (due) clock->time = clock->next_write;
    if (end) clock->time = control->end_time;
    if (due) clock->next_write += clock->interval;
    mac_log_step(&r->c, &r->coupled, clock->time, dt, MPI_Wtime() - r->began);
    if (mac_series_write(r->series, &r->c, &r->coupled, clock->time, dt)) {
        snprintf(r->message, sizeof r->message, "solver.csv could not be written");
        return -1;
    }
    if (check_courant(r, dt) || ((due || end) && write(r))) return -1;
    return restart_is_due(r, before, dt) ? write_restart(r) : 0;
}

/* ---- the run --------------------------------------------------------------------------------- */

static void tell_failure(const run *r)
{
    const char *text = r->message;
    /* the ledger's messages begin with the time, a restart file's with its name */
    const int told = strncmp(text, "time ", 5) == 0 || strncmp(text, "restart file", 12) == 0;
    if (text[0] && told)
        message_stop(PROGRAM, "%s", text);
    else if (text[0])
        message_stop(PROGRAM, "time %g s: %s", r->clock.time, text);
    if (r->c.control.restart[0] && !r->ready)
        restarts_tell_older(PROGRAM, r->c.directory, &r->c.control);
}

/* All steps. Fields of the start are the user's own. */
static int steps(run *r)
{
    const double end = r->c.control.end_time;
    r->began = MPI_Wtime();
    int failed = r->c.control.restart[0] ? 0 : write_snapshot(r);
    if (r->clock.time >= end) {
        puts("endTime has been reached: nothing is left to do");
        return failed;
    }
    while (!failed && r->clock.time < end) failed = step(r);
    if (failed) return failed;
    const double seconds = MPI_Wtime() - r->began;
    mac_log_shares(&r->coupled, seconds);
    printf("\nEnd: %.1f s of wall clock\n", seconds);
    return 0;
}

static int solve(const char *directory)
{
    run r = {.ready = 0};
    int failed = read_case(&r, directory);
    if (!failed) {
        mac_log_case(&r.c);
        failed = build(&r);
    }
    if (!failed) {
        r.ready = 1;
        mac_log_limits(&r.c, &r.coupled, r.clock.dt);
        failed = steps(&r);
    }
    if (failed) tell_failure(&r);
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
        (void)message_first_rank_speaks(); /* where it fails all speak */
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
