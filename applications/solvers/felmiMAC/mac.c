/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * mac.c - the staggered fluid: its life, its step, and cell fields in and out.
 *
 * A step: boundary values, carrying fluxes, explicit terms, predictor with implicit drag,
 * projection. The convecting flux is eps^{n+1} u^n: with the void fraction that the projection
 * itself sees, a uniform velocity that satisfies continuity is kept to rounding.
 */
#include "mac.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

mac_param mac_param_default(void)
{
    mac_param p;
    memset(&p, 0, sizeof p);
    p.rho = 1;
    p.convection = MAC_HYBRID;
    p.cycle = MAC_W_CYCLE;
    p.tolerance = 1e-8;
    p.max_iterations = 500;
    return p;
}

static int allocate(double **array, size_t size)
{
    *array = calloc(size, sizeof **array);
    return *array ? 0 : -1;
}

static int allocate_fields(mac *m)
{
    size_t size = m->grid.size;
    double **scalar[6] = {&m->p, &m->eps, &m->eps_old, &m->K, &m->k, &m->work};
    int failed = 0;
    for (int a = 0; a < 6; a++) failed |= allocate(scalar[a], size);
    for (int d = 0; d < 3; d++) {
        double **face[7] = {&m->u[d],    &m->dp[d],  &m->S[d],       &m->s[d],
                            &m->flux[d], &m->rhs[d], &m->mobility[d]};
        for (int a = 0; a < 7; a++) failed |= allocate(face[a], size);
        if (m->param.hold_flux[d]) failed |= allocate(&m->response[d], size);
    }
    if (failed) return -1;
    for (size_t q = 0; q < size; q++) m->eps[q] = m->eps_old[q] = 1;
    return 0;
}

/* The pressure solver's loops are fast along their first direction: give it the longest one. */
static int start_solver(mac *m)
{
    const mac_grid *g = &m->grid;
    int from[3] = {0, 1, 2}, n[3], periodic[3]; /* our direction of each of the solver's */
    double h[3];
    for (int a = 0; a < 2; a++)
        for (int b = 0; b < 2 - a; b++)
            if (g->n[from[b]] < g->n[from[b + 1]]) {
                int swap = from[b];
                from[b] = from[b + 1];
                from[b + 1] = swap;
            }
    for (int a = 0; a < 3; a++) {
        n[a] = g->n[from[a]];
        h[a] = g->h[from[a]];
        periodic[a] = g->periodic[from[a]];
        m->axis[from[a]] = a;
    }
    if (mac_poisson_init(&m->poisson, n, h, periodic, m->param.cycle, m->param.tolerance,
                         m->param.max_iterations))
        return -1;
    for (int d = 0; d < 3; d++) m->solver_stride[d] = m->poisson.mg.level[0].stride[m->axis[d]];
    return 0;
}

mac *mac_new(const mac_param *param)
{
    mac *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    m->param = *param;
    mac_grid *g = &m->grid;
    g->volume = 1;
    for (int d = 0; d < 3; d++) {
        g->n[d] = param->n[d];
        g->h[d] = param->h[d];
        g->lo[d] = param->lo[d];
        g->periodic[d] = param->side[2 * d].normal == MAC_CYCLIC;
        g->volume *= g->h[d];
        if (!g->periodic[d]) m->param.hold_flux[d] = 0;
    }
    g->stride[0] = 1;
    g->stride[1] = (size_t)g->n[0] + 3;
    g->stride[2] = g->stride[1] * ((size_t)g->n[1] + 3);
    g->size = g->stride[2] * ((size_t)g->n[2] + 3);
    if (allocate_fields(m) || start_solver(m)) {
        mac_free(m);
        return NULL;
    }
    mac_boundary_values(m);
    mac_fill_velocity(m);
    return m;
}

void mac_free(mac *m)
{
    if (!m) return;
    double *scalar[6] = {m->p, m->eps, m->eps_old, m->K, m->k, m->work};
    for (int a = 0; a < 6; a++) free(scalar[a]);
    for (int d = 0; d < 3; d++) {
        double *face[8] = {m->u[d],    m->dp[d],  m->S[d],        m->s[d],
                           m->flux[d], m->rhs[d], m->mobility[d], m->response[d]};
        for (int a = 0; a < 8; a++) free(face[a]);
    }
    mac_poisson_free(&m->poisson);
    free(m);
}

/* ---- cell fields ----------------------------------------------------------------------------- */

void mac_set_cells(const mac *m, const double *field, int width, double *const *array)
{
    const mac_grid *g = &m->grid;
    for (int c = 0; c < width; c++) {
        const double *from = field + c;
        for (int k = 1; k <= g->n[2]; k++)
            for (int j = 1; j <= g->n[1]; j++)
                for (int i = 1; i <= g->n[0]; i++, from += width)
                    array[c][mac_at(g, i, j, k)] = *from;
        mac_fill_copy(g, array[c], -1);
    }
}

void mac_cell_velocity(const mac *m, double (*U)[3])
{
    const mac_grid *g = &m->grid;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++, U++) {
                size_t q = mac_at(g, i, j, k);
                for (int d = 0; d < 3; d++)
                    (*U)[d] = 0.5 * (m->u[d][q] + m->u[d][q + g->stride[d]]);
            }
}

void mac_drag_velocity(const mac *m, const double (*v)[3], double (*U)[3])
{
    const mac_grid *g = &m->grid;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++, U++, v++) {
                size_t q = mac_at(g, i, j, k);
                for (int d = 0; d < 3; d++) {
                    size_t s = g->stride[d];
                    double low = mac_face(m->eps, q, s) * (m->u[d][q] - (*v)[d]);
                    double high = mac_face(m->eps, q + s, s) * (m->u[d][q + s] - (*v)[d]);
                    (*U)[d] = (*v)[d] + 0.5 * (low + high) / m->eps[q];
                }
            }
}

void mac_start(mac *m, const double (*U)[3])
{
    const mac_grid *g = &m->grid;
    mac_set_cells(m, U[0], 3, m->rhs);
    for (int d = 0; d < 3; d++)
        for (int k = 1; k <= g->n[2] + (d == 2); k++)
            for (int j = 1; j <= g->n[1] + (d == 1); j++)
                for (int i = 1; i <= g->n[0] + (d == 0); i++) {
                    size_t q = mac_at(g, i, j, k);
                    m->u[d][q] = mac_face(m->rhs[d], q, g->stride[d]);
                }
    mac_boundary_values(m);
    mac_fill_velocity(m);
}

/* ---- step ------------------------------------------------------------------------------------ */

/* Momentum eps u of the faces whose velocity is given, kept where their gradient will stand. */
static void keep_given_momentum(mac *m)
{
    const mac_grid *g = &m->grid;
    for (int s = 0; s < 6; s++) {
        if (m->param.side[s].normal != MAC_PRESCRIBED) continue;
        int d = s / 2, a = (d + 1) % 3, b = (d + 2) % 3;
        for (int q = 1; q <= g->n[b]; q++)
            for (int p = 1; p <= g->n[a]; p++) {
                size_t f = (size_t)(s % 2 ? g->n[d] + 1 : 1) * g->stride[d] +
                           (size_t)p * g->stride[a] + (size_t)q * g->stride[b];
                m->dp[d][f] = mac_face(m->eps_old, f, g->stride[d]) * m->u[d][f];
            }
    }
}

static void scale_drag(mac *m)
{
    for (size_t q = 0; q < m->grid.size; q++) {
        double factor = m->param.explicit_drag ? 1 : 1 / (m->eps[q] * m->eps[q]);
        m->k[q] = factor * m->K[q];
        for (int d = 0; d < 3; d++) m->s[d][q] = factor * m->S[d][q];
    }
}

static void carrying_flux(mac *m)
{
    const mac_grid *g = &m->grid;
    for (int d = 0; d < 3; d++) {
        for (int k = 1; k <= g->n[2] + (d == 2); k++)
            for (int j = 1; j <= g->n[1] + (d == 1); j++)
                for (int i = 1; i <= g->n[0] + (d == 0); i++) {
                    size_t q = mac_at(g, i, j, k);
                    m->flux[d][q] = mac_face(m->eps, q, g->stride[d]) * m->u[d][q];
                }
        mac_fill_copy(g, m->flux[d], d);
    }
}

/* Largest number of cells crossed per second, sum over d of |u_d|/h_d; not finite where a velocity
 * is not, then at cell[3]. */
static double crossing_rate(const mac *m, int cell[3])
{
    const mac_grid *g = &m->grid;
    double largest = 0;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++) {
                size_t q = mac_at(g, i, j, k);
                double sum = 0;
                for (int d = 0; d < 3; d++)
                    sum += fmax(fabs(m->u[d][q]), fabs(m->u[d][q + g->stride[d]])) / g->h[d];
                if (!isfinite(sum)) {
                    cell[0] = i, cell[1] = j, cell[2] = k;
                    return sum;
                }
                if (sum > largest) largest = sum;
            }
    return largest;
}

/* The Courant number, or -1 with the message set when a velocity is not finite. */
static double courant(mac *m, double dt)
{
    int c[3];
    double rate = crossing_rate(m, c);
    if (isfinite(rate)) return rate * dt;
    size_t q = mac_at(&m->grid, c[0], c[1], c[2]);
    snprintf(m->message, sizeof m->message,
             "the velocity in cell (%d %d %d) is not finite: (%g %g %g)", c[0] - 1, c[1] - 1,
             c[2] - 1, m->u[0][q], m->u[1][q], m->u[2][q]);
    return -1;
}

int mac_step(mac *m, double dt)
{
    keep_given_momentum(m);
    mac_boundary_values(m);
    mac_fill_velocity(m);
    scale_drag(m);
    carrying_flux(m);
    mac_explicit_terms(m);
    if (mac_project(m, dt)) return -1;
    mac_fill_velocity(m);
    m->report.courant = courant(m, dt);
    return m->report.courant < 0 ? -1 : 0;
}

/* A single layer of cells feels viscosity where a side holds the tangential velocity. */
static int sheared(const mac_param *p, int d)
{
    for (int s = 2 * d; s <= 2 * d + 1; s++)
        if (p->side[s].normal != MAC_CYCLIC && p->side[s].tangent != MAC_FREE) return 1;
    return 0;
}

double mac_viscous_limit(const mac_param *param)
{
    double stiff = 0;
    for (int d = 0; d < 3; d++)
        if (param->n[d] > 1 || sheared(param, d)) stiff += 1 / (param->h[d] * param->h[d]);
    /* rho / (2 mu sum h^-2), half of it because of the transposed gradient */
    return param->mu > 0 && stiff > 0 ? param->rho / (4 * param->mu * stiff) : INFINITY;
}

void mac_limits(const mac *m, double *convective, double *viscous)
{
    int cell[3];
    double rate = crossing_rate(m, cell);
    *convective = rate > 0 ? 1 / rate : INFINITY;
    *viscous = mac_viscous_limit(&m->param);
}

/* ---- pressure at the sides ------------------------------------------------------------------- */

double mac_face_pressure(const mac *m, int side, size_t inside)
{
    const mac_grid *g = &m->grid;
    int d = side / 2, high = side % 2;
    size_t face = inside + (high ? g->stride[d] : 0);
    if (m->param.side[side].normal == MAC_CYCLIC) return mac_face(m->p, face, g->stride[d]);
    if (m->param.side[side].normal == MAC_OPEN) return m->param.side[side].pressure;
    return m->p[inside] + (high ? 0.5 : -0.5) * g->h[d] * m->dp[d][face];
}

double mac_side_pressure(const mac *m, int side)
{
    const mac_grid *g = &m->grid;
    int d = side / 2, a = (d + 1) % 3, b = (d + 2) % 3;
    double sum = 0;
    for (int q = 1; q <= g->n[b]; q++)
        for (int p = 1; p <= g->n[a]; p++)
            sum += mac_face_pressure(m, side,
                                     (size_t)(side % 2 ? g->n[d] : 1) * g->stride[d] +
                                         (size_t)p * g->stride[a] + (size_t)q * g->stride[b]);
    return sum / ((double)g->n[a] * g->n[b]);
}
