/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demWallSurface.c - walls of triangles within the engine: when they are sampled, what is felt.
 */
#include "demRig.h"

#include "stlFixture.h"

#include <dirent.h>
#include <sys/stat.h>

typedef struct told {
    int calls;
    double last;
} told;

static void listen(void *context, const char *what, double done)
{
    told *t = context;
    assert_non_null(what);
    assert_true(done >= 0 && done <= 1);
    t->calls++;
    t->last = done;
}

/* A slab whose upper face is z = 0. */
static dem_sdf *slab(void)
{
    body b = box_body((const double[3]){-.025, -.02, -.01}, (const double[3]){.025, .02, 0}, 3);
    dem_sdf *s = stl_shape(&b, 0);
    body_free(&b);
    return s;
}

static dem_wall *stl_wall(rig *r, dem_sdf *shape)
{
    dem_wall *w = &r->wall[r->param.n_wall++];
    strcpy(w->name, "slab");
    w->shape = shape;
    w->material = 1;
    return w;
}

static size_t memory_with(rig *r, double radius, double x)
{
    rig_ball(r, radius, x, 0, 2 * radius, 0, 0, 0);
    return dem_sdf_memory(r->wall[0].shape);
}

static void sampled_for_those_who_come(void **state)
{
    (void)state;
    rig r;
    told t = {0, 0};
    rig_init(&r, DEM_LINEAR, .1);
    r.param.progress = listen;
    r.param.progress_context = &t;
    stl_wall(&r, slab());
    size_t bare = dem_sdf_memory(r.wall[0].shape);
    rig_start(&r);
    assert_true(dem_sdf_memory(r.wall[0].shape) == bare); /* nobody is there */
    size_t first = memory_with(&r, 2e-3, 0);
    assert_true(first > bare);
    assert_true(memory_with(&r, 1.1e-3, .01) == first); /* more than half as large */
    size_t fine = memory_with(&r, .9e-3, .02);
    print_message("bytes: exact %zu, sampled %zu, finer %zu\n", bare, first, fine);
    assert_true(fine > 1.5 * first); /* spacing less than half */
    size_t wide = memory_with(&r, 4e-3, .04);
    assert_true(wide > fine);
    assert_true(memory_with(&r, 3e-3, -.04) == wide);
    assert_int_equal(t.calls, 0); /* it was for dem_new only */
    dem_free(r.sim);
}

static int files_in(const char *directory)
{
    int n = 0;
    DIR *d = opendir(directory);
    for (struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) n += e->d_name[0] != '.';
    if (d) closedir(d);
    return n;
}

static void remove_all(const char *directory)
{
    DIR *d = opendir(directory);
    for (struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) {
        char path[700];
        if (!strcmp(e->d_name, ".") || !strcmp(e->d_name, "..")) continue;
        snprintf(path, sizeof path, "%s/%s", directory, e->d_name);
        remove(path);
    }
    if (d) closedir(d);
    remove(directory);
}

/* Announced sizes are sampled for in dem_new, with progress and cache. */
static void announced_sizes(void **state)
{
    (void)state;
    char cache[256];
    snprintf(cache, sizeof cache, "%s", scratch_path("cache"));
    remove_all(cache);
    size_t memory[2];
    for (int again = 0; again < 2; again++) {
        rig r;
        told t = {0, 0};
        const double x[1][3] = {{.01, 0, .01}};
        dem_species fine = {.share = 1, .size = {.kind = DEM_SIZE_UNIFORM, .lo = 1e-3, .hi = 4e-3}};
        dem_insertion one = {
            .name = "one", .kind = DEM_INSERT_LIST, .n = 1, .x = x, .diameter = 3e-3};
        dem_feeder feed = {.name = "feed",
                           .n_species = 1,
                           .species = &fine,
                           .number_rate = 1,
                           .begin = 1,
                           .end = 2,
                           .mass = INFINITY,
                           .number = -1,
                           .lo = {-.01, -.01, .02},
                           .hi = {.01, .01, .04}};
        feed.region = dem_sdf_box(feed.lo, feed.hi, 1);
        rig_init(&r, DEM_LINEAR, .1);
        r.param.progress = listen;
        r.param.progress_context = &t;
        r.param.sdf_cache = cache;
        r.param.n_insertion = r.param.n_feeder = 1;
        r.param.insertion = &one;
        r.param.feeder = &feed;
        stl_wall(&r, slab());
        rig_start(&r);
        if (!again) assert_true(t.calls > 0 && t.last == 1);
        memory[again] = dem_sdf_memory(r.wall[0].shape);
        rig_ball(&r, .5e-3, 0, .01, .01, 0, 0, 0); /* the smallest that was announced */
        rig_ball(&r, 2e-3, .02, .01, .01, 0, 0, 0);
        assert_true(dem_sdf_memory(r.wall[0].shape) == memory[again]);
        assert_int_equal(files_in(cache), 1);
        dem_free(r.sim);
    }
    assert_true(memory[0] == memory[1]);
    remove_all(cache);
}

static void weight_on_triangles(void **state)
{
    (void)state;
    rig r;
    const double R = 2e-3, g = 9.81;
    rig_init(&r, DEM_HERTZ, .1);
    rig_hertz(&r, 1e7, .3, 2500);
    rig_pairs(&r, .4, .5, 1, 1);
    r.param.gravity[2] = -g;
    dem_wall *w = stl_wall(&r, slab());
    w->centre[0] = .013;
    rig_start(&r);
    rig_ball(&r, R, .021, -.003, R, 0, 0, 0);
    rig_advance(&r, .5, 0);
    rig_advance(&r, .01, 0);
    double force[3], torque[3], weight = 4. / 3 * M_PI * R * R * R * 2500 * g;
    dem_wall_force(r.sim, 0, force);
    dem_wall_torque(r.sim, 0, torque);
    report("weight of a ball on triangles, N", -force[2], weight);
    report("its torque, N m", torque[1], weight * .008);
    assert_close(-force[2], weight, 1e-9);
    assert_close(torque[1], weight * .008, 1e-6);
    dem_free(r.sim);
}

/* A box of triangles, turned by an odd angle, tumbles with particles in it. */
static void tumble(double skin, double (*x)[3], double torque[3])
{
    enum { N = 125 };
    rig r;
    rig_init(&r, DEM_LINEAR, .1);
    rig_pairs(&r, .7, .4, 3000, .3);
    r.param.skin = skin;
    body b = box_body((const double[3]){-.02, -.02, -.02}, (const double[3]){.02, .02, .02}, 2);
    move_body(&b, .41, (const double[3]){.003, -.002, .001});
    dem_motion m[2] = {dem_motion_default(), dem_motion_default()};
    m[0].kind = DEM_ROTATION;
    m[0].vector[0] = 1;
    m[0].vector[1] = -.4;
    m[0].rate = 23;
    m[0].begin = .004; /* nobody moves before the walls come */
    m[1].vector[2] = .7;
    dem_wall *w = stl_wall(&r, stl_shape(&b, 1));
    body_free(&b);
    w->n_motion = 2;
    w->motion = m;
    rig_start(&r);
    double at[N][3], radius[N];
    int material[N];
    for (int i = 0; i < N; i++) {
        const int c[3] = {i % 5, i / 5 % 5, i / 25};
        for (int a = 0; a < 3; a++) at[i][a] = .0042 * (c[a] - 2) + 2e-4 * sin(3 * i + a);
        radius[i] = .0017 + .0001 * (i % 3);
        material[i] = 0;
    }
    assert_int_equal(dem_add(r.sim, N, (const double(*)[3])at, NULL, NULL, radius, material, NULL),
                     DEM_OK);
    memset(torque, 0, 3 * sizeof *torque);
    for (int k = 0; k < 30; k++) {
        double mean[3];
        rig_advance(&r, 1e-3, 40);
        dem_wall_torque(r.sim, 0, mean);
        for (int a = 0; a < 3; a++) torque[a] += mean[a] * 1e-3;
    }
    dem_view v = dem_particles(r.sim);
    for (size_t i = 0; i < v.n; i++) memcpy(x[v.id[i]], v.x[i], sizeof *x);
    dem_free(r.sim);
}

static void list_of_moving_triangles_is_never_short(void **state)
{
    (void)state;
    static double x[3][125][3];
    double torque[3][3], worst = 0;
    tumble(.02, x[0], torque[0]);
    tumble(.15, x[1], torque[1]);
    tumble(1.5, x[2], torque[2]);
    for (int i = 0; i < 125; i++)
        for (int a = 0; a < 3; a++)
            worst = fmax(worst, fmax(fabs(x[0][i][a] - x[2][i][a]), fabs(x[1][i][a] - x[2][i][a])));
    print_message("angular impulse on the box %g %g %g N m s\n", torque[2][0], torque[2][1],
                  torque[2][2]);
    report("positions with thin, usual and wide skin, m", worst, 0);
    assert_true(fabs(torque[2][0]) > 1e-7);
    assert_within(worst, 0, 1e-9);
}

/* In the middle of a sheet three samples thick the distance is the same all around: no direction to
 * push, hence no force. Powers of two, so that the gradient there is zero to the last digit. */
static void middle_of_a_sheet(void **state)
{
    (void)state;
    const double h = 1. / 1024, radius = 2 * h;
    body sheet = box_body((const double[3]){-32 * h, -32 * h, 0},
                          (const double[3]){32 * h, 32 * h, 3 * h}, 2);
    rig r;
    rig_init(&r, DEM_LINEAR, .1);
    rig_pairs(&r, .7, .4, 900, 1);
    memset(r.param.gravity, 0, sizeof r.param.gravity);
    dem_wall *w = stl_wall(&r, stl_shape(&sheet, 0));
    body_free(&sheet);
    rig_start(&r);
    rig_ball(&r, radius, 0, 0, 1.5 * h, .3, 0, .2);
    double gradient[3];
    const double phi = dem_sdf_eval(w->shape, 0, (const double[3]){0, 0, 1.5 * h}, gradient);
    assert_close(phi, -h, 1e-12);
    assert_true(gradient[0] == 0 && gradient[1] == 0 && gradient[2] == 0);
    assert_int_equal(dem_advance(r.sim, 1e-7, 1), DEM_OK);
    const dem_view p = dem_particles(r.sim);
    assert_true(p.v[0][0] == .3 && p.v[0][2] == .2);
    for (int a = 0; a < 3; a++) assert_true(p.force[0][a] == 0 && p.omega[0][a] == 0);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sampled_for_those_who_come),
        cmocka_unit_test(announced_sizes),
        cmocka_unit_test(weight_on_triangles),
        cmocka_unit_test(list_of_moving_triangles_is_never_short),
        cmocka_unit_test(middle_of_a_sheet),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
