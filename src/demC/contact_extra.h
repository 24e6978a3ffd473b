/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * contact_extra.h - rolling resistance, cohesion and the energy of one contact.
 *
 * What not every simulation asks for: scalar kernels, called after law_force() in loops of their
 * own, so that the plain loops do not pay for them.
 *
 * Rolling. w is the spin of the particle relative to its partner, without its component along n
 * (no torque against twisting), R the effective radius r_i r_j/(r_i + r_j), E the elastic normal
 * force, I = I_i I_j/(I_i + I_j). The torque acts on the particle, the opposite one on the partner.
 *
 *   constant   T = -mu_r R E w/|w|, but at most I |w|/(6 dt)
 *   epsd       dM/dt = -k_r w, turned with the contact, |M| <= mu_r R E
 *              k_r = 2.25 k_n (mu_r R)^2
 *              T = M - 2 eta_r sqrt(I_r k_r) w below the limit, else M,   I_r = 3.5 I
 *
 * k_n is E over the overlap and I_r the inertia about the contact point, 1/I_r = sum 1/(I_i + m_i
 * r_i^2), which is 3.5 I for spheres. Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011) 269,
 * doi:10.1016/j.powtec.2010.09.030: models A (constant) and C (elastic-plastic), three dimensions,
 * no dashpot at the limit. k_r goes with the contact radius a under Hertz's law; M is summed and
 * scaled like the tangential spring, and for its reason (see contact_law.h).
 *
 * Why a sixth: a torque that would end the relative spin of one pair in one step ends it several
 * times over where a sphere has several contacts. In the densest packing, twelve neighbours of
 * which a spin is tangential to two thirds, a sixth takes at most .9 of any pattern of spins away
 * in a step, so that none changes sign and all come to rest.
 *
 * Cohesion, SJKR: attraction kappa A with A the area of the circle in which the spheres intersect,
 *
 *   A = pi (r_i^2 - h_i^2),  h_i the distance of its plane from the centre;  wall: h_i = phi
 *
 * It begins and ends at zero overlap and is the gradient of -kappa times the volume of the lens.
 * In the simplified form known from LIGGGHTS ("sjkr"; Kloss et al., Prog. Comput. Fluid Dyn. 12
 * (2012) 140, doi:10.1504/PCFD.2012.047457). Coulomb's limit stays mu E: E is what presses the
 * surfaces on each other, attraction included, so that a sticky contact at rest still holds.
 *
 * Energy. Springs hold k_n d^2/2 (2/5 k_n d^2 for Hertz), |S|^2/(2 k_t), |M|^2/(2 k_r). With Hertz
 * k_t and k_r change with a: pressed, S stays and the spring stiffens; released, S falls in
 * proportion to a. Either way min(a/a', a'/a) of its energy is left; the rest can never come back
 * and is booked as lost by friction (micro-slip).
 */
#ifndef DEM_CONTACT_EXTRA_H
#define DEM_CONTACT_EXTRA_H

#include "contact_law.h"

/* What a pair of materials adds to its coefficients. */
typedef struct resistance {
    double friction; /* mu_r */
    double damping;  /* eta_r */
    double cohesion; /* kappa, J/m3 */
} resistance;

/* What the models of a simulation are. */
typedef struct extras {
    dem_law law;
    dem_rolling rolling;
    dem_cohesion cohesion;
    int balance;             /* energies are asked for */
    const resistance *table; /* [n_material * n_material] */
} extras;

/* One contact, as law_force() has left it. */
typedef struct extra_contact {
    contact c;
    coefficient q;
    resistance r;
    double dt;
    double inertia;       /* effective, kg m2 */
    double wx, wy, wz;    /* relative spin, rad/s */
    double area;          /* of the contact, m2 */
    spring before, after; /* tangential spring */
    contact_force f;
} extra_contact;

/* What it adds, and what its force consists of. */
typedef struct extra_force {
    double attraction;         /* N, along -n */
    double torque[3];          /* on the particle, N m */
    double damped[3], slid[3]; /* force of dashpots; of friction, if it slides */
    double rolled[3];          /* torque less that of the spring */
} extra_force;

/* Energies of springs at the begin and at the end of a step, and what was lost other than by the
 * work of the forces above; sums over contacts, J. */
typedef struct spring_energy {
    double tangential, turned;         /* at the end, */
    double tangential_old, turned_old; /* and what the same contacts had before */
    double slid, rolled;               /* lost */
} spring_energy;

/* Area of the circle in which two spheres at the distance d intersect. */
DEM_INLINE double lens_area(double ri, double rj, double d)
{
    double s = (ri + rj - d) * (ri + rj + d), t = (d - ri + rj) * (d + ri - rj);
    return .25 * M_PI * s * t / (d * d);
}

/* Volume they share. */
DEM_INLINE double lens_volume(double ri, double rj, double d)
{
    double gap = ri + rj - d, uneven = ri - rj;
    return M_PI * gap * gap * (d * d + 2 * d * (ri + rj) - 3 * uneven * uneven) / (12 * d);
}

/* Of a sphere whose centre is phi from a plane: what lies behind it. */
DEM_INLINE double cap_volume(double r, double phi)
{
    return M_PI / 3 * (r - phi) * (r - phi) * (2 * r + phi);
}

/* Stiffness of the normal (secant), tangential or rolling spring for the contact radius a. */
DEM_INLINE double rolling_stiffness(resistance r, double kn, double radius)
{
    return 2.25 * kn * r.friction * radius * r.friction * radius; /* Ai et al. 2011, eq. for 3-D */
}

/* Energy of a normal spring at the overlap d. */
DEM_INLINE double normal_energy(dem_law law, double kn, double d)
{
    return (law == DEM_HERTZ ? .4 : .5) * kn * d * d;
}

/* |s|^2/(2 k), nothing for a spring without stiffness. */
DEM_INLINE double spring_held(spring s, double k)
{
    return k > 0 ? .5 * (s.x * s.x + s.y * s.y + s.z * s.z) / k : 0;
}

/* The part of a spring's energy that is left when the contact radius changes. */
DEM_INLINE double left_over(double before, double now)
{
    return before < now ? before / now : now / before;
}

/* The springs t and, unless NULL, m of a contact; radius: effective. */
static inline void add_springs(dem_law law, coefficient q, resistance r, double radius,
                               const double t[4], const double *m, spring_energy *sum)
{
    double a = law == DEM_HERTZ ? t[3] : 1;
    sum->tangential += spring_held((spring){t[0], t[1], t[2], 0}, q.tangential * a);
    if (!m) return;
    double kr = rolling_stiffness(r, q.normal * (law == DEM_HERTZ ? m[3] : 1), radius);
    sum->turned += spring_held((spring){m[0], m[1], m[2], 0}, kr);
}

static inline void rolling_constant(const extra_contact *e, double limit, const double w[3],
                                    extra_force *out)
{
    const double share = 1. / 6;
    double speed = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    double stop = share * e->inertia / e->dt;
    double per = limit < stop * speed ? limit / speed : stop;
    for (int a = 0; a < 3; a++) out->torque[a] = out->rolled[a] = -per * w[a];
}

static inline void rolling_epsd(dem_law law, const extra_contact *e, double kn, double limit,
                                const double w[3], spring *m, extra_force *out, spring_energy *sum)
{
    double kr = rolling_stiffness(e->r, kn, e->c.radius);
    spring t = law_turn(*m, e->c.nx, e->c.ny, e->c.nz);
    double a = e->after.a, old = 0, kept = 0;
    if (law == DEM_HERTZ && m->a > 0) {
        old = spring_held(t, kr * m->a / a);
        kept = old * left_over(m->a, a);
        double keep = a < m->a ? a / m->a : 1;
        t.x *= keep;
        t.y *= keep;
        t.z *= keep;
    } else if (law == DEM_LINEAR)
        old = kept = spring_held(t, kr);
    t.x -= kr * e->dt * w[0];
    t.y -= kr * e->dt * w[1];
    t.z -= kr * e->dt * w[2];
    double m2 = t.x * t.x + t.y * t.y + t.z * t.z;
    int yields = m2 > limit * limit;
    double back = yields ? limit / sqrt(m2) : 1;
    double eta = yields ? 0 : 2 * e->r.damping * sqrt(3.5 * e->inertia * kr);
    *m = (spring){t.x * back, t.y * back, t.z * back, a};
    const double spring_part[3] = {m->x, m->y, m->z};
    for (int k = 0; k < 3; k++) {
        out->torque[k] = spring_part[k] - eta * w[k];
        out->rolled[k] = yields ? out->torque[k] : -eta * w[k];
    }
    double now = spring_held(*m, kr);
    sum->turned += now;
    sum->turned_old += old;
    sum->rolled += old - kept;
    if (yields) sum->rolled -= now - kept;
}

/* Energies of the tangential spring; the parts of the force. */
static inline void law_parts(dem_law law, const extra_contact *e, double kt, extra_force *out,
                             spring_energy *sum)
{
    const contact_force *f = &e->f;
    double dashpot = f->normal - f->elastic;
    const double n[3] = {e->c.nx, e->c.ny, e->c.nz}, t[3] = {f->tx, f->ty, f->tz};
    const double s[3] = {e->after.x, e->after.y, e->after.z};
    for (int a = 0; a < 3; a++) {
        out->damped[a] = dashpot * n[a] + (f->slides ? 0 : t[a] - s[a]);
        out->slid[a] = f->slides ? t[a] : 0;
    }
    double now = spring_held(e->after, kt), old = 0, kept = 0;
    if (law == DEM_HERTZ && e->before.a > 0) {
        old = spring_held(e->before, kt * e->before.a / e->after.a);
        kept = old * left_over(e->before.a, e->after.a);
    } else if (law == DEM_LINEAR)
        old = kept = spring_held(e->before, kt);
    sum->tangential += now;
    sum->tangential_old += old;
    sum->slid += old - kept;
    if (f->slides) sum->slid -= now - kept;
}

/* Everything beyond law_force(); `m`, the rolling spring, is updated. */
static inline extra_force extra_law(dem_law law, const extras *x, const extra_contact *e, spring *m,
                                    spring_energy *sum)
{
    extra_force out = {0};
    double a = law == DEM_HERTZ ? e->after.a : 1, kn = e->q.normal * a;
    if (x->cohesion == DEM_COHESION_SJKR) out.attraction = e->r.cohesion * e->area * e->c.steepness;
    if (x->rolling != DEM_ROLLING_NONE) {
        double wn = e->wx * e->c.nx + e->wy * e->c.ny + e->wz * e->c.nz;
        const double w[3] = {e->wx - wn * e->c.nx, e->wy - wn * e->c.ny, e->wz - wn * e->c.nz};
        double limit = e->r.friction * e->c.radius * e->f.elastic;
        if (x->rolling == DEM_ROLLING_CONSTANT)
            rolling_constant(e, limit, w, &out);
        else
            rolling_epsd(law, e, kn, limit, w, m, &out, sum);
    }
    if (x->balance) law_parts(law, e, e->q.tangential * a, &out, sum);
    return out;
}

#endif
