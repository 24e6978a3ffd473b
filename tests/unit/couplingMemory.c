/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingMemory.c - one rank runs out of memory: at each allocation of a map over several ranks in
 * turn. All ranks hear of it, none waits, and the next build is none the worse.
 *
 * couplingLib is compiled into this program with the allocation of failingMemory.h.
 * couplingExchangeRanks.sh runs it on several ranks.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "failingMemory.h"
#undef malloc
#undef calloc
#undef realloc

#include "cpl.h"
#include "near.h"

static int rank, ranks;
static long allocations, fails_at; /* of this rank; < 0: none */

static int fails(void)
{
    return ++allocations == fails_at;
}

void *failing_malloc(size_t size)
{
    return fails() ? NULL : malloc(size);
}

void *failing_calloc(size_t n, size_t size)
{
    return fails() ? NULL : calloc(n, size);
}

void *failing_realloc(void *block, size_t size)
{
    return fails() ? NULL : realloc(block, size);
}

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

enum { CELLS = 7 * 5 * 9, PARTICLES = 1700 };

static struct {
    cpl_mesh whole, part;
    int place[CELLS];
    size_t n;
    double x[PARTICLES][3], radius[PARTICLES], V[PARTICLES];
} rig;

static void locate_own(void *context, size_t m, const double (*x)[3], int *cell)
{
    (void)context;
    rig.whole.locate(rig.whole.context, m, x, cell);
    for (size_t p = 0; p < m; p++)
        if (cell[p] >= 0) cell[p] = rig.place[cell[p]];
}

/* Cells in slabs, particles dealt out like cards; as a box or as any other mesh. */
static void make_rig(int general)
{
    static const int cells[3] = {7, 5, 9}, closed[3] = {0, 0, 0};
    static const double origin[3] = {0, 0, 0}, h = .005, spacing[3] = {.005, .005, .005};
    int64_t id[CELLS];
    size_t own = 0;
    uint64_t state = 5;
    for (int c = 0; c < CELLS; c++) {
        const int owner = c % 7 * ranks / 7;
        rig.place[c] = owner == rank ? (int)own : -1;
        if (owner == rank) id[own++] = c;
    }
    assert_int_equal(cpl_mesh_box(&rig.whole, cells, origin, spacing, closed), CPL_OK);
    assert_int_equal(cpl_mesh_box_part(&rig.part, cells, origin, spacing, closed, own, id), CPL_OK);
    if (general) rig.part.cells[0] = 0, rig.part.locate = locate_own;
    rig.n = 0;
    for (int p = 0; p < PARTICLES; p++) {
        double x[3];
        for (int a = 0; a < 3; a++) x[a] = cells[a] * h * uniform(&state);
        if (p % ranks != rank) continue;
        memcpy(rig.x[rig.n], x, sizeof x);
        rig.radius[rig.n] = .001;
        rig.V[rig.n++] = 4.18e-9;
    }
}

static cpl_status build(cpl_map *map)
{
    return cpl_map_build(map, rig.n, (const double(*)[3])rig.x, rig.radius, rig.V);
}

/* The last rank fails at allocation `at`, none if negative. Volume moved by the packing limit;
 * *failed counts, *over: there are no more allocations. */
static double attempt(long at, size_t *failed, int *over)
{
    cpl_map *map;
    allocations = 0;
    fails_at = rank == ranks - 1 ? at : -1;
    cpl_status status = cpl_map_new_ranks(MPI_COMM_WORLD, &rig.part, CPL_DIVIDED_CUBE, .19, &map);
    const int made = !status;
    if (made) status = build(map);
    fails_at = -1;
    const long tried = allocations;
    int same[2] = {status, -status};
    MPI_Allreduce(MPI_IN_PLACE, same, 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    assert_int_equal(same[0], -same[1]);
    *over = tried < at;
    MPI_Bcast(over, 1, MPI_INT, ranks - 1, MPI_COMM_WORLD);
    assert_int_equal(status, at < 0 || *over ? CPL_OK : CPL_NO_MEMORY);
    *failed += status != CPL_OK;
    if (map && status) assert_non_null(strstr(cpl_map_message(map), "no memory"));
    if (made && status) assert_int_equal(build(map), CPL_OK);
    const double moved = made ? cpl_map_last_report(map).moved_volume : 0;
    cpl_map_free(map);
    return moved;
}

static void every_allocation(void **unused)
{
    (void)unused;
    for (int general = 0; general < 2; general++) {
        size_t failed = 0;
        int over = 0;
        make_rig(general);
        const double moved = attempt(-1, &failed, &over);
        assert_true(moved > 0);
        over = 0;
        for (long at = 1; !over; at++) {
            const double again = attempt(at, &failed, &over);
            if (again != 0) assert_near(again / moved, 1, 1e-13);
        }
        if (rank == 0) print_message("%zu allocations failed\n", failed);
        assert_true(failed > 10);
        cpl_mesh_free(&rig.part);
        cpl_mesh_free(&rig.whole);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
