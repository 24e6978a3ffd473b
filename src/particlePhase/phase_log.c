/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phase_log.c - the line of the log that a coupled step leaves, and the table of all of them.
 *
 * One line a step, columns of fixed width so that a run can be watched and grepped:
 *
 *     Time = 0.0125 s  eps 0.381..1  Co 0.31  contacts 51234  overlap 0.40%  K dt/rho 12.3  ...
 */
#include "state.h"

#include <math.h>
#include <stdio.h>

/* h:mm:ss, or what stands for an unknown time. */
static void clock_text(double seconds, char *text, size_t size)
{
    if (!(seconds >= 0 && seconds < 3.6e8)) {
        snprintf(text, size, "-:--:--");
        return;
    }
    const long s = lround(seconds);
    snprintf(text, size, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
}

int phase_log(const phase *ph, char *line, size_t size, double time, double end_time,
              double courant, double seconds_fluid, double seconds_elapsed, double start_time)
{
    const phase_report r = phase_last_report(ph);
    char left[32], exchange[32] = "";
    int ranks;
    clock_text(seconds_elapsed * (end_time - time) / (time - start_time), left, sizeof left);
    MPI_Comm_size(ph->comm, &ranks);
    if (ranks > 1) snprintf(exchange, sizeof exchange, "exchange %.1f ", 1e3 * r.seconds_exchange);
    return snprintf(line, size,
                    "Time = %-9.6g s  eps %.3f..%.3f  Co %-5.3g  contacts %-7lld  overlap %5.2f%%  "
                    "K dt/rho %-8.3g  ledger %.0e  [dem %.1f map %.1f %sdrag %.1f fluid %.1f ms]  "
                    "left %s",
                    time, r.map.eps_min, r.map.eps_max, courant,
                    (long long)(r.dem.contacts + r.dem.wall_contacts), 100 * r.dem.overlap,
                    r.stiffness, r.ledger_residual, 1e3 * r.seconds_dem, 1e3 * r.seconds_map,
                    exchange, 1e3 * r.seconds_drag, 1e3 * seconds_fluid, left);
}

int phase_shares(const phase *ph, char *text, size_t size, double seconds_fluid, double seconds_all)
{
    static const char *const name[] = {"DEM", "map", "exchange", "forces", "fluid", "other", "all"};
    enum { FLUID = PHASE_PARTS, OTHER, ALL, ROWS };
    double mine[ROWS], mean[ROWS];
    int ranks, used = 0;
    for (int k = 0; k < PHASE_PARTS; k++) mine[k] = ph->seconds[k];
    mine[FLUID] = seconds_fluid;
    mine[ALL] = mine[OTHER] = seconds_all;
    for (int k = 0; k < OTHER; k++) mine[OTHER] -= mine[k];
    MPI_Comm_size(ph->comm, &ranks);
    MPI_Allreduce(mine, mean, ROWS, MPI_DOUBLE, MPI_SUM, ph->comm);
    for (int k = -1; k < ROWS; k++) {
        char *at = text + ((size_t)used < size ? (size_t)used : size);
        const size_t room = (size_t)used < size ? size - (size_t)used : 0;
        used += k < 0 ? snprintf(at, room, "%-12s%12s%8s\n", "Time", "s", "%")
                      : snprintf(at, room, "    %-8s%12.2f%8.1f\n", name[k], mean[k] / ranks,
                                 mean[ALL] > 0 ? 100 * mean[k] / mean[ALL] : 0);
    }
    return used;
}
