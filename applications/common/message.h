/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * message.h - what a program says on stderr when it stops.
 *
 * The log is flushed before, so that in a file that holds both the message stands where it belongs.
 */
#ifndef FELMI_MESSAGE_H
#define FELMI_MESSAGE_H

#include "case.h"

/* "<program>: <text>" and a newline. */
void message_stop(const char *program, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Notes of a case in the log, its errors on stderr: number of errors. */
int message_case(const char *program, const case_errors *errors);

#endif
