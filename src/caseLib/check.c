/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * check.c - checks that need more than one file of a case.
 *
 * Cells against particles: the volume-averaged equations need cells larger than the particles;
 * below one diameter they mean nothing, and results stop to depend on the cell at about 1.6
 * diameters (with exact void fractions: Peng, Doroodchi, Luo & Moghtaderi, AIChE J. 60 (2014) 2000,
 * doi:10.1002/aic.14421). Walls are compared with the domain through their
 * signed distance, which changes by no more than the way gone.
 */
#include "particles.h"

#include <math.h>
#include <string.h>

/* Cells below this many diameters get a note. */
#define RECOMMENDED_CELL 1.5

/* `kind`: insertion or feeders; most: largest diameter, m. */
static void compare_cells(const case_mesh *mesh, const place *at, const char *kind,
                          const char *name, double most, case_errors *errors)
{
    for (int a = 0; a < 3; a++) {
        double h = mesh->spacing[a];
        if (most > h)
            case_error(errors, at->file, at->line,
                       "%s.%s.diameter: the particles, %g m, are larger than a cell of "
                       "the mesh, %g m in %c; accepted: cells of at least one diameter, %g or "
                       "more are recommended",
                       kind, name, most, h, "xyz"[a], RECOMMENDED_CELL);
        else if (most * RECOMMENDED_CELL > h * (1 + 1e-9))
            case_note(errors, at->file, at->line,
                      "%s.%s.diameter: a cell of the mesh, %g m in %c, is only %.3g "
                      "diameters; %g or more are recommended",
                      kind, name, h, "xyz"[a], h / most, RECOMMENDED_CELL);
    }
}

static void check_cells(const case_mesh *mesh, const case_dem *dem, case_errors *errors)
{
    const particle_storage *storage = dem->storage;
    for (size_t i = 0; i < dem->param.n_insertion; i++) {
        const dem_insertion *in = &dem->param.insertion[i];
        compare_cells(mesh, &storage->diameter[i], "insertion", in->name, in->diameter, errors);
    }
    for (size_t i = 0; i < dem->param.n_feeder; i++) {
        const dem_feeder *in = &dem->param.feeder[i];
        compare_cells(mesh, &storage->feeder_diameter[i], "feeders", in->name,
                      most_diameter(in->n_species, in->species), errors);
    }
}

static int inside(const dem_param *param, const double x[3])
{
    for (int a = 0; a < 3; a++)
        if (!(x[a] >= param->lo[a] && x[a] <= param->hi[a])) return 0;
    return 1;
}

/* Positions from a file: the first one that is wrong, and how many are. */
static void check_positions(const case_mesh *mesh, const case_dem *dem, size_t i,
                            case_errors *errors)
{
    const dem_param *param = &dem->param;
    const particle_storage *storage = dem->storage;
    const dem_insertion *insertion = &param->insertion[i];
    const place *at = &storage->insertion[i];
    size_t outside = 0, buried = 0, first_outside = 0, first_buried = 0, in_wall = 0;
    for (size_t k = 0; k < insertion->n; k++) {
        const double *x = insertion->x[k];
        if (!inside(param, x) && !outside++) first_outside = k;
        for (size_t w = 0; w < param->n_wall; w++) {
            if (!param->wall[w].shape || dem_sdf_distance(param->wall[w].shape, x) >= 0) continue;
            if (!buried++) {
                first_buried = k;
                in_wall = w;
            }
            break;
        }
    }
    if (outside) {
        const double *x = insertion->x[first_outside];
        case_error(
            errors, at->file, at->line,
            "insertion.%s.file: in %s particle %zu, counted from 0, at (%g %g %g) lies outside "
            "the %s, (%g %g %g) to (%g %g %g) m; %zu in all do",
            insertion->name, storage->positions[i], first_outside, x[0], x[1], x[2],
            mesh ? "mesh" : "domain", param->lo[0], param->lo[1], param->lo[2], param->hi[0],
            param->hi[1], param->hi[2], outside);
    } else if (buried) {
        const double *x = insertion->x[first_buried];
        case_error(
            errors, at->file, at->line,
            "insertion.%s.file: in %s particle %zu, counted from 0, at (%g %g %g) lies within "
            "the wall '%s'; %zu in all lie within walls",
            insertion->name, storage->positions[i], first_buried, x[0], x[1], x[2],
            param->wall[in_wall].name, buried);
    }
}

static void check_walls(const case_dem *dem, case_errors *errors)
{
    enum { LEVELS = 6 }; /* room narrower than 1/64 of the domain does not count */
    const dem_param *param = &dem->param;
    const particle_storage *storage = dem->storage;
    double centre[3], reach = 0;
    for (int a = 0; a < 3; a++) {
        centre[a] = .5 * (param->lo[a] + param->hi[a]);
        reach = hypot(reach, .5 * (param->hi[a] - param->lo[a]));
    }
    for (size_t w = 0; w < param->n_wall; w++) {
        const dem_sdf *shape = param->wall[w].shape;
        const place *at = &storage->wall[w];
        if (!shape) continue;
        const char *why = NULL;
        if (dem_sdf_distance(shape, centre) > reach && param->wall[w].n_motion == 0)
            why = "lies wholly outside the domain and touches no particle";
        else if (!has_room(1, &shape, param->lo, param->hi, LEVELS))
            why = "fills the whole domain: is 'inside' or the normal wrong?";
        if (why)
            case_error(errors, at->file, at->line,
                       "walls.%s.shape: the wall %s; the domain is (%g %g %g) to (%g %g %g) m",
                       param->wall[w].name, why, param->lo[0], param->lo[1], param->lo[2],
                       param->hi[0], param->hi[1], param->hi[2]);
    }
}

static void check_packing(const case_dem *dem, const cpl_param *coupling, case_errors *errors)
{
    const particle_storage *storage = dem->storage;
    for (size_t i = 0; i < dem->param.n_insertion; i++) {
        const dem_insertion *insertion = &dem->param.insertion[i];
        if (insertion->kind == DEM_INSERT_RANDOM && insertion->number < 0 &&
            insertion->solid_fraction > coupling->packing_limit)
            case_error(errors, storage->insertion[i].file, storage->insertion[i].line,
                       "insertion.%s.solidFraction: found %g; accepted: at most packingLimit of "
                       "couplingProperties, %g",
                       insertion->name, insertion->solid_fraction, coupling->packing_limit);
    }
}

void case_check(const case_control *control, const case_mesh *mesh, const case_dem *dem,
                const cpl_param *coupling, case_errors *errors)
{
    if (!dem->storage) return;
    int known = isfinite(dem->param.lo[0] + dem->param.hi[0] + dem->param.lo[1] + dem->param.hi[1] +
                         dem->param.lo[2] + dem->param.hi[2]);
    const particle_storage *storage = dem->storage;
    if (mesh && mesh->cells[0] > 0 && coupling) check_cells(mesh, dem, errors);
    for (size_t i = 0; known && i < dem->param.n_insertion; i++)
        if (storage->positions[i]) check_positions(mesh, dem, i, errors);
    const int before = case_errors_count(errors);
    if (known && !check_surfaces(dem, errors)) check_walls(dem, errors);
    if (known && case_errors_count(errors) == before) check_sides(dem, errors);
    if (known) check_feeds(dem, errors);
    if (coupling) check_packing(dem, coupling, errors);
    if (control && dem->param.time_step > control->delta_t)
        case_note(errors, storage->domain.file, 0,
                  "timeStep.maximum, %g s, is above deltaT of the flow, %g s, which limits the DEM "
                  "step too",
                  dem->param.time_step, control->delta_t);
}
