/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demPeriodicWall.c - walls at periodic sides.
 *
 * A knob that stands on a periodic side is in the domain with one half only unless its shape is
 * given on both sides. A particle that comes through the side into the missing half must not be
 * shot off by it: the run stops. Given twice, it is one knob.
 */
#include "demRig.h"

static const double half = .1, knob = .02, radius = .005;

static void put_knob(rig *r, double x)
{
    dem_wall *w = &r->wall[r->param.n_wall++];
    strcpy(w->name, "knob");
    w->shape = dem_sdf_sphere((const double[3]){x, 0, 0}, knob, 0);
    w->material = 1;
}

/* A ball that comes from within along x to the side where no half of the knob is. */
static dem_status meet(rig *r, int twice)
{
    rig_init(r, DEM_LINEAR, half);
    r->param.periodic[0] = 1;
    put_knob(r, half);
    if (twice) put_knob(r, -half);
    rig_start(r);
    rig_ball(r, radius, -.06, 0, 0, -1, 0, 0);
    return dem_advance(r->sim, .1, 0);
}

static void half_a_knob_is_refused(void **state)
{
    (void)state;
    rig r;
    assert_int_equal(meet(&r, 0), DEM_BAD_ARGUMENT);
    assert_non_null(strstr(dem_message(r.sim), "wall knob does not go on beyond a periodic side"));
    assert_true(fabs(dem_particles(r.sim).v[0][0]) < 1.001);
    dem_free(r.sim);
}

static void a_whole_one_sends_it_back(void **state)
{
    (void)state;
    rig r;
    assert_int_equal(meet(&r, 1), DEM_OK);
    assert_close(dem_particles(r.sim).v[0][0], 1, 1e-3);
    dem_free(r.sim);
}

/* Planes along the side go on by themselves, also for those that roll on them. */
static void a_floor_goes_on(void **state)
{
    (void)state;
    rig r;
    rig_init(&r, DEM_LINEAR, half);
    r.param.periodic[0] = 1;
    r.param.gravity[2] = -9.81;
    rig_floor(&r);
    rig_start(&r);
    rig_ball(&r, radius, 0, 0, radius, 1, 0, 0);
    rig_advance(&r, 1, 0);
    assert_close(dem_particles(r.sim).v[0][0], 1, 1e-9);
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(half_a_knob_is_refused),
                                       cmocka_unit_test(a_whole_one_sends_it_back),
                                       cmocka_unit_test(a_floor_goes_on)};
    MPI_Init(&argc, &argv);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
