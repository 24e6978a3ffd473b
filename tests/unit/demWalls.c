/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demWalls.c - motions as functions of time, and the list of particles near moving walls.
 *
 * Places are compared with closed forms, velocities with differences of places: a motion that says
 * one thing and does another would let friction act against a surface that goes elsewhere.
 */
#include "demRig.h"
#include "motion.h"

static void place_of(const path *path, double t, const double b[3], double x[3])
{
    pose p = path_pose(path, t);
    pose_apply(&p, b, x);
}

static path path_of(size_t n, const dem_motion *m)
{
    path p;
    char why[256] = "";
    for (size_t k = 0; k < n; k++)
        if (motion_check(&m[k], why, sizeof why)) fail_msg("motion %zu: %s", k, why);
    assert_int_equal(path_init(&p, n, m), DEM_OK);
    return p;
}

/* One of each kind, oblique, with ugly numbers. */
static const double rows_t[] = {.31, .52, 1.27, 1.9, 3.3};
static const double rows_shift[][3] = {
    {.2, -.1, 0}, {.25, .3, -.4}, {.9, .35, -.1}, {-.2, .1, .35}, {.4, .4, .4}};
static const double rows_turn[][3] = {
    {.3, 0, -.2}, {.8, .5, .1}, {1.9, .7, -2.2}, {-.4, 1.1, .3}, {0, 0, 1e-4}};

static void make_all(dem_motion m[5])
{
    for (int k = 0; k < 5; k++) {
        m[k] = dem_motion_default();
        m[k].kind = (dem_motion_kind)k;
        m[k].begin = .13;
        m[k].end = 3.71;
        m[k].frequency = .83;
        m[k].phase = .37;
        m[k].rate = 2.385;
        m[k].amplitude = .71;
        m[k].ramp = k < 2 ? .61 : 0;
        for (int a = 0; a < 3; a++) {
            m[k].vector[a] = (double[]){.3, -1.1, .55}[a];
            m[k].origin[a] = (double[]){-.7, .2, 1.3}[a];
        }
    }
    m[4].n = 5;
    m[4].time = rows_t;
    m[4].shift = rows_shift;
    m[4].turn = rows_turn;
}

/* ---- velocity is the derivative of the place ------------------------------------------------- */

static double worst_difference(const path *path)
{
    const double b[][3] = {{0, 0, 0}, {1.3, -.4, .8}, {-.2, 2.1, -1.7}}, h = 1e-5;
    double worst = 0;
    for (int i = 0; i < 400; i++) {
        /* Differences across a kink of the velocity (begin, end, end of the ramp) would be off. */
        double t = .0137 + .0107 * i;
        pose now = path_pose(path, t);
        for (int k = 0; k < 3; k++) {
            double before[3], after[3], x[3], u[3];
            place_of(path, t - h, b[k], before);
            place_of(path, t + h, b[k], after);
            pose_apply(&now, b[k], x);
            pose_velocity(&now, x, u);
            for (int a = 0; a < 3; a++)
                worst = fmax(worst, fabs(u[a] - (after[a] - before[a]) / (2 * h)));
        }
    }
    return worst;
}

static void velocity_is_rate_of_place(void **state)
{
    (void)state;
    dem_motion m[5];
    make_all(m);
    for (size_t first = 0; first < 5; first++) {
        path alone = path_of(1, &m[first]);
        double worst = worst_difference(&alone);
        path_free(&alone);
        report("difference of velocity and rate of place, m/s", worst, 0);
        assert_within(worst, 0, 1e-7);
    }
    path all = path_of(5, m);
    double worst = worst_difference(&all);
    path_free(&all);
    report("likewise, the five one after the other", worst, 0);
    assert_within(worst, 0, 1e-7);
}

static void rotation_stays_one(void **state)
{
    (void)state;
    dem_motion m[5];
    make_all(m);
    path all = path_of(5, m);
    for (int i = 0; i < 100; i++) {
        pose p = path_pose(&all, .05 * i);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                double dot = 0;
                for (int c = 0; c < 3; c++) dot += p.rotation[3 * a + c] * p.rotation[3 * b + c];
                assert_within(dot, a == b, 1e-14);
            }
    }
    path_free(&all);
}

/* ---- closed forms ---------------------------------------------------------------------------- */

static void check_place(const path *path, double t, const double b[3], double x, double y, double z)
{
    double at[3];
    place_of(path, t, b, at);
    assert_within(at[0], x, 1e-13);
    assert_within(at[1], y, 1e-13);
    assert_within(at[2], z, 1e-13);
}

static void places_of_simple_motions(void **state)
{
    (void)state;
    const double b[3] = {1.4, .3, -.2};
    dem_motion m = dem_motion_default();
    m.vector[1] = 2.5;
    m.begin = 1;
    m.end = 4;
    m.ramp = .5;
    path p = path_of(1, &m);
    check_place(&p, .9, b, 1.4, .3, -.2);
    check_place(&p, 1.2, b, 1.4, .3 + 2.5 * .5 * .04 / .5, -.2);
    check_place(&p, 2.3, b, 1.4, .3 + 2.5 * (1.3 - .25), -.2);
    check_place(&p, 9, b, 1.4, .3 + 2.5 * (3 - .25), -.2);
    assert_within(path_pose(&p, 1.2).velocity[1], 2.5 * .4, 1e-14);
    assert_true(path_pose(&p, 4).velocity[1] == 0 && path_pose(&p, .99).velocity[1] == 0);
    path_free(&p);

    /* Three quarters of a turn about an axis parallel to z, its direction not of unit length. */
    m = dem_motion_default();
    m.kind = DEM_ROTATION;
    m.vector[2] = 3;
    m.origin[0] = .4;
    m.rate = .5 * M_PI;
    p = path_of(1, &m);
    check_place(&p, 3, b, .4 + .3, -1, -.2);
    pose now = path_pose(&p, 3);
    assert_within(now.spin[2], .5 * M_PI, 1e-14);
    path_free(&p);

    m = dem_motion_default();
    m.kind = DEM_OSCILLATION;
    m.vector[0] = .25;
    m.frequency = 2;
    m.phase = M_PI / 6;
    p = path_of(1, &m);
    check_place(&p, -1, b, 1.4 + .125, .3, -.2);
    check_place(&p, 1. / 12, b, 1.4 + .25, .3, -.2); /* sin(pi/3 + pi/6) = 1 */
    path_free(&p);
}

static void oscillation_peaks(void **state)
{
    (void)state;
    dem_motion m = dem_motion_default();
    m.kind = DEM_ROCKING;
    m.vector[0] = 1;
    m.frequency = .5;
    m.amplitude = M_PI / 2;
    path p = path_of(1, &m);
    const double b[3] = {.7, 1, 0};
    check_place(&p, .5, b, .7, 0, 1); /* a quarter of the period: turned by +90 degrees */
    check_place(&p, 1.5, b, .7, 0, -1);
    check_place(&p, 1, b, .7, 1, 0);
    assert_within(path_pose(&p, 1).spin[0], -M_PI * M_PI / 2, 1e-13);
    path_free(&p);
}

/* A sun gear and its planet: the axis of the first motion is carried along by the second. */
static void earlier_axis_is_carried(void **state)
{
    (void)state;
    dem_motion m[2] = {dem_motion_default(), dem_motion_default()};
    m[0].kind = m[1].kind = DEM_ROTATION;
    m[0].vector[2] = m[1].vector[2] = 1;
    m[0].origin[0] = 2; /* the planet's axis */
    m[0].rate = -3.1;
    m[1].rate = 1.7;
    path p = path_of(2, m);
    const double b[3] = {2.5, 0, 0};
    for (double t = 0; t < 3; t += .37)
        check_place(&p, t, b, 2 * cos(1.7 * t) + .5 * cos(-1.4 * t),
                    2 * sin(1.7 * t) + .5 * sin(-1.4 * t), 0);
    path_free(&p);
}

/* A clamped spline is the cubic itself where the cubic rests at both ends. */
static void tables_are_clamped_splines(void **state)
{
    (void)state;
    const double t[] = {0, .2, .5, .55, 1};
    double shift[5][3] = {{0}};
    for (int i = 0; i < 5; i++) shift[i][1] = .8 * t[i] * t[i] * (3 - 2 * t[i]);
    dem_motion m = dem_motion_default();
    m.kind = DEM_TABLE;
    m.begin = 2;
    m.n = 5;
    m.time = t;
    m.shift = (const double(*)[3])shift;
    path p = path_of(1, &m);
    const double b[3] = {0, 0, 0};
    for (double s = .03; s < 1; s += .0917) {
        check_place(&p, 2 + s, b, 0, .8 * s * s * (3 - 2 * s), 0);
        assert_within(path_pose(&p, 2 + s).velocity[1], 4.8 * s * (1 - s), 1e-13);
    }
    check_place(&p, 1, b, 0, 0, 0);
    check_place(&p, 5, b, 0, .8, 0);
    assert_true(path_pose(&p, 3).velocity[1] == 0 && path_pose(&p, 5).velocity[1] == 0);
    path_free(&p);
    /* Two rows: 3 u^2 - 2 u^3. */
    m.n = 2;
    m.time = (const double[]){0, 3};
    m.shift = (const double[][3]){{0, 0, 0}, {0, 0, 1.5}};
    p = path_of(1, &m);
    check_place(&p, 2 + .75, b, 0, 0, 1.5 * (3 * .0625 - 2 * .015625));
    path_free(&p);
}

/* ---- largest speed --------------------------------------------------------------------------- */

static void speed_is_a_bound(void **state)
{
    (void)state;
    dem_motion m[5];
    make_all(m);
    const double lo[3] = {-.4, .1, -1}, hi[3] = {1.2, .6, 1.9};
    for (size_t k = 0; k < 5; k++) {
        path p = path_of(1, &m[k]);
        double bound = path_speed(&p, 0, lo, hi), most = 0;
        for (double t = 0; t < 4; t += .003)
            for (int corner = 0; corner < 8; corner++) {
                double b[3], x[3], u[3];
                for (int a = 0; a < 3; a++) b[a] = corner >> a & 1 ? hi[a] : lo[a];
                pose now = path_pose(&p, t);
                pose_apply(&now, b, x);
                pose_velocity(&now, x, u);
                most = fmax(most, sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]));
            }
        report("largest speed and its bound, m/s", most, bound);
        assert_true(most <= bound * (1 + 1e-12));
        assert_true(most >= (k < 4 ? .999 : .4) * bound); /* nor is it lavish */
        assert_true(path_speed(&p, 3.71, lo, hi) == 0);
        path_free(&p);
    }
}

/* A tenth of the smallest radius; of a turning plane the domain's corner is the fastest. */
static void wall_limits_the_step(void **state)
{
    (void)state;
    const double R = 1.3e-3;
    for (int turns = 0; turns < 2; turns++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .2);
        rig_floor(&r);
        dem_motion m = dem_motion_default();
        m.kind = turns ? DEM_ROTATION : DEM_TRANSLATION;
        m.vector[2] = 40;
        m.rate = 130;
        m.begin = .7;
        m.end = .8;
        r.wall[0].n_motion = 1;
        r.wall[0].motion = &m;
        rig_start(&r);
        assert_true(dem_time_limits(r.sim).wall == INFINITY); /* nobody is there */
        rig_ball(&r, 2 * R, .05, 0, .1, 0, 0, 0);
        rig_ball(&r, R, 0, 0, .1, 0, 0, 0);
        double speed = turns ? 130 * sqrt(2) * .2 : 40;
        dem_limits l = dem_time_limits(r.sim);
        assert_close(l.wall, .1 * R / speed, 1e-12);
        assert_true(l.step <= l.wall && l.wall < l.contact);
        rig_advance(&r, 1e-4, 0);
        assert_true(dem_last_report(r.sim).step <= l.wall);
        dem_set_time(r.sim, .8);
        assert_true(dem_time_limits(r.sim).wall == INFINITY);
        dem_free(r.sim);
    }
}

/* ---- refusals -------------------------------------------------------------------------------- */

static void expect_refusal(dem_motion m, const char *words)
{
    rig r;
    rig_init(&r, DEM_LINEAR, 1);
    rig_floor(&r);
    r.wall[0].n_motion = 1;
    r.wall[0].motion = &m;
    r.param.n_material = 2;
    r.param.material = r.material;
    r.param.pair = r.pair;
    r.param.wall = r.wall;
    assert_int_equal(dem_new(MPI_COMM_SELF, &r.param, &r.sim), DEM_BAD_ARGUMENT);
    const char *message = dem_message(r.sim);
    if (!strstr(message, "wall floor, motion 1") || !strstr(message, words))
        fail_msg("no \"%s\" in: %s", words, message);
    dem_free(r.sim);
    dem_sdf_free(r.wall[0].shape);
}

static void bad_motions_are_named(void **state)
{
    (void)state;
    dem_motion m[5];
    make_all(m);
    dem_motion bad = m[1];
    memset(bad.vector, 0, sizeof bad.vector);
    expect_refusal(bad, "the axis (0 0 0) has no direction");
    bad = m[0];
    bad.end = bad.begin;
    expect_refusal(bad, "begin 0.13 s must be finite and before end 0.13 s");
    bad = m[0];
    bad.ramp = -1;
    expect_refusal(bad, "ramp -1 s");
    bad = m[2];
    bad.frequency = 0;
    expect_refusal(bad, "frequency 0 Hz must be > 0");
    bad = m[3];
    bad.amplitude = NAN;
    expect_refusal(bad, "amplitude nan rad");
    bad = m[4];
    bad.n = 1;
    expect_refusal(bad, "a table of 1 rows");
    bad = m[4];
    bad.time = (const double[]){0, 1, 2, 2, 3};
    expect_refusal(bad, "row 4: time 2 s must be finite and later than 2");
    bad = m[4];
    bad.shift = bad.turn = NULL;
    expect_refusal(bad, "without shift or turn");
    bad = m[0];
    bad.kind = (dem_motion_kind)9;
    expect_refusal(bad, "kind 9");
}

/* ---- the list -------------------------------------------------------------------------------- */

/* A paddle wheel runs through a cloud of particles at rest; where are they then? */
static void stir(double skin, double (*x)[3], double impulse[3])
{
    rig r;
    rig_init(&r, DEM_LINEAR, .2);
    rig_pairs(&r, .8, .4, 2000, .3);
    r.param.skin = skin;
    dem_motion spin[2] = {dem_motion_default(), dem_motion_default()};
    spin[0].kind = DEM_ROTATION;
    spin[0].vector[0] = .2;
    spin[0].vector[2] = 1;
    spin[0].rate = 31;
    spin[1].vector[2] = 1.3;
    for (int k = 0; k < 3; k++) {
        dem_wall *w = &r.wall[r.param.n_wall++];
        const double c = cos(2.1 * k), s = sin(2.1 * k);
        strcpy(w->name, "paddle");
        w->shape = dem_sdf_cylinder((const double[3]){.03 * c, .03 * s, -.01},
                                    (const double[3]){.1 * c, .1 * s, .02}, .009, 1, 0);
        w->material = 1;
        w->n_motion = 2;
        w->motion = spin;
    }
    rig_start(&r);
    double p[512][3], radius[512];
    int material[512];
    for (int i = 0; i < 512; i++) {
        const int c[3] = {i % 8, i / 8 % 8, i / 64};
        for (int a = 0; a < 3; a++) p[i][a] = .0123 * (c[a] - 3.5) + 1e-3 * sin(i + a);
        p[i][2] += .09; /* the wheel gets there by its second motion, while nobody moves */
        radius[i] = .004 + .001 * (i % 3);
        material[i] = 0;
    }
    assert_int_equal(dem_add(r.sim, 512, (const double(*)[3])p, NULL, NULL, radius, material, NULL),
                     DEM_OK);
    memset(impulse, 0, 3 * sizeof *impulse);
    for (int k = 0; k < 40; k++) {
        rig_advance(&r, 1e-3, 25);
        dem_report rep = dem_last_report(r.sim);
        for (int a = 0; a < 3; a++) impulse[a] += rep.wall_impulse[a];
    }
    dem_view v = dem_particles(r.sim);
    for (size_t i = 0; i < v.n; i++) memcpy(x[v.id[i]], v.x[i], sizeof *x);
    dem_free(r.sim);
}

static void list_of_moving_walls_is_never_short(void **state)
{
    (void)state;
    static double thin[512][3], usual[512][3], thick[512][3];
    double j[3][3];
    stir(.01, thin, j[0]);
    stir(.15, usual, j[1]);
    stir(20, thick, j[2]); /* everything is listed: the reference */
    double worst = 0;
    for (int i = 0; i < 512; i++)
        for (int a = 0; a < 3; a++)
            worst =
                fmax(worst, fmax(fabs(thin[i][a] - thick[i][a]), fabs(usual[i][a] - thick[i][a])));
    print_message("impulse of the paddles %g %g %g N s\n", j[2][0], j[2][1], j[2][2]);
    report("positions with thin, usual and endless skin, m", worst, 0);
    assert_true(fabs(j[2][2]) > 1e-4);
    assert_within(worst, 0, 1e-9);
}

static void place_is_told(void **state)
{
    (void)state;
    rig r;
    rig_init(&r, DEM_LINEAR, 1);
    rig_floor(&r);
    dem_motion m = dem_motion_default();
    m.kind = DEM_ROTATION;
    m.vector[0] = 1;
    m.origin[2] = .5;
    m.rate = .5 * M_PI;
    r.wall[0].n_motion = 1;
    r.wall[0].motion = &m;
    rig_start(&r);
    double place[3], R[9];
    rig_advance(&r, .25, 5); /* no particle is there */
    dem_set_time(r.sim, 1);
    dem_wall_place(r.sim, 0, place, R);
    const double expected[9] = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    for (int k = 0; k < 9; k++) assert_within(R[k], expected[k], 1e-15);
    assert_within(place[1], .5, 1e-15);
    assert_within(place[2], .5, 1e-15);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(velocity_is_rate_of_place),
        cmocka_unit_test(rotation_stays_one),
        cmocka_unit_test(places_of_simple_motions),
        cmocka_unit_test(oscillation_peaks),
        cmocka_unit_test(earlier_axis_is_carried),
        cmocka_unit_test(tables_are_clamped_splines),
        cmocka_unit_test(speed_is_a_bound),
        cmocka_unit_test(wall_limits_the_step),
        cmocka_unit_test(bad_motions_are_named),
        cmocka_unit_test(list_of_moving_walls_is_never_short),
        cmocka_unit_test(place_is_told),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
