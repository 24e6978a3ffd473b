/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demHeap.c - a heap stands by elastic-plastic rolling resistance and creeps by a constant torque.
 *
 * A column of spheres falls apart into a heap, in a slice that is periodic across. Everything is
 * the same but the model of rolling resistance. Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011)
 * 269, doi:10.1016/j.powtec.2010.09.030, find that a heap with the elastic-plastic model comes to
 * rest and keeps its height, while one with a torque against the relative spin (their model A) does
 * not hold its spheres. What is compared: the mean height of the spheres, and that of the summit,
 * the mean of the highest twentieth, when the fall is over and two seconds later. Every heap must
 * stand or sink; which model's is the higher one is asked of the mean over several columns, for a
 * fall goes another way with any other rounding.
 */
#include "demRig.h"

#include <stdlib.h>

enum { WIDE = 9, DEEP = 3, HIGH = 15, NUMBER = WIDE * DEEP * HIGH, COLUMNS = 4 };

static const double R = 2.5e-3, g = 9.81;

typedef struct heap {
    double mean, summit, kinetic; /* m, m, J/(m g R) */
} heap;

static int descending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

static heap look(const rig *r)
{
    dem_view p = dem_particles(r->sim);
    double z[NUMBER];
    heap h = {0};
    for (size_t i = 0; i < p.n; i++) {
        z[i] = p.x[i][2];
        h.mean += z[i] / NUMBER;
    }
    qsort(z, NUMBER, sizeof *z, descending);
    for (int i = 0; i < NUMBER / 20; i++) h.summit += z[i] / (NUMBER / 20);
    dem_report rep = dem_last_report(r->sim);
    h.kinetic = (rep.kinetic_energy + rep.rotational_energy) / (rep.mass * g * R);
    return h;
}

static void build(rig *r, dem_law law, dem_rolling rolling, int column)
{
    rig_init(r, law, 80 * R);
    r->param.lo[1] = 0;
    r->param.hi[1] = DEEP * 2.02 * R;
    r->param.periodic[1] = 1;
    rig_hertz(r, 4e6, .3, 2500);
    rig_pairs(r, .5, .6, 2e3, .8);
    for (int p = 0; p < 4; p++) {
        r->pair[p].rolling_friction = .25;
        r->pair[p].rolling_damping = .3;
    }
    r->param.rolling = rolling;
    r->param.gravity[2] = -g;
    rig_floor(r);
    rig_start(r);
    double x[NUMBER][3], radius[NUMBER];
    int material[NUMBER] = {0};
    uint64_t random = 2385 + (uint64_t)column;
    for (int i = 0; i < NUMBER; i++) {
        const int at[3] = {i % WIDE, i / WIDE % DEEP, i / WIDE / DEEP};
        for (int a = 0; a < 3; a++) {
            /* xorshift64 */
            random ^= random << 13, random ^= random >> 7, random ^= random << 17;
            double scatter = (double)(random >> 11) / 9007199254740992. - .5;
            x[i][a] = 2.02 * R * (at[a] + .5 - (a ? 0 : .5 * WIDE)) + .03 * R * scatter;
        }
        radius[i] = R * (.93 + .06 * (double)(random >> 40) / 16777216.);
    }
    if (dem_add(r->sim, NUMBER, (const double(*)[3])x, NULL, NULL, radius, material, NULL))
        fail_msg("%s", dem_message(r->sim));
}

/* A heap when the fall is over, and later. */
static void fall(dem_law law, int epsd, int column, heap *early, heap *late)
{
    rig r;
    build(&r, law, epsd ? DEM_ROLLING_EPSD : DEM_ROLLING_CONSTANT, column);
    rig_advance(&r, 1.5, 0);
    *early = look(&r);
    rig_advance(&r, 2, 0);
    *late = look(&r);
    print_message("%s, %s: mean height %.5f R, later %.5f R; summit %.4f R, later %.4f R; "
                  "moving %.1e, later %.1e m g R\n",
                  law ? "Hertz" : "linear", epsd ? "epsd" : "constant", early->mean / R,
                  late->mean / R, early->summit / R, late->summit / R, early->kinetic,
                  late->kinetic);
    dem_free(r.sim);
}

static void heaps(void **state)
{
    (void)state;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        double mean[2] = {0}, summit[2] = {0};
        for (int column = 0; column < COLUMNS; column++) {
            heap early[2], late[2];
            for (int epsd = 0; epsd < 2; epsd++) {
                fall((dem_law)law, epsd, column, &early[epsd], &late[epsd]);
                mean[epsd] += late[epsd].mean / COLUMNS;
                summit[epsd] += late[epsd].summit / COLUMNS;
            }
            /* the elastic-plastic heap keeps its height */
            assert_within(late[1].mean, early[1].mean, 1e-4 * R);
            assert_within(late[1].summit, early[1].summit, 1e-4 * R);
            /* the other sinks, */
            assert_true(early[0].mean - late[0].mean > 100 * fabs(early[1].mean - late[1].mean));
            assert_true(early[0].mean - late[0].mean > 1e-2 * R);
        }
        /* and is the lower one */
        print_message("%s: mean height %.3f R, epsd %.3f R; summit %.3f R, epsd %.3f R\n",
                      law ? "Hertz" : "linear", mean[0] / R, mean[1] / R, summit[0] / R,
                      summit[1] / R);
        assert_true(mean[1] > 1.03 * mean[0]);
        assert_true(summit[1] > summit[0] + .5 * R);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(heaps)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
