/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * settings.c - reads a case: OpenFOAM's own files through caseLib, and felmiMAC's settings from
 * system/fvSolution:
 *
 *     felmiMAC
 *     {
 *         tolerance       1e-8;       // of the pressure equation, relative to its right-hand side
 *         maxIterations   500;
 *         cycle           W;          // W, V
 *         convection      hybrid;     // hybrid, upwind, central
 *         meanFlux        (0 0 0);    // m/s, kept in the periodic directions; absent: not kept
 *     }
 */
#include "settings.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- patches --------------------------------------------------------------------------------- */

static mac_patch *find_patch(mac_case *c, const char *name)
{
    for (int i = 0; i < c->patches; i++)
        if (strcmp(c->patch[i].name, name) == 0) return &c->patch[i];
    return NULL;
}

static void add_side(mac_case *c, int side)
{
    const case_side *from = &c->mesh.side[side];
    mac_patch *patch = find_patch(c, from->patch);
    if (!patch) {
        patch = &c->patch[c->patches++];
        memcpy(patch->name, from->patch, sizeof patch->name);
        patch->type = from->type;
    }
    for (int i = 0; i < patch->sides; i++)
        if (patch->side[i] == side) return;
    patch->side[patch->sides++] = side;
}

/* Side on which a face with these vertices lies: its centre is half a box away from the middle. */
static int side_of_face(const mac_case *c, const double *vertex, size_t n, const double *label,
                        double scale)
{
    double centre[3] = {0};
    for (int v = 0; v < 4; v++) {
        if (!(label[v] >= 0 && 3 * label[v] + 2 < (double)n)) return -1;
        for (int d = 0; d < 3; d++) centre[d] += scale * vertex[3 * (size_t)label[v] + d] / 4;
    }
    int best = -1;
    double most = 0;
    for (int d = 0; d < 3; d++) {
        double size = c->mesh.hi[d] - c->mesh.lo[d];
        double off = (centre[d] - 0.5 * (c->mesh.lo[d] + c->mesh.hi[d])) / size;
        if (fabs(off) <= most) continue;
        most = fabs(off);
        best = 2 * d + (off > 0);
    }
    return best;
}

/* Order of patches and of the sides within them as OpenFOAM's blockMesh has it. The mesh has been
 * read and found good before. */
static void order_patches(mac_case *c, case_errors *errors)
{
    case_dict *dict = case_file_exists(c->directory, "system/blockMeshDict")
                          ? case_read_file(c->directory, "system/blockMeshDict", errors)
                          : NULL;
    const char *key = dict && case_has(dict, "scale") ? "scale" : "convertToMeters";
    double *vertex = NULL, one = 1;
    double scale = dict ? case_scalar(dict, key, &one, case_positive, errors) : 1;
    size_t n = dict ? case_numbers(dict, "vertices", &vertex, errors) : 0;
    size_t count = dict && vertex ? case_list_size(dict, "boundary") : 0;
    for (size_t i = 0; i < count; i++) {
        double *label = NULL;
        size_t labels = case_numbers(case_list_at(dict, "boundary", i), "faces", &label, errors);
        for (size_t f = 0; labels % 4 == 0 && f < labels; f += 4) {
            int side = side_of_face(c, vertex, n, label + f, scale);
            if (side >= 0) add_side(c, side);
        }
        free(label);
    }
    free(vertex);
    case_dict_free(dict);
    for (int side = 0; side < 6; side++) add_side(c, side); /* those of other forms of the file */
}

/* ---- solver ---------------------------------------------------------------------------------- */

static void read_own_settings(mac_case *c, const case_dict *dict, case_errors *errors)
{
    static const char *const known[] = {"tolerance",  "maxIterations", "cycle",
                                        "convection", "meanFlux",      NULL};
    static const char *const cycles[] = {"V", "W", NULL};
    static const mac_cycle cycle[] = {MAC_V_CYCLE, MAC_W_CYCLE};
    static const char *const schemes[] = {"hybrid", "upwind", "central", NULL};
    static const mac_convection scheme[] = {MAC_HYBRID, MAC_UPWIND, MAC_CENTRAL};
    const case_range tolerance = {0, 1e-2, 1, 0};
    mac_param *p = &c->flow;
    long most = p->max_iterations;
    case_known(dict, known, errors);
    p->tolerance = case_scalar(dict, "tolerance", &p->tolerance, tolerance, errors);
    p->max_iterations = (int)case_integer(dict, "maxIterations", &most, 1, 100000, errors);
    p->cycle = cycle[case_choice(dict, "cycle", cycles, 1, errors)];
    p->convection = scheme[case_choice(dict, "convection", schemes, 0, errors)];
    if (!case_has(dict, "meanFlux")) return;
    case_vector(dict, "meanFlux", NULL, p->mean_flux, errors);
    int any = 0;
    for (int d = 0; d < 3; d++) {
        int cyclic = c->mesh.side[2 * d].type == CASE_CYCLIC;
        p->hold_flux[d] = cyclic;
        any |= cyclic;
        if (!cyclic && p->mean_flux[d] != 0)
            case_error(errors, case_dict_file(dict), case_dict_line(dict, "meanFlux"),
                       "felmiMAC.meanFlux: the %c direction is not periodic, so its flux cannot be "
                       "prescribed; accepted: 0 there",
                       "xyz"[d]);
    }
    if (!any)
        case_error(errors, case_dict_file(dict), case_dict_line(dict, "meanFlux"),
                   "felmiMAC.meanFlux: the case has no cyclic patches");
}

static void read_solution(mac_case *c, case_errors *errors)
{
    case_dict *dict = case_read_file(c->directory, "system/fvSolution", errors);
    if (!dict) return;
    const case_dict *pimple =
        case_sub(dict, case_has(dict, "PIMPLE") ? "PIMPLE" : "PISO", 0, errors);
    long none = 0, cells = (long)c->mesh.cells[0] * c->mesh.cells[1] * c->mesh.cells[2];
    double zero = 0;
    if (pimple) {
        c->flow.reference_cell =
            (size_t)case_integer(pimple, "pRefCell", &none, 0, cells - 1, errors);
        c->flow.reference_value =
            c->fluid.rho * case_scalar(pimple, "pRefValue", &zero, case_any, errors);
    }
    const case_dict *own = case_sub(dict, "felmiMAC", 0, errors);
    if (own) read_own_settings(c, own, errors);
    case_dict_free(dict);
}

/* ---- particles ------------------------------------------------------------------------------- */

static void read_particles(mac_case *c, case_errors *errors)
{
    c->particles = case_file_exists(c->directory, "constant/demProperties");
    if (!c->particles) {
        if (case_file_exists(c->directory, "constant/couplingProperties"))
            case_error(errors, "constant/couplingProperties", 0,
                       "there is no constant/demProperties beside it: add it, or remove this file "
                       "for a run without particles");
        return;
    }
    case_dict *dem = case_read_file(c->directory, "constant/demProperties", errors);
    if (dem) case_read_dem(dem, c->directory, &c->mesh, c->fluid.gravity, &c->dem, errors);
    case_dict_free(dem);
    case_dict *coupling = case_read_file(c->directory, "constant/couplingProperties", errors);
    if (coupling) case_read_coupling(coupling, &c->coupling, errors);
    case_dict_free(coupling);
    if (case_errors_count(errors) == 0)
        case_check(&c->control, &c->mesh, &c->dem, &c->coupling, errors);
}

void mac_time_name(const mac_case *c, double time, char *name, size_t size)
{
    case_time_name(&c->control, time, 1e-3 * c->control.write_interval, name, size);
}

/* Particles begin at time 0 or go on from a restart file. The conditions are then those that the
 * run began with: a time directory holds fewer digits, and may not be there. */
static void check_time(mac_case *c, case_errors *errors)
{
    const case_control *control = &c->control;
    mac_time_name(c, control->restart[0] ? 0 : control->start_time, c->start, sizeof c->start);
    if (!c->particles || control->restart[0] || control->start_time == 0) return;
    char time[32];
    mac_time_name(c, control->start_time, time, sizeof time);
    case_error(errors, "system/controlDict", 0,
               "%s: particles would start at %s s, for which there is no file restart/%s.h5; "
               "accepted: a time of which there is one, or startFrom startTime; startTime 0;",
               control->start_from == CASE_START_TIME ? "startTime" : "startFrom", time, time);
}

/* A fixed step beyond the viscous limit cannot work. The conditions must be known before. */
static void check_step(const mac_case *c, case_errors *errors)
{
    const case_control *control = &c->control;
    const double step = fmin(control->delta_t, control->max_delta_t);
    const double viscous = mac_viscous_limit(&c->flow);
    if (!control->adjust_time_step && step > viscous)
        case_error(
            errors, "system/controlDict", 0,
            "deltaT: %g s is too much for felmiMAC: the explicit viscous term is stable only up "
            "to %g s on this mesh; accepted: a smaller deltaT, or adjustTimeStep yes",
            step, viscous);
}

void mac_case_read(const char *directory, mac_case *c, case_errors *errors)
{
    memset(c, 0, sizeof *c);
    c->directory = directory;
    c->flow = mac_param_default();
    c->coupling = cpl_param_default();
    if (case_file_exists(directory, "constant/demProperties"))
        case_read_run(directory, &c->control, errors);
    else
        case_read_control(directory, &c->control, errors);
    case_read_fluid(directory, &c->fluid, errors);
    int before = case_errors_count(errors);
    case_read_mesh(directory, &c->mesh, errors);
    if (case_errors_count(errors) > before) {
        read_particles(c, errors);
        return; /* without a mesh nothing else has a meaning */
    }
    order_patches(c, errors);
    for (int d = 0; d < 3; d++) {
        c->flow.n[d] = c->mesh.cells[d];
        c->flow.lo[d] = c->mesh.lo[d];
        c->flow.h[d] = c->mesh.spacing[d];
        c->flow.gravity[d] = c->fluid.gravity[d];
    }
    c->flow.rho = c->fluid.rho;
    c->flow.mu = c->fluid.rho * c->fluid.nu;
    read_solution(c, errors);
    read_particles(c, errors);
    check_time(c, errors);
    mac_read_conditions(c, errors);
    check_step(c, errors);
}

void mac_case_free(mac_case *c, int shapes)
{
    if (c->particles) case_dem_free(&c->dem, shapes);
    free(c->U);
    c->U = NULL;
}
