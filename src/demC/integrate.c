/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * integrate.c - one step of translation and rotation under contact, gravity and outside force.
 *
 * Symplectic Euler: v' = v + dt F(x, v)/m, x' = x + dt v', w' = w + dt T/I. The outside force
 * F = f + k (w - v') - M (v' - v)/dt is taken at the new velocity, so that it is stable for any k:
 *
 *     (m + M + k dt) v' = (m + M) v + dt (F_c + m g + f + k w)
 *
 * What it delivered is J = m (v' - v) - dt (F_c + m g), which equals dt (f + k (w - v')) -
 * M (v' - v), but in this form momentum is booked to the last digit even where k dt >> m.
 */
#include "integrate.h"

#include <math.h>
#include <string.h>

#define ALWAYS static inline __attribute__((always_inline))

typedef int64_t mask4 __attribute__((vector_size(32)));

ALWAYS void move(motion *m, particles *p, size_t begin, size_t end, int outside)
{
    const double dt = m->dt, *g = m->gravity;
    /* The fourth lane of a record is no component: it must not move. */
    const vec4 step = {dt, dt, dt, 0}, zero = {0, 0, 0, 0}, weight = {g[0], g[1], g[2], 0};
    vec4 fastest = zero, poison = zero;
    for (size_t i = begin; i < end; i++) {
        vec4 *v = (vec4 *)p->vel[i], *f = (vec4 *)p->force[i];
        vec4 new = v[0] + step *(f[0] * v[0][3] + weight);
        if (outside) {
            const double *o = p->outside[i], mass = p->mass[i];
            double heavy = mass + o[7], per = 1 / (heavy + o[3] * dt);
            for (int a = 0; a < 3; a++) {
                double push = p->force[i][a] + mass * g[a], old = p->vel[i][a];
                double now = per * (heavy * old + dt * (push + o[a] + o[3] * o[4 + a]));
                p->impulse[i][a] += mass * (now - old) - dt * push;
                new[a] = now;
            }
        }
        v[0] = new;
        v[1] += step * (f[1] * v[1][3]);
        *(vec4 *)p->pos[i] += step * new;
        vec4 square = new *new;
        mask4 faster = square > fastest;
        fastest = (vec4)((faster & (mask4)square) | (~faster & (mask4)fastest));
        poison += new * 0 + v[1] * 0; /* not a number from anything not finite */
        f[0] = zero;
        f[1] = zero;
    }
    for (int a = 0; a < 3; a++) m->most[a] = fmax(m->most[a], fastest[a]);
    m->lost |= poison[0] + poison[1] + poison[2] != 0;
}

static void keep_force(const motion *m, particles *p, size_t begin, size_t end)
{
    for (size_t i = begin; i < end; i++)
        for (int a = 0; a < 3; a++) p->last[i][a] = p->force[i][a] + p->mass[i] * m->gravity[a];
}

static void move_plain(motion *m, particles *p, size_t begin, size_t end)
{
    if (m->outside)
        move(m, p, begin, end, 1);
    else
        move(m, p, begin, end, 0);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2,fma"))) static void move_avx2(motion *m, particles *p, size_t begin,
                                                          size_t end)
{
    if (m->outside)
        move(m, p, begin, end, 1);
    else
        move(m, p, begin, end, 0);
}
#endif

void integrate(motion *m, particles *p, size_t begin, size_t end)
{
    if (m->last) keep_force(m, p, begin, end);
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        move_avx2(m, p, begin, end);
        return;
    }
#endif
    move_plain(m, p, begin, end);
}
