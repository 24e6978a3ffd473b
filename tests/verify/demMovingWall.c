/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demMovingWall.c - particles and walls, at rest and moving, against closed forms.
 *
 *     shifted frame     an impact on a wall that moves evenly is that on a wall at rest
 *     bouncing table    v' = -e v + (1 + e) u with the table's velocity u at the impact
 *     belt              a ball laid on a belt of speed u slides until t = 2 u/(7 mu g), then rolls
 *                       at 2 u/7 (I = 2/5 m r^2)
 *     turntable         a ball rolling on it goes in circles at 2/7 of its rate, about a centre
 * that depends on the throw alone (Weltner, Am. J. Phys. 47 (1979) 984, doi:10.1119/1.11602)
 *     carried round     between two plates that turn as one, held by friction alone: shifted
 *                       outwards by m W^2 l/(2 k_t), half of it for each plate
 *     piston            a ball between an end and a piston at V gains 2 V at every hit
 *     loads             weight, lever and wedge by statics; what walls give is what particles get
 */
#include "demRig.h"

static dem_motion motion_of(dem_motion_kind kind, double x, double y, double z)
{
    dem_motion m = dem_motion_default();
    m.kind = kind;
    m.vector[0] = x;
    m.vector[1] = y;
    m.vector[2] = z;
    return m;
}

static void drive(dem_wall *w, const dem_motion *m)
{
    w->n_motion = 1;
    w->motion = m;
}

static dem_wall *add_wall(rig *r, const char *name, dem_sdf *shape)
{
    dem_wall *w = &r->wall[r->param.n_wall++];
    assert_non_null(shape);
    strcpy(w->name, name);
    w->shape = shape;
    w->material = 1;
    return w;
}

static void gravity_down(rig *r, double g)
{
    r->param.gravity[2] = -g;
}

/* ---- a frame that moves evenly --------------------------------------------------------------- */

static void throw_at(dem_law law, const double u[3], double v[3], double omega[3])
{
    rig r;
    const double R = 2.5e-3, x[1][3] = {{.004, -.003, R + 1e-5}}, spin[1][3] = {{40, -70, 110}};
    const double thrown[1][3] = {{.7 + u[0], -.2 + u[1], -1.1 + u[2]}};
    const int material = 0;
    rig_init(&r, law, .2);
    rig_hertz(&r, 5e7, .25, 2500);
    rig_pairs(&r, .77, .23, 4e4, .6);
    rig_floor(&r);
    dem_motion m = motion_of(DEM_TRANSLATION, u[0], u[1], u[2]);
    drive(&r.wall[0], &m);
    rig_start(&r);
    assert_int_equal(dem_add(r.sim, 1, x, thrown, spin, &R, &material, NULL), DEM_OK);
    rig_advance(&r, 2e-3, 2000);
    dem_view p = dem_particles(r.sim);
    for (int a = 0; a < 3; a++) v[a] = p.v[0][a] - u[a];
    for (int a = 0; a < 3; a++) omega[a] = p.omega[0][a];
    dem_free(r.sim);
}

static void shifted_frame(void **state)
{
    (void)state;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        double v[2][3], omega[2][3];
        throw_at((dem_law)law, (const double[3]){0, 0, 0}, v[0], omega[0]);
        throw_at((dem_law)law, (const double[3]){2.3, -1.7, 3.1}, v[1], omega[1]);
        report("speed after, relative to a moving wall, m/s", v[1][2], v[0][2]);
        report("spin after, rad/s", omega[1][1], omega[0][1]);
        assert_true(v[0][2] > .8);
        for (int a = 0; a < 3; a++) assert_within(v[1][a], v[0][a], 1e-11);
        for (int a = 0; a < 3; a++) assert_within(omega[1][a], omega[0][a], 1e-8);
    }
}

/* ---- bouncing table -------------------------------------------------------------------------- */

static void bouncing_table(void **state)
{
    (void)state;
    const double R = 2e-3, e = .71, v = 1.9;
    const double phase[] = {0, 1.3, 2.6, 3.9, 5.2};
    for (int k = 0; k < 5; k++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .2);
        rig_pairs(&r, e, 0, 1e7, 1);
        rig_floor(&r);
        dem_motion m = motion_of(DEM_OSCILLATION, 0, 0, .011);
        m.frequency = 9.3;
        m.phase = phase[k];
        drive(&r.wall[0], &m);
        rig_start(&r);
        rig_ball(&r, R, 0, 0, R + .011 * sin(phase[k]) + 1e-4, 0, 0, -v);
        double mass = sphere_mass(R, 2500), dt = 2 * M_PI * sqrt(mass / 1e7) / 4000;
        double begin = 0, end = 0;
        while (dem_time(r.sim) < .05) {
            double t = dem_time(r.sim);
            rig_advance(&r, dt, 1);
            int touches = dem_last_report(r.sim).wall_contacts > 0;
            if (touches && begin == 0) begin = t;
            if (begin > 0 && !touches) {
                end = t;
                break;
            }
        }
        assert_true(end > begin && begin > 0);
        double pulse = 2 * M_PI * m.frequency, t = .5 * (begin + end);
        double u = .011 * pulse * cos(pulse * t + m.phase);
        double got = dem_particles(r.sim).v[0][2];
        report("velocity after the table's kick, m/s", got, e * v + (1 + e) * u);
        assert_within(got, e * v + (1 + e) * u, 1e-3 * v);
        dem_free(r.sim);
    }
}

/* ---- belt ------------------------------------------------------------------------------------ */

static void belt(void **state)
{
    (void)state;
    const double R = 5e-3, mu = .31, g = 9.81, u = 1.3, k = 2e5;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        rig r;
        rig_init(&r, (dem_law)law, 1);
        rig_hertz(&r, 1e10, .3, 2500);
        rig_pairs(&r, .5, mu, k, 1);
        gravity_down(&r, g);
        rig_floor(&r);
        dem_motion m = motion_of(DEM_TRANSLATION, -.6 * u, .8 * u, 0);
        drive(&r.wall[0], &m);
        rig_start(&r);
        double mass = sphere_mass(R, 2500), K = 4. / 3 * 1e10 / (1 - .09) * sqrt(R);
        double sink = law == DEM_LINEAR ? mass * g / k : pow(mass * g / K, 2. / 3);
        rig_ball(&r, R, 0, 0, R - sink, 0, 0, 0);
        double slides = 2 * u / (7 * mu * g);
        rig_advance(&r, .6 * slides, 0);
        dem_view p = dem_particles(r.sim);
        report("speed while the belt slips, m/s", hypot(p.v[0][0], p.v[0][1]), .6 * 2 * u / 7);
        assert_close(hypot(p.v[0][0], p.v[0][1]), .6 * 2 * u / 7, 1e-3);
        rig_advance(&r, 1.4 * slides, 0);
        p = dem_particles(r.sim);
        report("speed in the direction of the belt when it rolls, m/s",
               -.6 * p.v[0][0] + .8 * p.v[0][1], 2 * u / 7);
        report("spin then, rad/s", hypot(p.omega[0][0], p.omega[0][1]), 5 * u / (7 * R));
        assert_close(-.6 * p.v[0][0] + .8 * p.v[0][1], 2 * u / 7, 1e-3);
        assert_close(hypot(p.omega[0][0], p.omega[0][1]), 5 * u / (7 * R), 1e-3);
        dem_free(r.sim);
    }
}

/* ---- turntable ------------------------------------------------------------------------------- */

/* Rolling: v = W z x x + R w x z. With w' = 5/(2 m R) (z x F) the throw goes round at 2/7 W, about
 * the point c that is found from v = 2/7 W z x (x - c). */
static void turntable(void **state)
{
    (void)state;
    const double R = 4e-3, g = 9.81, W = 5.7, k = 1e6;
    rig r;
    rig_init(&r, DEM_LINEAR, .5);
    rig_pairs(&r, .4, .9, k, .8);
    gravity_down(&r, g);
    rig_floor(&r);
    dem_motion m = motion_of(DEM_ROTATION, 0, 0, 1);
    m.rate = W;
    drive(&r.wall[0], &m);
    rig_start(&r);
    double l = R - sphere_mass(R, 2500) * g / k; /* height of the centre */
    const double x[1][3] = {{.09, .02, l}}, v[1][3] = {{-.05, .08, 0}};
    /* l w x z = l (w_y, -w_x, 0) is what v has beyond the table's velocity. */
    const double w[1][3] = {{-(v[0][1] - W * x[0][0]) / l, (v[0][0] + W * x[0][1]) / l, 0}};
    const int material = 0;
    assert_int_equal(dem_add(r.sim, 1, x, v, w, &R, &material, NULL), DEM_OK);
    double rate = 2 * W / 7, period = 2 * M_PI / rate;
    /* v = rate z x (x - c): v_x = -rate (y - c_y), v_y = rate (x - c_x) */
    double c[2] = {x[0][0] - v[0][1] / rate, x[0][1] + v[0][0] / rate};
    double rx = x[0][0] - c[0], ry = x[0][1] - c[1], size = hypot(rx, ry), worst = 0;
    for (int s = 1; s <= 12; s++) {
        rig_advance(&r, period / 12, 0);
        dem_view p = dem_particles(r.sim);
        double q = 2 * M_PI * s / 12;
        double ex = c[0] + cos(q) * rx - sin(q) * ry, ey = c[1] + sin(q) * rx + cos(q) * ry;
        worst = fmax(worst, hypot(p.x[0][0] - ex, p.x[0][1] - ey));
    }
    report("turntable: farthest off the circle of radius 1", worst / size, 0);
    assert_within(worst / size, 0, 2e-3);
    dem_free(r.sim);
}

/* ---- carried round --------------------------------------------------------------------------- */

static void carried_round(void **state)
{
    (void)state;
    const double R = 4e-3, W = 6.3, kn = 5e4, kt = 3e4, squeeze = 4e-5, l = .11, e = .3;
    for (int upright = 0; upright < 2; upright++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .4);
        rig_pairs(&r, e, .8, kn, kt / kn);
        /* About z, or about an axis along no coordinate. */
        const double axis[3] = {upright ? 0 : .48, upright ? 0 : .6, upright ? 1 : .64};
        const double out[3] = {upright ? 1 : .8, 0, upright ? 0 : -.6};
        const double origin[3] = {.03, -.02, .05};
        const double turn = 2 * M_PI / W, dt = turn / 30000;
        dem_motion m = motion_of(DEM_ROTATION, axis[0], axis[1], axis[2]);
        m.rate = W;
        double low[3], high[3], down[3], x[1][3], v[1][3], w[1][3];
        for (int a = 0; a < 3; a++) {
            m.origin[a] = origin[a];
            low[a] = origin[a] - (R - squeeze) * axis[a];
            high[a] = origin[a] + (R - squeeze) * axis[a];
            down[a] = -axis[a];
            w[0][a] = W * axis[a];
            x[0][a] = origin[a] + l * out[a];
        }
        drive(add_wall(&r, "lower", dem_sdf_plane(low, axis)), &m);
        drive(add_wall(&r, "upper", dem_sdf_plane(high, down)), &m);
        for (int a = 0; a < 3; a++) {
            int b = (a + 1) % 3, c = (a + 2) % 3;
            double along = axis[b] * out[c] - axis[c] * out[b];
            /* The velocity of half a step before: symplectic Euler has it so. */
            v[0][a] = W * l * (cos(.5 * W * dt) * along + sin(.5 * W * dt) * out[a]);
            memcpy(r.wall[0].centre, origin, sizeof origin);
            memcpy(r.wall[1].centre, origin, sizeof origin);
        }
        rig_start(&r);
        const int material = 0;
        assert_int_equal(dem_add(r.sim, 1, (const double(*)[3])x, (const double(*)[3])v,
                                 (const double(*)[3])w, &R, &material, NULL),
                         DEM_OK);
        double mass = sphere_mass(R, 2500);
        rig_advance(&r, 2 * turn, 60000);
        double shift = 0, aside = 0, spin[3], torque[3];
        dem_view p = dem_particles(r.sim);
        for (int a = 0; a < 3; a++) {
            int b = (a + 1) % 3, c = (a + 2) % 3;
            double along = axis[b] * out[c] - axis[c] * out[b];
            shift += (p.x[0][a] - x[0][a]) * out[a];
            aside += (p.x[0][a] - x[0][a]) * along;
            spin[a] = p.omega[0][a];
            assert_within(spin[a], W * axis[a], 1e-6 * W);
        }
        report("shift outwards after two turns, m", shift, mass * W * W * l / (2 * kt));
        report("aside, m", aside, 0);
        assert_close(shift, mass * W * W * l / (2 * kt), 2e-3);
        assert_within(aside, 0, 1e-7 * l);
        double force[2][3], sum = 0, radial = mass * W * W * (l + shift);
        rig_advance(&r, dt, 1);
        dem_wall_force(r.sim, 0, force[0]);
        dem_wall_force(r.sim, 1, force[1]);
        for (int a = 0; a < 3; a++) sum += pow(force[0][a] + force[1][a], 2);
        report("centripetal force by both plates, N", sqrt(sum), radial);
        assert_close(sqrt(sum), radial, 1e-4);
        dem_wall_torque(r.sim, 0, torque);
        double about = torque[0] * axis[0] + torque[1] * axis[1] + torque[2] * axis[2];
        report("torque about the axis over that force times lever", about / (radial * l), 0);
        assert_within(about, 0, 1e-4 * radial * l);
        dem_free(r.sim);
    }
}

/* A ball in the outer corner of a box that turns about the vertical. */
static void carried_round_in_a_corner(void **state)
{
    (void)state;
    const double R = 3e-3, W = 20, g = 9.81;
    rig r;
    rig_init(&r, DEM_HERTZ, .2);
    rig_hertz(&r, 1e8, .3, 2500);
    rig_pairs(&r, .5, .4, 1, 1);
    gravity_down(&r, g);
    dem_motion m = motion_of(DEM_ROTATION, 0, 0, 1);
    m.rate = W;
    m.ramp = .2;
    const double lo[3] = {-.03, -.05, 0}, hi[3] = {.04, .02, .05};
    drive(add_wall(&r, "box", dem_sdf_box(lo, hi, 1)), &m);
    rig_start(&r);
    rig_ball(&r, R, hi[0] - R, hi[1] - R, R, 0, 0, 0);
    double first[3], place[3], Q[9];
    for (int k = 0; k < 2; k++) {
        /* The corner (.04 .02) sees the throw outwards at 27 degrees: both sides are pressed. */
        rig_advance(&r, k ? 2 * M_PI / W : 1, 0);
        dem_wall_place(r.sim, 0, place, Q);
        dem_view p = dem_particles(r.sim);
        double b[3];
        for (int a = 0; a < 3; a++)
            b[a] = Q[a] * p.x[0][0] + Q[3 + a] * p.x[0][1] + Q[6 + a] * p.x[0][2];
        if (k)
            for (int a = 0; a < 3; a++) {
                report("place in the box after a turn, m", b[a], first[a]);
                assert_within(b[a], first[a], 1e-6 * R);
            }
        memcpy(first, b, sizeof b);
        report("spin, rad/s", p.omega[0][2], W);
        assert_close(p.omega[0][2], W, 1e-6);
        double force[3], mass = sphere_mass(R, 2500);
        dem_wall_force(r.sim, 0, force);
        assert_close(-force[2], mass * g, 1e-6);
    }
    dem_free(r.sim);
}

/* ---- piston ---------------------------------------------------------------------------------- */

static void piston(void **state)
{
    (void)state;
    const double R = 1e-3, V = .21, v0 = 1.7, gap = .05;
    rig r;
    rig_init(&r, DEM_LINEAR, .2);
    rig_pairs(&r, 1, 0, 1e6, 1);
    add_wall(&r, "end", dem_sdf_plane((const double[3]){0, 0, 0}, (const double[3]){1, 0, 0}));
    dem_motion m = motion_of(DEM_TRANSLATION, -V, 0, 0);
    dem_wall *w =
        add_wall(&r, "piston",
                 dem_sdf_plane((const double[3]){gap + 2 * R, 0, 0}, (const double[3]){-1, 0, 0}));
    drive(w, &m);
    rig_start(&r);
    rig_ball(&r, R, R + .01, 0, 0, v0, 0, 0);
    double mass = sphere_mass(R, 2500), dt = 2 * M_PI * sqrt(mass / 1e6) / 400, work = 0;
    while (dem_time(r.sim) < .16) {
        double force[3];
        rig_advance(&r, 50 * dt, 50);
        dem_wall_force(r.sim, 1, force);
        work += force[0] * V * 50 * dt;
    }
    dem_report rep = dem_last_report(r.sim);
    /* Point by point: the way between hits, v to and fro, while the piston comes nearer. */
    double t = 0, v = v0, x = .01, hits = 0;
    for (;;) {
        double hit = (gap - x - V * t) / (v + V); /* from now on, moving to the piston */
        if (t + hit > dem_time(r.sim)) break;
        t += hit;
        x = gap - V * t;
        v += 2 * V;
        hits++;
        if (t + x / v > dem_time(r.sim)) break;
        t += x / v;
        x = 0;
    }
    print_message("%g hits of the piston\n", hits);
    report("speed after them, m/s", rep.speed, v);
    report("work of the piston, J", work, rep.kinetic_energy - .5 * mass * v0 * v0);
    assert_true(hits >= 5);
    assert_close(rep.speed, v, 1e-3);
    assert_close(work, rep.kinetic_energy - .5 * mass * v0 * v0, 2e-3);
    dem_free(r.sim);
}

/* ---- loads ----------------------------------------------------------------------------------- */

/* A ball at rest on a floor that stands, or goes with it: the torque is about the floor's own
 * centre, which goes along. */
static void lever(void **state)
{
    (void)state;
    const double R = 3e-3, g = 9.81, at[3] = {.07, -.045, 0};
    for (int moves = 0; moves < 2; moves++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .2);
        rig_pairs(&r, .3, .5, 1000, 1);
        gravity_down(&r, g);
        rig_floor(&r);
        r.wall[0].centre[0] = .011;
        r.wall[0].centre[2] = -.3;
        dem_motion m = dem_motion_default();
        m.kind = DEM_TRANSLATION;
        const double v[3] = {.06 * moves, .05 * moves, -.09 * moves};
        memcpy(m.vector, v, sizeof v);
        r.wall[0].n_motion = (size_t)moves;
        r.wall[0].motion = &m;
        rig_start(&r);
        rig_ball(&r, R, at[0], at[1], R, v[0], v[1], v[2]);
        rig_advance(&r, 1, 0);
        rig_advance(&r, .01, 0);
        double force[3], torque[3], weight = sphere_mass(R, 2500) * g;
        dem_wall_force(r.sim, 0, force);
        dem_wall_torque(r.sim, 0, torque);
        report("force of a ball at rest, N", force[2], -weight);
        report("torque about x, N m", torque[0], -weight * at[1]);
        report("torque about y, N m", torque[1], weight * (at[0] - .011));
        assert_close(force[2], -weight, 1e-9);
        assert_close(torque[0], -weight * at[1], 1e-9);
        assert_close(torque[1], weight * (at[0] - .011), 1e-9);
        assert_within(torque[2], 0, 1e-12 * weight);
        dem_free(r.sim);
    }
}

static void groove(void **state)
{
    (void)state;
    const double R = 3e-3, g = 9.81, left = .7, right = .4; /* slopes, rad */
    rig r;
    rig_init(&r, DEM_HERTZ, .2);
    rig_hertz(&r, 1e8, .3, 2500);
    rig_pairs(&r, .3, 0, 1, 1);
    gravity_down(&r, g);
    const double o[3] = {0, 0, 0}, nl[3] = {sin(left), 0, cos(left)},
                 nr[3] = {-sin(right), 0, cos(right)};
    add_wall(&r, "left", dem_sdf_plane(o, nl));
    add_wall(&r, "right", dem_sdf_plane(o, nr));
    rig_start(&r);
    /* Where both are at the distance R. */
    double z = R * (sin(left) + sin(right)) / sin(left + right);
    rig_ball(&r, R, (R - z * cos(left)) / sin(left), 0, z, 0, 0, 0);
    rig_advance(&r, 1, 0);
    rig_advance(&r, .01, 0);
    double force[2][3], weight = sphere_mass(R, 2500) * g;
    dem_wall_force(r.sim, 0, force[0]);
    dem_wall_force(r.sim, 1, force[1]);
    for (int k = 0; k < 2; k++) {
        double N = weight * sin(k ? left : right) / sin(left + right);
        const double *n = k ? nr : nl;
        report("normal force in a groove, N", -force[k][0] * n[0] - force[k][2] * n[2], N);
        for (int a = 0; a < 3; a++) assert_within(force[k][a], -N * n[a], 1e-7 * N);
    }
    dem_free(r.sim);
}

/* A slot narrower than the ball: two walls, or two faces of one. */
static void narrow_slot(void **state)
{
    (void)state;
    const double R = 3e-3, k = 2e4, narrow = 6e-5;
    for (int one = 0; one < 2; one++) {
        rig r;
        rig_init(&r, DEM_LINEAR, .2);
        rig_pairs(&r, .3, 0, k, 1);
        double low = -.01, high = low + 2 * R - narrow;
        if (one)
            add_wall(
                &r, "slot",
                dem_sdf_box((const double[3]){low, -.1, -.1}, (const double[3]){high, .1, .1}, 1));
        else {
            add_wall(&r, "low",
                     dem_sdf_plane((const double[3]){low, 0, 0}, (const double[3]){1, 0, 0}));
            add_wall(&r, "high",
                     dem_sdf_plane((const double[3]){high, 0, 0}, (const double[3]){-1, 0, 0}));
        }
        rig_start(&r);
        rig_ball(&r, R, .5 * (low + high) + 1e-5, .02, .03, 0, .05, 0);
        rig_advance(&r, .05, 0);
        rig_advance(&r, 1e-4, 0);
        dem_view p = dem_particles(r.sim);
        report("centre in a narrow slot, m", p.x[0][0], .5 * (low + high));
        assert_within(p.x[0][0], .5 * (low + high), 1e-9 * R);
        assert_true(dem_last_report(r.sim).wall_contacts == 2);
        assert_within(p.v[0][1], .05, 1e-15); /* nothing holds it along the slot */
        double force[3] = {0}, sum[3];
        dem_wall_force(r.sim, 0, force);
        report("force on the lower side, N", force[0], one ? 0 : -.5 * k * narrow);
        assert_within(force[0], one ? 0 : -.5 * k * narrow, 1e-7 * k * narrow);
        if (!one) {
            dem_wall_force(r.sim, 1, sum);
            assert_within(sum[0] + force[0], 0, 1e-7 * k * narrow);
        }
        dem_free(r.sim);
    }
}

/* A pile in a box that shakes, then rests: momentum in every step to rounding, in the end weight.
 */
static void weight_of_a_pile(void **state)
{
    (void)state;
    enum { N = 300 };
    rig r;
    rig_init(&r, DEM_HERTZ, .1);
    rig_hertz(&r, 2e6, .25, 2500);
    rig_pairs(&r, .4, .5, 1, 1);
    const double g[3] = {1.1, -.7, -9.2};
    memcpy(r.param.gravity, g, sizeof g);
    const double lo[3] = {-.02, -.02, 0}, hi[3] = {.02, .02, .09};
    dem_wall *box = add_wall(&r, "box", dem_sdf_box(lo, hi, 1));
    add_wall(
        &r, "post",
        dem_sdf_cylinder((const double[3]){0, 0, 0}, (const double[3]){0, .01, .05}, .004, 1, 0));
    dem_motion m[2] = {motion_of(DEM_OSCILLATION, .001, .0007, 0),
                       motion_of(DEM_ROCKING, 1, .3, 0)};
    m[0].frequency = 35;
    m[1].frequency = 12;
    m[1].amplitude = .05;
    m[0].end = m[1].end = .25; /* whole periods: back at the start */
    m[0].end = 9. / 35;
    box->n_motion = 2;
    box->motion = m;
    rig_start(&r);
    double x[N][3], radius[N], mass = 0;
    int material[N], n = 0;
    for (int i = 0; n < N; i++) {
        const int c[3] = {i % 7, i / 7 % 7, i / 49};
        double at[3];
        for (int a = 0; a < 3; a++) at[a] = .0052 * (c[a] - (a < 2 ? 3 : -1)) + 1e-4 * sin(i + a);
        if (hypot(at[0], at[1] - .2 * at[2]) < .0068 && at[2] < .056) continue; /* the post */
        memcpy(x[n], at, sizeof at);
        radius[n] = .0018 + .0002 * (n % 4);
        mass += sphere_mass(radius[n], 2500);
        material[n++] = 0;
    }
    assert_int_equal(dem_add(r.sim, N, (const double(*)[3])x, NULL, NULL, radius, material, NULL),
                     DEM_OK);
    double before[3] = {0}, worst = 0, scale = 0, mean[3] = {0};
    for (int s = 0; s < 300; s++) {
        const double dt = .005;
        rig_advance(&r, dt, 0);
        dem_report rep = dem_last_report(r.sim);
        double force[2][3];
        for (int w = 0; w < 2; w++) dem_wall_force(r.sim, (size_t)w, force[w]);
        for (int a = 0; a < 3; a++) {
            double given = -(force[0][a] + force[1][a]) * dt;
            scale = fmax(scale, fabs(rep.wall_impulse[a]));
            worst = fmax(worst, fabs(rep.wall_impulse[a] - given));
            worst = fmax(worst, fabs(rep.momentum[a] - before[a] - rep.wall_impulse[a] -
                                     rep.gravity_impulse[a]));
            before[a] = rep.momentum[a];
            if (s >= 200) mean[a] += (force[0][a] + force[1][a]) / 100;
        }
    }
    report("momentum: given and got, over the largest impulse", worst / scale, 0);
    assert_within(worst, 0, 1e-12 * scale);
    for (int a = 0; a < 3; a++) {
        report("force of the pile on its walls, N", mean[a], mass * g[a]);
        assert_close(mean[a], mass * g[a], 1e-3);
    }
    dem_free(r.sim);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shifted_frame),
        cmocka_unit_test(bouncing_table),
        cmocka_unit_test(belt),
        cmocka_unit_test(turntable),
        cmocka_unit_test(carried_round),
        cmocka_unit_test(carried_round_in_a_corner),
        cmocka_unit_test(piston),
        cmocka_unit_test(lever),
        cmocka_unit_test(groove),
        cmocka_unit_test(narrow_slot),
        cmocka_unit_test(weight_of_a_pile),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
