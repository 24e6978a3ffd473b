/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restarts.c - restart files of another run, and what to do about one that is no good.
 */
#include "restarts.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "message.h"

int restarts_set_aside(const char *program, const char *directory, const case_control *control)
{
    const int moved = case_set_restarts_aside(directory, control);
    if (moved < 0)
        message_stop(program,
                     "cannot move restart files of an earlier run from %s/restart to restart.old: "
                     "%s",
                     directory, strerror(errno));
    else if (moved > 0)
        printf("Moved %d restart file%s of an earlier run to restart.old\n", moved,
               moved == 1 ? "" : "s");
    return moved < 0;
}

void restarts_tell_older(const char *program, const char *directory, const case_control *control)
{
    char name[CASE_NAME];
    const double before = nextafter(control->start_time, -INFINITY);
    const double time = case_restart_latest(directory, before, name);
    if (isnan(time))
        message_stop(program, "there is no older restart file; 'startFrom startTime' begins anew");
    else
        message_stop(program,
                     "to go on from restart/%s instead: 'startFrom startTime; startTime %.12g;'",
                     name, time);
}
