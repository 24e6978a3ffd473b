/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall.c - walls: material, shape, motion, and the point that torques are about.
 */
#include "particles.h"

#include <math.h>
#include <string.h>

/* Where nothing is said: a point on the axis the wall turns about, else the middle of its surface,
 * else, where that has no end, the origin. */
static void default_centre(dem_wall *wall)
{
    for (size_t i = 0; i < wall->n_motion; i++) {
        const dem_motion *motion = &wall->motion[i];
        if (motion->kind != DEM_ROTATION && motion->kind != DEM_ROCKING) continue;
        memcpy(wall->centre, motion->origin, sizeof wall->centre);
        return;
    }
    double lo[3], hi[3];
    if (!wall->shape) return;
    dem_sdf_bounds(wall->shape, lo, hi);
    for (int a = 0; a < 3; a++)
        if (!isfinite(lo[a]) || !isfinite(hi[a])) return;
    for (int a = 0; a < 3; a++) wall->centre[a] = .5 * (lo[a] + hi[a]);
}

void read_walls(particle_reader *reader)
{
    static const char *const known[] = {"material", "shape", "motion", "centre", NULL};
    const case_dict *list = case_sub(reader->dict, "walls", 0, reader->errors);
    particle_storage *storage = reader->storage;
    if (!list || list->n == 0) return;
    dem_wall *wall = store_alloc(storage->store, list->n * sizeof *wall);
    storage->wall = store_alloc(storage->store, list->n * sizeof *storage->wall);
    reader->param->wall = wall;
    for (size_t i = 0; i < list->n; i++) {
        const case_dict *dict = case_sub(list, list->entry[i]->key, 1, reader->errors);
        if (!dict) continue;
        extent box;
        const size_t k = reader->param->n_wall++;
        case_known(dict, known, reader->errors);
        copy_name(reader, dict, wall[k].name);
        wall[k].material = read_material(reader, dict);
        const case_dict *shape = case_sub(dict, "shape", 1, reader->errors);
        wall[k].shape = shape ? read_shape(reader, shape, 0, &box) : NULL;
        storage->wall[k] = place_of(storage->store, dict, "shape");
        read_motions(reader, dict, &wall[k]);
        default_centre(&wall[k]);
        read_vector(dict, "centre", "m", wall[k].centre, wall[k].centre, reader->errors);
    }
}
