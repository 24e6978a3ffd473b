/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * particles.h - what the readers of the parts of demProperties share; private to caseLib.
 */
#ifndef CASE_PARTICLES_H
#define CASE_PARTICLES_H

#include "tree.h"

typedef struct place {
    const char *file;
    int line;
} place;

/* Owner of a case_dem's arrays, and where its parts stand in the files, for later checks. */
typedef struct particle_storage {
    store *store;
    place domain, contacts;
    place *wall;            /* [n_wall] */
    place *insertion;       /* [n_insertion], of the key that gives the positions */
    place *diameter;        /* [n_insertion] */
    const char **positions; /* [n_insertion], the file of type file, else NULL */
} particle_storage;

typedef struct particle_reader {
    const case_dict *dict;
    const char *directory;
    const case_mesh *mesh;
    dem_param *param;
    particle_storage *storage;
    case_errors *errors;
} particle_reader;

/* shape.c: a wall's shape, or with `region` the inside of a closed one. Bounds of what is not
 * unbounded. NULL with an error. */
dem_sdf *read_shape(const case_dict *dict, int region, double lo[3], double hi[3],
                    case_errors *errors);

/* material.c */
void read_materials(particle_reader *reader);
/* Index of the material that a key names, 0 with an error when there is none. */
int read_material(const particle_reader *reader, const case_dict *dict);
/* After walls and insertions: which pairs can meet depends on them. */
void read_contacts(particle_reader *reader);

/* insertion.c */
void read_insertions(particle_reader *reader);

place place_of(store *store, const case_dict *dict, const char *key);
void copy_name(const particle_reader *reader, const case_dict *dict, char name[DEM_NAME]);

#endif
