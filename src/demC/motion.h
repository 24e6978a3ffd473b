/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * motion.h - place and velocity of rigid walls as functions of time.
 */
#ifndef DEM_MOTION_H
#define DEM_MOTION_H

#include "dem.h"

/* Where a rigid body is and how it moves. The point that was at b at the start is now at
 * x = place + R b and has the velocity V + W x (x - place). */
typedef struct pose {
    double place[3];    /* m */
    double rotation[9]; /* R, row by row */
    double velocity[3]; /* V, m/s */
    double spin[3];     /* W, rad/s */
} pose;

/* One dem_motion, with what is computed once. */
typedef struct leg {
    dem_motion motion; /* axis of unit length; the arrays of a table are owned by the leg */
    double *time;      /* TABLE: [n] */
    double (*value)[6], (*slope)[6]; /* TABLE: [n], shift then turn, at the rows, and d/dt */
    double speed, spin;              /* no larger ones occur, m/s, rad/s */
} leg;

typedef struct path {
    size_t n;
    leg *leg; /* [n], applied one after the other */
} path;

/* DEM_BAD_ARGUMENT if a motion makes no sense; the reason in `message` of `size` bytes. */
dem_status motion_check(const dem_motion *motion, char *message, size_t size);
/* The motions have passed motion_check. */
dem_status path_init(path *path, size_t n, const dem_motion *motion);
void path_free(path *path);

pose path_pose(const path *path, double time);
/* The pose at time - ago, where motions that have begun at `time` count as begun: they start with
 * their full velocity. */
pose path_before(const path *path, double time, double ago);
/* Bound of the speed, from `time` on, of the points of the box lo...hi (m, coordinates of the
 * start), with the levers they have at `time`. */
double path_speed(const path *path, double time, const double lo[3], const double hi[3]);

/* x = place + R b */
static inline void pose_apply(const pose *p, const double b[3], double x[3])
{
    for (int a = 0; a < 3; a++)
        x[a] = p->place[a] + p->rotation[3 * a] * b[0] + p->rotation[3 * a + 1] * b[1] +
               p->rotation[3 * a + 2] * b[2];
}

/* y = R b */
static inline void pose_turn(const pose *p, const double b[3], double y[3])
{
    for (int a = 0; a < 3; a++)
        y[a] = p->rotation[3 * a] * b[0] + p->rotation[3 * a + 1] * b[1] +
               p->rotation[3 * a + 2] * b[2];
}

/* y = R^T x */
static inline void pose_turn_back(const pose *p, const double x[3], double y[3])
{
    for (int a = 0; a < 3; a++)
        y[a] = p->rotation[a] * x[0] + p->rotation[3 + a] * x[1] + p->rotation[6 + a] * x[2];
}

/* Velocity of the body at x. */
static inline void pose_velocity(const pose *p, const double x[3], double u[3])
{
    const double *w = p->spin;
    double d[3] = {x[0] - p->place[0], x[1] - p->place[1], x[2] - p->place[2]};
    u[0] = p->velocity[0] + w[1] * d[2] - w[2] * d[1];
    u[1] = p->velocity[1] + w[2] * d[0] - w[0] * d[2];
    u[2] = p->velocity[2] + w[0] * d[1] - w[1] * d[0];
}

#endif
