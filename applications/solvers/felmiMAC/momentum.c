/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * momentum.c - explicit terms of the momentum equation: convection, viscosity, gravity.
 *
 * Per face control volume of component c,
 *     rhs = eps rho g_c - sum_e d/dx_e [ rho Phi_e u_c - eps mu (d u_c/dx_e + d u_e/dx_c) ].
 *
 * Phi_e is the mean of the two fluxes eps u_e of the continuity equation: the mass balance of a
 * face control volume is then the mean of the balances of its two cells, and a uniform velocity
 * stays uniform while the void fraction moves with it. The carried u_c is central where the cell
 * Peclet number |u_e| h rho/mu is at most 2, else upwind (hybrid), or always one of them. In the
 * plane of a side it is the side's own value, the mean of inside and ghost.
 *
 * The control volume of a boundary face is half a cell, from the cell centre to the side.
 *
 * References: D. B. Spalding, Int. J. Numer. Methods Eng. 4 (1972) 551, doi:10.1002/nme.1620040409;
 * Y. Mori, doctoral thesis, University of Tokyo (2021), eqs 177-188 (corrected).
 */
#include "mac.h"

#include <math.h>

/* Speed above which the scheme takes the upwind value. */
static double upwind_above(const mac_param *p, int e)
{
    if (p->convection == MAC_UPWIND) return -1;
    if (p->convection == MAC_CENTRAL) return INFINITY;
    return 2 * p->mu / (p->rho * p->h[e]); /* Peclet number 2 */
}

static inline double carried(double below, double above, double speed, double limit)
{
    double up = speed > 0 ? below : above;
    return fabs(speed) > limit ? up : 0.5 * (below + above);
}

/* Flux of component c along its own direction, at the centres of cells 0..n+1. */
static void normal_flux(const mac *m, int c, double *restrict G)
{
    const mac_grid *g = &m->grid;
    const double *restrict u = m->u[c], *restrict F = m->flux[c], *restrict eps = m->eps;
    double rho = m->param.rho, limit = upwind_above(&m->param, c);
    double nu = 2 * m->param.mu / g->h[c];
    size_t s = g->stride[c];
    int first[3] = {1, 1, 1};
    first[c] = 0;
    for (int k = first[2]; k <= g->n[2] + (c == 2); k++)
        for (int j = first[1]; j <= g->n[1] + (c == 1); j++)
            for (int i = first[0]; i <= g->n[0] + (c == 0); i++) {
                size_t q = mac_at(g, i, j, k);
                double speed = 0.5 * (u[q] + u[q + s]), phi = 0.5 * (F[q] + F[q + s]);
                G[q] = rho * phi * carried(u[q], u[q + s], speed, limit) -
                       nu * eps[q] * (u[q + s] - u[q]);
            }
}

/* Flux of component c across direction e != c, at the edges below (i, j, k) in c and e. */
static void edge_flux(const mac *m, int c, int e, double *restrict G, double limit, int first,
                      int last)
{
    const mac_grid *g = &m->grid;
    const double *restrict u = m->u[c], *restrict v = m->u[e], *restrict F = m->flux[e];
    const double *restrict eps = m->eps;
    double rho = m->param.rho, mu4 = 0.25 * m->param.mu, he = 1 / g->h[e], hc = 1 / g->h[c];
    size_t s = g->stride[c], t = g->stride[e];
    int lo[3] = {1, 1, 1}, hi[3] = {g->n[0], g->n[1], g->n[2]};
    hi[c]++;
    lo[e] = first;
    hi[e] = last;
    for (int k = lo[2]; k <= hi[2]; k++)
        for (int j = lo[1]; j <= hi[1]; j++)
            for (int i = lo[0]; i <= hi[0]; i++) {
                size_t q = mac_at(g, i, j, k);
                double speed = 0.5 * (v[q] + v[q - s]), phi = 0.5 * (F[q] + F[q - s]);
                double shear = (u[q] - u[q - t]) * he + (v[q] - v[q - s]) * hc;
                double eps4 = eps[q] + eps[q - s] + eps[q - t] + eps[q - s - t];
                G[q] = rho * phi * carried(u[q - t], u[q], speed, limit) - mu4 * eps4 * shear;
            }
}

/* rhs -= (G above - G below) / h. */
static void subtract_divergence(const mac *m, int c, int e, const double *restrict G,
                                double *restrict rhs)
{
    const mac_grid *g = &m->grid;
    double scale = 1 / g->h[e];
    /* along c itself a face lies between cell centres, across it between edges */
    size_t above = e == c ? 0 : g->stride[e], below = e == c ? g->stride[e] : 0;
    int hi[3] = {g->n[0], g->n[1], g->n[2]};
    hi[c]++;
    for (int k = 1; k <= hi[2]; k++)
        for (int j = 1; j <= hi[1]; j++)
            for (int i = 1; i <= hi[0]; i++) {
                size_t q = mac_at(g, i, j, k);
                rhs[q] -= scale * (G[q + above] - G[q - below]);
            }
}

/* Half control volumes at the sides normal to c: the flux through the side itself carries the
 * side's velocity; the normal stress there is that of the cell inside, its best estimate. The
 * missing half is written into the ghost of G so that the divergence over a whole cell is right. */
static void half_volumes(const mac *m, int c, double *G)
{
    const mac_grid *g = &m->grid;
    if (g->periodic[c]) return;
    const double *u = m->u[c], *F = m->flux[c];
    int a = (c + 1) % 3, b = (c + 2) % 3;
    size_t s = g->stride[c], n = (size_t)g->n[c];
    double rho = m->param.rho, nu = 2 * m->param.mu / g->h[c];
    for (int q = 1; q <= g->n[b]; q++)
        for (int p = 1; p <= g->n[a]; p++) {
            size_t line = (size_t)p * g->stride[a] + (size_t)q * g->stride[b];
            size_t low = line + s, high = line + (n + 1) * s; /* boundary faces */
            double stress_low = nu * m->eps[low] * (u[low + s] - u[low]);
            double stress_high = nu * m->eps[high - s] * (u[high] - u[high - s]);
            double side_low = rho * F[low] * u[low] - stress_low;
            double side_high = rho * F[high] * u[high] - stress_high;
            G[low - s] = 2 * side_low - G[low]; /* (G - side)/(h/2) = (G - ghost)/h */
            G[high] = 2 * side_high - G[high - s];
        }
}

static void gravity(const mac *m, int c, double *rhs)
{
    const mac_grid *g = &m->grid;
    double weight = m->param.rho * m->param.gravity[c];
    int hi[3] = {g->n[0], g->n[1], g->n[2]};
    hi[c]++;
    for (int k = 1; k <= hi[2]; k++)
        for (int j = 1; j <= hi[1]; j++)
            for (int i = 1; i <= hi[0]; i++) {
                size_t q = mac_at(g, i, j, k);
                rhs[q] = weight * mac_face(m->eps, q, g->stride[c]);
            }
}

void mac_explicit_terms(mac *m)
{
    const mac_grid *g = &m->grid;
    for (int c = 0; c < 3; c++) {
        gravity(m, c, m->rhs[c]);
        for (int e = 0; e < 3; e++) {
            if (e == c) {
                normal_flux(m, c, m->work);
                half_volumes(m, c, m->work);
            } else {
                int n = g->n[e];
                edge_flux(m, c, e, m->work, upwind_above(&m->param, e), 1, n + 1);
                if (!g->periodic[e]) {
                    edge_flux(m, c, e, m->work, INFINITY, 1, 1);
                    edge_flux(m, c, e, m->work, INFINITY, n + 1, n + 1);
                }
            }
            subtract_divergence(m, c, e, m->work, m->rhs[c]);
        }
    }
}
