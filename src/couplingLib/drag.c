/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * drag.c - drag laws of one sphere, F = kappa (u - v), in the model with shared pressure gradient.
 *
 * kappa is written without a division by the Reynolds number, so that it is finite at zero slip.
 * Notation: e void fraction, u slip of interstitial velocities, d diameter, V = pi d^3/6,
 * Re = e rho u d/mu. In two-fluid notation beta = kappa (1-e)/V.
 *
 *     Ergun                kappa/V = 150 (1-e) mu/(e d^2) + 1.75 rho u/d
 *     Wen & Yu             kappa/V = 3/4 (C_D u) rho e/d e^-2.65
 *     Di Felice            kappa   = pi/8 d^2 rho (C_D u) e^(2-chi)
 *     Schiller & Naumann   kappa   = pi/8 d^2 rho (C_D u)            with e = 1
 *
 * References: S. Ergun, Chem. Eng. Prog. 48 (1952) 89; C.Y. Wen & Y.H. Yu, Chem. Eng. Prog. Symp.
 * Ser. 62 (1966) 100; D. Gidaspow, Multiphase Flow and Fluidization (1994),
 * doi:10.1016/C2009-0-21244-X (switch at .8); R. Di Felice, Int. J. Multiphase Flow 20 (1994) 153,
 * doi:10.1016/0301-9322(94)90011-6; L. Schiller & A. Naumann, Z. Ver. Dtsch. Ing. 77 (1935) 318.
 */
#include "cpl.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* C_D u of Schiller and Naumann, .44 above Re = 1000 (Rowe's form, as Wen & Yu use it); `re_u` is
 * Re/u, s/m, so that C_D u = 24 (1 + .15 Re^.687)/(Re/u). */
static double schiller_naumann(double u, double re_u)
{
    const double re = re_u * u;
    return re <= 1000 ? 24 / re_u * (1 + .15 * pow(re, .687)) : .44 * u;
}

static double ergun(double e, double u, double d, double rho, double mu)
{
    return pi / 6 * d * d * d * (150 * (1 - e) * mu / (e * d * d) + 1.75 * rho * u / d);
}

static double wen_yu(double e, double u, double d, double rho, double mu)
{
    const double cd_u = schiller_naumann(u, e * rho * d / mu);
    return pi / 6 * d * d * d * .75 * cd_u * rho * e / d * pow(e, -2.65);
}

/* The exponent 2 - chi belongs to the shared pressure gradient; 1 - chi, as often printed, to the
 * model in which the fluid alone carries it. C_D u = (.63 sqrt u + 4.8 sqrt(u/Re))^2. */
static double di_felice(double e, double u, double d, double rho, double mu)
{
    const double re_u = e * rho * d / mu;
    const double root = .63 * sqrt(u) + 4.8 / sqrt(re_u);
    const double away = 1.5 - log10(re_u * u); /* infinite at rest: chi = 3.7 */
    const double chi = 3.7 - .65 * exp(-.5 * away * away);
    return pi / 8 * d * d * rho * root * root * pow(e, 2 - chi);
}

static double single_sphere(double u, double d, double rho, double mu)
{
    return pi / 8 * d * d * rho * schiller_naumann(u, rho * d / mu);
}

double cpl_drag(cpl_drag_law law, double eps, double slip, double d, double rho, double mu)
{
    switch (law) {
    case CPL_ERGUN_WEN_YU:
        return eps <= .8 ? ergun(eps, slip, d, rho, mu) : wen_yu(eps, slip, d, rho, mu);
    case CPL_DI_FELICE:
        return di_felice(eps, slip, d, rho, mu);
    case CPL_SCHILLER_NAUMANN:
        return single_sphere(slip, d, rho, mu);
    case CPL_DRAG_NONE:
        break;
    }
    return 0;
}
