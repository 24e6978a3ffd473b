/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * shape.c - reads the shape of a wall or of a region and makes its signed distance function.
 *
 * The words are those of OpenFOAM's searchable surfaces where these have them: plane (point,
 * normal), box (min, max), sphere (centre, radius), cylinder (point1, point2, radius), cone
 * (point1, radius1, point2, radius2). A shape is solid unless `inside` makes it a container.
 */
#include "particles.h"

#include <math.h>
#include <string.h>

typedef enum shape_type { PLANE, BOX, SPHERE, CYLINDER, CONE } shape_type;

static const char *const type_words[] = {"plane", "box", "sphere", "cylinder", "cone", NULL};
static const char *const region_words[] = {"box", "sphere", "cylinder", "cone", NULL};

/* Keys of each type; a region takes those before `inside` and `closed`. */
static const char *const keys[][8] = {
    [PLANE] = {"type", "point", "normal", NULL},
    [BOX] = {"type", "min", "max", "inside", NULL},
    [SPHERE] = {"type", "centre", "radius", "inside", NULL},
    [CYLINDER] = {"type", "point1", "point2", "radius", "inside", "closed", NULL},
    [CONE] = {"type", "point1", "point2", "radius1", "radius2", "inside", "closed", NULL},
};

typedef struct shape_reader {
    const case_dict *dict;
    int region, inside, closed;
    double *lo, *hi;
    case_errors *errors;
} shape_reader;

static void check_keys(const shape_reader *shape, shape_type type)
{
    const char *known[8];
    int n = 0;
    for (int i = 0; keys[type][i]; i++) {
        if (shape->region && (strcmp(keys[type][i], "inside") == 0)) break;
        known[n++] = keys[type][i];
    }
    known[n] = NULL;
    case_known(shape->dict, known, shape->errors);
}

static void point(const shape_reader *shape, const char *key, double value[3])
{
    read_vector(shape->dict, key, "m", NULL, value, shape->errors);
}

static double radius(const shape_reader *shape, const char *key, case_range range)
{
    return read_number(shape->dict, key, "m", NULL, range, shape->errors);
}

static dem_sdf *read_plane(const shape_reader *shape)
{
    double at[3], normal[3];
    point(shape, "point", at);
    point(shape, "normal", normal);
    if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)
        key_error(shape->errors, shape->dict, "normal",
                  "found (0 0 0); accepted: a direction, "
                  "pointing to where particles may be");
    return dem_sdf_plane(at, normal);
}

static dem_sdf *read_box(const shape_reader *shape)
{
    point(shape, "min", shape->lo);
    point(shape, "max", shape->hi);
    for (int a = 0; a < 3; a++)
        if (shape->hi[a] <= shape->lo[a])
            key_error(shape->errors, shape->dict, "max",
                      "its %c is %g, not above that of min, %g; accepted: max > min in x, y and z",
                      "xyz"[a], shape -> hi[a], shape -> lo[a]);
    return dem_sdf_box(shape->lo, shape->hi, shape->inside);
}

static dem_sdf *read_sphere(const shape_reader *shape)
{
    double centre[3];
    point(shape, "centre", centre);
    double r = radius(shape, "radius", case_positive);
    for (int a = 0; a < 3; a++) {
        shape->lo[a] = centre[a] - r;
        shape->hi[a] = centre[a] + r;
    }
    return dem_sdf_sphere(centre, r, shape->inside);
}

/* Bounds of two discs of radius r[] around p[0] and p[1], across the axis between them: in the
 * direction a a disc reaches r sqrt(1 - n_a^2). 0 with an error when there is no axis. */
static int bound_discs(const shape_reader *shape, const double p[2][3], const double r[2])
{
    double n[3], length = 0;
    for (int a = 0; a < 3; a++) {
        n[a] = p[1][a] - p[0][a];
        length += n[a] * n[a];
    }
    length = sqrt(length);
    if (length == 0) {
        key_error(shape->errors, shape->dict, "point2",
                  "the same as point1; accepted: another point "
                  "of the axis");
        return 0;
    }
    for (int a = 0; a < 3; a++) {
        double reach = sqrt(fmax(0, 1 - n[a] * n[a] / (length * length)));
        shape->lo[a] = fmin(p[0][a] - r[0] * reach, p[1][a] - r[1] * reach);
        shape->hi[a] = fmax(p[0][a] + r[0] * reach, p[1][a] + r[1] * reach);
    }
    return 1;
}

static dem_sdf *read_round(const shape_reader *shape, shape_type type)
{
    double p[2][3], r[2];
    point(shape, "point1", p[0]);
    point(shape, "point2", p[1]);
    if (type == CYLINDER) {
        r[0] = r[1] = radius(shape, "radius", case_positive);
    } else {
        r[0] = radius(shape, "radius1", case_non_negative);
        r[1] = radius(shape, "radius2", case_non_negative);
        if (r[0] == 0 && r[1] == 0)
            key_error(shape->errors, shape->dict, "radius2",
                      "found 0, like radius1; accepted: at "
                      "least one of them > 0");
    }
    if (!bound_discs(shape, (const double(*)[3])p, r)) return NULL;
    return type == CYLINDER ? dem_sdf_cylinder(p[0], p[1], r[0], shape->closed, shape->inside)
                            : dem_sdf_cone(p[0], p[1], r[0], r[1], shape->closed, shape->inside);
}

dem_sdf *read_shape(const case_dict *dict, int region, double lo[3], double hi[3],
                    case_errors *errors)
{
    shape_reader shape = {.dict = dict, .region = region, .lo = lo, .hi = hi, .errors = errors};
    int before = case_errors_count(errors);
    int choice = case_choice(dict, "type", region ? region_words : type_words, -1, errors);
    if (case_errors_count(errors) > before) return NULL;
    shape_type type = (shape_type)(choice + (region ? BOX : PLANE));
    check_keys(&shape, type);
    shape.inside = region || (type != PLANE && case_bool(dict, "inside", &(int){0}, errors));
    shape.closed = region || (type >= CYLINDER && case_bool(dict, "closed", &(int){1}, errors));
    dem_sdf *sdf = type == PLANE    ? read_plane(&shape)
                   : type == BOX    ? read_box(&shape)
                   : type == SPHERE ? read_sphere(&shape)
                                    : read_round(&shape, type);
    if (!sdf && case_errors_count(errors) == before)
        key_error(errors, dict, "type", "this %s has no extent", type_words[type]);
    if (case_errors_count(errors) == before) return sdf;
    dem_sdf_free(sdf);
    return NULL;
}
