/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * dem.h - the discrete element engine as a library: its whole public face.
 *
 * Particles move by Newton's laws under contact forces, gravity, walls given by signed distance
 * functions, and an outside (fluid) force that answers to the particle's own velocity:
 *
 *     m dv/dt = sum F_contact + m g + f + k (w - v) + M (a - dv/dt)   (M a is handed over in f)
 *
 * The engine knows nothing of fluids, meshes or files of a case. It reports the impulse that the
 * outside force really delivered to each particle, so that whoever gave the force can close its
 * momentum balance to rounding.
 *
 * Conventions. SI units. Vectors are [n][3]. Ids are int64_t. The unit normal of a contact between
 * i and j points from j to i; the overlap is positive in contact. A wall's signed distance phi is
 * positive where particles may be. All functions that take a dem_sim are collective over its
 * communicator; errors come back as the same code on every rank, with the text in dem_message().
 *
 * References: Cundall & Strack, Geotechnique 29 (1979) 47, doi:10.1680/geot.1979.29.1.47;
 * Y. Mori, doctoral thesis, University of Tokyo (2021).
 */
#ifndef DEM_H
#define DEM_H

#include <mpi.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DEM_NAME 64 /* longest name of a material or wall, with its terminating zero */

typedef enum dem_status {
    DEM_OK = 0,
    DEM_BAD_ARGUMENT, /* a parameter is out of its range */
    DEM_NO_MEMORY,
    DEM_LOST, /* a particle left the domain; message has id, position and last force */
    DEM_NAN,  /* a particle's state is not finite; message likewise */
    DEM_IO    /* a file could not be written or read */
} dem_status;

/* ---- walls: signed distance functions ------------------------------------------------------- */

/**
 * A shape: phi(x) and its gradient. A shape consists of one or more smooth parts (a box seen from
 * the inside has six), each with its own contact and history, so that a particle in a corner feels
 * every face of it.
 */
typedef struct dem_sdf dem_sdf;

/* Constructors. phi > 0 outside the solid. `inside` nonzero turns the shape into a container:
 * particles live within it. Lengths in m; vectors need not be normalised. NULL when out of memory
 * or for a degenerate shape (zero axis, zero or negative size). */
dem_sdf *dem_sdf_plane(const double point[3], const double normal[3]);
dem_sdf *dem_sdf_box(const double lo[3], const double hi[3], int inside);
dem_sdf *dem_sdf_sphere(const double centre[3], double radius, int inside);
/* Cylinder between two points of its axis; closed: with its end discs, else infinitely long. */
dem_sdf *dem_sdf_cylinder(const double p0[3], const double p1[3], double radius, int closed,
                          int inside);
/* Frustum of a cone, radius r0 at p0 and r1 at p1; closed: with end discs, else the bare
 * lateral surface that ends at its two rims. */
dem_sdf *dem_sdf_cone(const double p0[3], const double p1[3], double r0, double r1, int closed,
                      int inside);
void dem_sdf_free(dem_sdf *sdf);

int dem_sdf_parts(const dem_sdf *sdf);
/* Signed distance (m) of part `part` at x, and its gradient. */
double dem_sdf_eval(const dem_sdf *sdf, int part, const double x[3], double gradient[3]);
/* Smallest signed distance over all parts. */
double dem_sdf_distance(const dem_sdf *sdf, const double x[3]);

/* ---- parameters ------------------------------------------------------------------------------ */

typedef enum dem_law {
    DEM_LINEAR, /* spring, dashpot and slider, constant stiffness */
    DEM_HERTZ   /* Hertz normal, Mindlin tangential force */
} dem_law;

typedef struct dem_material {
    char name[DEM_NAME];
    double density;        /* kg/m3, > 0 */
    double youngs_modulus; /* Pa, > 0 with DEM_HERTZ */
    double poisson_ratio;  /* -, (-1, .5] with DEM_HERTZ */
} dem_material;

/* What two materials do to each other. */
typedef struct dem_pair {
    double restitution;     /* -, (0, 1] */
    double friction;        /* -, >= 0 */
    double stiffness;       /* normal spring of the contact, N/m, > 0 with DEM_LINEAR */
    double stiffness_ratio; /* tangential to normal spring with DEM_LINEAR, > 0, default 1 */
} dem_pair;

typedef struct dem_wall {
    char name[DEM_NAME];
    dem_sdf *shape; /* owned by the simulation once dem_new has returned DEM_OK */
    int material;
} dem_wall;

typedef enum dem_insertion_kind {
    DEM_INSERT_RANDOM,  /* random positions without overlap, `number` or `solid_fraction` */
    DEM_INSERT_LATTICE, /* regular lattice of spacing `spacing` filling the region */
    DEM_INSERT_LIST     /* the given positions */
} dem_insertion_kind;

/* One act of creation at the start. */
typedef struct dem_insertion {
    char name[DEM_NAME];
    dem_insertion_kind kind;
    dem_sdf *region;       /* centres obey distance >= radius for RANDOM, >= 0 for LATTICE; owned
                              like a wall's shape; made with inside = 1; NULL for LIST */
    double lo[3], hi[3];   /* bounding box of the region, m */
    int64_t number;        /* RANDOM: how many, or -1 to use solid_fraction */
    double solid_fraction; /* RANDOM: volume of particles / volume of the region */
    double spacing[3];     /* LATTICE: m; first centre at lo + spacing/2 */
    size_t n;              /* LIST: number of positions, owned copy made by dem_new */
    const double (*x)[3];  /* LIST */
    int material;
    double diameter;            /* m */
    double velocity[3];         /* m/s */
    double velocity_spread;     /* m/s, standard deviation of each component (normal), >= 0 */
    double angular_velocity[3]; /* rad/s */
    uint64_t seed;
} dem_insertion;

typedef struct dem_param {
    double lo[3], hi[3]; /* domain, m; leaving it through a side not periodic is fatal */
    int periodic[3];
    double gravity[3]; /* m/s2 */
    dem_law law;
    size_t n_material;
    const dem_material *material;
    const dem_pair *pair; /* [n_material * n_material], symmetric */
    size_t n_wall;
    const dem_wall *wall;
    size_t n_insertion;
    const dem_insertion *insertion;
    double steps_per_period; /* Omega of the DEM time step, default 20 */
    double time_step;        /* largest DEM step, s; 0: from steps_per_period alone */
    double impact_speed;     /* m/s, floor of the speed that sets Hertz's contact time; 0: none */
    double skin;             /* Verlet skin / median diameter, default .15; > 0 */
} dem_param;

dem_param dem_param_default(void);

/* ---- life cycle ------------------------------------------------------------------------------ */

typedef struct dem_sim dem_sim;

/**
 * Make a simulation: checks `param`, duplicates `comm`, builds the walls and runs the insertions.
 * On error *sim may be non-NULL and then carries only the message; free it all the same.
 */
dem_status dem_new(MPI_Comm comm, const dem_param *param, dem_sim **sim);
void dem_free(dem_sim *sim);
/* Text of the last error, "" if none. Never NULL. */
const char *dem_message(const dem_sim *sim);

/* ---- particles ------------------------------------------------------------------------------- */

/* Borrowed view of the particles on this rank, valid until the next call that is not const.
 * `revision` changes whenever particles were added, removed or put in another order. */
typedef struct dem_view {
    uint64_t revision;
    size_t n;
    const int64_t *id;
    const double (*x)[3];     /* m */
    const double (*v)[3];     /* m/s */
    const double (*omega)[3]; /* rad/s */
    const double *radius;     /* m */
    const double *mass;       /* kg */
    const int *material;
    const double (*force)[3];   /* contact force + weight of the last step, N */
    const double (*impulse)[3]; /* delivered by the outside force in the last dem_advance, N s */
} dem_view;

dem_view dem_particles(const dem_sim *sim);

/**
 * Add particles. v and omega may be NULL (zero). id may be NULL (numbered on from the largest).
 * Fatal for a centre outside the domain, a state that is not finite, or two particles, new or
 * present, that overlap by more than 1.5 times the smaller radius: no contact is that deep, and
 * from coincident centres there is no direction to go apart. Nothing is added then.
 */
dem_status dem_add(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                   const double (*omega)[3], const double *radius, const int *material,
                   const int64_t *id);

/**
 * Attach a named column of `width` doubles per particle, zero at first, that follows the
 * particles through sorting, insertion and removal. Returns its handle (>= 0) or -1.
 */
int dem_attach(dem_sim *sim, const char *name, int width);
/* The column, [n][width], valid as long as a dem_view. */
double *dem_column(dem_sim *sim, int handle);

/**
 * Set the outside force F = f + k (w - v) - M dv/dt for the coming dem_advance, in the order of
 * the current view. f, w: [n][3] (N, m/s); k: [n] (kg/s, >= 0); M: [n] (kg, >= 0) or NULL.
 * Copied. v is taken anew in every sub-step, implicitly. Stays in force until set again; f, k and
 * w all NULL: no outside force any more.
 */
dem_status dem_set_outside_force(dem_sim *sim, const double (*f)[3], const double *k,
                                 const double (*w)[3], const double *M);

/* ---- time ------------------------------------------------------------------------------------ */

/* The limits on the DEM time step, s (infinite where one does not apply). */
typedef struct dem_limits {
    double contact;  /* linear: 2 pi sqrt(m/k) / Omega; Hertz: 2 contact times / Omega at the speed
                        max(2 * fastest, sqrt(|g| d), impact_speed, speed at which the largest
                        overlap present drives apart), or the Rayleigh limit if that is zero */
    double rayleigh; /* .2 of the Rayleigh time, DEM_HERTZ only; reported, not imposed */
    double user;     /* param.time_step */
    double step;     /* the step the next dem_advance will not exceed */
} dem_limits;

dem_limits dem_time_limits(const dem_sim *sim);

/**
 * Advance by dt in equal sub-steps: `substeps` of them, or, for 0, as few as dem_time_limits
 * allows. Symplectic Euler. DEM_LOST and DEM_NAN leave the state as it was found to be bad.
 */
dem_status dem_advance(dem_sim *sim, double dt, int substeps);

double dem_time(const dem_sim *sim);
void dem_set_time(dem_sim *sim, double time);

/* ---- what happened --------------------------------------------------------------------------- */

/* Sums over all ranks, taken in the last dem_advance or at its end. */
typedef struct dem_report {
    int64_t particles;
    int substeps;
    double step;      /* s, of a sub-step */
    int64_t contacts; /* between particles, touching at the end */
    int64_t wall_contacts;
    double overlap;            /* largest overlap / radius of the smaller particle, - */
    double speed;              /* largest, m/s */
    double kinetic_energy;     /* translational, J */
    double rotational_energy;  /* J */
    double momentum[3];        /* sum m v, kg m/s */
    double outside_impulse[3]; /* delivered by the outside force, N s */
    double gravity_impulse[3]; /* N s */
    double wall_impulse[3];    /* given by all walls to particles, N s */
    int64_t rebuilds;          /* neighbour lists built since dem_new */
    double seconds_force, seconds_neighbour, seconds_other; /* wall-clock, in the last advance */
} dem_report;

dem_report dem_last_report(const dem_sim *sim);
size_t dem_walls(const dem_sim *sim);
const char *dem_wall_name(const dem_sim *sim, size_t wall);
/* Force on wall `wall` by the particles, mean over the last dem_advance, N. */
void dem_wall_force(const dem_sim *sim, size_t wall, double force[3]);

/* ---- output ---------------------------------------------------------------------------------- */

/**
 * Write `<directory>/<name>.h5` (datasets under /particles, attribute `time`) and add it to
 * `<directory>/particles.xmf`, a time series that ParaView opens. Files are written whole under
 * another name and then renamed.
 */
dem_status dem_write_snapshot(dem_sim *sim, const char *directory, const char *name);

#ifdef __cplusplus
}
#endif
#endif
