/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * files.c - the small files of a case: system/controlDict, constant/transportProperties,
 * constant/g.
 *
 * These belong to OpenFOAM, which allows keys there that nobody here knows. Only a key that looks
 * like a misspelling of one that is read, and that one is absent, is an error.
 */
#include "tree.h"
#include "files.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *case_version(void)
{
    return FELMI_VERSION;
}

case_dict *case_read_file(const char *directory, const char *name, case_errors *errors)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s", directory, name) >= (int)sizeof path) {
        case_error(errors, directory, 0, "the name of the case directory is too long");
        return NULL;
    }
    return case_dict_read(path, errors);
}

int case_file_exists(const char *directory, const char *name)
{
    char path[4096];
    return snprintf(path, sizeof path, "%s/%s", directory, name) < (int)sizeof path &&
           access(path, F_OK) == 0;
}

void suspect_keys(const case_dict *dict, const char *const *known, case_errors *errors)
{
    for (size_t i = 0; i < dict->n; i++) {
        const char *key = dict->entry[i]->key, *near = case_nearest(key, known);
        if (near && strcmp(key, near) != 0 && !dict->entry[i]->used && !case_has(dict, near))
            key_error(errors, dict, key, "unknown key; did you mean '%s'?", near);
    }
}

/* Digits of fields where writePrecision is absent: OpenFOAM's own 6 would lose what its and our
 * tools find by differences of pressure. */
#define WRITE_PRECISION 10

/* ---- control --------------------------------------------------------------------------------- */

/* Largest (or smallest) time among the directories of a case; 0 when there is none. */
static double time_directory(const char *directory, int latest)
{
    double found = latest ? -INFINITY : INFINITY;
    DIR *folder = opendir(directory);
    struct dirent *item;
    while (folder && (item = readdir(folder))) {
        char *end;
        double time = strtod(item->d_name, &end);
        if (end == item->d_name || *end || !isfinite(time)) continue;
        found = latest ? fmax(found, time) : fmin(found, time);
    }
    if (folder) closedir(folder);
    return isfinite(found) ? found : 0;
}

/* latestTime is OpenFOAM's default. */
static case_start start_from(const case_dict *dict, case_errors *errors)
{
    static const char *const from[] = {[CASE_START_TIME] = "startTime",
                                       [CASE_FIRST_TIME] = "firstTime",
                                       [CASE_LATEST_TIME] = "latestTime",
                                       NULL};
    return (case_start)case_choice(dict, "startFrom", from, CASE_LATEST_TIME, errors);
}

static double start_time_of(const case_dict *dict, const char *directory, case_start from,
                            case_errors *errors)
{
    if (from == CASE_START_TIME) return read_number(dict, "startTime", "s", NULL, case_any, errors);
    return time_directory(directory, from == CASE_LATEST_TIME);
}

double case_start_time(const case_dict *dict, const char *directory, case_errors *errors)
{
    return start_time_of(dict, directory, start_from(dict, errors), errors);
}

/* s; NAN in error */
static double read_interval(const case_dict *dict, const case_control *control, case_errors *errors)
{
    static const char *const kinds[] = {"timeStep", "runTime", "adjustableRunTime", "adjustable",
                                        NULL};
    int before = case_errors_count(errors);
    int kind = case_choice(dict, "writeControl", kinds, 0, errors);
    if (case_errors_count(errors) > before) return NAN; /* the kind of interval is not known */
    if (kind != 0) return read_number(dict, "writeInterval", "s", NULL, case_positive, errors);
    if (control->adjust_time_step)
        key_error(errors, dict, case_has(dict, "writeControl") ? "writeControl" : "adjustTimeStep",
                  "output every so many steps does not go with adjustTimeStep; accepted: "
                  "adjustableRunTime, runTime");
    return (double)case_integer(dict, "writeInterval", NULL, 1, 1000000000, errors) *
           control->delta_t;
}

static void read_restart(const case_dict *dict, case_control *control, case_errors *errors)
{
    static const char *const known[] = {"write", "interval", "keep", NULL};
    const case_dict *sub = case_sub(dict, "restart", 0, errors);
    control->restart_write = 1;
    control->restart_interval = control->write_interval;
    control->restart_keep = 2; /* the newest, and one to go back to */
    if (!sub) return;
    case_known(sub, known, errors);
    control->restart_write = case_bool(sub, "write", &(int){1}, errors);
    control->restart_interval =
        read_number(sub, "interval", "s", &control->write_interval, case_positive, errors);
    control->restart_keep = (int)case_integer(sub, "keep", &(long){2}, 0, 1000000000, errors);
}

/* What is right in OpenFOAM but not followed here is said, not passed over. */
static void note_ignored(const case_dict *dict, case_errors *errors)
{
    static const char *const formats[] = {"ascii", "binary", NULL};
    static const char *const names[] = {"general", "fixed", "scientific", NULL};
    const char *file = dict->file;
    if (case_choice(dict, "writeFormat", formats, 0, errors) == 1)
        case_note(errors, file, case_dict_line(dict, "writeFormat"),
                  "writeFormat: felmiMAC writes fields in ascii, whatever is said here");
    if (case_choice(dict, "timeFormat", names, 0, errors) != 0)
        case_note(errors, file, case_dict_line(dict, "timeFormat"),
                  "timeFormat: felmiMAC and felmiDEM name times in the general format, whatever is "
                  "said here");
    if (case_integer(dict, "purgeWrite", &(long){0}, 0, 1000000000, errors) > 0)
        case_note(errors, file, case_dict_line(dict, "purgeWrite"),
                  "purgeWrite: felmiMAC and felmiDEM keep the output of all times");
    const node *value =
        case_has(dict, "writeCompression") ? dict_match(dict, "writeCompression")->value : NULL;
    static const char *const off[] = {"off", "no", "false", "uncompressed", NULL};
    for (int i = 0; value && value->text && off[i]; i++)
        if (strcmp(value->text, off[i]) == 0) value = NULL;
    if (value)
        case_note(errors, file, case_dict_line(dict, "writeCompression"),
                  "writeCompression: felmiMAC writes fields uncompressed, whatever is said here");
}

static void read_times(const case_dict *dict, case_control *control, case_errors *errors)
{
    *control = (case_control){.max_co = INFINITY,
                              .max_delta_t = INFINITY,
                              .time_precision = 6,
                              .write_precision = WRITE_PRECISION};
    control->end_time = read_number(dict, "endTime", "s", NULL, case_any, errors);
    control->delta_t = read_number(dict, "deltaT", "s", NULL, case_positive, errors);
}

static void check_end(const case_dict *dict, const case_control *control, case_errors *errors)
{
    if (control->end_time <= control->start_time)
        key_error(errors, dict, "endTime", "found %g; accepted: a time after the start, %g s",
                  control->end_time, control->start_time);
}

void case_control_of(const case_dict *dict, double start_time, case_control *control,
                     case_errors *errors)
{
    read_times(dict, control, errors);
    control->start_time = start_time;
    control->write_interval = control->end_time - start_time;
    check_end(dict, control, errors);
    read_restart(dict, control, errors);
}

static void read_control(const char *directory, int restarts, case_control *control,
                         case_errors *errors)
{
    static const char *const known[] = {
        "application",       "startFrom",      "startTime",    "stopAt",
        "endTime",           "deltaT",         "writeControl", "writeInterval",
        "writeFormat",       "writePrecision", "timeFormat",   "writeCompression",
        "timePrecision",     "adjustTimeStep", "maxCo",        "maxDeltaT",
        "purgeWrite",        "restart",        "functions",    "libs",
        "runTimeModifiable", "graphFormat",    "FoamFile",     NULL};
    static const char *const stop[] = {"endTime", NULL};
    *control = (case_control){.end_time = NAN, .delta_t = NAN, .write_interval = NAN};
    case_dict *dict = case_read_file(directory, "system/controlDict", errors);
    if (!dict) return;
    suspect_keys(dict, known, errors);
    case_choice(dict, "stopAt", stop, 0, errors);
    read_times(dict, control, errors);
    control->start_from = start_from(dict, errors);
    control->start_time = start_time_of(dict, directory, control->start_from, errors);
    if (restarts) case_find_restart(directory, control);
    if (!control->restart[0]) check_end(dict, control, errors);
    control->adjust_time_step = case_bool(dict, "adjustTimeStep", &(int){0}, errors);
    control->write_interval = read_interval(dict, control, errors);
    control->max_co = read_number(dict, "maxCo", "", &(double){1}, case_positive, errors);
    control->max_delta_t =
        read_number(dict, "maxDeltaT", "s", &(double){INFINITY}, case_positive, errors);
    control->time_precision = (int)case_integer(dict, "timePrecision", &(long){6}, 1, 17, errors);
    control->write_precision =
        (int)case_integer(dict, "writePrecision", &(long){WRITE_PRECISION}, 1, 17, errors);
    read_restart(dict, control, errors);
    note_ignored(dict, errors);
    case_dict_free(dict);
}

void case_read_control(const char *directory, case_control *control, case_errors *errors)
{
    read_control(directory, 0, control, errors);
}

void case_read_run(const char *directory, case_control *control, case_errors *errors)
{
    read_control(directory, 1, control, errors);
}

void case_time_name(const case_control *control, double time, double apart, char *name, size_t size)
{
    char text[32];
    for (int digits = control->time_precision; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, time);
        if (!(fabs(strtod(text, NULL) - time) > apart)) break;
    }
    snprintf(name, size, "%s", text);
}

/* ---- fluid ----------------------------------------------------------------------------------- */

void case_read_gravity(const char *directory, double gravity[3], case_errors *errors)
{
    static const char *const known[] = {"FoamFile", "dimensions", "value", NULL};
    gravity[0] = gravity[1] = gravity[2] = 0;
    if (!case_file_exists(directory, "constant/g")) return; /* weightless */
    case_dict *dict = case_read_file(directory, "constant/g", errors);
    if (!dict) return;
    suspect_keys(dict, known, errors);
    read_vector(dict, "value", "m/s2", NULL, gravity, errors);
    case_dict_free(dict);
}

void case_fluid_of(const case_dict *dict, int newtonian, case_fluid *fluid, case_errors *errors)
{
    static const char *const models[] = {"Newtonian", NULL};
    *fluid = (case_fluid){.nu = NAN};
    if (newtonian) case_choice(dict, "transportModel", models, 0, errors);
    fluid->rho = read_number(dict, "rho", "kg/m3", NULL, case_positive, errors);
    if (newtonian || case_has(dict, "nu"))
        fluid->nu = read_number(dict, "nu", "m2/s", NULL, case_positive, errors);
}

void case_read_fluid(const char *directory, case_fluid *fluid, case_errors *errors)
{
    static const char *const known[] = {"FoamFile", "transportModel", "rho", "nu", NULL};
    *fluid = (case_fluid){.rho = NAN, .nu = NAN};
    case_dict *dict = case_read_file(directory, "constant/transportProperties", errors);
    if (dict) {
        suspect_keys(dict, known, errors);
        case_fluid_of(dict, 1, fluid, errors);
        case_dict_free(dict);
    }
    case_read_gravity(directory, fluid->gravity, errors);
}

/* ---- coupling -------------------------------------------------------------------------------- */

void case_read_coupling(const case_dict *dict, cpl_param *param, case_errors *errors)
{
    static const char *const known[] = {
        "map", "packingLimit", "drag", "scheme", "carryGain", "addedMassAbove", "ledgerTolerance",
        NULL};
    static const char *const maps[] = {
        [CPL_CENTRE] = "centre", [CPL_DIVIDED_CUBE] = "dividedCube", NULL};
    static const char *const drags[] = {[CPL_DRAG_NONE] = "none",
                                        [CPL_ERGUN_WEN_YU] = "ErgunWenYu",
                                        [CPL_DI_FELICE] = "DiFelice",
                                        [CPL_SCHILLER_NAUMANN] = "SchillerNaumann",
                                        NULL};
    static const char *const schemes[] = {
        [CPL_SEMI_IMPLICIT] = "semiImplicit", [CPL_EXPLICIT] = "explicit", NULL};
    const case_range inside = {0, 1, 1, 1}, share = {0, 1, 1, 0};
    *param = cpl_param_default();
    case_known(dict, known, errors);
    param->map = (cpl_map_model)case_choice(dict, "map", maps, (int)param->map, errors);
    param->drag = (cpl_drag_law)case_choice(dict, "drag", drags, (int)param->drag, errors);
    param->scheme = (cpl_scheme)case_choice(dict, "scheme", schemes, (int)param->scheme, errors);
    param->packing_limit =
        read_number(dict, "packingLimit", "", &param->packing_limit, inside, errors);
    param->carry_gain = read_number(dict, "carryGain", "", &param->carry_gain, share, errors);
    param->added_mass_above = read_number(dict, "addedMassAbove", "", &param->added_mass_above,
                                          case_non_negative, errors);
    param->ledger_tolerance =
        read_number(dict, "ledgerTolerance", "", &param->ledger_tolerance, case_positive, errors);
}
