/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insertion.c - what particles a case starts with.
 *
 * Types: lattice (spacing, region), random (number or solidFraction, region), file (positions in
 * the format of an OpenFOAM vectorField: an optional header and "N ( (x y z) ... )").
 */
#include "files.h"
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const type_words[] = {[DEM_INSERT_RANDOM] = "random",
                                         [DEM_INSERT_LATTICE] = "lattice",
                                         [DEM_INSERT_LIST] = "file",
                                         NULL};

/* Random close packing of equal spheres: none denser is random (J. G. Berryman, Phys. Rev. A 27
 * (1983) 1053, doi:10.1103/PhysRevA.27.1053). */
static const case_range packed = {0, .64, 1, 0};
/* More particles than this in one insertion is a mistake of unit. */
#define MOST_PARTICLES 4e9

static void check_keys(const particle_reader *reader, const case_dict *dict,
                       dem_insertion_kind kind)
{
#define COMMON                                                                                     \
    "type", "material", "diameter", "velocity", "velocitySpread", "angularVelocity", "seed"
    static const char *const random[] = {COMMON, "region", "number", "solidFraction", NULL};
    static const char *const lattice[] = {COMMON, "region", "spacing", NULL};
    static const char *const list[] = {COMMON, "file", NULL};
#undef COMMON
    const char *const *known = kind == DEM_INSERT_RANDOM    ? random
                               : kind == DEM_INSERT_LATTICE ? lattice
                                                            : list;
    case_known(dict, known, reader->errors);
}

/* ---- region ---------------------------------------------------------------------------------- */

static void read_region(particle_reader *reader, const case_dict *dict, dem_insertion *to)
{
    const case_dict *region = case_sub(dict, "region", 1, reader->errors);
    const dem_param *param = reader->param;
    to->region = region ? read_shape(region, 1, to->lo, to->hi, reader->errors) : NULL;
    if (!to->region) return;
    for (int a = 0; a < 3; a++) {
        double slack = 1e-9 * (param->hi[a] - param->lo[a]); /* the same number in two files */
        int below = to->lo[a]<param->lo[a] - slack, above = to->hi[a]> param->hi[a] + slack;
        const char *key = above ? "max" : "min";
        if (below || above)
            key_error(reader->errors, region, case_has(region, key) ? key : "",
                      "the region reaches from %g to %g m in %c, beyond the %s, %g to %g m",
                      to->lo[a], to->hi[a], "xyz"[a], reader -> mesh ? "mesh" : "domain",
                      param->lo[a], param->hi[a]);
    }
}

static void read_random(particle_reader *reader, const case_dict *dict, dem_insertion *to)
{
    case_errors *errors = reader->errors;
    int number = case_has(dict, "number"), fraction = case_has(dict, "solidFraction");
    to->number = -1;
    if (number == fraction)
        key_error(errors, dict, number ? "solidFraction" : "number",
                  "%s; accepted: either number or solidFraction",
                  number ? "given beside number" : "missing, and so is solidFraction");
    if (number)
        to->number = case_integer(dict, "number", NULL, 0, (long)MOST_PARTICLES, errors);
    else if (fraction)
        to->solid_fraction = read_number(dict, "solidFraction", "", NULL, packed, errors);
    read_region(reader, dict, to);
    for (int a = 0; a < 3 && to->region; a++)
        if (to->diameter > to->hi[a] - to->lo[a])
            key_error(errors, dict, "diameter",
                      "particles of %g m do not fit into the region, which is %g m wide in %c",
                      to->diameter, to->hi[a] - to->lo[a], "xyz"[a]);
}

static void read_lattice(particle_reader *reader, const case_dict *dict, dem_insertion *to)
{
    case_errors *errors = reader->errors;
    double *value, product = 1;
    size_t n = 0;
    if (!case_has(dict, "spacing"))
        key_error(errors, dict, "spacing", "missing; accepted: a number > 0 or a vector in m");
    else if (n = case_numbers(dict, "spacing", &value, errors), n > 0) {
        if (n != 1 && n != 3)
            key_error(errors, dict, "spacing",
                      "found %zu numbers; accepted: a number > 0 or a "
                      "vector (x y z) in m",
                      n);
        for (int a = 0; a < 3; a++) to->spacing[a] = n == 3 ? value[a] : value[0];
        free(value);
    }
    read_region(reader, dict, to);
    for (int a = 0; a < 3 && (n == 1 || n == 3); a++) {
        double room = to->hi[a] - to->lo[a];
        if (to->spacing[a] < to->diameter || !(to->spacing[a] > 0)) {
            key_error(errors, dict, "spacing",
                      "found %g m in %c; accepted: at least the diameter, "
                      "%g m, or the particles overlap",
                      to->spacing[a], "xyz"[a], to -> diameter);
            return;
        }
        if (to->region && .5 * to->spacing[a] > room)
            key_error(errors, dict, "spacing",
                      "found %g m in %c, where the region is %g m wide: no "
                      "particle would be made",
                      to->spacing[a], "xyz"[a], room);
        product *= room / to->spacing[a];
    }
    if (to->region && product > MOST_PARTICLES)
        key_error(errors, dict, "spacing", "about %.2g particles would be made; accepted: up to %g",
                  product, MOST_PARTICLES);
}

/* ---- file ------------------------------------------------------------------------------------ */

/* A file named in constant/demProperties: there, or from the top of the case, or absolute. */
static case_dict *open_positions(const particle_reader *reader, const char *name)
{
    char path[4096];
    if (*name == '/') return case_dict_read(name, reader->errors);
    snprintf(path, sizeof path, "constant/%s", name);
    if (!case_file_exists(reader->directory, path) && case_file_exists(reader->directory, name))
        return case_read_file(reader->directory, name, reader->errors);
    return case_read_file(reader->directory, path, reader->errors);
}

/* The first member of a list that is not a position: its place counted from 0, its line, its text.
 */
static const node *wrong_position(const node *list, size_t *index)
{
    *index = 0;
    for (const node *at = list->first; at; at = at->next, ++*index)
        if (at->kind != NODE_LIST || at->first || at->width || at->n != 3) return at;
    return NULL;
}

static void refuse_positions(particle_reader *reader, const case_dict *positions,
                             const entry *entry)
{
    static const char *const accepted = "accepted: a list of positions, N ( (x y z) ... ), in m";
    const node *list = entry ? entry->value : NULL, *wrong = NULL;
    size_t index = 0;
    char found[256];
    if (list && list->kind == NODE_LIST) wrong = wrong_position(list, &index);
    if (wrong) {
        describe_members(wrong, found, sizeof found);
        case_error(reader->errors, positions->file, wrong->line,
                   "position %zu, counted from 0, is '%s'; %s", index, found, accepted);
    } else if (list && list->kind == NODE_LIST && list->n > 0) {
        case_error(reader->errors, positions->file, list->line, "found a list of %s; %s",
                   list->width ? "rows that have not three numbers" : "plain numbers", accepted);
    } else {
        case_error(reader->errors, positions->file, entry ? entry->line : 1, "%s", accepted);
    }
}

static void read_file(particle_reader *reader, const case_dict *dict, dem_insertion *to,
                      const char **file)
{
    const char *name = case_word(dict, "file", NULL, 1, reader->errors);
    int before = case_errors_count(reader->errors);
    if (!name) return;
    case_dict *positions = open_positions(reader, name);
    if (!positions) {
        if (case_errors_count(reader->errors) > before)
            key_error(reader->errors, dict, "file", "the file '%s' was not read", name);
        return;
    }
    const entry *entry = dict_match(positions, "");
    const node *list = entry ? entry->value : NULL;
    if (!list || list->width != 3) {
        refuse_positions(reader, positions, entry);
    } else {
        store *store = reader->storage->store;
        double(*x)[3] = store_alloc(store, list->n * sizeof *x);
        memcpy(x, list->value, list->n * sizeof *x);
        to->x = (const double(*)[3])x;
        to->n = list->n;
        *file = store_text(store, positions->file, strlen(positions->file));
    }
    case_dict_free(positions);
}

/* ---- insertions ------------------------------------------------------------------------------ */

static void read_insertion(particle_reader *reader, const case_dict *dict, dem_insertion *to,
                           size_t i)
{
    static const double zero[3] = {0, 0, 0};
    particle_storage *storage = reader->storage;
    case_errors *errors = reader->errors;
    copy_name(reader, dict, to->name);
    int before = case_errors_count(errors);
    to->kind = (dem_insertion_kind)case_choice(dict, "type", type_words, -1, errors);
    int typed = case_errors_count(errors) == before;
    if (typed) check_keys(reader, dict, to->kind);
    to->material = read_material(reader, dict);
    to->diameter = read_number(dict, "diameter", "m", NULL, case_positive, errors);
    read_vector(dict, "velocity", "m/s", zero, to->velocity, errors);
    read_vector(dict, "angularVelocity", "rad/s", zero, to->angular_velocity, errors);
    to->velocity_spread =
        read_number(dict, "velocitySpread", "m/s", &(double){0}, case_non_negative, errors);
    to->seed = (uint64_t)case_integer(dict, "seed", &(long){1}, 0, 9007199254740992, errors);
    storage->diameter[i] = place_of(storage->store, dict, "diameter");
    storage->insertion[i] =
        place_of(storage->store, dict, case_has(dict, "file") ? "file" : "region");
    if (!typed) return;
    if (to->kind == DEM_INSERT_RANDOM)
        read_random(reader, dict, to);
    else if (to->kind == DEM_INSERT_LATTICE)
        read_lattice(reader, dict, to);
    else
        read_file(reader, dict, to, &storage->positions[i]);
}

void read_insertions(particle_reader *reader)
{
    const case_dict *list = case_sub(reader->dict, "insertion", 0, reader->errors);
    particle_storage *storage = reader->storage;
    if (!list || list->n == 0) return;
    dem_insertion *insertion = store_alloc(storage->store, list->n * sizeof *insertion);
    storage->insertion = store_alloc(storage->store, list->n * sizeof *storage->insertion);
    storage->diameter = store_alloc(storage->store, list->n * sizeof *storage->diameter);
    storage->positions = store_alloc(storage->store, list->n * sizeof *storage->positions);
    reader->param->insertion = insertion;
    for (size_t i = 0; i < list->n; i++) {
        const case_dict *dict = case_sub(list, list->entry[i]->key, 1, reader->errors);
        size_t k = reader->param->n_insertion;
        if (!dict) continue;
        read_insertion(reader, dict, &insertion[k], k);
        reader->param->n_insertion++;
    }
}
