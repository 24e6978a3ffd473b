/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * progress.h - lines of the log for long work before the first step: how far it is, and how long
 * it will take.
 */
#ifndef FELMI_PROGRESS_H
#define FELMI_PROGRESS_H

#include "dem.h"

typedef struct progress {
    char what[256];     /* the work under way */
    double began, said; /* wall clock, s */
    double done;        /* share that was said last */
} progress;

/* Have dem_new tell by `p`, which must live as long. */
void progress_follow(progress *p, dem_param *param);

#endif
