/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phaseRestart.c - a particle phase that goes on from a restart file does what the one that wrote
 * it does: every number that it saves later is the same to the last bit, and so is its ledger.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>
#include <cmocka.h>

#include "phaseBox.h"

enum { CELLS = 8 };

static char top[] = "/tmp/phaseRestartXXXXXX";

/* Glass in air, or in water, whose inertia matters; a density wave, so that cells differ. */
static phase_box box(double rho, double mu, cpl_scheme scheme)
{
    phase_box b = {.eps = .62,
                   .d = 1.3e-3,
                   .density = 2520,
                   .rho = rho,
                   .mu = mu,
                   .gravity = {0, 0, -9.81},
                   .velocity = {.21, -.13, .34},
                   .stiffness = 40,
                   .cells = {2, 2, 2},
                   .wave = 1e-4,
                   .coupling = cpl_param_default()};
    b.coupling.scheme = scheme;
    return b;
}

/* A step in a fluid that takes no notice: another one in every cell and step. */
static void step(phase_box *b, int number)
{
    double u[CELLS][3], gradient[CELLS][3], drag[3] = {0}, pressure[3] = {0};
    assert_int_equal(phase_advance(b->phase, 1e-5), 0);
    for (int c = 0; c < CELLS; c++)
        for (int a = 0; a < 3; a++) {
            u[c][a] = .3 + sin(1 + number + 3 * c + a);
            gradient[c][a] = 1e4 * cos(number + 5 * c + 2 * a);
        }
    assert_int_equal(phase_drag(b->phase, (const double(*)[3])u), 0);
    const double *K = phase_K(b->phase), *eps = phase_voidage(b->phase);
    const double(*S)[3] = phase_S(b->phase);
    for (int c = 0; c < CELLS; c++)
        for (int a = 0; a < 3; a++) {
            drag[a] += (K[c] * u[c][a] - S[c][a]) * b->mesh.volume[c];
            pressure[a] -= (1 - eps[c]) * gradient[c][a] * b->mesh.volume[c];
        }
    assert_int_equal(phase_settle(b->phase, (const double(*)[3])u, (const double(*)[3])gradient,
                                  NULL, drag, pressure),
                     0);
}

static char *content(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    char *bytes = malloc(*size + 1);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    bytes[*size] = '\0';
    fclose(file);
    return bytes;
}

static void same(const char *a, const char *b)
{
    size_t n, m;
    char *first = content(a, &n), *second = content(b, &m);
    assert_int_equal(n, m);
    assert_memory_equal(first, second, n);
    free(first), free(second);
}

static void save(phase_box *b, const char *name)
{
    assert_int_equal(dem_write_restart(phase_engine(b->phase), top, name, 0), DEM_OK);
}

static void goes_on(phase_box b)
{
    char files[4][64], ledgers[2][64];
    for (int k = 0; k < 4; k++) snprintf(files[k], sizeof *files, "%s/%c.h5", top, "abcd"[k]);
    for (int k = 0; k < 2; k++) snprintf(ledgers[k], sizeof *ledgers, "%s/%d", top, k);
    phase_box first = b, second = b;
    first.ledger = ledgers[0];
    assert_int_equal(phase_box_new(&first), 0);
    for (int k = 0; k < 12; k++) {
        step(&first, k);
        if (k == 6) save(&first, "a");
    }
    save(&first, "b");
    phase_box_free(&first);

    second.restart = files[0];
    assert_int_equal(phase_box_new(&second), 0);
    assert_true(dem_time(phase_engine(second.phase)) > 6.9e-5);
    save(&second, "c");
    same(files[0], files[2]);
    for (int k = 7; k < 12; k++) step(&second, k);
    save(&second, "d");
    same(files[1], files[3]);
    phase_box_free(&second);

    /* the ledger of the straight run, cut at the restart and continued */
    phase_box third = b;
    char path[2][96];
    third.restart = files[0], third.ledger = ledgers[0];
    for (int k = 0; k < 2; k++) snprintf(path[k], sizeof *path, "%s/ledger.csv", ledgers[k]);
    size_t n, m;
    char *straight = content(path[0], &n);
    assert_int_equal(phase_box_new(&third), 0);
    for (int k = 7; k < 12; k++) step(&third, k);
    phase_box_free(&third);
    char *continued = content(path[0], &m);
    assert_string_equal(straight, continued);
    free(straight), free(continued);
}

static void in_air(void **unused)
{
    (void)unused;
    goes_on(box(1.19, 1.82e-5, CPL_SEMI_IMPLICIT));
}

static void in_water(void **unused)
{
    (void)unused;
    goes_on(box(998, 1e-3, CPL_SEMI_IMPLICIT));
}

static void explicitly(void **unused)
{
    (void)unused;
    goes_on(box(1.19, 1.82e-5, CPL_EXPLICIT));
}

/* Particles that no fluid has met are no state of a coupled run. */
static void others_are_refused(void **unused)
{
    (void)unused;
    phase_box b = box(1.19, 1.82e-5, CPL_SEMI_IMPLICIT);
    char file[64];
    dem_sim *sim;
    assert_int_equal(phase_box_new(&b), 0);
    b.dem.insertion = &b.insertion;
    assert_int_equal(dem_new(MPI_COMM_SELF, &b.dem, &sim), DEM_OK);
    assert_int_equal(dem_write_restart(sim, top, "alone", 0), DEM_OK);
    dem_free(sim);
    phase_box_free(&b);
    snprintf(file, sizeof file, "%s/alone.h5", top);
    b.restart = file;
    assert_int_equal(phase_box_new(&b), DEM_IO);
    assert_non_null(strstr(phase_message(b.phase), "alone.h5: is of a run of particles alone"));
    phase_box_free(&b);
}

/* A few lines, and they add up. */
static void time_is_shared(void **unused)
{
    (void)unused;
    phase_box b = box(1.19, 1.82e-5, CPL_SEMI_IMPLICIT);
    char text[1024], word[32];
    double seconds[7], share[7];
    assert_int_equal(phase_box_new(&b), 0);
    for (int k = 0; k < 3; k++) step(&b, k);
    const int length = phase_shares(b.phase, text, sizeof text, 30, 50);
    assert_int_equal(length, strlen(text));
    const char *line = strchr(text, '\n');
    for (int k = 0; k < 7; k++, line = strchr(line + 1, '\n'))
        assert_int_equal(sscanf(line, " %31s %lf %lf", word, &seconds[k], &share[k]), 3);
    assert_true(seconds[4] == 30 && share[4] == 60);
    assert_true(seconds[6] == 50 && share[6] == 100);
    double all = 0;
    for (int k = 0; k < 6; k++) all += seconds[k];
    assert_true(fabs(all - 50) < .04);
    assert_true(phase_shares(b.phase, text, 10, 30, 50) == length && strlen(text) == 9);
    phase_box_free(&b);
}

static int make_folder(void **unused)
{
    (void)unused;
    return mkdtemp(top) == NULL;
}

static int remove_folder(void **unused)
{
    (void)unused;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", top);
    return system(command);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(in_air),         cmocka_unit_test(in_water),
        cmocka_unit_test(explicitly),     cmocka_unit_test(others_are_refused),
        cmocka_unit_test(time_is_shared),
    };
    const int failed = cmocka_run_group_tests(tests, make_folder, remove_folder);
    MPI_Finalize();
    return failed;
}
