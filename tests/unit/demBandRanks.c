/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Surfaces sampled by several ranks: each ends with what it would have made alone, to the last bit,
 * the cache is the business of one, and what is refused is refused by all. Run alone it is a team
 * of one; demRanks.sh runs it on more.
 */
#include "dem_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "band.h"
#include "near.h"
#include "stlFixture.h"

static dem_sim team; /* no more of it than its ranks */
static int told;

static void tell(void *context, const char *what, double done)
{
    (void)context;
    assert_non_null(what);
    assert_true(done > 0. && done <= 1.);
    told++;
}

static void assert_same(const band *s, const band *t)
{
    assert_int_equal(s->n, t->n);
    assert_int_equal(s->n_side, t->n_side);
    assert_memory_equal(s->place, t->place, s->n * sizeof *s->place);
    assert_memory_equal(s->value, t->value, s->n * sizeof *s->value);
    assert_memory_equal(s->hidden, t->hidden, s->n * sizeof *s->hidden);
    assert_memory_equal(s->side, t->side, s->n_side * sizeof *s->side);
}

/* Sample by all ranks; seconds that it took. */
static double sample(dem_sdf *s, double spacing, double width, const char *cache)
{
    char message[512];
    const sdf_progress work = {.call = team.rank ? NULL : tell, .sim = &team};
    told = 0;
    MPI_Barrier(MPI_COMM_WORLD);
    const double begin = MPI_Wtime();
    assert_int_equal(sdf_sample(s, spacing, width, cache, &work, message, sizeof message), DEM_OK);
    assert_string_equal(message, "");
    return MPI_Wtime() - begin;
}

static void compare(body *b, double spacing, const char *what)
{
    char message[512];
    dem_sdf *alone = stl_shape(b, 1), *shared = stl_shape(b, 1);
    const double begin = MPI_Wtime();
    assert_int_equal(sdf_sample(alone, spacing, 3. * spacing, NULL, NULL, message, 512), DEM_OK);
    const double one = MPI_Wtime() - begin, all = sample(shared, spacing, 3. * spacing, NULL);
    assert_same(shared->band, alone->band);
    assert_true(team.rank > 0 || told > 0);
    if (team.rank == 0)
        print_message("%-30s %6zu bricks, every rank alone %.3f s, %d ranks %.3f s\n", what,
                      alone->band->n, one, team.ranks, all);
    dem_sdf_free(alone);
    dem_sdf_free(shared);
    body_free(b);
}

/* Few large triangles with creases and ridges, many small ones, and fewer than there are ranks. */
static void test_same(void **state)
{
    (void)state;
    const double lo[3] = {-.31, -.42, -.55}, hi[3] = {.47, .33, .68}, o[3] = {.03, -.02, .05};
    body b = box_body(lo, hi, 1);
    move_body(&b, .83, o);
    compare(&b, .011, "a turned box of 12 triangles");
    b = ball_body(o, .6, 24, .2);
    compare(&b, .015, "a rough ball");
    b = torus_body(.5, .23, 60, 40);
    compare(&b, .7, "a torus in a few bricks");
}

/* One rank reads and writes the cache; who finds it damaged has it made again by all. */
static void test_cache(void **state)
{
    (void)state;
    const double o[3] = {.03, -.02, .05};
    char directory[512], path[1024];
    snprintf(directory, sizeof directory, "%s", scratch_path("ranks"));
    MPI_Bcast(directory, sizeof directory, MPI_CHAR, 0, MPI_COMM_WORLD);
    body b = ball_body(o, .3, 6, .2);
    dem_sdf *made = stl_shape(&b, 0), *read = stl_shape(&b, 0);
    sample(made, .02, .08, directory);
    assert_true(team.rank > 0 || told > 0);
    sample(read, .02, .08, directory);
    assert_int_equal(told, 0);
    assert_same(read->band, made->band);
    const double x[3] = {.28, .11, -.04};
    double g[3];
    assert_near(dem_sdf_eval(read, 0, x, g), dem_sdf_eval(made, 0, x, g), 0.);

    snprintf(path, sizeof path, "cd '%s' && for f in *; do echo damage >$f; done", directory);
    if (team.rank == 0) assert_int_equal(system(path), 0);
    dem_sdf *again = stl_shape(&b, 0);
    char message[512];
    const sdf_progress work = {.sim = &team};
    assert_int_equal(sdf_sample(again, .02, .08, directory, &work, message, 512), DEM_OK);
    assert_true((team.rank == 0) == (strstr(message, "made again") != NULL));
    assert_same(again->band, made->band);
    snprintf(path, sizeof path, "rm -r '%s'", directory);
    if (team.rank == 0) assert_int_equal(system(path), 0);
    dem_sdf_free(made);
    dem_sdf_free(read);
    dem_sdf_free(again);
    body_free(&b);
}

static void test_refused(void **state)
{
    (void)state;
    const double lo[3] = {0, 0, 0}, hi[3] = {4e5, 3e5, 7e5};
    char message[512];
    body b = box_body(lo, hi, 1);
    dem_sdf *s = stl_shape(&b, 1);
    const sdf_progress work = {.sim = &team};
    assert_int_equal(sdf_sample(s, 2.5e-4, 2e-3, NULL, &work, message, 512), DEM_NO_MEMORY);
    assert_non_null(strstr(message, "wrong units"));
    dem_sdf_free(s);
    body_free(&b);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    team.comm = MPI_COMM_WORLD;
    MPI_Comm_rank(team.comm, &team.rank);
    MPI_Comm_size(team.comm, &team.ranks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same),
        cmocka_unit_test(test_cache),
        cmocka_unit_test(test_refused),
    };
    const int failures = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failures;
}
