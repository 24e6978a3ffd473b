/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restarts.h - what programs that go on from restart files do alike with those of a case.
 */
#ifndef FELMI_RESTARTS_H
#define FELMI_RESTARTS_H

#include "case.h"

/* Move files that the next restart must not take for those of this run, and say so. 0, or 1 with the
 * reason on stderr. */
int restarts_set_aside(const char *program, const char *directory, const case_control *control);
/* On stderr: what a user can do about the file control->restart that is refused. */
void restarts_tell_older(const char *program, const char *directory, const case_control *control);

#endif
