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

/* ---- traffic --------------------------------------------------------------------------------- */

static const int open_sides[3] = {0, 0, 0};

/* Particles that are with their cells borrow the layer beyond the border, if they stick out. */
static void borrows_at_borders_only(void **unused)
{
    (void)unused;
    cloud all = all_particles(1723, 1), mine = cloud_new(all.n);
    divided *d = divide(SLABS_Z, 0, open_sides);
    mine.n = 0;
    for (size_t p = 0; p < all.n; p++) {
        int cell;
        d->whole.locate(d->whole.context, 1, (const double(*)[3]) & all.x[p], &cell);
        if (d->place[cell] < 0) continue;
        memcpy(mine.x[mine.n], all.x[p], sizeof *mine.x);
        mine.radius[mine.n] = all.radius[p];
        mine.V[mine.n++] = all.V[p];
    }
    for (int model = CPL_CENTRE; model <= CPL_DIVIDED_CUBE; model++) {
        cpl_map *map;
        CHECK(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, (cpl_map_model)model, .9, &map));
        CHECK(build(map, &mine));
        const size_t layer = (size_t)(cells[0] * cells[1]), borders = (size_t)(ranks - 1);
        const size_t borrowed = cpl_map_last_report(map).borrowed;
        if (model == CPL_CENTRE || ranks == 1)
            assert_int_equal(borrowed, 0);
        else
            assert_in_range(borrowed, borders * layer, 2 * borders * layer);
        cpl_map_free(map);
    }
    free_divided(d);
    cloud_free(&mine);
    cloud_free(&all);
}

/* A swarm drifts through a long channel: cells that it has left are given back, and it is mapped as
 * on one rank all the way. */
static void gives_back(void **unused)
{
    (void)unused;
    enum { LONG = 400, WIDE = 4, SWARM = 600, BUILDS = 700 };
    static const int channel[3] = {WIDE, WIDE, LONG}, periodic[3] = {0, 0, 1};
    static const double zero[3] = {0, 0, 0}, h[3] = {.002, .002, .002};
    static int64_t id[WIDE * WIDE * LONG];
    size_t n = 0, most = 0;
    for (int64_t c = 0; c < WIDE * WIDE * LONG; c++)
        if (c * 31 % 7 % ranks == rank) id[n++] = c;
    cpl_mesh part, whole;
    cpl_map *map, *one;
    CHECK(cpl_mesh_box_part(&part, channel, zero, h, periodic, n, id));
    CHECK(cpl_mesh_box(&whole, channel, zero, h, periodic));
    CHECK(cpl_map_new_ranks(MPI_COMM_WORLD, &part, CPL_DIVIDED_CUBE, .9, &map));
    CHECK(cpl_map_new(&whole, CPL_DIVIDED_CUBE, .9, &one));
    static double x[SWARM][3], radius[SWARM], V[SWARM], eps[WIDE * WIDE * LONG];
    static double eps1[WIDE * WIDE * LONG];
    for (int b = 0; b < BUILDS; b++) {
        uint64_t state = 7;
        for (int p = 0; p < SWARM; p++) {
            for (int a = 0; a < 3; a++) x[p][a] = .0005 + .007 * uniform(&state);
            x[p][2] += 1.1e-3 * b;
            radius[p] = 4e-4;
            V[p] = 2.68e-10;
        }
        /* now one rank has the swarm, now another; it grows when cells are first given back */
        const size_t number = b < 63 ? 20 : SWARM, here = b / 50 % ranks == rank ? number : 0;
        CHECK(cpl_map_build(map, here, (const double(*)[3])x, radius, V));
        if (cpl_map_last_report(map).borrowed > most) most = cpl_map_last_report(map).borrowed;
        if (b % 20) continue;
        CHECK(cpl_map_build(one, number, (const double(*)[3])x, radius, V));
        cpl_voidage(map, eps);
        cpl_voidage(one, eps1);
        for (size_t i = 0; i < n; i++) compare(eps[i], eps1[id[i]], 1);
    }
    if (rank == 0) print_message("%zu cells borrowed at most, of %zu\n", most, whole.n);
    assert_true(ranks == 1 || (most > 100 && most < 1200));
    cpl_map_free(map);
    cpl_map_free(one);
    cpl_mesh_free(&part);
    cpl_mesh_free(&whole);
}

/* ---- errors ---------------------------------------------------------------------------------- */

/* The text is the same on all ranks and has these words. */
static void expect_text(const char *text, const char *words)
{
    char first[512] = "";
    snprintf(first, sizeof first, "%s", text);
    MPI_Bcast(first, sizeof first, MPI_CHAR, 0, MPI_COMM_WORLD);
    assert_string_equal(first, text);
    if (!strstr(text, words)) fail_msg("'%s' is not in '%s'", words, text);
}

static void one_bad_particle(int general, cpl_map_model model)
{
    cloud all = all_particles(311, 1);
    divided *d = divide(CHECKERBOARD, general, open_sides);
    cpl_map *map, *one;
    CHECK(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, model, .9, &map));
    CHECK(cpl_map_new(&d->whole, model, .9, &one));
    CHECK(build(one, &all));
    const int last = rank == ranks - 1;
    char words[64];
    snprintf(words, sizeof words, "row 3 of rank %d", ranks - 1);
    for (int bad = 0; bad < 2; bad++) {
        cloud mine = own_particles(&all, 0);
        if (last) mine.x[3][1] = bad ? NAN : origin[1] - 1e-5;
        assert_int_equal(build(map, &mine), CPL_OUTSIDE);
        expect_text(cpl_map_message(map), words);
        cloud_free(&mine);
    }
    cloud mine = own_particles(&all, 0);
    if (rank == 0) mine.radius[2] = 0;
    assert_int_equal(build(map, &mine), CPL_BAD_ARGUMENT);
    expect_text(cpl_map_message(map), "row 2 has radius 0");
    mine.radius[2] = 1e-3;
    cloud_free(&mine);
    mine = own_particles(&all, 1); /* nothing is left of the errors */
    CHECK(build(map, &mine));
    compare_maps(d, map, &mine, one, &all);
    cloud_free(&mine);
    cpl_map_free(map);
    cpl_map_free(one);
    free_divided(d);
    cloud_free(&all);
}

static void bad_particles(void **unused)
{
    (void)unused;
    one_bad_particle(0, CPL_DIVIDED_CUBE);
    one_bad_particle(0, CPL_CENTRE);
    one_bad_particle(1, CPL_DIVIDED_CUBE);
    one_bad_particle(1, CPL_CENTRE);
}

/* More solid than all cells can hold, and than a corner cut off from the rest can. */
static void no_room(void **unused)
{
    (void)unused;
    cloud all = all_particles(1723, 1), mine = own_particles(&all, 0);
    divided *d = divide(SLABS_X, 0, open_sides);
    cpl_map *map;
    CHECK(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, CPL_DIVIDED_CUBE, .05, &map));
    assert_int_equal(build(map, &mine), CPL_FULL);
    expect_text(cpl_map_message(map), "packing limit 0.05");
    cpl_map_free(map);
    free_divided(d);

    d = divide(SCATTERED, 1, open_sides);
    for (size_t i = 0; i < d->n; i++) /* no way out of the lowest layer */
        for (size_t k = d->offset[i]; k < d->offset[i + 1]; k++) {
            const int layer = cells[0] * cells[1];
            if ((d->id[i] < layer) != (d->link[k] < layer)) d->link[k] = d->id[i];
        }
    for (size_t p = 0; p < mine.n; p++) mine.x[p][2] = origin[2] + .5 * spacing[2];
    CHECK(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, CPL_CENTRE, .3, &map));
    assert_int_equal(build(map, &mine), CPL_FULL);
    expect_text(cpl_map_message(map), "no cell connected with it has room left");
    cpl_map_free(map);
    free_divided(d);
    cloud_free(&mine);
    cloud_free(&all);
}

static void bad_parts(void **unused)
{
    (void)unused;
    cpl_map *map;
    divided *d = divide(ALL_ON_LAST, 1, open_sides);
    const int last = rank == ranks - 1;
    const int64_t id = d->id[7], link = d->link[11];

    if (last) d->id[7] = d->id[8];
    assert_int_equal(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, CPL_DIVIDED_CUBE, .9, &map),
                     CPL_BAD_ARGUMENT);
    expect_text(cpl_map_message(map), "the cell with id");
    cpl_map_free(map);

    if (last) d->id[7] = id, d->link[11] = CELLS;
    assert_int_equal(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, CPL_DIVIDED_CUBE, .9, &map),
                     CPL_BAD_ARGUMENT);
    expect_text(cpl_map_message(map), "has the id 315, the mesh has 315 cells");
    cpl_map_free(map);

    if (last) d->link[11] = link;
    assert_int_equal(cpl_map_new_ranks(MPI_COMM_WORLD, &d->part, CPL_DIVIDED_CUBE, 1.2, &map),
                     CPL_BAD_ARGUMENT);
    expect_text(cpl_map_message(map), "packing limit between 0 and 1");
    cpl_map_free(map);
    free_divided(d);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_one_rank),
        cmocka_unit_test(packing_limit),
        cmocka_unit_test(borrows_at_borders_only),
        cmocka_unit_test(gives_back),
        cmocka_unit_test(bad_particles),
        cmocka_unit_test(no_room),
        cmocka_unit_test(bad_parts),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
