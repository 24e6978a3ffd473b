/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * time_step.c - limits on the time step.
 *
 * Linear law: dt <= 2 pi sqrt(m/k)/Omega with the smallest mass and the stiffest partner it may
 * meet, particle or wall (thesis, section 2.1.1(3)).
 *
 * Hertz: two contact times, which is the period of the half oscillation, over Omega. The time of
 * an elastic contact at the speed v is 2.943275 d_max/v (Hertz; 2.943275 = 4 sqrt(pi)/5
 * Gamma(2/5)/Gamma(9/10)), with d_max = (15 m v^2/(16 E* sqrt R))^(2/5). v is the largest of
 * twice the speed of the fastest particle, the speed gained falling by a diameter, sqrt(|g| d),
 * param.impact_speed, and the speed that the largest overlap present stands for: the one at which
 * it would be d_max, and at which it drives its spheres apart. Without any of them, with nothing
 * that moves, falls or touches, the Rayleigh limit takes its place.
 *
 * Rayleigh: .2 of pi r sqrt(rho/G)/(.1631 nu + .8766) (Ning, doctoral thesis, Aston 1995; Y. Li et
 * al., Powder Technol. 149 (2005) 75).
 */
#include "time_step.h"

#include <math.h>

#define HERTZ_TIME 2.943275

typedef struct smallest {
    double mass, radius; /* of a material's particles; infinite if there are none */
} smallest;

static double linear_limit(const dem_sim *sim, int a, int b, smallest s)
{
    double k = sim->pair[a * sim->n_material + b].stiffness;
    return 2 * M_PI * sqrt(s.mass / k) / sim->steps_per_period;
}

/* The largest overlap is known as a share of the smaller radius, but not whose it is. Of pairs with
 * the same share the smallest spheres have the shortest contact, which goes with the radius.
 * Against a wall the partner's mass and radius are infinite. */
static double hertz_limit(const dem_sim *sim, int a, int b, smallest s, smallest t, double speed)
{
    double mass = 1 / (1 / s.mass + 1 / t.mass), radius = 1 / (1 / s.radius + 1 / t.radius);
    double modulus = effective_modulus(&sim->material[a], &sim->material[b]);
    double spring = 16 * modulus * sqrt(radius) / 15; /* m v^2 = spring d_max^2.5 */
    double present = sim->overlap * fmin(s.radius, t.radius);
    speed = fmax(speed, sqrt(spring / mass) * pow(present, 1.25));
    double overlap = pow(mass * speed * speed / spring, .4);
    return 2 * HERTZ_TIME * overlap / speed / sim->steps_per_period;
}

static double rayleigh_limit(const dem_material *m, smallest s)
{
    double shear = m->youngs_modulus / (2 * (1 + m->poisson_ratio));
    return .2 * M_PI * s.radius * sqrt(m->density / shear) / (.1631 * m->poisson_ratio + .8766);
}

static double impact_speed(const dem_sim *sim)
{
    const double *g = sim->gravity;
    double fall = sqrt(sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * 2 *
                       fmax(sim->largest_radius, sim->coming_radius));
    return fmax(fmax(2 * fmax(sim->speed, sim->coming_speed), fall), sim->impact_speed);
}

/* Limit of particles of material a that meet particles of b, or, if s_b is infinite, a wall. */
static double meet(const dem_sim *sim, int a, int b, smallest s, smallest t, double speed)
{
    if (sim->law == DEM_LINEAR) return linear_limit(sim, a, b, s);
    return speed > 0 || sim->overlap > 0 ? hertz_limit(sim, a, b, s, t, speed) : INFINITY;
}

dem_limits time_limits(const dem_sim *sim)
{
    const smallest none = {INFINITY, INFINITY};
    dem_limits l = {.contact = INFINITY, .rayleigh = INFINITY, .wall = INFINITY, .skin = INFINITY};
    l.user = sim->time_step > 0 ? sim->time_step : INFINITY;
    double speed = impact_speed(sim);
    for (int a = 0; a < sim->n_material; a++) {
        smallest s = {sim->smallest_mass[a], sim->smallest_radius[a]};
        if (!isfinite(s.mass)) continue;
        for (int b = 0; b < sim->n_material; b++) {
            smallest t = {sim->smallest_mass[b], sim->smallest_radius[b]};
            if (isfinite(t.mass)) l.contact = fmin(l.contact, meet(sim, a, b, s, t, speed));
        }
        for (size_t w = 0; w < sim->walls.n; w++)
            l.contact = fmin(l.contact, meet(sim, a, sim->walls.wall[w].material, s, none, speed));
        if (sim->law == DEM_HERTZ)
            l.rayleigh = fmin(l.rayleigh, rayleigh_limit(&sim->material[a], s));
    }
    if (sim->law == DEM_HERTZ && !(speed > 0) && !(sim->overlap > 0))
        l.contact = l.rayleigh;
    l.step = fmin(l.contact, l.user);
    return l;
}
