/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * boundary.c - ghost values of the staggered fields.
 *
 * A tangential velocity is mirrored at a side of given value, u_ghost = 2 u_side - u_inside, so
 * that wall shear acts over half a cell; at a side of zero gradient it is copied. Directions are
 * filled one after the other over the full extent of the others, which fills edges and corners.
 */
#include "mac.h"

/* Begin of the line (a, b) along direction d. */
static size_t line_of(const mac_grid *g, int d, int p, int q)
{
    return (size_t)p * g->stride[(d + 1) % 3] + (size_t)q * g->stride[(d + 2) % 3];
}

static void wrap(const mac_grid *g, int d, double *line)
{
    size_t s = g->stride[d], n = (size_t)g->n[d];
    line[0] = line[n * s];
    line[(n + 1) * s] = line[s];
    line[(n + 2) * s] = line[(n > 1 ? 2 : 1) * s];
}

static void copy(const mac_grid *g, int d, double *line, int face)
{
    size_t s = g->stride[d], last = (size_t)g->n[d] + (face == d);
    line[0] = line[s];
    line[(last + 1) * s] = line[last * s];
}

void mac_fill_copy(const mac_grid *g, double *q, int face)
{
    for (int d = 0; d < 3; d++)
        for (int b = 0; b < g->n[(d + 2) % 3] + 3; b++)
            for (int a = 0; a < g->n[(d + 1) % 3] + 3; a++) {
                double *line = q + line_of(g, d, a, b);
                if (g->periodic[d])
                    wrap(g, d, line);
                else
                    copy(g, d, line, face);
            }
}

void mac_boundary_values(mac *m)
{
    const mac_grid *g = &m->grid;
    for (int s = 0; s < 6; s++) {
        const mac_side *side = &m->param.side[s];
        int d = s / 2;
        if (side->normal != MAC_PRESCRIBED) continue;
        size_t face = (size_t)(s % 2 ? g->n[d] + 1 : 1) * g->stride[d];
        for (int b = 1; b <= g->n[(d + 2) % 3]; b++)
            for (int a = 1; a <= g->n[(d + 1) % 3]; a++) {
                size_t at = face + line_of(g, d, a, b);
                double eps = mac_face(m->eps, at, g->stride[d]);
                m->u[d][at] = side->velocity[d] / (side->superficial ? eps : 1);
            }
    }
}

/* Component c on the ghosts of side s, normal to d != c. */
static void fill_side(mac *m, int c, int s)
{
    const mac_grid *g = &m->grid;
    const mac_side *side = &m->param.side[s];
    int d = s / 2, high = s % 2;
    size_t step = g->stride[d], across = g->stride[c];
    size_t inside = (size_t)(high ? g->n[d] : 1) * step, face = inside + (high ? step : 0);
    double *u = m->u[c];
    for (int b = 0; b < g->n[(d + 2) % 3] + 3; b++)
        for (int a = 0; a < g->n[(d + 1) % 3] + 3; a++) {
            size_t line = line_of(g, d, a, b), in = line + inside;
            size_t ghost = high ? in + step : in - step;
            int fixed = side->tangent == MAC_FIXED;
            if (side->tangent == MAC_INFLOW_FIXED) {
                size_t f = line + face, below = f >= across ? f - across : f;
                double normal = m->u[d][f] + m->u[d][below];
                fixed = high ? normal < 0 : normal > 0;
            }
            double value = side->velocity[c];
            if (fixed && side->superficial) {
                size_t below = in >= across ? in - across : in;
                value /= 0.5 * (m->eps[in] + m->eps[below]);
            }
            u[ghost] = fixed ? 2 * value - u[in] : u[in];
        }
}

void mac_fill_velocity(mac *m)
{
    const mac_grid *g = &m->grid;
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) {
            if (g->periodic[d] || d == c) {
                for (int b = 0; b < g->n[(d + 2) % 3] + 3; b++)
                    for (int a = 0; a < g->n[(d + 1) % 3] + 3; a++) {
                        double *line = m->u[c] + line_of(g, d, a, b);
                        if (g->periodic[d])
                            wrap(g, d, line);
                        else
                            copy(g, d, line, d);
                    }
                continue;
            }
            fill_side(m, c, 2 * d);
            fill_side(m, c, 2 * d + 1);
        }
}
