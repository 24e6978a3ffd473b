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

/* A surface of triangles that a shape was made of. */
typedef struct surface {
    place at;
    const char *key;  /* path of the key `file` */
    const char *name; /* of the file */
    double extent[3]; /* m, after scaling */
    double spacing;   /* m; 0: not given */
    int samples;      /* of a wall, whose distances are sampled */
    struct surface *next;
} surface;

/* Owner of a case_dem's arrays, and where its parts stand in the files, for later checks. */
typedef struct particle_storage {
    store *store;
    place domain, contacts;
    place *wall;            /* [n_wall] */
    place *insertion;       /* [n_insertion], of the key that gives the positions */
    place *diameter;        /* [n_insertion] */
    const char **positions; /* [n_insertion], the file of type file, else NULL */
    place *feeder;          /* [n_feeder], of its region */
    place *feeder_diameter; /* [n_feeder] */
    place *outlet;          /* [n_outlet], of its region */
    surface *surfaces;      /* latest first */
} particle_storage;

typedef struct particle_reader {
    const case_dict *dict;
    const char *directory;
    const case_mesh *mesh;
    dem_param *param;
    particle_storage *storage;
    case_errors *errors;
} particle_reader;

/* ---- shapes ---------------------------------------------------------------------------------- */

/* A box that holds a region; `loose`: one that may be larger than needed. */
typedef struct extent {
    double lo[3], hi[3];
    int loose;
} extent;

/* shape.c: a wall's shape, or with `region` the inside of a closed one and the box that holds it.
 * NULL with an error. */
dem_sdf *read_shape(particle_reader *reader, const case_dict *dict, int region, extent *box);
/* simple_shape.c: the types that shape.c does not know. `type` is one of simple_words. */
extern const char *const simple_words[]; /* NULL-terminated; regions take all but the first */
dem_sdf *read_simple_shape(particle_reader *reader, const case_dict *dict, int type, int region,
                           extent *box);
/* Keys that any shape may have, for the lists of known ones. */
#define SHAPE_KEYS "type", "scale", "rotate", "translate"
/* region.c: the sub-dictionary `region`, which must lie in the domain if `within`. NULL with an
 * error. lo, hi: box of the region, m. */
dem_sdf *read_region(particle_reader *reader, const case_dict *dict, int within, double lo[3],
                     double hi[3]);
/* Is there a point with phi > 0 for all n shapes in the box? Found by halving boxes that may hold
 * one, down to `level` halvings. */
int has_room(size_t n, const dem_sdf *const *shape, const double lo[3], const double hi[3],
             int level);

/* ---- parts of the dictionary ----------------------------------------------------------------- */

/* material.c */
void read_materials(particle_reader *reader);
/* Index of the material that a key names, 0 with an error when there is none. */
int read_material(const particle_reader *reader, const case_dict *dict);
/* After walls, insertions and feeders: which pairs can meet depends on them. */
void read_contacts(particle_reader *reader);

/* wall.c, motion.c */
void read_walls(particle_reader *reader);
void read_motions(particle_reader *reader, const case_dict *dict, dem_wall *wall);

/* size.c: keys material, diameter, size, species, shareBy */
typedef struct kinds {
    size_t n;
    dem_species *species; /* [n] */
    int by_mass;
} kinds;
#define KIND_KEYS "material", "diameter", "size", "species", "shareBy"
kinds read_kinds(particle_reader *reader, const case_dict *dict);
/* Key that the diameters stand at. */
const char *size_key(const case_dict *dict);
/* Smallest and largest diameter, m; of laws without bounds those of 1 in 1000. */
double size_least(const dem_size *size);
double size_most(const dem_size *size);
/* Of all that an insertion or feeder makes. */
double least_diameter(size_t n, const dem_species *species);
double most_diameter(size_t n, const dem_species *species);

/* insertion.c, feed.c */
void read_insertions(particle_reader *reader);
void read_feeders(particle_reader *reader);
void read_outlets(particle_reader *reader);
/* How particles move when they are made: velocity, velocitySpread, angularVelocity, seed. */
#define START_KEYS "velocity", "velocitySpread", "angularVelocity", "seed"
typedef struct birth {
    double velocity[3], velocity_spread, angular_velocity[3];
    uint64_t seed;
} birth;
birth read_birth(const case_dict *dict, case_errors *errors);
/* Particles of `diameter` have to fit into the box of a region. */
void check_fit(particle_reader *reader, const case_dict *dict, const char *key, double diameter,
               const double lo[3], const double hi[3]);

/* rows.c: a table { rows ( (...) ... ); } or { file "..."; } of at least `least` rows, all of
 * `width` numbers, or of `other` if that is not 0. NULL with an error. */
const double *read_rows(particle_reader *reader, const case_dict *dict, size_t width, size_t other,
                        size_t least, const char *accepted, size_t *n, size_t *found);
/* A file named in constant/demProperties: there, or from the top of the case, or absolute. `folder`
 * is looked into first. 0 when it is in none; then path is that of the first. */
int find_file(const particle_reader *reader, const char *folder, const char *name, char *path,
              size_t size);
/* A dictionary found so, NULL with errors. */
case_dict *read_beside(const particle_reader *reader, const case_dict *dict, const char *key);

/* check_geometry.c: surfaces of triangles against domain and particles: how many are refused.
 * Then what is to be filled against the walls; feeders and outlets against the domain and each
 * other. */
int check_surfaces(const case_dem *dem, case_errors *errors);
void check_sides(const case_dem *dem, case_errors *errors);
void check_feeds(const case_dem *dem, case_errors *errors);

place place_of(store *store, const case_dict *dict, const char *key);
void copy_name(const particle_reader *reader, const case_dict *dict, char name[DEM_NAME]);
/* The same text in the memory of the case. */
const char *keep_text(particle_reader *reader, const char *text);

#endif
