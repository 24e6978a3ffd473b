/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall_motion.c - walls in time: where they are, how far they have gone, how fast they can get.
 *
 * A wall's shape stays as it was given; its pose says where it has been carried. The places hold
 * for the time of the simulation, always: whatever changes that time calls walls_move().
 *
 * Velocities are those of half a step before. Symplectic Euler, x' = x + dt v', makes v the mean
 * velocity of the step that led to x. A wall's velocity of the same moment as x would be compared
 * with that of a moment half a step earlier: a particle held by friction on a disc that turns at W
 * would drift inwards by W dt/2 of its radius in every radian. With the velocity of the middle of
 * the step, at the place the particle had there, sticking is the implicit midpoint rule, which
 * keeps the radius.
 *
 * How far a rigid body has gone. The displacement of its point b between two poses, (p1 - p0) +
 * (R1 - R0) b, is an affine function of b, and the length of an affine function is convex: in a
 * box it is largest at a corner. The box holds the part of the surface that particles can meet,
 * the shape's own box cut with the domain. No signed distance has changed by more than that.
 */
#include "wall.h"

#include "dem_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

dem_status walls_init(walls *w, size_t n, const dem_wall *wall, const double lo[3],
                      const double hi[3])
{
    memset(w, 0, sizeof *w);
    memcpy(w->lo, lo, sizeof w->lo);
    memcpy(w->hi, hi, sizeof w->hi);
    if (!n) return DEM_OK;
    w->wall = malloc(n * sizeof *w->wall);
    w->body = calloc(n, sizeof *w->body);
    if (!w->wall || !w->body) return DEM_NO_MEMORY;
    memcpy(w->wall, wall, n * sizeof *w->wall);
    w->n = n;
    size_t parts = 0;
    for (size_t k = 0; k < n; k++) parts += (size_t)dem_sdf_parts(wall[k].shape);
    w->near = malloc((parts + 1) * sizeof *w->near);
    if (!w->near) return DEM_NO_MEMORY;
    dem_status status = DEM_OK;
    for (size_t k = 0; k < n && !status; k++) {
        wall_body *b = &w->body[k];
        status = path_init(&b->path, wall[k].n_motion, wall[k].motion);
        b->moves = wall[k].n_motion > 0;
        b->now = b->half = b->listed = path_pose(&b->path, 0);
        pose_apply(&b->now, w->wall[k].centre, b->centre);
        w->wall[k].motion = NULL; /* the caller's */
    }
    return status;
}

void walls_free(walls *w, int free_shapes)
{
    for (size_t k = 0; k < w->n; k++) {
        if (free_shapes) dem_sdf_free(w->wall[k].shape);
        path_free(&w->body[k].path);
    }
    free(w->wall);
    free(w->body);
    free(w->near);
    free(w->entry);
    free(w->before);
    memset(w, 0, sizeof *w);
}

void walls_move(walls *w, double time, double dt)
{
    for (size_t k = 0; k < w->n; k++) {
        wall_body *b = &w->body[k];
        if (!b->moves) continue;
        b->now = path_pose(&b->path, time);
        b->half = dt > 0 ? path_before(&b->path, time, .5 * dt) : b->now;
        pose_apply(&b->now, w->wall[k].centre, b->centre);
    }
}

/* Box, in the coordinates of the start, of the surface of wall k within `reach` of the domain. */
static void box_within(const walls *w, size_t k, double reach, double lo[3], double hi[3])
{
    const pose *now = &w->body[k].now;
    for (int a = 0; a < 3; a++) {
        lo[a] = INFINITY;
        hi[a] = -INFINITY;
    }
    for (int corner = 0; corner < 8; corner++) {
        double d[3], b[3];
        for (int a = 0; a < 3; a++)
            d[a] = (corner >> a & 1 ? w->hi[a] + reach : w->lo[a] - reach) - now->place[a];
        pose_turn_back(now, d, b);
        for (int a = 0; a < 3; a++) {
            lo[a] = fmin(lo[a], b[a]);
            hi[a] = fmax(hi[a], b[a]);
        }
    }
    double from[3], to[3];
    dem_sdf_bounds(w->wall[k].shape, from, to);
    for (int a = 0; a < 3; a++)
        if (from[a] > hi[a] || to[a] < lo[a]) return; /* out of reach as yet: all of the domain */
    for (int a = 0; a < 3; a++) {
        lo[a] = fmax(lo[a], from[a]);
        hi[a] = fmin(hi[a], to[a]);
    }
}

void walls_remember(walls *w, double reach)
{
    for (size_t k = 0; k < w->n; k++) {
        wall_body *b = &w->body[k];
        if (!b->moves) continue;
        b->listed = b->now;
        box_within(w, k, reach + w->slack, b->lo, b->hi);
    }
}

int walls_hold(const walls *w)
{
    for (size_t k = 0; k < w->n; k++) {
        const wall_body *b = &w->body[k];
        if (!b->moves) continue;
        for (int corner = 0; corner < 8; corner++) {
            double c[3], x[3], y[3];
            for (int a = 0; a < 3; a++) c[a] = corner >> a & 1 ? b->hi[a] : b->lo[a];
            pose_apply(&b->now, c, x);
            pose_apply(&b->listed, c, y);
            double dx = x[0] - y[0], dy = x[1] - y[1], dz = x[2] - y[2];
            if (dx * dx + dy * dy + dz * dz > w->slack * w->slack) return 0;
        }
    }
    return 1;
}

double walls_speed(const walls *w, double time)
{
    double most = 0;
    for (size_t k = 0; k < w->n; k++) {
        const wall_body *b = &w->body[k];
        if (!b->moves) continue;
        double lo[3], hi[3];
        box_within(w, k, 0, lo, hi);
        most = fmax(most, path_speed(&b->path, time, lo, hi));
    }
    return most;
}

/* ---- loads ----------------------------------------------------------------------------------- */

void walls_clear_loads(walls *w)
{
    for (size_t k = 0; k < w->n; k++) memset(w->body[k].load, 0, sizeof w->body[k].load);
}

void walls_average_loads(walls *w, int substeps)
{
    for (size_t k = 0; k < w->n; k++)
        for (int a = 0; a < 6; a++) w->body[k].mean[a] = w->body[k].load[a] / substeps;
}

size_t dem_walls(const dem_sim *sim)
{
    return sim->walls.n;
}

const char *dem_wall_name(const dem_sim *sim, size_t wall)
{
    return wall < sim->walls.n ? sim->walls.wall[wall].name : "";
}

void dem_wall_force(const dem_sim *sim, size_t wall, double force[3])
{
    for (int a = 0; a < 3; a++) force[a] = wall < sim->walls.n ? sim->walls.body[wall].mean[a] : 0;
}

void dem_wall_torque(const dem_sim *sim, size_t wall, double torque[3])
{
    for (int a = 0; a < 3; a++)
        torque[a] = wall < sim->walls.n ? sim->walls.body[wall].mean[3 + a] : 0;
}

int dem_wall_moves(const dem_sim *sim, size_t wall)
{
    return wall < sim->walls.n && sim->walls.body[wall].moves;
}

void dem_wall_place(const dem_sim *sim, size_t wall, double place[3], double rotation[9])
{
    for (int a = 0; a < 3; a++)
        place[a] = wall < sim->walls.n ? sim->walls.body[wall].now.place[a] : 0;
    for (int a = 0; a < 9; a++)
        rotation[a] = wall < sim->walls.n ? sim->walls.body[wall].now.rotation[a] : a % 4 == 0;
}
