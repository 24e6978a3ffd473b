/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * shape.c - reads the shape of a wall or of a region and makes its signed distance function.
 */
#include "particles.h"

dem_sdf *read_shape(particle_reader *reader, const case_dict *dict, int region, extent *box)
{
    case_errors *errors = reader->errors;
    const int before = case_errors_count(errors);
    /* A region is bounded: no plane. */
    int type =
        case_choice(dict, "type", region ? simple_words + 1 : simple_words, -1, errors) + region;
    if (case_errors_count(errors) > before) return NULL;
    *box = (extent){{0, 0, 0}, {0, 0, 0}, 0};
    dem_sdf *sdf = read_simple_shape(reader, dict, type, region, box);
    if (!sdf && case_errors_count(errors) == before)
        key_error(errors, dict, "type", "this %s has no extent", simple_words[type]);
    if (case_errors_count(errors) == before) return sdf;
    dem_sdf_free(sdf);
    return NULL;
}
