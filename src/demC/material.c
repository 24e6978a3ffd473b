/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * material.c - coefficients of contact laws from the properties of two materials.
 *
 * Restitution e enters through B = -ln e / sqrt(pi^2 + ln^2 e), the damping ratio of an oscillator
 * that returns after half a period with e times its speed. Linear: eta = 2 B sqrt(m k). Hertz, with
 * eta = alpha sqrt(m K) d^(1/4) and K d^(3/2) the elastic force, the same e for every speed needs
 * alpha = sqrt5 B (Tsuji, Tanaka & Ishida 1992, doi:10.1016/0032-5910(92)88030-L; Antypov &
 * Elliott, EPL 94 (2011) 50004, doi:10.1209/0295-5075/94/50004, who also prove it exact). The
 * tangential dashpot is 2 sqrt(5/6) B sqrt(m k_t).
 *
 * 1/E* = sum (1 - nu^2)/E, 1/G* = sum 2 (2 - nu)(1 + nu)/E (Mindlin 1949).
 */
#include "material.h"

double effective_modulus(const dem_material *a, const dem_material *b)
{
    return 1 / ((1 - a->poisson_ratio * a->poisson_ratio) / a->youngs_modulus +
                (1 - b->poisson_ratio * b->poisson_ratio) / b->youngs_modulus);
}

static double shear_compliance(const dem_material *m)
{
    return 2 * (2 - m->poisson_ratio) * (1 + m->poisson_ratio) / m->youngs_modulus;
}

coefficient coefficient_of_pair(dem_law law, const dem_material *a, const dem_material *b,
                                const dem_pair *pair)
{
    double loss = -log(pair->restitution);
    double ratio = loss / sqrt(M_PI * M_PI + loss * loss);
    if (law == DEM_LINEAR)
        return (coefficient){pair->stiffness, pair->stiffness * pair->stiffness_ratio, 2 * ratio,
                             2 * ratio, pair->friction};
    double shear = 1 / (shear_compliance(a) + shear_compliance(b));
    return (coefficient){4. / 3 * effective_modulus(a, b), 8 * shear, sqrt(5) * ratio,
                         2 * sqrt(5. / 6) * ratio, pair->friction};
}

resistance resistance_of_pair(const dem_pair *pair)
{
    return (resistance){pair->rolling_friction, pair->rolling_damping, pair->cohesion};
}
