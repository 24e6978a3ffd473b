/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demScale.c - no length, time or mass is built in.
 *
 * The same spheres of many sizes, spinning and of two materials, fall into a box, collide, slide
 * and come to rest, in three worlds: powder of 8 um, grains of 2 mm on the moon, boulders of .5 m
 * on a heavier planet. With lengths in L, times in sqrt(L/g) and masses in rho L^3, where moduli
 * are in rho g L, springs in rho g L^2 and cohesion in rho g L, the equations are those of one
 * world (Buckingham's theorem), so that trajectories are the same.
 *
 * Each collision multiplies what rounding left of a difference, by about five. So the units are
 * powers of two, with g L a power of four: every product, quotient and square root of the contact
 * laws then has the same digits in all worlds, and trajectories of any length can be compared. The
 * engine's own limits of the time step have fractional powers and agree to rounding.
 */
#include "demRig.h"

enum { BALLS = 14, SAMPLES = 70, STEPS = 250 };

typedef struct world {
    double L, g, rho;
} world;

static const world worlds[] = {{1. / 131072, 8, 2048}, {1. / 512, 2, 4096}, {.5, 32, 1024}};

typedef struct model {
    dem_law law;
    dem_rolling rolling;
    dem_cohesion cohesion;
    const char *name;
} model;

typedef struct history {
    double x[SAMPLES][BALLS][3], w[SAMPLES][BALLS][3], force[SAMPLES][3], contact[SAMPLES];
    double overlap[SAMPLES], fastest;
    int contacts;
} history;

static void world_init(rig *r, const model *m, const world *o)
{
    const double weight = o->rho * o->g * o->L;
    rig_init(r, m->law, 40 * o->L);
    r->param.gravity[0] = .11 * o->g;
    r->param.gravity[2] = -o->g;
    r->param.rolling = m->rolling;
    r->param.cohesion = m->cohesion;
    rig_hertz(r, 2.7e5 * weight, .27, o->rho);
    r->material[1].youngs_modulus = 9.1e5 * weight;
    r->material[1].density = .43 * o->rho;
    for (int p = 0; p < 4; p++)
        r->pair[p] = (dem_pair){.restitution = .55 + .1 * (p / 2 + p % 2),
                                .friction = .37,
                                .stiffness = (7 + p / 2 + p % 2) * 1e4 * weight * o->L,
                                .stiffness_ratio = .8,
                                .rolling_friction = .13,
                                .rolling_damping = .3,
                                .cohesion = 60 * weight};
    const double lo[3] = {-2.6 * o->L, -2.3 * o->L, 0}, hi[3] = {2.6 * o->L, 2.3 * o->L, 30 * o->L};
    strcpy(r->wall[0].name, "box");
    r->wall[0].shape = dem_sdf_box(lo, hi, 1);
    r->wall[0].material = 1;
    r->param.n_wall = 1;
}

/* A loose column, two by two, shaken by sines that repeat nowhere. */
static void add_balls(rig *r, const world *o)
{
    const double speed = sqrt(o->g * o->L);
    double x[BALLS][3], v[BALLS][3], w[BALLS][3], radius[BALLS];
    int material[BALLS];
    for (int i = 0; i < BALLS; i++) {
        const double at[3] = {i % 2 ? 1.2 : -1.2, i / 2 % 2 ? 1.1 : -1.1, 1.3 + 2.1 * (i / 4)};
        radius[i] = o->L * (.8 + .17 * sin(2.7 * i));
        material[i] = i % 3 == 0;
        for (int a = 0; a < 3; a++) {
            x[i][a] = o->L * (at[a] + .05 * sin(1 + 5.3 * i + 2.1 * a));
            v[i][a] = speed * .6 * sin(2 + 3.1 * i + 1.9 * a);
            w[i][a] = speed / o->L * sin(3 + 1.3 * i + 2.9 * a);
        }
    }
    if (dem_add(r->sim, BALLS, (const double(*)[3])x, (const double(*)[3])v, (const double(*)[3])w,
                radius, material, NULL))
        fail_msg("dem_add: %s", dem_message(r->sim));
}

static history live(const model *m, const world *o)
{
    rig r;
    history h = {.fastest = 0};
    const double T = sqrt(o->L / o->g), weight = o->rho * o->g * pow(o->L, 3);
    world_init(&r, m, o);
    rig_start(&r);
    add_balls(&r, o);
    for (int k = 0; k < SAMPLES; k++) {
        h.contact[k] = dem_time_limits(r.sim).contact / T;
        assert_true(.15 / STEPS < h.contact[k]);
        rig_advance(&r, .15 * T, STEPS);
        dem_view p = dem_particles(r.sim);
        dem_report rep = dem_last_report(r.sim);
        for (size_t i = 0; i < p.n; i++)
            for (int a = 0; a < 3; a++) {
                h.x[k][p.id[i]][a] = p.x[i][a] / o->L;
                h.w[k][p.id[i]][a] = p.omega[i][a] * T;
            }
        dem_wall_force(r.sim, 0, h.force[k]);
        for (int a = 0; a < 3; a++) h.force[k][a] /= weight;
        h.overlap[k] = rep.overlap;
        h.contacts += (int)(rep.contacts + rep.wall_contacts);
        h.fastest = fmax(h.fastest, rep.speed * T / o->L);
    }
    dem_free(r.sim);
    return h;
}

static void same_in_all_worlds(void **state)
{
    (void)state;
    const model models[] = {
        {DEM_LINEAR, DEM_ROLLING_NONE, DEM_COHESION_NONE, "linear"},
        {DEM_HERTZ, DEM_ROLLING_NONE, DEM_COHESION_NONE, "Hertz"},
        {DEM_LINEAR, DEM_ROLLING_CONSTANT, DEM_COHESION_SJKR, "linear, constant, SJKR"},
        {DEM_HERTZ, DEM_ROLLING_EPSD, DEM_COHESION_SJKR, "Hertz, EPSD, SJKR"}};
    for (int m = 0; m < 4; m++) {
        static history h[3];
        double way = 0, spin = 0, force = 0, limit = 0, overlap = 0;
        for (int o = 0; o < 3; o++) h[o] = live(&models[m], &worlds[o]);
        for (int o = 1; o < 3; o++)
            for (int k = 0; k < SAMPLES; k++) {
                for (int i = 0; i < BALLS; i++)
                    for (int a = 0; a < 3; a++) {
                        way = fmax(way, fabs(h[o].x[k][i][a] - h[0].x[k][i][a]));
                        spin = fmax(spin, fabs(h[o].w[k][i][a] - h[0].w[k][i][a]));
                        force = fmax(force, fabs(h[o].force[k][a] - h[0].force[k][a]));
                    }
                limit = fmax(limit, fabs(h[o].contact[k] / h[0].contact[k] - 1));
                overlap = fmax(overlap, fabs(h[o].overlap[k] - h[0].overlap[k]));
            }
        print_message("8 um, 2 mm, .5 m, %s: %d contacts at %d moments, fastest %.3g\n",
                      models[m].name, h[0].contacts, SAMPLES, h[0].fastest);
        report("    places, of L", way, 0);
        report("    spins, of sqrt(g/L)", spin, 0);
        report("    force on the wall, of rho g L^3", force, 0);
        report("    limit of the time step, of itself", limit, 0);
        report("    overlap, of the radius", overlap, 0);
        assert_true(h[0].contacts > 6 * SAMPLES);
        assert_true(way < 1e-9 && spin < 1e-9 && force < 1e-9 && overlap < 1e-9);
        assert_true(limit < 1e-9);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(same_in_all_worlds)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
