/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phase.h - the particle phase as a flow solver sees it: cell arrays in, cell arrays out.
 *
 * Owns the particle engine, the map and the ledger, and carries out the particle side of a coupled
 * step, so that every flow solver does the same and none does it twice:
 *
 *     phase_advance(dt)      particles move under the predicted force; map; void fraction
 *     phase_drag(U)          drag coefficients; per cell the fluid gets  S - K U  (N/m3)
 *        ... the flow solver solves momentum and pressure ...
 *     phase_settle(u, gradp) force of the fluid on each particle; carried imbalance; ledger
 *
 * A flow solver that keeps its momentum on faces interpolates K, S and eps to faces itself, and
 * hands back to phase_settle cell fields that are the transpose of that interpolation, so that the
 * momentum it lost and the momentum the particles are booked are the same sum.
 *
 * Collective over the communicator. Each rank gives its part of the mesh (cpl.h: cpl_mesh with ids)
 * and gets arrays of its own cells; which particles it has is the engine's affair. Functions return
 * 0, a dem_status, or DEM_IO + a cpl_status, the same on all ranks; the text is in phase_message().
 *
 * A particle that has not met the fluid yet starts with the buoyancy of a fluid at rest. What the
 * particles carry from step to step lives in columns of the engine: carried, fluidForce [3],
 * dragCoefficient, voidFraction [1], and where the fluid's inertia can matter acceleration,
 * velocityBefore [3].
 *
 * Restart: dem_write_restart of phase_engine() between two steps saves all of it. A phase made with
 * param.dem->restart goes on bit for bit, if the fluid does: void fraction and mean velocity of the
 * cells follow from the particles, K and S are those of the next phase_drag. The ledger goes on.
 */
#ifndef PHASE_H
#define PHASE_H

#include <mpi.h>
#include "cpl.h"
#include "dem.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct phase phase;

typedef struct phase_param {
    const dem_param *dem;
    const cpl_param *coupling;
    const cpl_mesh *mesh; /* of this rank; borrowed for the life of the phase */
    double rho, mu;       /* fluid: kg/m3, Pa s */
    const char *ledger;   /* directory of ledger.csv, written by the first rank; NULL: none is
                             written (still checked) */
} phase_param;

/* On error *phase may be non-NULL and then carries only the message; free it all the same. */
int phase_new(MPI_Comm comm, const phase_param *param, phase **phase);
void phase_free(phase *phase);
const char *phase_message(const phase *phase);
dem_sim *phase_engine(phase *phase);

/* Stage 1-2: move the particles by dt, build the map, find the void fraction. */
int phase_advance(phase *phase, double dt);
/* Void fraction now and before the last phase_advance, [cells]. */
const double *phase_voidage(const phase *phase);
const double *phase_voidage_before(const phase *phase);

/**
 * Drag coefficients from the void fraction, the fluid velocity U [cells][3] (interstitial, m/s) and
 * the particles' new velocity. Afterwards phase_K (kg/m3/s, [cells]) and phase_S (N/m3, [cells][3])
 * hold the fluid's momentum source S - K U; K = 0 with the explicit scheme. May be called again
 * within a step (outer correctors). phase_Us: mean particle velocity in a cell, volume-weighted.
 */
int phase_drag(phase *phase, const double (*U)[3]);
const double *phase_K(const phase *phase);
const double (*phase_S(const phase *phase))[3];
const double (*phase_Us(const phase *phase))[3];

/**
 * What the fluid's equation really did in this step: u [cells][3] is the velocity that drag acted
 * on, seen from the cells (transpose of the solver's interpolation); grad_p [cells][3] (Pa/m) the
 * gradient that acted on the solid fraction, likewise. tensor [cells][9], row by row, or NULL for
 * unity: the same transpose applied to a uniform velocity; 1 on meshes of equal boxes.
 * fluid_drag, fluid_pressure [3]: impulse per second (N) the fluid lost by drag and to the solid
 * fraction by its pressure gradient, summed by the solver from its own equation and over all ranks:
 * booked against the particles' sum in the ledger.
 */
int phase_settle(phase *phase, const double (*u)[3], const double (*grad_p)[3],
                 const double (*tensor)[9], const double fluid_drag[3],
                 const double fluid_pressure[3]);

/* Fluid force on each particle in the order of dem_particles(), N. */
const double (*phase_force(const phase *phase))[3];

typedef struct phase_report {
    dem_report dem;
    cpl_map_report map;
    double stiffness; /* largest K dt/(rho eps) of the last step */
    double ledger_residual;
    double height; /* mean bed height: twice the mass-weighted mean height along -gravity
                      above the lowest point of the mesh, m */
    /* wall-clock, last step, this rank; exchange: with other ranks over cells, not in map or drag
     */
    double seconds_dem, seconds_map, seconds_drag, seconds_exchange;
} phase_report;

phase_report phase_last_report(const phase *phase);
/* The line of the log for a step, without newline; returns its length like snprintf. Time, eps,
 * Courant, contacts (with walls), overlap, stiffness, ledger, wall time per part (the exchange on
 * several ranks only), time to completion. seconds_fluid: the solver's own part. */
int phase_log(const phase *phase, char *line, size_t size, double time, double end_time,
              double courant, double seconds_fluid, double seconds_elapsed, double start_time);
/* Table of where the time went in all steps, s and per cent: DEM, map, exchange, drag (forces), the
 * flow solver's own seconds_fluid, and what is left of seconds_all. Means over the ranks;
 * collective. Returns its length like snprintf. */
int phase_shares(const phase *phase, char *text, size_t size, double seconds_fluid,
                 double seconds_all);

#ifdef __cplusplus
}
#endif
#endif
