/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * wall.c - contact of particles with walls given by signed distance functions.
 *
 * A wall consists of smooth parts; each makes its own contact with its own history. With phi the
 * signed distance of the centre x and n = grad phi/|grad phi|:
 *
 *     overlap d = r - phi > 0,  F_n = k d grad phi - eta v_n n,  contact point x_c = x - phi n,
 *     effective radius r, effective mass m
 *
 * A wall that moves is asked in its own coordinates, where its shape is as it was given: with the
 * pose (place X, rotation R, velocity V, spin W; motion.h) phi(x) = phi_0(R^T (x - X)), grad phi =
 * R grad phi_0, and the surface has the velocity V + W x (x_c - X). Places are those of the time of
 * the positions, velocities those of half a step before, as the particles' are (wall_motion.c).
 * Springs are kept in the wall's coordinates, so that a particle carried round by a drum has its
 * friction carried round too. Torques on a wall are about its own centre, which it carries along.
 *
 * |grad phi| is kept in the elastic force so that it is the gradient of an energy k d^2/2 even
 * where phi is not quite a distance (a sampled one).
 *
 * When the neighbour list is built the particles that are nearer to a part than the margin they
 * may move are listed; the others need no look at the wall until the next build. For a wall that
 * moves the margin is wider by the slack it may move; when it has, only this list is made again.
 * The list is sorted by (particle, wall, part), which is also the order of the sums.
 */
#include "wall.h"

#include "sdf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples of a surface lie scattered in memory: what this many entries later are in need of is
 * asked for. */
enum { ENTRIES_AHEAD = 4 };

/* x in the coordinates of the start of a wall. */
static void in_wall(const wall_body *body, const double x[3], double b[3])
{
    const pose *now = &body->now;
    double d[3] = {x[0] - now->place[0], x[1] - now->place[1], x[2] - now->place[2]};
    if (body->moves)
        pose_turn_back(now, d, b);
    else
        memcpy(b, x, 3 * sizeof *b);
}

/* Signed distance of an entry's part, and its gradient, where the wall is now. */
static double distance_now(const walls *w, wall_entry *e, const double x[3], double gradient[3])
{
    const dem_sdf *shape = w->wall[e->wall].shape;
    const wall_body *body = &w->body[e->wall];
    if (!body->moves) return sdf_eval_again(shape, e->part, x, gradient, &e->hint);
    double b[3], g[3];
    in_wall(body, x, b);
    double phi = sdf_eval_again(shape, e->part, b, g, &e->hint);
    pose_turn(&body->now, g, gradient);
    return phi;
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

dem_status walls_append(walls *w, const wall_entry *entry)
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

/* The parts that some particle of begin...end-1 may be near to, into w->near; how many. */
static size_t find_near(walls *w, const particles *p, size_t begin, size_t end, double margin)
{
    double lo[4], hi[4], centre[3], half2 = 0;
    memcpy(lo, p->pos[begin], sizeof lo);
    memcpy(hi, p->pos[begin], sizeof hi);
    for (size_t i = begin + 1; i < end; i++)
        for (int a = 0; a < 4; a++) {
            lo[a] = fmin(lo[a], p->pos[i][a]);
            hi[a] = fmax(hi[a], p->pos[i][a]);
        }
    for (int a = 0; a < 3; a++) {
        centre[a] = .5 * (lo[a] + hi[a]);
        half2 += .25 * (hi[a] - lo[a]) * (hi[a] - lo[a]);
    }
    size_t n = 0;
    for (size_t k = 0; k < w->n; k++) {
        int parts = dem_sdf_parts(w->wall[k].shape);
        double reach = sqrt(half2) + hi[3] + margin + (w->body[k].moves ? w->slack : 0), b[3];
        in_wall(&w->body[k], centre, b);
        for (int part = 0; part < parts; part++)
            if (sdf_near(w->wall[k].shape, part, b, reach))
                w->near[n++] = (wall_part){(int)k, part};
    }
    return n;
}

dem_status walls_list(walls *w, const particles *p, double margin, const uint32_t *place)
{
    /* Particles that follow each other are neighbours: what the whole block is far from need not be
     * asked of each. */
    const size_t block = 16;
    dem_status status = set_aside(w, place);
    if (status) return status;
    w->n_entry = 0;
    double largest = 0;
    for (size_t i = 0; i < p->n; i++) largest = fmax(largest, p->pos[i][3]);
    walls_remember(w, largest + margin);
    size_t old = 0, n_near = 0;
    for (size_t i = 0; i < p->n; i++) {
        if (i % block == 0) {
            size_t end = i + block < p->n ? i + block : p->n;
            n_near = find_near(w, p, i, end, margin);
        }
        double b[3];
        for (size_t c = 0; c < n_near; c++) {
            int k = w->near[c].wall, part = w->near[c].part;
            double reach = p->pos[i][3] + margin + (w->body[k].moves ? w->slack : 0);
            if (c == 0 || k != w->near[c - 1].wall) in_wall(&w->body[k], p->pos[i], b);
            if (!sdf_near(w->wall[k].shape, part, b, reach)) continue;
            wall_entry e = {{0}, {0}, (uint32_t)i, k, part, 0, 0};
            while (old < w->n_before && by_particle(&w->before[old], &e) < 0) old++;
            if (old < w->n_before && by_particle(&w->before[old], &e) == 0) e = w->before[old];
            if ((status = walls_append(w, &e))) return status;
        }
    }
    return DEM_OK;
}

void walls_renumber(walls *w, const uint32_t *place)
{
    size_t kept = 0;
    for (size_t k = 0; k < w->n_entry; k++) {
        wall_entry e = w->entry[k];
        e.particle = place[e.particle];
        if (e.particle != UINT32_MAX) w->entry[kept++] = e;
    }
    w->n_entry = kept;
}

double walls_deepest(const walls *w, const double pos[4], size_t *wall)
{
    double largest = 0;
    for (size_t k = 0; k < w->n; k++) {
        const dem_sdf *shape = w->wall[k].shape;
        double b[3], gradient[3], r = pos[3];
        in_wall(&w->body[k], pos, b);
        for (int part = 0; part < dem_sdf_parts(shape); part++) {
            if (!sdf_near(shape, part, b, r)) continue;
            double overlap = 1 - dem_sdf_eval(shape, part, b, gradient) / r;
            if (!(overlap > largest)) continue;
            largest = overlap;
            if (wall) *wall = k;
        }
    }
    return largest;
}

double walls_overlap(const walls *w, size_t n, const double (*pos)[4])
{
    double largest = 0;
    for (size_t i = 0; i < n; i++) largest = fmax(largest, walls_deepest(w, pos[i], NULL));
    return largest;
}

/* History from the coordinates that the wall carries along to those of space, and back. */
static spring spring_in_space(const wall_body *b, const double kept[4])
{
    spring s = {kept[0], kept[1], kept[2], kept[3]};
    if (b->moves) {
        double turned[3];
        pose_turn(&b->now, kept, turned);
        s = (spring){turned[0], turned[1], turned[2], kept[3]};
    }
    return s;
}

static void keep_spring(const wall_body *b, spring s, double kept[4])
{
    const double in_space[3] = {s.x, s.y, s.z};
    if (b->moves)
        pose_turn_back(&b->now, in_space, kept);
    else
        memcpy(kept, in_space, sizeof in_space);
    kept[3] = s.a;
}

/* What of the extras' force loses energy, and the work of the wall that moves at u. */
static void book(const wall_forces *job, const wall_body *body, uint32_t i, double phi,
                 const contact *c, const extra_force *g, const contact_force *f, const double u[3])
{
    balance *b = job->balance;
    const double n[3] = {c->nx, c->ny, c->nz}, dt = job->dt;
    const double force[3] = {f->x, f->y, f->z};
    for (int a = 0; a < 3; a++) {
        int s = (a + 1) % 3, t = (a + 2) % 3;
        double spin = body->moves ? body->half.spin[a] : 0;
        b->damped[i][a] += g->damped[a];
        b->damped[i][3 + a] -= phi * (n[s] * g->damped[t] - n[t] * g->damped[s]);
        b->slid[i][a] += g->slid[a];
        b->slid[i][3 + a] -= phi * (n[s] * g->slid[t] - n[t] * g->slid[s]);
        b->rolled[i][a] += g->rolled[a];
        b->damping += dt * g->damped[a] * u[a];
        b->sliding += dt * g->slid[a] * u[a];
        b->rolling += dt * g->rolled[a] * spin;
        b->walls += dt * (force[a] * u[a] + g->torque[a] * spin);
    }
}

/* Rolling resistance, cohesion, balance: added to the force `f` that law_force() has made of the
 * contact in `x`; returns what is added to the torque in `torque`. */
static void touch_extra(wall_forces *job, const wall_body *body, wall_entry *e, const particles *p,
                        extra_contact *x, const double u[3], contact_force *f, double torque[3])
{
    const contact *c = &x->c;
    const double *v = p->vel[e->particle], r = c->radius, phi = r - c->overlap;
    const double still[3] = {0, 0, 0}, *spin = body->moves ? body->half.spin : still;
    x->inertia = 1 / v[7];
    x->wx = v[4] - spin[0];
    x->wy = v[5] - spin[1];
    x->wz = v[6] - spin[2];
    x->area = M_PI * (r - phi) * (r + phi);
    x->f = *f;
    spring roll = {0, 0, 0, 0};
    if (e->touch) roll = spring_in_space(body, e->rolling);
    extra_force g = extra_law(job->law, job->extras, x, &roll, &job->springs);
    keep_spring(body, roll, e->rolling);
    f->x -= g.attraction * c->nx;
    f->y -= g.attraction * c->ny;
    f->z -= g.attraction * c->nz;
    for (int a = 0; a < 3; a++) torque[a] += g.torque[a];
    if (job->extras->balance) book(job, body, e->particle, phi, c, &g, f, u);
}

/* Force of a part on a particle; the torque is -phi n x F_t. */
static contact_force touch(wall_forces *job, const walls *w, const particles *p, wall_entry *e,
                           double phi, const double g[3], double torque[3])
{
    const wall_body *body = &w->body[e->wall];
    const double *x = p->pos[e->particle], *v = p->vel[e->particle], r = x[3];
    double steep = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    /* On the medial surface of a sampled sheet the gradient may vanish, and the force with it. */
    double per = steep > 0 ? 1 / steep : 0;
    double nx = g[0] * per, ny = g[1] * per, nz = g[2] * per;
    double u[3] = {0, 0, 0}; /* of the surface */
    if (body->moves) {
        const double h = .5 * job->dt; /* see wall_motion.c */
        const double point[3] = {x[0] - h * v[0] - phi * nx, x[1] - h * v[1] - phi * ny,
                                 x[2] - h * v[2] - phi * nz};
        pose_velocity(&body->half, point, u);
    }
    contact c = {nx,
                 ny,
                 nz,
                 r - phi,
                 v[0] - phi * (v[5] * nz - v[6] * ny) - u[0],
                 v[1] - phi * (v[6] * nx - v[4] * nz) - u[1],
                 v[2] - phi * (v[4] * ny - v[5] * nx) - u[2],
                 1 / v[3],
                 r,
                 steep};
    spring s = {0, 0, 0, 0};
    if (e->touch) s = spring_in_space(body, e->spring);
    int pair = p->material[e->particle] * job->n_material + w->wall[e->wall].material;
    spring before = s;
    contact_force f = law_force(job->law, job->table[pair], c, job->dt, &s);
    keep_spring(body, s, e->spring);
    torque[0] = -phi * (ny * f.tz - nz * f.ty);
    torque[1] = -phi * (nz * f.tx - nx * f.tz);
    torque[2] = -phi * (nx * f.ty - ny * f.tx);
    if (job->extras) {
        extra_contact more = {.c = c,
                              .q = job->table[pair],
                              .r = job->extras->table[pair],
                              .dt = job->dt,
                              .before = before,
                              .after = s};
        touch_extra(job, body, e, p, &more, u, &f, torque);
    }
    return f;
}

/* What a particle at x gets from the wall the wall loses, about its own centre. */
static void load_wall(wall_body *b, const double x[3], const double force[3],
                      const double torque[3])
{
    double l[3] = {x[0] - b->centre[0], x[1] - b->centre[1], x[2] - b->centre[2]};
    b->load[3] -= l[1] * force[2] - l[2] * force[1] + torque[0];
    b->load[4] -= l[2] * force[0] - l[0] * force[2] + torque[1];
    b->load[5] -= l[0] * force[1] - l[1] * force[0] + torque[2];
    for (int a = 0; a < 3; a++) b->load[a] -= force[a];
}

/* What the entry k reads of a shape at rest. */
static void fetch_ahead(const walls *w, const particles *p, size_t k)
{
    if (k >= w->n_entry) return;
    const wall_entry *e = &w->entry[k];
    if (!w->body[e->wall].moves) sdf_fetch(w->wall[e->wall].shape, p->pos[e->particle], e->hint);
}

void sum_wall_forces(wall_forces *job, walls *w, particles *p, size_t end)
{
    for (; job->next < w->n_entry && w->entry[job->next].particle < end; job->next++) {
        wall_entry *e = &w->entry[job->next];
        double gradient[3], torque[3];
        fetch_ahead(w, p, job->next + ENTRIES_AHEAD);
        double r = p->pos[e->particle][3];
        double phi = distance_now(w, e, p->pos[e->particle], gradient);
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
            job->on_particles[a] += force[a];
        }
        load_wall(&w->body[e->wall], p->pos[e->particle], force, torque);
        if (job->balance) {
            const double *x = p->pos[e->particle];
            double *L = job->balance->wall_angular;
            L[0] += job->dt * (x[1] * force[2] - x[2] * force[1] + torque[0]);
            L[1] += job->dt * (x[2] * force[0] - x[0] * force[2] + torque[1]);
            L[2] += job->dt * (x[0] * force[1] - x[1] * force[0] + torque[2]);
        }
        job->contacts++;
        if (1 - phi / r > job->overlap) job->overlap = 1 - phi / r;
    }
}

double walls_elastic(const walls *w, const particles *p, const coefficient *table, int n_material,
                     const extras *x, spring_energy *s)
{
    double sum = 0, gradient[3];
    for (size_t k = 0; k < w->n_entry; k++) {
        wall_entry *e = &w->entry[k];
        const double *pos = p->pos[e->particle], r = pos[3];
        int pair = p->material[e->particle] * n_material + w->wall[e->wall].material;
        if (e->touch) {
            const double *m = x->rolling == DEM_ROLLING_EPSD ? e->rolling : NULL;
            add_springs(x->law, table[pair], x->table[pair], r, e->spring, m, s);
        }
        double phi = distance_now(w, e, pos, gradient);
        if (!(phi < r)) continue;
        double a = x->law == DEM_HERTZ ? sqrt(r * (r - phi)) : 1;
        sum += normal_energy(x->law, table[pair].normal * a, r - phi);
        if (x->cohesion == DEM_COHESION_SJKR) sum -= x->table[pair].cohesion * cap_volume(r, phi);
    }
    return sum;
}
