/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart.c - the restart files of a case, <case>/restart/<time>.h5: which one a run goes on from,
 * and which are of another run.
 *
 * Times are those of the names, as OpenFOAM has it with time directories. startFrom latestTime
 * takes the latest file; startFrom startTime takes the one of that time, so that a user can go back
 * to an older one. Without such a file the run begins anew. Files that are later than the start,
 * and all of them when a run begins anew, are another run's, or another future of this one. They
 * would be taken for its own at the next restart, so they are moved to <case>/restart.old, which
 * holds one such set: what was in there before is deleted.
 */
#include "case.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The number of a name "<number>.h5", NAN if it is none of that form. */
static double number_of(const char *name)
{
    char text[CASE_NAME], *end;
    const size_t length = strlen(name);
    if (length < 4 || length >= sizeof text || strcmp(name + length - 3, ".h5") != 0) return NAN;
    snprintf(text, sizeof text, "%.*s", (int)length - 3, name);
    const double number = strtod(text, &end);
    return *end == '\0' && isfinite(number) ? number : NAN;
}

double case_restart_latest(const char *directory, double most, char name[CASE_NAME])
{
    char path[4096];
    snprintf(path, sizeof path, "%s/restart", directory);
    double found = NAN;
    DIR *folder = opendir(path);
    for (struct dirent *e = folder ? readdir(folder) : NULL; e != NULL; e = readdir(folder)) {
        const double time = number_of(e->d_name);
        /* NAN is not a number of these: the macros compare it without a trap of OpenFOAM's. */
        if (!islessequal(time, most) || islessequal(time, found)) continue;
        found = time;
        snprintf(name, CASE_NAME, "%.*s", CASE_NAME - 1, e->d_name);
    }
    if (folder) closedir(folder);
    return found;
}

void case_find_restart(const char *directory, case_control *control)
{
    control->restart[0] = '\0';
    double most = INFINITY, least = -INFINITY;
    if (control->start_from == CASE_FIRST_TIME) return;
    if (control->start_from == CASE_START_TIME) {
        /* Names are as near to the time as that, see case_time_name. */
        const double apart = .01 * control->delta_t;
        most = control->start_time + apart;
        least = control->start_time - apart;
    }
    char name[CASE_NAME];
    const double time = case_restart_latest(directory, most, name);
    if (!isgreaterequal(time, least)) return;
    snprintf(control->restart, sizeof control->restart, "%s", name);
    control->start_time = time;
}

/* Delete what an earlier call has put into a directory. */
static void empty(const char *path)
{
    char file[4096 + 256];
    DIR *folder = opendir(path);
    for (struct dirent *e = folder ? readdir(folder) : NULL; e != NULL; e = readdir(folder)) {
        if (isnan(number_of(e->d_name))) continue;
        snprintf(file, sizeof file, "%s/%s", path, e->d_name);
        unlink(file);
    }
    if (folder) closedir(folder);
}

int case_set_restarts_aside(const char *directory, const case_control *control)
{
    char from[4096], to[4096], old[4096 + 256], new[4096 + 256], name[CASE_NAME];
    const double after = control->restart[0] ? number_of(control->restart) : -INFINITY;
    snprintf(from, sizeof from, "%s/restart", directory);
    snprintf(to, sizeof to, "%s/restart.old", directory);
    int moved = 0;
    for (;;) {
        const double time = case_restart_latest(directory, INFINITY, name);
        if (!isgreater(time, after)) return moved;
        if (moved == 0) {
            if (mkdir(to, 0777) != 0 && errno != EEXIST) return -1;
            empty(to);
        }
        snprintf(old, sizeof old, "%s/%s", from, name);
        snprintf(new, sizeof new, "%s/%s", to, name);
        if (rename(old, new) != 0) return -1;
        moved++;
    }
}
