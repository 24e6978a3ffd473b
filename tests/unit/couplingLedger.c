/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingLedger.c - the ledger's file, its residuals, and that every kind of loss stops a run.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <math.h>
#include <cmocka.h>

#include "cpl.h"
#include "near.h"

/* A step in which all four balances hold exactly in binary numbers. */
static cpl_entry balanced(void)
{
    return (cpl_entry){.time = .0125,
                       .particle_volume = 3.5,
                       .mapped_volume = 3.5,
                       .moved_volume = .25,
                       .fluid_drag = {2, 0, 1},
                       .fluid_pressure = {-.5, 0, 4},
                       .particle_force = {1.5, 0, 5},
                       .delivered = {1.25, 0, 4.5},
                       .carried_before = {.5, 0, 1},
                       .carried = {.75, -.25, 2},
                       .momentum_before = {7, 1, 2},
                       .momentum = {8.25, .5, -.75},
                       .gravity = {0, 0, -8},
                       .walls = {0, 0, .5},
                       .supply = {0, -.5, .25},
                       .gone = {0, .25, -.5},
                       .scale = 8,
                       .momentum_scale = 16};
}

static void balances_close(void **unused)
{
    (void)unused;
    cpl_ledger *ledger;
    assert_int_equal(cpl_ledger_new(NULL, 1e-9, NAN, &ledger), CPL_OK);
    const cpl_entry entry = balanced(), nothing = {.time = 1};
    assert_int_equal(cpl_ledger_book(ledger, &entry), CPL_OK);
    assert_true(cpl_ledger_residual(ledger) == 0);
    assert_int_equal(cpl_ledger_book(ledger, &nothing), CPL_OK); /* no particles, no scale */
    assert_true(cpl_ledger_residual(ledger) == 0);
    cpl_ledger_free(ledger);
    assert_int_equal(cpl_ledger_new(NULL, 0, NAN, &ledger), CPL_BAD_ARGUMENT);
    cpl_ledger_free(ledger);
}

static void expect(cpl_entry entry, double residual, const char *name)
{
    cpl_ledger *ledger;
    assert_int_equal(cpl_ledger_new(NULL, .5 * residual, NAN, &ledger), CPL_OK);
    assert_int_equal(cpl_ledger_book(ledger, &entry), CPL_IMBALANCE);
    assert_near(cpl_ledger_residual(ledger), residual, 1e-6 * residual);
    assert_non_null(strstr(cpl_ledger_message(ledger), name));
    assert_non_null(strstr(cpl_ledger_message(ledger), "time 0.0125 s"));
    cpl_ledger_free(ledger);
    assert_int_equal(cpl_ledger_new(NULL, 2 * residual, NAN, &ledger), CPL_OK);
    assert_int_equal(cpl_ledger_book(ledger, &entry), CPL_OK);
    cpl_ledger_free(ledger);
}

static void losses_are_named(void **unused)
{
    (void)unused;
    cpl_entry e = balanced();
    e.mapped_volume -= 3.5e-6;
    expect(e, 1e-6, "balance of volume");
    e = balanced();
    e.fluid_pressure[1] += 8e-5; /* to the particles, but not booked */
    expect(e, 1e-5, "balance of exchange");
    e = balanced();
    e.carried[2] -= 8e-4;
    expect(e, 1e-4, "balance of carry");
    e = balanced();
    e.momentum[0] += 16e-4;
    expect(e, 1e-4, "balance of particle momentum");
    e = balanced();
    e.gone[1] += 8e-4;
    expect(e, 1e-4, "balance of carry");
    e = balanced();
    e.supply[2] += 16e-4;
    expect(e, 1e-4, "balance of particle momentum");
    /* A NaN never balances, nor does a difference without a measure. */
    cpl_ledger *ledger;
    assert_int_equal(cpl_ledger_new(NULL, 1e9, NAN, &ledger), CPL_OK);
    e = balanced();
    e.fluid_drag[0] = NAN;
    assert_int_equal(cpl_ledger_book(ledger, &e), CPL_IMBALANCE);
    assert_true(isnan(cpl_ledger_residual(ledger)));
    e = balanced();
    e.scale = 0, e.carried[0] += 1;
    assert_int_equal(cpl_ledger_book(ledger, &e), CPL_IMBALANCE);
    cpl_ledger_free(ledger);
}

/* Counts lines, those that start with #, and the columns of the last line. */
static void read_back(const char *path, int *lines, int *comments, int *columns, char *last,
                      size_t size)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    *lines = *comments = 0;
    while (fgets(last, (int)size, file)) {
        ++*lines;
        *comments += last[0] == '#';
    }
    *columns = 1;
    for (const char *s = last; *s; s++) *columns += *s == ',';
    fclose(file);
}

static void file_is_written(void **unused)
{
    (void)unused;
    char top[] = "/tmp/couplingLedgerXXXXXX", directory[128], path[160], below[176], last[2048];
    assert_non_null(mkdtemp(top));
    snprintf(directory, sizeof directory, "%s/postProcessing/coupling", top);
    snprintf(path, sizeof path, "%s/ledger.csv", directory);
    const cpl_entry entry = balanced();
    int lines[4], comments[4], columns[4];
    const double from[4] = {NAN, 1, NAN, 1};
    cpl_ledger *ledger;
    for (int run = 0; run < 4; run++) {
        if (run == 3) assert_int_equal(remove(path), 0);
        assert_int_equal(cpl_ledger_new(directory, 1e-9, from[run], &ledger), CPL_OK);
        assert_int_equal(cpl_ledger_book(ledger, &entry), CPL_OK);
        /* read before it is closed: rows are out as soon as they are booked */
        read_back(path, &lines[run], &comments[run], &columns[run], last, sizeof last);
        cpl_ledger_free(ledger);
    }
    assert_int_equal(lines[1], lines[0] + 1); /* appended, with no second header */
    assert_int_equal(lines[2], lines[0]);     /* begun anew */
    assert_int_equal(lines[3], lines[0]);     /* appending to nothing writes a header */
    assert_int_equal(lines[0], comments[0] + 2);
    assert_int_equal(columns[0], 4 + 12 * 3 + 2 + 4);
    assert_memory_equal(last, "0.0125,3.5,3.5,0.25,2,0,1,-0.5,0,4,1.5,0,5,1.25,0,4.5,", 53);

    /* a directory below a file cannot be made */
    snprintf(below, sizeof below, "%s/below", path);
    assert_int_equal(cpl_ledger_new(below, 1e-9, NAN, &ledger), CPL_IO);
    assert_non_null(strstr(cpl_ledger_message(ledger), "cannot write"));
    cpl_ledger_free(ledger);
    remove(path);
    snprintf(path, sizeof path, "%s/postProcessing/coupling", top);
    rmdir(path);
    snprintf(path, sizeof path, "%s/postProcessing", top);
    rmdir(path);
    rmdir(top);
}

static void put(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void holds(const char *path, const char *expected)
{
    char text[256] = "";
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(text, expected);
}

/* A restart keeps whole rows up to its time, and whatever stood under other columns. */
static void table_goes_on(void **unused)
{
    (void)unused;
    char top[] = "/tmp/couplingTableXXXXXX", path[128], aside[160], message[512];
    assert_non_null(mkdtemp(top));
    snprintf(path, sizeof path, "%s/a/b.csv", top);
    snprintf(aside, sizeof aside, "%s.before-0.2", path);
    FILE *file = cpl_table_open(path, "# s\ntime,x\n", NAN, message, sizeof message);
    assert_non_null(file);
    assert_string_equal(message, "");
    fclose(file);
    put(path, "# s\ntime,x\n0.1,7\n0.2,8\n0.3,9\n0.15");
    file = cpl_table_open(path, "# s\ntime,x\n", .2, message, sizeof message);
    assert_non_null(file);
    assert_string_equal(message, "");
    holds(path, "# s\ntime,x\n0.1,7\n0.2,8\n");
    fputs("0.25,6\n", file);
    fclose(file);
    holds(path, "# s\ntime,x\n0.1,7\n0.2,8\n0.25,6\n");

    file = cpl_table_open(path, "# s\ntime,x,y\n", .2, message, sizeof message);
    assert_non_null(file);
    assert_non_null(strstr(message, "b.csv.before-0.2"));
    fclose(file);
    holds(path, "# s\ntime,x,y\n");
    holds(aside, "# s\ntime,x\n0.1,7\n0.2,8\n0.25,6\n");

    /* a file that cannot be read is not overwritten */
    remove(path);
    assert_int_equal(symlink("b.csv", path), 0);
    assert_null(cpl_table_open(path, "time\n", .2, message, sizeof message));
    assert_non_null(strstr(message, "cannot write"));
    assert_non_null(strstr(message, path));
    remove(path), remove(aside);
    snprintf(path, sizeof path, "%s/a/.b.csv.part", top);
    remove(path);
    snprintf(path, sizeof path, "%s/a", top);
    assert_int_equal(rmdir(path), 0);
    rmdir(top);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(balances_close),
        cmocka_unit_test(losses_are_named),
        cmocka_unit_test(file_is_written),
        cmocka_unit_test(table_goes_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
