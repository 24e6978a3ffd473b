/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingExchange.c - a map whose cells and particles are divided among ranks, each in its own
 * way, gives what one rank gives: void fraction, gather, scatter, the packing limit, reports and
 * errors.
 *
 * Every rank makes the whole map as well and compares its part. couplingExchangeRanks.sh runs this
 * on several ranks; on one the cells are out of order.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "cpl.h"

#define CHECK(status) assert_int_equal((status), CPL_OK)

static int rank, ranks;

/* Knuth's MMIX constants. */
static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

static const int cells[3] = {7, 5, 9};
static const double origin[3] = {-.0131, .0072, .0119};
static const double spacing[3] = {.00513, .00731, .00497};
enum { CELLS = 7 * 5 * 9 };

/* ---- dividing -------------------------------------------------------------------------------- */

typedef enum division {
    SLABS_X,
    SLABS_Z,
    CHECKERBOARD,
    SCATTERED,
    ALL_ON_LAST,
    DIVISIONS
} division;
static const char *const division_name[] = {"slabs along x", "slabs along z", "checkerboard",
                                            "scattered", "all on the last rank"};

static int owner_of(division how, int c)
{
    const int i = c % cells[0], j = c / cells[0] % cells[1], k = c / cells[0] / cells[1];
    uint64_t seed = (uint64_t)c * 977 + 5;
    switch (how) {
    case SLABS_X:
        return i * ranks / cells[0];
    case SLABS_Z:
        return k * ranks / cells[2];
    case CHECKERBOARD:
        return (i + j + k) % ranks;
    case SCATTERED:
        uniform(&seed);
        return (int)(uniform(&seed) * ranks);
    default:
        return ranks - 1;
    }
}

/* The whole mesh, and the part of this rank. */
typedef struct divided {
    cpl_mesh whole, part;
    int general, place[CELLS]; /* of a cell in the part, -1 elsewhere */
    int64_t id[CELLS], link[6 * CELLS];
    size_t n, offset[CELLS + 1];
    double volume[CELLS], centre[CELLS][3], lo[CELLS][3], hi[CELLS][3];
} divided;

/* Own cells only, as a flow solver's search would find them. */
static void locate_own(void *context, size_t m, const double (*x)[3], int *cell)
{
    const divided *d = context;
    d->whole.locate(d->whole.context, m, x, cell);
    for (size_t p = 0; p < m; p++)
        if (cell[p] >= 0) cell[p] = d->place[cell[p]];
}

/* A general mesh by its looks: bounding boxes overlap, as those of skewed cells do. */
static void skew(cpl_mesh *mesh)
{
    double(*lo)[3] = (double(*)[3])mesh->lo, (*hi)[3] = (double(*)[3])mesh->hi;
    double *volume = (double *)mesh->volume;
    for (size_t c = 0; c < mesh->n; c++) {
        volume[c] *= 1 + .1 * sin(3. * (double)c);
        for (int a = 0; a < 3; a++) lo[c][a] -= .11 * spacing[a], hi[c][a] += .11 * spacing[a];
    }
    mesh->cells[0] = 0;
}

static void make_general_part(divided *d)
{
    size_t links = 0;
    d->offset[0] = 0;
    for (size_t i = 0; i < d->n; i++) {
        const size_t c = (size_t)d->id[i];
        d->volume[i] = d->whole.volume[c];
        memcpy(d->centre[i], d->whole.centre[c], sizeof d->centre[i]);
        memcpy(d->lo[i], d->whole.lo[c], sizeof d->lo[i]);
        memcpy(d->hi[i], d->whole.hi[c], sizeof d->hi[i]);
        for (size_t k = d->whole.offset[c]; k < d->whole.offset[c + 1]; k++)
            d->link[links++] = d->whole.neighbour[k];
        d->offset[i + 1] = links;
    }
    d->part = (cpl_mesh){.n = d->n,
                         .volume = d->volume,
                         .centre = (const double(*)[3])d->centre,
                         .lo = (const double(*)[3])d->lo,
                         .hi = (const double(*)[3])d->hi,
                         .offset = d->offset,
                         .locate = locate_own,
                         .context = d,
                         .id = d->id,
                         .neighbour_id = d->link};
}

static divided *divide(division how, int general, const int periodic[3])
{
    divided *d = calloc(1, sizeof *d);
    CHECK(cpl_mesh_box(&d->whole, cells, origin, spacing, periodic));
    for (int i = 0; i < CELLS; i++) {
        const int c = (i * 101 + 17) % CELLS; /* in no order that means anything */
        d->place[c] = -1;
        if (owner_of(how, c) != rank) continue;
        d->place[c] = (int)d->n;
        d->id[d->n++] = c;
    }
    d->general = general;
    if (general) {
        skew(&d->whole);
        make_general_part(d);
    } else {
        CHECK(cpl_mesh_box_part(&d->part, cells, origin, spacing, periodic, d->n, d->id));
    }
    return d;
}

static void free_divided(divided *d)
{
    cpl_mesh_free(&d->whole);
    if (!d->general) cpl_mesh_free(&d->part);
    free(d);
}

/* ---- particles ------------------------------------------------------------------------------- */

typedef struct cloud {
    size_t n;
    size_t *number; /* of each in the whole cloud */
    double (*x)[3], *radius, *V, (*s)[3];
} cloud;

static cloud cloud_new(size_t n)
{
    return (cloud){n,
                   malloc(n * sizeof(size_t) + 1),
                   malloc(n * 3 * sizeof(double) + 1),
                   malloc(n * sizeof(double) + 1),
                   malloc(n * sizeof(double) + 1),
                   malloc(n * 3 * sizeof(double) + 1)};
}

static void cloud_free(cloud *c)
{
    free(c->number), free(c->x), free(c->radius), free(c->V), free(c->s);
}

/* `crowd` gathers the particles towards the lower end, beyond what cells can hold. */
static cloud all_particles(size_t n, double crowd)
{
    cloud c = cloud_new(n);
    uint64_t state = 2385;
    for (size_t p = 0; p < n; p++) {
        c.number[p] = p;
        for (int a = 0; a < 3; a++)
            c.x[p][a] = origin[a] + cells[a] * spacing[a] * pow(uniform(&state), crowd);
        c.radius[p] = .0004 + .0009 * uniform(&state);
        c.V[p] = 4.1887902047863905 * pow(c.radius[p], 3);
        for (int a = 0; a < 3; a++) c.s[p][a] = uniform(&state) - .42;
    }
    return c;
}

/* Those of this rank: by space, cut elsewhere than the cells are, or by nothing at all. */
static cloud own_particles(const cloud *all, int by_space)
{
    cloud c = cloud_new(all->n);
    c.n = 0;
    for (size_t i = 0; i < all->n; i++) {
        const size_t p = (i * 7919 + 13) % all->n; /* another order */
        const double y = (all->x[p][1] - origin[1]) / (cells[1] * spacing[1]);
        const int host = by_space ? (int)(y * .999 * ranks) : (int)(p * 31 % 101) % ranks;
        if (host != rank) continue;
        c.number[c.n] = p;
        memcpy(c.x[c.n], all->x[p], sizeof *c.x);
        memcpy(c.s[c.n], all->s[p], sizeof *c.s);
        c.radius[c.n] = all->radius[p];
        c.V[c.n++] = all->V[p];
    }
    return c;
}

static cpl_status build(cpl_map *map, const cloud *c)
{
    return cpl_map_build(map, c->n, (const double(*)[3])c->x, c->radius, c->V);
}

/* ---- comparing ------------------------------------------------------------------------------- */

static double worst; /* difference over the largest magnitude, since it was last told */

static void compare(double found, double expected, double scale)
{
    const double off = fabs(found - expected) / scale;
    if (!(off <= worst)) worst = off;
    if (!(off <= 1e-13)) fail_msg("%.17g instead of %.17g, of %g", found, expected, scale);
}

static void compare_reports(const cpl_map_report *r, const cpl_map_report *one)
{
    assert_int_equal(r->rows, one->rows);
    assert_int_equal(r->full_cells, one->full_cells);
    compare(r->solid_volume, one->solid_volume, one->solid_volume);
    compare(r->mapped_volume, one->mapped_volume, one->mapped_volume);
    compare(r->moved_volume, one->moved_volume, one->solid_volume);
    compare(r->eps_min, one->eps_min, 1);
    compare(r->eps_max, one->eps_max, 1);
}

static double largest(size_t n, const double *x)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs(x[i]));
    return most;
}

/* All that comes out of `map` against `one`, which has everything. */
static void compare_maps(const divided *d, const cpl_map *map, const cloud *mine,
                         const cpl_map *one, const cloud *all)
{
    const cpl_map_report r = cpl_map_last_report(map), r1 = cpl_map_last_report(one);
    compare_reports(&r, &r1);
    static double eps[CELLS], eps1[CELLS], q[9 * CELLS], q1[9 * CELLS], S[3 * CELLS], S1[3 * CELLS];
    cpl_voidage(map, eps);
    cpl_voidage(one, eps1);
    for (size_t i = 0; i < d->n; i++) compare(eps[i], eps1[d->id[i]], 1);
    cpl_scatter(map, 3, mine->s[0], S);
    cpl_scatter(one, 3, all->s[0], S1);
    for (size_t i = 0; i < d->n; i++)
        for (int a = 0; a < 3; a++)
            compare(S[3 * i + (size_t)a], S1[3 * d->id[i] + a], largest(3 * CELLS, S1));
    for (int width = 1; width <= 9; width += width == 1 ? 2 : 6) {
        uint64_t state = 77;
        double *at = malloc(mine->n * (size_t)width * sizeof *at + 1);
        double *at1 = malloc(all->n * (size_t)width * sizeof *at1 + 1);
        for (int i = 0; i < width * CELLS; i++) q1[i] = uniform(&state) - .31;
        for (size_t i = 0; i < d->n; i++)
            memcpy(q + i * (size_t)width, q1 + d->id[i] * width, (size_t)width * sizeof *q);
        cpl_gather(map, width, q, at);
        cpl_gather(one, width, q1, at1);
        for (size_t p = 0; p < mine->n; p++)
            for (int a = 0; a < width; a++)
                compare(at[p * (size_t)width + (size_t)a],
                        at1[mine->number[p] * (size_t)width + (size_t)a], 1);
        free(at), free(at1);
    }
}

/* One cloud on one mesh, divided in all ways. Returns the cells over the limit. */
static size_t divisions(int general, cpl_map_model model, double limit, const int periodic[3],
                        const cloud *all)
{
    size_t full = 0;
    for (int how = 0; how < DIVISIONS; how++)
        for (int by_space = 0; by_space < 2; by_space++) {
            divided *d = divide((division)how, general, periodic);
            cloud mine = own_particles(all, by_space);
            cpl_map *map, *one;
            CHECK(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, model, limit, &map));
            CHECK(cpl_map_new(&d->whole, model, limit, &one));
            const cpl_status status = build(map, &mine);
            if (status) fail_msg("%s: %s", division_name[how], cpl_map_message(map));
            CHECK(build(one, all));
            compare_maps(d, map, &mine, one, all);
            full = cpl_map_last_report(one).full_cells;
            cpl_map_free(map);
            cpl_map_free(one);
            cloud_free(&mine);
            free_divided(d);
        }
    if (rank == 0)
        print_message("%s, %s, limit %g: off by at most %.1e; %zu cells over the limit\n",
                      general ? "general" : "box", model == CPL_CENTRE ? "centre" : "divided cube",
                      limit, worst, full);
    worst = 0;
    return full;
}

static void same_as_one_rank(void **unused)
{
    (void)unused;
    cloud all = all_particles(1723, 1);
    for (int model = CPL_CENTRE; model <= CPL_DIVIDED_CUBE; model++) {
        divisions(0, (cpl_map_model)model, .92, (const int[3]){0, 0, 0}, &all);
        divisions(0, (cpl_map_model)model, .92, (const int[3]){1, 0, 1}, &all);
        divisions(0, (cpl_map_model)model, .92, (const int[3]){1, 1, 1}, &all);
        divisions(1, (cpl_map_model)model, .92, (const int[3]){0, 0, 0}, &all);
    }
    cloud_free(&all);
}

/* The limit acts in a few places, then in most of the box, where cells give through many rings. */
static void packing_limit(void **unused)
{
    (void)unused;
    cloud all = all_particles(1723, 1), heap = all_particles(1723, 1.6);
    assert_in_range(divisions(0, CPL_DIVIDED_CUBE, .2, (const int[3]){0, 0, 0}, &all), 3, 12);
    assert_in_range(divisions(0, CPL_DIVIDED_CUBE, .1, (const int[3]){1, 1, 0}, &all), 100, 180);
    assert_in_range(divisions(1, CPL_DIVIDED_CUBE, .15, (const int[3]){0, 0, 0}, &all), 20, 60);
    assert_in_range(divisions(0, CPL_DIVIDED_CUBE, .3, (const int[3]){0, 0, 0}, &heap), 6, 25);
    assert_in_range(divisions(1, CPL_CENTRE, .3, (const int[3]){0, 1, 0}, &heap), 6, 25);
    cloud_free(&all);
    cloud_free(&heap);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_one_rank),
        cmocka_unit_test(packing_limit),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
