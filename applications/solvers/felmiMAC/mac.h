/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * mac.h - the volume-averaged fluid on a staggered grid: state, parameters and one time step.
 *
 * Equations (pressure shared by both phases, u interstitial, p full pressure in Pa):
 *     d(eps rho u)/dt + div(eps rho u u) = -eps grad p + S - K u + div(eps tau) + eps rho g
 *     d(eps)/dt + div(eps u) = 0
 *
 * Layout. p, eps, K, S live at cell centres, the velocity component d at the faces normal to d.
 * All arrays have the same shape, n + 3 along each direction: cell i is at index i, 1..n, with
 * ghosts 0 and n+1; face i is the lower face of cell i, 1..n+1, with ghosts 0 and n+2. In a
 * periodic direction face n+1 is face 1. The element (i, j, k) is at i + j stride[1] + k stride[2].
 *
 * Face values. eps_f is the mean of the two cells. Drag is  K_f = eps_f^2 mean(K/eps^2)  and S_f
 * likewise: with q = eps u the gradient that balances it is then mean(K/eps^2) q, the resistance of
 * the two half cells in series, also where a bed ends (the plain mean of K would lose a third of a
 * cell at each end of a bed). Explicit drag takes the plain mean of S. A boundary face has the
 * values of the cell inside and a control volume of half a cell.
 *
 * Reference: F. H. Harlow & J. E. Welch, Phys. Fluids 8 (1965) 2182, doi:10.1063/1.1761178;
 * Y. Mori, doctoral thesis, University of Tokyo (2021), 2.4.
 */
#ifndef MAC_H
#define MAC_H

#include <stddef.h>
#include "poisson.h"

/* ---- parameters ------------------------------------------------------------------------------ */

typedef enum mac_normal {
    MAC_PRESCRIBED, /* normal velocity given, pressure gradient follows from the momentum equation
                     */
    MAC_OPEN,       /* pressure given, normal velocity follows from the momentum equation */
    MAC_CYCLIC
} mac_normal;

typedef enum mac_tangent {
    MAC_FREE,        /* zero gradient */
    MAC_FIXED,       /* given value */
    MAC_INFLOW_FIXED /* given value where fluid enters, zero gradient where it leaves */
} mac_tangent;

typedef struct mac_side {
    mac_normal normal;
    mac_tangent tangent;
    double velocity[3]; /* m/s */
    int superficial;    /* velocity is eps u: divided by the void fraction inside */
    double pressure;    /* Pa, MAC_OPEN */
} mac_side;

typedef enum mac_convection {
    MAC_HYBRID, /* central where the cell's Peclet number is below 2, else upwind (Spalding 1972) */
    MAC_UPWIND,
    MAC_CENTRAL
} mac_convection;

typedef struct mac_param {
    int n[3];
    double lo[3], h[3]; /* m */
    mac_side side[6];   /* -x +x -y +y -z +z */
    double rho, mu;     /* kg/m3, Pa s */
    double gravity[3];  /* m/s2 */
    mac_convection convection;
    mac_cycle cycle;
    double tolerance; /* of the pressure equation, relative to its right-hand side */
    int max_iterations;
    int explicit_drag;      /* S is the whole drag, of the old velocity, and K = 0 */
    size_t reference_cell;  /* where no side gives the pressure: p of this cell ... */
    double reference_value; /* ... is this, Pa */
    int hold_flux[3];       /* keep the mean volume flux of this periodic direction ... */
    double mean_flux[3];    /* ... at this value, m/s: mean of eps u + (1 - eps) v over the box */
} mac_param;

mac_param mac_param_default(void);

/* ---- state ----------------------------------------------------------------------------------- */

typedef struct mac_grid {
    int n[3];
    double h[3], lo[3];
    int periodic[3];
    size_t stride[3], size;
    double volume; /* of a cell, m3 */
} mac_grid;

/* What a step did. */
typedef struct mac_report {
    int iterations;     /* of the pressure equation, all solves of the step */
    double residual;    /* of the pressure equation, relative */
    double continuity;  /* largest |d eps/dt + div(eps u)| dt, - */
    double courant;     /* largest sum_a |u_a| dt / h_a, - */
    double stiffness;   /* largest K dt / (rho eps), - */
    double gradient[3]; /* mean pressure gradient that holds the mean flux, Pa/m */
} mac_report;

#define MAC_MESSAGE 512

typedef struct mac {
    mac_param param;
    mac_grid grid;
    double *u[3];          /* velocity, m/s */
    double *p;             /* periodic part of the pressure, Pa */
    double *dp[3];         /* pressure gradient at the faces in the last step, mean part included */
    double *eps, *eps_old; /* void fraction at the end and the start of the step */
    double *K, *S[3];      /* drag coefficient kg/m3/s and source N/m3 */
    double *k, *s[3];      /* K and S over eps^2 (as they are with explicit drag) */
    double *flux[3];       /* eps u that carries momentum */
    double *rhs[3];        /* convection, viscosity, gravity, N/m3 */
    double *mobility[3];   /* (dt/rho) alpha_d, m3 s/kg; 0 where the velocity is given */
    double *work;          /* flux of momentum through the faces of a control volume */
    double solid_flux[3];  /* mean of (1 - eps) v over the box, m/s */
    mac_poisson poisson;   /* its rows lie along the longest side of the box: */
    int axis[3];           /* the solver's direction of each of ours */
    size_t solver_stride[3];
    double *response[3]; /* pressure answering a unit mean gradient, in the solver's layout */
    mac_report report;
    char message[MAC_MESSAGE]; /* of the last error */
} mac;

static inline size_t mac_at(const mac_grid *g, int i, int j, int k)
{
    return (size_t)i + (size_t)j * g->stride[1] + (size_t)k * g->stride[2];
}

/* Mean of q at the lower face of cell m. */
static inline double mac_face(const double *q, size_t m, size_t stride)
{
    return 0.5 * (q[m] + q[m - stride]);
}

/* Share of a face of void fraction eps in the drag k or s of its cells. */
static inline double mac_face_share(const mac *m, double eps)
{
    return m->param.explicit_drag ? 1 : eps * eps;
}

/* ---- life and step --------------------------------------------------------------------------- */

/* NULL when out of memory. eps = 1, u = 0, p = 0, K = S = 0. */
mac *mac_new(const mac_param *param);
void mac_free(mac *m);

/**
 * Advance by dt: eps_old, eps, K and S must be set in the cells (mac_set_cells). 0, or -1 with the
 * text in m->message.
 */
int mac_step(mac *m, double dt);

/* Copy a cell field [cells] (x fastest) of `width` components into arrays with ghosts. */
void mac_set_cells(const mac *m, const double *field, int width, double *const *array);
/* Velocity in the cells: mean of the two faces, [cells][3]. */
void mac_cell_velocity(const mac *m, double (*U)[3]);
/* Velocity for the drag law: that of the mean volume flux past particles of velocity v,
 * v + mean(eps_f (u_f - v))/eps; with v at the end of the step, so with the new eps. */
void mac_drag_velocity(const mac *m, const double (*v)[3], double (*U)[3]);
/* Start from a uniform or cell-wise velocity: faces are the means of cells; sides as prescribed. */
void mac_start(mac *m, const double (*U)[3]);

/* Largest stable steps of the explicit terms, s: convection at the present velocity (infinite at
 * rest) and viscosity. */
void mac_limits(const mac *m, double *convective, double *viscous);
double mac_viscous_limit(const mac_param *param);

/* Area-mean pressure on a side, Pa; the mean gradient of a held flux is not included. */
double mac_side_pressure(const mac *m, int side);
/* Pressure on the face of a side next to cell index `inside`. */
double mac_face_pressure(const mac *m, int side, size_t inside);

/**
 * What drag and the pressure gradient did to the particles, seen from the cells: the transpose of
 * the interpolation to faces. u [cells][3]: velocity the drag acted on; tensor [cells][9]: the same
 * of a uniform velocity (diagonal); grad_p [cells][3], Pa/m; drag and pressure: sums over the
 * faces, sum V_f (K u - S) and -sum V_f (1 - eps) dp, N.
 */
void mac_exchange(const mac *m, double (*u)[3], double (*tensor)[9], double (*grad_p)[3],
                  double drag[3], double pressure[3]);

/* ---- parts of a step (mac_step calls them) --------------------------------------------------- */

/* boundary.c */
void mac_boundary_values(mac *m); /* prescribed normal velocities from eps */
void mac_fill_velocity(mac *m);   /* ghosts of u from the sides' conditions */
void mac_fill_copy(const mac_grid *g, double *q, int face); /* ghosts: copy or wrap; face: direction
                                                              of staggering, -1 for cells */
/* momentum.c */
void mac_explicit_terms(mac *m); /* m->rhs from u, eps, flux */
/* projection.c */
int mac_project(mac *m, double dt);

#endif
