/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Any number of ranks moves the particles alike, to the last bit.
 *
 * The same run on one rank and on two, three, four; positions, velocities and spins are compared at
 * several moments. Each run says that what could make a difference has happened: particles that
 * touch across borders, that change ranks with their histories, new divisions of the domain. When
 * these happen depends on the time that ranks took, and may not matter.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "ranksFixture.h"

enum { MOMENTS = 4 };

/* ---- a case and what it owns ----------------------------------------------------------------- */

typedef struct bed {
    dem_param param;
    dem_material material[2];
    dem_pair pair[4];
    dem_wall wall[8];
    dem_motion motion[2];
    dem_insertion insertion;
    dem_species species[2], fed[1];
    dem_feeder feeder;
    dem_outlet outlet;
    MPI_Comm comm;
    dem_sim *sim;
    int column; /* that holds id and what was added to it */
    int turn;   /* advances so far */
} bed;

typedef struct scene {
    const char *name;
    void (*prepare)(bed *b);
    void (*before_advance)(bed *b); /* or NULL */
    int advances, substeps;         /* of an advance; 0: the engine's choice for `dt` */
    double dt;                      /* s, of an advance */
    size_t moved, across, least;    /* at least so many: particles that moved house, pairs across
                                       borders at the moments, on all numbers of ranks together;
                                       particles at the end */
} scene;

static void box(bed *b, double x, double y, double z)
{
    memset(b, 0, sizeof *b);
    b->column = -1;
    b->param = dem_param_default();
    b->param.hi[0] = x;
    b->param.hi[1] = y;
    b->param.hi[2] = z;
    b->param.gravity[2] = -9.81;
    b->param.imbalance = 1.0001;
    strcpy(b->material[0].name, "glass");
    strcpy(b->material[1].name, "steel");
    b->material[0].density = 2500;
    b->material[1].density = 7800;
    for (int k = 0; k < 2; k++) {
        b->material[k].youngs_modulus = 5e6 * (1 + 3 * k);
        b->material[k].poisson_ratio = .25;
    }
    for (int k = 0; k < 4; k++)
        b->pair[k] = (dem_pair){.restitution = .8 - .1 * k,
                                .friction = .3 + .05 * (k / 2 + k % 2),
                                .stiffness = 200,
                                .stiffness_ratio = .8,
                                .rolling_friction = .05,
                                .rolling_damping = .3,
                                .cohesion = 2000};
    b->pair[2] = b->pair[1];
    b->param.n_material = 2;
    b->param.material = b->material;
    b->param.pair = b->pair;
    b->param.wall = b->wall;
}

static void add_wall(bed *b, const char *name, dem_sdf *shape, const dem_motion *motion)
{
    dem_wall *w = &b->wall[b->param.n_wall++];
    snprintf(w->name, sizeof w->name, "%s", name);
    assert_non_null(shape);
    w->shape = shape;
    w->material = 1;
    w->n_motion = motion != NULL;
    w->motion = motion;
}

static void add_plane(bed *b, const char *name, double x, double y, double z, int axis, double n,
                      const dem_motion *motion)
{
    const double point[3] = {x, y, z};
    double normal[3] = {0, 0, 0};
    normal[axis] = n;
    add_wall(b, name, dem_sdf_plane(point, normal), motion);
}

static void fill(bed *b, int64_t number, const double lo[3], const double hi[3], double diameter)
{
    dem_insertion *in = &b->insertion;
    strcpy(in->name, "filling");
    in->kind = DEM_INSERT_RANDOM;
    in->region = dem_sdf_box(lo, hi, 1);
    memcpy(in->lo, lo, sizeof in->lo);
    memcpy(in->hi, hi, sizeof in->hi);
    in->number = number;
    in->diameter = diameter;
    in->velocity_spread = .1;
    in->seed = 20260404;
    b->param.n_insertion = 1;
    b->param.insertion = in;
}

/* ---- scenes ---------------------------------------------------------------------------------- */

/* Equal spheres fall into a tray, periodic in x, whose front wall shakes them; a ball lies in it.
 */
static void slosh(bed *b)
{
    box(b, .048, .030, .060);
    b->param.periodic[0] = 1;
    b->motion[0] = dem_motion_default();
    b->motion[0].kind = DEM_OSCILLATION;
    b->motion[0].vector[1] = .004;
    b->motion[0].frequency = 9;
    add_plane(b, "floor", 0, 0, .001, 2, 1, NULL);
    add_plane(b, "front", 0, .005, 0, 1, 1, &b->motion[0]);
    add_plane(b, "back", 0, .029, 0, 1, -1, NULL);
    add_wall(b, "ball", dem_sdf_sphere((const double[3]){.024, .018, .002}, .006, 0), NULL);
    fill(b, 2500, (const double[3]){0, .01, .012}, (const double[3]){.048, .029, .046}, .002);
    b->insertion.velocity[1] = -.2;
    b->insertion.velocity[2] = -.6;
}

static void slosh_hertz(bed *b)
{
    slosh(b);
    b->param.law = DEM_HERTZ;
    b->param.rolling = DEM_ROLLING_CONSTANT;
}

/* One to four in size, two materials, sticky, in a drum that turns: searched by levels. */
static void mixture(bed *b)
{
    static const double p0[3] = {.016, -.01, .016}, p1[3] = {.016, .06, .016};
    box(b, .032, .044, .032);
    b->param.law = DEM_HERTZ;
    b->param.rolling = DEM_ROLLING_EPSD;
    b->param.cohesion = DEM_COHESION_SJKR;
    b->motion[0] = dem_motion_default();
    b->motion[0].kind = DEM_ROTATION;
    b->motion[0].vector[1] = 1;
    memcpy(b->motion[0].origin, p0, sizeof p0);
    b->motion[0].rate = 12;
    add_wall(b, "drum", dem_sdf_cylinder(p0, p1, .0155, 0, 1), &b->motion[0]);
    add_plane(b, "front", 0, .001, 0, 1, 1, NULL);
    add_plane(b, "back", 0, .043, 0, 1, -1, NULL);
    fill(b, 1500, (const double[3]){.009, .001, .004}, (const double[3]){.023, .043, .022}, .001);
    for (int k = 0; k < 2; k++) {
        b->species[k].material = k;
        b->species[k].size = (dem_size){.kind = DEM_SIZE_EQUAL, .mean = k ? .001 : .004};
        b->species[k].share = k ? .97 : .03;
    }
    b->insertion.n_species = 2;
    b->insertion.species = b->species;
    b->insertion.velocity[2] = -.5;
}

/* What enters, what leaves, a fluid that pushes and carries, two sides that are periodic. */
static void stream(bed *b)
{
    static const double low[3] = {.001, .001, .030}, high[3] = {.025, .023, .038};
    box(b, .034, .024, .040);
    b->param.periodic[0] = b->param.periodic[1] = 1;
    b->param.rolling = DEM_ROLLING_EPSD;
    b->param.balance = 1;
    add_plane(b, "floor", 0, 0, .001, 2, 1, NULL);
    add_plane(b, "lid", 0, 0, .039, 2, -1, NULL);
    fill(b, 900, (const double[3]){0, 0, .001}, (const double[3]){.034, .024, .03}, .0016);
    b->fed[0] =
        (dem_species){.size = {.kind = DEM_SIZE_UNIFORM, .lo = .001, .hi = .002}, .share = 1};
    strcpy(b->feeder.name, "spout");
    b->feeder.region = dem_sdf_box(low, high, 1);
    memcpy(b->feeder.lo, low, sizeof low);
    memcpy(b->feeder.hi, high, sizeof high);
    b->feeder.n_species = 1;
    b->feeder.species = b->fed;
    b->feeder.number_rate = 3000;
    b->feeder.end = 10;
    b->feeder.mass = INFINITY;
    b->feeder.number = -1;
    b->feeder.velocity[2] = -.2;
    b->feeder.velocity_spread = .05;
    b->feeder.seed = 4;
    b->param.n_feeder = 1;
    b->param.feeder = &b->feeder;
    strcpy(b->outlet.name, "drain");
    b->outlet.region = dem_sdf_cylinder((const double[3]){.008, .012, -.01},
                                        (const double[3]){.008, .012, .004}, .004, 1, 1);
    b->outlet.end = 10;
    b->param.n_outlet = 1;
    b->param.outlet = &b->outlet;
}

/* A force that depends on the particle alone, and a column that counts with it. */
static void blow(bed *b)
{
    if (b->column < 0) b->column = dem_attach(b->sim, "follower", 2);
    const dem_view view = dem_particles(b->sim);
    double *column = dem_column(b->sim, b->column);
    double(*f)[3] = calloc(view.n + 1, sizeof *f), (*w)[3] = calloc(view.n + 1, sizeof *w);
    double *k = calloc(view.n + 1, sizeof *k), *M = calloc(view.n + 1, sizeof *M);
    for (size_t i = 0; i < view.n; i++) {
        const double *x = view.x[i], weight = 9.81 * view.mass[i];
        if (column[2 * i] == 0) column[2 * i] = (double)view.id[i] + 1; /* it came since */
        assert_true(column[2 * i] == (double)view.id[i] + 1);
        column[2 * i + 1] += 1e-3 * (double)view.id[i];
        f[i][0] = .2 * weight * sin(300 * x[1]);
        w[i][2] = .4 * sin(200 * x[0]);
        k[i] = weight * (.5 + x[2]);
        M[i] = .1 * view.mass[i] * (double)(view.id[i] % 3);
    }
    const dem_status status =
        dem_set_outside_force(b->sim, (const double(*)[3])f, k, (const double(*)[3])w, M);
    if (status) fail_msg("%s", dem_message(b->sim));
    free(f);
    free(w);
    free(k);
    free(M);
}

/* Hands over particles, every rank some, in no order, with ids and without. */
static void pour(bed *b)
{
    int rank, ranks;
    MPI_Comm_rank(b->comm, &rank);
    MPI_Comm_size(b->comm, &ranks);
    double x[20][3], v[20][3], radius[20];
    int material[20];
    int64_t id[20];
    size_t n = 0;
    for (int k = 0; k < 20; k++) {
        /* Which rank has which must not matter where ids are given; else they are numbered in the
         * order of the ranks. */
        if ((b->turn % 2 ? 7 * k % ranks : k * ranks / 20) != rank) continue;
        for (int a = 0; a < 2; a++) x[n][a] = .0025 + .0055 * (a ? k / 5 : k % 5);
        x[n][2] = .0375;
        v[n][0] = .1 * (k % 3 - 1);
        v[n][1] = 0;
        v[n][2] = -.4;
        radius[n] = .0006 + .00002 * k;
        material[n] = k % 2;
        id[n++] = 100000 * (b->turn + 1) + 17 * k % 20;
    }
    const dem_status status = dem_add(b->sim, n, (const double(*)[3])x, (const double(*)[3])v, NULL,
                                      radius, material, b->turn % 2 ? id : NULL);
    if (status) fail_msg("turn %d: %s", b->turn, dem_message(b->sim));
}

static void blow_and_pour(bed *b)
{
    if (b->turn % 7 == 3) pour(b);
    blow(b);
}

/* Three particles: with four ranks one has none, and all of them come together in a corner. */
static void three(bed *b)
{
    box(b, .02, .02, .02);
    add_wall(b, "tray", dem_sdf_box(b->param.lo, b->param.hi, 1), NULL);
    b->param.gravity[0] = b->param.gravity[1] = -9.81;
    for (int k = 0; k < 4; k++) b->pair[k].restitution = .2;
}

static void hand_over_three(bed *b)
{
    static const double x[3][3] = {{.002, .018, .005}, {.018, .002, .015}, {.01, .011, .018}};
    static const double radius[3] = {.001, .0012, .001};
    static const int material[3] = {0, 0, 1};
    int rank;
    MPI_Comm_rank(b->comm, &rank);
    if (b->turn > 0) return;
    const dem_status status =
        dem_add(b->sim, rank == 0 ? 3 : 0, x, NULL, NULL, radius, material, NULL);
    if (status) fail_msg("%s", dem_message(b->sim));
}

static void place_three(bed *b)
{
    if (b->turn == 0) hand_over_three(b);
}

/* All leave: the last steps are those of nobody. Then some come again. */
static void drain(bed *b)
{
    three(b);
    strcpy(b->outlet.name, "drain");
    b->outlet.region = dem_sdf_sphere((const double[3]){0, 0, 0}, .006, 1);
    b->outlet.end = 10;
    b->param.n_outlet = 1;
    b->param.outlet = &b->outlet;
}

static void place_again(bed *b)
{
    if (b->turn == 18) assert_int_equal(dem_last_report(b->sim).particles, 0);
    if (b->turn == 0 || b->turn == 20) hand_over_three(b);
}

static const scene SCENES[] = {
    {"tray, linear", slosh, NULL, 40, 50, 50 * 6e-5, 300, 30, 2500},
    {"tray, Hertz", slosh_hertz, NULL, 20, 0, .003, 100, 30, 2500},
    {"drum", mixture, NULL, 20, 0, .002, 20, 10, 1500},
    {"stream", stream, blow_and_pour, 40, 0, .003, 100, 5, 800},
    {"three", three, place_three, 20, 0, .008, 1, 0, 3},
    {"drain", drain, place_again, 24, 0, .008, 0, 0, 0},
};

/* ---- runs ------------------------------------------------------------------------------------ */

/* What a run leaves behind, on its first rank. */
typedef struct outcome {
    crowd moment[MOMENTS];
    size_t moved, across;
    dem_report last;
    double wall_force[8][3];
} outcome;

static void outcome_free(outcome *o)
{
    for (int k = 0; k < MOMENTS; k++) crowd_free(&o->moment[k]);
}

static void advance(bed *b, const scene *s)
{
    if (s->before_advance) s->before_advance(b);
    if (dem_advance(b->sim, s->dt, s->substeps))
        fail_msg("%s, advance %d: %s", s->name, b->turn, dem_message(b->sim));
    b->turn++;
}

static outcome run(const scene *s, MPI_Comm comm)
{
    bed b;
    outcome o;
    memset(&o, 0, sizeof o);
    s->prepare(&b);
    b.comm = comm;
    if (dem_new(comm, &b.param, &b.sim)) fail_msg("%s: %s", s->name, dem_message(b.sim));
    crowd before = gather(comm, b.sim);
    for (int k = 0; k < s->advances; k++) {
        advance(&b, s);
        crowd now = gather(comm, b.sim);
        o.moved += moved_house(&before, &now);
        crowd_free(&before);
        before = now;
        if ((k + 1) % (s->advances / MOMENTS) != 0) continue;
        o.moment[(k + 1) / (s->advances / MOMENTS) - 1] = gather(comm, b.sim);
        o.across += pairs_across(&now);
    }
    crowd_free(&before);
    o.last = dem_last_report(b.sim);
    for (size_t w = 0; w < b.param.n_wall; w++) dem_wall_force(b.sim, w, o.wall_force[w]);
    dem_free(b.sim);
    return o;
}

/* What reports sum over ranks, to rounding; counts exactly. */
static void compare_reports(const scene *s, const outcome *one, const outcome *many)
{
    const dem_report *a = &one->last, *b = &many->last;
    assert_int_equal(a->particles, b->particles);
    assert_int_equal(a->substeps, b->substeps);
    assert_int_equal(a->contacts, b->contacts);
    assert_int_equal(a->wall_contacts, b->wall_contacts);
    assert_int_equal(a->rebuilds, b->rebuilds);
    assert_int_equal(a->fed, b->fed);
    assert_int_equal(a->removed, b->removed);
    assert_true(a->step == b->step && a->overlap == b->overlap && a->speed == b->speed);
    const double sums[][2] = {{a->kinetic_energy, b->kinetic_energy},
                              {a->rotational_energy, b->rotational_energy},
                              {a->mass, b->mass},
                              {a->energy.elastic, b->energy.elastic},
                              {a->energy.sliding, b->energy.sliding},
                              {a->energy.damping, b->energy.damping}};
    for (size_t k = 0; k < sizeof sums / sizeof *sums; k++)
        if (fabs(sums[k][0] - sums[k][1]) > 1e-10 * fabs(sums[k][0]))
            fail_msg("%s: sum %zu is %.17g and %.17g", s->name, k, sums[k][0], sums[k][1]);
    for (int w = 0; w < 8; w++)
        for (int c = 0; c < 3; c++) {
            const double x = one->wall_force[w][c], y = many->wall_force[w][c];
            if (fabs(x - y) > 1e-10 * (fabs(x) + 1e-3))
                fail_msg("%s: wall %d: force %c %.17g and %.17g", s->name, w, "xyz"[c], x, y);
        }
}

static int64_t divisions, runs; /* on several ranks, of all scenes */

static void compare(const scene *s, int ranks, const outcome *one, const outcome *many)
{
    for (int k = 0; k < MOMENTS; k++) {
        double most;
        const size_t n = differences(&one->moment[k], &many->moment[k], &most);
        if (n > 0)
            fail_msg(
                "%s, %d ranks, moment %d of %d: %zu of %zu particles differ, by %.3g m at most",
                s->name, ranks, k + 1, MOMENTS, n, one->moment[k].n, most);
    }
    compare_reports(s, one, many);
    print_message("%s on %d ranks: the same; %zu particles, %d contacts, %d rebuilds, moved house "
                  "%zu times, %d divisions, %d ghosts, %zu pairs across borders\n",
                  s->name, ranks, many->moment[MOMENTS - 1].n, (int)many->last.contacts,
                  (int)many->last.rebuilds, many->moved, (int)many->last.divisions,
                  (int)many->last.ghosts, many->across);
    divisions += many->last.divisions;
    runs++;
}

static void play(const scene *s)
{
    outcome one, many;
    memset(&one, 0, sizeof one);
    if (world_rank() == 0) {
        one = run(s, MPI_COMM_SELF);
        assert_true(one.moment[MOMENTS - 1].n >= s->least && one.moved == 0 && one.across == 0);
    }
    rest_until_all();
    for (int ranks = 2; ranks <= world_size(); ranks++) {
        MPI_Comm comm = first_ranks(ranks);
        if (comm != MPI_COMM_NULL) {
            many = run(s, comm);
            if (world_rank() == 0) compare(s, ranks, &one, &many);
            one.moved += many.moved;
            one.across += many.across;
            outcome_free(&many);
            MPI_Comm_free(&comm);
        }
        rest_until_all();
    }
    if (world_rank() == 0 && (one.moved < s->moved || one.across < s->across))
        fail_msg("%s: %zu moved house, %zu pairs across borders", s->name, one.moved, one.across);
    outcome_free(&one);
}

static void test_scene(void **state)
{
    play(*state);
}

/* How often depends on the machine; each run has one at the start. */
static void test_divisions(void **state)
{
    (void)state;
    print_message("%d runs with %d divisions\n", (int)runs, (int)divisions);
    if (world_rank() == 0) assert_true(runs > 0 && divisions > runs + 2);
}

int main(int argc, char **argv)
{
    enum { N = sizeof SCENES / sizeof *SCENES };
    struct CMUnitTest tests[N + 1];
    MPI_Init(&argc, &argv);
    for (int k = 0; k < N; k++)
        tests[k] = (struct CMUnitTest){SCENES[k].name, test_scene, NULL, NULL, (void *)&SCENES[k]};
    tests[N] = (struct CMUnitTest)cmocka_unit_test(test_divisions);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
