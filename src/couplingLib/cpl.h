/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * cpl.h - coupling of particles with a volume-averaged fluid: arrays in, arrays out.
 *
 * One idea: a sparse map W[p][c] >= 0 whose rows sum to 1, built once per coupling step.
 *
 *     solid fraction   (1 - eps)_c = sum_p W_pc V_p / V_c
 *     gather           q_p         = sum_c W_pc q_c            fluid -> particle
 *     scatter          S_c         = sum_p W_pc s_p / V_c      particle -> fluid
 *
 * Gather is the transpose of scatter, so what one side gives the other receives, to rounding.
 * Models of the void fraction differ only in how the rows of W are filled. Volume that would push
 * a cell beyond the packing limit is moved to its neighbours by moving weight within rows.
 *
 * On several ranks each has some of the cells and some of the particles, divided independently of
 * each other: rows of W are made where the particle is, and values of the cells that a row names
 * but another rank owns are fetched from there, or sums for them sent there. Traffic grows with the
 * number of such cells alone.
 *
 * Knows neither the particle engine nor the flow solver. SI units; vectors are [n][3]. Functions
 * return CPL_OK or a code, with the text in the object's message.
 *
 * References: Y. Mori, doctoral thesis, University of Tokyo (2021), chapter 2;
 * Mori, Wu & Sakai, Powder Technol. 349 (2019) (semi-implicit drag).
 */
#ifndef CPL_H
#define CPL_H

#include <mpi.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum cpl_status {
    CPL_OK = 0,
    CPL_BAD_ARGUMENT,
    CPL_NO_MEMORY,
    CPL_OUTSIDE,   /* a particle is in no cell; message has its row and position */
    CPL_FULL,      /* no room left for the solid volume anywhere around a cell */
    CPL_IMBALANCE, /* the ledger's residual passed its threshold */
    CPL_IO         /* a file could not be written */
} cpl_status;

/* ---- mesh ------------------------------------------------------------------------------------ */

/**
 * Cells as arrays, borrowed for the life of the map. Bounds are axis-aligned boxes around the
 * cells. Neighbours of cell c are neighbour[offset[c] .. offset[c+1]): all cells that share a face.
 */
typedef struct cpl_mesh {
    size_t n;
    const double *volume; /* [n], m3 */
    const double (*centre)[3];
    const double (*lo)[3], (*hi)[3];
    const size_t *offset; /* [n+1] */
    const int *neighbour;
    /* Cell holding each of m points, -1 outside. */
    void (*locate)(void *context, size_t m, const double (*x)[3], int *cell);
    void *context;
    /* A mesh that is a box of equal cells, numbered with x fastest, then y, then z, says so here
     * and gets the fast path; cells[0] = 0 otherwise. Only such a mesh may be periodic. */
    int cells[3];
    double origin[3], spacing[3];
    int periodic[3];
    /* A part of a mesh that is divided among ranks, for cpl_map_new_ranks; all zero otherwise. The
     * arrays above are then those of the n >= 0 cells that this rank owns, in any order;
     * `neighbour` is not looked at, and `locate` knows own cells only: -1 for points elsewhere.
     * `cells`, `origin`, `spacing` and `periodic` are those of the whole mesh, if that is a box of
     * equal cells divided in any way: ids are then the numbers of its cells, and `locate` is not
     * called.
     *
     * Results do not depend on the division, but for rounding, if a cell has the same id in all;
     * except that with CPL_CENTRE, on a mesh that is no box, a centre that lies on the face between
     * two parts is in the cell of the rank that has the particle. */
    const int64_t *id;           /* [n], number of the cell in the whole mesh, 0...all cells - 1 */
    const int64_t *neighbour_id; /* [offset[n]], ids of the cells that share a face, on any rank */
} cpl_mesh;

/* Fills everything from cells, origin, spacing and periodic. Free with cpl_mesh_free. */
cpl_status cpl_mesh_box(cpl_mesh *mesh, const int cells[3], const double origin[3],
                        const double spacing[3], const int periodic[3]);
/* The part of such a mesh that consists of the n cells with these ids (copied). Not collective. */
cpl_status cpl_mesh_box_part(cpl_mesh *mesh, const int cells[3], const double origin[3],
                             const double spacing[3], const int periodic[3], size_t n,
                             const int64_t *id);
void cpl_mesh_free(cpl_mesh *mesh); /* only of a mesh made by one of these */

/* ---- map ------------------------------------------------------------------------------------- */

typedef enum cpl_map_model {
    CPL_CENTRE,      /* the whole particle in the cell of its centre */
    CPL_DIVIDED_CUBE /* the circumscribed cube cut by the cells (DPVM), the default */
} cpl_map_model;

typedef struct cpl_map cpl_map;

/* packing_limit: largest solid fraction of a cell, (0, 1). On error *map may carry the message. */
cpl_status cpl_map_new(const cpl_mesh *mesh, cpl_map_model model, double packing_limit,
                       cpl_map **map);
/**
 * The same for a mesh that is divided among the ranks of comm (duplicated), each of which gives its
 * part. On more than one rank, everything below that takes the map is collective, but for
 * cpl_voidage, cpl_map_message and cpl_map_last_report. Particles and their arrays are those that
 * the calling rank has, in its own order, and may lie in cells of any rank; cell arrays are those
 * of its own cells, in the order of its part. Errors are the same code and text on all ranks. On
 * one rank ids may be missing and the map is that of cpl_map_new.
 */
cpl_status cpl_map_new_ranks(MPI_Comm comm, const cpl_mesh *mesh, cpl_map_model model,
                             double packing_limit, cpl_map **map);
void cpl_map_free(cpl_map *map);
const char *cpl_map_message(const cpl_map *map);

/* Build the rows for n particles of centre x, radius and volume V. Applies the packing limit. Cost
 * is linear in n; nothing is allocated once the arrays have grown. After an error the map is of
 * no use until the next good build. */
cpl_status cpl_map_build(cpl_map *map, size_t n, const double (*x)[3], const double *radius,
                         const double *V);

/* eps [cells] from the map of the last build. */
void cpl_voidage(const cpl_map *map, double *eps);
/* q_p = sum_c W_pc q_c, `width` components a cell, 1...9. */
void cpl_gather(const cpl_map *map, int width, const double *q_cell, double *q_particle);
/* S_c = sum_p W_pc s_p / V_c, overwrites. */
void cpl_scatter(const cpl_map *map, int width, const double *s_particle, double *S_cell);

/* Sums over all ranks. */
typedef struct cpl_map_report {
    size_t rows, entries;
    double solid_volume;  /* of the particles, m3 */
    double mapped_volume; /* sum (1 - eps) V, m3: equal to rounding */
    double moved_volume;  /* moved to neighbours by the packing limit, m3 */
    size_t full_cells;    /* cells that the limit acted on */
    double eps_min, eps_max;
    size_t borrowed;         /* cells that ranks hold copies of, because particles touch them */
    double seconds_exchange; /* wall-clock of this rank with others and waiting for them, s: since
                                the last cpl_map_build began */
} cpl_map_report;

cpl_map_report cpl_map_last_report(const cpl_map *map);

/* ---- drag ------------------------------------------------------------------------------------ */

typedef enum cpl_drag_law {
    CPL_DRAG_NONE,
    CPL_ERGUN_WEN_YU, /* Gidaspow's switch at eps = .8 */
    CPL_DI_FELICE,
    CPL_SCHILLER_NAUMANN /* single sphere, no influence of eps */
} cpl_drag_law;

/**
 * Drag coefficient of one sphere in the model in which both phases share the pressure gradient:
 * F = kappa (u - v), kg/s, never singular at zero slip.
 * slip = |u - v| of the interstitial velocity, m/s; d, m; rho, kg/m3; mu, Pa s.
 */
double cpl_drag(cpl_drag_law law, double eps, double slip, double d, double rho, double mu);

/* ---- coupling in time ------------------------------------------------------------------------ */

typedef enum cpl_scheme {
    CPL_SEMI_IMPLICIT, /* drag implicit in the fluid's new velocity: Mori and Sakai */
    CPL_EXPLICIT       /* for reference: drag of the old velocities */
} cpl_scheme;

typedef struct cpl_param {
    cpl_map_model map;
    double packing_limit;    /* largest solid fraction of a cell, default .75 */
    cpl_drag_law drag;       /* default Ergun-Wen-Yu */
    cpl_scheme scheme;       /* default semi-implicit */
    double carry_gain;       /* g: share of the carried imbalance returned per step, default .5 */
    double added_mass_above; /* numerical inertia M is used where rho(1-eps)/(eps rho_p) exceeds
                                this, default .1 */
    double ledger_tolerance; /* relative; the run stops above it; default 1e-9 */
} cpl_param;

cpl_param cpl_param_default(void);

/**
 * What particle p feels during the next step, as prediction of the fluid's force:
 *     f + k (w - v) - M dv/dt   with   f = L + g C/dt + M a,  k = kappa/eps^2,  w = v now,
 *     M = rho V (1 - eps)/eps where rho (1-eps)/(eps rho_p) > added_mass_above, else 0.
 * L, C [n][3]: force of the last solve (N), carried imbalance (N s); a [n][3]: mean acceleration
 * of the particles around in the last step (m/s2). All output arrays caller's; eps > 0. With
 * CPL_EXPLICIT: f = L + g C/dt, k = 0, M = 0. Stability: force.c.
 */
void cpl_predict(const cpl_param *param, size_t n, double dt, double rho, const double *eps,
                 const double *kappa, const double *V, const double *mass, const double (*L)[3],
                 const double (*C)[3], const double (*a)[3], double (*f)[3], double *k, double *M);

/**
 * Force of the fluid on particles, per unit time what the fluid lost to each:
 *     L = kappa (u - v) - V grad p        and       C += L dt - J.
 * u [n][3]: fluid velocity that the drag in the fluid's equation saw, gathered; grad_p likewise,
 * Pa/m.
 */
void cpl_settle(size_t n, double dt, const double *kappa, const double *V, const double (*u)[3],
                const double (*v)[3], const double (*grad_p)[3], const double (*J)[3],
                double (*L)[3], double (*C)[3]);

/* ---- ledger ---------------------------------------------------------------------------------- */

/* One coupled step, all sums over the domain. */
typedef struct cpl_entry {
    double time;
    double particle_volume, mapped_volume, moved_volume; /* m3 */
    double fluid_drag[3];     /* impulse the fluid's equation gave to the particles by drag, N s */
    double fluid_pressure[3]; /* and by the pressure gradient on the solid fraction, N s */
    double particle_force[3]; /* sum L dt as booked for the particles, N s */
    double delivered[3];      /* sum J, N s */
    double carried_before[3], carried[3];   /* sum C, N s */
    double momentum_before[3], momentum[3]; /* of the particles, kg m/s */
    double gravity[3], walls[3];            /* impulses on the particles, N s */
    double supply[3]; /* momentum of particles that came, less that of those that left, kg m/s */
    double gone[3];   /* owed to those that left when they did: C, less J of this step, N s */
    double scale;     /* sum of magnitudes of the exchanged impulses, N s: the measure of 1 */
    double momentum_scale; /* sum of magnitudes of particle momenta and impulses, kg m/s */
} cpl_entry;

typedef struct cpl_ledger cpl_ledger;

/* Writes <directory>/ledger.csv (created with its directories). from, s: a restart, which keeps the
 * rows up to then; NAN: a new file. directory NULL: no file, balances are checked all the same. On
 * error *ledger may carry the message; free it. */
cpl_status cpl_ledger_new(const char *directory, double tolerance, double from,
                          cpl_ledger **ledger);
void cpl_ledger_free(cpl_ledger *ledger);
/* Book a step: writes a row; CPL_IMBALANCE when a residual passes the tolerance, named in message.
 */
cpl_status cpl_ledger_book(cpl_ledger *ledger, const cpl_entry *entry);
/* Largest residual of the last entry: of volume, exchange, carry and particle momentum, relative.
 */
double cpl_ledger_residual(const cpl_ledger *ledger);
const char *cpl_ledger_message(const cpl_ledger *ledger);

/* ---- time series ----------------------------------------------------------------------------- */

/**
 * A text file of rows that begin with the time, behind `head` (whole lines); folders are made. Of
 * rows that are there already those up to the time `from` are kept, none if it is NAN. NULL with
 * the reason in `message`; else there is a note in it if the head was another one, and the file
 * that had it was put aside.
 */
FILE *cpl_table_open(const char *path, const char *head, double from, char *message, size_t size);

#ifdef __cplusplus
}
#endif
#endif
