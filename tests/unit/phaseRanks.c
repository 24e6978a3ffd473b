/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phaseRanks.c - a bed that is stirred by a given fluid, with its cells and particles divided among
 * ranks in ways that have nothing to do with each other, goes as on one rank, and its books close.
 *
 * Every rank runs the whole bed as well, alone, and compares its particles and cells. A shell
 * script of the same name runs this on several ranks; on one the cells are out of order.
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

#include "near.h"
#include "phase.h"

static int rank, ranks;

static const int cells[3] = {5, 4, 9};
enum { CELLS = 5 * 4 * 9, PARTICLES = 700, MOST = 4 * PARTICLES };
static const double h = .0027, origin[3] = {0, 0, 0}, spacing[3] = {.0027, .0027, .0027};

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

/* ---- a bed ----------------------------------------------------------------------------------- */

typedef struct bed {
    size_t n; /* own cells */
    int64_t id[CELLS];
    cpl_mesh mesh;
    dem_material material;
    dem_pair pair;
    dem_insertion insertion;
    dem_wall wall[2];
    dem_species species;
    dem_feeder feeder;
    dem_outlet outlet;
    dem_param dem;
    cpl_param coupling;
    double rho, mu;
    double u[CELLS][3], gradient[CELLS][3]; /* of the fluid in own cells */
    phase *phase;
} bed;

/* Both ends closed, periodic sides; cells in slabs along x, or like a checkerboard. */
static void divide(bed *b, int checkerboard, int all)
{
    static const int periodic[3] = {1, 1, 0};
    b->n = 0;
    for (int i = 0; i < CELLS; i++) {
        const int c = (i * 77 + 5) % CELLS;
        const int x = c % cells[0], y = c / cells[0] % cells[1], z = c / cells[0] / cells[1];
        const int owner = checkerboard ? (x + y + z) % ranks : x * ranks / cells[0];
        if (all || owner == rank) b->id[b->n++] = all ? i : c;
    }
    assert_int_equal(cpl_mesh_box_part(&b->mesh, cells, origin, spacing, periodic, b->n, b->id),
                     CPL_OK);
}

static void fill(bed *b)
{
    const double top[3] = {0, 0, cells[2] * h}, up[3] = {0, 0, 1}, down[3] = {0, 0, -1};
    dem_param *dem = &b->dem;
    b->material = (dem_material){.name = "glass", .density = 2500};
    b->pair =
        (dem_pair){.restitution = .9, .friction = .3, .stiffness = 200, .stiffness_ratio = .8};
    b->wall[0] = (dem_wall){.name = "floor", .shape = dem_sdf_plane(origin, up)};
    b->wall[1] = (dem_wall){.name = "lid", .shape = dem_sdf_plane(top, down)};
    *dem = dem_param_default();
    for (int a = 0; a < 3; a++) dem->hi[a] = cells[a] * h, dem->periodic[a] = a < 2;
    dem->gravity[2] = -9.81;
    b->insertion = (dem_insertion){.name = "bed",
                                   .kind = DEM_INSERT_RANDOM,
                                   .number = PARTICLES,
                                   .diameter = .001,
                                   .velocity_spread = .1,
                                   .seed = 5};
    b->insertion.hi[0] = cells[0] * h, b->insertion.hi[1] = cells[1] * h;
    b->insertion.hi[2] = .6 * cells[2] * h;
    b->insertion.region = dem_sdf_box(b->insertion.lo, b->insertion.hi, 1);
    dem->law = DEM_LINEAR;
    dem->n_material = 1, dem->material = &b->material, dem->pair = &b->pair;
    dem->n_wall = 2, dem->wall = b->wall;
    dem->n_insertion = 1, dem->insertion = &b->insertion;
}

/* Particles rain in below the lid; the lowest layer takes those that come down there. */
static void open_ends(bed *b)
{
    double lo[3] = {0, 0, 7.5 * h}, hi[3] = {cells[0] * h, cells[1] * h, 8.9 * h};
    b->species = (dem_species){0, {.kind = DEM_SIZE_UNIFORM, .lo = .6e-3, .hi = 1e-3}, 1};
    b->feeder = (dem_feeder){.name = "rain",
                             .region = dem_sdf_box(lo, hi, 1),
                             .n_species = 1,
                             .species = &b->species,
                             .number_rate = 2e4,
                             .end = INFINITY,
                             .mass = INFINITY,
                             .number = -1,
                             .velocity = {0, 0, -.5},
                             .seed = 3};
    memcpy(b->feeder.lo, lo, sizeof lo);
    memcpy(b->feeder.hi, hi, sizeof hi);
    lo[2] = 0, hi[2] = .4 * h, hi[0] = .7 * cells[0] * h;
    b->outlet = (dem_outlet){"drain", dem_sdf_box(lo, hi, 1), 0, INFINITY};
    b->dem.n_feeder = b->dem.n_outlet = 1;
    b->dem.feeder = &b->feeder, b->dem.outlet = &b->outlet;
}

/* restart: a file to go on from, or NULL. */
static int bed_new(MPI_Comm comm, int checkerboard, int liquid, double limit, int open,
                   const char *restart, bed *b)
{
    memset(b, 0, sizeof *b);
    divide(b, checkerboard, comm == MPI_COMM_SELF);
    fill(b);
    if (open) open_ends(b);
    b->dem.restart = restart;
    b->coupling = cpl_param_default();
    b->coupling.packing_limit = limit;
    b->rho = liquid ? 998 : 1.2, b->mu = liquid ? 1e-3 : 1.8e-5;
    const phase_param param = {
        .dem = &b->dem, .coupling = &b->coupling, .mesh = &b->mesh, .rho = b->rho, .mu = b->mu};
    return phase_new(comm, &param, &b->phase);
}

static void bed_free(bed *b)
{
    phase_free(b->phase);
    cpl_mesh_free(&b->mesh);
}

/* ---- a step ---------------------------------------------------------------------------------- */

/* The fluid of this step: drawn for all cells, whoever has them. */
static void stir(bed *b, int step)
{
    for (size_t i = 0; i < b->n; i++) {
        uint64_t state = (uint64_t)(b->id[i] * 1000 + step);
        uniform(&state);
        for (int a = 0; a < 3; a++) {
            b->u[i][a] = .8 * uniform(&state) - .4 + (a == 2 ? .9 : 0);
            b->gradient[i][a] = 300 * uniform(&state) - 150 - (a == 2 ? 9.81 * b->rho : 0);
        }
    }
}

/* What it loses in all cells, N. */
static void fluid_loses(const bed *b, MPI_Comm comm, double loss[2][3])
{
    const double *K = phase_K(b->phase), *eps = phase_voidage(b->phase);
    const double(*S)[3] = phase_S(b->phase);
    memset(loss, 0, 6 * sizeof(double));
    for (size_t c = 0; c < b->n; c++)
        for (int a = 0; a < 3; a++) {
            loss[0][a] += (K[c] * b->u[c][a] - S[c][a]) * b->mesh.volume[c];
            loss[1][a] -= (1 - eps[c]) * b->gradient[c][a] * b->mesh.volume[c];
        }
    MPI_Allreduce(MPI_IN_PLACE, loss, 6, MPI_DOUBLE, MPI_SUM, comm);
}

static int bed_step(bed *b, MPI_Comm comm, int step)
{
    double loss[2][3];
    stir(b, step);
    int failed = phase_advance(b->phase, 2e-4);
    if (!failed) failed = phase_drag(b->phase, (const double(*)[3])b->u);
    if (failed) return failed;
    fluid_loses(b, comm, loss);
    return phase_settle(b->phase, (const double(*)[3])b->u, (const double(*)[3])b->gradient, NULL,
                        loss[0], loss[1]);
}

/* ---- comparison ------------------------------------------------------------------------------ */

/* Largest difference of the particles' positions, over the box; all of them are somewhere. */
static double compare_particles(const bed *b, const bed *alone)
{
    const dem_view p = dem_particles(phase_engine(b->phase));
    const dem_view q = dem_particles(phase_engine(alone->phase));
    static size_t row[MOST];
    long long count = (long long)p.n, all;
    double worst = 0;
    for (size_t i = 0; i < q.n; i++) {
        assert_in_range(q.id[i], 0, MOST - 1);
        row[q.id[i]] = i;
    }
    for (size_t i = 0; i < p.n; i++)
        for (int a = 0; a < 3; a++) {
            double d = fabs(p.x[i][a] - q.x[row[p.id[i]]][a]) / (cells[a] * h);
            if (a < 2 && d > .5) d = fabs(d - 1);
            worst = fmax(worst, d);
        }
    MPI_Allreduce(&count, &all, 1, MPI_LONG_LONG, MPI_SUM, MPI_COMM_WORLD);
    assert_int_equal(all, q.n);
    return worst;
}

/* Largest difference of the sources and of the void fraction, over the largest magnitude. */
static double compare_cells(const bed *b, const bed *alone)
{
    const double *K = phase_K(b->phase), *K1 = phase_K(alone->phase);
    const double *eps = phase_voidage(b->phase), *eps1 = phase_voidage(alone->phase);
    const double(*S)[3] = phase_S(b->phase), (*S1)[3] = phase_S(alone->phase);
    const double(*Us)[3] = phase_Us(b->phase), (*Us1)[3] = phase_Us(alone->phase);
    double worst = 0, most = 0, source = 0;
    for (int c = 0; c < CELLS; c++) most = fmax(most, K1[c]), source = fmax(source, fabs(S1[c][2]));
    for (size_t i = 0; i < b->n; i++) {
        const int64_t c = b->id[i];
        worst = fmax(worst, fabs(K[i] - K1[c]) / most);
        worst = fmax(worst, fabs(eps[i] - eps1[c]));
        for (int a = 0; a < 3; a++) {
            worst = fmax(worst, fabs(S[i][a] - S1[c][a]) / source);
            worst = fmax(worst, fabs(Us[i][a] - Us1[c][a]));
        }
    }
    return worst;
}

static void check(int failed, const bed *b)
{
    if (failed) fail_msg("%s", phase_message(b->phase));
}

static void goes_as_on_one_rank(int checkerboard, int liquid, double limit, int open)
{
    static bed b, alone;
    const int made = bed_new(MPI_COMM_WORLD, checkerboard, liquid, limit, open, NULL, &b);
    check(made, &b);
    check(bed_new(MPI_COMM_SELF, checkerboard, liquid, limit, open, NULL, &alone), &alone);
    double particles = compare_particles(&b, &alone), in_cells = compare_cells(&b, &alone);
    double ledger = 0;
    size_t full = 0;
    int64_t fed = 0, removed = 0;
    for (int step = 0; step < 100; step++) {
        check(bed_step(&b, MPI_COMM_WORLD, step), &b);
        check(bed_step(&alone, MPI_COMM_SELF, step), &alone);
        particles = fmax(particles, compare_particles(&b, &alone));
        in_cells = fmax(in_cells, compare_cells(&b, &alone));
        const phase_report r = phase_last_report(b.phase), r1 = phase_last_report(alone.phase);
        ledger = fmax(ledger, r.ledger_residual);
        full += r.map.full_cells;
        fed += r.dem.fed, removed += r.dem.removed;
        assert_int_equal(r.dem.fed, r1.dem.fed);
        assert_int_equal(r.dem.removed, r1.dem.removed);
        assert_int_equal(r.dem.contacts, r1.dem.contacts);
        assert_near(r.height / r1.height, 1, 1e-10);
        assert_near(r.stiffness / r1.stiffness, 1, 1e-9);
        if (ranks > 1) assert_true(r.map.borrowed > 0);
    }
    double most[2] = {particles, in_cells};
    MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    if (rank == 0)
        print_message("%s, %s, limit %g: 100 steps off by %.1e of the box, cells by %.1e; ledger "
                      "%.1e; %zu times a cell over the limit; %d fed, %d gone\n",
                      liquid ? "liquid" : "gas", checkerboard ? "checkerboard" : "slabs", limit,
                      most[0], most[1], ledger, full, (int)fed, (int)removed);
    assert_true(most[0] < 1e-10);
    assert_true(most[1] < 1e-9);
    assert_true(ledger < 1e-12);
    assert_int_equal(full > 0, limit < .7);
    assert_true(open ? fed > 100 && removed > 20 : fed == 0 && removed == 0);
    bed_free(&b);
    bed_free(&alone);
}

static void same_as_alone(void **unused)
{
    (void)unused;
    goes_as_on_one_rank(0, 0, .9, 0);
    goes_as_on_one_rank(1, 0, .27, 0);
    goes_as_on_one_rank(1, 1, .9, 0);
}

static void with_feeder_and_outlet(void **unused)
{
    (void)unused;
    goes_as_on_one_rank(1, 0, .9, 1);
}

/* Written by all ranks in mid-run, with feeder and outlet: the file goes on with other parts of the
 * mesh, and on one rank, as if there had been no break. */
static void goes_on_from_a_file(void **unused)
{
    (void)unused;
    static bed b, again, alone;
    char top[] = "/tmp/phaseRanksXXXXXX", file[64];
    if (rank == 0) assert_non_null(mkdtemp(top));
    MPI_Bcast(top, sizeof top, MPI_CHAR, 0, MPI_COMM_WORLD);
    snprintf(file, sizeof file, "%s/half.h5", top);
    check(bed_new(MPI_COMM_WORLD, 1, 1, .9, 1, NULL, &b), &b);
    for (int step = 0; step < 30; step++) check(bed_step(&b, MPI_COMM_WORLD, step), &b);
    assert_int_equal(dem_write_restart(phase_engine(b.phase), top, "half", 0), DEM_OK);
    check(bed_new(MPI_COMM_WORLD, 0, 1, .9, 1, file, &again), &again);
    check(bed_new(MPI_COMM_SELF, 0, 1, .9, 1, file, &alone), &alone);
    for (int step = 30; step < 60; step++) {
        check(bed_step(&b, MPI_COMM_WORLD, step), &b);
        check(bed_step(&again, MPI_COMM_WORLD, step), &again);
        check(bed_step(&alone, MPI_COMM_SELF, step), &alone);
    }
    double off[2] = {compare_particles(&b, &alone), compare_particles(&again, &alone)};
    MPI_Allreduce(MPI_IN_PLACE, off, 2, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    const double ledger = phase_last_report(again.phase).ledger_residual;
    if (rank == 0) {
        print_message("after a restart off by %.1e on as many ranks, %.1e on one\n",
                      fmax(off[0], off[1]), off[0]);
        remove(file);
        rmdir(top);
    }
    assert_true(off[0] < 1e-10 && off[1] < 1e-10 && ledger < 1e-12);
    bed_free(&b);
    bed_free(&again);
    bed_free(&alone);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_alone),
        cmocka_unit_test(with_feeder_and_outlet),
        cmocka_unit_test(goes_on_from_a_file),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
