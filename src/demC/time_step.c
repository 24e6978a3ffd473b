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
 * twice the speed of the fastest particle or wall, the speed gained falling by a diameter, sqrt(|g|
 * d), param.impact_speed, and the speed that the largest overlap present stands for: the one at
 * which it would be d_max, and at which it drives its spheres apart. Without any of them, with
 * nothing that moves, falls or touches, the Rayleigh limit takes its place.
 *
 * Elastic-plastic rolling: 2 pi sqrt(I/k_r)/Omega with the effective inertia, less for its damping.
 *
 * No contact is let come nearer than nine tenths to where it gets unstable. A mode with the
 * stiffness s^2 and the damping c, both over the inertia, has with symplectic Euler the multipliers
 * z^2 - (2 - s^2 h^2 - c h) z + 1 - c h = 0, within the unit circle for s^2 h^2 + 2 c h < 4:
 *
 *     h < (sqrt(c^2 + 4 s^2) - c)/s^2
 *
 * Modes of one contact: normal, k and eta over the effective mass (Hertz: 3/2 k_n, the slope);
 * tangential, k_t and eta_t times 7/2 over it, since m r^2/I = 5/2 for both spheres; rolling, k_r
 * and its dashpot over the effective inertia. A given number of sub-steps is refused beyond it.
 *
 * In a bed at rest a sphere has some six contacts that stick. A spin is tangential to two thirds of
 * them, and where neighbours spin alike the surfaces meet twice as fast: 6 2/3 5/2 2 k_t/m = 10
 * k_t over the effective mass of equal spheres, not 7/2. With the linear law, whose stiffness is
 * that of an impact also at rest, the engine's own step obeys this bound too: at a restitution of
 * .5 a twentieth of the period is beyond it, and a heap then shivers and creeps for ever. It bites
 * below a restitution of about .7. Hertz's contacts are far softer at rest than in an impact.
 *
 * The step the engine chooses shrinks with its limit at once, but grows only when the limit is
 * GROWTH times as large. In a Hertz impact of one sphere with a wall the limit rises to 1.175 of
 * what it was and falls again; a step that followed it, a little late and, in advances of a few
 * steps, by whole numbers, would be another on the way out than on the way in, and what is
 * symplectic only with an even step gained or lost some percent of the energy in every impact.
 *
 * Rayleigh: .2 of pi r sqrt(rho/G)/(.1631 nu + .8766) (Ning, doctoral thesis, Aston 1995; Y. Li et
 * al., Powder Technol. 149 (2005) 75).
 */
#include "time_step.h"

#include <math.h>

#define HERTZ_TIME 2.943275
#define GROWTH     1.25 /* above the 1.175 of an impact, and not much above: steps cost time */

typedef struct smallest {
    double mass, radius; /* of a material's particles; infinite if there are none */
} smallest;

/* Two that meet, and the stiffest that their contact gets. */
typedef struct encounter {
    int pair;
    int among;                    /* particles, not with a wall */
    double mass, radius, inertia; /* effective */
    double period;                /* of the half oscillation, s */
    double normal, slope;         /* k_n as a secant, and dF/dd, N/m */
    double tangential, rolling;   /* k_t, N/m, and k_r, N m */
} encounter;

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
    double fastest = fmax(fmax(sim->speed, sim->coming_speed), walls_speed(&sim->walls, sim->time));
    return fmax(fmax(2 * fastest, fall), sim->impact_speed);
}

static smallest smallest_of(const dem_sim *sim, int material)
{
    return (smallest){sim->smallest_mass[material], sim->smallest_radius[material]};
}

/* The largest overlap is known as a share of the smaller radius, but not whose it is. Of pairs with
 * the same share the smallest spheres have the shortest contact, which goes with the radius.
 * Against a wall the partner's mass and radius are infinite. */
static void meet_hertz(const dem_sim *sim, smallest s, smallest t, encounter *e)
{
    double normal = sim->table[e->pair].normal;    /* 4/3 E* */
    double spring = .8 * normal * sqrt(e->radius); /* m v^2 = spring d_max^2.5 */
    double present = sim->overlap * fmin(s.radius, t.radius);
    double speed = fmax(impact_speed(sim), sqrt(spring / e->mass) * pow(present, 1.25));
    e->period = INFINITY;
    if (!(speed > 0)) return;
    double overlap = pow(e->mass * speed * speed / spring, .4), a = sqrt(e->radius * overlap);
    e->period = 2 * HERTZ_TIME * overlap / speed;
    e->normal = normal * a;
    e->slope = 1.5 * e->normal;
    e->tangential = sim->table[e->pair].tangential * a;
}

/* Particles of material a meet particles of b, or, where t is infinite, a wall of it. */
static encounter meet(const dem_sim *sim, int a, int b, smallest s, smallest t)
{
    encounter e = {.pair = a * sim->n_material + b,
                   .among = isfinite(t.mass),
                   .mass = 1 / (1 / s.mass + 1 / t.mass),
                   .radius = 1 / (1 / s.radius + 1 / t.radius)};
    e.inertia = .4 / (1 / (s.mass * s.radius * s.radius) + 1 / (t.mass * t.radius * t.radius));
    if (sim->law == DEM_HERTZ)
        meet_hertz(sim, s, t, &e);
    else {
        e.normal = e.slope = sim->table[e.pair].normal;
        e.tangential = sim->table[e.pair].tangential;
        e.period = 2 * M_PI * sqrt(fmin(s.mass, t.mass) / e.normal);
    }
    if (sim->extras.rolling == DEM_ROLLING_EPSD)
        e.rolling = rolling_stiffness(sim->resistance[e.pair], e.normal, e.radius);
    return e;
}

/* Largest stable step of a mode: s2 and c over the inertia. */
static double stable(double s2, double c)
{
    return s2 > 0 ? (sqrt(c * c + 4 * s2) - c) / s2 : INFINITY;
}

/* Of one contact; tangential: factor of the tangential mode over the effective mass. */
static double stable_with(const dem_sim *sim, const encounter *e, double tangential)
{
    const coefficient q = sim->table[e->pair];
    double eta_n = q.damping_n * sqrt(e->mass * e->normal), eta_t = eta_n;
    if (sim->law == DEM_HERTZ) eta_t = q.damping_t * sqrt(e->mass * e->tangential);
    double eta_r = 2 * sim->resistance[e->pair].damping * sqrt(3.5 * e->inertia * e->rolling);
    double step = stable(e->slope / e->mass, eta_n / e->mass);
    if (q.friction > 0)
        step =
            fmin(step, stable(tangential * e->tangential / e->mass, tangential * eta_t / e->mass));
    return fmin(step, stable(e->rolling / e->inertia, eta_r / e->inertia));
}

static double stable_step(const dem_sim *sim, const encounter *e)
{
    return stable_with(sim, e, 3.5);
}

static double contact_step(const dem_sim *sim, const encounter *e)
{
    double period = e->period;
    if (e->rolling > 0) {
        double share = sqrt(3.5) * sim->resistance[e->pair].damping; /* of critical */
        double own = 2 * M_PI * sqrt(e->inertia / e->rolling);
        period = fmin(period, own * (sqrt(1 + share * share) - share));
    }
    int crowd = e->among && sim->law == DEM_LINEAR;
    return fmin(period / sim->steps_per_period, .9 * stable_with(sim, e, crowd ? 10 : 3.5));
}

typedef double limit_of(const dem_sim *sim, const encounter *e);

/* Smallest limit of what particles of a and particles and walls of b do to each other. */
static double one_way(const dem_sim *sim, int a, int b, limit_of *limit)
{
    const smallest none = {INFINITY, INFINITY}, s = smallest_of(sim, a), t = smallest_of(sim, b);
    double least = INFINITY;
    if (!isfinite(s.mass)) return least;
    if (isfinite(t.mass)) {
        encounter e = meet(sim, a, b, s, t);
        least = limit(sim, &e);
    }
    int wall = 0;
    for (size_t w = 0; w < sim->walls.n; w++) wall |= sim->walls.wall[w].material == b;
    if (wall) {
        encounter e = meet(sim, a, b, s, none);
        least = fmin(least, limit(sim, &e));
    }
    return least;
}

static double pair_step(const dem_sim *sim, int a, int b, limit_of *limit)
{
    return fmin(one_way(sim, a, b, limit), one_way(sim, b, a, limit));
}

/* The smallest of all pairs, and whose it is. */
static double least_step(const dem_sim *sim, limit_of *limit, int *a, int *b)
{
    double least = INFINITY;
    *a = *b = 0;
    for (int i = 0; i < sim->n_material; i++)
        for (int j = i; j < sim->n_material; j++) {
            double step = pair_step(sim, i, j, limit);
            if (!(step < least)) continue;
            least = step;
            *a = i;
            *b = j;
        }
    return least;
}

void pair_limits(const dem_sim *sim, int a, int b, double *contact, double *rayleigh)
{
    *contact = pair_step(sim, a, b, contact_step);
    *rayleigh = INFINITY;
    if (sim->law != DEM_HERTZ) return;
    for (int k = 0; k < 2; k++) {
        int one = k ? b : a, other = k ? a : b;
        smallest s = smallest_of(sim, one);
        int met = isfinite(s.mass) && isfinite(smallest_of(sim, other).mass);
        for (size_t w = 0; w < sim->walls.n; w++)
            met |= isfinite(s.mass) && sim->walls.wall[w].material == other;
        if (met) *rayleigh = fmin(*rayleigh, rayleigh_limit(&sim->material[one], s));
    }
}

dem_limits time_limits(const dem_sim *sim)
{
    int a, b;
    dem_limits l = {.rayleigh = INFINITY, .wall = INFINITY, .skin = INFINITY};
    l.user = sim->time_step > 0 ? sim->time_step : INFINITY;
    l.contact = least_step(sim, contact_step, &a, &b);
    double smallest_radius = INFINITY;
    for (int m = 0; m < sim->n_material; m++) {
        smallest s = smallest_of(sim, m);
        smallest_radius = fmin(smallest_radius, s.radius);
        if (sim->law == DEM_HERTZ && isfinite(s.mass))
            l.rayleigh = fmin(l.rayleigh, rayleigh_limit(&sim->material[m], s));
    }
    if (sim->law == DEM_HERTZ && !(impact_speed(sim) > 0) && !(sim->overlap > 0))
        l.contact = l.rayleigh;
    double wall = walls_speed(&sim->walls, sim->time);
    if (wall > 0) l.wall = .1 * smallest_radius / wall;
    if (sim->speed > 0) l.skin = sim->skin * sim->median_radius / sim->speed;
    l.step = fmin(fmin(l.contact, l.wall), l.user);
    if (l.step > sim->held_step && l.step <= GROWTH * sim->held_step) l.step = sim->held_step;
    if (sim->fixed_step > 0) l.step = sim->fixed_step;
    return l;
}

dem_status check_fixed_step(dem_sim *sim)
{
    const dem_limits l = time_limits(sim);
    double step = sim->fixed_step * (1 - 1e-12);
    int a, b;
    least_step(sim, contact_step, &a, &b);
    if (step > l.contact)
        return fail(sim, DEM_BAD_ARGUMENT,
                    "the fixed step %g s is above the contact limit %g s of %s and %s (%g steps a "
                    "period): fix a smaller one, let the engine choose, or make the contact softer",
                    sim->fixed_step, l.contact, sim->material[a].name, sim->material[b].name,
                    sim->steps_per_period);
    if (step > l.wall)
        return fail(sim, DEM_BAD_ARGUMENT,
                    "the fixed step %g s is above the wall limit %g s, in which the fastest wall "
                    "moves by a tenth of the smallest radius: fix a smaller one, or let the engine "
                    "choose",
                    sim->fixed_step, l.wall);
    return DEM_OK;
}

dem_status choose_substeps(dem_sim *sim, double dt, int *substeps)
{
    int a, b;
    dem_status status = check_cohesion(sim);
    if (status) return status;
    if (*substeps) {
        if (sim->total < 2 && !sim->walls.n && !sim->feeders.n) return DEM_OK; /* none meet */
        double bound = least_step(sim, stable_step, &a, &b);
        if (dt / *substeps <= bound) return DEM_OK;
        return fail(sim, DEM_BAD_ARGUMENT,
                    "%d sub-steps of %g s: contacts of %s and %s are unstable above %g s; at least "
                    "%.0f sub-steps are needed for %g s, or 0 for the engine to choose",
                    *substeps, dt / *substeps, sim->material[a].name, sim->material[b].name, bound,
                    ceil(dt / bound), dt);
    }
    if (sim->fixed_step > 0 && (status = check_fixed_step(sim))) return status;
    /* A ratio that is whole but for rounding must not cost a step more. */
    sim->held_step = time_limits(sim).step;
    double least = ceil(dt / sim->held_step * (1 - 1e-12));
    if (least > 2147483647.)
        return fail(sim, DEM_BAD_ARGUMENT, "time step %g s needs %g sub-steps", dt, least);
    *substeps = least > 1 ? (int)least : 1;
    return DEM_OK;
}

dem_status check_cohesion(dem_sim *sim)
{
    if (sim->extras.cohesion != DEM_COHESION_SJKR || sim->law != DEM_LINEAR) return DEM_OK;
    double largest = fmax(sim->largest_radius, sim->coming_radius);
    for (int a = 0; a < sim->n_material; a++)
        for (int b = a; b < sim->n_material; b++) {
            /* attraction 2 pi kappa R d for small overlaps; R is the radius itself at a wall */
            int wall = 0, pair = a * sim->n_material + b;
            for (size_t w = 0; w < sim->walls.n; w++)
                wall |= sim->walls.wall[w].material == a || sim->walls.wall[w].material == b;
            double radius = wall ? largest : .5 * largest;
            double attraction = 2 * M_PI * sim->pair[pair].cohesion * radius;
            if (attraction < sim->pair[pair].stiffness) continue;
            return fail(sim, DEM_BAD_ARGUMENT,
                        "contact %s-%s: cohesion %g J/m3 attracts spheres of the radius %g m by %g "
                        "N/m, more than the spring of %g N/m pushes: they would sink into each "
                        "other; make it stiffer or take the hertz law",
                        sim->material[a].name, sim->material[b].name, sim->pair[pair].cohesion,
                        largest, attraction, sim->pair[pair].stiffness);
        }
    return DEM_OK;
}
