/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force.c - the loop over pairs: list -> touching pairs -> law -> forces and torques.
 *
 * Works in blocks that stay in the first-level cache:
 *
 *   detect  entries of the list -> dense block of touching pairs, without branches
 *   gather  velocities and springs of the block into rows
 *   law     one vectorised loop over the block
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
#include "force.h"

#include <string.h>

#define BLOCK 128
/* Partners lie up to some layers of particles away, in the second-level cache at best: what is
 * needed soon is asked for early. NEIGHBOUR_SPARE entries behind the list may be looked at. */
#define AHEAD NEIGHBOUR_SPARE

#define WIDE 8 /* numbers in the widest vector; divides BLOCK */

typedef struct block {
    int n;
    uint32_t i[BLOCK + 1], j[BLOCK + 1]; /* j: with its image until it is gathered */
    uint32_t old[BLOCK + 1];             /* number of the contact in the last sum, */
    uint8_t was[BLOCK + 1];              /* if there was one */
    double d2[BLOCK + 1];
    double dx[BLOCK], dy[BLOCK], dz[BLOCK];
    double reach[BLOCK];  /* r_i + r_j */
    double uneven[BLOCK]; /* r_i - r_j */
    double overlap[BLOCK];
    double mass[BLOCK], radius[BLOCK];      /* effective; unless uniform */
    _Alignas(64) double velocity[BLOCK][4]; /* v_i - v_j */
    _Alignas(64) double spin[BLOCK][4];     /* w_i + w_j */
    _Alignas(64) double twist[BLOCK][4];    /* (r_i - r_j)(w_i - w_j); unless uniform */
    _Alignas(64) double spring[BLOCK][4];
    _Alignas(64) double force[BLOCK][4];
    _Alignas(64) double torque[BLOCK][4]; /* on i */
    double lever[BLOCK];                  /* l_j / l_i; unless uniform */
    coefficient q[BLOCK];                 /* unless uniform */
} block;

/* What the extras need besides. */
typedef struct extra_block {
    double before[BLOCK][4];  /* spring */
    double rolling[BLOCK][4]; /* rolling spring */
    double torque[BLOCK][3];  /* of the rolling resistance, on i */
    double normal[BLOCK], elastic[BLOCK];
    int slides[BLOCK];
} extra_block;

/* The pointers of the loop, so that no store makes the compiler read one again. */
typedef struct arrays {
    const double (*restrict pos)[4];
    const double (*restrict vel)[8];
    double (*restrict force)[8];
    const int *restrict material;
    const size_t *restrict row;
    const uint32_t *restrict slot; /* particle of a row, NULL: the same */
    const uint32_t *restrict entry;
    const double (*restrict shift)[4];
    uint8_t *restrict touch;
    size_t n_own; /* particles; those behind are ghosts */
} arrays;

/* Entries begin..end-1 of the row of particle i: those that touch are appended to the block. */
DEM_INLINE void detect(block *b, const arrays *a, contact_stream *s, size_t i, size_t begin,
                       size_t end, int uniform, double all_reach, int periodic)
{
    const double *xi = a->pos[i];
    double x = xi[0], y = xi[1], z = xi[2], r = xi[3];
    uint32_t old = (uint32_t)s->read;
    int n = b->n;
    for (size_t k = begin; k < end; k++) {
        uint32_t entry = a->entry[k], j = periodic ? entry & NEIGHBOUR_MASK : entry;
        const double *xj = a->pos[j];
        __builtin_prefetch(a->pos[a->entry[k + AHEAD] & NEIGHBOUR_MASK]);
        __builtin_prefetch(a->vel[j]);
        __builtin_prefetch(a->force[j], 1);
        double dx = x - xj[0], dy = y - xj[1], dz = z - xj[2];
        if (periodic) {
            const double *shift = a->shift[entry >> NEIGHBOUR_BITS];
            dx -= shift[0];
            dy -= shift[1];
            dz -= shift[2];
        }
        double d2 = dx * dx + dy * dy + dz * dz, reach = uniform ? all_reach : r + xj[3];
        b->i[n] = (uint32_t)i;
        b->j[n] = entry;
        b->old[n] = old;
        b->was[n] = a->touch[k];
        b->d2[n] = d2;
        int inside = d2 < reach * reach;
        old += a->touch[k];
        a->touch[k] = (uint8_t)inside;
        n += inside;
    }
    b->n = n;
    s->read = old;
}

/* Place in the ring of the contact k of the last sum. */
DEM_INLINE size_t ring_at(const contact_stream *s, size_t k)
{
    return s->begin + k < s->size ? s->begin + k : s->begin + k - s->size;
}

DEM_INLINE void gather(block *b, const arrays *a, const contact_stream *s, const pair_forces *job,
                       int uniform, int one, int periodic)
{
    static const vec4 none = {0, 0, 0, 0};
    for (int c = 0; c < b->n; c++) {
        const uint32_t entry = b->j[c], i = b->i[c], j = periodic ? entry & NEIGHBOUR_MASK : entry;
        const double *xi = a->pos[i], *xj = a->pos[j];
        double dx = xi[0] - xj[0], dy = xi[1] - xj[1], dz = xi[2] - xj[2];
        if (periodic) {
            const double *shift = a->shift[entry >> NEIGHBOUR_BITS];
            dx -= shift[0];
            dy -= shift[1];
            dz -= shift[2];
        }
        b->j[c] = j;
        b->dx[c] = dx;
        b->dy[c] = dy;
        b->dz[c] = dz;
        const vec4 *vi = (const vec4 *)a->vel[i], *vj = (const vec4 *)a->vel[j];
        *(vec4 *)b->velocity[c] = vi[0] - vj[0];
        *(vec4 *)b->spin[c] = vi[1] + vj[1];
        const vec4 *old = (const vec4 *)s->spring[ring_at(s, b->old[c])];
        *(vec4 *)b->spring[c] = *(b->was[c] ? old : &none);
        if (uniform) continue;
        b->reach[c] = xi[3] + xj[3];
        b->uneven[c] = xi[3] - xj[3];
        *(vec4 *)b->twist[c] = (vi[1] - vj[1]) * b->uneven[c];
        b->mass[c] = 1 / (a->vel[i][3] + a->vel[j][3]);
        b->radius[c] = a->pos[i][3] * a->pos[j][3] / b->reach[c];
        if (!one) b->q[c] = job->table[a->material[i] * job->n_material + a->material[j]];
    }
}

/* Copies of the last pair up to whole vectors. */
DEM_INLINE int fill_up(block *b, int uniform, int one)
{
    const int last = b->n - 1, whole = (b->n + WIDE - 1) / WIDE * WIDE;
    for (int c = b->n; c < whole; c++) {
        b->dx[c] = b->dx[last];
        b->dy[c] = b->dy[last];
        b->dz[c] = b->dz[last];
        b->d2[c] = b->d2[last];
        *(vec4 *)b->velocity[c] = *(vec4 *)b->velocity[last];
        *(vec4 *)b->spin[c] = *(vec4 *)b->spin[last];
        *(vec4 *)b->spring[c] = *(vec4 *)b->spring[last];
        if (uniform) continue;
        b->reach[c] = b->reach[last];
        b->uneven[c] = b->uneven[last];
        *(vec4 *)b->twist[c] = *(vec4 *)b->twist[last];
        b->mass[c] = b->mass[last];
        b->radius[c] = b->radius[last];
        if (!one) b->q[c] = b->q[last];
    }
    return whole / WIDE;
}

/* `x`, a literal NULL in the plain loops, keeps what the extras ask for. */
DEM_INLINE void apply_law(block *restrict b, extra_block *restrict x, const pair_forces *job,
                          dem_law law, int uniform, int one)
{
    const coefficient only = uniform ? job->only : job->table[0];
    const double mass = .5 * job->mass, radius = .5 * job->radius, dt = job->dt;
    const double reach = 2 * job->radius;
    const int n = WIDE * fill_up(b, uniform, one);
    for (int c = 0; c < n; c++) {
        double d = sqrt(b->d2[c]), per_d = 1 / d;
        double nx = b->dx[c] * per_d, ny = b->dy[c] * per_d, nz = b->dz[c] * per_d;
        double overlap = (uniform ? reach : b->reach[c]) - d;
        double wx = d * b->spin[c][0], wy = d * b->spin[c][1], wz = d * b->spin[c][2];
        double uneven = 0;
        if (!uniform) {
            wx += b->twist[c][0];
            wy += b->twist[c][1];
            wz += b->twist[c][2];
            uneven = b->uneven[c];
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
        spring s = {b->spring[c][0], b->spring[c][1], b->spring[c][2], b->spring[c][3]};
        contact_force f = law_force(law, one ? only : b->q[c], t, dt, &s);
        if (x) {
            x->normal[c] = f.normal;
            x->elastic[c] = f.elastic;
            x->slides[c] = f.slides;
        }
        b->overlap[c] = overlap;
        b->spring[c][0] = s.x;
        b->spring[c][1] = s.y;
        b->spring[c][2] = s.z;
        b->spring[c][3] = s.a;
        b->force[c][0] = f.x;
        b->force[c][1] = f.y;
        b->force[c][2] = f.z;
        b->force[c][3] = 0;
        double li = .5 * (d + uneven); /* T_i = (x_c - x_i) x F = -l_i n x F_t */
        b->torque[c][0] = li * (nz * f.ty - ny * f.tz);
        b->torque[c][1] = li * (nx * f.tz - nz * f.tx);
        b->torque[c][2] = li * (ny * f.tx - nx * f.ty);
        b->torque[c][3] = 0;
        if (!uniform) b->lever[c] = (d - uneven) / (d + uneven);
    }
}

/* What models beyond the plain law add to pair c, whose place in the ring is `at`. */
static void scatter_extra(const block *b, const extra_block *x, const arrays *a,
                          const contact_stream *s, int c, size_t at)
{
    double *ti = a->force[b->i[c]] + 4, *tj = a->force[b->j[c]] + 4;
    for (int k = 0; k < 3; k++) {
        ti[k] += x->torque[c][k];
        tj[k] -= x->torque[c][k];
    }
    if (s->rolling) memcpy(s->rolling[at], x->rolling[c], sizeof x->rolling[c]);
}

/* Pair by pair, all of a pair at once: which pairs share a block is not the same on every number of
 * ranks, and must not decide the order of a sum. */
DEM_INLINE void scatter(const block *b, const extra_block *x, const arrays *a,
                        const contact_stream *s, int uniform)
{
    size_t at = s->to + s->written;
    for (int c = 0; c < b->n; c++, at++) {
        vec4 *fi = (vec4 *)a->force[b->i[c]], *fj = (vec4 *)a->force[b->j[c]];
        vec4 f = *(const vec4 *)b->force[c], t = *(const vec4 *)b->torque[c];
        if (at >= s->size) at -= s->size;
        *(vec4 *)s->spring[at] = *(const vec4 *)b->spring[c];
        fi[0] += f;
        fi[1] += t;
        fj[0] -= f;
        fj[1] += uniform ? t : t * b->lever[c];
        if (x) scatter_extra(b, x, a, s, c, at);
    }
}

/* ---- extras ---------------------------------------------------------------------------------- */

static void gather_extra(const block *b, extra_block *x, const contact_stream *s)
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
    const double *vi = a->vel[i], *vj = a->vel[j], *f = b->force[c], *s = b->spring[c];
    double d = sqrt(b->d2[c]), fn = x->normal[c];
    extra_contact e = {.c = {.nx = b->dx[c] / d,
                             .ny = b->dy[c] / d,
                             .nz = b->dz[c] / d,
                             .overlap = b->overlap[c],
                             .mass = b->mass[c],
                             .radius = b->radius[c],
                             .steepness = 1},
                       .q = b->q[c],
                       .dt = job->dt,
                       .inertia = 1 / (vi[7] + vj[7]),
                       .wx = vi[4] - vj[4],
                       .wy = vi[5] - vj[5],
                       .wz = vi[6] - vj[6],
                       .area = lens_area(a->pos[i][3], a->pos[j][3], d),
                       .after = {s[0], s[1], s[2], s[3]}};
    e.r = job->extras->table[a->material[i] * job->n_material + a->material[j]];
    s = x->before[c];
    e.before = (spring){s[0], s[1], s[2], s[3]};
    e.f = (contact_force){.tx = f[0] - fn * e.c.nx,
                          .ty = f[1] - fn * e.c.ny,
                          .tz = f[2] - fn * e.c.nz,
                          .normal = fn,
                          .elastic = x->elastic[c],
                          .slides = x->slides[c]};
    return e;
}

static void apply_extra(block *b, extra_block *x, const arrays *a, pair_forces *job)
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
            b->force[c][k] -= g.attraction * n[k];
            x->torque[c][k] = g.torque[k];
        }
        if (!kept) continue;
        const double d = sqrt(b->d2[c]), uneven = b->uneven[c];
        const double lever[2] = {.5 * (d + uneven), .5 * (d - uneven)};
        book_pair(kept, a->n_own, who, n, lever, &g);
    }
}

/* ---- the loop -------------------------------------------------------------------------------- */

/* Largest overlap / smaller radius in the block: r_j = (reach - uneven)/2. */
static void survey(const block *b, pair_forces *job, int uniform)
{
    for (int c = 0; c < b->n; c++) {
        double smaller = uniform ? job->radius : .5 * (b->reach[c] - fabs(b->uneven[c]));
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
    if (!b->n || s->failed) return;
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
    b.n = 0;
    for (size_t r = first; r < last; r++) {
        const size_t i = a->slot ? a->slot[r] : r;
        for (size_t k = a->row[r], row_end = a->row[r + 1]; k < row_end;) {
            size_t room = (size_t)(BLOCK - b.n);
            size_t end = row_end - k > room ? k + room : row_end;
            detect(&b, a, s, i, k, end, uniform, 2 * job->radius, periodic);
            if (b.n == BLOCK) {
                flush(&b, x, a, s, job, law, uniform, one, periodic);
                b.n = 0;
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
    const int plain = job->uniform ? EQUAL : job->n_material == 1 ? ALIKE : ANY;
    pair_kernel *kernel =
        choose(job->vectors, job->law, job->extras ? EXTRA : plain, list->any_periodic);
    kernel(job, &a, &loop->springs, begin, end);
}

dem_status forces_close(force_loop *loop)
{
    return contacts_close(&loop->springs, loop->list);
}
