/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * banner.c - prints the head of a log, so that a run can be told and judged by its log alone.
 */
#include "banner.h"

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "case.h"

void banner_line(void)
{
    puts("// * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * //");
}

void banner_program(const char *program, const char *directory)
{
    static const char *const rule =
        "---------------------------------------------------------------------------";
    char host[256] = "unknown", date[64] = "", title[128];
    const time_t now = time(NULL);
    struct tm local;
    gethostname(host, sizeof host - 1);
    if (localtime_r(&now, &local)) strftime(date, sizeof date, "%b %d %Y %H:%M:%S", &local);
    char *folder = realpath(directory, NULL);
    int ranks;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    snprintf(title, sizeof title,
             "felmiFoam %-10s particles in fluids: FELMI, component by component", case_version());
    printf("/*%s*\\\n|  %-73.73s  |\n\\*%s*/\n"
           "Exec   : %s\nDate   : %s\nHost   : %s\nPID    : %ld\nCase   : %s\nnProcs : %d\n",
           rule, title, rule, program, date, host, (long)getpid(), folder ? folder : directory,
           ranks);
    free(folder);
    banner_line();
}

void banner_limit(const char *name, double value, const char *what)
{
    if (isfinite(value) && value > 0.)
        printf("    %-16s%12.4g s  %s\n", name, value, what);
    else
        printf("    %-16s%12s    %s\n", name, "-", what);
}
