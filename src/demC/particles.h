/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * particles.h - the store of particles: add, remove, grow, sort, attached columns.
 *
 * Data layout. What the force loop reads lies in records of 32 or 64 aligned bytes, one cache line
 * at most per particle and purpose; a fourth number fills what three vector components leave free:
 *
 *     pos   x y z r                    vel   vx vy vz 1/m   wx wy wz 1/I      I = 2/5 m r^2
 *     force Fx Fy Fz 0  Tx Ty Tz 0     outside fx fy fz k   wx wy wz M
 *
 * The arrays of dem_view are copies, brought up to date by particles_publish() when the engine
 * returns to its caller. Every array is entered in a table of fields, so that growing and sorting
 * are one loop each. While particles are sorted the forces, which are zero then, lend their room.
 */
#ifndef DEM_PARTICLES_H
#define DEM_PARTICLES_H

#include "dem.h"

/* Four doubles as the machine handles them. Never passed by value between functions. */
typedef double vec4 __attribute__((vector_size(32)));

typedef struct field {
    void **slot; /* where the address of the array is kept; NULL: in `data` */
    void *data;
    size_t size;     /* bytes per particle */
    int stays;       /* nonzero: made anew before it is read again, so it need not be sorted */
    int ghosts;      /* nonzero: ghosts have rows in it, behind those of the n particles */
    double *removed; /* of a column: its sum over the particles that have gone */
    int restored;    /* of a column: 1 it comes from a restart file and waits for who attaches it,
                        2 it has been attached */
    char name[DEM_NAME];
} field;

typedef struct particles {
    size_t n, n_ghost, capacity; /* rows n...n + n_ghost - 1: copies of other ranks' particles */
    uint64_t revision;
    int64_t next_id;

    double (*pos)[4];
    double (*vel)[8];
    double (*force)[8];
    double (*outside)[8]; /* NULL until there is an outside force */
    double (*built)[4];   /* pos when the neighbour list was built */

    int64_t *id;
    double *radius, *mass;
    int *material;

    double (*x)[3], (*v)[3], (*omega)[3], (*last)[3]; /* published */
    double (*impulse)[3];                             /* likewise, and summed in the steps before */

    field *field;
    size_t n_field, n_fixed; /* fields beyond n_fixed are attached columns */
} particles;

dem_status particles_init(particles *p);
void particles_free(particles *p);
dem_status particles_reserve(particles *p, size_t capacity);
/* Make the field `outside`, with zeros, if it is not there. */
dem_status particles_open_outside(particles *p);
/* Put at the place i what was at the place order[i], in every field that does not stay; order has
 * the ghosts behind. */
dem_status particles_permute(particles *p, const uint32_t *order);
/* Keep the n particles at the places order[], increasing, in that order. */
dem_status particles_keep(particles *p, const uint32_t *order, size_t n);
/* Handle of a new column, or of one of that name and width that waits, or -1. */
int particles_attach(particles *p, const char *name, int width);
/* Undo the last particles_attach, which gave that handle. */
void particles_detach(particles *p, int handle);
double *particles_column(particles *p, int handle);
/* Sums of the columns over the particles gone since: to zero, and with that of row i. */
void particles_clear_removed(particles *p);
void particles_count_removed(particles *p, size_t i);
/* Ghosts give up n rows in front of them; there must be room. */
void particles_push_ghosts(particles *p, size_t n);
/* Append one particle; there must be room, and no ghosts. */
void particles_append(particles *p, const double x[3], const double v[3], const double omega[3],
                      double radius, double mass, int material, int64_t id);
/* Copy x (wrapped into the periodic directions), v, omega for dem_view. */
void particles_publish(particles *p, const double lo[3], const double hi[3], const int periodic[3]);

#endif
