/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * coupling.c - one coupled step:
 *
 *     1  particles move under the predicted force; void fraction
 *     2  drag coefficients with the fluid's velocity in the cells
 *     3  momentum and pressure
 *     4  what drag and pressure gave to the particles
 */
#include "coupling.h"

#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int fail(char *message, size_t size, const char *text)
{
    snprintf(message, size, "%s", text);
    return -1;
}

int mac_coupled_new(mac_coupled *c, const mac_param *flow, const dem_param *dem,
                    const cpl_param *coupling, const char *ledger, char *message, size_t size)
{
    memset(c, 0, sizeof *c);
    mac_param fluid = *flow;
    fluid.explicit_drag = dem && coupling->scheme == CPL_EXPLICIT;
    c->fluid = mac_new(&fluid);
    c->cells = (size_t)flow->n[0] * (size_t)flow->n[1] * (size_t)flow->n[2];
    c->U = calloc(c->cells, sizeof *c->U);
    c->gradient = calloc(c->cells, sizeof *c->gradient);
    c->tensor = calloc(c->cells, sizeof *c->tensor);
    if (!c->fluid || !c->U || !c->gradient || !c->tensor)
        return fail(message, size, "no memory for the fluid's fields");
    if (!dem) return 0;
    if (cpl_mesh_box(&c->mesh, flow->n, flow->lo, flow->h, c->fluid->grid.periodic))
        return fail(message, size, "no memory for the mesh");
    const phase_param param = {.dem = dem,
                               .coupling = coupling,
                               .mesh = &c->mesh,
                               .rho = flow->rho,
                               .mu = flow->mu,
                               .ledger = ledger};
    if (phase_new(MPI_COMM_SELF, &param, &c->particles))
        return fail(message, size, phase_message(c->particles));
    mac_set_cells(c->fluid, phase_voidage(c->particles), 1, &c->fluid->eps);
    mac_boundary_values(c->fluid);
    return 0;
}

void mac_coupled_free(mac_coupled *c)
{
    phase_free(c->particles);
    if (c->mesh.n) cpl_mesh_free(&c->mesh);
    mac_free(c->fluid);
    free(c->U);
    free(c->gradient);
    free(c->tensor);
    memset(c, 0, sizeof *c);
}

/* Mean of (1 - eps) v over the box. */
static void solid_flux(mac_coupled *c)
{
    const double *eps = phase_voidage(c->particles);
    const double(*v)[3] = phase_Us(c->particles);
    for (int d = 0; d < 3; d++) {
        double sum = 0;
        for (size_t i = 0; i < c->cells; i++) sum += (1 - eps[i]) * v[i][d];
        c->fluid->solid_flux[d] = sum / (double)c->cells;
    }
}

int mac_coupled_step(mac_coupled *c, double dt, char *message, size_t size)
{
    mac *m = c->fluid;
    phase *ph = c->particles;
    if (ph) {
        if (phase_advance(ph, dt)) return fail(message, size, phase_message(ph));
        mac_set_cells(m, phase_voidage_before(ph), 1, &m->eps_old);
        mac_set_cells(m, phase_voidage(ph), 1, &m->eps);
        mac_drag_velocity(m, phase_Us(ph), c->U);
        if (phase_drag(ph, (const double(*)[3])c->U)) return fail(message, size, phase_message(ph));
        mac_set_cells(m, phase_K(ph), 1, &m->K);
        mac_set_cells(m, phase_S(ph)[0], 3, m->S);
        solid_flux(c);
    }
    double start = MPI_Wtime();
    if (mac_step(m, dt)) return fail(message, size, m->message);
    if (ph) mac_exchange(m, c->U, c->tensor, c->gradient, c->drag, c->pressure);
    c->seconds_fluid = MPI_Wtime() - start;
    c->seconds_fluid_all += c->seconds_fluid;
    if (ph && phase_settle(ph, (const double(*)[3])c->U, (const double(*)[3])c->gradient,
                           (const double(*)[9])c->tensor, c->drag, c->pressure))
        return fail(message, size, phase_message(ph));
    return 0;
}
