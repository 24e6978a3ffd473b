/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demContact.c - the force and the history of a pair are its own, whatever else is in the list.
 *
 * Pairs of spheres that meet and part at random. Each is summed in a list of its own and together
 * with all the others, in blocks of every length: forces, torques and springs must agree to the
 * last bit, whatever stretches the list is summed in, over many sums, over rebuilds that put the
 * pairs in another order, and while contacts form faster than the ring of springs is wide.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "../../src/demC/dem_internal.h" /* before cmocka.h, which has a fail() of its own */

#include <cmocka.h>
#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>

#include "../../src/demC/contact.h"
#include "../../src/demC/force.h"
#include "../../src/demC/material.h"

enum { MOST = 4000 };

/* Pairs k of the particles 2k and 2k + 1, and a list of them. */
typedef struct set {
    particles p;
    neighbour list;
    contacts c;
    size_t *row;
    uint32_t *entry, *place;
} set;

static void set_init(set *s, size_t pairs, int rolls)
{
    static const double box[3] = {1, 1, 1}, zero[3] = {0, 0, 0};
    static const int no[3] = {0, 0, 0};
    memset(s, 0, sizeof *s);
    assert_int_equal(particles_init(&s->p), DEM_OK);
    assert_int_equal(particles_reserve(&s->p, 2 * pairs), DEM_OK);
    neighbour_init(&s->list, zero, box, no, 0);
    s->row = s->list.row = calloc(2 * pairs + 1, sizeof *s->row);
    s->entry = s->list.entry = calloc(pairs + NEIGHBOUR_SPARE, sizeof *s->entry);
    s->place = s->list.place = calloc(2 * pairs, sizeof *s->place);
    s->list.n_row = s->p.n = 2 * pairs;
    for (size_t k = 0; k < pairs; k++) {
        s->row[2 * k + 1] = s->row[2 * k + 2] = k + 1;
        s->entry[k] = (uint32_t)(2 * k + 1);
        s->place[2 * k] = (uint32_t)(2 * k);
        s->place[2 * k + 1] = (uint32_t)(2 * k + 1);
    }
    s->c.rolls = rolls;
    assert_int_equal(contacts_restore(&s->c, &s->list), DEM_OK);
}

static void set_free(set *s)
{
    particles_free(&s->p);
    contacts_free(&s->c);
    neighbour_free(&s->list);
}

/* One state of a pair. */
typedef struct state {
    double pos[2][4], vel[2][8], force[2][8];
    int material[2];
} state;

static double scatter(gsl_rng *rng, double size)
{
    return size * (2 * gsl_rng_uniform(rng) - 1);
}

/* A pair at random that touches, or does not. */
static void draw(gsl_rng *rng, state *s, int uniform, int materials, int touches)
{
    double n[3], length = 0;
    for (int a = 0; a < 3; a++) {
        n[a] = scatter(rng, 1);
        length += n[a] * n[a];
    }
    for (int i = 0; i < 2; i++) {
        s->pos[i][3] = 1e-3 * (uniform ? 1 : 1 + i * .37);
        s->material[i] = i % materials;
        const double r = s->pos[i][3], mass = 2500 * 4. / 3 * M_PI * r * r * r;
        for (int a = 0; a < 3; a++) {
            s->vel[i][a] = scatter(rng, 1);
            s->vel[i][4 + a] = scatter(rng, 1e3);
        }
        s->vel[i][3] = 1 / mass;
        s->vel[i][7] = 2.5 / (mass * r * r);
    }
    const double reach = s->pos[0][3] + s->pos[1][3];
    const double d = reach * (touches ? 1 - .02 * gsl_rng_uniform(rng) : 1.05);
    for (int a = 0; a < 3; a++) {
        s->pos[0][a] = scatter(rng, .1);
        s->pos[1][a] = s->pos[0][a] - d * n[a] / sqrt(length);
    }
}

static void to_row(set *s, size_t k, const state *from)
{
    for (size_t i = 0; i < 2; i++) {
        memcpy(s->p.pos[2 * k + i], from->pos[i], sizeof from->pos[i]);
        memcpy(s->p.vel[2 * k + i], from->vel[i], sizeof from->vel[i]);
        memset(s->p.force[2 * k + i], 0, sizeof from->force[i]);
        s->p.material[2 * k + i] = from->material[i];
    }
}

typedef struct task {
    pair_forces job;
    coefficient table[4];
    resistance resistance[4];
    extras extras;
    size_t pairs;
    set together, alone[MOST];
    uint32_t where[MOST]; /* of a pair in the list of all */
} task;

static void task_init(task *t, dem_law law, int kind, size_t pairs)
{
    const dem_material m = {.density = 2500, .youngs_modulus = 1e7, .poisson_ratio = .3};
    const dem_pair pair = {.restitution = .6,
                           .friction = .4,
                           .stiffness = 1000,
                           .stiffness_ratio = .8,
                           .rolling_friction = .1,
                           .rolling_damping = .2,
                           .cohesion = 1e5};
    const int extra = kind == 2;
    t->pairs = pairs;
    for (int k = 0; k < 4; k++) {
        t->table[k] = coefficient_of_pair(law, &m, &m, &pair);
        t->resistance[k] = resistance_of_pair(&pair);
    }
    t->extras = (extras){.law = law,
                         .rolling = DEM_ROLLING_EPSD,
                         .cohesion = DEM_COHESION_SJKR,
                         .table = t->resistance};
    t->job = (pair_forces){.law = law,
                           .vectors = force_vectors(),
                           .table = t->table,
                           .n_material = 2,
                           .one_material = kind == 0 || kind == 3,
                           .uniform = kind == 0,
                           .mass = 2500 * 4. / 3 * M_PI * 1e-9,
                           .radius = 1e-3,
                           .only = t->table[0],
                           .dt = 1e-5,
                           .extras = extra ? &t->extras : NULL};
    set_init(&t->together, pairs, extra);
    for (size_t k = 0; k < pairs; k++) {
        set_init(&t->alone[k], 1, extra);
        t->where[k] = (uint32_t)k;
    }
}

static void task_free(task *t)
{
    set_free(&t->together);
    for (size_t k = 0; k < t->pairs; k++) set_free(&t->alone[k]);
}

static size_t sum_forces(const pair_forces *job, set *s, size_t stretch)
{
    pair_forces now = *job;
    force_loop loop = forces_open(&now, &s->p, &s->list, &s->c);
    for (size_t begin = 0; begin < s->list.n_row; begin += stretch)
        forces_of_rows(&loop, begin,
                       begin + stretch < s->list.n_row ? begin + stretch : s->list.n_row);
    assert_int_equal(forces_close(&loop), DEM_OK);
    return now.contacts;
}

/* New positions; forces of all, together and alone, must be equal. */
static void compare_sum(task *t, gsl_rng *rng, double share)
{
    const pair_forces job = t->job;
    size_t contacts = 0;
    for (size_t k = 0; k < t->pairs; k++) {
        state s;
        draw(rng, &s, job.uniform, job.one_material ? 1 : 2, gsl_rng_uniform(rng) < share);
        to_row(&t->alone[k], 0, &s);
        to_row(&t->together, t->where[k], &s);
        contacts += sum_forces(&job, &t->alone[k], 1);
    }
    const size_t stretch = 1 + gsl_rng_uniform_int(rng, 2 * t->together.list.n_row);
    assert_int_equal(sum_forces(&job, &t->together, stretch), contacts);
    assert_int_equal(t->together.c.n, contacts);
    for (size_t k = 0; k < t->pairs; k++)
        for (size_t i = 0; i < 2; i++)
            assert_memory_equal(t->together.p.force[2 * t->where[k] + i], t->alone[k].p.force[i],
                                sizeof(double[8]));
}

/* Rebuild: pair k goes to where[k]. */
static void reorder(task *t, gsl_rng *rng)
{
    set *s = &t->together;
    assert_int_equal(contacts_save(&s->c, &s->list), DEM_OK);
    uint32_t to[MOST], before[MOST];
    for (size_t k = 0; k < t->pairs; k++) to[k] = (uint32_t)k;
    gsl_ran_shuffle(rng, to, t->pairs, sizeof *to);
    memcpy(before, t->where, sizeof before);
    for (size_t k = 0; k < t->pairs; k++) {
        t->where[k] = to[k];
        for (uint32_t i = 0; i < 2; i++) s->place[2 * before[k] + i] = 2 * to[k] + i;
    }
    assert_int_equal(contacts_restore(&s->c, &s->list), DEM_OK);
}

static void as_if_alone(dem_law law, int kind)
{
    static task t;
    static const size_t sizes[] = {1, 3, 8, 13, 127, 130, 300, MOST};
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (size_t n = 0; n < sizeof sizes / sizeof *sizes; n++) {
        task_init(&t, law, kind, sizes[n]);
        const double share[] = {0, .02, 1, .7, .1, .6, .99, .5, 0, .3, 1, 1, .9, .95};
        for (size_t s = 0; s < sizeof share / sizeof *share; s++) {
            compare_sum(&t, rng, share[s]);
            if (s % 4 == 3) reorder(&t, rng);
        }
        task_free(&t);
    }
    gsl_rng_free(rng);
}

static void linear_equal(void **state)
{
    (void)state;
    as_if_alone(DEM_LINEAR, 0);
}

static void linear_different(void **state)
{
    (void)state;
    as_if_alone(DEM_LINEAR, 1);
}

static void linear_one_material(void **state)
{
    (void)state;
    as_if_alone(DEM_LINEAR, 3);
}

static void linear_with_more(void **state)
{
    (void)state;
    as_if_alone(DEM_LINEAR, 2);
}

static void hertz_equal(void **state)
{
    (void)state;
    as_if_alone(DEM_HERTZ, 0);
}

static void hertz_different(void **state)
{
    (void)state;
    as_if_alone(DEM_HERTZ, 1);
}

static void hertz_one_material(void **state)
{
    (void)state;
    as_if_alone(DEM_HERTZ, 3);
}

static void hertz_with_more(void **state)
{
    (void)state;
    as_if_alone(DEM_HERTZ, 2);
}

/* Where the order within a pair is turned about, so is the sign of its springs. */
static void turned_about(void **state)
{
    (void)state;
    set s;
    set_init(&s, 2, 1);
    const saved_contact in[2] = {{{1, 2, 3, 4}, {5, 6, 7, 8}, 1, 0},
                                 {{9, 10, 11, 12}, {13, 14, 15, 16}, 2, 3}};
    for (int k = 0; k < 2; k++) assert_int_equal(contacts_append(&s.c, &in[k]), DEM_OK);
    /* Twice the same, as only a file that is wrong could have it. */
    assert_int_equal(contacts_append(&s.c, &in[1]), DEM_OK);
    assert_int_equal(contacts_restore(&s.c, &s.list), DEM_OK);
    assert_int_equal(contacts_save(&s.c, &s.list), DEM_OK);
    assert_int_equal(s.c.n, 2);
    const saved_contact a = contacts_get(&s.c, 0), b = contacts_get(&s.c, 1);
    assert_true(a.i == 0 && a.j == 1 && b.i == 2 && b.j == 3);
    const double turned[2][4] = {{-1, -2, -3, 4}, {-5, -6, -7, 8}};
    assert_memory_equal(a.spring, turned[0], sizeof a.spring);
    assert_memory_equal(a.rolling, turned[1], sizeof a.rolling);
    assert_memory_equal(b.spring, in[1].spring, sizeof b.spring);
    assert_memory_equal(b.rolling, in[1].rolling, sizeof b.rolling);
    /* One partner goes, and the history with it. */
    const uint32_t place[4] = {0, UINT32_MAX, 1, 2};
    contacts_renumber(&s.c, place);
    assert_int_equal(s.c.n, 1);
    const saved_contact left = contacts_get(&s.c, 0);
    assert_true(left.i == 1 && left.j == 2);
    assert_memory_equal(left.spring, in[1].spring, sizeof left.spring);
    set_free(&s);
}

/* A simulation sums with the widest vectors that the machine has: only speed would tell. */
static void widest_vectors(void **state)
{
    (void)state;
    dem_param p = dem_param_default();
    for (int a = 0; a < 3; a++) p.hi[a] = 1;
    dem_sim *sim;
    assert_int_equal(dem_new(MPI_COMM_WORLD, &p, &sim), DEM_OK);
    assert_int_equal(sim->vectors, force_vectors());
    dem_free(sim);
}

/* Two spheres of different sizes that overlap and slide, of the material `m` of n; where the first
 * is after a step. */
static void push_apart(int n, const dem_material *material, const dem_pair *pair, int m,
                       double after[3])
{
    dem_param p = dem_param_default();
    for (int a = 0; a < 3; a++) p.hi[a] = .02;
    p.n_material = n;
    p.material = material;
    p.pair = pair;
    dem_sim *sim;
    assert_int_equal(dem_new(MPI_COMM_WORLD, &p, &sim), DEM_OK);
    const double x[2][3] = {{.01, .01, .01}, {.0129, .01, .01}}, r[2] = {1e-3, 2e-3};
    const double v[2][3] = {{0, .1, 0}, {0, -.1, 0}};
    const int of[2] = {m, m};
    assert_int_equal(dem_add(sim, 2, x, v, NULL, r, of, NULL), DEM_OK);
    assert_true(sim->one_material && sim->the_material == m && !sim->uniform);
    assert_int_equal(dem_advance(sim, 1e-5, 1), DEM_OK);
    memcpy(after, dem_particles(sim).x[0], sizeof(double[3]));
    const double far[1][3] = {{.002, .002, .002}};
    const int other[1] = {0};
    assert_int_equal(dem_add(sim, 1, far, NULL, NULL, r, other, NULL), DEM_OK);
    assert_int_equal(sim->one_material, m == 0);
    dem_free(sim);
}

/* That there are materials which no particle has, for walls, changes nothing. */
static void materials_without_particles(void **state)
{
    (void)state;
    const dem_material two[2] = {{.density = 1000, .youngs_modulus = 1e6, .poisson_ratio = .3},
                                 {.density = 2500, .youngs_modulus = 1e7, .poisson_ratio = .3}};
    const dem_pair soft = {
        .restitution = .3, .friction = .1, .stiffness = 100, .stiffness_ratio = 1};
    const dem_pair stiff = {
        .restitution = .9, .friction = .5, .stiffness = 1000, .stiffness_ratio = 1};
    const dem_pair pairs[4] = {soft, soft, soft, stiff};
    double alone[3], among[3];
    push_apart(1, two + 1, &stiff, 0, alone);
    push_apart(2, two, pairs, 1, among);
    assert_memory_equal(alone, among, sizeof alone);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_equal),
        cmocka_unit_test(linear_different),
        cmocka_unit_test(linear_with_more),
        cmocka_unit_test(hertz_equal),
        cmocka_unit_test(hertz_different),
        cmocka_unit_test(hertz_with_more),
        cmocka_unit_test(linear_one_material),
        cmocka_unit_test(hertz_one_material),
        cmocka_unit_test(turned_about),
        cmocka_unit_test(widest_vectors),
        cmocka_unit_test(materials_without_particles),
    };
    MPI_Init(&argc, &argv);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
