/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * table.c - text files of time series that go on after a restart.
 *
 * A file is begun anew under another name; behind its head come the rows of the file that is there
 * up to the time of the restart; then it takes its place. So later rows, of a future that did not
 * come, are cut, a row that was cut short by the end of a run goes, and nothing else is lost,
 * whenever the program is killed. A file with another head (a patch has come or gone) cannot be
 * continued: it stays beside the new one, as <name>.before-<time>.
 */
#include "cpl.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PATH = 4096 };

/* mkdir -p of the folder that `path` is in */
static int make_folder(const char *path)
{
    char folder[PATH];
    snprintf(folder, sizeof folder, "%s", path);
    for (char *s = folder + 1; *s; s++) {
        if (*s != '/') continue;
        *s = '\0';
        if (mkdir(folder, 0777) != 0 && errno != EEXIST) return -1;
        *s = '/';
    }
    return 0;
}

/* Whether `old` begins with the head; it stands behind it then. */
static int same_head(const char *head, FILE *old)
{
    while (*head && getc(old) == (unsigned char)*head) head++;
    return *head == '\0';
}

/* Rows up to `from`; one without its end is not whole. */
static int copy_rows(FILE *file, FILE *old, double from)
{
    /* Rows have 12 digits of the time at least, and are farther apart than that. */
    const double last = from + 1e-9 * fabs(from);
    char *line = NULL;
    size_t room = 0;
    ssize_t length;
    while ((length = getline(&line, &room, old)) > 0)
        if (line[length - 1] == '\n' && strtod(line, NULL) <= last) fputs(line, file);
    free(line);
    return ferror(old) ? -1 : 0;
}

/* What there is behind the head of `file`, or out of its way. */
static int take_over(FILE *file, const char *path, const char *head, double from, char *message,
                     size_t size)
{
    char aside[PATH + 40];
    FILE *old = fopen(path, "r");
    if (!old) return errno == ENOENT ? 0 : -1;
    int failed;
    if (same_head(head, old)) {
        failed = copy_rows(file, old, from);
    } else {
        snprintf(aside, sizeof aside, "%s.before-%.12g", path, from);
        failed = rename(path, aside);
        if (!failed)
            snprintf(message, size, "its columns have changed: rows so far are in %s", aside);
    }
    fclose(old);
    return failed;
}

FILE *cpl_table_open(const char *path, const char *head, double from, char *message, size_t size)
{
    char part[PATH + 8];
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    if (size) message[0] = '\0';
    FILE *file = NULL;
    errno = ENAMETOOLONG;
    if (strlen(path) < PATH - 64 && make_folder(path) == 0) {
        snprintf(part, sizeof part, "%.*s.%s.part", (int)(name - path), path, name);
        file = fopen(part, "w");
    }
    int failed = !file || fputs(head, file) == EOF;
    if (!failed && !isnan(from)) failed = take_over(file, path, head, from, message, size);
    if (!failed) failed = fflush(file) != 0 || rename(part, path) != 0;
    if (!failed) return file;
    snprintf(message, size, "cannot write %s: %s", path, strerror(errno));
    if (file) fclose(file);
    return NULL;
}
