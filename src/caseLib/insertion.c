/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insertion.c - what particles a case starts with.
 *
 * Types: lattice (spacing, region), random (number or solidFraction, region, sizes and species),
 * file (positions in the format of an OpenFOAM vectorField: an optional header and
 * "N ( (x y z) ... )").
 */
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
    static const char *const random[] = {"type",   KIND_KEYS,       START_KEYS, "region",
                                         "number", "solidFraction", NULL};
    static const char *const lattice[] = {"type",   "material", "diameter", START_KEYS,
                                          "region", "spacing",  NULL};
    static const char *const list[] = {"type", "material", "diameter", START_KEYS, "file", NULL};
    const char *const *known = kind == DEM_INSERT_RANDOM    ? random
                               : kind == DEM_INSERT_LATTICE ? lattice
                                                            : list;
    case_known(dict, known, reader->errors);
}

/* ---- in a region ----------------------------------------------------------------------------- */

void check_fit(particle_reader *reader, const case_dict *dict, const char *key, double diameter,
               const double lo[3], const double hi[3])
{
    for (int a = 0; a < 3; a++)
        if (diameter > hi[a] - lo[a])
            key_error(reader->errors, dict, key,
                      "particles of %g m do not fit into the region, which is %g m wide in %c",
                      diameter, hi[a] - lo[a], "xyz"[a]);
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
    to->region = read_region(reader, dict, 1, to->lo, to->hi);
    if (to->region) check_fit(reader, dict, size_key(dict), to->diameter, to->lo, to->hi);
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
    to->region = read_region(reader, dict, 1, to->lo, to->hi);
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
    case_dict *positions = read_beside(reader, dict, "file");
    if (!positions) return;
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

birth read_birth(const case_dict *dict, case_errors *errors)
{
    static const double zero[3] = {0, 0, 0};
    birth born;
    read_vector(dict, "velocity", "m/s", zero, born.velocity, errors);
    read_vector(dict, "angularVelocity", "rad/s", zero, born.angular_velocity, errors);
    born.velocity_spread =
        read_number(dict, "velocitySpread", "m/s", &(double){0}, case_non_negative, errors);
    born.seed = (uint64_t)case_integer(dict, "seed", &(long){1}, 0, 9007199254740992, errors);
    return born;
}

/* One material and diameter, or for random ones as many as there are species. `diameter` is then
 * that of the largest, which is what the checks of room are about. */
static void read_what(particle_reader *reader, const case_dict *dict, dem_insertion *to)
{
    if (to->kind == DEM_INSERT_RANDOM && !case_has(dict, "diameter")) {
        const kinds all = read_kinds(reader, dict);
        to->n_species = all.n;
        to->species = all.species;
        to->share_by_mass = all.by_mass;
        to->material = all.n ? all.species[0].material : 0;
        to->diameter = most_diameter(all.n, all.species);
        return;
    }
    to->material = read_material(reader, dict);
    to->diameter = read_number(dict, "diameter", "m", NULL, case_positive, reader->errors);
}

static void read_insertion(particle_reader *reader, const case_dict *dict, dem_insertion *to,
                           size_t i)
{
    particle_storage *storage = reader->storage;
    case_errors *errors = reader->errors;
    copy_name(reader, dict, to->name);
    int before = case_errors_count(errors);
    to->kind = (dem_insertion_kind)case_choice(dict, "type", type_words, -1, errors);
    int typed = case_errors_count(errors) == before;
    if (typed) check_keys(reader, dict, to->kind);
    read_what(reader, dict, to);
    const birth born = read_birth(dict, errors);
    memcpy(to->velocity, born.velocity, sizeof to->velocity);
    memcpy(to->angular_velocity, born.angular_velocity, sizeof to->angular_velocity);
    to->velocity_spread = born.velocity_spread;
    to->seed = born.seed;
    storage->diameter[i] = place_of(storage->store, dict, size_key(dict));
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
