/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * exchange.c - what the fluid's momentum equation gave to the particles, seen from the cells.
 *
 * The faces lose  sum_f V_f eps_f^2 (k_f u_f - s_f)  by drag, where k = K/eps^2 and s = S/eps^2 are
 * averaged from the two cells of a face (mac.h). Ordered by cells this is
 *     sum_c V (K_c u_c - t_c S_c),
 *     u_c = sum_f eps_f^2 u_f / (2 eps_c^2)   and   t_c = sum_f eps_f^2 / (2 eps_c^2)
 * over the two faces of a cell: a boundary face has half the volume and the whole coefficient of
 * its only cell, which fits. t, the same for a uniform velocity, keeps the drag free of the frame
 * of reference. The pressure gradient on the solid fraction, -sum_f V_f (1 - eps_f) dp_f, becomes
 * the mean of the two gradients. Both sums are formed over the faces here, so that the ledger
 * compares two different orders of summation.
 */
#include "mac.h"

#include <string.h>

static void seen_from_cell(const mac *m, size_t q, double u[3], double tensor[9], double grad_p[3])
{
    const mac_grid *g = &m->grid;
    memset(tensor, 0, 9 * sizeof *tensor);
    for (int d = 0; d < 3; d++) {
        size_t s = g->stride[d];
        double scale = 0.5 / mac_face_share(m, m->eps[q]);
        double low = scale * mac_face_share(m, mac_face(m->eps, q, s));
        double high = scale * mac_face_share(m, mac_face(m->eps, q + s, s));
        u[d] = low * m->u[d][q] + high * m->u[d][q + s];
        tensor[4 * d] = low + high;
        grad_p[d] = 0.5 * (m->dp[d][q] + m->dp[d][q + s]);
    }
}

void mac_exchange(const mac *m, double (*u)[3], double (*tensor)[9], double (*grad_p)[3],
                  double drag[3], double pressure[3])
{
    const mac_grid *g = &m->grid;
    size_t c = 0;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++, c++)
                seen_from_cell(m, mac_at(g, i, j, k), u[c], tensor[c], grad_p[c]);
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
                    double V = side ? 0.5 * g->volume : g->volume, eps = mac_face(m->eps, q, s);
                    drag[d] += V * mac_face_share(m, eps) *
                               (mac_face(m->k, q, s) * m->u[d][q] - mac_face(m->s[d], q, s));
                    pressure[d] -= V * (1 - eps) * m->dp[d][q];
                }
    }
}
