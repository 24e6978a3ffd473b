/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * size.c - what particles an insertion or a feeder makes: materials, diameters, shares.
 *
 * One kind is `material` with `diameter` or `size { }`; several are the list `species`, each of
 * which has these and its share.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const number_or_mass[] = {"number", "mass", NULL};

/* The words of the laws, from DEM_SIZE_UNIFORM on. */
static const char *const type_words[] = {"uniform",      "normal", "logNormal",
                                         "rosinRammler", "table",  NULL};

static const char *const keys[][8] = {
    [DEM_SIZE_UNIFORM] = {"type", "by", "min", "max", NULL},
    [DEM_SIZE_NORMAL] = {"type", "by", "mean", "deviation", "min", "max", NULL},
    [DEM_SIZE_LOGNORMAL] = {"type", "by", "median", "deviation", "min", "max", NULL},
    [DEM_SIZE_ROSIN_RAMMLER] = {"type", "by", "d63", "exponent", "min", "max", NULL},
    [DEM_SIZE_TABLE] = {"type", "by", "rows", "file", NULL},
};

/* ---- laws of size ---------------------------------------------------------------------------- */

static void read_bounds(const case_dict *dict, dem_size *size, case_errors *errors)
{
    const int optional = size->kind == DEM_SIZE_LOGNORMAL;
    if (optional && !case_has(dict, "min") && !case_has(dict, "max")) return;
    size->lo = read_number(dict, "min", "m", NULL, case_positive, errors);
    size->hi = read_number(dict, "max", "m", NULL, case_positive, errors);
    if (size->hi <= size->lo)
        key_error(errors, dict, "max", "found %g; accepted: above min, %g m", size->hi, size->lo);
}

/* A middle beyond the bounds is mostly a mistake of unit, but the tail of a law may be meant. */
static void note_middle(const case_dict *dict, const char *key, const dem_size *size,
                        case_errors *errors)
{
    char path[512];
    if (!(size->lo > 0) || !(size->hi > size->lo)) return;
    if (!(size->mean > 0) || (size->mean >= size->lo && size->mean <= size->hi)) return;
    key_path(dict, key, path, sizeof path);
    case_note(errors, dict->file, case_dict_line(dict, key),
              "%s: %g m lies outside min and max, %g to %g m: only a tail of the law is left", path,
              size->mean, size->lo, size->hi);
}

static void read_table(particle_reader *reader, const case_dict *dict, dem_size *size)
{
    static const char *const accepted =
        "two or more rows (diameter share) of diameters in m, increasing, and the share of "
        "particles below each, from 0 to 1";
    size_t n, width;
    const double *row = read_rows(reader, dict, 2, 0, 2, accepted, &n, &width);
    if (!row) return;
    double *diameter = store_alloc(reader->storage->store, n * sizeof *diameter);
    double *share = store_alloc(reader->storage->store, n * sizeof *share);
    const char *const key = case_has(dict, "rows") ? "rows" : "file";
    for (size_t i = 0; i < n; i++) {
        diameter[i] = row[2 * i];
        share[i] = row[2 * i + 1];
        if (diameter[i] > (i ? diameter[i - 1] : 0) && share[i] >= (i ? share[i - 1] : 0) &&
            !(i == 0 && share[i] != 0) && !(i + 1 == n && share[i] != 1))
            continue;
        key_error(reader->errors, dict, key, "row %zu, counted from 0, is (%g %g); accepted: %s", i,
                  diameter[i], share[i], accepted);
        return;
    }
    size->n = n;
    size->diameter = diameter;
    size->cumulative = share;
}

static void read_law(particle_reader *reader, const case_dict *dict, dem_size *size)
{
    case_errors *errors = reader->errors;
    const int before = case_errors_count(errors);
    const char *middle = NULL;
    size->kind = (dem_size_kind)(case_choice(dict, "type", type_words, -1, errors) + 1);
    if (case_errors_count(errors) > before) return;
    case_known(dict, keys[size->kind], errors);
    size->by_mass = case_choice(dict, "by", number_or_mass, -1, errors);
    switch (size->kind) {
    case DEM_SIZE_NORMAL:
        middle = "mean";
        size->mean = read_number(dict, middle, "m", NULL, case_positive, errors);
        size->deviation = read_number(dict, "deviation", "m", NULL, case_positive, errors);
        break;
    case DEM_SIZE_LOGNORMAL:
        middle = "median";
        size->mean = read_number(dict, middle, "m", NULL, case_positive, errors);
        size->deviation = read_number(dict, "deviation", "", NULL, case_positive, errors);
        break;
    case DEM_SIZE_ROSIN_RAMMLER:
        middle = "d63";
        size->mean = read_number(dict, middle, "m", NULL, case_positive, errors);
        size->exponent = read_number(dict, "exponent", "", NULL, case_positive, errors);
        break;
    case DEM_SIZE_TABLE:
        read_table(reader, dict, size);
        return;
    default:
        break;
    }
    read_bounds(dict, size, errors);
    if (middle) note_middle(dict, middle, size, errors);
}

const char *size_key(const case_dict *dict)
{
    return case_has(dict, "diameter") ? "diameter" : case_has(dict, "size") ? "size" : "species";
}

/* diameter, or size { } */
static void read_size(particle_reader *reader, const case_dict *dict, dem_size *size)
{
    case_errors *errors = reader->errors;
    const int equal = case_has(dict, "diameter"), law = case_has(dict, "size");
    *size = (dem_size){.kind = DEM_SIZE_EQUAL, .mean = NAN};
    if (equal && law)
        key_error(errors, dict, "size", "given beside diameter; accepted: either of them");
    if (law) {
        const case_dict *sub = case_sub(dict, "size", 1, errors);
        if (sub) read_law(reader, sub, size);
    } else {
        size->mean = read_number(dict, "diameter", "m", NULL, case_positive, errors);
    }
}

/* Where a log-normal law without bounds has all but 1 in 1000 of the particles: the quantile of
 * the normal law, 3.09 (M. Abramowitz & I. A. Stegun, Handbook of Mathematical Functions (1964),
 * table 26.5). */
static const double quantile = 3.09;

double size_least(const dem_size *size)
{
    if (size->kind == DEM_SIZE_EQUAL) return size->mean;
    if (size->kind == DEM_SIZE_TABLE) return size->n ? size->diameter[0] : NAN;
    if (size->kind == DEM_SIZE_LOGNORMAL && !(size->lo > 0))
        return size->mean * exp(-quantile * size->deviation);
    return size->lo;
}

double size_most(const dem_size *size)
{
    if (size->kind == DEM_SIZE_EQUAL) return size->mean;
    if (size->kind == DEM_SIZE_TABLE) return size->n ? size->diameter[size->n - 1] : NAN;
    if (size->kind == DEM_SIZE_LOGNORMAL && !(size->hi > 0))
        return size->mean * exp(quantile * size->deviation);
    return size->hi;
}

double least_diameter(size_t n, const dem_species *species)
{
    double least = INFINITY;
    for (size_t i = 0; i < n; i++) least = fmin(least, size_least(&species[i].size));
    return least;
}

double most_diameter(size_t n, const dem_species *species)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = fmax(most, size_most(&species[i].size));
    return most;
}

/* ---- species --------------------------------------------------------------------------------- */

static kinds read_species(particle_reader *reader, const case_dict *dict)
{
    static const char *const known[] = {"material", "diameter", "size", "share", NULL};
    case_errors *errors = reader->errors;
    kinds all = {.n = case_list_size(dict, "species")};
    if (all.n == 0) {
        key_error(errors, dict, "species",
                  "not such a list; accepted: a list of dictionaries ( { material ...; diameter "
                  "...; share ...; } ... )");
        return all;
    }
    for (const char *const *key = (const char *const[]){"material", "diameter", "size", NULL}; *key;
         key++)
        if (case_has(dict, *key))
            key_error(errors, dict, *key, "given beside species, each of which has its own");
    all.species = store_alloc(reader->storage->store, all.n * sizeof *all.species);
    all.by_mass = case_choice(dict, "shareBy", number_or_mass, 1, errors);
    for (size_t i = 0; i < all.n; i++) {
        const case_dict *one = case_list_at(dict, "species", i);
        dem_species *species = &all.species[i];
        case_known(one, known, errors);
        species->material = read_material(reader, one);
        read_size(reader, one, &species->size);
        species->share = read_number(one, "share", "", NULL, case_positive, errors);
    }
    return all;
}

kinds read_kinds(particle_reader *reader, const case_dict *dict)
{
    if (case_has(dict, "species")) return read_species(reader, dict);
    kinds one = {.n = 1};
    if (case_has(dict, "shareBy"))
        key_error(reader->errors, dict, "shareBy", "given without species, of which it speaks");
    one.species = store_alloc(reader->storage->store, sizeof *one.species);
    one.species->material = read_material(reader, dict);
    one.species->share = 1;
    read_size(reader, dict, &one.species->size);
    return one;
}
