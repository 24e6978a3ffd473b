/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demStl.c - balls against walls of triangles, sampled as in any run.
 *
 * Elastic impacts in closed vessels keep the kinetic energy, since the force is the gradient of an
 * energy whatever the errors of the samples; on a flat face it is that of a plane, so that a ball
 * which slides over it in equilibrium feels neither edges of triangles nor how many there are.
 */
#include "demRig.h"
#include "stlFixture.h"

static const double RADIUS = 4.7e-3;

/* ---- energy ---------------------------------------------------------------------------------- */

static double kinetic(const rig *r)
{
    const dem_view p = dem_particles(r->sim);
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += .5 * p.mass[0] * p.v[0][k] * p.v[0][k];
    return sum;
}

/* Largest relative change of energy between impacts, over 20 and more of them. */
static double bounce(dem_law law, dem_sdf *shape, const double x[3], double steps, const char *what)
{
    enum { IMPACTS = 20, LONGEST = 4000000 };
    rig r;
    rig_init(&r, law, .2);
    rig_hertz(&r, 2.3e7, .31, 2437);
    rig_pairs(&r, 1, 0, 8300, .8);
    r.param.steps_per_period = steps;
    r.wall[r.param.n_wall++] = (dem_wall){.name = "vessel", .shape = shape, .material = 1};
    r.param.impact_speed = 2;
    rig_start(&r);
    rig_ball(&r, RADIUS, x[0], x[1], x[2], 1.21, -.83, 1.07);
    const double start = kinetic(&r), dt = dem_time_limits(r.sim).step;
    double worst = 0;
    int impacts = 0, touching = 0;
    for (int step = 0; step < LONGEST && impacts < IMPACTS; step++) {
        rig_advance(&r, dt, 1); /* one step throughout: symplectic Euler keeps energy then */
        const int now = dem_last_report(r.sim).wall_contacts > 0;
        impacts += touching && !now;
        touching = now;
        if (!now) worst = fmax(worst, fabs(kinetic(&r) / start - 1));
    }
    report(what, worst, 0);
    assert_int_equal(impacts, IMPACTS);
    dem_free(r.sim);
    return worst;
}

static dem_sdf *vessel(double angle, int n)
{
    const double lo[3] = {-.031, -.042, -.035}, hi[3] = {.047, .033, .038},
                 shift[3] = {.011, -.017, .023};
    body b = box_body(lo, hi, n);
    move_body(&b, angle, shift);
    dem_sdf *s = stl_shape(&b, 1);
    body_free(&b);
    return s;
}

static void energy_in_a_box(void **state)
{
    (void)state;
    const double x[3] = {.013, -.012, .02};
    for (int law = 0; law < 2; law++) {
        const char *name[2][3] = {{"20 impacts in an STL box, change of energy, linear",
                                   "turned by .83", "turned by -2.1, 32 triangles a face"},
                                  {"20 impacts in an STL box, change of energy, Hertz",
                                   "turned by .83", "turned by -2.1, 32 triangles a face"}};
        assert_true(bounce(law, vessel(0., 1), x, 60, name[law][0]) < 1e-3);
        assert_true(bounce(law, vessel(.83, 1), x, 60, name[law][1]) < 1e-3);
        assert_true(bounce(law, vessel(-2.1, 4), x, 60, name[law][2]) < 1e-3);
    }
}

static dem_sdf *pear(void)
{
    const double o[3] = {0, 0, 0};
    body b = ball_body(o, .041, 12, .05);
    dem_sdf *s = stl_shape(&b, 1);
    body_free(&b);
    return s;
}

static dem_sdf *torus(void)
{
    body b = torus_body(.06, .025, 60, 40);
    dem_sdf *s = stl_shape(&b, 1);
    body_free(&b);
    return s;
}

/* Curved walls, where samples have an error and forces a kink from cell to cell: what energy is
 * lost or won goes away with the time step, so it is not the wall's. */
static void energy_in_round_vessels(void **state)
{
    (void)state;
    const double o[3] = {0, 0, 0}, x[3] = {.06, 0, .004};
    const double coarse = bounce(DEM_LINEAR, pear(), o, 60, "20 impacts in a pear");
    const double fine = bounce(DEM_LINEAR, pear(), o, 1200, "with a twentieth of the step");
    const double coarse2 = bounce(DEM_HERTZ, torus(), x, 60, "20 impacts in a torus, Hertz");
    const double fine2 = bounce(DEM_HERTZ, torus(), x, 1200, "with a twentieth of the step");
    assert_true(coarse < 2e-2 && fine < 1e-3);
    assert_true(coarse2 < 2e-2 && fine2 < 1e-3);
}

/* ---- flat faces ------------------------------------------------------------------------------ */

enum { STEPS = 3000 };

/* A ball slides over the upper face of a box of triangles, pressed on by its weight along the
 * normal; F/(m g) - 1 at every step. */
static void slide(int n, double force[STEPS])
{
    rig r;
    rig_init(&r, DEM_LINEAR, 1);
    rig_pairs(&r, .8, 0, 8300, .8);
    const double zero[3] = {0, 0, 0}, lo[3] = {-.1, -.07, -.03}, hi[3] = {.1, .08, 0};
    /* the frame of the box: images of the unit vectors */
    body unit = {0, 0, NULL};
    add_triangle(&unit, (double[3]){1, 0, 0}, (double[3]){0, 1, 0}, (double[3]){0, 0, 1});
    move_body(&unit, .83, zero);
    double e[3][3];
    memcpy(e, unit.x[0], sizeof e);
    body_free(&unit);

    body b = box_body(lo, hi, n);
    move_body(&b, .83, zero);
    r.wall[r.param.n_wall++] = (dem_wall){.name = "face", .shape = stl_shape(&b, 0), .material = 1};
    body_free(&b);
    for (int k = 0; k < 3; k++) r.param.gravity[k] = -9.81 * e[2][k];
    rig_start(&r);
    const double weight = sphere_mass(RADIUS, 2500) * 9.81, height = RADIUS - weight / 8300;
    double x[3], v[3];
    for (int k = 0; k < 3; k++) { /* over the diagonal of the face, and off it */
        x[k] = -.05 * e[0][k] - .038 * e[1][k] + height * e[2][k];
        v[k] = .31 * e[0][k] + .27 * e[1][k];
    }
    rig_ball(&r, RADIUS, x[0], x[1], x[2], v[0], v[1], v[2]);
    for (int i = 0; i < STEPS; i++) {
        double f[3], along = 0;
        rig_advance(&r, 1e-4, 1);
        dem_wall_force(r.sim, 0, f);
        for (int k = 0; k < 3; k++) along -= f[k] * e[2][k];
        force[i] = along / weight - 1;
    }
    dem_free(r.sim);
}

static void edges_of_triangles(void **state)
{
    (void)state;
    static double force[3][STEPS];
    double off = 0, change = 0;
    for (int level = 0; level < 3; level++) {
        slide(2 << level, force[level]);
        for (int i = 0; i < STEPS; i++) {
            off = fmax(off, fabs(force[level][i]));
            change = fmax(change, fabs(force[level][i] - force[0][i]));
        }
    }
    report("force over edges of triangles / weight - 1", off, 0);
    report("change of force with 4 and 16 times the triangles", change, 0);
    assert_true(off < 1e-6);
    assert_true(change < 1e-8);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_in_a_box),
        cmocka_unit_test(energy_in_round_vessels),
        cmocka_unit_test(edges_of_triangles),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
