/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * check.c - checks of parameters and of the state of particles, with messages for people.
 *
 * Every message names the value found and the values accepted.
 */
#include "check.h"

#include "halo.h"
#include "periodic.h"

#include "levels.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A contact may be as deep when it begins. At 2 the contact point passes the centre of the smaller
 * sphere and the law has lost its meaning; equal spheres are then at the same place, without a
 * direction to go apart. */
static const double most_overlap = 1.5;

/* Walls are not repeated beyond periodic sides: they must go on there by themselves. A sphere that
 * is carried over may find its deepest wall contact deeper or shallower by that share of its
 * radius, which surfaces of triangles may be off by; any more is an impact out of nothing. */
static const double most_jump = .1;

static const char axis[] = "xyz";

static dem_status check_domain(dem_sim *sim, const dem_param *param)
{
    for (int a = 0; a < 3; a++) {
        if (!isfinite(param->lo[a]) || !isfinite(param->hi[a]) || !(param->lo[a] < param->hi[a]))
            return fail(sim, DEM_BAD_ARGUMENT,
                        "domain: lo %g must be below hi %g in direction %c, both finite",
                        param->lo[a], param->hi[a], axis[a]);
        if (!isfinite(param->gravity[a]))
            return fail(sim, DEM_BAD_ARGUMENT, "gravity: component %c is %g, must be finite",
                        axis[a], param->gravity[a]);
    }
    if (param->law != DEM_LINEAR && param->law != DEM_HERTZ)
        return fail(sim, DEM_BAD_ARGUMENT, "contact law %d is none of linear (%d), hertz (%d)",
                    (int)param->law, DEM_LINEAR, DEM_HERTZ);
    if (param->rolling < DEM_ROLLING_NONE || param->rolling > DEM_ROLLING_EPSD)
        return fail(sim, DEM_BAD_ARGUMENT,
                    "rolling resistance %d is none of none (%d), constant (%d), epsd (%d)",
                    (int)param->rolling, DEM_ROLLING_NONE, DEM_ROLLING_CONSTANT, DEM_ROLLING_EPSD);
    if (param->cohesion != DEM_COHESION_NONE && param->cohesion != DEM_COHESION_SJKR)
        return fail(sim, DEM_BAD_ARGUMENT, "cohesion %d is none of none (%d), sjkr (%d)",
                    (int)param->cohesion, DEM_COHESION_NONE, DEM_COHESION_SJKR);
    return DEM_OK;
}

static dem_status check_numbers(dem_sim *sim, const dem_param *param)
{
    if (!(param->steps_per_period > M_PI) || !isfinite(param->steps_per_period))
        return fail(sim, DEM_BAD_ARGUMENT,
                    "steps per period %g must be above pi, the limit of stability; 20 is usual",
                    param->steps_per_period);
    if (!(param->time_step >= 0) || !isfinite(param->time_step))
        return fail(sim, DEM_BAD_ARGUMENT, "time step %g s must be >= 0 (0: automatic)",
                    param->time_step);
    if (!(param->fixed_step >= 0) || !isfinite(param->fixed_step))
        return fail(sim, DEM_BAD_ARGUMENT, "fixed step %g s must be >= 0 (0: chosen by the engine)",
                    param->fixed_step);
    if (!(param->impact_speed >= 0) || !isfinite(param->impact_speed))
        return fail(sim, DEM_BAD_ARGUMENT, "impact speed %g m/s must be >= 0", param->impact_speed);
    if (!(param->imbalance > 1) || !isfinite(param->imbalance))
        return fail(sim, DEM_BAD_ARGUMENT,
                    "imbalance %g must be > 1 (work of the busiest rank over the mean; 1.1 is "
                    "usual)",
                    param->imbalance);
    if (!(param->skin > 0) || !isfinite(param->skin))
        return fail(sim, DEM_BAD_ARGUMENT,
                    "skin %g must be > 0 (fraction of the largest diameter; .15 is usual)",
                    param->skin);
    return DEM_OK;
}

static dem_status check_material(dem_sim *sim, const dem_param *param, const dem_material *m)
{
    if (!(m->density > 0) || !isfinite(m->density))
        return fail(sim, DEM_BAD_ARGUMENT, "material %s: density %g kg/m3 must be > 0", m->name,
                    m->density);
    if (param->law != DEM_HERTZ) return DEM_OK;
    if (!(m->youngs_modulus > 0) || !isfinite(m->youngs_modulus))
        return fail(sim, DEM_BAD_ARGUMENT, "material %s: Young's modulus %g Pa must be > 0",
                    m->name, m->youngs_modulus);
    if (!(m->poisson_ratio > -1) || !(m->poisson_ratio <= .5))
        return fail(sim, DEM_BAD_ARGUMENT, "material %s: Poisson's ratio %g must be in (-1, .5]",
                    m->name, m->poisson_ratio);
    return DEM_OK;
}

static dem_status check_pair(dem_sim *sim, const dem_param *param, size_t a, size_t b)
{
    const dem_pair *pair = &param->pair[a * param->n_material + b];
    const dem_pair *other = &param->pair[b * param->n_material + a];
    const char *na = param->material[a].name, *nb = param->material[b].name;
    if (!(pair->restitution > 0) || !(pair->restitution <= 1))
        return fail(sim, DEM_BAD_ARGUMENT, "contact %s-%s: restitution %g must be in (0, 1]", na,
                    nb, pair->restitution);
    if (!(pair->friction >= 0) || !isfinite(pair->friction))
        return fail(sim, DEM_BAD_ARGUMENT, "contact %s-%s: friction %g must be >= 0", na, nb,
                    pair->friction);
    if (param->law == DEM_LINEAR) {
        if (!(pair->stiffness > 0) || !isfinite(pair->stiffness))
            return fail(sim, DEM_BAD_ARGUMENT, "contact %s-%s: stiffness %g N/m must be > 0", na,
                        nb, pair->stiffness);
        if (!(pair->stiffness_ratio > 0) || !isfinite(pair->stiffness_ratio))
            return fail(sim, DEM_BAD_ARGUMENT, "contact %s-%s: stiffness ratio %g must be > 0", na,
                        nb, pair->stiffness_ratio);
    }
    const double extra[] = {pair->rolling_friction, pair->rolling_damping, pair->cohesion};
    const char *what[] = {"rolling friction", "rolling damping", "cohesion energy density"};
    for (int k = 0; k < 3; k++)
        if (!(extra[k] >= 0) || !isfinite(extra[k]))
            return fail(sim, DEM_BAD_ARGUMENT, "contact %s-%s: %s %g must be >= 0", na, nb, what[k],
                        extra[k]);
    if (pair->rolling_friction != other->rolling_friction ||
        pair->rolling_damping != other->rolling_damping || pair->cohesion != other->cohesion ||
        pair->restitution != other->restitution || pair->friction != other->friction ||
        pair->stiffness != other->stiffness || pair->stiffness_ratio != other->stiffness_ratio)
        return fail(sim, DEM_BAD_ARGUMENT, "contact %s-%s differs from contact %s-%s", na, nb, nb,
                    na);
    return DEM_OK;
}

static dem_status check_parts(dem_sim *sim, const dem_param *param)
{
    for (size_t w = 0; w < param->n_wall; w++) {
        const dem_wall *wall = &param->wall[w];
        if (!wall->shape) return fail(sim, DEM_BAD_ARGUMENT, "wall %s has no shape", wall->name);
        if (wall->material < 0 || (size_t)wall->material >= param->n_material)
            return fail(sim, DEM_BAD_ARGUMENT, "wall %s: material %d is none of the %zu",
                        wall->name, wall->material, param->n_material);
        if (wall->n_motion && !wall->motion)
            return fail(sim, DEM_BAD_ARGUMENT, "wall %s: its %zu motions are missing", wall->name,
                        wall->n_motion);
        for (size_t k = 0; k < wall->n_motion; k++) {
            char why[256];
            if (motion_check(&wall->motion[k], why, sizeof why))
                return fail(sim, DEM_BAD_ARGUMENT, "wall %s, motion %zu: %s", wall->name, k + 1,
                            why);
        }
        for (int a = 0; a < 3; a++)
            if (!isfinite(wall->centre[a]))
                return fail(sim, DEM_BAD_ARGUMENT, "wall %s: its centre must be finite",
                            wall->name);
    }
    for (size_t k = 0; k < param->n_insertion; k++) {
        const dem_insertion *ins = &param->insertion[k];
        if (ins->n_species > 0) continue; /* looked at where they are drawn */
        if (ins->material < 0 || (size_t)ins->material >= param->n_material)
            return fail(sim, DEM_BAD_ARGUMENT, "insertion %s: material %d is none of the %zu",
                        ins->name, ins->material, param->n_material);
        if (!(ins->diameter > 0) || !isfinite(ins->diameter))
            return fail(sim, DEM_BAD_ARGUMENT, "insertion %s: diameter %g m must be > 0", ins->name,
                        ins->diameter);
    }
    return DEM_OK;
}

dem_status check_param(dem_sim *sim, const dem_param *param)
{
    dem_status status = check_domain(sim, param);
    if (!status) status = check_numbers(sim, param);
    if (status) return status;
    if (param->n_material && (!param->material || !param->pair))
        return fail(sim, DEM_BAD_ARGUMENT, "materials or their contacts are missing");
    for (size_t a = 0; a < param->n_material && !status; a++)
        status = check_material(sim, param, &param->material[a]);
    for (size_t a = 0; a < param->n_material && !status; a++)
        for (size_t b = 0; b < param->n_material && !status; b++)
            status = check_pair(sim, param, a, b);
    return status ? status : check_parts(sim, param);
}

static int finite3(const double x[3])
{
    return isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]);
}

dem_status check_particle(dem_sim *sim, size_t k, const double x[3], const double v[3],
                          const double omega[3], double radius, int material)
{
    if (!finite3(x) || (v && !finite3(v)) || (omega && !finite3(omega)))
        return fail(sim, DEM_NAN,
                    "particle %zu to be added: position (%g %g %g) or velocity is "
                    "not finite",
                    k, x[0], x[1], x[2]);
    if (!(radius > 0) || !isfinite(radius))
        return fail(sim, DEM_BAD_ARGUMENT, "particle %zu to be added: radius %g m must be > 0", k,
                    radius);
    if (material < 0 || material >= sim->n_material)
        return fail(sim, DEM_BAD_ARGUMENT,
                    "particle %zu to be added: material %d is none of the "
                    "%d",
                    k, material, sim->n_material);
    for (int a = 0; a < 3; a++)
        if (x[a] < sim->lo[a] || x[a] > sim->hi[a])
            return fail(sim, DEM_LOST,
                        "particle %zu to be added at (%g %g %g) lies outside the domain: %c from "
                        "%g to %g",
                        k, x[0], x[1], x[2], axis[a], sim->lo[a], sim->hi[a]);
    return DEM_OK;
}

static dem_status tell(dem_sim *sim, dem_status status, size_t i, const char *what)
{
    const particles *p = &sim->particles;
    const double *x = p->pos[i], *v = p->vel[i], *f = p->last[i];
    return fail(sim, status,
                "particle %lld %s at time %g: position (%g %g %g), velocity (%g %g %g), last "
                "force (%g %g %g) N",
                (long long)p->id[i], what, sim->time, x[0], x[1], x[2], v[0], v[1], v[2], f[0],
                f[1], f[2]);
}

dem_status check_finite(dem_sim *sim)
{
    const particles *p = &sim->particles;
    for (size_t i = 0; i < p->n; i++)
        if (!finite3(p->pos[i]) || !finite3(p->vel[i]) || !finite3(p->vel[i] + 4))
            return tell(sim, DEM_NAN, i, "has a state that is not finite");
    return DEM_OK;
}

dem_status check_inside(dem_sim *sim)
{
    const particles *p = &sim->particles;
    for (size_t i = 0; i < p->n; i++)
        for (int a = 0; a < 3; a++)
            if (!sim->periodic[a] && (p->pos[i][a] < sim->lo[a] || p->pos[i][a] > sim->hi[a]))
                return tell(sim, DEM_LOST, i, "has left the domain");
    return DEM_OK;
}

/* A particle that is about to be brought from `from` back to `to`. */
static dem_status check_jump(dem_sim *sim, size_t i, const double from[4], const double to[4])
{
    size_t wall = 0;
    double before = walls_deepest(&sim->walls, from, &wall);
    double after = walls_deepest(&sim->walls, to, before > 0 ? NULL : &wall);
    if (fabs(after - before) <= most_jump) return DEM_OK;
    return fail(sim, DEM_BAD_ARGUMENT,
                "wall %s does not go on beyond a periodic side: particle %lld, carried from (%g %g "
                "%g) to (%g %g %g), would overlap with walls by %g of its radius instead of %g; "
                "walls are not repeated, make its shape periodic",
                sim->walls.wall[wall].name, (long long)sim->particles.id[i], from[0], from[1],
                from[2], to[0], to[1], to[2], after, before);
}

dem_status check_crossing(dem_sim *sim)
{
    const particles *p = &sim->particles;
    if (!sim->walls.n || !sim->list.any_periodic) return DEM_OK;
    for (size_t i = 0; i < p->n; i++) {
        double to[4];
        int crosses = 0;
        memcpy(to, p->pos[i], sizeof to);
        for (int a = 0; a < 3; a++) {
            if (!sim->periodic[a]) continue;
            double length = sim->hi[a] - sim->lo[a], turns = floor((to[a] - sim->lo[a]) / length);
            to[a] -= turns * length;
            crosses |= turns != 0;
        }
        dem_status status = crosses ? check_jump(sim, i, p->pos[i], to) : DEM_OK;
        if (status) return status;
    }
    return DEM_OK;
}

dem_status check_range(dem_sim *sim, double largest_radius)
{
    double range = 2 * largest_radius * (1 + sim->skin);
    for (int a = 0; a < 3; a++)
        if (sim->periodic[a] && sim->hi[a] - sim->lo[a] < 2 * range)
            return fail(sim, DEM_BAD_ARGUMENT,
                        "periodic domain: length %g m in direction %c must be at least %g m, "
                        "twice the largest diameter plus skin",
                        sim->hi[a] - sim->lo[a], axis[a], 2 * range);
    return DEM_OK;
}

/* ---- overlaps -------------------------------------------------------------------------------- */

typedef struct deepest {
    const double (*pos)[4];
    double overlap; /* in smaller radii */
} deepest;

static int look_at_pair(void *context, uint32_t i, uint32_t j, const double d[3], double d2)
{
    (void)d;
    deepest *deep = context;
    double ri = deep->pos[i][3], rj = deep->pos[j][3];
    deep->overlap = fmax(deep->overlap, (ri + rj - sqrt(d2)) / fmin(ri, rj));
    return deep->overlap > most_overlap ? (int)j + 1 : 0;
}

/* A sphere that is looked at: present, label = id, or to be added, label = -1 - place. */
typedef struct crowd {
    size_t n;
    double (*pos)[4];
    int64_t *label;
} crowd;

/* "particle 17", or by its place among those to be added. */
static const char *name_of(int64_t label, char name[64])
{
    const int64_t given = -1 - label;
    const long long at = given & (((int64_t)1 << LABEL_BITS) - 1), by = given >> LABEL_BITS;
    char rank[32] = "";
    if (by > 0) snprintf(rank, sizeof rank, " by rank %lld", by);
    if (label >= 0)
        snprintf(name, 64, "particle %lld", (long long)label);
    else
        snprintf(name, 64, "particle %lld to be added%s", at, rank);
    return name;
}

static dem_status refuse_pair(dem_sim *sim, const crowd *all, size_t i, size_t j,
                              const deepest *deep)
{
    char one[64], two[64];
    size_t a = i > j ? i : j, b = i > j ? j : i; /* the later one first */
    const double *x = deep->pos[a], *y = deep->pos[b];
    return fail(sim, DEM_BAD_ARGUMENT,
                "%s at (%g %g %g), radius %g m, and %s at (%g %g %g), radius %g m, overlap by %g "
                "times the smaller radius, must be at most %g",
                name_of(all->label[a], one), x[0], x[1], x[2], x[3], name_of(all->label[b], two),
                y[0], y[1], y[2], y[3], deep->overlap, most_overlap);
}

static dem_status look_at_all(dem_sim *sim, const crowd *all, deepest *deep)
{
    levels g;
    dem_status status = levels_init(&g, sim->lo, sim->hi, sim->periodic, all->n, deep->pos, 0);
    if (status) return fail(sim, status, "out of memory with %zu particles", all->n);
    for (size_t i = 0; i < all->n && !status; i++) {
        int j = levels_partners(&g, (uint32_t)i, look_at_pair, deep) - 1;
        if (j >= 0) status = refuse_pair(sim, all, i, (size_t)j, deep);
    }
    levels_free(&g);
    return status;
}

/* Those present here and the n to be added, wrapped. */
static dem_status gather_own(dem_sim *sim, size_t n, const double (*x)[3], const double *radius,
                             const int64_t *label, crowd *all)
{
    const particles *p = &sim->particles;
    all->n = p->n + n;
    all->pos = malloc((all->n + 1) * sizeof *all->pos);
    all->label = malloc((all->n + 1) * sizeof *all->label);
    if (!all->pos || !all->label)
        return fail(sim, DEM_NO_MEMORY, "out of memory with %zu particles", all->n);
    for (size_t i = 0; i < all->n; i++) {
        const size_t k = i - p->n;
        double *pos = all->pos[i];
        memcpy(pos, i < p->n ? p->pos[i] : x[k], 3 * sizeof(double));
        pos[3] = i < p->n ? p->radius[i] : radius[k];
        all->label[i] = i < p->n ? p->id[i] : label ? label[k] : -(int64_t)k - 1;
        wrap_into(pos, sim->lo, sim->hi, sim->periodic);
    }
    return DEM_OK;
}

dem_status check_overlaps(dem_sim *sim, size_t n, const double (*x)[3], const double *radius,
                          const int64_t *label, double largest_radius, double *largest)
{
    crowd all = {0};
    dem_status status = gather_own(sim, n, x, radius, label, &all);
    const size_t own = all.n;
    status = halo_spheres(sim, status, largest_radius, &all.n, &all.pos, &all.label);
    if (!status) {
        deepest deep = {(const double(*)[4])all.pos, 0};
        status = look_at_all(sim, &all, &deep);
        *largest = fmax(deep.overlap, walls_overlap(&sim->walls, own, deep.pos));
    }
    free(all.pos);
    free(all.label);
    status = agree(sim, status);
    max_reals(sim, largest, 1);
    return status;
}
