/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demBounce.c - many elastic impacts, in advances of every length, keep the speed.
 *
 * A sphere without gravity goes to and fro between two plates, Hertz's law, restitution 1. Its
 * speed between impacts is what it was, but for the error of symplectic Euler with an even step,
 * which does not pile up. The caller asks for advances of a half to a thousand steps and lets the
 * engine choose the sub-steps, as a coupled solver does: an engine whose step follows the contact
 * in and out of the impact gains 8 % or loses 38 % of the speed here.
 */
#include "demRig.h"

static const double speed = 1;

static void plate(rig *r, double z, double normal)
{
    dem_wall *w = &r->wall[r->param.n_wall++];
    w->name[0] = normal > 0 ? 'f' : 'c';
    w->shape = dem_sdf_plane((const double[3]){0, 0, z}, (const double[3]){0, 0, normal});
    w->material = 1;
}

/* Largest deviation of the speed between `most` impacts; advances of `steps` limits. */
static double worst(double steps, int most)
{
    rig r;
    rig_init(&r, DEM_HERTZ, .1);
    rig_hertz(&r, 1e7, .3, 2500);
    rig_pairs(&r, 1, 0, 1000, 1);
    plate(&r, 0, 1);
    plate(&r, .012, -1);
    rig_start(&r);
    rig_ball(&r, .005, 0, 0, .006, 0, 0, speed);
    const double dt = steps * dem_time_limits(r.sim).step;
    double off = 0, before = speed;
    for (int impacts = 0, advances = 0; impacts < most; advances++) {
        assert_true(advances < 100000);
        rig_advance(&r, dt, 0);
        const double v = dem_particles(r.sim).v[0][2];
        if (v * before < 0) impacts++;
        before = v;
        if (!dem_last_report(r.sim).wall_contacts) off = fmax(off, fabs(fabs(v) / speed - 1));
    }
    dem_free(r.sim);
    return off;
}

static void even(void **state)
{
    (void)state;
    const double steps[] = {.5, 1, 1.5, 2.2, 3.3, 5.7, 10.3, 20.7, 50.5};
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        const double off = worst(steps[k], 100);
        print_message("advances of %g steps: speed off by at most %.2g\n", steps[k], off);
        assert_within(off, 0, .01);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(even)};
    MPI_Init(&argc, &argv);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
