/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseDem.h - reads a text as constant/demProperties of a case and compares messages.
 */
#ifndef CASE_DEM_H
#define CASE_DEM_H

#include "caseFixture.h"

/* A vessel, a bed and the contacts between glass and steel: `more` is added at the end. */
#define DEM_MATERIALS                                                                              \
    "contactLaw linear;\n"                                                                         \
    "materials { glass { density 2526; } steel { density 7800; } lead { density 11340; } }\n"      \
    "contacts\n"                                                                                   \
    "(\n"                                                                                          \
    "{ materials (glass glass); stiffness 1000; restitution .97; friction .1; }\n"                 \
    "{ materials (glass steel); stiffness 1500; restitution .9; friction .09; }\n"                 \
    ");\n"                                                                                         \
    "domain { min (0 0 0); max (.1 .2 .4); }\n"

/* Read and checked; the caller frees dem. */
static inline void read_dem(fixture *f, const char *text, case_dem *dem)
{
    static const double weight[3] = {0, 0, -9.81};
    case_dict *dict = case_dict_parse(text, "demProperties", f->errors);
    assert_non_null(dict);
    case_read_dem(dict, f->directory, NULL, weight, dem, f->errors);
    case_dict_free(dict);
    case_check(NULL, NULL, dem, NULL, f->errors);
}

/* `old` replaced by `new` in `text` must be refused with `part` in the message. */
static inline void refused_in(fixture *f, const char *text, const char *old, const char *new,
                              const char *part)
{
    case_dem dem;
    char *variant = replaced(text, old, new);
    fixture own = {.errors = case_errors_new()};
    memcpy(own.directory, f->directory, sizeof own.directory);
    read_dem(&own, variant, &dem);
    assert_says(own.errors, part);
    assert_true(case_errors_count(own.errors) > 0);
    case_dem_free(&dem, 1);
    case_errors_free(own.errors);
    free(variant);
}

#endif
