/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * material.c - materials and what each pair of them does in contact.
 *
 * Every pair that can meet has to be given: two materials of particles, or one of particles and one
 * of a wall. A pair that cannot meet (two walls) repeats the first one given, so that the table has
 * valid numbers everywhere and none that would set the time step.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const case_range poisson_range = {-1, .5, 1, 0};
/* Without any rebound the dashpot of the linear law, 1/ln(e), is not defined. */
static const case_range restitution_range = {0, 1, 1, 0};

void read_materials(particle_reader *reader)
{
    static const char *const known[] = {"density", "youngsModulus", "poissonRatio", NULL};
    const case_dict *list = case_sub(reader->dict, "materials", 1, reader->errors);
    dem_param *param = reader->param;
    if (!list) return;
    dem_material *material = store_alloc(reader->storage->store, (list->n + 1) * sizeof *material);
    param->material = material;
    int hertz = param->law == DEM_HERTZ;
    for (size_t i = 0; i < list->n; i++) {
        const case_dict *dict = case_sub(list, list->entry[i]->key, 1, reader->errors);
        if (!dict) continue;
        dem_material *m = &material[param->n_material++];
        case_known(dict, known, reader->errors);
        copy_name(reader, dict, m->name);
        m->density = read_number(dict, "density", "kg/m3", NULL, case_positive, reader->errors);
        m->youngs_modulus = read_number(dict, "youngsModulus", "Pa", hertz ? NULL : &(double){0},
                                        case_positive, reader->errors);
        m->poisson_ratio = read_number(dict, "poissonRatio", "", hertz ? NULL : &(double){0},
                                       poisson_range, reader->errors);
    }
    if (list->n == 0)
        key_error(reader->errors, reader->dict, "materials", "empty; accepted: at least one");
}

/* Index of the material `name`, -1 with an error at `key`. */
static int find_material(const particle_reader *reader, const case_dict *dict, const char *key,
                         const char *name)
{
    const dem_param *param = reader->param;
    const char *names[64] = {NULL};
    char list[512] = "";
    size_t used = 0;
    for (size_t i = 0; i < param->n_material; i++) {
        if (strcmp(param->material[i].name, name) == 0) return (int)i;
        if (i < 63) names[i] = param->material[i].name;
        if (used < sizeof list)
            used += (size_t)snprintf(list + used, sizeof list - used, i ? ", %s" : "%s",
                                     param->material[i].name);
    }
    const char *near = case_nearest(name, names);
    if (param->n_material)
        key_error(reader->errors, dict, key,
                  "found '%s', which is not among the materials; "
                  "accepted: %s%s%s%s",
                  name, list, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    return -1;
}

int read_material(const particle_reader *reader, const case_dict *dict)
{
    const char *name = case_word(dict, "material", NULL, 1, reader->errors);
    int found = name ? find_material(reader, dict, "material", name) : -1;
    return found < 0 ? 0 : found;
}

/* ---- contacts -------------------------------------------------------------------------------- */

/* The two materials of a contact; 0 with an error. */
static int read_pair(const particle_reader *reader, const case_dict *dict, int pair[2])
{
    const entry *entry = dict_match(dict, "materials");
    const node *list = entry ? entry->value : NULL;
    int good = list && list->kind == NODE_LIST && !list->next && list->n == 2 && list->first;
    const node *name = good ? list->first : NULL;
    for (int i = 0; i < 2 && good; i++, name = name->next)
        good = name->kind == NODE_WORD || name->kind == NODE_STRING;
    if (!good) {
        key_error(reader->errors, dict, "materials", "accepted: the names of two materials (a b)");
        return 0;
    }
    for (int i = 0; i < 2; i++) {
        const char *text = i ? list->last->text : list->first->text;
        pair[i] = find_material(reader, dict, "materials", text);
    }
    return pair[0] >= 0 && pair[1] >= 0;
}

/* Where this model is not chosen its numbers would have no effect: a run without it is still a
 * good way to see what it does, so they may stay. Nothing is said when the case has mistakes: the
 * name of the model may be one. */
static void note_unused(const particle_reader *reader, const case_dict *dict, const char *key,
                        int used, const char *model)
{
    char path[512];
    if (used || !case_has(dict, key) || case_errors_count(reader->errors) > 0) return;
    key_path(dict, key, path, sizeof path);
    case_note(reader->errors, dict->file, case_dict_line(dict, key), "%s: has no effect with %s",
              path, model);
}

static void read_rolling(const particle_reader *reader, const case_dict *dict, dem_pair *pair)
{
    /* Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011) 269, doi:10.1016/j.powtec.2010.09.030,
     * use .3 of critical damping for the elastic-plastic model. */
    static const double damping = .3;
    const dem_rolling rolling = reader->param->rolling;
    const int some = rolling != DEM_ROLLING_NONE, elastic = rolling == DEM_ROLLING_EPSD;
    case_errors *errors = reader->errors;
    pair->rolling_friction = read_number(dict, "rollingFriction", "", some ? NULL : &(double){0},
                                         case_non_negative, errors);
    pair->rolling_damping =
        read_number(dict, "rollingDamping", "", &damping, case_non_negative, errors);
    note_unused(reader, dict, "rollingFriction", some, "rolling none");
    note_unused(reader, dict, "rollingDamping", elastic,
                some ? "rolling constantTorque" : "rolling none");
}

static dem_pair read_contact(const particle_reader *reader, const case_dict *dict)
{
    static const char *const known[] = {
        "materials",       "stiffness",      "stiffnessRatio",        "restitution", "friction",
        "rollingFriction", "rollingDamping", "cohesionEnergyDensity", NULL};
    case_errors *errors = reader->errors;
    const double *missing = reader->param->law == DEM_LINEAR ? NULL : &(double){0};
    const int cohesive = reader->param->cohesion != DEM_COHESION_NONE;
    dem_pair pair;
    case_known(dict, known, errors);
    pair.stiffness = read_number(dict, "stiffness", "N/m", missing, case_positive, errors);
    pair.stiffness_ratio =
        read_number(dict, "stiffnessRatio", "", &(double){1}, case_positive, errors);
    pair.restitution = read_number(dict, "restitution", "", NULL, restitution_range, errors);
    pair.friction = read_number(dict, "friction", "", NULL, case_non_negative, errors);
    read_rolling(reader, dict, &pair);
    pair.cohesion = read_number(dict, "cohesionEnergyDensity", "J/m3",
                                cohesive ? NULL : &(double){0}, case_non_negative, errors);
    note_unused(reader, dict, "cohesionEnergyDensity", cohesive, "cohesion none");
    return pair;
}

static int is_among(size_t n, const dem_species *species, int m)
{
    for (size_t i = 0; i < n; i++)
        if (species[i].material == m) return 1;
    return 0;
}

/* What puts material m among the particles, "insertion 'bed'". 0 when nothing does. */
static int inserted_by(const dem_param *param, int m, char text[DEM_NAME + 16])
{
    for (size_t i = 0; i < param->n_insertion; i++) {
        const dem_insertion *in = &param->insertion[i];
        if (in->n_species ? !is_among(in->n_species, in->species, m) : in->material != m) continue;
        snprintf(text, DEM_NAME + 16, "insertion '%s'", in->name);
        return 1;
    }
    for (size_t i = 0; i < param->n_feeder; i++) {
        const dem_feeder *in = &param->feeder[i];
        if (!is_among(in->n_species, in->species, m)) continue;
        snprintf(text, DEM_NAME + 16, "feeder '%s'", in->name);
        return 1;
    }
    return 0;
}

static const char *wall_of(const dem_param *param, int m)
{
    for (size_t i = 0; i < param->n_wall; i++)
        if (param->wall[i].material == m) return param->wall[i].name;
    return NULL;
}

static void check_given(const particle_reader *reader, int a, int b)
{
    const dem_param *param = reader->param;
    char first[DEM_NAME + 16], second[DEM_NAME + 16];
    if (!inserted_by(param, a, first)) return;
    if (inserted_by(param, b, second)) {
        if (b < a) return; /* said the other way round */
    } else {
        const char *wall = wall_of(param, b);
        if (!wall) return;
        snprintf(second, sizeof second, "wall '%s'", wall);
    }
    const char *na = param->material[a].name, *nb = param->material[b].name;
    key_error(reader->errors, reader->dict, "contacts",
              "no contact for the materials (%s %s), which can meet: %s and %s; accepted: a list "
              "with an entry { materials (%s %s); ... } for each such pair",
              na, nb, first, second, na, nb);
}

static const entry *contact_list(const particle_reader *reader)
{
    const entry *entry = dict_match(reader->dict, "contacts");
    const node *list = entry ? entry->value : NULL;
    int good = list && list->kind == NODE_LIST && !list->next;
    for (const node *member = good ? list->first : NULL; member; member = member->next)
        good = good && member->kind == NODE_DICT;
    if (good && (list->first || list->n == 0)) return entry;
    key_error(reader->errors, reader->dict, "contacts",
              "%s; accepted: a list of dictionaries ( { materials (a b); ... } ... )",
              entry ? "not such a list" : "missing");
    return NULL;
}

void read_contacts(particle_reader *reader)
{
    dem_param *param = reader->param;
    size_t n = param->n_material, first = n * n;
    if (!contact_list(reader) || n == 0) return;
    int before = case_errors_count(reader->errors);
    dem_pair *table = store_alloc(reader->storage->store, n * n * sizeof *table);
    int *line = store_alloc(reader->storage->store, n * n * sizeof *line);
    for (size_t i = 0; i < case_list_size(reader->dict, "contacts"); i++) {
        const case_dict *dict = case_list_at(reader->dict, "contacts", i);
        int m[2] = {0, 0}, named = read_pair(reader, dict, m);
        dem_pair pair = read_contact(reader, dict);
        if (!named) continue;
        size_t ab = (size_t)m[0] * n + (size_t)m[1], ba = (size_t)m[1] * n + (size_t)m[0];
        if (line[ab])
            key_error(reader->errors, dict, "materials", "given before, in line %d", line[ab]);
        table[ab] = table[ba] = pair;
        line[ab] = line[ba] = dict->line;
        if (first == n * n) first = ab;
    }
    if (case_errors_count(reader->errors) == before)
        for (size_t a = 0; a < n; a++)
            for (size_t b = 0; b < n; b++)
                if (!line[a * n + b]) check_given(reader, (int)a, (int)b);
    for (size_t ab = 0; ab < n * n; ab++) {
        if (!line[ab] && first < n * n)
            table[ab] = table[first];
        else if (!line[ab])
            table[ab] = (dem_pair){
                .restitution = 1, .stiffness = 1, .stiffness_ratio = 1}; /* nothing can meet */
    }
    param->pair = table;
}
