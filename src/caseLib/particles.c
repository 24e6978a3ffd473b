/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * particles.c - constant/demProperties as the parameters of the particle engine.
 *
 * Order matters: the domain first (regions are compared with it), then materials, walls, what makes
 * and takes particles, and last the contacts, of which those that can happen must be given.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

place place_of(store *store, const case_dict *dict, const char *key)
{
    const entry *entry = dict_match(dict, key);
    return (place){store_text(store, dict->file, strlen(dict->file)),
                   entry ? entry->line : dict->line};
}

void copy_name(const particle_reader *reader, const case_dict *dict, char name[DEM_NAME])
{
    snprintf(name, DEM_NAME, "%s", dict->name);
    if (strlen(dict->name) >= DEM_NAME)
        key_error(reader->errors, dict, "", "a name longer than %d characters", DEM_NAME - 1);
}

/* ---- domain ---------------------------------------------------------------------------------- */

/* periodic (yes no no) */
static void read_periodic(particle_reader *reader, const case_dict *dict)
{
    static const char *const words[] = {"no", "yes", "false", "true", "off", "on", NULL};
    const entry *entry = dict_match(dict, "periodic");
    const node *list = entry ? entry->value : NULL;
    const node *at = list && list->kind == NODE_LIST && list->n == 3 ? list->first : NULL;
    int value[3], n = 0;
    if (!entry) return;
    for (; at && at->kind == NODE_WORD; at = at->next, n++) {
        int i = 0;
        while (words[i] && strcmp(words[i], at->text) != 0) i++;
        if (!words[i]) break;
        value[n] = i % 2;
    }
    if (n != 3 || list->next) {
        key_error(reader->errors, dict, "periodic", "accepted: three of yes, no, as (yes no no)");
        return;
    }
    for (int a = 0; a < 3; a++) {
        if (reader->mesh && value[a] != reader->param->periodic[a])
            key_error(reader->errors, dict, "periodic",
                      "found %s in %c, but the patches of the mesh "
                      "say %s",
                      value[a] ? "yes" : "no", "xyz"[a], value[a] ? "no" : "yes");
        reader->param->periodic[a] = value[a];
    }
}

/* The mesh's box, unless the dictionary narrows it. */
static void read_domain(particle_reader *reader)
{
    static const char *const known[] = {"min", "max", "periodic", NULL};
    const case_mesh *mesh = reader->mesh;
    dem_param *param = reader->param;
    case_errors *errors = reader->errors;
    int meshed = mesh && mesh->cells[0] > 0; /* 0: it could not be read, which has been said */
    for (int a = 0; a < 3; a++) {
        param->lo[a] = meshed ? mesh->lo[a] : NAN;
        param->hi[a] = meshed ? mesh->hi[a] : NAN;
        param->periodic[a] = meshed && mesh->side[2 * a].type == CASE_CYCLIC;
    }
    const case_dict *dict = case_sub(reader->dict, "domain", !mesh, errors);
    reader->storage->domain = place_of(reader->storage->store, reader->dict, "domain");
    if (!dict) return;
    case_known(dict, known, errors);
    read_vector(dict, "min", "m", meshed ? mesh->lo : NULL, param->lo, errors);
    read_vector(dict, "max", "m", meshed ? mesh->hi : NULL, param->hi, errors);
    read_periodic(reader, dict);
    for (int a = 0; a < 3; a++) {
        double slack = meshed ? 1e-9 * (mesh->hi[a] - mesh->lo[a]) : 0;
        if (param->hi[a] <= param->lo[a])
            key_error(errors, dict, "max", "found %g in %c; accepted: above min, %g m",
                      param->hi[a], "xyz"[a], param -> lo[a]);
        if (meshed && (param->lo[a] < mesh->lo[a] - slack || param->hi[a] > mesh->hi[a] + slack))
            key_error(errors, dict, "",
                      "from %g to %g m in %c it reaches beyond the mesh, %g to %g m", param->lo[a],
                      param->hi[a], "xyz"[a], mesh -> lo[a], mesh -> hi[a]);
    }
}

/* ---- all ------------------------------------------------------------------------------------- */

static void read_time_step(particle_reader *reader)
{
    static const char *const known[] = {"fixed", "stepsPerPeriod", "maximum", "impactSpeed", NULL};
    /* Symplectic Euler is stable for more than pi steps in a period of the contact's spring. */
    const case_range stable = {3.141592653589793, INFINITY, 1, 1};
    const case_dict *dict = case_sub(reader->dict, "timeStep", 0, reader->errors);
    dem_param *param = reader->param;
    if (!dict) return;
    case_known(dict, known, reader->errors);
    param->fixed_step =
        read_number(dict, "fixed", "s", &param->fixed_step, case_positive, reader->errors);
    param->steps_per_period =
        read_number(dict, "stepsPerPeriod", "", &param->steps_per_period, stable, reader->errors);
    param->time_step =
        read_number(dict, "maximum", "s", &param->time_step, case_positive, reader->errors);
    param->impact_speed = read_number(dict, "impactSpeed", "m/s", &param->impact_speed,
                                      case_non_negative, reader->errors);
}

static void read_neighbour(particle_reader *reader)
{
    static const char *const known[] = {"skin", NULL};
    /* A particle's list holds those within 1 + skin diameters: at 2 it is 27 times the volume of a
     * contact's reach, and about a hundred particles long. More is a length in metres or per cent
     * by mistake, and memory to no use. */
    const case_range sensible = {0, 2, 1, 0};
    const case_dict *dict = case_sub(reader->dict, "neighbour", 0, reader->errors);
    if (!dict) return;
    case_known(dict, known, reader->errors);
    reader->param->skin =
        read_number(dict, "skin", "", &reader->param->skin, sensible, reader->errors);
}

static void read_parallel(particle_reader *reader)
{
    static const char *const known[] = {"imbalance", NULL};
    const case_range above_one = {1, INFINITY, 1, 1};
    const case_dict *dict = case_sub(reader->dict, "parallel", 0, reader->errors);
    if (!dict) return;
    case_known(dict, known, reader->errors);
    reader->param->imbalance =
        read_number(dict, "imbalance", "", &reader->param->imbalance, above_one, reader->errors);
}

/* Where sampled surfaces are kept, from the top of the case; `none`: nowhere. Without surfaces
 * there is nothing to keep. */
static void read_sdf(particle_reader *reader)
{
    static const char *const known[] = {"cache", NULL};
    const case_dict *dict = case_sub(reader->dict, "sdf", 0, reader->errors);
    const char *cache = "constant/sdf";
    int sampled = 0;
    if (dict) {
        case_known(dict, known, reader->errors);
        cache = case_word(dict, "cache", cache, 0, reader->errors);
    }
    for (const surface *s = reader->storage->surfaces; s; s = s->next) sampled |= s->samples;
    if (!cache || !sampled || strcmp(cache, "none") == 0) return;
    char path[4096];
    snprintf(path, sizeof path, "%s%s%s", *cache == '/' ? "" : reader->directory,
             *cache == '/' ? "" : "/", cache);
    reader->param->sdf_cache = keep_text(reader, path);
}

static void read_laws(particle_reader *reader)
{
    static const char *const laws[] = {[DEM_LINEAR] = "linear", [DEM_HERTZ] = "hertz", NULL};
    static const char *const rolling[] = {[DEM_ROLLING_NONE] = "none",
                                          [DEM_ROLLING_CONSTANT] = "constantTorque",
                                          [DEM_ROLLING_EPSD] = "elasticPlastic",
                                          NULL};
    static const char *const cohesion[] = {
        [DEM_COHESION_NONE] = "none", [DEM_COHESION_SJKR] = "sjkr", NULL};
    dem_param *param = reader->param;
    const case_dict *dict = reader->dict;
    param->law = (dem_law)case_choice(dict, "contactLaw", laws, -1, reader->errors);
    param->rolling =
        (dem_rolling)case_choice(dict, "rolling", rolling, DEM_ROLLING_NONE, reader->errors);
    param->cohesion =
        (dem_cohesion)case_choice(dict, "cohesion", cohesion, DEM_COHESION_NONE, reader->errors);
    param->balance = case_bool(dict, "balance", &(int){0}, reader->errors);
}

void case_read_dem(const case_dict *dict, const char *directory, const case_mesh *mesh,
                   const double gravity[3], case_dem *dem, case_errors *errors)
{
    static const char *const known[] = {"contactLaw", "rolling", "cohesion", "materials",
                                        "contacts",   "walls",   "sdf",      "insertion",
                                        "feeders",    "outlets", "timeStep", "neighbour",
                                        "domain",     "balance", "parallel", NULL};
    store *store = store_new();
    particle_storage *storage = store_alloc(store, sizeof *storage);
    storage->store = store;
    *dem = (case_dem){.param = dem_param_default(), .storage = storage};
    particle_reader reader = {.dict = dict,
                              .directory = directory,
                              .mesh = mesh,
                              .param = &dem->param,
                              .storage = storage,
                              .errors = errors};
    memcpy(dem->param.gravity, gravity, sizeof dem->param.gravity);
    case_known(dict, known, errors);
    read_laws(&reader);
    read_domain(&reader);
    read_materials(&reader);
    read_walls(&reader);
    read_sdf(&reader);
    read_insertions(&reader);
    read_feeders(&reader);
    read_outlets(&reader);
    read_contacts(&reader);
    read_time_step(&reader);
    read_neighbour(&reader);
    read_parallel(&reader);
    storage->contacts = place_of(store, dict, "contacts");
}

void case_dem_free(case_dem *dem, int shapes)
{
    particle_storage *storage = dem->storage;
    if (!storage) return;
    for (size_t i = 0; shapes && i < dem->param.n_wall; i++) dem_sdf_free(dem->param.wall[i].shape);
    for (size_t i = 0; shapes && i < dem->param.n_insertion; i++)
        dem_sdf_free(dem->param.insertion[i].region);
    for (size_t i = 0; shapes && i < dem->param.n_feeder; i++)
        dem_sdf_free(dem->param.feeder[i].region);
    for (size_t i = 0; shapes && i < dem->param.n_outlet; i++)
        dem_sdf_free(dem->param.outlet[i].region);
    store_free(storage->store);
    *dem = (case_dem){0};
}
