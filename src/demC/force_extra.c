/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force_extra.c - rolling resistance, cohesion and the balance within the loop over pairs.
 */
#include "force_block.h"

#include <string.h>

void gather_extra(const block *b, extra_block *x, const contact_stream *s)
{
    memcpy(x->before, b->spring, (size_t)b->n * sizeof *b->spring);
    for (int c = 0; c < b->n && s->rolling; c++) {
        const double *old = s->rolling[ring_at(s, b->old[c])];
        for (int m = 0; m < 4; m++) x->rolling[c][m] = b->was[c] ? old[m] : 0;
    }
}

/* A force of a pair as particle i has it: what it does to its motion, and to its spin. */
static void book(double where[6], const double n[3], double lever, const double f[3], double sign)
{
    for (int a = 0; a < 3; a++) {
        int s = (a + 1) % 3, t = (a + 2) % 3;
        where[a] += sign * f[a];
        where[3 + a] -= lever * (n[s] * f[t] - n[t] * f[s]);
    }
}

/* Force on i, -force on j; torque -l n x force on both. Ghosts keep no books. */
static void book_pair(balance *kept, size_t n_own, const uint32_t who[2], const double n[3],
                      const double lever[2], const extra_force *g)
{
    for (int side = 0; side < 2; side++) {
        const uint32_t i = who[side];
        const double sign = side ? -1 : 1;
        if (i >= n_own) continue;
        book(kept->damped[i], n, lever[side], g->damped, sign);
        book(kept->slid[i], n, lever[side], g->slid, sign);
        for (int k = 0; k < 3; k++) kept->rolled[i][k] += sign * g->rolled[k];
    }
}

/* sum += weight x one */
static void add_energies(spring_energy *sum, double weight, const spring_energy *one)
{
    sum->tangential += weight * one->tangential;
    sum->turned += weight * one->turned;
    sum->tangential_old += weight * one->tangential_old;
    sum->turned_old += weight * one->turned_old;
    sum->slid += weight * one->slid;
    sum->rolled += weight * one->rolled;
}

static extra_contact describe(const block *b, const extra_block *x, const arrays *a,
                              const pair_forces *job, int c)
{
    uint32_t i = b->i[c], j = b->j[c];
    const int pair = a->material[i] * job->n_material + a->material[j];
    const double *vi = a->vel[i], *vj = a->vel[j], *s = x->before[c];
    const double f[3] = {b->force[0][c], b->force[1][c], b->force[2][c]};
    double d = sqrt(b->d2[c]), fn = x->normal[c];
    extra_contact e = {.c = {.nx = b->apart[c][0] / d,
                             .ny = b->apart[c][1] / d,
                             .nz = b->apart[c][2] / d,
                             .overlap = b->overlap[c],
                             .mass = b->mass[c],
                             .radius = b->radius[c],
                             .steepness = 1},
                       .q = job->table[pair],
                       .dt = job->dt,
                       .inertia = 1 / (vi[7] + vj[7]),
                       .wx = vi[4] - vj[4],
                       .wy = vi[5] - vj[5],
                       .wz = vi[6] - vj[6],
                       .area = lens_area(a->pos[i][3], a->pos[j][3], d),
                       .before = {s[0], s[1], s[2], s[3]},
                       .after = {b->after[0][c], b->after[1][c], b->after[2][c], b->after[3][c]}};
    e.r = job->extras->table[pair];
    e.f = (contact_force){.tx = f[0] - fn * e.c.nx,
                          .ty = f[1] - fn * e.c.ny,
                          .tz = f[2] - fn * e.c.nz,
                          .normal = fn,
                          .elastic = x->elastic[c],
                          .slides = x->slides[c]};
    return e;
}

void apply_extra(block *b, extra_block *x, const arrays *a, pair_forces *job)
{
    balance *kept = job->extras->balance ? job->balance : NULL;
    for (int c = 0; c < b->n; c++) {
        const uint32_t who[2] = {b->i[c], b->j[c]};
        extra_contact e = describe(b, x, a, job, c);
        double *m = x->rolling[c];
        spring roll = {m[0], m[1], m[2], m[3]};
        spring_energy held = {0};
        extra_force g = extra_law(job->law, job->extras, &e, &roll, &held);
        /* A pair with a ghost is summed on two ranks. */
        add_energies(&job->springs, who[0] < a->n_own && who[1] < a->n_own ? 1 : .5, &held);
        x->rolling[c][0] = roll.x;
        x->rolling[c][1] = roll.y;
        x->rolling[c][2] = roll.z;
        x->rolling[c][3] = roll.a;
        const double n[3] = {e.c.nx, e.c.ny, e.c.nz};
        for (int k = 0; k < 3; k++) {
            b->force[k][c] -= g.attraction * n[k];
            x->torque[c][k] = g.torque[k];
        }
        if (!kept) continue;
        const double d = sqrt(b->d2[c]), uneven = b->apart[c][3];
        const double lever[2] = {.5 * (d + uneven), .5 * (d - uneven)};
        book_pair(kept, a->n_own, who, n, lever, &g);
    }
}

/* What models beyond the plain law add to pair c, whose place in the ring is `at`. */
void scatter_extra(const block *b, const extra_block *x, const arrays *a, const contact_stream *s,
                   int c, size_t at)
{
    double *ti = a->force[b->i[c]] + 4, *tj = a->force[b->j[c]] + 4;
    for (int k = 0; k < 3; k++) {
        ti[k] += x->torque[c][k];
        tj[k] -= x->torque[c][k];
    }
    if (s->rolling) memcpy(s->rolling[at], x->rolling[c], sizeof x->rolling[c]);
}
