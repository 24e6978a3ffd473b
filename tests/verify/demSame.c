/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demSame.c - the same physics by different ways through the engine gives the same impact.
 *
 * Two equal spheres that meet head-on are, each of them, a sphere on a rigid plane halfway between:
 * its overlap s is half of theirs. With Hertz the plane has no modulus of its own,
 *
 *     pair   4/3 E/(2(1-nu^2)) sqrt(R/2) (2s)^1.5 = 4/3 E/(1-nu^2) sqrt(R) s^1.5   plane,
 *
 * with the linear law it is k (2s) = (2k) s, twice the stiffness; dashpots, which go with the root
 * of mass times stiffness, and tangential springs agree likewise. The line of centres turns while
 * spheres meet at an angle, as the plane does not, by v t/R: with friction and spin contacts are
 * made so short (an overlap of 1e-7 R) that it does not matter.
 *
 * The same plane again: as a face of a box from within and without, turned by an odd angle, as a
 * part of shapes of shapes, and as triangles from a file. The trilinear interpolant of samples has
 * no error where the distance is linear.
 *
 * A sphere on one 1e12 times as heavy is a sphere on a wall that is a sphere, with the linear law,
 * whose forces know of no radius; without friction, since a wall's lever is the distance of its
 * surface, that of spheres the middle of the overlap.
 */
#include "demRig.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { SAMPLES = 40 };

static const double axis[3] = {1, 2, 3}, odd_angle = .7385;
static const double sizes[3] = {10e-6, 1.7e-3, .5};

typedef struct shot {
    dem_law law;
    double R, e, mu;
    double v[3], w[3]; /* in the frame: two directions along the wall, one off it; of v and v/R */
    double speed;      /* unit of v, m/s */
    double overlap;    /* largest of an elastic impact at that speed on the wall, of R */
    double angle;      /* of the frame, about the axis */
    int pair;
} shot;

typedef struct path {
    double x[SAMPLES][3], v[SAMPLES][3], w[SAMPLES][3]; /* of overlap, v, v/R; in the frame */
    double overlap;                                     /* largest, of R */
    int left;                                           /* no contact at the end */
} path;

/* By Rodrigues' formula: x turned about the axis, forwards or backwards. */
static void turn(double angle, const double x[3], double y[3])
{
    const double l = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const double a[3] = {axis[0] / l, axis[1] / l, axis[2] / l};
    const double along = a[0] * x[0] + a[1] * x[1] + a[2] * x[2], c = cos(angle), s = sin(angle);
    for (int k = 0; k < 3; k++) {
        const int m = (k + 1) % 3, n = (k + 2) % 3;
        y[k] = c * x[k] + s * (a[m] * x[n] - a[n] * x[m]) + (1 - c) * along * a[k];
    }
}

/* Sets materials so that an elastic impact has the overlap asked for; returns its duration. */
static double shot_init(rig *r, const shot *s)
{
    const double rho = 2385, nu = .27, m = sphere_mass(s->R, rho), d = s->overlap * s->R;
    rig_init(r, s->law, 100 * s->R);
    const double E_star = 1.25 * m * s->speed * s->speed / (4. / 3 * sqrt(s->R) * pow(d, 2.5));
    rig_hertz(r, E_star * (1 - nu * nu), nu, rho);
    const double k = m * pow(s->speed / d, 2);
    rig_pairs(r, s->e, s->mu, k, .8);
    r->pair[0].stiffness = .5 * k;
    return s->law == DEM_LINEAR ? M_PI * d / s->speed : 2.943275 * d / s->speed;
}

static void add(rig *r, const shot *s, double sign, double gap)
{
    const double unit[3] = {0, 0, sign * (s->R + gap)};
    double v[3], w[3], x[1][3], u[1][3], spin[1][3];
    for (int a = 0; a < 3; a++) {
        v[a] = sign * s->speed * s->v[a];
        w[a] = s->speed / s->R * s->w[a];
    }
    turn(s->angle, unit, x[0]);
    turn(s->angle, v, u[0]);
    turn(s->angle, w, spin[0]);
    const int material = 0;
    if (dem_add(r->sim, 1, (const double(*)[3])x, (const double(*)[3])u, (const double(*)[3])spin,
                &s->R, &material, NULL))
        fail_msg("dem_add: %s", dem_message(r->sim));
}

/* Fly the shot at `wall` (its surface the plane through the origin), or at its own image. */
static path fly(const shot *s, dem_sdf *wall)
{
    rig r;
    path p = {.overlap = 0};
    const double time = shot_init(&r, s), dt = 1.6 * time / SAMPLES / 50;
    if (!s->pair) {
        assert_non_null(wall);
        strcpy(r.wall[0].name, "wall");
        r.wall[0].shape = wall;
        r.wall[0].material = 1;
        r.param.n_wall = 1;
    }
    rig_start(&r);
    const double d = s->overlap * s->R, gap = .01 * d;
    add(&r, s, 1, gap);
    if (s->pair) add(&r, s, -1, gap);
    for (int k = 0; k < SAMPLES; k++) {
        rig_advance(&r, 50 * dt, 50);
        dem_view view = dem_particles(r.sim);
        const size_t i = view.id[0] == 0 ? 0 : 1;
        turn(-s->angle, view.x[i], p.x[k]);
        turn(-s->angle, view.v[i], p.v[k]);
        turn(-s->angle, view.omega[i], p.w[k]);
        for (int a = 0; a < 3; a++) {
            p.x[k][a] = (p.x[k][a] - (a == 2 ? s->R : 0)) / d;
            p.v[k][a] /= s->speed;
            p.w[k][a] *= s->R / s->speed;
        }
        p.overlap = fmax(p.overlap, -p.x[k][2] * s->overlap);
    }
    dem_report last = dem_last_report(r.sim);
    p.left = !last.contacts && !last.wall_contacts;
    dem_free(r.sim);
    return p;
}

/* Largest difference of velocity, spin and, if asked, place on the way. */
static double difference(const path *a, const path *b, int whole)
{
    double worst = 0;
    for (int k = whole ? 0 : SAMPLES - 1; k < SAMPLES; k++)
        for (int c = 0; c < 3; c++) {
            worst = fmax(worst, fabs(a->v[k][c] - b->v[k][c]));
            worst = fmax(worst, fabs(a->w[k][c] - b->w[k][c]));
            if (whole) worst = fmax(worst, fabs(a->x[k][c] - b->x[k][c]));
        }
    return worst;
}

static dem_sdf *plane(double angle)
{
    const double up[3] = {0, 0, 1}, origin[3] = {0, 0, 0};
    double n[3];
    turn(angle, up, n);
    return dem_sdf_plane(origin, n);
}

/* ---- spheres and plane ----------------------------------------------------------------------- */

static void pair_is_plane(void **state)
{
    (void)state;
    const double e[] = {1, .9, .3};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        double worst = 0;
        for (int k = 0; k < 9; k++) {
            shot s = {.law = (dem_law)law, .R = sizes[k / 3], .e = e[k % 3], .v = {0, 0, -1}};
            s.speed = 2.385 * sqrt(s.R);
            s.overlap = .03;
            s.angle = odd_angle;
            path one = fly(&s, plane(s.angle));
            s.pair = 1;
            path two = fly(&s, NULL);
            assert_true(one.left && two.left && one.overlap > .015);
            assert_within(one.v[SAMPLES - 1][2], s.e, .02);
            worst = fmax(worst, difference(&one, &two, 1));
        }
        report(law == DEM_LINEAR ? "Two spheres or sphere and plane, linear, way and velocity"
                                 : "Two spheres or sphere and plane, Hertz, way and velocity",
               worst, 0);
        assert_true(worst < 1e-6);
    }
}

/* With friction and spin, from sticking to sliding. */
static void oblique_pair_is_plane(void **state)
{
    (void)state;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        double worst = 0;
        for (int k = 0; k < 12; k++) {
            const double slip = .1 + .3 * (k % 4);
            shot s = {.law = (dem_law)law,
                      .R = sizes[k / 4],
                      .e = .8,
                      .mu = .31,
                      .v = {slip, -.2 * slip, -1},
                      .w = {.3 * slip, -.5 * slip, 0},
                      .overlap = 1e-7,
                      .angle = odd_angle};
            s.speed = 2.385 * sqrt(s.R);
            path one = fly(&s, plane(s.angle));
            s.pair = 1;
            path two = fly(&s, NULL);
            assert_true(one.left && two.left);
            /* It did turn. */
            assert_true(k % 4 == 0 || fabs(one.w[SAMPLES - 1][1] - s.w[1]) > .4);
            worst = fmax(worst, difference(&one, &two, 0));
        }
        report(law == DEM_LINEAR ? "At an angle, with friction and spin, linear"
                                 : "At an angle, with friction and spin, Hertz",
               worst, 0);
        assert_true(worst < 1e-6);
    }
}

/* ---- shapes that have the same plane --------------------------------------------------------- */

static dem_sdf *turned(dem_sdf *shape, double angle)
{
    const double none[3] = {0, 0, 0};
    return dem_sdf_transform(shape, 1, axis, angle, none);
}

/* A box of ten radii on the origin (inside) or below it, from a file with unit edges. */
static dem_sdf *stl_box(double R, double angle, int inside)
{
    static const int corner[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                      {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                      {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    char name[64], message[512];
    snprintf(name, sizeof name, "/tmp/demSame.%ld.stl", (long)getpid());
    FILE *f = fopen(name, "w");
    assert_non_null(f);
    fprintf(f, "solid box\n");
    for (int t = 0; t < 12; t++) {
        fprintf(f, "facet normal 0 0 0\nouter loop\n");
        for (int c = 0; c < 3; c++) {
            const int at = corner[t][c];
            fprintf(f, "vertex %.17g %.17g %.17g\n", at % 2 - .47, at / 2 % 2 - .44,
                    at / 4 - (inside ? 0 : 1.));
        }
        fprintf(f, "endloop\nendfacet\n");
    }
    fprintf(f, "endsolid box\n");
    assert_int_equal(fclose(f), 0);
    dem_stl stl = dem_stl_default();
    stl.path = name;
    stl.scale = 10 * R;
    stl.inside = inside;
    dem_sdf *box = dem_sdf_stl(&stl, message, sizeof message);
    unlink(name);
    if (!box) fail_msg("%s", message);
    return turned(box, angle);
}

static dem_sdf *shape(int which, double R, double angle)
{
    const double room_lo[3] = {-9 * R, -9 * R, 0}, room_hi[3] = {9 * R, 9 * R, 9 * R};
    const double block_lo[3] = {-9 * R, -9 * R, -9 * R}, block_hi[3] = {9 * R, 9 * R, 0};
    const double below[3] = {0, 0, -8 * R}, origin[3] = {0, 0, 0};
    dem_sdf *two[2];
    switch (which) {
    case 0:
        return turned(dem_sdf_box(room_lo, room_hi, 1), angle);
    case 1:
        return turned(dem_sdf_box(block_lo, block_hi, 0), angle);
    case 2:
        return turned(dem_sdf_cylinder(below, origin, 7 * R, 1, 0), angle);
    case 3:
        return turned(dem_sdf_complement(dem_sdf_box(room_lo, room_hi, 0)), angle);
    case 4:
        two[0] = turned(dem_sdf_box(block_lo, block_hi, 0), angle);
        two[1] = dem_sdf_sphere((const double[3]){20 * R, 20 * R, 20 * R}, R, 0);
        return dem_sdf_union(2, two);
    case 5:
        two[0] = turned(dem_sdf_box(block_lo, block_hi, 0), angle);
        two[1] = dem_sdf_sphere(origin, 30 * R, 0);
        return dem_sdf_intersection(2, two);
    case 6:
        return stl_box(R, angle, 1);
    default:
        return stl_box(R, angle, 0);
    }
}

static const char *const shape_name[] = {
    "box from within",        "box from without",        "end of a cylinder",
    "complement of a box",    "union of box and sphere", "intersection of box and sphere",
    "triangles, from within", "triangles, from without"};

static void shapes_are_plane(void **state)
{
    (void)state;
    for (int which = 0; which < 8; which++) {
        double worst = 0;
        for (int k = 0; k < 12; k++) {
            shot s = {.law = k % 2 ? DEM_HERTZ : DEM_LINEAR,
                      .R = sizes[k / 4],
                      .e = .8,
                      .mu = .31,
                      .v = {.7, -.2, -1},
                      .w = {.3, -.5, 0},
                      .overlap = .03,
                      .angle = k / 2 % 2 ? odd_angle : 0};
            s.speed = 2.385 * sqrt(s.R);
            path flat = fly(&s, plane(s.angle)), other = fly(&s, shape(which, s.R, s.angle));
            assert_true(flat.left && other.left);
            worst = fmax(worst, difference(&flat, &other, 1));
        }
        char what[80];
        snprintf(what, sizeof what, "Plane or %s", shape_name[which]);
        report(what, worst, 0);
        assert_true(worst < 1e-6);
    }
}

/* ---- a sphere that is a wall ----------------------------------------------------------------- */

/* Off its centre onto a ball of twice its radius that is a particle or a wall. */
static path onto_ball(const shot *s, int particle)
{
    rig r;
    path p = {.overlap = 0};
    const double time = shot_init(&r, s), d = s->overlap * s->R;
    const double ball[1][3] = {{0, 0, 0}}, other = 2 * s->R;
    r.material[1].density = 1e12 * r.material[0].density;
    for (int k = 1; k < 4; k++) r.pair[k].stiffness = r.pair[0].stiffness;
    if (!particle) {
        strcpy(r.wall[0].name, "ball");
        r.wall[0].shape = dem_sdf_sphere(ball[0], other, 0);
        r.wall[0].material = 1;
        r.param.n_wall = 1;
    }
    rig_start(&r);
    const double from = asin(.55), far = 3 * s->R + .01 * d;
    rig_ball(&r, s->R, far * sin(from), 0, far * cos(from), 0, 0, -s->speed);
    const int material = 1;
    if (particle && dem_add(r.sim, 1, ball, NULL, NULL, &other, &material, NULL))
        fail_msg("dem_add: %s", dem_message(r.sim));
    for (int k = 0; k < SAMPLES; k++) {
        rig_advance(&r, 3 * time / SAMPLES, 100);
        dem_view view = dem_particles(r.sim);
        const size_t i = view.id[0] == 0 ? 0 : 1;
        for (int a = 0; a < 3; a++) {
            p.x[k][a] = view.x[i][a] / d;
            p.v[k][a] = view.v[i][a] / s->speed;
            p.w[k][a] = view.omega[i][a] * s->R / s->speed;
        }
    }
    dem_report last = dem_last_report(r.sim);
    p.left = !last.contacts && !last.wall_contacts;
    dem_free(r.sim);
    return p;
}

static void heavy_sphere_is_wall(void **state)
{
    (void)state;
    double worst = 0;
    for (int k = 0; k < 3; k++) {
        shot s = {.law = DEM_LINEAR, .R = sizes[k], .e = .7, .overlap = .03};
        s.speed = 2.385 * sqrt(s.R);
        path wall = onto_ball(&s, 0), sphere = onto_ball(&s, 1);
        assert_true(wall.left && sphere.left && fabs(wall.v[SAMPLES - 1][0]) > .3);
        worst = fmax(worst, difference(&wall, &sphere, 1));
    }
    report("Heavy sphere or spherical wall, linear, off the centre", worst, 0);
    assert_true(worst < 1e-6);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pair_is_plane), cmocka_unit_test(oblique_pair_is_plane),
        cmocka_unit_test(shapes_are_plane), cmocka_unit_test(heavy_sphere_is_wall)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
