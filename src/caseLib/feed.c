/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * feed.c - what particles come and go during a run: feeders and outlets.
 */
#include "particles.h"

#include <math.h>
#include <string.h>

/* More particles than this from one feeder is a mistake of unit. */
#define MOST_PARTICLES 4e9

/* begin and end of a time window, s. */
static void read_window(const case_dict *dict, double *begin, double *end, case_errors *errors)
{
    *begin = read_number(dict, "begin", "s", &(double){0}, case_any, errors);
    *end = read_number(dict, "end", "s", &(double){INFINITY}, case_any, errors);
    if (*end <= *begin)
        key_error(errors, dict, "end", "found %g; accepted: after begin, %g s", *end, *begin);
}

static void read_rate(const case_dict *dict, dem_feeder *to, case_errors *errors)
{
    const int mass = case_has(dict, "massRate"), number = case_has(dict, "numberRate");
    if (mass == number)
        key_error(errors, dict, mass ? "numberRate" : "massRate",
                  "%s; accepted: either massRate in kg/s or numberRate in 1/s",
                  mass ? "given beside massRate" : "missing, and so is numberRate");
    if (mass)
        to->mass_rate = read_number(dict, "massRate", "kg/s", NULL, case_positive, errors);
    else if (number)
        to->number_rate = read_number(dict, "numberRate", "1/s", NULL, case_positive, errors);
}

static void read_feeder(particle_reader *reader, const case_dict *dict, dem_feeder *to, size_t k)
{
    static const char *const known[] = {"region", "massRate", "numberRate", "begin",    "end",
                                        "mass",   "number",   KIND_KEYS,    START_KEYS, NULL};
    particle_storage *storage = reader->storage;
    case_errors *errors = reader->errors;
    case_known(dict, known, errors);
    copy_name(reader, dict, to->name);
    read_rate(dict, to, errors);
    read_window(dict, &to->begin, &to->end, errors);
    to->mass = read_number(dict, "mass", "kg", &(double){INFINITY}, case_positive, errors);
    to->number = case_integer(dict, "number", &(long){-1}, 1, (long)MOST_PARTICLES, errors);
    const birth born = read_birth(dict, errors);
    memcpy(to->velocity, born.velocity, sizeof to->velocity);
    memcpy(to->angular_velocity, born.angular_velocity, sizeof to->angular_velocity);
    to->velocity_spread = born.velocity_spread;
    to->seed = born.seed;
    const kinds all = read_kinds(reader, dict);
    to->n_species = all.n;
    to->species = all.species;
    to->share_by_mass = all.by_mass;
    to->region = read_region(reader, dict, 1, to->lo, to->hi);
    if (to->region)
        check_fit(reader, dict, size_key(dict), most_diameter(all.n, all.species), to->lo, to->hi);
    storage->feeder[k] = place_of(storage->store, dict, "region");
    storage->feeder_diameter[k] = place_of(storage->store, dict, size_key(dict));
}

void read_feeders(particle_reader *reader)
{
    const case_dict *list = case_sub(reader->dict, "feeders", 0, reader->errors);
    particle_storage *storage = reader->storage;
    if (!list || list->n == 0) return;
    dem_feeder *feeder = store_alloc(storage->store, list->n * sizeof *feeder);
    storage->feeder = store_alloc(storage->store, list->n * sizeof *storage->feeder);
    storage->feeder_diameter =
        store_alloc(storage->store, list->n * sizeof *storage->feeder_diameter);
    reader->param->feeder = feeder;
    for (size_t i = 0; i < list->n; i++) {
        const case_dict *dict = case_sub(list, list->entry[i]->key, 1, reader->errors);
        const size_t k = reader->param->n_feeder;
        if (!dict) continue;
        read_feeder(reader, dict, &feeder[k], k);
        reader->param->n_feeder++;
    }
}

void read_outlets(particle_reader *reader)
{
    static const char *const known[] = {"region", "begin", "end", NULL};
    const case_dict *list = case_sub(reader->dict, "outlets", 0, reader->errors);
    particle_storage *storage = reader->storage;
    if (!list || list->n == 0) return;
    dem_outlet *outlet = store_alloc(storage->store, list->n * sizeof *outlet);
    storage->outlet = store_alloc(storage->store, list->n * sizeof *storage->outlet);
    reader->param->outlet = outlet;
    for (size_t i = 0; i < list->n; i++) {
        const case_dict *dict = case_sub(list, list->entry[i]->key, 1, reader->errors);
        const size_t k = reader->param->n_outlet;
        double lo[3], hi[3];
        if (!dict) continue;
        case_known(dict, known, reader->errors);
        copy_name(reader, dict, outlet[k].name);
        read_window(dict, &outlet[k].begin, &outlet[k].end, reader->errors);
        outlet[k].region = read_region(reader, dict, 0, lo, hi);
        storage->outlet[k] = place_of(storage->store, dict, "region");
        reader->param->n_outlet++;
    }
}
