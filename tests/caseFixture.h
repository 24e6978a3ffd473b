/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseFixture.h - what the tests of caseLib share: a text parsed, a directory to write cases into,
 * messages compared.
 */
#ifndef CASE_FIXTURE_H
#define CASE_FIXTURE_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "case.h"

typedef struct fixture {
    char directory[64];
    case_errors *errors;
} fixture;

static inline void shell(const char *format, const char *a, const char *b)
{
    char command[1024];
    snprintf(command, sizeof command, format, a, b);
    assert_int_equal(system(command), 0);
}

/* A directory of its own with empty system, constant and 0. */
static inline fixture fixture_new(void)
{
    fixture f = {"/tmp/felmiCaseXXXXXX", case_errors_new()};
    assert_non_null(mkdtemp(f.directory));
    shell("mkdir %s/system %s/constant", f.directory, f.directory);
    return f;
}

static inline void fixture_free(fixture *f)
{
    shell("rm -rf %s%s", f->directory, "");
    case_errors_free(f->errors);
}

static inline void put_file(const fixture *f, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", f->directory, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    fclose(file);
}

/* No error at all. */
#define assert_clean(errors)                                                                       \
    do {                                                                                           \
        if (case_errors_count(errors)) print_error("%s", case_errors_text(errors));                \
        assert_int_equal(case_errors_count(errors), 0);                                            \
    } while (0)

/* `part` stands in the messages. */
#define assert_says(errors, part)                                                                  \
    do {                                                                                           \
        if (!strstr(case_errors_text(errors), part))                                               \
            print_error("wanted '%s' in:\n%s", part, case_errors_text(errors));                    \
        assert_non_null(strstr(case_errors_text(errors), part));                                   \
    } while (0)

/* A text that must be refused with `part` in the message. */
#define assert_refused(text, part)                                                                 \
    do {                                                                                           \
        case_errors *refused_ = case_errors_new();                                                 \
        case_dict *dict_ = case_dict_parse(text, "text", refused_);                                \
        assert_null(dict_);                                                                        \
        assert_says(refused_, part);                                                               \
        case_errors_free(refused_);                                                                \
    } while (0)

/* `text` with the first `old` replaced by `new`; to be freed. */
static inline char *replaced(const char *text, const char *old, const char *new)
{
    const char *at = strstr(text, old);
    assert_non_null(at);
    size_t size = strlen(text) + strlen(new) + 1;
    char *result = malloc(size);
    snprintf(result, size, "%.*s%s%s", (int)(at - text), text, new, at + strlen(old));
    return result;
}

static inline case_dict *parsed(const char *text, case_errors *errors)
{
    case_dict *dict = case_dict_parse(text, "text", errors);
    assert_clean(errors);
    assert_non_null(dict);
    return dict;
}

#endif
