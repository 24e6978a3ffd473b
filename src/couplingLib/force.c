/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force.c - the coupling in time: what a particle feels in a step, and what it is owed after it.
 *
 * The fluid solves step n+1 with drag implicit in its new velocity. The particles move before
 * that, under a prediction of the force the fluid will turn out to have lost to them:
 *
 *     F = L + g C/dt + k (v^n - v) + M (a - dv/dt)
 *     L = kappa (u - v) - V grad p    of the last solve;      C <- C + L dt - J
 *
 * k and M are the fluid's answer to a change of the particles' velocity. In a region where
 * continuity holds the volume flux, e u + (1-e) v = const, a change dv of the solids changes the
 * slip by -dv/e and, through the pressure gradient that this takes, the force on a particle by
 *
 *     d(kappa (u-v) - V grad p) = -(kappa/e^2) dv - rho V (1-e)/e d(dv/dt)
 *
 * (eliminate grad p from the fluid's momentum equation), hence k = kappa/e^2 and
 * M = rho V (1-e)/e. With the bare force of the last step in their place the scheme diverges for
 * kappa dt/m above a few tenths in a dense bed, and at any step for particles lighter than about
 * (1-e)/e times the fluid. Whatever the prediction missed is carried in C and returned, so that
 * the momentum of fluid, particles and C together is conserved to rounding. tests/verify/
 * couplingTwoVelocity.c measures all of this.
 *
 * What it costs: where nothing holds the flux, a particle that is to be accelerated together with
 * its fluid resists at first, and the difference returns at the rate g/(1 + k dt/m) a step: for
 * k dt/m >> 1 (powders) in an open flow that is slow, though momentum is conserved all along.
 *
 * References: Y. Mori, doctoral thesis, University of Tokyo (2021), section 2.4.3 (the fluid's
 * side); the particles' side is this project's, docs/theory.md.
 */
#include "cpl.h"

cpl_param cpl_param_default(void)
{
    return (cpl_param){.map = CPL_DIVIDED_CUBE,
                       .packing_limit = .75,
                       .drag = CPL_ERGUN_WEN_YU,
                       .scheme = CPL_SEMI_IMPLICIT,
                       .carry_gain = .5,
                       .added_mass_above = .1,
                       .ledger_tolerance = 1e-9};
}

void cpl_predict(const cpl_param *param, size_t n, double dt, double rho, const double *eps,
                 const double *kappa, const double *V, const double *mass, const double (*L)[3],
                 const double (*C)[3], const double (*a)[3], double (*f)[3], double *k, double *M)
{
    const double gain = param->carry_gain / dt;
    const int plain = param->scheme == CPL_EXPLICIT;
    for (size_t p = 0; p < n; p++) {
        const double inertia = rho * V[p] * (1 - eps[p]) / eps[p];
        k[p] = plain ? 0 : kappa[p] / (eps[p] * eps[p]);
        M[p] = !plain && inertia > param->added_mass_above * mass[p] ? inertia : 0;
        for (int c = 0; c < 3; c++) f[p][c] = L[p][c] + gain * C[p][c] + M[p] * a[p][c];
    }
}

void cpl_settle(size_t n, double dt, const double *kappa, const double *V, const double (*u)[3],
                const double (*v)[3], const double (*grad_p)[3], const double (*J)[3],
                double (*L)[3], double (*C)[3])
{
    for (size_t p = 0; p < n; p++)
        for (int c = 0; c < 3; c++) {
            L[p][c] = kappa[p] * (u[p][c] - v[p][c]) - V[p] * grad_p[p][c];
            C[p][c] += L[p][c] * dt - J[p][c];
        }
}
