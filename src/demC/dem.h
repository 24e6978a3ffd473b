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
 * positive where particles may be.
 *
 * On several ranks. Parameters are the same on all of them, lists and tables included. Functions
 * that change a simulation or write are collective over its communicator; what only looks
 * (dem_particles, dem_column, dem_time, dem_last_report and the like) is not. dem_add and
 * dem_set_outside_force take from every rank what it has, a view and a column are of the particles
 * that are here now, all other numbers are of all ranks and the same on each. A particle belongs to
 * the rank in whose part of space it is; it may change ranks in dem_add and dem_advance. Errors
 * come back as the same code on every rank, with the text in dem_message().
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

/* Shapes of shapes. They take possession of their members, also when they return NULL (out of
 * memory, no member, a member that is NULL). The solid of a union is that of any member, the solid
 * of an intersection that of all; the complement turns solid and free space about. A member of a
 * union is felt where its surface is bare, with contacts of its own, so that a particle in the
 * corner between two members touches both. */
dem_sdf *dem_sdf_union(size_t n, dem_sdf *const *member);
dem_sdf *dem_sdf_intersection(size_t n, dem_sdf *const *member);
dem_sdf *dem_sdf_complement(dem_sdf *member);
/* The member scaled about the origin (> 0), then turned by `angle` (rad) about the axis through the
 * origin, then shifted by `translation` (m). axis may be anything when the angle is 0. */
dem_sdf *dem_sdf_transform(dem_sdf *member, double scale, const double axis[3], double angle,
                           const double translation[3]);

/* A surface of triangles from an STL file, ASCII or binary. */
typedef struct dem_stl {
    const char *path;
    double scale;         /* of the file's numbers to m, > 0; default 1 */
    int inside;           /* particles live within the surface */
    int mend;             /* nonzero: a surface that is not closed is accepted and the side told by
                             the winding number; else it is refused */
    double spacing;       /* of the samples, m; 0: a quarter of the smallest particle diameter */
    double feature_angle; /* rad, (0, pi]: concave edges sharper than this part the surface into
                             faces that are felt separately; default .7 (40 degrees) */
} dem_stl;
dem_stl dem_stl_default(void);
/* Reads and checks the file. NULL in error, with the reason in `message` of `size` bytes: cannot be
 * read, truncated, empty, zero-area triangles, not closed, not oriented. Not collective. Distances
 * are exact, by search among the triangles, until dem_new samples the shapes of walls. */
dem_sdf *dem_sdf_stl(const dem_stl *stl, char *message, size_t size);

/* Box that holds the surface of the shape, m; infinite where the surface is. */
void dem_sdf_bounds(const dem_sdf *sdf, double lo[3], double hi[3]);
/* Bytes that the shape takes. */
size_t dem_sdf_memory(const dem_sdf *sdf);

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

/* Resistance to rolling; theory.md, "Rolling resistance". */
typedef enum dem_rolling {
    DEM_ROLLING_NONE,
    DEM_ROLLING_CONSTANT, /* torque mu_r R_eff F_n against the relative spin */
    DEM_ROLLING_EPSD      /* elastic-plastic spring and dashpot (Ai et al. 2011) */
} dem_rolling;

typedef enum dem_cohesion {
    DEM_COHESION_NONE,
    DEM_COHESION_SJKR /* attraction = cohesion energy density * contact area */
} dem_cohesion;

typedef struct dem_material {
    char name[DEM_NAME];
    double density;        /* kg/m3, > 0 */
    double youngs_modulus; /* Pa, > 0 with DEM_HERTZ */
    double poisson_ratio;  /* -, (-1, .5] with DEM_HERTZ */
} dem_material;

/* What two materials do to each other. */
typedef struct dem_pair {
    double restitution;      /* -, (0, 1] */
    double friction;         /* -, >= 0 */
    double stiffness;        /* normal spring of the contact, N/m, > 0 with DEM_LINEAR */
    double stiffness_ratio;  /* tangential to normal spring with DEM_LINEAR, > 0, default 1 */
    double rolling_friction; /* mu_r, -, >= 0 */
    double rolling_damping;  /* EPSD: share of critical damping, -, >= 0 */
    double cohesion;         /* SJKR: cohesion energy density, J/m3, >= 0 */
} dem_pair;

/* ---- motion of walls ------------------------------------------------------------------------- */

typedef enum dem_motion_kind {
    DEM_TRANSLATION, /* with the velocity `vector` */
    DEM_ROTATION,    /* about the axis `vector` through `origin` at `rate` */
    DEM_OSCILLATION, /* shift vector sin(2 pi frequency t + phase) */
    DEM_ROCKING,     /* angle `amplitude` sin(2 pi frequency t + phase) about the axis */
    DEM_TABLE        /* shift and rotation vector (rad, about `origin`) by cubic splines in time
                        that begin and end at rest */
} dem_motion_kind;

/* A rigid motion. It is at rest before `begin`, with the place of that moment, and after `end`. t
 * is the time since `begin`. Place and velocity are functions of time alone. */
typedef struct dem_motion {
    dem_motion_kind kind;
    double begin, end;        /* s */
    double ramp;              /* s, >= 0: the speed of TRANSLATION, ROTATION grows evenly to its
                                 full value */
    double vector[3];         /* m/s, m, or axis */
    double origin[3];         /* m, where the wall is before it moves */
    double rate;              /* rad/s */
    double amplitude;         /* rad */
    double frequency, phase;  /* Hz, rad */
    size_t n;                 /* TABLE: rows, >= 2 */
    const double *time;       /* [n], s, increasing; before and after: at rest */
    const double (*shift)[3]; /* [n], m, or NULL: none */
    const double (*turn)[3];  /* [n], rad, or NULL: none */
} dem_motion;
dem_motion dem_motion_default(void);

typedef struct dem_wall {
    char name[DEM_NAME];
    dem_sdf *shape; /* owned by the simulation once dem_new has returned DEM_OK; not repeated
                       beyond periodic sides: it must go on there by itself */
    int material;
    size_t n_motion;
    const dem_motion *motion; /* [n_motion], applied one after the other: the axis of a later one
                                 stands in space, that of an earlier one is carried along; copied */
    double centre[3];         /* of the torque on the wall, m; moves with it */
} dem_wall;

/* ---- sizes and species ----------------------------------------------------------------------- */

typedef enum dem_size_kind {
    DEM_SIZE_EQUAL,         /* `mean` */
    DEM_SIZE_UNIFORM,       /* between `lo` and `hi` */
    DEM_SIZE_NORMAL,        /* `mean`, `deviation` */
    DEM_SIZE_LOGNORMAL,     /* median `mean`, `deviation` of ln d */
    DEM_SIZE_ROSIN_RAMMLER, /* share below d: 1 - exp(-(d/mean)^exponent) */
    DEM_SIZE_TABLE          /* share below diameter[i] is cumulative[i], straight in between */
} dem_size_kind;

/* A distribution of diameters, of the number of particles or of their mass. */
typedef struct dem_size {
    dem_size_kind kind;
    int by_mass;
    double mean;      /* m */
    double deviation; /* m; LOGNORMAL: - */
    double exponent;
    double lo, hi; /* m; the distribution is cut off there and normalised again; 0 < lo < hi, both
                      0: not cut off, which NORMAL and ROSIN_RAMMLER do not allow */
    size_t n;
    const double *diameter, *cumulative; /* [n], increasing, cumulative from 0 to 1; copied */
} dem_size;

/* A kind of particle within an insertion or a feed. */
typedef struct dem_species {
    int material;
    dem_size size;
    double share; /* of the particles' mass or number; the shares need not add up to 1 */
} dem_species;

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
    size_t n_species;           /* RANDOM: > 0 overrides material and diameter */
    const dem_species *species; /* [n_species]; copied */
    int share_by_mass;          /* shares of mass, else of number */
    double velocity[3];         /* m/s */
    double velocity_spread;     /* m/s, standard deviation of each component (normal), >= 0 */
    double angular_velocity[3]; /* rad/s */
    uint64_t seed;
} dem_insertion;

/* Particles that enter during the run, at random free places of a region, at moments of the
 * feeder's own from `begin` to `end` (feed.c). What the rate asks for and the region has no room
 * for waits, up to the end. */
typedef struct dem_feeder {
    char name[DEM_NAME];
    dem_sdf *region;     /* as in dem_insertion; owned likewise */
    double lo[3], hi[3]; /* m, box of the region */
    size_t n_species;    /* >= 1 */
    const dem_species *species;
    int share_by_mass;
    double mass_rate, number_rate; /* kg/s, 1/s; one is > 0, the other 0 */
    double begin, end;             /* s */
    double mass;                   /* kg in all, or INFINITY */
    int64_t number;                /* particles in all, or -1: no limit */
    double velocity[3], velocity_spread, angular_velocity[3];
    uint64_t seed;
} dem_feeder;

/* A region that takes every particle whose centre gets into it: when the neighbour list is rebuilt,
 * and at the end of every dem_advance. It should be wider than the skin. */
typedef struct dem_outlet {
    char name[DEM_NAME];
    dem_sdf *region;   /* made with inside = 1; owned likewise */
    double begin, end; /* s */
} dem_outlet;

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
    size_t n_feeder;
    const dem_feeder *feeder;
    size_t n_outlet;
    const dem_outlet *outlet;
    dem_rolling rolling;
    dem_cohesion cohesion;
    int balance;           /* nonzero: keep the balance of energy and angular momentum */
    const char *sdf_cache; /* directory that keeps sampled shapes, or NULL: none */
    void (*progress)(void *context, const char *what, double done); /* of long work in dem_new,
                                                                       done 0...1; or NULL */
    void *progress_context;
    double fixed_step;       /* s; > 0: the DEM step, refused where it is above a limit */
    double steps_per_period; /* Omega of the DEM time step, default 20 */
    double time_step;        /* largest DEM step, s; 0: from steps_per_period alone */
    double impact_speed;     /* m/s, floor of the speed that sets Hertz's contact time; 0: none */
    double skin;             /* Verlet skin / median diameter, default .15; > 0 */
    double imbalance; /* several ranks: particles are divided anew among them when the busiest one
                         works this many times as long as the mean; > 1, default 1.1 */
    const char *restart; /* file of dem_write_restart to go on from, or NULL; see there */
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
/* Text of the last error, or a note that dem_new or dem_add left about a cache of samples that it
 * could not use; "" if none. Never NULL. */
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
/* Sum of the column, [width], over the particles that outlets took on this rank in the last
 * dem_advance. */
void dem_removed_column(const dem_sim *sim, int handle, double *sum);

/* Whether the column came with a restart file, instead of being made anew with zeros. */
int dem_column_restored(const dem_sim *sim, int handle);

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
                        max(2 * fastest particle or wall, sqrt(|g| d), impact_speed, speed at which
                        the  largest     overlap present drives apart), or the Rayleigh limit if that
                        is zero */
    double rayleigh; /* .2 of the Rayleigh time, DEM_HERTZ only; reported, not imposed */
    double wall;     /* a tenth of the smallest radius at the speed of the fastest wall */
    double skin;     /* half the skin at the speed of the fastest particle; reported, not imposed */
    double user;     /* param.time_step */
    double step;     /* the step the next dem_advance will not exceed */
} dem_limits;

dem_limits dem_time_limits(const dem_sim *sim);
/* Contact and Rayleigh limit of materials a and b, s; infinite where none of them meet. */
void dem_pair_limits(const dem_sim *sim, int a, int b, double *contact, double *rayleigh);

/**
 * Advance by dt in equal sub-steps: `substeps` of them, or, for 0, as few as dem_time_limits
 * allows. Symplectic Euler. DEM_LOST and DEM_NAN leave the state as it was found to be bad.
 */
dem_status dem_advance(dem_sim *sim, double dt, int substeps);

double dem_time(const dem_sim *sim);
void dem_set_time(dem_sim *sim, double time);

/* ---- what happened --------------------------------------------------------------------------- */

/* Energies, J, kept when param.balance is set. Work and losses are sums since dem_new;
 * kinetic + rotational + elastic - work - supply + losses stays what it was at the start, but for
 * the error of the time integration. */
typedef struct dem_energy {
    double kinetic, rotational;
    double elastic;  /* in normal, tangential and rolling springs, cohesion included */
    double gravity;  /* work of gravity */
    double outside;  /* work of the outside force */
    double walls;    /* work of moving walls on particles */
    double damping;  /* lost in dashpots, normal and tangential */
    double sliding;  /* lost by friction */
    double rolling;  /* lost by rolling resistance */
    double supply;   /* brought by particles fed or added, less what left with others */
    double residual; /* what the sum above is off by since the start */
} dem_energy;

/* Sums over all ranks, taken in the last dem_advance or at its end. */
typedef struct dem_report {
    int64_t particles;
    int substeps;
    double step;      /* s, of a sub-step */
    int64_t contacts; /* between particles, touching at the end */
    int64_t wall_contacts;
    double overlap;                /* largest overlap / radius of the smaller particle, - */
    double speed;                  /* largest, m/s */
    double kinetic_energy;         /* translational, J */
    double rotational_energy;      /* J */
    double momentum[3];            /* sum m v, kg m/s */
    double outside_impulse[3];     /* delivered by the outside force, to those removed too, N s */
    double gravity_impulse[3];     /* N s */
    double wall_impulse[3];        /* given by all walls to particles, N s */
    double mass;                   /* of the particles present, kg */
    int64_t fed, removed;          /* particles, in the last advance */
    double fed_mass, removed_mass; /* kg, likewise */
    double fed_momentum[3], removed_momentum[3]; /* kg m/s, likewise */
    double removed_impulse[3]; /* what the outside force gave to those removed, N s, likewise */
    dem_energy energy;         /* zeros unless param.balance */
    /* about the origin, kg m2/s, unless param.balance is 0: of the particles; given in the last
     * advance by walls, gravity and outside force; meaningless with periodic sides */
    double angular_momentum[3], wall_angular[3], gravity_angular[3], outside_angular[3];
    int64_t rebuilds; /* neighbour lists built since dem_new */
    /* wall-clock in the last advance, of the rank that took longest for each; force: and motion */
    double seconds_force, seconds_neighbour, seconds_exchange, seconds_other;
    double imbalance;  /* work of the busiest rank over the mean, when last measured; 1 on one */
    int64_t divisions; /* of the domain among the ranks, since dem_new */
    int64_t ghosts;    /* particles that a rank has copies of, sum over the ranks */
} dem_report;

dem_report dem_last_report(const dem_sim *sim);

/* Bytes in use on this rank. */
typedef struct dem_memory {
    size_t particles;  /* and their copies for the caller, and for ghosts */
    size_t columns;    /* attached */
    size_t neighbours; /* cells and list */
    size_t contacts;   /* springs and flags */
    size_t balance;    /* of energy, if it is kept */
    size_t walls;      /* list of the particles near them */
    size_t shapes;     /* triangles and samples */
    size_t all;
} dem_memory;
dem_memory dem_memory_used(const dem_sim *sim);

size_t dem_walls(const dem_sim *sim);
const char *dem_wall_name(const dem_sim *sim, size_t wall);
/* Force on wall `wall` by the particles, mean over the last dem_advance, N. */
void dem_wall_force(const dem_sim *sim, size_t wall, double force[3]);
/* Its torque about the wall's centre, likewise, N m. */
void dem_wall_torque(const dem_sim *sim, size_t wall, double torque[3]);
/* Whether it has a motion. */
int dem_wall_moves(const dem_sim *sim, size_t wall);
/* Where the wall is: x = place + R (x_start), R row by row. */
void dem_wall_place(const dem_sim *sim, size_t wall, double place[3], double rotation[9]);

/* What a feeder or an outlet has let through since dem_new. `waiting`: kg that a feeder still owes
 * because its region was full. */
size_t dem_feeders(const dem_sim *sim);
const char *dem_feeder_name(const dem_sim *sim, size_t feeder);
void dem_fed(const dem_sim *sim, size_t feeder, int64_t *number, double *mass, double *waiting);
size_t dem_outlets(const dem_sim *sim);
const char *dem_outlet_name(const dem_sim *sim, size_t outlet);
void dem_removed(const dem_sim *sim, size_t outlet, int64_t *number, double *mass);

/* ---- output ---------------------------------------------------------------------------------- */

/**
 * Write `<directory>/<name>.h5` (datasets under /particles, attribute `time`) and add it to
 * `<directory>/particles.xmf`, a time series that ParaView opens. Files are written whole under
 * another name and then renamed.
 */
dem_status dem_write_snapshot(dem_sim *sim, const char *directory, const char *name);

/* ---- restart --------------------------------------------------------------------------------- */

/**
 * Write all state to `<directory>/<name>.h5`, whole and on the disk before it has that name; then
 * delete all but the last `keep` (0: none) of the restart files there whose names are numbers not
 * above this one's. DEM_IO: the files that were there are as they were.
 *
 * A simulation made with param.restart goes on bit for bit where this one is, on any number of
 * ranks, which the file does not tell. Insertions are not run. Materials, walls, feeders, outlets
 * and all settings are those of the parameters, which may have changed; history goes by their
 * names, and is left behind by what is no more. The materials of the particles, contact law,
 * rolling resistance and periodic sides must be as they were. Every byte of the file is checked;
 * one that is not whole, of another kind or of a newer version is refused. Columns come with their
 * values to who attaches them again.
 */
dem_status dem_write_restart(dem_sim *sim, const char *directory, const char *name, int keep);
/* Numbers of the caller that go into restart files and come back with them: by a name without '/',
 * replaced when it is there already. Copied. */
dem_status dem_keep(dem_sim *sim, const char *name, size_t n, const double *value);
/* How many numbers are kept under that name, 0: none; at most n of them are copied. */
size_t dem_kept(const dem_sim *sim, const char *name, size_t n, double *value);

#ifdef __cplusplus
}
#endif
#endif
