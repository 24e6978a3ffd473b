/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Creation, feeders, outlets and balances on several ranks: the same particles as on one rank, to
 * the last bit, and the same books on all ranks. Run alone it compares one rank with itself;
 * demRanks.sh runs it on more.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <math.h>

#include "near.h"
#include "ranks.h"

static const dem_material MATERIAL[2] = {{"glass", 2470, 5e7, .23}, {"steel", 7830, 5e7, .29}};
static const dem_pair PAIR = {.restitution = .83,
                              .friction = .31,
                              .stiffness = 900,
                              .stiffness_ratio = .7,
                              .rolling_friction = .05,
                              .rolling_damping = .3};
static const double LO[3] = {-.06, -.04, -.02}, HI[3] = {.07, .05, .17};

/* All that a chute consists of: a slope on which what is there from the start and what two feeders
 * bring slides to an outlet; it goes on through its sides along y. One feeder reaches beyond them.
 */
typedef struct chute {
    dem_pair pair[4];
    dem_species species[2];
    dem_wall wall[2];
    dem_insertion insertion[3];
    dem_feeder feeder[2];
    dem_outlet outlet[2];
    dem_param param;
} chute;

static void set_box(dem_sdf **region, double lo[3], double hi[3], const double a[3],
                    const double b[3])
{
    *region = dem_sdf_box(a, b, 1);
    memcpy(lo, a, 3 * sizeof *lo);
    memcpy(hi, b, 3 * sizeof *hi);
}

static void add_insertions(chute *c)
{
    static const double list[][3] = {{.0613, .0171, .161},
                                     {-.0313, -.0371, .141},
                                     {.0113, .0471, .157},
                                     {-.0253, .0071, .163},
                                     {.0413, -.0171, .1591}};
    dem_insertion *i = c->insertion;
    i[0] = (dem_insertion){.name = "rows",
                           .kind = DEM_INSERT_LATTICE,
                           .spacing = {.0071, .009, .0067},
                           .diameter = .0053,
                           .material = 1,
                           .velocity = {-.1, .02, 0},
                           .velocity_spread = .05,
                           .seed = 71};
    set_box(&i[0].region, i[0].lo, i[0].hi, (double[3]){-.01, -.04, .05},
            (double[3]){.06, .05, .075});
    i[1] = (dem_insertion){.name = "heap",
                           .kind = DEM_INSERT_RANDOM,
                           .number = 61,
                           .n_species = 2,
                           .species = c->species,
                           .velocity_spread = .03,
                           .seed = 9913};
    /* It reaches down among the rows. */
    set_box(&i[1].region, i[1].lo, i[1].hi, (double[3]){.01, -.04, .06},
            (double[3]){.06, .05, .095});
    i[2] = (dem_insertion){.name = "list",
                           .kind = DEM_INSERT_LIST,
                           .n = sizeof list / sizeof *list,
                           .x = list,
                           .diameter = .0061,
                           .velocity_spread = .02,
                           .seed = 3};
    c->param.n_insertion = 3;
    c->param.insertion = i;
}

static void add_flow(chute *c)
{
    dem_feeder *f = c->feeder;
    for (int k = 0; k < 2; k++)
        f[k] = (dem_feeder){.name = "inlet",
                            .n_species = 2,
                            .species = c->species,
                            .mass = INFINITY,
                            .number = -1,
                            .end = INFINITY,
                            .velocity = {-.05, .03, -.4},
                            .velocity_spread = .02,
                            .seed = 8712 + (uint64_t)k};
    f[0].mass_rate = .093;
    set_box(&f[0].region, f[0].lo, f[0].hi, (double[3]){.01, -.02, .12},
            (double[3]){.06, .02, .15});
    f[1].number_rate = 173;
    f[1].begin = .0413;
    f[1].number = 47;
    set_box(&f[1].region, f[1].lo, f[1].hi, (double[3]){-.02, .03, .12},
            (double[3]){.005, .07, .15});
    dem_outlet *o = c->outlet;
    o[0] = (dem_outlet){"exit", dem_sdf_box((double[3]){-1, -1, -1}, (double[3]){-.047, 1, 1}, 1),
                        0, INFINITY};
    /* and one for a while in the midst of them */
    o[1] = (dem_outlet){
        "hole", dem_sdf_box((double[3]){.02, .01, .01}, (double[3]){.045, .03, .06}, 1), .11, .16};
    c->param.n_feeder = c->param.n_outlet = 2;
    c->param.feeder = f;
    c->param.outlet = o;
}

static void make_chute(chute *c, int insertions, int flow)
{
    memset(c, 0, sizeof *c);
    dem_param *p = &c->param;
    *p = dem_param_default();
    memcpy(p->lo, LO, sizeof p->lo);
    memcpy(p->hi, HI, sizeof p->hi);
    p->periodic[1] = 1;
    p->gravity[2] = -9.81;
    p->n_material = 2;
    p->material = MATERIAL;
    for (int k = 0; k < 4; k++) c->pair[k] = PAIR;
    p->pair = c->pair;
    p->rolling = DEM_ROLLING_EPSD;
    p->balance = 1;
    c->species[0] = (dem_species){0, {.kind = DEM_SIZE_UNIFORM, .lo = .0041, .hi = .0073}, .7};
    c->species[1] = (dem_species){1, {.kind = DEM_SIZE_EQUAL, .mean = .0047}, .3};
    c->wall[0] = (dem_wall){.name = "slope", .material = 1};
    c->wall[0].shape = dem_sdf_plane((const double[3]){0, 0, .02}, (const double[3]){-.55, 0, 1});
    c->wall[1] = (dem_wall){.name = "back", .material = 1};
    c->wall[1].shape = dem_sdf_plane((const double[3]){.066, 0, 0}, (const double[3]){-1, 0, 0});
    p->wall = c->wall;
    p->n_wall = 2;
    if (insertions) add_insertions(c);
    if (flow) add_flow(c);
}

static dem_sim *start(MPI_Comm comm, int insertions, int flow)
{
    chute c;
    dem_sim *sim;
    make_chute(&c, insertions, flow);
    if (dem_new(comm, &c.param, &sim)) fail_msg("%s", dem_message(sim));
    return sim;
}

/* A sum over ranks differs from that of one by roundings of what it is made of. */
static void assert_alike(const double *a, const double *b, size_t n, double size)
{
    for (size_t k = 0; k < n; k++) assert_near(a[k], b[k], 1e-12 * size);
}

static void compare_books(const dem_sim *a, const dem_sim *b)
{
    int64_t n, m;
    double mass[2], waiting[2];
    assert_int_equal(dem_feeders(a), dem_feeders(b));
    for (size_t k = 0; k < dem_feeders(a); k++) {
        dem_fed(a, k, &n, &mass[0], &waiting[0]);
        dem_fed(b, k, &m, &mass[1], &waiting[1]);
        assert_int_equal(n, m);
        assert_near(mass[0], mass[1], 0);
        assert_near(waiting[0], waiting[1], 0);
    }
    for (size_t k = 0; k < dem_outlets(a); k++) {
        dem_removed(a, k, &n, &mass[0]);
        dem_removed(b, k, &m, &mass[1]);
        assert_int_equal(n, m);
        assert_near(mass[0], mass[1], 1e-15 * mass[1]);
    }
}

static void compare_reports(const dem_sim *a, const dem_sim *b)
{
    const dem_report r = dem_last_report(a), s = dem_last_report(b);
    assert_int_equal(r.particles, s.particles);
    assert_int_equal(r.fed, s.fed);
    assert_int_equal(r.removed, s.removed);
    assert_int_equal(r.contacts, s.contacts);
    assert_int_equal(r.wall_contacts, s.wall_contacts);
    assert_near(r.speed, s.speed, 0);
    assert_near(r.overlap, s.overlap, 0);
    const double mass = s.mass + s.removed_mass, momentum = mass * s.speed;
    assert_near(r.mass, s.mass, 1e-12 * mass);
    assert_near(r.fed_mass, s.fed_mass, 0);
    assert_near(r.removed_mass, s.removed_mass, 1e-12 * mass);
    assert_alike(r.fed_momentum, s.fed_momentum, 3, momentum);
    assert_alike(r.removed_momentum, s.removed_momentum, 3, momentum);
    assert_alike(r.momentum, s.momentum, 3, momentum);
    assert_alike(r.wall_impulse, s.wall_impulse, 3, momentum);
    assert_alike(r.gravity_impulse, s.gravity_impulse, 3, momentum);
    /* of energies the largest is what went into the sums */
    const dem_energy *e = &s.energy;
    const double energy = e->kinetic + fabs(e->gravity) + fabs(e->supply) + e->damping;
    assert_alike((const double *)&r.energy, (const double *)e, sizeof *e / sizeof(double), energy);
    assert_alike(r.angular_momentum, s.angular_momentum, 3, momentum);
    assert_alike(r.wall_angular, s.wall_angular, 3, momentum);
    assert_alike(r.gravity_angular, s.gravity_angular, 3, momentum);
}

/* The clock's error piles up in the sums; what the balance is off by stays small. */
static void run(int insertions, int flow, int advances)
{
    int ranks, rank;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    dem_sim *divided = start(MPI_COMM_WORLD, insertions, flow);
    dem_sim *alone = start(MPI_COMM_SELF, insertions, flow);
    size_t n = assert_same_particles(divided, MPI_COMM_WORLD, alone), most = n;
    int64_t fed = 0, removed = 0;
    for (int k = 0; k < advances; k++) {
        if (dem_advance(divided, .0103, 0)) fail_msg("%s", dem_message(divided));
        if (dem_advance(alone, .0103, 0)) fail_msg("%s", dem_message(alone));
        n = assert_same_particles(divided, MPI_COMM_WORLD, alone);
        if (n > most) most = n;
        compare_books(divided, alone);
        compare_reports(divided, alone);
        fed += dem_last_report(alone).fed;
        removed += dem_last_report(alone).removed;
    }
    const dem_report r = dem_last_report(divided);
    if (rank == 0)
        print_message("%d ranks: up to %zu particles, fed %lld, taken %lld, %lld rebuilds, energy "
                      "off by %.1e J of %.1e\n",
                      ranks, most, (long long)fed, (long long)removed, (long long)r.rebuilds,
                      r.energy.residual, r.energy.damping + r.energy.sliding);
    assert_true(removed > 30 && (!flow || fed > 60));
    dem_free(divided);
    dem_free(alone);
}

static void all_together(void **unused)
{
    (void)unused;
    run(1, 1, 30);
}

/* Space is divided by the first that a feeder brings. */
static void from_nothing(void **unused)
{
    (void)unused;
    run(0, 1, 30);
}

/* Dense packings, pushed apart in blocks that ranks share: of one size round a periodic box, and in
 * a smaller one of two kinds that keep clear of what is there already. */
static void packed(void **unused)
{
    (void)unused;
    for (int two = 0; two < 2; two++) {
        dem_sim *sim[2];
        for (int k = 0; k < 2; k++) {
            chute c;
            make_chute(&c, 0, 0);
            for (int a = 0; a < 3; a++) c.param.periodic[a] = !two;
            c.param.n_wall = 0;
            dem_insertion ins[2] = {{.name = "block", .diameter = .0063, .solid_fraction = .43},
                                    {.name = "upon", .n_species = 2, .solid_fraction = .37}};
            ins[0].kind = ins[1].kind = DEM_INSERT_RANDOM;
            ins[0].number = ins[1].number = -1;
            ins[0].species = ins[1].species = c.species;
            set_box(&ins[0].region, ins[0].lo, ins[0].hi, LO,
                    two ? (const double[3]){HI[0], HI[1], .04} : HI);
            set_box(&ins[1].region, ins[1].lo, ins[1].hi, (const double[3]){-.04, -.04, .035},
                    (const double[3]){.05, .05, .16});
            c.param.n_insertion = two ? 2 : 1;
            c.param.insertion = ins;
            if (!two) dem_sdf_free(ins[1].region);
            for (int w = 0; w < 2; w++) dem_sdf_free(c.wall[w].shape);
            if (dem_new(k ? MPI_COMM_SELF : MPI_COMM_WORLD, &c.param, &sim[k]))
                fail_msg("%s", dem_message(sim[k]));
        }
        assert_true(assert_same_particles(sim[0], MPI_COMM_WORLD, sim[1]) > 4000);
        dem_free(sim[0]);
        dem_free(sim[1]);
    }
}

/* A lattice that is too narrow, by a point whose neighbour another rank has, is refused by all. */
static void refused(void **unused)
{
    (void)unused;
    chute c;
    dem_sim *sim;
    make_chute(&c, 1, 0);
    c.insertion[0].diameter = .0069; /* above the spacing along z */
    assert_int_equal(dem_new(MPI_COMM_WORLD, &c.param, &sim), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(sim), "insertion rows"));
    assert_non_null(strstr(dem_message(sim), "spacing is too small"));
    dem_free(sim);
    for (int k = 0; k < 2; k++) dem_sdf_free(c.wall[k].shape);
    for (int k = 0; k < 2; k++) dem_sdf_free(c.insertion[k].region);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(refused),
        cmocka_unit_test(packed),
        cmocka_unit_test(all_together),
        cmocka_unit_test(from_nothing),
    };
    const int failures = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failures;
}
