/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * progress.c - says now and then how far long work is. Work that is done before the first line is
 * due is not spoken of.
 */
#include "progress.h"

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <string.h>

/* Between lines: 2 s at least, and 5 per cent of the work or half a minute. */
static const double shortest = 2, share = .05, silence = 30;

static void tell(void *context, const char *what, double done)
{
    progress *p = context;
    const double now = MPI_Wtime();
    if (strncmp(p->what, what, sizeof p->what - 1) != 0) {
        snprintf(p->what, sizeof p->what, "%s", what);
        p->began = p->said = now;
        p->done = 0;
    }
    const int spoken = p->said > p->began;
    const double since = now - p->said;
    const int due = since >= silence || (since >= shortest && done >= p->done + share);
    if (done >= 1) {
        if (spoken) printf("    %-40s 100 %%  %.1f s\n", p->what, now - p->began);
        *p->what = '\0';
    } else if (due && done > 0) {
        const long left = lrint((now - p->began) * (1 - done) / done);
        printf("    %-40s %3.0f %%  left %ld:%02ld:%02ld\n", p->what, floor(100 * done),
               left / 3600, left / 60 % 60, left % 60);
        p->said = now;
        p->done = done;
    }
    fflush(stdout);
}

void progress_follow(progress *p, dem_param *param)
{
    *p = (progress){.what = ""};
    param->progress = tell;
    param->progress_context = p;
}
