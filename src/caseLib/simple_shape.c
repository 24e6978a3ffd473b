/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * simple_shape.c - reads planes, boxes and shapes of revolution.
 *
 * The words are those of OpenFOAM's searchable surfaces where these have them: plane (point,
 * normal), box (min, max), sphere (centre, radius), cylinder (point1, point2, radius), cone
 * (point1, radius1, point2, radius2). A shape is solid unless `inside` makes it a container.
 */
#include "particles.h"

#include <math.h>
#include <string.h>

typedef enum shape_type { PLANE, BOX, SPHERE, CYLINDER, CONE } shape_type;

const char *const simple_words[] = {"plane", "box", "sphere", "cylinder", "cone", NULL};

/* Keys of each type; a region takes those before `inside` and `closed`. */
static const char *const keys[][12] = {
    [PLANE] = {SHAPE_KEYS, "point", "normal", NULL},
    [BOX] = {SHAPE_KEYS, "min", "max", "inside", NULL},
    [SPHERE] = {SHAPE_KEYS, "centre", "radius", "inside", NULL},
    [CYLINDER] = {SHAPE_KEYS, "point1", "point2", "radius", "inside", "closed", NULL},
    [CONE] = {SHAPE_KEYS, "point1", "point2", "radius1", "radius2", "inside", "closed", NULL},
};

typedef struct shape_reader {
    const case_dict *dict;
    int region, inside, closed;
    extent *box;
    case_errors *errors;
} shape_reader;

static void check_keys(const shape_reader *shape, shape_type type)
{
    const char *known[12];
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
    point(shape, "min", shape->box->lo);
    point(shape, "max", shape->box->hi);
    for (int a = 0; a < 3; a++)
        if (shape->box->hi[a] <= shape->box->lo[a])
            key_error(shape->errors, shape->dict, "max",
                      "its %c is %g, not above that of min, %g; accepted: max > min in x, y and z",
                      "xyz"[a], shape -> box -> hi[a], shape -> box -> lo[a]);
    return dem_sdf_box(shape->box->lo, shape->box->hi, shape->inside);
}

static dem_sdf *read_sphere(const shape_reader *shape)
{
    double centre[3];
    point(shape, "centre", centre);
    double r = radius(shape, "radius", case_positive);
    for (int a = 0; a < 3; a++) {
        shape->box->lo[a] = centre[a] - r;
        shape->box->hi[a] = centre[a] + r;
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
        shape->box->lo[a] = fmin(p[0][a] - r[0] * reach, p[1][a] - r[1] * reach);
        shape->box->hi[a] = fmax(p[0][a] + r[0] * reach, p[1][a] + r[1] * reach);
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

dem_sdf *read_simple_shape(particle_reader *reader, const case_dict *dict, int type, int region,
                           extent *box)
{
    case_errors *errors = reader->errors;
    shape_reader shape = {.dict = dict, .region = region, .box = box, .errors = errors};
    check_keys(&shape, (shape_type)type);
    shape.inside = region || (type != PLANE && case_bool(dict, "inside", &(int){0}, errors));
    shape.closed = region || (type >= CYLINDER && case_bool(dict, "closed", &(int){1}, errors));
    return type == PLANE    ? read_plane(&shape)
           : type == BOX    ? read_box(&shape)
           : type == SPHERE ? read_sphere(&shape)
                            : read_round(&shape, (shape_type)type);
}
