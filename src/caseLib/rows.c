/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * rows.c - files that demProperties names, and tables of numbers, in it or in such a file.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *keep_text(particle_reader *reader, const char *text)
{
    return store_text(reader->storage->store, text, strlen(text));
}

int find_file(const particle_reader *reader, const char *folder, const char *name, char *path,
              size_t size)
{
    char inside[2048];
    if (*name == '/') {
        snprintf(path, size, "%s", name);
        return case_file_exists("", name);
    }
    snprintf(inside, sizeof inside, "%s/%s", folder, name);
    const int first = case_file_exists(reader->directory, inside);
    const int top = !first && case_file_exists(reader->directory, name);
    /* One that names its folder is missed where it says. */
    const int asIs = top || (!first && strchr(name, '/') != NULL);
    snprintf(path, size, "%s/%s", reader->directory, asIs ? name : inside);
    return first || top;
}

case_dict *read_beside(const particle_reader *reader, const case_dict *dict, const char *key)
{
    const char *name = case_word(dict, key, NULL, 1, reader->errors);
    char path[4096];
    const int before = case_errors_count(reader->errors);
    if (!name) return NULL;
    find_file(reader, "constant", name, path, sizeof path);
    case_dict *found = case_dict_read(path, reader->errors);
    if (!found && case_errors_count(reader->errors) > before)
        key_error(reader->errors, dict, key, "the file '%s' was not read", name);
    return found;
}

/* A list of equal rows of numbers, NULL with an error at `at`. */
static const node *good_rows(const particle_reader *reader, const case_dict *dict, const char *key,
                             size_t width, size_t other, size_t least, const char *accepted)
{
    const entry *entry = dict_match(dict, key);
    const node *list = list_value(dict, key);
    if (list && (list->width == width || (other && list->width == other)) && list->n >= least) {
        size_t finite = 0, all = list->n * list->width;
        while (finite < all && isfinite(list->value[finite])) finite++;
        if (finite == all) return list;
    }
    char found[256];
    describe_value(entry, found, sizeof found);
    if (list && list->n < least)
        key_error(reader->errors, dict, key, "found %zu rows; accepted: %s", list->n, accepted);
    else if (list && list->width)
        key_error(reader->errors, dict, key, "found rows of %zu numbers; accepted: %s", list->width,
                  accepted);
    else
        key_error(reader->errors, dict, key, "found %s; accepted: %s", found, accepted);
    return NULL;
}

const double *read_rows(particle_reader *reader, const case_dict *dict, size_t width, size_t other,
                        size_t least, const char *accepted, size_t *n, size_t *found)
{
    const int rows = case_has(dict, "rows"), file = case_has(dict, "file");
    *n = *found = 0;
    if (rows == file) {
        key_error(reader->errors, dict, rows ? "file" : "rows",
                  "%s; accepted: either rows ( (...) ... ) or the file they stand in",
                  rows ? "given beside rows" : "missing, and so is file");
        return NULL;
    }
    case_dict *beside = file ? read_beside(reader, dict, "file") : NULL;
    double *value = NULL;
    if (rows || beside) {
        const node *list = good_rows(reader, beside ? beside : dict, beside ? "" : "rows", width,
                                     other, least, accepted);
        if (list) {
            const size_t all = list->n * list->width;
            value = store_alloc(reader->storage->store, all * sizeof *value);
            memcpy(value, list->value, all * sizeof *value);
            *n = list->n;
            *found = list->width;
        }
    }
    case_dict_free(beside);
    return value;
}
