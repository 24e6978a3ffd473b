/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phaseBox.h - a fully periodic box of equal spheres on a face-centred lattice, for tests of the
 * particle phase. A mesh cell is a whole number of lattice periods wide, so that the void fraction
 * is the same in every cell wherever the lattice has moved. Include after cmocka.h.
 */
#ifndef PHASE_BOX_H
#define PHASE_BOX_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "phase.h"

enum { PERIODS = 4, PHASE_BOX_N = 4 * PERIODS * PERIODS * PERIODS };

typedef struct phase_box {
    double eps, d, density, rho, mu, gravity[3], velocity[3];
    double stiffness; /* of contacts, N/m: sets the sub-step, the lattice itself never touches */
    int cells[3];     /* of the mesh: 1, 2 or 4 along each axis */
    double wave;      /* amplitude of a density wave along z that starts with the run, m */
    const char *ledger;
    const char *restart;      /* file to go on from, or NULL */
    const dem_feeder *feeder; /* one or none */
    const dem_outlet *outlet; /* likewise */
    cpl_param coupling;
    /* made by phase_box_new */
    double period;
    double x[PHASE_BOX_N][3];
    cpl_mesh mesh;
    dem_material material;
    dem_pair pair;
    dem_insertion insertion;
    dem_param dem;
    phase *phase;
} phase_box;

static inline void phase_box_lattice(phase_box *b)
{
    static const double base[4][3] = {{.1, .2, .3}, {.6, .7, .3}, {.6, .2, .8}, {.1, .7, .8}};
    const double turn = 6.28318530717958648;
    int n = 0;
    for (int i = 0; i < PERIODS; i++)
        for (int j = 0; j < PERIODS; j++)
            for (int k = 0; k < PERIODS; k++)
                for (int s = 0; s < 4; s++, n++) {
                    b->x[n][0] = b->period * (i + base[s][0]);
                    b->x[n][1] = b->period * (j + base[s][1]);
                    const double z = b->period * (k + base[s][2]);
                    b->x[n][2] = z + b->wave * sin(turn * z / (PERIODS * b->period));
                }
}

/* Fills b from its first members; returns the status of phase_new. */
static inline int phase_box_new(phase_box *b)
{
    const double pi = 3.14159265358979323846, origin[3] = {0, 0, 0};
    b->period = b->d * cbrt(4 * pi / 6 / (1 - b->eps));
    phase_box_lattice(b);
    const double side = PERIODS * b->period;
    const double h[3] = {side / b->cells[0], side / b->cells[1], side / b->cells[2]};
    const int periodic[3] = {1, 1, 1};
    assert_int_equal(cpl_mesh_box(&b->mesh, b->cells, origin, h, periodic), CPL_OK);
    b->material = (dem_material){.name = "glass", .density = b->density};
    b->pair = (dem_pair){
        .restitution = .9, .friction = .1, .stiffness = b->stiffness, .stiffness_ratio = 1};
    b->insertion = (dem_insertion){.name = "lattice",
                                   .kind = DEM_INSERT_LIST,
                                   .n = PHASE_BOX_N,
                                   .x = (const double(*)[3])b->x,
                                   .diameter = b->d};
    memcpy(b->insertion.velocity, b->velocity, sizeof b->velocity);
    b->dem = dem_param_default();
    for (int a = 0; a < 3; a++) {
        b->dem.hi[a] = side;
        b->dem.periodic[a] = 1;
        b->dem.gravity[a] = b->gravity[a];
    }
    b->dem.law = DEM_LINEAR;
    b->dem.restart = b->restart;
    b->dem.n_material = 1, b->dem.material = &b->material, b->dem.pair = &b->pair;
    b->dem.n_insertion = 1, b->dem.insertion = &b->insertion;
    b->dem.n_feeder = b->feeder != NULL, b->dem.feeder = b->feeder;
    b->dem.n_outlet = b->outlet != NULL, b->dem.outlet = b->outlet;
    const phase_param param = {.dem = &b->dem,
                               .coupling = &b->coupling,
                               .mesh = &b->mesh,
                               .rho = b->rho,
                               .mu = b->mu,
                               .ledger = b->ledger};
    return phase_new(MPI_COMM_SELF, &param, &b->phase);
}

static inline void phase_box_free(phase_box *b)
{
    phase_free(b->phase);
    cpl_mesh_free(&b->mesh);
}

#endif
