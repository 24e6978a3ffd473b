/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * case.h - reads an OpenFOAM-style case directory into parameter structs.
 *
 * One place for keywords, defaults, ranges and error messages. The reader understands OpenFOAM's
 * dictionary grammar: comments, nested dictionaries, lists, dimensions, #include, $macro. Errors
 * are collected, so that a user sees all of them at once, each as
 *     <file>:<line>: <key>: what was found; what is accepted; the nearest match.
 *
 * Getters return the default, or in error NAN (numbers) or the first choice, and never stop; of a
 * NULL dictionary, whose file could not be read, they do so without another message.
 * Every function that can fail takes a case_errors; after reading, case_errors_count() > 0 means
 * that nothing may be run. Serial: read on each rank.
 */
#ifndef CASE_H
#define CASE_H

#include <stddef.h>
#include "dem.h"
#include "cpl.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CASE_NAME 64

/* Version of felmiFoam, as "0.1.0". */
const char *case_version(void);

/* ---- errors ---------------------------------------------------------------------------------- */

typedef struct case_errors case_errors;
case_errors *case_errors_new(void);
void case_errors_free(case_errors *errors);
int case_errors_count(const case_errors *errors);
/* All messages, one a line. Owned by errors. */
const char *case_errors_text(const case_errors *errors);
void case_error(case_errors *errors, const char *file, int line, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* Notes: what a user should know but what does not forbid a run. Not counted as errors. */
void case_note(case_errors *errors, const char *file, int line, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
const char *case_notes_text(const case_errors *errors);
/* Nearest of the NULL-terminated words, NULL if none is near enough to be a misspelling. */
const char *case_nearest(const char *word, const char *const *words);

/* ---- dictionaries ---------------------------------------------------------------------------- */

typedef struct case_dict case_dict;

/* Parse a file, or a text that is called `name` in messages. A text may hold lines `#line N` that
 * set the line number of the entry after it (used when OpenFOAM hands over its own dictionaries).
 * NULL on error. */
case_dict *case_dict_read(const char *path, case_errors *errors);
/* The same of a file of a case, <directory>/<name>. */
case_dict *case_read_file(const char *directory, const char *name, case_errors *errors);
int case_file_exists(const char *directory, const char *name);
case_dict *case_dict_parse(const char *text, const char *name, case_errors *errors);
void case_dict_free(case_dict *dict);
/* File it was read from, and its own key ("" at the top). */
const char *case_dict_file(const case_dict *dict);
const char *case_dict_name(const case_dict *dict);
int case_dict_line(const case_dict *dict, const char *key); /* 0 if absent */

/* Entries in order. */
size_t case_dict_size(const case_dict *dict);
const char *case_dict_key(const case_dict *dict, size_t i);
int case_has(const case_dict *dict, const char *key);
/* Sub-dictionary, or NULL; required: an error if absent. */
const case_dict *case_sub(const case_dict *dict, const char *key, int required,
                          case_errors *errors);
/* An entry that is a list of dictionaries: its length (0 if absent), and its i-th member. */
size_t case_list_size(const case_dict *dict, const char *key);
const case_dict *case_list_at(const case_dict *dict, const char *key, size_t i);

/* Values. `missing` non-NULL: the default of an optional key; NULL: required. Range is inclusive
 * unless `open_lo`; numbers must be finite. A dimension set before a number is read over. */
typedef struct case_range {
    double lo, hi;
    int open_lo, open_hi;
} case_range;
extern const case_range case_any, case_positive, case_non_negative, case_fraction /* [0,1] */;
double case_scalar(const case_dict *dict, const char *key, const double *missing, case_range range,
                   case_errors *errors);
long case_integer(const case_dict *dict, const char *key, const long *missing, long lo, long hi,
                  case_errors *errors);
int case_bool(const case_dict *dict, const char *key, const int *missing, case_errors *errors);
void case_vector(const case_dict *dict, const char *key, const double missing[3], double value[3],
                 case_errors *errors);
/* A word or quoted string; NULL if absent and not required or in error. */
const char *case_word(const case_dict *dict, const char *key, const char *missing, int required,
                      case_errors *errors);
/* Index of the word in the NULL-terminated list `accepted`; `missing` < 0: required. */
int case_choice(const case_dict *dict, const char *key, const char *const *accepted, int missing,
                case_errors *errors);
/* Numbers of a flat or nested list, e.g. vertices, or one number: count; *value malloced, NULL in
 * error, and the key is required. "nonuniform List<vector> N" before the list is read over. A file
 * that is a bare list (polyMesh/points, a vectorField) has it under the key "". */
size_t case_numbers(const case_dict *dict, const char *key, double **value, case_errors *errors);
/* Every key of dict must be in `known` (NULL-terminated), or it is an error with the nearest match.
 * Let through: keys that a macro has used, and at the top FoamFile and `variables`. */
void case_known(const case_dict *dict, const char *const *known, case_errors *errors);

/* ---- a case ---------------------------------------------------------------------------------- */

/* system/controlDict */
typedef enum case_start { CASE_START_TIME, CASE_FIRST_TIME, CASE_LATEST_TIME } case_start;
typedef struct case_control {
    case_start start_from;
    double start_time, end_time, delta_t, write_interval;
    int adjust_time_step;
    double max_co, max_delta_t;
    int time_precision;      /* of the names of time directories */
    int write_precision;     /* digits of numbers in fields */
    int restart_write;       /* nonzero: write restart files, */
    double restart_interval; /* s, > 0, */
    int restart_keep;        /* so many of them, 0: all */
    char restart[CASE_NAME]; /* file in <directory>/restart to go on from, or "" */
} case_control;
/* Notes what OpenFOAM knows and the C programs do not follow: purgeWrite, binary fields. */
void case_read_control(const char *directory, case_control *control, case_errors *errors);
/* The same for a run that goes on from a restart file if there is one, as case_find_restart says;
 * its time may then be past end_time. */
void case_read_run(const char *directory, case_control *control, case_errors *errors);
/* Where startFrom lets a run start: a key, or the time directories there are. */
double case_start_time(const case_dict *dict, const char *directory, case_errors *errors);
/* Of a controlDict that has been read only what any solver needs: deltaT, endTime after start_time,
 * and restart. The rest as if output were wanted at the end alone. */
void case_control_of(const case_dict *dict, double start_time, case_control *control,
                     case_errors *errors);
/* Where a run that can go on from a restart file starts: finds control->restart, and start_time is
 * then its time. */
void case_find_restart(const char *directory, case_control *control);
/* The latest file in <directory>/restart up to the time `most`, s: its time, or NAN. */
double case_restart_latest(const char *directory, double most, char name[CASE_NAME]);
/* Move restart files that are not of the run that starts now to <directory>/restart.old: how many,
 * or -1 (errno). */
int case_set_restarts_aside(const char *directory, const case_control *control);
/* Name of a time directory as OpenFOAM writes it, with more digits where it would be off by more
 * than `apart`, so that two times do not share a name. */
void case_time_name(const case_control *control, double time, double apart, char *name,
                    size_t size);

/* system/blockMeshDict of one block of equal cells aligned with the axes */
typedef enum case_patch_type {
    CASE_PATCH,
    CASE_WALL,
    CASE_SYMMETRY,
    CASE_EMPTY,
    CASE_CYCLIC
} case_patch_type;
typedef struct case_side { /* -x, +x, -y, +y, -z, +z */
    char patch[CASE_NAME];
    case_patch_type type;
} case_side;
typedef struct case_mesh {
    int cells[3];
    double lo[3], hi[3], spacing[3];
    case_side side[6];
    int general; /* not one box, but a mesh that blockMesh may well make: for felmiFoam */
} case_mesh;
/* In error the mesh has no cells. */
void case_read_mesh(const char *directory, case_mesh *mesh, case_errors *errors);

/* constant/transportProperties and constant/g */
typedef struct case_fluid {
    double rho, nu; /* kg/m3, m2/s */
    double gravity[3];
} case_fluid;
void case_read_fluid(const char *directory, case_fluid *fluid, case_errors *errors);
/* rho and nu of a transportProperties that has been read; gravity is left 0. `newtonian`: no other
 * transportModel will do; else nu may be absent, and is NAN then. */
void case_fluid_of(const case_dict *dict, int newtonian, case_fluid *fluid, case_errors *errors);
/* constant/g alone, for a run without fluid; (0 0 0) when there is no such file. */
void case_read_gravity(const char *directory, double gravity[3], case_errors *errors);

/* constant/demProperties. `mesh` NULL: the domain must be given in the dictionary; else it
 * defaults to the mesh's box, and cyclic sides are periodic. `directory` resolves file names. */
typedef struct case_dem {
    dem_param param; /* its arrays are owned by this struct; shapes pass to dem_new */
    void *storage;
} case_dem;
void case_read_dem(const case_dict *dict, const char *directory, const case_mesh *mesh,
                   const double gravity[3], case_dem *dem, case_errors *errors);
/* Frees the arrays, not the shapes (owned by the simulation after a good dem_new; freed here when
 * `shapes` is nonzero, for a case that was not run). */
void case_dem_free(case_dem *dem, int shapes);

/* Lines for a log, each after `indent`: walls with their extent, memory and motion, feeders,
 * outlets, and the limits of the DEM step by pairs of materials that meet. Text to be freed, empty
 * when there is nothing to tell; NULL when out of memory. Not after the simulation that owns the
 * shapes has been freed. */
char *case_describe_walls(const case_dem *dem, const char *indent);
char *case_describe_feeders(const case_dem *dem, const char *indent);
char *case_describe_outlets(const case_dem *dem, const char *indent);
char *case_describe_limits(const case_dem *dem, const dem_sim *sim, const char *indent);

/* constant/couplingProperties */
void case_read_coupling(const case_dict *dict, cpl_param *param, case_errors *errors);

/* Checks that need more than one file: cell against particle size, particles inside the mesh,
 * time step. Adds to errors. */
void case_check(const case_control *control, const case_mesh *mesh, const case_dem *dem,
                const cpl_param *coupling, case_errors *errors);

#ifdef __cplusplus
}
#endif
#endif
