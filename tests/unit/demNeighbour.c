/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demNeighbour.c - the neighbour list against brute force; sorting, history, columns, order.
 *
 * Contacts are looked at through the public face only: what the list misses is a force missed.
 */
#include "demRig.h"

#include <gsl/gsl_rng.h>
#include <stdlib.h>

enum { MANY = 300 };

typedef struct crowd {
    size_t n;
    double x[MANY][3], v[MANY][3], radius[MANY];
    int material[MANY];
    int64_t id[MANY];
} crowd;

enum { MIXED, EQUAL, DUST }; /* radii R to .3 R, R alone, R to R/20, each factor as frequent */

/* Nearer than nine tenths of touching nobody is placed. */
static int crowded(const crowd *c, size_t i, const double lo[3], const double hi[3])
{
    for (size_t j = 0; j < i; j++) {
        double d2 = 0, s = .9 * (c->radius[i] + c->radius[j]);
        for (int a = 0; a < 3; a++) {
            /* As if all sides were periodic. */
            double d = fabs(c->x[i][a] - c->x[j][a]), L = hi[a] - lo[a];
            d = fmin(d, L - d);
            d2 += d * d;
        }
        if (d2 < s * s) return 1;
    }
    return 0;
}

static void make_crowd(crowd *c, unsigned seed, size_t n, const double lo[3], const double hi[3],
                       double R, double speed, int sizes)
{
    c->n = n;
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, seed);
    for (size_t i = 0; i < n; i++) {
        /* the large ones first, while there is room */
        c->radius[i] = sizes == EQUAL   ? R
                       : sizes == MIXED ? R * (.3 + .7 * gsl_rng_uniform(rng))
                                        : R * pow(20, -(double)i / (double)(n - 1));
        c->material[i] = sizes == EQUAL ? 0 : (int)gsl_rng_uniform_int(rng, 2);
        c->id[i] = 7 * (int64_t)i + 3;
        do
            for (int a = 0; a < 3; a++) {
                c->x[i][a] = lo[a] + (hi[a] - lo[a]) * gsl_rng_uniform(rng);
                c->v[i][a] = speed * (gsl_rng_uniform(rng) - .5);
            }
        while (crowded(c, i, lo, hi));
    }
    gsl_rng_free(rng);
}

static void add_crowd(rig *r, const crowd *c)
{
    if (dem_add(r->sim, c->n, c->x, c->v, NULL, c->radius, c->material, c->id))
        fail_msg("%s", dem_message(r->sim));
}

/* Pairs that overlap, and the force of each on each, by looking at all of them. */
static int64_t brute_force(const rig *r, const dem_view *p, double (*force)[3], double k)
{
    int64_t found = 0;
    memset(force, 0, p->n * sizeof *force);
    for (size_t i = 0; i < p->n; i++)
        for (size_t j = i + 1; j < p->n; j++) {
            double d[3], d2 = 0, reach = p->radius[i] + p->radius[j];
            for (int a = 0; a < 3; a++) {
                double L = r->param.hi[a] - r->param.lo[a];
                d[a] = p->x[i][a] - p->x[j][a];
                if (r->param.periodic[a]) d[a] -= L * nearbyint(d[a] / L);
                d2 += d[a] * d[a];
            }
            if (d2 >= reach * reach) continue;
            found++;
            double f = k * (reach - sqrt(d2)) / sqrt(d2);
            for (int a = 0; a < 3; a++) {
                force[i][a] += f * d[a];
                force[j][a] -= f * d[a];
            }
        }
    return found;
}

/* Walls at the sides that are not periodic; the domain is the net behind them. */
static void enclose(rig *r, double side, int periodic_mask)
{
    for (int a = 0; a < 3; a++) {
        double lo[3] = {-1, -1, -1}, hi[3] = {1, 1, 1};
        r->param.periodic[a] = periodic_mask >> a & 1;
        if (r->param.periodic[a]) continue;
        r->param.lo[a] *= 1.2;
        r->param.hi[a] *= 1.2;
        lo[a] = -side;
        hi[a] = side;
        r->wall[r->param.n_wall++].shape = dem_sdf_box(lo, hi, 1);
    }
}

/* One step, its forces against those of all pairs and walls at its beginning. Returns contacts. */
static int64_t check_step(rig *r, double side, double k, double size)
{
    static double expected[MANY][3], by_id[7 * MANY + 3][3];
    dem_view p = dem_particles(r->sim);
    int64_t found = brute_force(r, &p, expected, k);
    for (size_t i = 0; i < p.n; i++)
        for (int a = 0; a < 3; a++) {
            double x = p.x[i][a];
            double sink = r->param.periodic[a] ? 0 : fabs(x) + p.radius[i] - side;
            /* By id: the step may sort. */
            by_id[p.id[i]][a] = expected[i][a] + (sink > 0 ? (x > 0 ? -k : k) * sink : 0);
        }
    rig_advance(r, 2e-5, 1);
    assert_int_equal(dem_last_report(r->sim).contacts, found);
    p = dem_particles(r->sim);
    for (size_t i = 0; i < p.n; i++)
        for (int a = 0; a < 3; a++) assert_within(p.force[i][a], by_id[p.id[i]][a], 1e-11 * size);
    return found;
}

/* Elastic and smooth, so that the force follows from the positions. */
static void compare(double box, int periodic_mask, int sizes, double skin)
{
    rig r;
    /* The smallest are to be pushed away within some steps, the largest not to pass each other. */
    const double R = 1e-3, k = sizes == DUST ? 1 : 700, side = .5 * box * R;
    const double speed = sizes == DUST ? .2 : 1;
    rig_init(&r, DEM_LINEAR, side);
    rig_pairs(&r, 1, 0, k, 1);
    r.param.skin = skin;
    enclose(&r, side, periodic_mask);
    rig_start(&r);
    static crowd c;
    double lo[3], hi[3], room = 1;
    for (int a = 0; a < 3; a++) {
        hi[a] = side - (r.param.periodic[a] ? 0 : R);
        lo[a] = -hi[a];
        room *= (hi[a] - lo[a]) / R;
    }
    double fill = sizes == DUST ? MANY : .3 * room / (4. / 3 * M_PI);
    make_crowd(&c, 11, fill < MANY ? (size_t)fill : MANY, lo, hi, R, speed, sizes);
    add_crowd(&r, &c);
    int64_t most = 0;
    for (int s = 0; s < 120; s++) {
        int64_t found = check_step(&r, side, k, k * R);
        most = found > most ? found : most;
    }
    if (most < (int64_t)c.n / 40 || most == 0) fail_msg("%ld contacts of %zu", (long)most, c.n);
    assert_true(dem_last_report(r.sim).rebuilds > 3);
    dem_free(r.sim);
}

static void against_brute_force(void **state)
{
    (void)state;
    for (int mask = 0; mask < 8; mask++) {
        compare(16, mask, MIXED, .15);
        compare(16, mask, EQUAL, .15);
        compare(9, mask, DUST, .15);
    }
    /* Periodic boxes with three, with two and with hardly two cells. */
    compare(7.5, 7, EQUAL, .15);
    compare(4.61, 7, EQUAL, .15);
    compare(4.61, 7, MIXED, .15);
    compare(5.3, 5, MIXED, .3);
}

static void small_periodic_box_is_refused(void **state)
{
    (void)state;
    rig r;
    rig_init(&r, DEM_LINEAR, 2.2e-3);
    r.param.periodic[1] = 1;
    rig_start(&r);
    const double x[1][3] = {{0, 0, 0}}, radius = 1e-3;
    const int material = 0;
    assert_int_equal(dem_add(r.sim, 1, x, NULL, NULL, &radius, &material, NULL), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "direction y must be at least 0.0046 m"));
    dem_free(r.sim);
}

/* ---- nothing depends on the order of input, on sorting or on when the list is built ------------
 */

static void start_mixed(rig *r, dem_law law, double skin, int periodic)
{
    const double R = 1e-3;
    rig_init(r, law, 7 * R);
    rig_hertz(r, 5e7, .3, 2500);
    r->material[1].youngs_modulus = 2e7;
    rig_pairs(r, .8, .5, 700, .8);
    r->param.skin = skin;
    r->param.gravity[2] = -60;
    r->param.periodic[0] = periodic;
    if (!periodic) r->param.lo[0] = -(r->param.hi[0] = .02);
    r->param.lo[1] = r->param.lo[2] = -.02;
    r->param.hi[1] = r->param.hi[2] = .02;
    r->wall[0].shape = dem_sdf_box((const double[3]){periodic ? -1 : -.007, -.007, -.007},
                                   (const double[3]){periodic ? 1 : .007, .007, .007}, 1);
    r->param.n_wall = 1;
    rig_start(r);
}

static void run_crowd(dem_law law, double skin, int periodic, unsigned shuffle, int steps,
                      double (*x)[3])
{
    rig r;
    start_mixed(&r, law, skin, periodic);
    static crowd c, d;
    const double lo[3] = {-.0065, -.0065, -.0065}, hi[3] = {.0065, .0065, .0065};
    make_crowd(&c, 5, MANY, lo, hi, 1e-3, .3, 0);
    d = c;
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, shuffle);
    for (int i = MANY - 1; i > 0 && shuffle; i--) {
        int j = (int)gsl_rng_uniform_int(rng, (unsigned long)i + 1);
        crowd *q = &d;
        for (int a = 0; a < 3; a++) {
            double t = q->x[i][a];
            q->x[i][a] = q->x[j][a];
            q->x[j][a] = t;
            t = q->v[i][a];
            q->v[i][a] = q->v[j][a];
            q->v[j][a] = t;
        }
        double t = q->radius[i];
        q->radius[i] = q->radius[j];
        q->radius[j] = t;
        int m = q->material[i];
        q->material[i] = q->material[j];
        q->material[j] = m;
        int64_t id = q->id[i];
        q->id[i] = q->id[j];
        q->id[j] = id;
    }
    gsl_rng_free(rng);
    add_crowd(&r, &d);
    rig_advance(&r, 4e-6 * steps, steps);
    dem_view p = dem_particles(r.sim);
    for (size_t i = 0; i < p.n; i++) memcpy(x[(p.id[i] - 3) / 7], p.x[i], sizeof *x);
    if (dem_last_report(r.sim).contacts < 10)
        fail_msg("%ld contacts", (long)dem_last_report(r.sim).contacts);
    dem_free(r.sim);
}

static void order_of_input(void **state)
{
    (void)state;
    static double a[MANY][3], b[MANY][3];
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int periodic = 0; periodic < 2; periodic++) {
            run_crowd((dem_law)law, .15, periodic, 0, 3750, a);
            run_crowd((dem_law)law, .15, periodic, 99, 3750, b);
            assert_memory_equal(a, b, sizeof a); /* to the last bit */
        }
}

/* Another skin means other rebuilds and another order: only rounding may differ, so histories
 * must have come through every one of them. */
static void history_over_rebuilds(void **state)
{
    (void)state;
    static double a[MANY][3], b[MANY][3];
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int periodic = 0; periodic < 2; periodic++) {
            run_crowd((dem_law)law, .02, periodic, 0, 750, a);
            run_crowd((dem_law)law, .9, periodic, 0, 750, b);
            double worst = 0;
            for (int i = 0; i < MANY; i++)
                for (int d = 0; d < 3; d++) worst = fmax(worst, fabs(a[i][d] - b[i][d]));
            assert_true(worst < 1e-9 * 1e-3);
        }
}

/* Particles added later must not disturb the histories of those that touch. */
static void history_over_adding(void **state)
{
    (void)state;
    double x[2][2];
    for (int add = 0; add < 2; add++) {
        rig r;
        const double R = 1e-3;
        rig_init(&r, DEM_LINEAR, .1);
        rig_pairs(&r, .5, 1e6, 700, .8);
        r.param.gravity[0] = 4;
        r.param.gravity[2] = -9.81;
        rig_floor(&r);
        rig_start(&r);
        rig_ball(&r, R, 0, 0, R, 0, 0, 0);
        rig_ball(&r, R, 0, 1.999 * R, R, 0, 0, 0);
        rig_advance(&r, 3e-3, 400);
        /* Far away, and sorted before the others. */
        if (add) rig_ball(&r, .9 * R, -.05, -.05, .01, 0, 0, 0);
        rig_advance(&r, 3e-3, 400);
        dem_view p = dem_particles(r.sim);
        for (size_t i = 0; i < p.n; i++)
            if (p.id[i] < 2) x[add][p.id[i]] = p.x[i][0];
        dem_free(r.sim);
    }
    for (int i = 0; i < 2; i++) assert_close(x[1][i], x[0][i], 1e-7);
}

static void columns_follow(void **state)
{
    (void)state;
    rig r;
    start_mixed(&r, DEM_LINEAR, .1, 1);
    int before = dem_attach(r.sim, "liquid", 1);
    static crowd c;
    const double lo[3] = {-.0065, -.0065, -.0065}, hi[3] = {.0065, .0065, .0065};
    make_crowd(&c, 5, MANY, lo, hi, 1e-3, .3, 0);
    add_crowd(&r, &c);
    int after = dem_attach(r.sim, "label", 3);
    assert_true(before >= 0 && after >= 0 && before != after);
    dem_view p = dem_particles(r.sim);
    uint64_t revision = p.revision;
    double *one = dem_column(r.sim, before), *three = dem_column(r.sim, after);
    for (size_t i = 0; i < p.n; i++) {
        assert_true(one[i] == 0 && three[3 * i + 2] == 0);
        one[i] = 2.5 * (double)p.id[i];
        for (int a = 0; a < 3; a++) three[3 * i + (size_t)a] = (double)(10 * p.id[i] + a);
    }
    rig_advance(&r, 5e-3, 0);
    rig_ball(&r, 1e-3, 0, 0, 0, 0, 0, 0); /* grows the store; id is one more than the largest */
    rig_advance(&r, 5e-3, 0);
    p = dem_particles(r.sim);
    assert_true(p.n == MANY + 1 && p.revision != revision);
    one = dem_column(r.sim, before);
    three = dem_column(r.sim, after);
    int moved = 0;
    for (size_t i = 0; i < p.n; i++) {
        int64_t id = p.id[i];
        int late = id == 7 * (MANY - 1) + 3 + 1;
        assert_true(one[i] == (late ? 0 : 2.5 * (double)id));
        assert_true(three[3 * i + 1] == (late ? 0 : (double)(10 * id + 1)));
        moved += id != c.id[i % MANY];
    }
    assert_true(moved > MANY / 2);
    assert_int_equal(dem_attach(r.sim, "none", 0), -1);
    assert_null(dem_column(r.sim, 7));
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(against_brute_force), cmocka_unit_test(small_periodic_box_is_refused),
        cmocka_unit_test(order_of_input),      cmocka_unit_test(history_over_rebuilds),
        cmocka_unit_test(history_over_adding), cmocka_unit_test(columns_follow)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
