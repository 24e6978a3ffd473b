/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * conditions.c - boundary and initial conditions from U and p of the time directory in which the run
 * began.
 *
 * Each side of the box has a normal and a tangential condition, made of the two types together:
 *
 *     U                              normal velocity            tangential velocity
 *     fixedValue, noSlip             given                      given
 *     movingWallVelocity             given                      given
 *     interstitialInletVelocity      inletVelocity / eps        likewise
 *     slip, symmetry, empty          0                          zero gradient
 *     zeroGradient                   from p                     zero gradient
 *     inletOutlet                    from p                     inletValue where fluid enters
 *     pressureInletOutletVelocity    from p                     0 where fluid enters
 *
 * where "from p" wants a pressure of type fixedValue, and the others one whose gradient follows:
 * fixedFluxPressure or zeroGradient. On the staggered grid both mean the same: the gradient that
 * the momentum equation of the boundary face gives.
 */
#include "settings.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const velocity_types[] = {"fixedValue",
                                             "noSlip",
                                             "slip",
                                             "zeroGradient",
                                             "inletOutlet",
                                             "pressureInletOutletVelocity",
                                             "interstitialInletVelocity",
                                             "movingWallVelocity",
                                             "symmetry",
                                             "symmetryPlane",
                                             "empty",
                                             "cyclic",
                                             NULL};
enum {
    U_FIXED_VALUE,
    U_NO_SLIP,
    U_SLIP,
    U_ZERO_GRADIENT,
    U_INLET_OUTLET,
    U_PRESSURE_INLET_OUTLET,
    U_INTERSTITIAL,
    U_MOVING_WALL,
    U_SYMMETRY,
    U_SYMMETRY_PLANE,
    U_EMPTY,
    U_CYCLIC
};

static const char *const pressure_types[] = {"fixedValue",    "fixedFluxPressure",
                                             "zeroGradient",  "symmetry",
                                             "symmetryPlane", "empty",
                                             "cyclic",        NULL};
enum {
    P_FIXED_VALUE,
    P_FIXED_FLUX,
    P_ZERO_GRADIENT,
    P_SYMMETRY,
    P_SYMMETRY_PLANE,
    P_EMPTY,
    P_CYCLIC
};

/* ---- one patch ------------------------------------------------------------------------------- */

/* Velocity of a side, and which keys hold it. */
static void velocity_side(const case_dict *dict, int type, mac_side *side, case_errors *errors)
{
    static const double zero[3] = {0, 0, 0};
    side->normal = MAC_PRESCRIBED;
    side->tangent = MAC_FIXED;
    switch (type) {
    case U_FIXED_VALUE:
        case_vector(dict, "value", NULL, side->velocity, errors);
        break;
    case U_MOVING_WALL:
        case_vector(dict, "value", zero, side->velocity, errors);
        break;
    case U_INTERSTITIAL:
        case_vector(dict, "inletVelocity", NULL, side->velocity, errors);
        side->superficial = 1;
        break;
    case U_ZERO_GRADIENT:
        side->normal = MAC_OPEN;
        side->tangent = MAC_FREE;
        break;
    case U_INLET_OUTLET:
        case_vector(dict, "inletValue", NULL, side->velocity, errors);
        side->normal = MAC_OPEN;
        side->tangent = MAC_INFLOW_FIXED;
        break;
    case U_PRESSURE_INLET_OUTLET:
        side->normal = MAC_OPEN;
        side->tangent = MAC_INFLOW_FIXED;
        break;
    case U_SLIP:
    case U_SYMMETRY:
    case U_SYMMETRY_PLANE:
    case U_EMPTY:
        side->tangent = MAC_FREE;
        break;
    case U_CYCLIC:
        side->normal = MAC_CYCLIC;
        side->tangent = MAC_FREE;
        break;
    default: /* no slip: at rest */
        break;
    }
}

/* The types that the mesh forces on a patch. */
static void check_mesh_type(const mac_patch *patch, const char *type, const case_dict *dict,
                            case_errors *errors)
{
    static const char *const wanted[] = {
        [CASE_SYMMETRY] = "symmetry", [CASE_EMPTY] = "empty", [CASE_CYCLIC] = "cyclic"};
    const char *forced = patch->type >= CASE_SYMMETRY ? wanted[patch->type] : NULL;
    int plane = patch->type == CASE_SYMMETRY && strcmp(type, "symmetryPlane") == 0;
    int special = strcmp(type, "symmetry") == 0 || strcmp(type, "symmetryPlane") == 0 ||
                  strcmp(type, "empty") == 0 || strcmp(type, "cyclic") == 0;
    if (forced && !plane && strcmp(type, forced) != 0)
        case_error(errors, case_dict_file(dict), case_dict_line(dict, "type"),
                   "%s: type is %s, but the patch is %s in blockMeshDict; accepted: %s",
                   patch->name, type, forced, forced);
    if (!forced && special)
        case_error(errors, case_dict_file(dict), case_dict_line(dict, "type"),
                   "%s: type is %s, but the patch is not in blockMeshDict", patch->name, type);
}

/* A patch that has no entry: the entry that looks like it and belongs to no other; 0 if none. */
static int suspect_patch(const mac_case *c, const case_dict *boundary, const char *name,
                         case_errors *errors)
{
    const char *const wanted[] = {name, NULL};
    for (size_t i = 0; i < case_dict_size(boundary); i++) {
        const char *key = case_dict_key(boundary, i);
        int known = 0;
        for (int k = 0; k < c->patches; k++) known |= strcmp(key, c->patch[k].name) == 0;
        if (known || !case_nearest(key, wanted)) continue;
        case_error(errors, case_dict_file(boundary), case_dict_line(boundary, key),
                   "boundaryField.%s: no patch of the mesh has this name; did you mean '%s'?", key,
                   name);
        return 1;
    }
    return 0;
}

static const case_dict *patch_dict(const mac_case *c, const case_dict *dict, const char *name,
                                   case_errors *errors)
{
    const case_dict *boundary = dict ? case_sub(dict, "boundaryField", 1, errors) : NULL;
    if (boundary && !case_has(boundary, name) && suspect_patch(c, boundary, name, errors))
        return NULL;
    return boundary ? case_sub(boundary, name, 1, errors) : NULL;
}

/* An open side needs its pressure, a side of given velocity must not have one. */
static void check_pair(const mac_patch *patch, const case_dict *p, int open, int given,
                       case_errors *errors)
{
    if (open && !given)
        case_error(errors, case_dict_file(p), case_dict_line(p, "type"),
                   "%s: U of type %s leaves the velocity to the pressure, but p is of type %s; "
                   "accepted: fixedValue",
                   patch->name, patch->U.type, patch->p.type);
    if (!open && given)
        case_error(errors, case_dict_file(p), case_dict_line(p, "type"),
                   "%s: U of type %s gives the velocity, and p of type fixedValue the pressure as "
                   "well; accepted: fixedFluxPressure, zeroGradient",
                   patch->name, patch->U.type);
}

static void read_patch(mac_case *c, mac_patch *patch, const case_dict *U, const case_dict *p,
                       case_errors *errors)
{
    int before = case_errors_count(errors);
    const case_dict *velocity = patch_dict(c, U, patch->name, errors);
    const case_dict *pressure = patch_dict(c, p, patch->name, errors);
    if (!velocity || !pressure) return;
    int u_type = case_choice(velocity, "type", velocity_types, -1, errors);
    int p_type = case_choice(pressure, "type", pressure_types, -1, errors);
    if (case_errors_count(errors) > before) return;
    mac_side side = {.normal = MAC_PRESCRIBED};
    velocity_side(velocity, u_type, &side, errors);
    patch->U.type = velocity_types[u_type];
    patch->p.type = pressure_types[p_type];
    memcpy(patch->U.value, side.velocity, sizeof side.velocity);
    check_mesh_type(patch, patch->U.type, velocity, errors);
    check_mesh_type(patch, patch->p.type, pressure, errors);
    if (p_type == P_FIXED_VALUE)
        patch->p.value[0] = case_scalar(pressure, "value", NULL, case_any, errors);
    side.pressure = c->fluid.rho * patch->p.value[0];
    check_pair(patch, pressure, side.normal == MAC_OPEN, p_type == P_FIXED_VALUE, errors);
    for (int s = 0; s < patch->sides; s++) c->flow.side[patch->side[s]] = side;
}

/* ---- initial fields -------------------------------------------------------------------------- */

/* The internal field: `width` numbers, or that many for each cell. NULL on error. */
static double *read_internal(const case_dict *dict, size_t cells, size_t width, case_errors *errors)
{
    double *value = NULL;
    size_t n = case_numbers(dict, "internalField", &value, errors);
    if (!value) return NULL;
    if (n != width && n != width * cells) {
        case_error(
            errors, case_dict_file(dict), case_dict_line(dict, "internalField"),
            "internalField: found %zu numbers; accepted: uniform, or %zu for each of the %zu "
            "cells of the mesh",
            n, width, cells);
        free(value);
        return NULL;
    }
    if (n == width * cells) return value;
    double *all = malloc(width * cells * sizeof *all);
    for (size_t i = 0; all && i < width * cells; i++) all[i] = value[i % width];
    free(value);
    return all;
}

void mac_read_conditions(mac_case *c, case_errors *errors)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s/U", c->directory, c->start);
    case_dict *U = case_dict_read(path, errors);
    snprintf(path, sizeof path, "%s/%s/p", c->directory, c->start);
    case_dict *p = case_dict_read(path, errors);
    if (U && p) {
        size_t cells = (size_t)c->flow.n[0] * (size_t)c->flow.n[1] * (size_t)c->flow.n[2];
        for (int i = 0; i < c->patches; i++) read_patch(c, &c->patch[i], U, p, errors);
        c->U = (double(*)[3])read_internal(U, cells, 3, errors);
    }
    case_dict_free(U);
    case_dict_free(p);
}
