/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall.h - contact of particles with walls given by signed distance functions.
 */
#ifndef DEM_WALL_H
#define DEM_WALL_H

#include "contact_law.h"
#include "particles.h"

/* A particle near a part of a wall: it may touch before the next rebuild. */
typedef struct wall_entry {
    double spring[4];
    uint32_t particle;
    int wall, part;
    int touch; /* when the forces were last summed */
} wall_entry;

typedef struct walls {
    size_t n;
    dem_wall *wall;     /* [n], shapes owned */
    double (*force)[3]; /* [n], on the wall, sum over the sub-steps of a dem_advance */
    wall_entry *entry, *before;
    size_t n_entry, capacity, n_before, before_capacity;
} walls;

typedef struct wall_forces {
    dem_law law;
    const coefficient *table; /* [n_material * n_material] */
    int n_material;
    double dt;
    size_t contacts;        /* out */
    double overlap;         /* out: largest overlap / radius */
    double on_particles[3]; /* out: sum of the forces */
} wall_forces;

dem_status walls_init(walls *w, size_t n, const dem_wall *wall);
void walls_free(walls *w, int free_shapes);
/* List the particles that may touch within `margin` of motion; history is kept. `place` tells
 * where particles have gone since the last call, NULL: nowhere. */
dem_status walls_list(walls *w, const particles *p, double margin, const uint32_t *place);
/* Largest overlap / radius of n spheres x y z r with the walls; 0 if none touches. */
double walls_overlap(const walls *w, size_t n, const double (*pos)[4]);
/* Adds to p->force and to w->force. */
void sum_wall_forces(wall_forces *job, walls *w, particles *p);

#endif
