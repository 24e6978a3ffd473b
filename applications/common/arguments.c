/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * arguments.c - reads the command line in OpenFOAM's manner; two dashes will do as well.
 */
#include "arguments.h"
#include "message.h"

#include <stdio.h>
#include <string.h>

#include "case.h"

const char *arguments_read(int argc, char **argv, const char *program, const char *help,
                           int *status)
{
    const char *directory = ".";
    for (int i = 1; i < argc; i++) {
        const char *argument = argv[i] + (strncmp(argv[i], "--", 2) == 0);
        const int asked = strcmp(argument, "-help") == 0 || strcmp(argument, "-h") == 0;
        *status = 0;
        if (asked || strcmp(argument, "-version") == 0) {
            fputs(asked ? help : case_version(), stdout);
            if (!asked) puts("");
            return NULL;
        }
        if (strcmp(argument, "-case") != 0 || i + 1 == argc) {
            fprintf(message_stream(), "%s: %s '%s'\n\n%s", program,
                    strcmp(argument, "-case") == 0 ? "a directory must follow" : "unknown argument",
                    argv[i], help);
            *status = 2;
            return NULL;
        }
        directory = argv[++i];
    }
    return directory;
}
