/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall.c - contact of particles with walls given by signed distance functions.
 *
 * A wall consists of smooth parts; each makes its own contact with its own history. With phi the
 * signed distance of the centre x and n = grad phi/|grad phi|:
 *
 *     overlap d = r - phi > 0,  F_n = k d grad phi - eta v_n n,  contact point x - phi n,
 *     effective radius r, effective mass m
 *
 * |grad phi| is kept in the elastic force so that it is the gradient of an energy k d^2/2 even
 * where phi is not quite a distance (a sampled one).
 *
 * When the neighbour list is built the particles that are nearer to a part than the margin they
 * may move are listed; the others need no look at the wall until the next build. The list is
 * sorted by (particle, wall, part), which is also the order of the sums.
 */
#include "wall.h"

#include <stdlib.h>
#include <string.h>

dem_status walls_init(walls *w, size_t n, const dem_wall *wall)
{
    memset(w, 0, sizeof *w);
    if (!n) return DEM_OK;
    w->wall = malloc(n * sizeof *w->wall);
    w->force = calloc(n, sizeof *w->force);
    if (!w->wall || !w->force) return DEM_NO_MEMORY;
    memcpy(w->wall, wall, n * sizeof *w->wall);
    w->n = n;
    return DEM_OK;
}

void walls_free(walls *w, int free_shapes)
{
    for (size_t k = 0; free_shapes && k < w->n; k++) dem_sdf_free(w->wall[k].shape);
    free(w->wall);
    free(w->force);
    free(w->entry);
    free(w->before);
    memset(w, 0, sizeof *w);
}

static int by_particle(const void *left, const void *right)
{
    const wall_entry *a = left, *b = right;
    if (a->particle != b->particle) return a->particle < b->particle ? -1 : 1;
    if (a->wall != b->wall) return a->wall < b->wall ? -1 : 1;
    return (a->part > b->part) - (a->part < b->part);
}

/* Put the touching entries aside, under the new places of their particles, in order. */
static dem_status set_aside(walls *w, const uint32_t *place)
{
    w->n_before = 0;
    if (w->n_entry > w->before_capacity) {
        wall_entry *grown = realloc(w->before, w->capacity * sizeof *grown);
        if (!grown) return DEM_NO_MEMORY;
        w->before = grown;
        w->before_capacity = w->capacity;
    }
    for (size_t k = 0; k < w->n_entry; k++) {
        if (!w->entry[k].touch) continue;
        wall_entry *old = &w->before[w->n_before++];
        *old = w->entry[k];
        if (place) old->particle = place[old->particle];
    }
    if (w->n_before) qsort(w->before, w->n_before, sizeof *w->before, by_particle);
    return DEM_OK;
}

static dem_status append(walls *w, const wall_entry *entry)
{
    if (w->n_entry == w->capacity) {
        size_t room = w->capacity ? 2 * w->capacity : 256;
        wall_entry *grown = realloc(w->entry, room * sizeof *grown);
        if (!grown) return DEM_NO_MEMORY;
        w->entry = grown;
        w->capacity = room;
    }
    w->entry[w->n_entry++] = *entry;
    return DEM_OK;
}

dem_status walls_list(walls *w, const particles *p, double margin, const uint32_t *place)
{
    dem_status status = set_aside(w, place);
    if (status) return status;
    w->n_entry = 0;
    size_t old = 0;
    for (size_t i = 0; i < p->n; i++)
        for (size_t k = 0; k < w->n; k++) {
            int parts = dem_sdf_parts(w->wall[k].shape);
            for (int part = 0; part < parts; part++) {
                double gradient[3];
                double phi = dem_sdf_eval(w->wall[k].shape, part, p->pos[i], gradient);
                if (!(phi < p->pos[i][3] + margin)) continue;
                wall_entry e = {{0, 0, 0, 0}, (uint32_t)i, (int)k, part, 0};
                while (old < w->n_before && by_particle(&w->before[old], &e) < 0) old++;
                if (old < w->n_before && by_particle(&w->before[old], &e) == 0) e = w->before[old];
                if ((status = append(w, &e))) return status;
            }
        }
    return DEM_OK;
}

double walls_overlap(const walls *w, size_t n, const double (*pos)[4])
{
    double largest = 0;
    for (size_t k = 0; k < w->n; k++)
        for (size_t i = 0; i < n; i++)
            largest = fmax(largest, 1 - dem_sdf_distance(w->wall[k].shape, pos[i]) / pos[i][3]);
    return largest;
}

/* Force of a part on a particle; the torque is -phi n x F_t. */
static contact_force touch(const wall_forces *job, const walls *w, const particles *p,
                           wall_entry *e, double phi, const double g[3], double torque[3])
{
    const double *v = p->vel[e->particle], r = p->pos[e->particle][3];
    double steep = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    double nx = g[0] / steep, ny = g[1] / steep, nz = g[2] / steep;
    contact c = {nx,
                 ny,
                 nz,
                 r - phi,
                 v[0] - phi * (v[5] * nz - v[6] * ny),
                 v[1] - phi * (v[6] * nx - v[4] * nz),
                 v[2] - phi * (v[4] * ny - v[5] * nx),
                 1 / v[3],
                 r,
                 steep};
    spring s = {0, 0, 0, 0};
    if (e->touch) s = (spring){e->spring[0], e->spring[1], e->spring[2], e->spring[3]};
    coefficient q =
        job->table[p->material[e->particle] * job->n_material + w->wall[e->wall].material];
    contact_force f = law_force(job->law, q, c, job->dt, &s);
    e->spring[0] = s.x;
    e->spring[1] = s.y;
    e->spring[2] = s.z;
    e->spring[3] = s.a;
    torque[0] = -phi * (ny * f.tz - nz * f.ty);
    torque[1] = -phi * (nz * f.tx - nx * f.tz);
    torque[2] = -phi * (nx * f.ty - ny * f.tx);
    return f;
}

void sum_wall_forces(wall_forces *job, walls *w, particles *p)
{
    job->contacts = 0;
    job->overlap = 0;
    memset(job->on_particles, 0, sizeof job->on_particles);
    for (size_t k = 0; k < w->n_entry; k++) {
        wall_entry *e = &w->entry[k];
        double gradient[3], torque[3];
        double r = p->pos[e->particle][3];
        double phi = dem_sdf_eval(w->wall[e->wall].shape, e->part, p->pos[e->particle], gradient);
        if (!(phi < r)) {
            e->touch = 0;
            continue;
        }
        contact_force f = touch(job, w, p, e, phi, gradient, torque);
        e->touch = 1;
        double force[3] = {f.x, f.y, f.z};
        for (int a = 0; a < 3; a++) {
            p->force[e->particle][a] += force[a];
            p->force[e->particle][4 + a] += torque[a];
            w->force[e->wall][a] -= force[a];
            job->on_particles[a] += force[a];
        }
        job->contacts++;
        if (1 - phi / r > job->overlap) job->overlap = 1 - phi / r;
    }
}
