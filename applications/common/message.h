/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * message.h - what a program says on stderr when it stops.
 *
 * The log is flushed before, so that in a file that holds both the message stands where it belongs.
 *
 * On several ranks the first one speaks. The log of the others goes nowhere, and their messages are
 * put by: most often all ranks have the same to say, and where not, message_agree() has the first
 * that has failed heard.
 */
#ifndef FELMI_MESSAGE_H
#define FELMI_MESSAGE_H

#include "case.h"

#include <stdio.h>

/* "<program>: <text>" and a newline. */
void message_stop(const char *program, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Notes of a case in the log, its errors on stderr: number of errors. */
int message_case(const char *program, const case_errors *errors);

/* Where messages go: stderr, or aside. */
FILE *message_stream(void);

/* After MPI_Init, for programs that run on several ranks. 0, or -1 when out of memory. */
int message_first_rank_speaks(void);
/* Collective. Nonzero on all ranks if any has failed; the first of them is heard. */
int message_agree(int failed);

#endif
