/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * message.c - messages on stderr, after what the log has to say.
 */
#include "message.h"

#include <stdarg.h>
#include <stdio.h>

void message_stop(const char *program, const char *format, ...)
{
    va_list values;
    fflush(stdout);
    fprintf(stderr, "%s: ", program);
    va_start(values, format);
    vfprintf(stderr, format, values);
    va_end(values);
    fputc('\n', stderr);
}

int message_case(const char *program, const case_errors *errors)
{
    const int count = case_errors_count(errors);
    fputs(case_notes_text(errors), stdout);
    if (count == 0) return 0;
    message_stop(program, "%d error%s in the case:", count, count == 1 ? "" : "s");
    fputs(case_errors_text(errors), stderr);
    return count;
}
