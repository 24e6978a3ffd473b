/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * exchange.c - what the fluid's momentum equation gave to the particles, seen from the cells.
 *
 * The faces lose  sum_f V_f (K_f u_f - S_f)  by drag, with K_f, S_f the means of two cells. Ordered
 * by cells this is  sum_c V (K_c u_c - S_c)  with u_c the mean of a cell's two faces: a boundary
 * face has half the volume and the whole coefficient of its only cell, which fits. The same holds
 * for the pressure gradient on the solid fraction, -sum_f V_f (1 - eps_f) dp_f. Both sums are
 * formed over the faces here, so that the ledger compares two different orders of summation.
 */
#include "mac.h"

void mac_exchange(const mac *m, double (*u)[3], double (*grad_p)[3], double drag[3],
                  double pressure[3])
{
    const mac_grid *g = &m->grid;
    size_t c = 0;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++, c++) {
                size_t q = mac_at(g, i, j, k);
                for (int d = 0; d < 3; d++) {
                    size_t s = g->stride[d];
                    u[c][d] = 0.5 * (m->u[d][q] + m->u[d][q + s]);
                    grad_p[c][d] = 0.5 * (m->dp[d][q] + m->dp[d][q + s]);
                }
            }
    for (int d = 0; d < 3; d++) {
        size_t s = g->stride[d];
        int hi[3] = {g->n[0], g->n[1], g->n[2]};
        hi[d] += !g->periodic[d]; /* face n+1 of a periodic direction is face 1 */
        drag[d] = pressure[d] = 0;
        for (int k = 1; k <= hi[2]; k++)
            for (int j = 1; j <= hi[1]; j++)
                for (int i = 1; i <= hi[0]; i++) {
                    int at[3] = {i, j, k};
                    int side = !g->periodic[d] && (at[d] == 1 || at[d] == g->n[d] + 1);
                    size_t q = mac_at(g, i, j, k);
                    double V = side ? 0.5 * g->volume : g->volume;
                    drag[d] += V * (mac_face(m->K, q, s) * m->u[d][q] - mac_face(m->S[d], q, s));
                    pressure[d] -= V * (1 - mac_face(m->eps, q, s)) * m->dp[d][q];
                }
    }
}
