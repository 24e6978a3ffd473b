/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * contact_law.h - the force of one contact: stateless scalar kernels, inlined into vector loops.
 *
 * The law is a literal at every call, so that each loop is compiled for one law and vectorises.
 * A contact is described by its unit normal n (from the partner to the particle), the overlap d,
 * the relative velocity of the two surfaces at the contact point, effective mass m and radius R.
 *
 *   elastic normal force   E  = k_n d                     (k_n = 4/3 E* sqrt(R d) for Hertz)
 *   normal force           Fn = E - eta_n v_n
 *   tangential force       Ft = S - eta_t v_t,   |Ft| <= mu E
 *   spring                 dS/dt = -k_t v_t, turned with the tangent plane
 *
 * Linear: eta_n = eta_t = -2 ln e sqrt(m k_n / (pi^2 + ln^2 e)). Hertz: k_t = 8 G* sqrt(R d),
 * eta_n = -sqrt5 ln e sqrt(m k_n / (pi^2 + ln^2 e)), eta_t the same with sqrt(10/3) and k_t.
 *
 * Why there is no clamp on Fn and why Coulomb's limit takes the elastic part: with the contact
 * ending at zero overlap the restitution is e exactly, and as eta depends on d alone the dashpot
 * delivers no net impulse, so that a contact sliding throughout gets mu (1 + e) m v_n exactly. The
 * limit is never negative, whatever the dashpot does in the last moments of a contact.
 *
 * Why the spring is stored as a force: Mindlin's k_t grows with the contact radius a = sqrt(R d).
 * While a grows, new area carries no force yet: S is summed in increments. While a shrinks, the
 * area given up takes its share along: S is scaled by a/a_old. A spring k_t(d) times its length
 * would instead do work out of nothing when pressed.
 *
 * Sliding: Ft is scaled back to the limit along its own direction (no 0/0 at rest) and the spring
 * becomes that force; the dashpot rests while the surfaces slide.
 *
 * No branches: what a condition selects is computed first, so that the compiler may vectorise (a
 * division it would have to skip it may not turn into a blend); what is not a number is selected
 * away.
 *
 * Cundall & Strack, Geotechnique 29 (1979) 47, doi:10.1680/geot.1979.29.1.47;
 * Tsuji, Tanaka & Ishida, Powder Technol. 71 (1992) 239, doi:10.1016/0032-5910(92)88030-L;
 * Mindlin, J. Appl. Mech. 16 (1949) 259; Thornton, Cummins & Cleary, Powder Technol. 233 (2013)
 * 30, doi:10.1016/j.powtec.2012.08.012 (rescaling while unloading).
 */
#ifndef DEM_CONTACT_LAW_H
#define DEM_CONTACT_LAW_H

#include <math.h>
#include "dem.h"

#define DEM_INLINE static inline __attribute__((always_inline))

/* Coefficients of a pair of materials; see coefficient_of_pair(). */
typedef struct coefficient {
    double normal;     /* linear: k_n, N/m; Hertz: 4/3 E*, Pa */
    double tangential; /* linear: k_t, N/m; Hertz: 8 G*, Pa */
    double damping_n;  /* eta_n / sqrt(m k_n); linear: eta_t is the same */
    double damping_t;  /* Hertz: eta_t / sqrt(m k_t) */
    double friction;
} coefficient;

typedef struct contact {
    double nx, ny, nz; /* unit normal */
    double overlap;    /* m, > 0 */
    double vx, vy, vz; /* m/s, particle minus partner, at the contact point */
    double mass;       /* effective, kg */
    double radius;     /* effective, m; not used by the linear law */
    double steepness;  /* |grad phi| of a wall, 1 between particles */
} contact;

typedef struct spring {
    double x, y, z; /* elastic tangential force, N */
    double a;       /* contact radius when it was last summed, m; Hertz only */
} spring;

typedef struct contact_force {
    double x, y, z;    /* on the particle, N; the partner gets the opposite */
    double tx, ty, tz; /* its tangential part, N */
    double normal;     /* Fn, N, */
    double elastic;    /* and the elastic part of it */
    int slides;        /* Coulomb's limit is reached */
} contact_force;

/* Turn the spring into the tangent plane without changing its length. */
DEM_INLINE spring law_turn(spring s, double nx, double ny, double nz)
{
    double s2 = s.x * s.x + s.y * s.y + s.z * s.z;
    double p = s.x * nx + s.y * ny + s.z * nz;
    double left = s2 - p * p; /* squared length of the projection */
    double stretch = sqrt(s2 / left);
    stretch = left > 0 ? stretch : 0;
    s.x = (s.x - p * nx) * stretch;
    s.y = (s.y - p * ny) * stretch;
    s.z = (s.z - p * nz) * stretch;
    return s;
}

DEM_INLINE contact_force law_force(dem_law law, coefficient q, contact c, double dt, spring *s)
{
    double a = law == DEM_HERTZ ? sqrt(c.radius * c.overlap) : 1;
    double kn = q.normal * a, kt = q.tangential * a;
    double eta_n = q.damping_n * sqrt(c.mass * kn);
    double eta_t = law == DEM_HERTZ ? q.damping_t * sqrt(c.mass * kt) : eta_n;

    double elastic = kn * c.overlap * c.steepness;
    double vn = c.vx * c.nx + c.vy * c.ny + c.vz * c.nz;
    double fn = elastic - eta_n * vn;

    double vx = c.vx - vn * c.nx, vy = c.vy - vn * c.ny, vz = c.vz - vn * c.nz;
    spring t = law_turn(*s, c.nx, c.ny, c.nz);
    if (law == DEM_HERTZ) {
        double keep = a / t.a;
        keep = a < t.a ? keep : 1;
        t.x *= keep;
        t.y *= keep;
        t.z *= keep;
    }
    t.x -= kt * dt * vx;
    t.y -= kt * dt * vy;
    t.z -= kt * dt * vz;
    double fx = t.x - eta_t * vx, fy = t.y - eta_t * vy, fz = t.z - eta_t * vz;

    double f2 = fx * fx + fy * fy + fz * fz;
    double limit = q.friction * elastic;
    double back = limit / sqrt(f2);
    int slides = f2 > limit * limit;
    back = slides ? back : 1;
    fx *= back;
    fy *= back;
    fz *= back;
    s->x = slides ? fx : t.x;
    s->y = slides ? fy : t.y;
    s->z = slides ? fz : t.z;
    s->a = a;
    return (contact_force){fx + fn * c.nx, fy + fn * c.ny, fz + fn * c.nz, fx, fy, fz, fn,
                           elastic,        slides};
}

#endif
