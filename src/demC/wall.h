/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall.h - contact of particles with walls given by signed distance functions, at rest or moving.
 */
#ifndef DEM_WALL_H
#define DEM_WALL_H

#include "balance.h"
#include "contact_extra.h"
#include "motion.h"
#include "particles.h"

/* A particle near a part of a wall: it may touch before the next rebuild. */
typedef struct wall_entry {
    double spring[4];  /* in the coordinates that the wall carries along */
    double rolling[4]; /* rolling spring, likewise */
    uint32_t particle;
    int wall, part;
    int touch;     /* when the forces were last summed */
    uint32_t hint; /* sdf_eval_again() */
} wall_entry;

typedef struct wall_part {
    int wall, part;
} wall_part;

/* What a wall is besides its shape. */
typedef struct wall_body {
    path path;
    int moves;
    pose now;            /* at the time of walls_move; at rest if it does not move */
    pose half;           /* half a step before, when particles had the velocity they have */
    pose listed;         /* when the list was made */
    double lo[3], hi[3]; /* box, in the coordinates of the start, of what particles could meet */
    double centre[3];    /* of the torque, now */
    double load[6];      /* force and torque on the wall, sum over the sub-steps */
    double mean[6];      /* mean over the last dem_advance */
} wall_body;

typedef struct walls {
    size_t n;
    dem_wall *wall;      /* [n], shapes owned */
    wall_body *body;     /* [n] */
    double lo[3], hi[3]; /* domain, m */
    wall_part *near;     /* [parts of all walls], those that a block of particles is near to */
    double sampled_spacing, sampled_width; /* of triangle surfaces, m; 0: not sampled yet */
    double slack; /* what a moving wall may have moved since the list was made, m */
    wall_entry *entry, *before;
    size_t n_entry, capacity, n_before, before_capacity;
} walls;

typedef struct wall_forces {
    dem_law law;
    const coefficient *table; /* [n_material * n_material] */
    int n_material;
    double dt;
    const extras *extras;   /* models beyond the plain law, or NULL */
    balance *balance;       /* where its parts go, if it is kept */
    size_t next;            /* entry of the list that the loop goes on from */
    size_t contacts;        /* out, like all below: zero at the beginning */
    double overlap;         /* out: largest overlap / radius */
    double on_particles[3]; /* out: sum of the forces */
    spring_energy springs;  /* out, if the balance is kept */
} wall_forces;

/* ---- wall_motion.c: walls in time ------------------------------------------------------------ */

/* lo, hi: the domain. The walls are at their places at time 0. */
dem_status walls_init(walls *w, size_t n, const dem_wall *wall, const double lo[3],
                      const double hi[3]);
void walls_free(walls *w, int free_shapes);
/* To the places of `time`, from which a step dt begins (0: none does). */
void walls_move(walls *w, double time, double dt);
/* Zero if some wall has moved by more than w->slack since the list was made. */
int walls_hold(const walls *w);
/* Remember the places; particles reach `reach` beyond the domain at most. */
void walls_remember(walls *w, double reach);
/* No point of a wall's surface within the domain will be faster from `time` on, with the levers it
 * has now, m/s. */
double walls_speed(const walls *w, double time);
void walls_clear_loads(walls *w);
/* Means over the sub-steps. */
void walls_average_loads(walls *w, int substeps);

/* ---- wall_sample.c: surfaces of triangles ------------------------------------------------------
 */

struct dem_sim;

/* See that the surfaces of triangles are sampled for particles of these diameters, m, the same on
 * all ranks. Message in error, and for a note. All three are collective. */
dem_status walls_sample(struct dem_sim *sim, double smallest, double largest);
/* For all that insertions and feeders announce. */
dem_status walls_sample_for(struct dem_sim *sim, const dem_param *param);
/* At least as finely and as wide as that. */
dem_status walls_sample_at(struct dem_sim *sim, double spacing, double width);

/* ---- wall.c ---------------------------------------------------------------------------------- */

/* List the particles that may touch within `margin` of motion of their own and w->slack of the
 * walls'; history is kept. `place` tells where particles have gone since the last call, NULL:
 * nowhere. */
dem_status walls_list(walls *w, const particles *p, double margin, const uint32_t *place);
/* One more, brought by a particle from another rank. */
dem_status walls_append(walls *w, const wall_entry *entry);
/* Particles have gone: place[old] is a particle's new index, UINT32_MAX none. */
void walls_renumber(walls *w, const uint32_t *place);
/* Largest overlap / radius of n spheres x y z r with the walls; 0 if none touches. */
double walls_overlap(const walls *w, size_t n, const double (*pos)[4]);
/* The same of one sphere, and, unless NULL, the wall that makes it. */
double walls_deepest(const walls *w, const double pos[4], size_t *wall);
/* Adds to p->force and to the loads of the walls, for the particles from where the last call left
 * off to end-1. */
void sum_wall_forces(wall_forces *job, walls *w, particles *p, size_t end);
/* Energy of normal springs and cohesion, J; the others are added to `s`. */
double walls_elastic(const walls *w, const particles *p, const coefficient *table, int n_material,
                     const extras *x, spring_energy *s);

#endif
