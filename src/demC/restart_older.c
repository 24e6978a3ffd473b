/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_older.c - deletes restart files that newer ones have taken the place of.
 *
 * Files whose names are numbers, not above that of the newest, count as older than it, by their
 * names. Nothing is deleted that does not say in its head what it is, but for what is left of files
 * that a run was making when it was killed.
 */
#include "restart_file.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The number of a name "<number>.h5", NAN if it is none of that form. */
static double number_of(const char *name)
{
    char text[64], *end;
    const size_t length = strlen(name);
    if (length < 4 || length >= sizeof text || strcmp(name + length - 3, ".h5") != 0) return NAN;
    snprintf(text, sizeof text, "%.*s", (int)length - 3, name);
    const double number = strtod(text, &end);
    return *end == '\0' && isfinite(number) ? number : NAN;
}

static int later_first(const void *a, const void *b)
{
    const double x = number_of(*(char *const *)a), y = number_of(*(char *const *)b);
    return (x < y) - (x > y);
}

/* Nothing is deleted that does not say what it is. */
static int is_restart_file(const char *path)
{
    char begin[sizeof RESTART_MAGIC - 1];
    FILE *file = fopen(path, "rb");
    if (file == NULL) return 0;
    const size_t got = fread(begin, 1, sizeof begin, file);
    fclose(file);
    return got == sizeof begin && memcmp(begin, RESTART_MAGIC, sizeof begin) == 0;
}

/* Names "<number>.h5" in the directory up to `last`, the latest first; remains of writing go. */
static size_t find_files(const char *directory, double last, char ***names)
{
    size_t n = 0;
    DIR *folder = opendir(directory);
    for (struct dirent *e = folder ? readdir(folder) : NULL; e != NULL; e = readdir(folder)) {
        char path[PATH_MAX];
        const size_t length = strlen(e->d_name);
        if (snprintf(path, sizeof path, "%s/%s", directory, e->d_name) >= (int)sizeof path)
            continue;
        if (e->d_name[0] == '.' && length > 8 && strcmp(e->d_name + length - 8, ".h5.part") == 0)
            unlink(path);
        if (!(number_of(e->d_name) <= last) || !is_restart_file(path)) continue;
        char **more = realloc(*names, (n + 1) * sizeof *more);
        if (more == NULL) break;
        *names = more;
        more[n] = strdup(e->d_name);
        if (more[n] == NULL) break;
        n++;
    }
    if (folder) closedir(folder);
    if (n > 0) qsort(*names, n, sizeof **names, later_first);
    return n;
}

void restart_delete_older(const char *directory, const char *newest, size_t keep)
{
    char **names = NULL, path[PATH_MAX];
    const char *slash = strrchr(newest, '/');
    const double last = number_of(slash ? slash + 1 : newest);
    const size_t n = isnan(last) ? 0 : find_files(directory, last, &names);
    for (size_t k = 0; k < n; k++) {
        if (k >= keep && snprintf(path, sizeof path, "%s/%s", directory, names[k]) < PATH_MAX)
            unlink(path); /* one that cannot be deleted merely stays */
        free(names[k]);
    }
    free(names);
}
