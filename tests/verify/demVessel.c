/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demVessel.c - walls of triangles at the sizes of powder, grains and boulders, both laws.
 *
 * A smooth elastic sphere keeps its energy while it bounces about in a box, into corners too. One
 * that rolls over a flat face, carried by it, does not feel into which triangles the face is cut.
 * The surfaces are sampled at a quarter of the diameter, the engine's default.
 */
#include "demRig.h"

#include "stlFixture.h"

static const double sizes[3] = {10e-6, 2.1e-3, .5};

/* Three directions turned as move_body turns. */
static void turn(double angle, double direction[3][3])
{
    const double zero[3] = {0, 0, 0};
    body t = {0, 0, NULL};
    add_triangle(&t, direction[0], direction[1], direction[2]);
    move_body(&t, angle, zero);
    memcpy(direction, t.x[0], sizeof t.x[0]);
    body_free(&t);
}

/* ---- bouncing -------------------------------------------------------------------------------- */

/* A sphere of radius R in `vessel`; the energy left after `impacts` over that of the start. In the
 * box it flies into a corner first. */
static double bounce(dem_law law, double R, dem_sdf *vessel, double angle, int impacts,
                     int *corners)
{
    rig r;
    const double rho = 2500, nu = .3, m = sphere_mass(R, rho), v = sqrt(R), d = .02 * R;
    const double E_star = 1.25 * m * v * v / (4. / 3 * sqrt(R) * pow(d, 2.5));
    const double time = law == DEM_LINEAR ? M_PI * d / v : 2.943275 * d / v;
    rig_init(&r, law, 100 * R);
    rig_hertz(&r, E_star * (1 - nu * nu), nu, rho);
    rig_pairs(&r, 1, 0, m * v * v / (d * d), 1);
    strcpy(r.wall[0].name, "vessel");
    r.wall[0].shape = vessel;
    r.wall[0].material = 1;
    r.param.n_wall = 1;
    rig_start(&r);
    double way[3][3] = {{.91, .2, 1.09}, {.48, .6, .64}, {0, 0, 1}};
    turn(angle, way);
    rig_ball(&r, R, R * way[0][0], R * way[0][1], R * way[0][2], v * way[1][0], v * way[1][1],
             v * way[1][2]);
    int hits = 0, touches = 0;
    while (hits < impacts || touches) {
        rig_advance(&r, .005 * time, 1);
        const int now = (int)dem_last_report(r.sim).wall_contacts;
        hits += now > touches;
        *corners += now > 1 && touches <= 1;
        touches = now;
        assert_true(dem_time(r.sim) < 1e5 * time);
    }
    const double kept = dem_last_report(r.sim).kinetic_energy / (.5 * m * v * v);
    dem_free(r.sim);
    return kept;
}

static void energy_in_a_box(void **state)
{
    (void)state;
    const double zero[3] = {0, 0, 0}, angle[] = {0, .83};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int a = 0; a < 2; a++) {
            double worst = 0;
            int corners = 0;
            for (int k = 0; k < 3; k++) {
                const double R = sizes[k], lo[3] = {-2.9 * R, -3.3 * R, -2.6 * R};
                const double hi[3] = {3.1 * R, 2.7 * R, 3.7 * R};
                body b = box_body(lo, hi, 2);
                move_body(&b, angle[a], zero);
                const double kept =
                    bounce((dem_law)law, R, stl_shape(&b, 1), angle[a], 60, &corners);
                if (fabs(kept - 1) > fabs(worst)) worst = kept - 1;
                body_free(&b);
            }
            print_message("Elastic sphere in a box of triangles, %s, turned by %g, %d times in a "
                          "corner\n",
                          law == DEM_LINEAR ? "linear" : "Hertz", angle[a], corners);
            report("    energy after 60 impacts", 1 + worst, 1);
            assert_true(fabs(worst) < 1e-3 && corners > 0);
        }
}

/* ---- rolling --------------------------------------------------------------------------------- */

typedef struct ride {
    double least, most; /* normal force over weight */
    double aside;       /* other force over weight */
    double end[3];      /* place, of R */
} ride;

/* Over the top of a block whose faces are cut in n x n halved cells, without slip. */
static ride roll(dem_law law, double R, int n, double angle)
{
    rig r;
    const double g = 9.81, rho = 2500, nu = .3, m = sphere_mass(R, rho), d = 1e-3 * R;
    const double E_star = m * g / (4. / 3 * sqrt(R) * pow(d, 1.5)), v = .7 * sqrt(g * R);
    rig_init(&r, law, 100 * R);
    rig_hertz(&r, E_star * (1 - nu * nu), nu, rho);
    rig_pairs(&r, .6, .4, m * g / d, .8);
    const double lo[3] = {-9 * R, -8 * R, -5 * R}, hi[3] = {8 * R, 10 * R, 0};
    const double zero[3] = {0, 0, 0};
    double frame[3][3] = {{0, 0, 1}, {.8, .6, 0}, {-.6, .8, 0}}; /* up, along, across */
    turn(angle, frame);
    body b = box_body(lo, hi, n);
    move_body(&b, angle, zero);
    strcpy(r.wall[0].name, "block");
    r.wall[0].shape = stl_shape(&b, 0);
    r.wall[0].material = 1;
    r.param.n_wall = 1;
    body_free(&b);
    for (int a = 0; a < 3; a++) r.param.gravity[a] = -g * frame[0][a];
    rig_start(&r);
    double x[1][3], u[1][3], w[1][3];
    for (int a = 0; a < 3; a++) {
        x[0][a] = (R - d) * frame[0][a] - 3.1 * R * frame[1][a];
        u[0][a] = v * frame[1][a];
        w[0][a] = v / (R - d) * frame[2][a];
    }
    const int material = 0;
    assert_int_equal(dem_add(r.sim, 1, (const double(*)[3])x, (const double(*)[3])u,
                             (const double(*)[3])w, &R, &material, NULL),
                     DEM_OK);
    ride found = {INFINITY, 0, 0, {0, 0, 0}};
    const double dt = .02 * sqrt(d / g);
    while (dem_time(r.sim) < 6 * R / v) {
        double force[3], normal = 0;
        rig_advance(&r, dt, 1);
        dem_wall_force(r.sim, 0, force);
        for (int a = 0; a < 3; a++) normal -= force[a] * frame[0][a];
        found.least = fmin(found.least, normal / (m * g));
        found.most = fmax(found.most, normal / (m * g));
        for (int a = 0; a < 3; a++)
            found.aside = fmax(found.aside, fabs(force[a] + normal * frame[0][a]) / (m * g));
    }
    for (int a = 0; a < 3; a++) found.end[a] = dem_particles(r.sim).x[0][a] / R;
    dem_free(r.sim);
    return found;
}

static void rolls_over_edges(void **state)
{
    (void)state;
    const double angle[] = {0, .83};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        double step = 0, aside = 0, cut = 0;
        for (int k = 0; k < 6; k++) {
            ride rough = {0};
            for (int n = 1; n <= 4; n *= 2) {
                ride p = roll((dem_law)law, sizes[k / 2], n, angle[k % 2]);
                step = fmax(step, fmax(fabs(p.most - 1), fabs(p.least - 1)));
                aside = fmax(aside, p.aside);
                if (n == 1) rough = p;
                cut = fmax(cut, fmax(fabs(p.most - rough.most), fabs(p.least - rough.least)));
                for (int a = 0; a < 3; a++) cut = fmax(cut, fabs(p.end[a] - rough.end[a]));
            }
        }
        print_message("Sphere rolling over triangles of a flat wall, %s\n",
                      law == DEM_LINEAR ? "linear" : "Hertz");
        report("    normal force, largest step, of the weight", step, 0);
        report("    force along the wall, of the weight", aside, 0);
        report("    change of force, and of the end over R, cut 4 and 16 times", cut, 0);
        assert_true(step < 1e-6 && aside < 1e-6 && cut < 1e-8);
    }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(energy_in_a_box),
                                       cmocka_unit_test(rolls_over_edges)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
