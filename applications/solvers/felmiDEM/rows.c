/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * rows.c - files of time series that go on after a restart.
 *
 * A file is begun anew under another name; behind its head come the rows of the file that is there
 * up to the time of the restart; then it takes its place. So later rows, of a future that did not
 * come, are cut, a row that was cut short by the end of a run goes, and nothing else is lost,
 * whenever the program is killed. A file with another head (a wall has come or gone) cannot be
 * continued: it stays beside the new one, as <name>.before-<time>.
 */
#include "felmiDEM.h"
#include "message.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PATH = 4096 };

static const char PROGRAM[] = "felmiDEM";

static void path_of(const char *directory, const char *name, const char *before, const char *after,
                    char path[PATH])
{
    snprintf(path, PATH, "%s/postProcessing/%s%s%s", directory, before, name, after);
}

FILE *rows_open(const char *directory, const char *name)
{
    char path[PATH];
    snprintf(path, sizeof path, "%s/postProcessing", directory);
    if (mkdir(path, 0777) != 0 && errno != EEXIST) {
        message_stop(PROGRAM, "cannot create %s: %s", path, strerror(errno));
        return NULL;
    }
    path_of(directory, name, ".", ".part", path);
    FILE *file = fopen(path, "w+");
    if (file == NULL) message_stop(PROGRAM, "cannot write %s: %s", path, strerror(errno));
    return file;
}

/* Whether `old` begins with what `file` holds; both stand behind it then. */
static int same_head(FILE *file, FILE *old)
{
    int a, b;
    rewind(file);
    while ((a = getc(file)) != EOF && (b = getc(old)) == a) {
    }
    fseek(file, 0, SEEK_END);
    return a == EOF;
}

/* Rows up to `from`; one without its end is not whole. */
static int copy_rows(FILE *file, FILE *old, double from)
{
    /* Rows have 12 digits of the time, and are farther apart than that. */
    const double last = from + 1e-9 * fabs(from);
    char *line = NULL;
    size_t room = 0;
    ssize_t length;
    while ((length = getline(&line, &room, old)) > 0)
        if (line[length - 1] == '\n' && strtod(line, NULL) <= last) fputs(line, file);
    free(line);
    return ferror(old) ? -1 : 0;
}

int rows_begin(FILE *file, const char *directory, const char *name, double from)
{
    char path[PATH], part[PATH], aside[PATH], after[64];
    path_of(directory, name, "", "", path);
    path_of(directory, name, ".", ".part", part);
    int bad = 0;
    FILE *old = isnan(from) ? NULL : fopen(path, "r");
    if (old != NULL && same_head(file, old)) {
        bad = copy_rows(file, old, from);
    } else if (old != NULL) {
        snprintf(after, sizeof after, ".before-%.12g", from);
        path_of(directory, name, "", after, aside);
        bad = rename(path, aside);
        printf("postProcessing/%s has other columns now: what there was is in %s%s\n", name, name,
               after);
    }
    if (old != NULL) fclose(old);
    if (bad || fflush(file) != 0 || rename(part, path) != 0) {
        message_stop(PROGRAM, "cannot write %s: %s", path, strerror(errno));
        return -1;
    }
    return 0;
}
