/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force.c - the loop over pairs: list -> touching pairs -> law -> forces and torques.
 *
 * Works in blocks of entries of the list that stay in the first-level cache:
 *
 *   look    x_i - x_j of every entry
 *   sieve   the pairs that touch, without branches
 *   gather  their velocities and springs
 *   law     one vectorised loop over the pairs
 *   scatter forces and torques to both partners, springs to the ring (contact.h)
 *
 * A block is filled up to whole vectors with copies of its last pair, so that each pair goes
 * through the same instructions wherever in a block it stands: its force is the same to the last
 * bit in every list that it may be part of, thus on any number of ranks.
 *
 * The order of the sums is that of the list, thus of (cell, id): see neighbour.h. The contact point
 * lies in the middle of the overlap, at l_i = r_i - d/2 from x_i, the same for both partners, and
 * what one gets the other loses: momentum and angular momentum are kept to rounding. The velocity
 * of the surfaces there is
 *
 *     v_r = v_i - v_j - (l_i w_i + l_j w_j) x n,   2 (l_i w_i + l_j w_j) =
 *           |x_i - x_j| (w_i + w_j) + (r_i - r_j)(w_i - w_j)
 *
 * The loop is compiled once for every law, with and without periodic sides, for equal and for
 * different particles, for one material and for several, and for three generations of vector
 * instructions; the choice is made once in a call. All have the same source. Rolling resistance,
 * cohesion and the balance (contact_extra.h) have loops of their own, for different particles; what
 * they do stands between law and scatter, and the plain loops know nothing of it.
 */
#include "force_block.h"

/* Partners lie up to some layers of particles away, in the second-level cache at best: what is
 * needed soon is asked for early, so many entries, contacts, particles before. NEIGHBOUR_SPARE
 * entries behind the list may be looked at. */
enum { AHEAD = NEIGHBOUR_SPARE, SPRINGS_AHEAD = 64, ROWS_AHEAD = 512 };

/* The first to come to a particle finds it in the second-level cache. */
DEM_INLINE void fetch_ahead(const arrays *a, size_t i)
{
    __builtin_prefetch(a->pos[i], 1, 2);
    __builtin_prefetch(a->vel[i], 1, 2);
    __builtin_prefetch(a->force[i], 1, 2);
}

/* Entries begin..end-1, of the row of particle i, are looked at. */
DEM_INLINE void look(block *b, const arrays *a, size_t i, size_t begin, size_t end, int uniform,
                     int periodic)
{
    const vec4 xi = *(const vec4 *)a->pos[i];
    int m = b->entries;
    for (size_t k = begin; k < end; k++, m++) {
        const uint32_t entry = a->entry[k], j = periodic ? entry & NEIGHBOUR_MASK : entry;
        const vec4 xj = *(const vec4 *)a->pos[j];
        __builtin_prefetch(a->pos[a->entry[k + AHEAD] & NEIGHBOUR_MASK]);
        __builtin_prefetch(a->vel[j]);
        __builtin_prefetch(a->force[j], 1);
        vec4 between = xi - xj;
        if (periodic) between -= *(const vec4 *)a->shift[entry >> NEIGHBOUR_BITS];
        *(vec4 *)b->between[m] = between;
        b->row[m] = (uint32_t)i;
        if (!uniform) b->sum[m] = xi[3] + xj[3];
    }
    b->entries = m;
}

/* Those of the entries that touch. */
DEM_INLINE void sieve(block *restrict b, const arrays *a, contact_stream *s, int uniform,
                      double all_reach)
{
    const vec4 none = {0, 0, 0, 0};
    const int whole = (b->entries + WIDE - 1) / WIDE * WIDE;
    for (int m = b->entries; m < whole; m++) *(vec4 *)b->between[m] = none;
    for (int m = 0; m < whole; m++) {
        const double *x = b->between[m];
        b->square[m] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    }
    uint8_t *touch = a->touch + b->first;
    uint32_t old = (uint32_t)s->read;
    int n = 0;
    for (int m = 0; m < b->entries; m++) {
        const double reach = uniform ? all_reach : b->sum[m];
        b->from[n] = (uint16_t)m;
        b->old[n] = old;
        b->was[n] = touch[m];
        const int inside = b->square[m] < reach * reach;
        old += touch[m];
        touch[m] = (uint8_t)inside;
        n += inside;
    }
    b->n = n;
    s->read = old;
}

DEM_INLINE void gather(block *b, const arrays *a, const contact_stream *s, const pair_forces *job,
                       int uniform, int one, int periodic)
{
    static const vec4 none = {0, 0, 0, 0};
    const uint32_t *entry = a->entry + b->first;
    for (int c = 0; c < b->n; c++) {
        const int m = b->from[c];
        const uint32_t i = b->row[m], j = periodic ? entry[m] & NEIGHBOUR_MASK : entry[m];
        b->i[c] = i;
        b->j[c] = j;
        b->d2[c] = b->square[m];
        *(vec4 *)b->apart[c] = *(const vec4 *)b->between[m];
        const vec4 *vi = (const vec4 *)a->vel[i], *vj = (const vec4 *)a->vel[j];
        *(vec4 *)b->velocity[c] = vi[0] - vj[0];
        *(vec4 *)b->spin[c] = vi[1] + vj[1];
        const vec4 *old = (const vec4 *)s->spring[ring_at(s, b->old[c])];
        __builtin_prefetch(old + SPRINGS_AHEAD);
        *(vec4 *)b->spring[c] = *(b->was[c] ? old : &none);
        if (uniform) continue;
        b->reach[c] = b->sum[m];
        *(vec4 *)b->twist[c] = (vi[1] - vj[1]) * b->between[m][3];
        b->mass[c] = 1 / (a->vel[i][3] + a->vel[j][3]);
        b->radius[c] = a->pos[i][3] * a->pos[j][3] / b->reach[c];
        if (one) continue;
        const int pair = a->material[i] * job->n_material + a->material[j];
        const double *q = (const double *)&job->table[pair];
        for (int k = 0; k < COEFFICIENTS; k++) b->q[k][c] = q[k];
    }
}

/* Copies of the last pair up to whole vectors. */
DEM_INLINE int fill_up(block *b, int uniform, int one)
{
    const int last = b->n - 1, whole = (b->n + WIDE - 1) / WIDE * WIDE;
    for (int c = b->n; c < whole; c++) {
        *(vec4 *)b->apart[c] = *(vec4 *)b->apart[last];
        b->d2[c] = b->d2[last];
        *(vec4 *)b->velocity[c] = *(vec4 *)b->velocity[last];
        *(vec4 *)b->spin[c] = *(vec4 *)b->spin[last];
        *(vec4 *)b->spring[c] = *(vec4 *)b->spring[last];
        if (uniform) continue;
        b->reach[c] = b->reach[last];
        *(vec4 *)b->twist[c] = *(vec4 *)b->twist[last];
        b->mass[c] = b->mass[last];
        b->radius[c] = b->radius[last];
        for (int k = 0; k < COEFFICIENTS && !one; k++) b->q[k][c] = b->q[k][last];
    }
    return whole / WIDE;
}

/* `x`, a literal NULL in the plain loops, keeps what the extras ask for. */
DEM_INLINE void apply_law(block *restrict b, extra_block *restrict x, const pair_forces *job,
                          dem_law law, int uniform, int one)
{
    _Static_assert(COEFFICIENTS == 5, "each is named below, in the order of the struct");
    const coefficient only = job->only;
    const double mass = .5 * job->mass, radius = .5 * job->radius, dt = job->dt;
    const double reach = 2 * job->radius;
    const int n = WIDE * fill_up(b, uniform, one);
    for (int c = 0; c < n; c++) {
        double d = sqrt(b->d2[c]), per_d = 1 / d;
        double nx = b->apart[c][0] * per_d, ny = b->apart[c][1] * per_d;
        double nz = b->apart[c][2] * per_d;
        double overlap = (uniform ? reach : b->reach[c]) - d;
        double wx = d * b->spin[c][0], wy = d * b->spin[c][1], wz = d * b->spin[c][2];
        double uneven = 0;
        if (!uniform) {
            wx += b->twist[c][0];
            wy += b->twist[c][1];
            wz += b->twist[c][2];
            uneven = b->apart[c][3];
        }
        contact t = {nx,
                     ny,
                     nz,
                     overlap,
                     b->velocity[c][0] - .5 * (wy * nz - wz * ny),
                     b->velocity[c][1] - .5 * (wz * nx - wx * nz),
                     b->velocity[c][2] - .5 * (wx * ny - wy * nx),
                     uniform ? mass : b->mass[c],
                     uniform ? radius : b->radius[c],
                     1};
        const coefficient q = {b->q[0][c], b->q[1][c], b->q[2][c], b->q[3][c], b->q[4][c]};
        spring s = {b->spring[c][0], b->spring[c][1], b->spring[c][2], b->spring[c][3]};
        contact_force f = law_force(law, one ? only : q, t, dt, &s);
        if (x) {
            x->normal[c] = f.normal;
            x->elastic[c] = f.elastic;
            x->slides[c] = f.slides;
        }
        b->overlap[c] = overlap;
        b->after[0][c] = s.x;
        b->after[1][c] = s.y;
        b->after[2][c] = s.z;
        b->after[3][c] = s.a;
        b->force[0][c] = f.x;
        b->force[1][c] = f.y;
        b->force[2][c] = f.z;
        double li = .5 * (d + uneven); /* T_i = (x_c - x_i) x F = -l_i n x F_t */
        b->torque[0][c] = li * (nz * f.ty - ny * f.tz);
        b->torque[1][c] = li * (nx * f.tz - nz * f.tx);
        b->torque[2][c] = li * (ny * f.tx - nx * f.ty);
        if (!uniform) b->lever[c] = (d - uneven) / (d + uneven);
    }
}

/* gcc and clang have different names for taking some of the numbers of two vectors. */
#ifdef __clang__
#define SOME_OF(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
typedef int64_t which4 __attribute__((vector_size(32)));
#define SOME_OF(a, b, ...) __builtin_shuffle(a, b, (which4){__VA_ARGS__})
#endif

/* Components of four pairs, from c on, to vectors of them. */
DEM_INLINE void turn(vec4 out[4], const double (*in)[BLOCK], int components, int c)
{
    const vec4 none = {0, 0, 0, 0};
    const vec4 x = *(const vec4 *)&in[0][c], y = *(const vec4 *)&in[1][c];
    const vec4 z = *(const vec4 *)&in[2][c], w = components > 3 ? *(const vec4 *)&in[3][c] : none;
    const vec4 xy0 = SOME_OF(x, y, 0, 4, 2, 6), xy1 = SOME_OF(x, y, 1, 5, 3, 7);
    const vec4 zw0 = SOME_OF(z, w, 0, 4, 2, 6), zw1 = SOME_OF(z, w, 1, 5, 3, 7);
    out[0] = SOME_OF(xy0, zw0, 0, 1, 4, 5);
    out[1] = SOME_OF(xy1, zw1, 0, 1, 4, 5);
    out[2] = SOME_OF(xy0, zw0, 2, 3, 6, 7);
    out[3] = SOME_OF(xy1, zw1, 2, 3, 6, 7);
}

/* Pair by pair, all of a pair at once: which pairs share a block is not the same on every number of
 * ranks, and must not decide the order of a sum. */
DEM_INLINE void scatter(const block *b, const extra_block *x, const arrays *a,
                        const contact_stream *s, int uniform)
{
    size_t at = s->to + s->written;
    for (int c = 0; c < b->n; c += 4) {
        vec4 f[4], t[4], after[4];
        turn(f, b->force, 3, c);
        turn(t, b->torque, 3, c);
        turn(after, b->after, 4, c);
        const int end = b->n - c < 4 ? b->n - c : 4;
        for (int k = 0; k < end; k++, at++) {
            vec4 *fi = (vec4 *)a->force[b->i[c + k]], *fj = (vec4 *)a->force[b->j[c + k]];
            if (at >= s->size) at -= s->size;
            *(vec4 *)s->spring[at] = after[k];
            fi[0] += f[k];
            fi[1] += t[k];
            fj[0] -= f[k];
            fj[1] += uniform ? t[k] : t[k] * b->lever[c + k];
            if (x) scatter_extra(b, x, a, s, c + k, at);
        }
    }
}

/* ---- the loop -------------------------------------------------------------------------------- */

/* Largest overlap / smaller radius in the block: r_j = (reach - uneven)/2. */
static void survey(const block *b, pair_forces *job, int uniform)
{
    for (int c = 0; c < b->n; c++) {
        double smaller = uniform ? job->radius : .5 * (b->reach[c] - fabs(b->apart[c][3]));
        double ratio = b->overlap[c] / smaller;
        if (ratio > job->overlap) job->overlap = ratio;
    }
}

/* Pairs of which this rank has the first: each is counted on one rank. */
DEM_INLINE size_t count_own(const block *b, size_t n_own)
{
    size_t n = 0;
    for (int c = 0; c < b->n; c++) n += b->i[c] < n_own;
    return n;
}

DEM_INLINE void flush(block *b, extra_block *x, const arrays *a, contact_stream *s,
                      pair_forces *job, dem_law law, int uniform, int one, int periodic)
{
    if (!b->entries || s->failed) return;
    sieve(b, a, s, uniform, 2 * job->radius);
    if (!b->n) return;
    gather(b, a, s, job, uniform, one, periodic);
    if (x) gather_extra(b, x, s);
    apply_law(b, x, job, law, uniform, one);
    if (x) apply_extra(b, x, a, job);
    const size_t n = (size_t)b->n;
    if (s->written + n > s->read + s->gap && contacts_widen(s, n)) return;
    scatter(b, x, a, s, uniform);
    if (job->survey) survey(b, job, uniform);
    job->contacts += count_own(b, a->n_own);
    s->written += n;
}

DEM_INLINE void pair_loop(pair_forces *job, extra_block *x, const arrays *a, contact_stream *s,
                          size_t first, size_t last, dem_law law, int uniform, int one,
                          int periodic)
{
    block b;
    b.entries = 0;
    b.first = a->row[first];
    for (size_t r = first; r < last; r++) {
        const size_t i = a->slot ? a->slot[r] : r;
        fetch_ahead(a, i + ROWS_AHEAD < a->n_own ? i + ROWS_AHEAD : i);
        for (size_t k = a->row[r], row_end = a->row[r + 1]; k < row_end;) {
            const size_t room = (size_t)(BLOCK - b.entries);
            const size_t end = row_end - k > room ? k + room : row_end;
            look(&b, a, i, k, end, uniform, periodic);
            if (b.entries == BLOCK) {
                flush(&b, x, a, s, job, law, uniform, one, periodic);
                b.entries = 0;
                b.first = end;
            }
            k = end;
        }
    }
    flush(&b, x, a, s, job, law, uniform, one, periodic);
}

typedef void pair_kernel(pair_forces *job, const arrays *a, contact_stream *s, size_t begin,
                         size_t end);

#define KERNEL(name, isa, law, uniform, one, periodic)                                             \
    isa static void name(pair_forces *job, const arrays *a, contact_stream *s, size_t begin,       \
                         size_t end)                                                               \
    {                                                                                              \
        pair_loop(job, NULL, a, s, begin, end, law, uniform, one, periodic);                       \
    }
#define EXTRA_KERNEL(name, isa, law, periodic)                                                     \
    isa static void name(pair_forces *job, const arrays *a, contact_stream *s, size_t begin,       \
                         size_t end)                                                               \
    {                                                                                              \
        extra_block x;                                                                             \
        pair_loop(job, &x, a, s, begin, end, law, 0, 0, periodic);                                 \
    }
#define KERNELS_OF(name, isa, law)                                                                 \
    KERNEL(name##_any, isa, law, 0, 0, 0)                                                          \
    KERNEL(name##_any_periodic, isa, law, 0, 0, 1)                                                 \
    KERNEL(name##_equal, isa, law, 1, 1, 0)                                                        \
    KERNEL(name##_equal_periodic, isa, law, 1, 1, 1)                                               \
    KERNEL(name##_alike, isa, law, 0, 1, 0)                                                        \
    KERNEL(name##_alike_periodic, isa, law, 0, 1, 1)                                               \
    EXTRA_KERNEL(name##_extra, isa, law, 0)                                                        \
    EXTRA_KERNEL(name##_extra_periodic, isa, law, 1)
#define TABLE_OF(name)                                                                             \
    {                                                                                              \
        [ANY] = {name##_any, name##_any_periodic},                                                 \
        [EQUAL] = {name##_equal, name##_equal_periodic},                                           \
        [ALIKE] = {name##_alike, name##_alike_periodic}, [EXTRA] = {                               \
            name##_extra,                                                                          \
            name##_extra_periodic                                                                  \
        }                                                                                          \
    }
/* Particles of any kind, equal ones, different ones of one material, extras. */
enum { ANY, EQUAL, ALIKE, EXTRA, KINDS };
/* [law][kind][periodic] */
#define KERNELS(suffix, isa)                                                                       \
    KERNELS_OF(linear_##suffix, isa, DEM_LINEAR)                                                   \
    KERNELS_OF(hertz_##suffix, isa, DEM_HERTZ)                                                     \
    static pair_kernel *const kernels_##suffix[2][KINDS][2] = {TABLE_OF(linear_##suffix),          \
                                                               TABLE_OF(hertz_##suffix)};

KERNELS(plain, )
#if defined(__x86_64__) && defined(__GNUC__) && !defined(DEM_PLAIN) /* fuzzers: less to compile */
#define DEM_HAVE_X86 1
KERNELS(avx2, __attribute__((target("avx2,fma"))))
KERNELS(avx512, __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw,avx2,fma"))))
#endif

int force_vectors(void)
{
#ifdef DEM_HAVE_X86
    if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw"))
        return 2;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return 1;
#endif
    return 0;
}

static pair_kernel *choose(int vectors, dem_law law, int kind, int periodic)
{
    int hertz = law == DEM_HERTZ;
#ifdef DEM_HAVE_X86
    if (vectors == 2) return kernels_avx512[hertz][kind][periodic];
    if (vectors == 1) return kernels_avx2[hertz][kind][periodic];
#endif
    (void)vectors;
    return kernels_plain[hertz][kind][periodic];
}

force_loop forces_open(pair_forces *job, particles *p, const neighbour *list, contacts *c)
{
    job->contacts = 0;
    job->overlap = 0;
    job->springs = (spring_energy){0};
    return (force_loop){job, p, list, contacts_open(c)};
}

void forces_of_rows(force_loop *loop, size_t begin, size_t end)
{
    pair_forces *job = loop->job;
    const particles *p = loop->p;
    const neighbour *list = loop->list;
    const arrays a = {(const double(*)[4])p->pos,
                      (const double(*)[8])p->vel,
                      p->force,
                      p->material,
                      list->row,
                      list->slot,
                      list->entry,
                      (const double(*)[4])list->shift,
                      loop->springs.c->touch,
                      p->n};
    const int plain = job->uniform ? EQUAL : job->one_material ? ALIKE : ANY;
    pair_kernel *kernel =
        choose(job->vectors, job->law, job->extras ? EXTRA : plain, list->any_periodic);
    kernel(job, &a, &loop->springs, begin, end);
}

dem_status forces_close(force_loop *loop)
{
    return contacts_close(&loop->springs, loop->list);
}
