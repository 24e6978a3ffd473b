/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What fails on one rank fails on all of them, with the same text, and none is left waiting.
 *
 * Lost and NaN particles, wherever they are; arguments that are bad on one rank only; memory that
 * runs out on one rank, at every place in turn. A rank that waits for another would hang: the test
 * has a limit of time.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "ranksFixture.h"

#include <unistd.h>

enum { SIDE = 6, GRAINS = SIDE * SIDE * SIDE };

static const double LENGTH = .03;

/* ---- a cloud without walls ------------------------------------------------------------------- */

typedef struct cloud {
    dem_param param;
    dem_material material;
    dem_pair pair;
    dem_sim *sim;
} cloud;

static void prepare(cloud *c)
{
    memset(c, 0, sizeof *c);
    c->param = dem_param_default();
    for (int a = 0; a < 3; a++) c->param.hi[a] = LENGTH;
    strcpy(c->material.name, "glass");
    c->material.density = 100;
    c->pair = (dem_pair){.restitution = .8, .friction = .3, .stiffness = 200, .stiffness_ratio = 1};
    c->param.n_material = 1;
    c->param.material = &c->material;
    c->param.pair = &c->pair;
}

/* Every status and text is that of the first rank, which has `part` in it. */
static void all_say(const dem_sim *sim, dem_status status, dem_status expected, const char *part)
{
    char here[1024], first[1024];
    snprintf(here, sizeof here, "%d %s", (int)status, status ? dem_message(sim) : "");
    memcpy(first, here, sizeof first);
    MPI_Bcast(first, sizeof first, MPI_CHAR, 0, MPI_COMM_WORLD);
    if (strcmp(here, first) != 0) fail_msg("'%s' here, on rank 0 '%s'", here, first);
    if (status != expected || !strstr(here, part))
        fail_msg("status %d with '%s' expected: %s", (int)expected, part, here);
}

#define assert_all_well(sim, status) all_say(sim, status, DEM_OK, "")

static int turn_of(int k)
{
    return k % world_size() == world_rank();
}

/* Particles on a lattice, each rank handing over some. */
static void fill(cloud *c)
{
    double x[GRAINS][3], radius[GRAINS];
    int material[GRAINS] = {0};
    int64_t id[GRAINS];
    size_t n = 0;
    for (int k = 0; k < GRAINS; k++) {
        if (!turn_of(k)) continue;
        const int at[3] = {k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE};
        for (int a = 0; a < 3; a++) x[n][a] = LENGTH * (at[a] + .5) / SIDE;
        radius[n] = .0024;
        id[n++] = k;
    }
    assert_all_well(c->sim,
                    dem_add(c->sim, n, (const double(*)[3])x, NULL, NULL, radius, material, id));
}

static void start(cloud *c)
{
    prepare(c);
    const dem_status status = dem_new(MPI_COMM_WORLD, &c->param, &c->sim);
    assert_all_well(c->sim, status);
    fill(c);
    assert_all_well(c->sim, dem_advance(c->sim, 2e-5, 2));
    const dem_report report = dem_last_report(c->sim);
    assert_int_equal(report.particles, GRAINS);
    assert_true(report.ghosts > 0);
}

/* It goes on as if nothing had been. */
static void still_works(cloud *c)
{
    assert_all_well(c->sim, dem_advance(c->sim, 2e-5, 2));
    assert_int_equal(dem_last_report(c->sim).particles, GRAINS);
}

/* A force on one particle, from the rank that has it: which that is. */
static int push(cloud *c, int64_t id, double fx)
{
    const dem_view view = dem_particles(c->sim);
    double(*f)[3] = calloc(view.n + 1, sizeof *f), *k = calloc(view.n + 1, sizeof *k);
    int owner = -1;
    for (size_t i = 0; i < view.n; i++)
        if (view.id[i] == id) {
            f[i][0] = fx;
            owner = world_rank();
        }
    const double(*none)[3] = calloc(view.n + 1, sizeof *none);
    assert_all_well(c->sim, dem_set_outside_force(c->sim, (const double(*)[3])f, k, none, NULL));
    free(f);
    free(k);
    free((void *)none);
    MPI_Allreduce(MPI_IN_PLACE, &owner, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    assert_true(owner >= 0);
    return owner;
}

/* ---- particles that go wrong ----------------------------------------------------------------- */

/* The corners of the lattice; all ranks must have had their turn. */
static void in_every_corner(double force, dem_status expected, const char *part)
{
    int seen[64] = {0}, ranks = 0;
    for (int corner = 0; corner < 8; corner++) {
        cloud c;
        char id[64];
        const int at = (corner & 1 ? SIDE - 1 : 0) + SIDE * (corner & 2 ? SIDE - 1 : 0) +
                       SIDE * SIDE * (corner & 4 ? SIDE - 1 : 0);
        start(&c);
        const int owner = push(&c, at, corner & 1 ? force : -force);
        ranks += !seen[owner]++;
        const dem_status status = dem_advance(c.sim, .05, 0);
        snprintf(id, sizeof id, "particle %d ", at);
        all_say(c.sim, status, expected, id);
        all_say(c.sim, status, expected, part);
        all_say(c.sim, status, expected, "last force");
        dem_free(c.sim);
    }
    print_message("on %d of %d ranks\n", ranks, world_size());
    assert_true(ranks > 1);
}

static void test_lost(void **state)
{
    (void)state;
    in_every_corner(1e-3, DEM_LOST, "has left the domain");
}

static void test_nan(void **state)
{
    (void)state;
    in_every_corner(1e308, DEM_NAN, "");
}

/* ---- bad arguments on one rank --------------------------------------------------------------- */

static void test_bad_force(void **state)
{
    (void)state;
    for (int rank = 0; rank < world_size(); rank++) {
        cloud c;
        start(&c);
        const dem_view view = dem_particles(c.sim);
        double(*f)[3] = calloc(view.n + 1, sizeof *f), *k = calloc(view.n + 1, sizeof *k);
        assert_true(view.n > 0);
        const int bad = world_rank() == rank;
        if (bad) f[view.n / 2][1] = NAN;
        const double(*force)[3] = (const double(*)[3])f;
        all_say(c.sim, dem_set_outside_force(c.sim, force, k, force, NULL), DEM_NAN,
                "outside force on particle");
        f[view.n / 2][1] = 0;
        if (bad) k[0] = -1;
        all_say(c.sim, dem_set_outside_force(c.sim, force, k, force, NULL), DEM_BAD_ARGUMENT,
                "k -1");
        assert_all_well(c.sim, dem_set_outside_force(c.sim, NULL, NULL, NULL, NULL));
        still_works(&c);
        free(f);
        free(k);
        dem_free(c.sim);
    }
}

/* One particle that cannot be, handed over by one rank; the others hand over a good one each, or
 * none. Nothing may come of it. */
static void refuse_one(cloud *c, int rank, const double bad[3], double radius, int64_t id,
                       dem_status expected, const char *part)
{
    const int mine = world_rank() == rank;
    const double step = LENGTH / SIDE;
    const double good[3] = {step * (1 + world_rank()), step, step};
    double x[1][3];
    memcpy(x[0], mine ? bad : good, sizeof good);
    const double r = mine ? radius : .0005;
    const int64_t one = mine ? id : 1000 + world_rank();
    const int material = 0;
    const size_t n = mine || world_rank() % 2;
    all_say(c->sim, dem_add(c->sim, n, (const double(*)[3])x, NULL, NULL, &r, &material, &one),
            expected, part);
}

static void test_bad_add(void **state)
{
    (void)state;
    const double half = LENGTH / SIDE / 2, gap[3] = {2 * half, 2 * half, 2 * half};
    const double outside[3] = {half, half, -1}, first[3] = {half, half, half + 2e-4};
    const double last[3] = {LENGTH - half, LENGTH - half, LENGTH - half + 2e-4};
    cloud c;
    start(&c);
    for (int rank = 0; rank < world_size(); rank++) {
        refuse_one(&c, rank, gap, -1, 2000, DEM_BAD_ARGUMENT, "radius");
        refuse_one(&c, rank, outside, .001, 2000, DEM_LOST, "outside the domain");
        refuse_one(&c, rank, gap, .0005, 7, DEM_BAD_ARGUMENT,
                   "7"); /* a number that another one has */
        refuse_one(&c, rank, first, .001, 2000, DEM_BAD_ARGUMENT, "overlap");
        refuse_one(&c, rank, last, .001, 2000, DEM_BAD_ARGUMENT, "overlap");
        still_works(&c);
    }
    dem_free(c.sim);
}

static void test_bad_param(void **state)
{
    (void)state;
    for (int rank = 0; rank < world_size(); rank++)
        for (int which = 0; which < 4; which++) {
            cloud c;
            prepare(&c);
            const int bad = world_rank() == rank;
            if (bad && which == 0) c.material.density = -1;
            if (bad && which == 1) c.param.lo[1] = NAN;
            char path[64];
            snprintf(path, sizeof path, "/nonexistent/%d.h5", world_rank());
            if (which == 2) c.param.restart = path;
            if (bad && which == 3) c.param.imbalance = .5;
            static const char *const part[] = {"density", "domain", "/nonexistent/0.h5",
                                               "imbalance"};
            const dem_status status = dem_new(MPI_COMM_WORLD, &c.param, &c.sim);
            all_say(c.sim, status, which == 2 ? DEM_IO : DEM_BAD_ARGUMENT, part[which]);
            dem_free(c.sim);
        }
}

static void test_bad_advance(void **state)
{
    (void)state;
    cloud c;
    start(&c);
    for (int rank = 0; rank < world_size(); rank++) {
        const int bad = world_rank() == rank;
        all_say(c.sim, dem_advance(c.sim, bad ? -1 : 1e-4, 2), DEM_BAD_ARGUMENT, "time step -1");
        all_say(c.sim, dem_advance(c.sim, 1e-4, bad ? -3 : 2), DEM_BAD_ARGUMENT, "-3 sub-steps");
        all_say(c.sim, dem_advance(c.sim, bad ? 2e-5 : 1e-5, 1), DEM_BAD_ARGUMENT,
                "different steps");
        still_works(&c);
    }
    dem_free(c.sim);
}

static void test_bad_output(void **state)
{
    (void)state;
    cloud c;
    start(&c);
    for (int rank = 0; rank < world_size(); rank++) {
        const char *name = world_rank() == rank ? "a/b" : "1";
        all_say(c.sim, dem_write_snapshot(c.sim, "/dev/null", name), DEM_IO, "");
        all_say(c.sim, dem_write_restart(c.sim, "/dev/null", name, 0), DEM_IO, "");
        still_works(&c);
    }
    dem_free(c.sim);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lost),       cmocka_unit_test(test_nan),
        cmocka_unit_test(test_bad_force),  cmocka_unit_test(test_bad_add),
        cmocka_unit_test(test_bad_param),  cmocka_unit_test(test_bad_advance),
        cmocka_unit_test(test_bad_output),
    };
    MPI_Init(&argc, &argv);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
