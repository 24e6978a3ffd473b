/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Restart of the engine: a run that is written, read and continued is the straight run to the last
 * bit, in everything that a restart file holds; what must not change is refused, what may change
 * keeps its history. How bad files are refused is in demRestartFile.c.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dem.h"
#include "stlFixture.h"

enum { CHUNKS = 12, GRAINS = 420 };

static char directory[256];

/* ---- a box of grains in many variants ---------------------------------------------------------
 */

typedef struct variant {
    const char *name;
    dem_law law;
    dem_rolling rolling;
    int periodic, uneven, moving, feeding, outside, balance, triangles;
    int least; /* contacts at the end, so that there is history to lose */
} variant;

static const variant VARIANT[] = {
    {.name = "linear", .law = DEM_LINEAR, .least = 100},
    {.name = "hertz", .law = DEM_HERTZ, .least = 100},
    {.name = "uneven", .law = DEM_LINEAR, .uneven = 1, .least = 100},
    {.name = "periodic", .law = DEM_HERTZ, .periodic = 1, .uneven = 1, .least = 100},
    {.name = "moving", .law = DEM_LINEAR, .moving = 1, .least = 100},
    {.name = "rolling",
     .law = DEM_HERTZ,
     .rolling = DEM_ROLLING_EPSD,
     .moving = 1,
     .balance = 1,
     .least = 100},
    {.name = "constant",
     .law = DEM_LINEAR,
     .rolling = DEM_ROLLING_CONSTANT,
     .balance = 1,
     .uneven = 1,
     .least = 100},
    {.name = "feeding", .law = DEM_LINEAR, .feeding = 1, .uneven = 1, .balance = 1, .least = 100},
    {.name = "triangles", .law = DEM_HERTZ, .triangles = 1, .least = 100},
    {.name = "outside", .law = DEM_LINEAR, .outside = 1, .least = 100},
};
enum { VARIANTS = sizeof VARIANT / sizeof *VARIANT };

typedef struct box {
    dem_param param;
    dem_material material[3];
    dem_pair pair[9];
    dem_wall wall[3];
    dem_motion motion[2];
    dem_insertion insertion;
    dem_species species[2];
    dem_feeder feeder;
    dem_outlet outlet;
    dem_sim *sim;
    int column;
} box;

static dem_sdf *vessel_of_triangles(void)
{
    body vessel = box_body((const double[3]){-.0205, -.0185, .0005},
                           (const double[3]){.0205, .0185, .069}, 2);
    dem_sdf *shape = stl_shape(&vessel, 1);
    assert_non_null(shape);
    body_free(&vessel);
    return shape;
}

static void box_init(box *b, const variant *v)
{
    memset(b, 0, sizeof *b);
    dem_param *p = &b->param;
    *p = dem_param_default();
    p->law = v->law;
    p->rolling = v->rolling;
    p->balance = v->balance;
    const double lo[3] = {-.021, -.019, 0}, hi[3] = {.021, .019, .07};
    memcpy(p->lo, lo, sizeof lo);
    memcpy(p->hi, hi, sizeof hi);
    p->periodic[0] = v->periodic;
    p->gravity[0] = 2.1;
    p->gravity[2] = -9.66;
    static const char *const names[] = {"grain", "steel", "wood"};
    for (int m = 0; m < 3; m++) {
        strcpy(b->material[m].name, names[m]);
        b->material[m].density = 2385 - 411 * m;
        b->material[m].youngs_modulus = 2.7e6;
        b->material[m].poisson_ratio = .29;
    }
    for (int k = 0; k < 9; k++)
        b->pair[k] = (dem_pair){.restitution = .61,
                                .friction = .37,
                                .stiffness = 713,
                                .stiffness_ratio = .81,
                                .rolling_friction = .09,
                                .rolling_damping = .3};
    p->n_material = 3;
    p->material = b->material;
    p->pair = b->pair;

    p->n_wall = 2;
    p->wall = b->wall;
    strcpy(b->wall[0].name, "box");
    /* Beyond the periodic sides; else just within the domain. */
    const double wide = v->periodic ? .03 : .0205;
    b->wall[0].shape = dem_sdf_box((const double[3]){-wide, -.0185, .0005},
                                   (const double[3]){wide, .0185, .069}, 1);
    if (v->triangles) {
        dem_sdf_free(b->wall[0].shape);
        b->wall[0].shape = vessel_of_triangles();
    }
    b->wall[0].material = 1;
    strcpy(b->wall[1].name, "bar");
    b->wall[1].shape = dem_sdf_cylinder((const double[3]){0, -.018, .008},
                                        (const double[3]){0, .018, .008}, .004, 1, 0);
    b->wall[1].material = 2;
    if (v->moving) {
        b->motion[0] = b->motion[1] = dem_motion_default();
        b->motion[0].kind = DEM_ROTATION;
        b->motion[0].vector[1] = 1;
        b->motion[0].origin[0] = .003;
        b->motion[0].origin[2] = .011;
        b->motion[0].rate = 23;
        b->motion[1].kind = DEM_OSCILLATION;
        b->motion[1].vector[2] = .002;
        b->motion[1].frequency = 31;
        b->wall[1].n_motion = 2;
        b->wall[1].motion = b->motion;
    }
    for (int s = 0; s < 2; s++) {
        b->species[s].material = s ? 2 : 0;
        b->species[s].share = 1 + s;
        b->species[s].size = (dem_size){.kind = DEM_SIZE_EQUAL, .mean = .0029};
        if (v->uneven)
            b->species[s].size =
                (dem_size){.kind = DEM_SIZE_UNIFORM, .lo = .0014 - .0002 * s, .hi = .0041};
    }
    const double low[3] = {-.02, -.018, .02}, high[3] = {.02, .018, .068};
    dem_insertion *i = &b->insertion;
    strcpy(i->name, "fill");
    i->kind = DEM_INSERT_RANDOM;
    i->region = dem_sdf_box(low, high, 1);
    memcpy(i->lo, low, sizeof low);
    memcpy(i->hi, high, sizeof high);
    i->number = GRAINS;
    i->n_species = v->uneven ? 2 : 1;
    i->species = b->species;
    i->velocity[2] = -.4;
    i->velocity_spread = .3;
    i->seed = 4711;
    p->n_insertion = 1;
    p->insertion = i;
    if (!v->feeding) return;
    dem_feeder *f = &b->feeder;
    strcpy(f->name, "spout");
    const double top[3] = {-.015, -.015, .05}, end[3] = {.015, .015, .068};
    f->region = dem_sdf_box(top, end, 1);
    memcpy(f->lo, top, sizeof top);
    memcpy(f->hi, end, sizeof end);
    f->n_species = 2;
    f->species = b->species;
    f->mass_rate = .043;
    f->end = 1;
    f->mass = INFINITY;
    f->number = -1;
    f->velocity[2] = -.9;
    f->velocity_spread = .11;
    f->seed = 99;
    p->n_feeder = 1;
    p->feeder = f;
    strcpy(b->outlet.name, "drain");
    b->outlet.region =
        dem_sdf_box((const double[3]){.012, -.02, 0}, (const double[3]){.022, 0, .006}, 1);
    b->outlet.end = INFINITY;
    p->n_outlet = 1;
    p->outlet = &b->outlet;
}

static void box_new(box *b, const variant *v, const char *restart)
{
    box_init(b, v);
    b->param.restart = restart;
    if (dem_new(MPI_COMM_SELF, &b->param, &b->sim)) fail_msg("%s", dem_message(b->sim));
    b->column = dem_attach(b->sim, "carried", 3);
    assert_true(b->column >= 0);
    assert_int_equal(dem_column_restored(b->sim, b->column), restart != NULL);
}

/* A fluid of sorts: drag to a wind that depends on place and on what is carried along. */
static void blow(box *b)
{
    const dem_view view = dem_particles(b->sim);
    double(*f)[3] = calloc(view.n + 1, sizeof *f), (*w)[3] = calloc(view.n + 1, sizeof *w);
    double *k = calloc(view.n + 1, sizeof *k), *M = calloc(view.n + 1, sizeof *M);
    double *carried = dem_column(b->sim, b->column);
    for (size_t i = 0; i < view.n; i++) {
        for (int a = 0; a < 3; a++) {
            carried[3 * i + (size_t)a] = .5 * carried[3 * i + (size_t)a] + view.impulse[i][a];
            f[i][a] = .1 * carried[3 * i + (size_t)a];
            w[i][a] = .3 * sin(200 * view.x[i][(a + 1) % 3]);
        }
        k[i] = 3e-4 * (1 + view.x[i][0]);
        M[i] = .2 * view.mass[i];
    }
    assert_int_equal(
        dem_set_outside_force(b->sim, (const double(*)[3])f, k, (const double(*)[3])w, M), DEM_OK);
    free(f);
    free(w);
    free(k);
    free(M);
}

/* Every other time the outside force of the chunk before stays. */
static void box_advance(box *b, const variant *v, int from, int to)
{
    for (int c = from; c < to; c++) {
        if (v->outside && c % 2 == 0) blow(b);
        if (dem_advance(b->sim, .0131, 0)) fail_msg("%s: %s", v->name, dem_message(b->sim));
    }
}

static char *path_of(const char *name, char path[512])
{
    snprintf(path, 512, "%s/%s.h5", directory, name);
    return path;
}

static void write_restart(box *b, const char *name)
{
    if (dem_write_restart(b->sim, directory, name, 0)) fail_msg("%s", dem_message(b->sim));
}

static char *read_whole(const char *name, size_t *size)
{
    char path[512];
    FILE *file = fopen(path_of(name, path), "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    char *bytes = malloc(*size + 1);
    rewind(file);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void expect_same_file(const char *variant_name, const char *one, const char *two)
{
    size_t size[2];
    char *a = read_whole(one, &size[0]), *b = read_whole(two, &size[1]);
    assert_int_equal(size[0], size[1]);
    if (memcmp(a, b, size[0]) != 0) fail_msg("%s: the two runs differ", variant_name);
    free(a);
    free(b);
}

static void remove_file(const char *name)
{
    char path[512];
    unlink(path_of(name, path));
}

/* ---- bit for bit ------------------------------------------------------------------------------
 */

static void expect_same_view(const box *one, const box *two)
{
    const dem_view a = dem_particles(one->sim), b = dem_particles(two->sim);
    assert_int_equal(a.n, b.n);
    assert_memory_equal(a.id, b.id, a.n * sizeof *a.id);
    assert_memory_equal(a.x, b.x, a.n * sizeof *a.x);
    assert_memory_equal(a.v, b.v, a.n * sizeof *a.v);
    assert_memory_equal(a.omega, b.omega, a.n * sizeof *a.omega);
    assert_memory_equal(a.force, b.force, a.n * sizeof *a.force);
    assert_memory_equal(a.impulse, b.impulse, a.n * sizeof *a.impulse);
    for (size_t w = 0; w < dem_walls(one->sim); w++) {
        double f[2][6];
        dem_wall_force(one->sim, w, f[0]);
        dem_wall_torque(one->sim, w, f[0] + 3);
        dem_wall_force(two->sim, w, f[1]);
        dem_wall_torque(two->sim, w, f[1] + 3);
        assert_memory_equal(f[0], f[1], sizeof f[0]);
    }
}

static void expect_same_report(const box *one, const box *two)
{
    dem_report a = dem_last_report(one->sim), b = dem_last_report(two->sim);
    assert_int_equal(a.rebuilds, b.rebuilds);
    assert_int_equal(a.contacts, b.contacts);
    assert_int_equal(a.wall_contacts, b.wall_contacts);
    assert_true(a.kinetic_energy == b.kinetic_energy);
    assert_true(a.rotational_energy == b.rotational_energy);
    assert_true(a.overlap == b.overlap && a.step == b.step && a.substeps == b.substeps);
    assert_memory_equal(&a.energy, &b.energy, sizeof a.energy);
    assert_memory_equal(a.momentum, b.momentum, sizeof a.momentum);
    assert_true(dem_time(one->sim) == dem_time(two->sim));
    const dem_limits l = dem_time_limits(one->sim), m = dem_time_limits(two->sim);
    assert_memory_equal(&l, &m, sizeof l);
}

/* Less than half as large as any that the parameters announce: the vessel is sampled more finely,
 * which a restart can know from the file alone. */
static void add_small(box *b)
{
    const double x[1][3] = {{.001, .002, .0695 - .0015}}, radius = .0007;
    const int material = 0;
    if (dem_add(b->sim, 1, x, NULL, NULL, &radius, &material, NULL))
        fail_msg("%s", dem_message(b->sim));
}

/* Written right after dem_new, early in the fall, and twice in the dense bed. */
static void straight_and_interrupted(const variant *v)
{
    static const int stop[] = {0, 1, 7, 10};
    static const char *const name[] = {"0", "1", "7", "10"};
    char path[512];
    box straight, again;
    box_new(&straight, v, NULL);
    if (v->triangles) add_small(&straight);
    for (int k = 0, at = 0; k < 4; k++) {
        box_advance(&straight, v, at, stop[k]);
        at = stop[k];
        write_restart(&straight, name[k]);
        write_restart(&straight, "twice"); /* writing changes nothing */
        expect_same_file(v->name, name[k], "twice");
    }
    box_advance(&straight, v, stop[3], CHUNKS);
    write_restart(&straight, "straight");
    const dem_report report = dem_last_report(straight.sim);
    if (report.contacts < v->least) fail_msg("%s: %d contacts", v->name, (int)report.contacts);
    assert_true(report.wall_contacts > 10 && report.rebuilds > 20);
    for (int k = 0; k < 4; k++) {
        box_new(&again, v, path_of(name[k], path));
        write_restart(&again, "twice"); /* nor does reading */
        expect_same_file(v->name, name[k], "twice");
        box_advance(&again, v, stop[k], CHUNKS);
        expect_same_view(&straight, &again);
        expect_same_report(&straight, &again);
        write_restart(&again, "again");
        expect_same_file(v->name, "straight", "again");
        dem_free(again.sim);
        remove_file(name[k]);
    }
    dem_free(straight.sim);
    remove_file("straight");
    remove_file("again");
    remove_file("twice");
}

static void test_bit_for_bit(void **state)
{
    (void)state;
    for (int k = 0; k < VARIANTS; k++) straight_and_interrupted(&VARIANT[k]);
}

/* What the file must hold is seen when it is left out: without history the runs go apart. */
static void test_history_matters(void **state)
{
    (void)state;
    char path[512];
    box straight, again;
    box_new(&straight, &VARIANT[0], NULL);
    box_advance(&straight, &VARIANT[0], 0, 8);
    write_restart(&straight, "8");
    box_init(&again, &VARIANT[0]);
    again.param.restart = path_of("8", path);
    strcpy(again.wall[0].name, "vessel"); /* another wall: its springs are left behind */
    if (dem_new(MPI_COMM_SELF, &again.param, &again.sim)) fail_msg("%s", dem_message(again.sim));
    box_advance(&straight, &VARIANT[0], 8, 9);
    box_advance(&again, &VARIANT[0], 8, 9);
    const dem_view a = dem_particles(straight.sim), b = dem_particles(again.sim);
    double most = 0;
    for (size_t i = 0; i < a.n; i++)
        for (size_t j = 0; j < b.n; j++)
            if (a.id[i] == b.id[j])
                for (int c = 0; c < 3; c++) most = fmax(most, fabs(a.x[i][c] - b.x[j][c]));
    assert_true(most > 1e-9 && most < 5e-3);
    dem_free(straight.sim);
    dem_free(again.sim);
    remove_file("8");
}

/* ---- what may change --------------------------------------------------------------------------
 */

static void test_changed_case(void **state)
{
    (void)state;
    char path[512];
    const variant *v = &VARIANT[7]; /* feeding */
    box straight, again;
    box_new(&straight, v, NULL);
    box_advance(&straight, v, 0, 8);
    write_restart(&straight, "8");

    /* Materials in another order and denser, a wall more before the others, a faster feeder. */
    box_init(&again, v);
    dem_material grain = again.material[0];
    again.material[0] = again.material[2];
    again.material[2] = grain;
    for (int m = 0; m < 3; m++) again.material[m].density *= 1.25;
    again.species[0].material = 2;
    again.species[1].material = 0;
    again.wall[2] = again.wall[0];
    again.wall[0] = again.wall[1];
    again.wall[0].material = 0;
    strcpy(again.wall[1].name, "plate");
    again.wall[1].shape = dem_sdf_plane((const double[3]){0, 0, .0001}, (const double[3]){0, 0, 1});
    again.wall[1].material = 1;
    again.param.n_wall = 3;
    again.feeder.mass_rate *= 3;
    again.param.restart = path_of("8", path);
    if (dem_new(MPI_COMM_SELF, &again.param, &again.sim)) fail_msg("%s", dem_message(again.sim));
    const dem_report a = dem_last_report(straight.sim), b = dem_last_report(again.sim);
    assert_int_equal(a.particles, b.particles);
    assert_float_equal(b.mass / a.mass, 1.25, 1e-12);
    double mass[2], waiting[2], taken[2];
    int64_t number[2], gone[2];
    dem_fed(straight.sim, 0, &number[0], &mass[0], &waiting[0]);
    dem_fed(again.sim, 0, &number[1], &mass[1], &waiting[1]);
    dem_removed(straight.sim, 0, &gone[0], &taken[0]);
    dem_removed(again.sim, 0, &gone[1], &taken[1]);
    assert_int_equal(number[0], number[1]);
    assert_int_equal(gone[0], gone[1]);
    assert_true(number[0] > 20 && gone[0] > 5 && taken[0] == taken[1] && mass[0] == mass[1]);
    box_advance(&straight, v, 8, CHUNKS);
    box_advance(&again, v, 8, CHUNKS);
    double now[2];
    dem_fed(straight.sim, 0, &number[0], &now[0], &waiting[0]);
    dem_fed(again.sim, 0, &number[1], &now[1], &waiting[1]);
    /* What was due is not fed twice: three times the rate of the straight run from there. */
    const double ratio = (now[1] + waiting[1] - mass[1]) / (now[0] + waiting[0] - mass[0]);
    if (fabs(ratio - 3) > .35) fail_msg("rate times %g", ratio);
    dem_free(straight.sim);
    dem_free(again.sim);
    remove_file("8");
}

typedef void spoil(box *b);
static void other_law(box *b)
{
    b->param.law = DEM_HERTZ;
}
static void other_rolling(box *b)
{
    b->param.rolling = DEM_ROLLING_EPSD;
}
static void other_sides(box *b)
{
    b->param.periodic[0] = 1;
}
static void other_grains(box *b)
{
    strcpy(b->material[0].name, "sand");
}
static void smaller_domain(box *b)
{
    b->param.hi[0] = .01;
}

static void test_must_agree(void **state)
{
    (void)state;
    static const struct {
        spoil *spoil;
        const char *says;
    } bad[] = {{other_law, "its contact law is linear, that of this simulation hertz"},
               {other_rolling, "its rolling resistance is none, that of this simulation epsd"},
               {other_sides, "direction x is not periodic there, here it is"},
               {other_grains, "material grain"},
               {smaller_domain, "has left the domain"}};
    char path[512];
    box b, other;
    box_new(&b, &VARIANT[0], NULL);
    box_advance(&b, &VARIANT[0], 0, 4);
    write_restart(&b, "4");
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        box_init(&other, &VARIANT[0]);
        other.param.restart = path_of("4", path);
        bad[k].spoil(&other);
        assert_true(dem_new(MPI_COMM_SELF, &other.param, &other.sim) != DEM_OK);
        if (!strstr(dem_message(other.sim), bad[k].says))
            fail_msg("'%s' expected in '%s'", bad[k].says, dem_message(other.sim));
        dem_free(other.sim);
        dem_sdf_free(other.wall[0].shape);
        dem_sdf_free(other.wall[1].shape);
        dem_sdf_free(other.insertion.region);
    }
    dem_free(b.sim);
    remove_file("4");
}

/* Columns nobody asks for stay with the particles; numbers of the caller come back. */
static void test_columns_and_numbers(void **state)
{
    (void)state;
    char path[512];
    const double pi[3] = {3, .14, .0015926};
    double back[3] = {0};
    box b;
    box_new(&b, &VARIANT[0], NULL);
    box_advance(&b, &VARIANT[0], 0, 2);
    assert_int_equal(dem_keep(b.sim, "origin", 3, back), DEM_OK);
    assert_int_equal(dem_keep(b.sim, "origin", 3, pi), DEM_OK);
    assert_int_equal(dem_keep(b.sim, "a/b", 3, pi), DEM_BAD_ARGUMENT);
    const dem_view view = dem_particles(b.sim);
    for (size_t i = 0; i < 3 * view.n; i++)
        dem_column(b.sim, b.column)[i] = sin(.7 * (double)(3 * view.id[i / 3]) + (double)(i % 3));
    write_restart(&b, "2");
    dem_free(b.sim);
    box_init(&b, &VARIANT[0]);
    b.param.restart = path_of("2", path);
    assert_int_equal(dem_new(MPI_COMM_SELF, &b.param, &b.sim), DEM_OK);
    box_advance(&b, &VARIANT[0], 2, 4);
    assert_int_equal(dem_attach(b.sim, "carried", 2), -1); /* it is three wide */
    const int handle = dem_attach(b.sim, "carried", 3), other = dem_attach(b.sim, "new", 3);
    assert_int_equal(dem_column_restored(b.sim, handle), 1);
    assert_int_equal(dem_column_restored(b.sim, other), 0);
    const dem_view now = dem_particles(b.sim);
    for (size_t i = 0; i < 3 * now.n; i++) {
        assert_true(dem_column(b.sim, handle)[i] ==
                    sin(.7 * (double)(3 * now.id[i / 3]) + (double)(i % 3)));
        assert_true(dem_column(b.sim, other)[i] == 0);
    }
    assert_int_equal(dem_kept(b.sim, "origin", 3, back), 3);
    assert_memory_equal(back, pi, sizeof pi);
    assert_int_equal(dem_kept(b.sim, "nothing", 3, back), 0);
    dem_free(b.sim);
    remove_file("2");
}

/* A simulation without particles, and one that was never advanced. */
static void test_empty(void **state)
{
    (void)state;
    char path[512];
    box b;
    box_init(&b, &VARIANT[0]);
    dem_sdf_free(b.insertion.region);
    b.param.n_insertion = 0;
    assert_int_equal(dem_new(MPI_COMM_SELF, &b.param, &b.sim), DEM_OK);
    dem_set_time(b.sim, 1.5);
    write_restart(&b, "empty");
    dem_free(b.sim);
    box_init(&b, &VARIANT[0]);
    b.param.restart = path_of("empty", path);
    if (dem_new(MPI_COMM_SELF, &b.param, &b.sim)) fail_msg("%s", dem_message(b.sim));
    assert_int_equal(dem_particles(b.sim).n, 0);
    assert_true(dem_time(b.sim) == 1.5);
    assert_int_equal(dem_advance(b.sim, .01, 0), DEM_OK);
    dem_free(b.sim);
    remove_file("empty");
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bit_for_bit),         cmocka_unit_test(test_history_matters),
        cmocka_unit_test(test_changed_case),        cmocka_unit_test(test_must_agree),
        cmocka_unit_test(test_columns_and_numbers), cmocka_unit_test(test_empty),
    };
    MPI_Init(&argc, &argv);
    const char *base = getenv("TMPDIR");
    snprintf(directory, sizeof directory, "%.200s/felmiRestart.XXXXXX", base ? base : "/tmp");
    if (mkdtemp(directory) == NULL) return 1;
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    rmdir(directory);
    MPI_Finalize();
    return failed;
}
