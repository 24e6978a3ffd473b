/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * shares.c - what the time goes into, for the end of the log.
 *
 * The engine's parts are those of the rank that took longest for each in a step, so that on several
 * ranks waiting counts as exchange; in sum they can be a little more than the wall clock.
 */
#include "felmiDEM.h"

#include <mpi.h>

void shares_add(shares *s, const dem_report *report, double engine)
{
    s->force += report->seconds_force;
    s->neighbour += report->seconds_neighbour;
    s->exchange += report->seconds_exchange;
    s->other += report->seconds_other;
    s->engine += engine;
}

static void print_row(const char *name, double seconds, double all, const char *what)
{
    printf("    %-16s%10.1f s%8.1f %%  %s\n", name, seconds, all > 0. ? 100. * seconds / all : 0.,
           what);
}

void shares_print(const shares *s, double all, const dem_report *report)
{
    int ranks;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    printf("\nTime\n");
    print_row("forces", s->force, all, "contacts between particles and with walls");
    print_row("lists", s->neighbour, all, "who is near whom, walls that move, feeders");
    if (ranks > 1)
        print_row("exchange", s->exchange, all, "particles and ghosts between ranks, waiting");
    print_row("other", s->other, all, "motion, sums");
    print_row("output", s->output, all, "snapshots, restart files");
    if (ranks > 1)
        printf(
            "Divided %lld times among %d ranks; the busiest worked %.2f times the mean when last "
            "measured\n",
            (long long)report->divisions, ranks, report->imbalance);
}
