/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * shape.c - reads the shape of a wall or of a region and makes its signed distance function.
 *
 *     simple    plane, box, sphere, cylinder, cone (simple_shape.c)
 *     stl       a surface of triangles from a file
 *     union, intersection (of the list `shapes`), complement (of `shape`)
 *
 * Any of them is then scaled about the origin, turned about an axis through it, and shifted:
 * `scale`, `rotate { axis; angle; }`, `translate`.
 *
 * In a wall these words speak of the solid, in a region of the space that it takes. The engine
 * knows solids only, and a region is the free space of one: its union is the intersection of
 * solids, and the reverse.
 */
#include "particles.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)

typedef enum combined_type { STL, UNION, INTERSECTION, COMPLEMENT } combined_type;

static const char *const wall_words[] = {"plane", "box",   "sphere",       "cylinder",   "cone",
                                         "stl",   "union", "intersection", "complement", NULL};
enum { SIMPLE = 5 }; /* words before those of combined_type */

static const extent everywhere = {
    {-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}, 1};

/* ---- surfaces of triangles ------------------------------------------------------------------- */

/* For the checks that need the whole case. */
static void keep_surface(particle_reader *reader, const case_dict *dict, const char *name,
                         const dem_stl *stl, const dem_sdf *sdf, int region)
{
    particle_storage *storage = reader->storage;
    surface *new = store_alloc(storage->store, sizeof *new);
    double lo[3], hi[3];
    char path[512];
    key_path(dict, "file", path, sizeof path);
    dem_sdf_bounds(sdf, lo, hi);
    *new = (surface){.at = place_of(storage->store, dict, "file"),
                     .key = keep_text(reader, path),
                     .name = keep_text(reader, name),
                     .spacing = stl->spacing,
                     .samples = !region,
                     .next = storage->surfaces};
    for (int a = 0; a < 3; a++) new->extent[a] = hi[a] - lo[a];
    storage->surfaces = new;
}

static dem_sdf *read_stl(particle_reader *reader, const case_dict *dict, int region, extent *box)
{
    static const char *const wall_keys[] = {SHAPE_KEYS, "file",         "inside", "mend",
                                            "spacing",  "featureAngle", NULL};
    static const char *const region_keys[] = {SHAPE_KEYS, "file", "mend", NULL};
    const case_range angle = {0, 180, 1, 0};
    case_errors *errors = reader->errors;
    const int before = case_errors_count(errors);
    dem_stl stl = dem_stl_default();
    char path[4096], message[1024] = "";
    case_known(dict, region ? region_keys : wall_keys, errors);
    const char *name = case_word(dict, "file", NULL, 1, errors);
    stl.scale = read_number(dict, "scale", "", &(double){1}, case_positive, errors);
    stl.inside = region || case_bool(dict, "inside", &(int){0}, errors);
    stl.mend = case_bool(dict, "mend", &(int){0}, errors);
    stl.spacing = read_number(dict, "spacing", "m", &(double){0}, case_positive, errors);
    stl.feature_angle = DEGREE * read_number(dict, "featureAngle", "degrees",
                                             &(double){stl.feature_angle / DEGREE}, angle, errors);
    if (case_errors_count(errors) > before) return NULL;
    find_file(reader, "constant/triSurface", name, path, sizeof path);
    stl.path = path;
    dem_sdf *sdf = dem_sdf_stl(&stl, message, sizeof message);
    if (!sdf) {
        key_error(errors, dict, "file", "%s", *message ? message : "out of memory");
        return NULL;
    }
    if (*message) {
        char key[512];
        key_path(dict, "file", key, sizeof key);
        case_note(errors, dict->file, case_dict_line(dict, "file"), "%s: %s", key, message);
    }
    keep_surface(reader, dict, name, &stl, sdf, region);
    dem_sdf_bounds(sdf, box->lo, box->hi);
    return sdf;
}

/* ---- shapes of shapes ------------------------------------------------------------------------ */

static void join(combined_type type, extent *box, const extent *with)
{
    box->loose = 1;
    for (int a = 0; a < 3; a++) {
        box->lo[a] = type == UNION ? fmin(box->lo[a], with->lo[a]) : fmax(box->lo[a], with->lo[a]);
        box->hi[a] = type == UNION ? fmax(box->hi[a], with->hi[a]) : fmin(box->hi[a], with->hi[a]);
    }
}

/* The list `shapes`: how many; with *member malloced. 0 with an error, and no members left. */
static size_t read_members(particle_reader *reader, const case_dict *dict, combined_type type,
                           int region, extent *box, dem_sdf ***member)
{
    const size_t n = case_list_size(dict, "shapes");
    size_t good = 0;
    if (n == 0) {
        key_error(reader->errors, dict, "shapes",
                  "%s; accepted: a list of shapes ( { type ...; } ... )",
                  case_has(dict, "shapes") ? "not such a list" : "missing");
        return 0;
    }
    *member = calloc(n, sizeof **member);
    for (size_t i = 0; *member && i < n; i++) {
        extent own;
        (*member)[i] = read_shape(reader, case_list_at(dict, "shapes", i), region, &own);
        if (!(*member)[i]) continue;
        if (good++)
            join(type, box, &own);
        else
            *box = own;
    }
    if (good == n) return n;
    for (size_t i = 0; *member && i < n; i++) dem_sdf_free((*member)[i]);
    free(*member);
    return 0;
}

static dem_sdf *read_list(particle_reader *reader, const case_dict *dict, combined_type type,
                          int region, extent *box)
{
    static const char *const known[] = {SHAPE_KEYS, "shapes", NULL};
    dem_sdf **member, *sdf;
    case_known(dict, known, reader->errors);
    size_t n = read_members(reader, dict, type, region, box, &member);
    if (n == 0) return NULL;
    sdf = (type == UNION) == !region ? dem_sdf_union(n, member) : dem_sdf_intersection(n, member);
    free(member);
    for (int a = 0; sdf && region && a < 3; a++)
        if (!(box->lo[a] < box->hi[a])) {
            key_error(reader->errors, dict, "shapes", "have nothing in common");
            break;
        }
    return sdf;
}

static dem_sdf *read_complement(particle_reader *reader, const case_dict *dict, int region,
                                extent *box)
{
    static const char *const known[] = {SHAPE_KEYS, "shape", NULL};
    case_known(dict, known, reader->errors);
    const case_dict *of = case_sub(dict, "shape", 1, reader->errors);
    dem_sdf *member = of ? read_shape(reader, of, region, box) : NULL;
    *box = everywhere;
    return member ? dem_sdf_complement(member) : NULL;
}

/* ---- place ----------------------------------------------------------------------------------- */

/* v turned by `angle` about the unit vector n (Rodrigues). */
static void turn(const double n[3], double angle, double v[3])
{
    const double c = cos(angle), s = sin(angle), along = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
    const double cross[3] = {n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2],
                             n[0] * v[1] - n[1] * v[0]};
    for (int a = 0; a < 3; a++) v[a] = c * v[a] + s * cross[a] + (1 - c) * along * n[a];
}

/* The box that holds a moved box. */
static void move_box(extent *box, double scale, const double axis[3], double angle,
                     const double shift[3])
{
    const extent old = *box;
    for (int a = 0; a < 3; a++)
        if (!isfinite(old.lo[a]) || !isfinite(old.hi[a])) {
            *box = everywhere;
            return;
        }
    *box = (extent){
        {INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, old.loose || angle != 0};
    for (int corner = 0; corner < 8; corner++) {
        double x[3];
        for (int a = 0; a < 3; a++) x[a] = scale * (corner >> a & 1 ? old.hi[a] : old.lo[a]);
        if (angle != 0) turn(axis, angle, x);
        for (int a = 0; a < 3; a++) {
            box->lo[a] = fmin(box->lo[a], x[a] + shift[a]);
            box->hi[a] = fmax(box->hi[a], x[a] + shift[a]);
        }
    }
}

/* A direction, made a unit vector; 0 with an error. */
static int read_axis(const case_dict *dict, double axis[3], case_errors *errors)
{
    if (!read_vector(dict, "axis", "", NULL, axis, errors)) return 0;
    const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    if (length == 0) key_error(errors, dict, "axis", "found (0 0 0); accepted: a direction");
    for (int a = 0; a < 3 && length > 0; a++) axis[a] /= length;
    return length > 0;
}

/* scale, rotate, translate. What an STL file is scaled by has been done when it was read. */
static dem_sdf *move_shape(particle_reader *reader, const case_dict *dict, int scaled,
                           const surface *older, extent *box, dem_sdf *sdf)
{
    static const char *const known[] = {"axis", "angle", NULL};
    case_errors *errors = reader->errors;
    double axis[3] = {0, 0, 1}, shift[3], angle = 0, scale = 1;
    const int before = case_errors_count(errors);
    if (!scaled) scale = read_number(dict, "scale", "", &scale, case_positive, errors);
    read_vector(dict, "translate", "m", (double[3]){0, 0, 0}, shift, errors);
    const case_dict *rotate = case_sub(dict, "rotate", 0, errors);
    if (rotate) {
        case_known(rotate, known, errors);
        read_axis(rotate, axis, errors);
        angle = DEGREE * read_number(rotate, "angle", "degrees", NULL, case_any, errors);
    }
    if (!sdf || case_errors_count(errors) > before) return sdf;
    if (scale == 1 && angle == 0 && shift[0] == 0 && shift[1] == 0 && shift[2] == 0) return sdf;
    for (surface *s = reader->storage->surfaces; s != older; s = s->next)
        for (int a = 0; a < 3; a++) s->extent[a] *= scale;
    move_box(box, scale, axis, angle, shift);
    return dem_sdf_transform(sdf, scale, axis, angle, shift);
}

/* ---- shapes ---------------------------------------------------------------------------------- */

dem_sdf *read_shape(particle_reader *reader, const case_dict *dict, int region, extent *box)
{
    case_errors *errors = reader->errors;
    const surface *older = reader->storage->surfaces;
    const int before = case_errors_count(errors);
    *box = everywhere;
    /* A region is bounded: no plane. */
    int type = case_choice(dict, "type", region ? wall_words + 1 : wall_words, -1, errors) + region;
    if (case_errors_count(errors) > before) return NULL;
    box->loose = type >= SIMPLE;
    dem_sdf *sdf;
    switch (type - SIMPLE) {
    case STL:
        sdf = read_stl(reader, dict, region, box);
        break;
    case UNION:
    case INTERSECTION:
        sdf = read_list(reader, dict, (combined_type)(type - SIMPLE), region, box);
        break;
    case COMPLEMENT:
        sdf = read_complement(reader, dict, region, box);
        break;
    default:
        sdf = read_simple_shape(reader, dict, type, region, box);
    }
    sdf = move_shape(reader, dict, type == SIMPLE + STL, older, box, sdf);
    if (!sdf && case_errors_count(errors) == before)
        key_error(errors, dict, "type", "this %s has no extent", wall_words[type]);
    if (case_errors_count(errors) == before) return sdf;
    dem_sdf_free(sdf);
    return NULL;
}
