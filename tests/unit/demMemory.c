/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demMemory.c - what a particle takes: at most 700 bytes in a bed with six contacts each, history
 * included, and nothing for what is not in use.
 */
#include "demRig.h"

#include <stdlib.h>

enum { ACROSS = 20, MANY = ACROSS * ACROSS * ACROSS };

/* A cube of spheres in a lattice that overlap a little: six contacts each, but at the sides. */
static void start(rig *r, int rolling)
{
    const double R = 1e-3;
    rig_init(r, DEM_LINEAR, 100 * R);
    rig_pairs(r, .5, .4, 100, 1);
    r->param.rolling = rolling ? DEM_ROLLING_EPSD : DEM_ROLLING_NONE;
    for (int k = 0; k < 4; k++) r->pair[k].rolling_friction = rolling ? .1 : 0;
    rig_start(r);
    double(*x)[3] = malloc(MANY * sizeof *x), *radius = malloc(MANY * sizeof *radius);
    int *material = calloc(MANY, sizeof *material);
    for (int i = 0; i < MANY; i++) {
        x[i][0] = 1.99 * R * (i % ACROSS);
        x[i][1] = 1.99 * R * (i / ACROSS % ACROSS);
        x[i][2] = 1.99 * R * (i / ACROSS / ACROSS);
        radius[i] = R;
    }
    if (dem_add(r->sim, MANY, (const double(*)[3])x, NULL, NULL, radius, material, NULL))
        fail_msg("%s", dem_message(r->sim));
    free(x);
    free(radius);
    free(material);
}

static dem_memory after_steps(rig *r)
{
    if (dem_advance(r->sim, 20e-6, 20)) fail_msg("%s", dem_message(r->sim));
    return dem_memory_used(r->sim);
}

static void at_most_700_bytes(void **state)
{
    (void)state;
    rig r;
    start(&r, 0);
    const dem_memory m = after_steps(&r);
    const int64_t contacts = dem_last_report(r.sim).contacts;
    assert_true(contacts >= 3 * ACROSS * ACROSS * (ACROSS - 1));
    assert_int_equal(m.columns + m.balance + m.walls + m.shapes, 0);
    assert_int_equal(m.all, m.particles + m.neighbours + m.contacts);
    assert_true(m.contacts > (size_t)contacts * sizeof(double[4]));
    assert_true(m.neighbours > (size_t)contacts * sizeof(uint32_t));
    if (m.all > 700 * (size_t)MANY) fail_msg("%g bytes a particle", (double)m.all / MANY);
    dem_free(r.sim);
}

static void what_is_in_use(void **state)
{
    (void)state;
    rig r;
    start(&r, 0);
    const dem_memory plain = after_steps(&r);
    double(*f)[3] = calloc(MANY, sizeof *f), *k = calloc(MANY, sizeof *k);
    assert_int_equal(
        dem_set_outside_force(r.sim, (const double(*)[3])f, k, (const double(*)[3])f, NULL),
        DEM_OK);
    assert_true(dem_attach(r.sim, "colour", 2) >= 0);
    const dem_memory more = dem_memory_used(r.sim);
    assert_int_equal(more.particles - plain.particles, MANY * sizeof(double[8]));
    assert_int_equal(more.columns, MANY * sizeof(double[2]));
    free(f);
    free(k);
    dem_free(r.sim);
    start(&r, 1);
    const dem_memory rolls = after_steps(&r);
    const size_t springs = (size_t)dem_last_report(r.sim).contacts * sizeof(double[4]);
    assert_true(rolls.contacts >= plain.contacts + springs);
    dem_free(r.sim);
}

/* A column keeps its values and its handle when the outside force comes after it. */
static void columns_stay(void **state)
{
    (void)state;
    rig r;
    start(&r, 0);
    const int narrow = dem_attach(r.sim, "narrow", 1), wide = dem_attach(r.sim, "wide", 11);
    for (size_t i = 0; i < MANY; i++) {
        const int64_t id = dem_particles(r.sim).id[i];
        dem_column(r.sim, narrow)[i] = (double)id;
        for (int c = 0; c < 11; c++) dem_column(r.sim, wide)[11 * i + c] = 100. * (double)id + c;
    }
    double(*f)[3] = calloc(MANY, sizeof *f), *k = calloc(MANY, sizeof *k);
    assert_int_equal(
        dem_set_outside_force(r.sim, (const double(*)[3])f, k, (const double(*)[3])f, NULL),
        DEM_OK);
    after_steps(&r); /* sorts them */
    size_t moved = 0;
    for (size_t i = 0; i < MANY; i++) {
        const int64_t id = dem_particles(r.sim).id[i];
        moved += id != (int64_t)i;
        assert_true(dem_column(r.sim, narrow)[i] == (double)id);
        for (int c = 0; c < 11; c++)
            assert_true(dem_column(r.sim, wide)[11 * i + c] == 100. * (double)id + c);
    }
    assert_true(moved > MANY / 2);
    free(f);
    free(k);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(at_most_700_bytes),
                                       cmocka_unit_test(what_is_in_use),
                                       cmocka_unit_test(columns_stay)};
    MPI_Init(&argc, &argv);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
