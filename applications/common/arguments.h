/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * arguments.h - the command line of the C programs: [-case <dir>] [-help] [-version].
 */
#ifndef FELMI_ARGUMENTS_H
#define FELMI_ARGUMENTS_H

/* The case directory, "." by default. NULL when there is nothing to do, because help or version
 * was asked for and printed (*status 0), or an argument is not known (*status 2). */
const char *arguments_read(int argc, char **argv, const char *program, const char *help,
                           int *status);

#endif
