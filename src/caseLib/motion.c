/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * motion.c - how a wall moves: `motion`, one dictionary or a list of them, applied one after the
 * other. Angles are in degrees, as everywhere in OpenFOAM's dictionaries; the engine has radians.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI     3.14159265358979323846
#define DEGREE (PI / 180)

static const char *const type_words[] = {[DEM_TRANSLATION] = "translation",
                                         [DEM_ROTATION] = "rotation",
                                         [DEM_OSCILLATION] = "oscillation",
                                         [DEM_ROCKING] = "rocking",
                                         [DEM_TABLE] = "table",
                                         NULL};

#define WINDOW "type", "begin", "end"
static const char *const keys[][10] = {
    [DEM_TRANSLATION] = {WINDOW, "velocity", "ramp", NULL},
    [DEM_ROTATION] = {WINDOW, "axis", "origin", "rate", "rpm", "ramp", NULL},
    [DEM_OSCILLATION] = {WINDOW, "amplitude", "frequency", "phase", NULL},
    [DEM_ROCKING] = {WINDOW, "axis", "origin", "amplitude", "frequency", "phase", NULL},
    [DEM_TABLE] = {WINDOW, "origin", "rows", "file", NULL},
};

/* A vector that is not zero. */
static void direction(const case_dict *dict, const char *key, const char *unit, double value[3],
                      case_errors *errors)
{
    if (read_vector(dict, key, unit, NULL, value, errors) && value[0] == 0 && value[1] == 0 &&
        value[2] == 0)
        key_error(errors, dict, key, "found (0 0 0); accepted: a vector that is not zero%s%s",
                  *unit ? ", in " : "", unit);
}

static double read_rate(const case_dict *dict, case_errors *errors)
{
    const int rate = case_has(dict, "rate"), rpm = case_has(dict, "rpm");
    if (rate == rpm)
        key_error(errors, dict, rate ? "rpm" : "rate",
                  "%s; accepted: either rate in rad/s or rpm in 1/min",
                  rate ? "given beside rate" : "missing, and so is rpm");
    if (rate) return read_number(dict, "rate", "rad/s", NULL, case_any, errors);
    return rpm ? 2 * PI / 60 * read_number(dict, "rpm", "1/min", NULL, case_any, errors) : 0;
}

static void read_swing(const case_dict *dict, dem_motion *motion, case_errors *errors)
{
    motion->frequency = read_number(dict, "frequency", "Hz", NULL, case_positive, errors);
    motion->phase = DEGREE * read_number(dict, "phase", "degrees", &(double){0}, case_any, errors);
}

static void read_table(particle_reader *reader, const case_dict *dict, dem_motion *motion)
{
    static const char *const accepted =
        "two or more rows (t x y z) or (t x y z rx ry rz) of the time in s, increasing, the shift "
        "in m, and the rotation vector in degrees";
    size_t n, width;
    const double *row = read_rows(reader, dict, 4, 7, 2, accepted, &n, &width);
    if (!row) return;
    store *store = reader->storage->store;
    double *time = store_alloc(store, n * sizeof *time);
    double(*shift)[3] = store_alloc(store, n * sizeof *shift);
    double(*turn)[3] = width == 7 ? store_alloc(store, n * sizeof *turn) : NULL;
    for (size_t i = 0; i < n; i++, row += width) {
        time[i] = row[0];
        for (int a = 0; a < 3; a++) shift[i][a] = row[1 + a];
        for (int a = 0; turn && a < 3; a++) turn[i][a] = DEGREE * row[4 + a];
        if (i && !(time[i] > time[i - 1]))
            key_error(reader->errors, dict, case_has(dict, "rows") ? "rows" : "file",
                      "the time of row %zu, counted from 0, is %g s, not above that of the row "
                      "before, %g s",
                      i, time[i], time[i - 1]);
    }
    motion->n = n;
    motion->time = time;
    motion->shift = (const double(*)[3])shift;
    motion->turn = (const double(*)[3])turn;
}

static void read_motion(particle_reader *reader, const case_dict *dict, dem_motion *motion)
{
    static const double zero[3] = {0, 0, 0};
    case_errors *errors = reader->errors;
    const int before = case_errors_count(errors);
    *motion = dem_motion_default();
    motion->kind = (dem_motion_kind)case_choice(dict, "type", type_words, -1, errors);
    if (case_errors_count(errors) > before) return;
    case_known(dict, keys[motion->kind], errors);
    motion->begin = read_number(dict, "begin", "s", &(double){0}, case_any, errors);
    motion->end = read_number(dict, "end", "s", &(double){INFINITY}, case_any, errors);
    if (motion->end <= motion->begin)
        key_error(errors, dict, "end", "found %g; accepted: after begin, %g s", motion->end,
                  motion->begin);
    motion->ramp = read_number(dict, "ramp", "s", &(double){0}, case_non_negative, errors);
    if (case_has(dict, "origin")) read_vector(dict, "origin", "m", zero, motion->origin, errors);
    switch (motion->kind) {
    case DEM_TRANSLATION:
        read_vector(dict, "velocity", "m/s", NULL, motion->vector, errors);
        break;
    case DEM_ROTATION:
        direction(dict, "axis", "", motion->vector, errors);
        motion->rate = read_rate(dict, errors);
        break;
    case DEM_OSCILLATION:
        direction(dict, "amplitude", "m", motion->vector, errors);
        read_swing(dict, motion, errors);
        break;
    case DEM_ROCKING:
        direction(dict, "axis", "", motion->vector, errors);
        motion->amplitude =
            DEGREE * read_number(dict, "amplitude", "degrees", NULL, case_any, errors);
        read_swing(dict, motion, errors);
        break;
    case DEM_TABLE:
        read_table(reader, dict, motion);
        break;
    }
}

void read_motions(particle_reader *reader, const case_dict *dict, dem_wall *wall)
{
    const entry *entry = dict_match(dict, "motion");
    const node *value = entry ? entry->value : NULL;
    if (!entry) return;
    const int one = value && value->kind == NODE_DICT;
    const size_t n = one ? 1 : case_list_size(dict, "motion");
    if (n == 0) {
        key_error(reader->errors, dict, "motion",
                  "accepted: a dictionary { type ...; } or a list of such ( { type ...; } ... )");
        return;
    }
    dem_motion *motion = store_alloc(reader->storage->store, n * sizeof *motion);
    for (size_t i = 0; i < n; i++)
        read_motion(reader, one ? value->dict : case_list_at(dict, "motion", i), &motion[i]);
    wall->n_motion = n;
    wall->motion = motion;
}
