/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * projection.c - drag taken implicitly, and the pressure that keeps continuity.
 *
 *     alpha = 1 / (1 + K dt/(rho eps))
 *     u^    = alpha [ (eps_old/eps) u + dt/(rho eps) (rhs + S) ]
 *     (dt/rho) div(alpha eps grad p) = (eps - eps_old)/dt + div(eps u^)
 *     u     = u^ - (dt/rho) alpha grad p
 *
 * The momentum equation of every face holds to rounding whatever the pressure solver leaves over,
 * so that what drag takes from the fluid is exactly what mac_exchange reports.
 *
 * A face of given velocity has no unknown; its momentum equation gives the pressure gradient there.
 * A face of given pressure sees the gradient over half a cell.
 *
 * Mean flux. In a periodic direction p may have a uniform mean gradient G besides its periodic
 * part. The answer to G = 1 is phi with div(alpha eps (e + grad phi)) = 0, and the volume flux is
 * linear in G, so the G that holds the flux follows from a system of at most three equations. Where
 * alpha eps does not vary, phi = 0 and nothing is solved.
 *
 * References: Mori, Wu & Sakai, Powder Technol. 349 (2019) (semi-implicit drag); Y. Mori, doctoral
 * thesis, University of Tokyo (2021), eqs 154-172 (corrected).
 */
#include "mac.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Faces of component d whose velocity is unknown. */
typedef struct range {
    int lo[3], hi[3];
} range;

static range unknown_faces(const mac *m, int d)
{
    const mac_grid *g = &m->grid;
    range r = {{1, 1, 1}, {g->n[0], g->n[1], g->n[2]}};
    if (g->periodic[d]) return r; /* face n+1 is face 1 */
    if (m->param.side[2 * d].normal == MAC_PRESCRIBED) r.lo[d] = 2;
    if (m->param.side[2 * d + 1].normal == MAC_OPEN) r.hi[d] = g->n[d] + 1;
    return r;
}

#define FOR_RANGE(r, k, j)                                                                         \
    for (int k = (r).lo[2]; k <= (r).hi[2]; k++)                                                   \
        for (int j = (r).lo[1]; j <= (r).hi[1]; j++)

/* ---- predictor ------------------------------------------------------------------------------- */

static void predict(mac *m, double dt)
{
    const mac_grid *g = &m->grid;
    double rho = m->param.rho, stiffest = 0;
    for (int d = 0; d < 3; d++) {
        range r = unknown_faces(m, d);
        size_t s = g->stride[d];
        double *restrict u = m->u[d], *restrict mobility = m->mobility[d];
        const double *restrict rhs = m->rhs[d], *restrict S = m->s[d];
        FOR_RANGE(r, k, j)
        for (int i = r.lo[0]; i <= r.hi[0]; i++) {
            size_t q = mac_at(g, i, j, k);
            double eps = mac_face(m->eps, q, s), old = mac_face(m->eps_old, q, s);
            double share = mac_face_share(m, eps), step = dt / (rho * eps);
            double stiff = share * mac_face(m->k, q, s) * step;
            double alpha = 1 / (1 + stiff);
            u[q] = alpha * (old / eps * u[q] + step * (rhs[q] + share * mac_face(S, q, s)));
            mobility[q] = alpha * dt / rho;
            if (stiff > stiffest) stiffest = stiff;
        }
        mac_fill_copy(g, u, d); /* face n+1 of a periodic direction */
        if (g->periodic[d]) mac_fill_copy(g, mobility, d);
    }
    m->report.stiffness = stiffest;
}

/* ---- pressure equation ----------------------------------------------------------------------- */

/* Index in the solver's layout, which has one ghost layer. */
static size_t solver_at(const mac *m, int i, int j, int k)
{
    const size_t *s = m->solver_stride;
    return (size_t)i * s[0] + (size_t)j * s[1] + (size_t)k * s[2];
}

static void coefficients(mac *m)
{
    const mac_grid *g = &m->grid;
    double **c = mac_poisson_coefficients(&m->poisson);
    for (int d = 0; d < 3; d++) {
        double scale = 1 / (g->h[d] * g->h[d]);
        size_t s = g->stride[d];
        int open[2] = {m->param.side[2 * d].normal == MAC_OPEN,
                       m->param.side[2 * d + 1].normal == MAC_OPEN};
        int own_neighbour = g->periodic[d] && g->n[d] == 1;
        range all = {{1, 1, 1}, {g->n[0], g->n[1], g->n[2]}};
        all.hi[d]++;
        FOR_RANGE(all, k, j)
        for (int i = all.lo[0]; i <= all.hi[0]; i++) {
            int at[3] = {i, j, k};
            size_t q = mac_at(g, i, j, k);
            double value = scale * m->mobility[d][q] * mac_face(m->eps, q, s);
            if ((at[d] == 1 && open[0]) || (at[d] == g->n[d] + 1 && open[1])) value *= 2;
            c[m->axis[d]][solver_at(m, i, j, k)] = own_neighbour ? 0 : value;
        }
    }
    mac_poisson_assemble(&m->poisson);
}

/* Gradient of the solver's field x at an unknown face of direction d. `given`: share of the sides'
 * pressures that x has there, 1 for the pressure, 0 for its answer to a mean gradient. */
static double gradient(const mac *m, const double *x, int d, const int at[3], double given)
{
    const mac_grid *g = &m->grid;
    const mac_side *low = &m->param.side[2 * d], *high = low + 1;
    size_t above = solver_at(m, at[0], at[1], at[2]);
    size_t below = above - m->solver_stride[d];
    if (at[d] == 1 && low->normal == MAC_OPEN)
        return 2 * (x[above] - given * low->pressure) / g->h[d];
    if (at[d] == g->n[d] + 1 && high->normal == MAC_OPEN)
        return 2 * (given * high->pressure - x[below]) / g->h[d];
    return (x[above] - x[below]) / g->h[d];
}

/* (eps - eps_old)/dt + div(eps u) of a cell, 1/s. */
static double imbalance(const mac *m, size_t q, double dt)
{
    const mac_grid *g = &m->grid;
    double sum = (m->eps[q] - m->eps_old[q]) / dt;
    for (int d = 0; d < 3; d++) {
        size_t s = g->stride[d];
        sum += (mac_face(m->eps, q + s, s) * m->u[d][q + s] - mac_face(m->eps, q, s) * m->u[d][q]) /
               g->h[d];
    }
    return sum;
}

static void right_hand_side(mac *m, double dt)
{
    const mac_grid *g = &m->grid;
    double **c = mac_poisson_coefficients(&m->poisson);
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++)
                m->poisson.b[solver_at(m, i, j, k)] = -imbalance(m, mac_at(g, i, j, k), dt);
    for (int s = 0; s < 6; s++) { /* sides of given pressure */
        const mac_side *side = &m->param.side[s];
        int d = s / 2;
        if (side->normal != MAC_OPEN || side->pressure == 0) continue;
        range r = {{1, 1, 1}, {g->n[0], g->n[1], g->n[2]}};
        r.lo[d] = r.hi[d] = s % 2 ? g->n[d] : 1;
        FOR_RANGE(r, k, j)
        for (int i = r.lo[0]; i <= r.hi[0]; i++) {
            size_t cell = solver_at(m, i, j, k);
            size_t face = cell + (s % 2 ? m->solver_stride[d] : 0);
            m->poisson.b[cell] += c[m->axis[d]][face] * side->pressure;
        }
    }
}

/* A box without opening can neither gain nor lose volume. */
static int check_closed_box(mac *m, double dt)
{
    const mac_grid *g = &m->grid;
    if (!m->poisson.singular) return 0;
    double sum = 0, size = 0, count = (double)g->n[0] * g->n[1] * g->n[2];
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++) {
                double b = m->poisson.b[solver_at(m, i, j, k)];
                sum += b;
                size += fabs(b);
            }
    if (!isfinite(sum)) return 0; /* the solver will find it */
    if (fabs(sum) <= 1e-6 * size || fabs(sum) * dt <= 1e-9 * count) return 0;
    snprintf(m->message, sizeof m->message,
             "the box has no side of given pressure, yet fluid and particles together would gain "
             "%g m3/s of volume: open a side, or make inflow and outflow equal",
             -sum * g->volume);
    return -1;
}

static int solve(mac *m, double floor)
{
    mac_poisson *ps = &m->poisson;
    mac_poisson_status status = mac_poisson_solve(ps, floor);
    m->report.iterations += ps->iterations;
    m->report.residual = ps->residual;
    if (status == MAC_SOLVED) return 0;
    if (status == MAC_NOT_CONVERGED)
        snprintf(m->message, sizeof m->message,
                 "the pressure equation did not converge: relative residual %.3g after %d "
                 "iterations, asked for %g",
                 ps->residual, ps->iterations, ps->tolerance);
    return -1;
}

/* Name the first value that is not finite. */
static void find_not_finite(mac *m)
{
    const mac_grid *g = &m->grid;
    const struct {
        const char *name;
        const double *q;
    } field[] = {
        {"void fraction", m->eps},  {"drag coefficient", m->K}, {"x velocity", m->u[0]},
        {"y velocity", m->u[1]},    {"z velocity", m->u[2]},    {"x drag source", m->S[0]},
        {"y drag source", m->S[1]}, {"z drag source", m->S[2]}, {"pressure gradient", m->dp[2]}};
    for (size_t f = 0; f < sizeof field / sizeof *field; f++)
        for (int k = 1; k <= g->n[2]; k++)
            for (int j = 1; j <= g->n[1]; j++)
                for (int i = 1; i <= g->n[0]; i++) {
                    double value = field[f].q[mac_at(g, i, j, k)];
                    if (isfinite(value)) continue;
                    snprintf(m->message, sizeof m->message,
                             "the solution has blown up: %s in cell (%d %d %d) is %g; the last "
                             "Courant number was %g",
                             field[f].name, i - 1, j - 1, k - 1, value, m->report.courant);
                    return;
                }
    snprintf(m->message, sizeof m->message, "the pressure is not finite");
}

/* ---- mean flux ------------------------------------------------------------------------------- */

/* phi for a unit gradient along d, into response[d]. */
static int solve_response(mac *m, int d)
{
    const mac_grid *g = &m->grid;
    mac_poisson *ps = &m->poisson;
    const mac_level *l = &ps->mg.level[0];
    size_t s = g->stride[d];
    double largest = 0, *kept = ps->x;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++) {
                size_t q = mac_at(g, i, j, k);
                double low = m->mobility[d][q] * mac_face(m->eps, q, s);
                double high = m->mobility[d][q + s] * mac_face(m->eps, q + s, s);
                ps->b[solver_at(m, i, j, k)] = (high - low) / g->h[d];
                largest = fmax(largest, high / g->h[d]);
            }
    ps->x = m->response[d]; /* the last step's answer is the guess */
    int failed = solve(m, 1e-12 * largest);
    mac_level_wrap(l, ps->x);
    ps->x = kept;
    return failed;
}

/* Mean over the box of eps times q(face), for q the velocity (along < 0) or the answer to a unit
 * gradient along `along`. */
static double mean_flux(const mac *m, int e, int along)
{
    const mac_grid *g = &m->grid;
    size_t s = g->stride[e];
    double sum = 0;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++) {
                const int at[3] = {i, j, k};
                size_t q = mac_at(g, i, j, k);
                double value = m->u[e][q];
                if (along >= 0)
                    value = m->mobility[e][q] *
                            ((along == e) + gradient(m, m->response[along], e, at, 0));
                sum += mac_face(m->eps, q, s) * value;
            }
    return sum / ((double)g->n[0] * g->n[1] * g->n[2]);
}

/* Solve R G = D for the held directions, R symmetric and positive definite. */
static void solve_small(const int held[3], double R[3][3], const double D[3], double G[3])
{
    double A[3][4];
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) A[r][c] = held[r] && held[c] ? R[r][c] : r == c;
        A[r][3] = held[r] ? D[r] : 0;
    }
    for (int p = 0; p < 3; p++)
        for (int r = p + 1; r < 3; r++) {
            double factor = A[r][p] / A[p][p];
            for (int c = p; c < 4; c++) A[r][c] -= factor * A[p][c];
        }
    for (int r = 2; r >= 0; r--) {
        double sum = A[r][3];
        for (int c = r + 1; c < 3; c++) sum -= A[r][c] * G[c];
        G[r] = sum / A[r][r];
    }
}

/* The mean gradients that bring the fluxes of the corrected velocity to their values; their
 * periodic parts are added to the pressure. */
static int hold_mean_flux(mac *m, double G[3])
{
    const mac_grid *g = &m->grid;
    const int *held = m->param.hold_flux;
    double R[3][3] = {{0}}, D[3] = {0};
    if (!held[0] && !held[1] && !held[2]) return 0;
    for (int d = 0; d < 3; d++)
        if (held[d] && solve_response(m, d)) return -1;
    for (int e = 0; e < 3; e++) {
        if (!held[e]) continue;
        D[e] = mean_flux(m, e, -1) + m->solid_flux[e] - m->param.mean_flux[e];
        for (int d = 0; d < 3; d++)
            if (held[d]) R[e][d] = mean_flux(m, e, d);
    }
    solve_small(held, R, D, G);
    for (int e = 0; e < 3; e++) {
        range r = unknown_faces(m, e);
        FOR_RANGE(r, k, j)
        for (int i = r.lo[0]; i <= r.hi[0]; i++) {
            const int at[3] = {i, j, k};
            size_t q = mac_at(g, i, j, k);
            double extra = G[e];
            for (int d = 0; d < 3; d++)
                if (held[d]) extra += G[d] * gradient(m, m->response[d], e, at, 0);
            m->dp[e][q] += extra;
            m->u[e][q] -= m->mobility[e][q] * extra;
        }
    }
    return 0;
}

/* ---- correction ------------------------------------------------------------------------------ */

static void correct(mac *m)
{
    const mac_grid *g = &m->grid;
    const double *x = m->poisson.x;
    for (int d = 0; d < 3; d++) {
        range r = unknown_faces(m, d);
        FOR_RANGE(r, k, j)
        for (int i = r.lo[0]; i <= r.hi[0]; i++) {
            const int at[3] = {i, j, k};
            size_t q = mac_at(g, i, j, k);
            double dp = gradient(m, x, d, at, 1);
            m->dp[d][q] = dp;
            m->u[d][q] -= m->mobility[d][q] * dp;
        }
    }
}

/* Pressure gradient at the faces of given velocity, from their own momentum equation. */
static void given_gradients(mac *m, double dt)
{
    const mac_grid *g = &m->grid;
    for (int s = 0; s < 6; s++) {
        if (m->param.side[s].normal != MAC_PRESCRIBED) continue;
        int d = s / 2;
        size_t t = g->stride[d];
        range r = {{1, 1, 1}, {g->n[0], g->n[1], g->n[2]}};
        r.lo[d] = r.hi[d] = s % 2 ? g->n[d] + 1 : 1;
        FOR_RANGE(r, k, j)
        for (int i = r.lo[0]; i <= r.hi[0]; i++) {
            size_t q = mac_at(g, i, j, k);
            double eps = mac_face(m->eps, q, t), u = m->u[d][q];
            double change = m->param.rho * (eps * u - m->dp[d][q]) / dt; /* see keep_... in mac.c */
            double drag = mac_face(m->k, q, t) * u - mac_face(m->s[d], q, t);
            m->dp[d][q] = (m->rhs[d][q] - mac_face_share(m, eps) * drag - change) / eps;
        }
    }
}

static void store_pressure(mac *m, const double G[3])
{
    const mac_grid *g = &m->grid;
    mac_poisson *ps = &m->poisson;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++) {
                size_t cell = solver_at(m, i, j, k);
                double p = ps->x[cell];
                for (int d = 0; d < 3; d++)
                    if (m->param.hold_flux[d]) p += G[d] * m->response[d][cell];
                m->p[mac_at(g, i, j, k)] = p;
            }
    if (ps->singular) {
        size_t n0 = (size_t)g->n[0], n1 = (size_t)g->n[1], c = m->param.reference_cell;
        size_t ref = mac_at(g, (int)(c % n0) + 1, (int)(c / n0 % n1) + 1, (int)(c / (n0 * n1)) + 1);
        double shift = m->param.reference_value - m->p[ref];
        for (int k = 1; k <= g->n[2]; k++)
            for (int j = 1; j <= g->n[1]; j++)
                for (int i = 1; i <= g->n[0]; i++) m->p[mac_at(g, i, j, k)] += shift;
    }
    mac_fill_copy(g, m->p, -1);
}

int mac_project(mac *m, double dt)
{
    const mac_grid *g = &m->grid;
    /* rounding of the void fraction in one step: a right-hand side below it is nothing */
    const double floor = 1e-15 / dt;
    double G[3] = {0, 0, 0};
    m->report.iterations = 0;
    m->report.residual = 0;
    predict(m, dt);
    coefficients(m);
    right_hand_side(m, dt);
    if (check_closed_box(m, dt)) return -1;
    m->message[0] = '\0';
    if (solve(m, floor)) {
        if (!m->message[0]) find_not_finite(m);
        return -1;
    }
    mac_level_wrap(&m->poisson.mg.level[0], m->poisson.x);
    correct(m);
    if (hold_mean_flux(m, G)) return -1;
    given_gradients(m, dt);
    for (int d = 0; d < 3; d++) {
        if (!g->periodic[d]) continue;
        mac_fill_copy(g, m->u[d], d);
        mac_fill_copy(g, m->dp[d], d);
    }
    store_pressure(m, G);
    memcpy(m->report.gradient, G, sizeof G);
    m->report.continuity = 0;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++)
                m->report.continuity =
                    fmax(m->report.continuity, fabs(imbalance(m, mac_at(g, i, j, k), dt)) * dt);
    return 0;
}
