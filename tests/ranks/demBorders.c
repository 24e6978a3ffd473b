/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demBorders.c - what may go wrong where two ranks meet: a partner of the other side that an outlet
 * takes just before a restart file is written, a domain that has become too small for what the file
 * holds, a position on the upper periodic side, an outside force that one rank does not give any
 * more.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "ranks.h"

enum { CHAIN = 20 };

static dem_material glass = {.name = "glass", .density = 2500};
static dem_pair contact = {
    .restitution = .5, .friction = .3, .stiffness = 1000, .stiffness_ratio = 1};
static const double radius = .002;

static dem_param box(double lo, double hi)
{
    dem_param p = dem_param_default();
    for (int a = 0; a < 3; a++) {
        p.lo[a] = lo;
        p.hi[a] = hi;
    }
    p.n_material = 1;
    p.material = &glass;
    p.pair = &contact;
    return p;
}

static int rank_of(MPI_Comm comm)
{
    int rank;
    MPI_Comm_rank(comm, &rank);
    return rank;
}

static dem_sim *make(MPI_Comm comm, const dem_param *p)
{
    dem_sim *sim;
    assert_int_equal(dem_new(comm, p, &sim), DEM_OK);
    return sim;
}

/* n spheres in a row along x from .005 m on; all given by the first rank. */
static void add_chain(MPI_Comm comm, dem_sim *sim, int n, double spacing)
{
    double x[CHAIN][3], r[CHAIN];
    int material[CHAIN] = {0};
    for (int i = 0; i < n; i++) {
        x[i][0] = .005 + i * spacing;
        x[i][1] = x[i][2] = .05;
        r[i] = radius;
    }
    const size_t given = rank_of(comm) == 0 ? (size_t)n : 0;
    assert_int_equal(dem_add(sim, given, (const double(*)[3])x, NULL, NULL, r, material, NULL),
                     DEM_OK);
}

/* A directory of the test's own, removed by remove_files(). */
static void make_directory(char *path, size_t size)
{
    if (rank_of(MPI_COMM_WORLD) == 0) {
        snprintf(path, size, "/tmp/felmiBordersXXXXXX");
        assert_non_null(mkdtemp(path));
    }
    MPI_Bcast(path, (int)size, MPI_CHAR, 0, MPI_COMM_WORLD);
}

static void remove_files(const char *directory, const char *file)
{
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank_of(MPI_COMM_WORLD) > 0) return;
    assert_int_equal(unlink(file), 0);
    assert_int_equal(rmdir(directory), 0);
}

/* The outlet begins when the list is there, so that pairs across its edge touch when it takes. */
static void outlet_beside_a_border(void **state)
{
    (void)state;
    for (int edge = 3; edge < 14; edge++) {
        dem_param p = box(0, .1);
        dem_outlet drain = {.name = "drain", .begin = 5e-6, .end = 10};
        drain.region = dem_sdf_box((const double[3]){.005 + (edge + .5) * .0039, -1, -1},
                                   (const double[3]){2, 1, 1}, 1);
        p.n_outlet = 1;
        p.outlet = &drain;
        dem_sim *sim = make(MPI_COMM_WORLD, &p);
        add_chain(MPI_COMM_WORLD, sim, 15, .0039);
        int64_t removed = 0;
        for (int s = 0; s < 3 && !removed; s++) {
            assert_int_equal(dem_advance(sim, 1e-5, 1), DEM_OK);
            removed = dem_last_report(sim).removed;
        }
        assert_int_equal(removed, 14 - edge);
        char directory[64], file[96];
        make_directory(directory, sizeof directory);
        snprintf(file, sizeof file, "%s/1.h5", directory);
        assert_int_equal(dem_write_restart(sim, directory, "1", 0), DEM_OK);
        dem_param again = box(0, .1);
        again.restart = file;
        dem_sim *on = make(MPI_COMM_WORLD, &again);
        assert_int_equal(dem_last_report(on).particles, edge + 1);
        dem_free(on);
        dem_free(sim);
        remove_files(directory, file);
    }
}

static void domain_too_small_for_the_file(void **state)
{
    (void)state;
    dem_param p = box(0, .1);
    dem_sim *sim = make(MPI_COMM_WORLD, &p);
    add_chain(MPI_COMM_WORLD, sim, CHAIN, .0045);
    assert_int_equal(dem_advance(sim, 1e-3, 0), DEM_OK);
    char directory[64], file[96], text[512];
    make_directory(directory, sizeof directory);
    snprintf(file, sizeof file, "%s/1.h5", directory);
    assert_int_equal(dem_write_restart(sim, directory, "1", 0), DEM_OK);
    dem_free(sim);
    p = box(0, .1);
    p.hi[0] = .08;
    p.restart = file;
    assert_int_equal(dem_new(MPI_COMM_WORLD, &p, &sim), DEM_LOST);
    snprintf(text, sizeof text, "%s", dem_message(sim));
    MPI_Bcast(text, sizeof text, MPI_CHAR, 0, MPI_COMM_WORLD);
    assert_string_equal(dem_message(sim), text);
    dem_free(sim);
    remove_files(directory, file);
}

static dem_sim *upper_side(MPI_Comm comm)
{
    dem_param p = box(.1, .7); /* .7 - (.7 - .1) is not .1 */
    p.periodic[0] = 1;
    dem_sim *sim = make(comm, &p);
    const double x[2][3] = {{.7, .3, .3}, {.1039, .3, .3}}, r[2] = {radius, radius};
    const int material[2] = {0, 0};
    const size_t given = rank_of(comm) == 0 ? 2 : 0;
    assert_int_equal(dem_add(sim, given, x, NULL, NULL, r, material, NULL), DEM_OK);
    assert_int_equal(dem_advance(sim, 1e-4, 0), DEM_OK);
    return sim;
}

static void upper_periodic_side(void **state)
{
    (void)state;
    dem_sim *alone = upper_side(MPI_COMM_SELF), *divided = upper_side(MPI_COMM_WORLD);
    assert_int_equal(assert_same_particles(divided, MPI_COMM_WORLD, alone), 2);
    dem_free(alone);
    dem_free(divided);
}

/* A rank that gives none while others do has none, and not that of the time before. */
static void outside_force_of_some_ranks(void **state)
{
    (void)state;
    dem_param p = box(0, .1);
    dem_sim *sim = make(MPI_COMM_WORLD, &p);
    add_chain(MPI_COMM_WORLD, sim, CHAIN, .0045);
    double f[CHAIN][3] = {{0}}, w[CHAIN][3] = {{0}}, k[CHAIN] = {0};
    for (int i = 0; i < CHAIN; i++) f[i][2] = 1e-3;
    for (int with = 1; with >= 0; with--) {
        const int gives = with || rank_of(MPI_COMM_WORLD) == 0;
        assert_int_equal(dem_set_outside_force(sim, gives ? (const double(*)[3])f : NULL,
                                               gives ? k : NULL,
                                               gives ? (const double(*)[3])w : NULL, NULL),
                         DEM_OK);
        assert_int_equal(dem_advance(sim, 1e-5, 1), DEM_OK);
        const dem_view view = dem_particles(sim);
        for (size_t i = 0; i < view.n; i++)
            assert_true(fabs(view.impulse[i][2] - (gives ? 1e-8 : 0)) < 1e-20);
    }
    dem_free(sim);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(outlet_beside_a_border),
        cmocka_unit_test(domain_too_small_for_the_file),
        cmocka_unit_test(upper_periodic_side),
        cmocka_unit_test(outside_force_of_some_ranks),
    };
    MPI_Init(&argc, &argv);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
