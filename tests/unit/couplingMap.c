/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * couplingMap.c - the map W: conservation, continuity, both search paths, the packing limit.
 *
 * Reference values are closed forms: overlap lengths of a cube with slabs, sums that must be kept.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "cpl.h"
#include "near.h"

#define CHECK(status) assert_int_equal((status), CPL_OK)

static const double pi = 3.14159265358979323846;

/* A small congruential generator is enough to scatter points; Knuth's MMIX constants. */
static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

typedef struct cloud {
    size_t n;
    double (*x)[3], *radius, *V;
} cloud;

static cloud random_cloud(size_t n, const double lo[3], const double hi[3], double r0, double r1)
{
    cloud c = {n, malloc(n * sizeof *c.x), malloc(n * sizeof(double)), malloc(n * sizeof(double))};
    uint64_t state = 2385;
    for (size_t p = 0; p < n; p++) {
        for (int a = 0; a < 3; a++) c.x[p][a] = lo[a] + (hi[a] - lo[a]) * uniform(&state);
        c.radius[p] = r0 + (r1 - r0) * uniform(&state);
        c.V[p] = 4. / 3 * pi * pow(c.radius[p], 3);
    }
    return c;
}

static void free_cloud(cloud *c)
{
    free(c->x), free(c->radius), free(c->V);
}

static const int cells[3] = {7, 3, 9};
static const double origin[3] = {-.0131, .0072, .0119};
static const double spacing[3] = {.00513, .00731, .00497};

static void box_ends(double lo[3], double hi[3])
{
    for (int a = 0; a < 3; a++) lo[a] = origin[a], hi[a] = origin[a] + cells[a] * spacing[a];
}

static cpl_status build(cpl_map *map, const cloud *c)
{
    return cpl_map_build(map, c->n, (const double(*)[3])c->x, c->radius, c->V);
}

/* Largest errors of check_conservation: of a row's sum, of momentum given and received, of the work
 * on both sides, of the volume. */
static struct {
    double row, momentum, work, volume;
} worst;

static void report_conservation(const char *what)
{
    print_message("%s: rows off 1 by %.1e, momentum given and received by %.1e, work by %.1e, "
                  "volume by %.1e\n",
                  what, worst.row, worst.momentum, worst.work, worst.volume);
    memset(&worst, 0, sizeof worst);
}

/* Rows sum to 1; scatter keeps totals; gather is its transpose; solid volume is kept. */
static void check_conservation(const cpl_mesh *mesh, const cpl_map *map, const cloud *c)
{
    double *q = malloc(3 * mesh->n * sizeof *q), *S = malloc(3 * mesh->n * sizeof *S);
    double *qp = malloc(3 * c->n * sizeof *qp), *s = malloc(3 * c->n * sizeof *s);
    uint64_t state = 77;
    for (size_t i = 0; i < mesh->n; i++) q[i] = 1;
    cpl_gather(map, 1, q, qp);
    for (size_t p = 0; p < c->n; p++) {
        worst.row = fmax(worst.row, fabs(qp[p] - 1));
        assert_near(qp[p], 1, 1e-13);
    }

    for (size_t i = 0; i < 3 * mesh->n; i++) q[i] = uniform(&state) - .31;
    for (size_t i = 0; i < 3 * c->n; i++) s[i] = uniform(&state) - .42;
    cpl_gather(map, 3, q, qp);
    cpl_scatter(map, 3, s, S);
    double given[3] = {0}, received[3] = {0}, size = 0, work_p = 0, work_c = 0;
    for (size_t p = 0; p < c->n; p++)
        for (int a = 0; a < 3; a++) {
            given[a] += s[3 * p + (size_t)a];
            size += fabs(s[3 * p + (size_t)a]);
            work_p += s[3 * p + (size_t)a] * qp[3 * p + (size_t)a];
        }
    for (size_t i = 0; i < mesh->n; i++)
        for (int a = 0; a < 3; a++) {
            received[a] += S[3 * i + (size_t)a] * mesh->volume[i];
            work_c += S[3 * i + (size_t)a] * q[3 * i + (size_t)a] * mesh->volume[i];
        }
    for (int a = 0; a < 3; a++) {
        worst.momentum = fmax(worst.momentum, fabs(given[a] - received[a]) / size);
        assert_near(given[a], received[a], 1e-13 * size);
    }
    worst.work = fmax(worst.work, fabs(work_p - work_c) / size);
    assert_near(work_p, work_c, 1e-13 * size);

    const cpl_map_report r = cpl_map_last_report(map);
    double volume = 0, *eps = S;
    cpl_voidage(map, eps);
    for (size_t i = 0; i < mesh->n; i++) volume += (1 - eps[i]) * mesh->volume[i];
    worst.volume = fmax(worst.volume, fabs(volume / r.solid_volume - 1));
    assert_int_equal(r.rows, c->n);
    assert_true(fabs(r.mapped_volume / r.solid_volume - 1) <= 1e-13);
    assert_true(fabs(volume / r.solid_volume - 1) <= 1e-13);
    free(q), free(S), free(qp), free(s);
}

static void conserves(void **unused)
{
    (void)unused;
    double lo[3], hi[3];
    box_ends(lo, hi);
    cloud c = random_cloud(1723, lo, hi, .0004, .0011); /* some cubes are cut by the boundary */
    for (int model = CPL_CENTRE; model <= CPL_DIVIDED_CUBE; model++) {
        for (int sides = 0; sides < 8; sides++) {
            const int periodic[3] = {sides & 1, sides & 2, sides & 4};
            cpl_mesh mesh;
            cpl_map *map;
            CHECK(cpl_mesh_box(&mesh, cells, origin, spacing, periodic));
            CHECK(cpl_map_new(&mesh, (cpl_map_model)model, .92, &map));
            CHECK(build(map, &c));
            check_conservation(&mesh, map, &c);
            cpl_map_free(map);
            cpl_mesh_free(&mesh);
        }
        report_conservation(model == CPL_CENTRE ? "Box, centre" : "Box, divided cube");
    }
    free_cloud(&c);
}

/* A cube across an edge of four cells, by hand: 30 % of its width left, 80 % below. */
static void shares_by_hand(void **unused)
{
    (void)unused;
    cpl_mesh mesh;
    cpl_map *map;
    CHECK(cpl_mesh_box(&mesh, cells, origin, spacing, (const int[3]){0, 0, 0}));
    CHECK(cpl_map_new(&mesh, CPL_DIVIDED_CUBE, .75, &map));
    const double r = .00083;
    const double x[1][3] = {{origin[0] + 3 * spacing[0] + .4 * r, origin[1] + 1.5 * spacing[1],
                             origin[2] + 5 * spacing[2] - .6 * r}};
    const double V = 4. / 3 * pi * r * r * r, vc = spacing[0] * spacing[1] * spacing[2];
    CHECK(cpl_map_build(map, 1, x, &r, &V));
    double *eps = malloc(mesh.n * sizeof *eps);
    cpl_voidage(map, eps);
    const double share[2][2] = {{.3 * .8, .7 * .8}, {.3 * .2, .7 * .2}};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 2; i++) {
            const int at = (2 + i) + cells[0] * (1 + cells[1] * (4 + k));
            assert_near(1 - eps[at], share[k][i] * V / vc, 1e-13);
        }
    assert_int_equal(cpl_map_last_report(map).entries, 4);
    free(eps);
    cpl_map_free(map);
    cpl_mesh_free(&mesh);
}

/* Moving by a period changes nothing; a box one cell wide and a cube wider than the box work. */
static void periodic_wrap(void **unused)
{
    (void)unused;
    const int few[3] = {1, 2, 3};
    cpl_mesh mesh;
    cpl_map *map;
    CHECK(cpl_mesh_box(&mesh, few, origin, spacing, (const int[3]){1, 1, 1}));
    CHECK(cpl_map_new(&mesh, CPL_DIVIDED_CUBE, .9, &map));
    const double r = 1.3 * spacing[0], V = .3 * mesh.volume[0];
    double here[6], moved[6];
    const double x[1][3] = {{origin[0] + .1 * r, origin[1] + .2 * r, origin[2] - .3 * r}};
    const double y[1][3] = {
        {x[0][0] - spacing[0], x[0][1] + 2 * spacing[1], x[0][2] + 3 * spacing[2]}};
    CHECK(cpl_map_build(map, 1, x, &r, &V));
    cpl_voidage(map, here);
    const cloud one = {1, (double(*)[3])x, (double *)&r, (double *)&V};
    check_conservation(&mesh, map, &one);
    CHECK(cpl_map_build(map, 1, y, &r, &V));
    cpl_voidage(map, moved);
    for (int c = 0; c < 6; c++) assert_near(here[c], moved[c], 1e-14);
    /* Along z: the cube covers [-1.3, .7] r about the lower side, r = 1.3417 cells wide of 3. */
    const double w = r / spacing[2], covered = .7 * w;
    double upper = 0, lower = 0;
    for (int c = 0; c < 2; c++) lower += 1 - here[c], upper += 1 - here[4 + c];
    assert_near(lower * mesh.volume[0] / V, covered / (2 * w), 1e-13);
    assert_near(upper * mesh.volume[0] / V, 1 / (2 * w), 1e-13);
    cpl_map_free(map);
    cpl_mesh_free(&mesh);
}

/* The same box without its fast path. */
static void general_is_box(void **unused)
{
    (void)unused;
    double lo[3], hi[3];
    box_ends(lo, hi);
    cloud c = random_cloud(911, lo, hi, .0003, .0029);
    for (size_t p = 0; p < c.n; p++) c.V[p] *= .03; /* large cubes, little volume: no limit yet */
    for (int crowd = 0; crowd < 2; crowd++) {
        cpl_mesh mesh, general;
        cpl_map *fast, *slow;
        CHECK(cpl_mesh_box(&mesh, cells, origin, spacing, (const int[3]){0, 0, 0}));
        general = mesh;
        general.cells[0] = 0;
        const double limit = crowd ? .032 : .75; /* the second time the limit moves volume */
        CHECK(cpl_map_new(&mesh, CPL_DIVIDED_CUBE, limit, &fast));
        CHECK(cpl_map_new(&general, CPL_DIVIDED_CUBE, limit, &slow));
        CHECK(build(fast, &c));
        CHECK(build(slow, &c));
        assert_int_equal(cpl_map_last_report(slow).full_cells > 0, crowd);
        double *e0 = malloc(mesh.n * sizeof *e0), *e1 = malloc(mesh.n * sizeof *e1);
        cpl_voidage(fast, e0);
        cpl_voidage(slow, e1);
        for (size_t i = 0; i < mesh.n; i++) assert_near(e0[i], e1[i], 1e-13);
        check_conservation(&general, slow, &c);
        free(e0), free(e1);
        cpl_map_free(fast), cpl_map_free(slow);
        cpl_mesh_free(&mesh);
        report_conservation(crowd ? "General path, at the packing limit" : "General path");
    }
    free_cloud(&c);
}

/* ---- a mesh whose planes are not equally spaced, and one that is sheared -------------------- */

typedef struct graded {
    double plane[3][12];
    int cells[3];
} graded;

static void locate_graded(void *context, size_t m, const double (*x)[3], int *cell)
{
    const graded *g = context;
    for (size_t p = 0; p < m; p++) {
        int i[3], inside = 1;
        for (int a = 0; a < 3; a++) {
            i[a] = 0;
            while (i[a] < g->cells[a] && x[p][a] >= g->plane[a][i[a] + 1]) i[a]++;
            inside &= x[p][a] >= g->plane[a][0] && i[a] < g->cells[a];
        }
        cell[p] = inside ? i[0] + g->cells[0] * (i[1] + g->cells[1] * i[2]) : -1;
    }
}

/* Turns the box mesh into a graded one; its arrays are malloced and may be written. `grow` widens
 * the bounding boxes by that fraction, as those of skewed cells are. */
static void grade(cpl_mesh *mesh, graded *g, double grow)
{
    double *volume = (double *)mesh->volume;
    double(*lo)[3] = (double(*)[3])mesh->lo, (*hi)[3] = (double(*)[3])mesh->hi;
    for (int a = 0; a < 3; a++) {
        g->cells[a] = cells[a];
        for (int i = 0; i <= cells[a]; i++)
            g->plane[a][i] = origin[a] + spacing[a] * (i + .13 * i * (i - cells[a]) / cells[a]);
    }
    for (int k = 0, c = 0; k < cells[2]; k++)
        for (int j = 0; j < cells[1]; j++)
            for (int i = 0; i < cells[0]; i++, c++) {
                const int at[3] = {i, j, k};
                volume[c] = 1;
                for (int a = 0; a < 3; a++) {
                    const double w = g->plane[a][at[a] + 1] - g->plane[a][at[a]];
                    lo[c][a] = g->plane[a][at[a]] - grow * w;
                    hi[c][a] = g->plane[a][at[a] + 1] + grow * w;
                    volume[c] *= w;
                }
            }
    mesh->cells[0] = 0;
}

static double length_within(double a, double b, double lo, double hi)
{
    return fmax(0, fmin(b, hi) - fmax(a, lo));
}

static void general_on_graded(void **unused)
{
    (void)unused;
    double lo[3], hi[3];
    box_ends(lo, hi);
    cloud c = random_cloud(307, lo, hi, .0003, .0021);
    for (int skewed = 0; skewed < 2; skewed++) {
        graded g;
        cpl_mesh mesh;
        cpl_map *map;
        CHECK(cpl_mesh_box(&mesh, cells, origin, spacing, (const int[3]){0, 0, 0}));
        grade(&mesh, &g, skewed ? .11 : 0);
        void *context = mesh.context;
        mesh.locate = locate_graded;
        mesh.context = &g;
        CHECK(cpl_map_new(&mesh, CPL_DIVIDED_CUBE, skewed ? .16 : .85, &map));
        CHECK(build(map, &c));
        check_conservation(&mesh, map, &c);
        if (!skewed) { /* every share is a product of lengths, cut and normalised per axis */
            double *eps = malloc(mesh.n * sizeof *eps), *solid = calloc(mesh.n, sizeof *solid);
            for (size_t p = 0; p < c.n; p++)
                for (size_t i = 0; i < mesh.n; i++) {
                    double share = 1;
                    for (int a = 0; a < 3; a++) {
                        const double from = c.x[p][a] - c.radius[p], to = c.x[p][a] + c.radius[p];
                        share *= length_within(from, to, mesh.lo[i][a], mesh.hi[i][a]) /
                                 length_within(from, to, lo[a], hi[a]);
                    }
                    solid[i] += share * c.V[p];
                }
            cpl_voidage(map, eps);
            assert_int_equal(cpl_map_last_report(map).full_cells, 0);
            for (size_t i = 0; i < mesh.n; i++)
                assert_near(1 - eps[i], solid[i] / mesh.volume[i], 1e-13);
            free(eps), free(solid);
        } else {
            assert_true(cpl_map_last_report(map).full_cells > 0);
        }
        cpl_map_free(map);
        mesh.context = context;
        cpl_mesh_free(&mesh);
        report_conservation(skewed ? "Skewed mesh, at the packing limit" : "Graded mesh");
    }
    free_cloud(&c);
}

/* ---- continuity ------------------------------------------------------------------------------ */

/**
 * Move one particle across faces and edges in small steps among others. Along one axis a share of
 * the cube changes by at most ds/d, so a cell's solid fraction by at most 3 ds/d V/V_c; at the
 * packing limit what moves on is bounded likewise, each volume passing through a few cells.
 */
static void moves_smoothly(const double limit, size_t crowd, int expect_full, double factor)
{
    double lo[3], hi[3];
    box_ends(lo, hi);
    cpl_mesh mesh;
    cpl_map *map;
    CHECK(cpl_mesh_box(&mesh, cells, origin, spacing, (const int[3]){0, 0, 0}));
    CHECK(cpl_map_new(&mesh, CPL_DIVIDED_CUBE, limit, &map));
    cloud c = random_cloud(crowd + 1, lo, hi, .0009, .0011);
    const double d = 2 * c.radius[0], vc = mesh.volume[0];
    double *eps = malloc(mesh.n * sizeof *eps), *old = malloc(mesh.n * sizeof *old), largest = 0;
    const int steps = 4000;
    const double from[3] = {lo[0] + .7 * d, lo[1] + .6 * d, lo[2] + .55 * d};
    const double way[3] = {hi[0] - lo[0] - 1.5 * d, hi[1] - lo[1] - 1.3 * d,
                           hi[2] - lo[2] - 1.2 * d};
    size_t full = 0;
    double volume = 0, beyond = 0; /* errors: of the volume, of the limit */
    for (int s = 0; s <= steps; s++) {
        for (int a = 0; a < 3; a++) c.x[0][a] = from[a] + way[a] * s / steps;
        CHECK(build(map, &c));
        const cpl_map_report r = cpl_map_last_report(map);
        full += r.full_cells;
        cpl_voidage(map, eps);
        double solid = 0;
        for (size_t i = 0; i < mesh.n; i++) {
            solid += (1 - eps[i]) * mesh.volume[i];
            beyond = fmax(beyond, 1 - eps[i] - limit);
            if (s > 0) largest = fmax(largest, fabs(eps[i] - old[i]));
        }
        memcpy(old, eps, mesh.n * sizeof *old);
        volume = fmax(volume, fabs(r.mapped_volume / r.solid_volume - 1));
        volume = fmax(volume, fabs(solid / r.solid_volume - 1));
    }
    const double ds = (way[0] + way[1] + way[2]) / steps;
    print_message(
        "Packing limit %g, %zu full cells in %d steps: largest change of the void fraction "
        "%.3f of the bound for one particle, volume off by %.1e\n",
        limit, full, steps, largest / (ds / d * c.V[0] / vc), volume);
    assert_true(volume <= 1e-13);
    assert_true(beyond <= 1e-13);
    assert_true(largest <= factor * ds / d * c.V[0] / vc);
    assert_true(largest > .2 * ds / d * c.V[0] / vc);
    assert_int_equal(full > 0, expect_full);
    free(eps), free(old);
    free_cloud(&c);
    cpl_map_free(map);
    cpl_mesh_free(&mesh);
}

static void continuous(void **unused)
{
    (void)unused;
    moves_smoothly(.75, 60, 0, 1.0001);
}

static void continuous_at_limit(void **unused)
{
    (void)unused;
    moves_smoothly(.16, 900, 1, 2.); /* mean solid fraction .11: many cells over the limit */
    moves_smoothly(.125, 900, 1, 4.);
}

/* ---- packing limit --------------------------------------------------------------------------- */

/* One crowded cell in a column: the excess is halved between the neighbours, in proportion to
 * their room once one of them holds something, and goes a ring further when they are full. */
static void excess_by_hand(void **unused)
{
    (void)unused;
    cpl_mesh mesh;
    cpl_map *map;
    CHECK(cpl_mesh_box(&mesh, (const int[3]){7, 1, 1}, (const double[3]){0, 0, 0},
                       (const double[3]){1, 1, 1}, (const int[3]){0, 0, 0}));
    CHECK(cpl_map_new(&mesh, CPL_CENTRE, .6, &map));
    const double x[3][3] = {{3.5, .5, .5}, {3.4, .5, .5}, {4.5, .5, .5}};
    const double radius[3] = {.3, .3, .3};
    double eps[7];
    CHECK(cpl_map_build(map, 3, x, radius, (const double[3]){.5, .4, .2}));
    cpl_voidage(map, eps);
    /* excess .3 onto room .6 and .4 */
    const double first[7] = {0, 0, .18, .6, .32, 0, 0};
    for (int c = 0; c < 7; c++) assert_near(1 - eps[c], first[c], 1e-14);
    assert_near(cpl_map_last_report(map).moved_volume, .3, 1e-14);
    assert_int_equal(cpl_map_last_report(map).full_cells, 1);

    CHECK(cpl_map_build(map, 3, x, radius, (const double[3]){1.1, .9, .2}));
    cpl_voidage(map, eps);
    /* excess 1.4: neighbours take .6 and .4, the ring beyond .2 and .2 */
    const double second[7] = {0, .2, .6, .6, .6, .2, 0};
    for (int c = 0; c < 7; c++) assert_near(1 - eps[c], second[c], 1e-14);

    /* A field seen through the moved rows: particle 0 keeps .6/2 of itself in cell 3. */
    const double q[7] = {0, 0, 0, 1, 0, 0, 0};
    double qp[3];
    cpl_gather(map, 1, q, qp);
    assert_near(qp[0], .3, 1e-14);
    assert_near(qp[2], 0, 1e-14);

    assert_int_equal(cpl_map_build(map, 3, x, radius, (const double[3]){3, 1, .21}), CPL_FULL);
    assert_non_null(strstr(cpl_map_message(map), "cell 3"));
    cpl_map_free(map);
    cpl_mesh_free(&mesh);
}

static void refuses(void **unused)
{
    (void)unused;
    cpl_mesh mesh;
    cpl_map *map;
    assert_int_equal(
        cpl_mesh_box(&mesh, (const int[3]){3, 0, 1}, origin, spacing, (const int[3]){0, 0, 0}),
        CPL_BAD_ARGUMENT);
    CHECK(cpl_mesh_box(&mesh, cells, origin, spacing, (const int[3]){0, 0, 1}));
    assert_int_equal(cpl_map_new(&mesh, CPL_CENTRE, 1.2, &map), CPL_BAD_ARGUMENT);
    cpl_map_free(map);
    for (int model = CPL_CENTRE; model <= CPL_DIVIDED_CUBE; model++) {
        CHECK(cpl_map_new(&mesh, (cpl_map_model)model, .7, &map));
        double x[2][3] = {{0, .01, .02}, {-.0132, .01, .02}};
        const double r[2] = {.001, .001}, V[2] = {4e-9, 4e-9}, none[2] = {.001, 0};
        assert_int_equal(cpl_map_build(map, 2, (const double(*)[3])x, r, V), CPL_OUTSIDE);
        assert_non_null(strstr(cpl_map_message(map), "row 1 at (-0.0132 0.01 0.02)"));
        x[1][0] = NAN;
        assert_int_equal(cpl_map_build(map, 2, (const double(*)[3])x, r, V), CPL_OUTSIDE);
        x[1][0] = .001;
        assert_int_equal(cpl_map_build(map, 2, (const double(*)[3])x, none, V), CPL_BAD_ARGUMENT);
        x[1][2] = origin[2] + 9.3 * spacing[2]; /* beyond the periodic side */
        CHECK(cpl_map_build(map, 2, (const double(*)[3])x, r, V));
        cpl_map_free(map);
    }
    cpl_mesh_free(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(conserves),
        cmocka_unit_test(shares_by_hand),
        cmocka_unit_test(periodic_wrap),
        cmocka_unit_test(general_is_box),
        cmocka_unit_test(general_on_graded),
        cmocka_unit_test(continuous),
        cmocka_unit_test(continuous_at_limit),
        cmocka_unit_test(excess_by_hand),
        cmocka_unit_test(refuses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
