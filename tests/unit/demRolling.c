/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demRolling.c - rolling resistance: of constant torque and elastic-plastic.
 *
 * A sphere that rolls on a plane without slipping has the inertia 7/5 m R^2 about the point of
 * contact. With the torque mu_r R m g cos a against it, on a slope of the angle a,
 *
 *     R dw/dt = (g sin a - mu_r g cos a)/1.4          flat: dw/dt = -mu_r g/(1.4 R)
 *
 * and it can rest where tan a <= mu_r. Below the limit the elastic-plastic law is an oscillator
 * with the stiffness k_r = 2.25 k (mu_r R)^2, that inertia, and eta_r of critical damping.
 */
#include "demRig.h"

static const double g = 9.81;

typedef struct slope {
    dem_law law;
    dem_rolling rolling;
    double R, angle, friction, damping, density, stiffness;
} slope;

/* So that all sink in by the same part of their radius. */
static double modulus(slope s)
{
    return 2e10 * s.R;
}

static void place(rig *r, slope s)
{
    rig_init(r, s.law, 4000 * s.R);
    rig_hertz(r, modulus(s), .27, s.density);
    rig_pairs(r, .6, .8, s.stiffness, .9);
    for (int p = 0; p < 4; p++) {
        r->pair[p].rolling_friction = s.friction;
        r->pair[p].rolling_damping = s.damping;
    }
    r->param.rolling = s.rolling;
    r->param.gravity[0] = g * sin(s.angle);
    r->param.gravity[2] = -g * cos(s.angle);
    rig_floor(r);
    rig_start(r);
}

/* On the floor with the overlap of rest, rolling at the speed v. */
static void roll(rig *r, slope s, double v)
{
    double m = sphere_mass(s.R, s.density), K = 4. / 3 * modulus(s) / (1 - .27 * .27) * sqrt(s.R);
    double weight = m * g * cos(s.angle);
    double overlap = s.law == DEM_LINEAR ? weight / s.stiffness : pow(weight / K, 2. / 3);
    double height = s.R - overlap;
    const double x[1][3] = {{0, 0, height}}, u[1][3] = {{v, 0, 0}}, w[1][3] = {{0, v / height, 0}};
    const int material = 0;
    assert_int_equal(dem_add(r->sim, 1, x, u, w, &s.R, &material, NULL), DEM_OK);
}

static double spin(const rig *r)
{
    return dem_particles(r->sim).omega[0][1];
}

static void decay(void **state)
{
    (void)state;
    const double radius[] = {10e-6, 2.6e-3, .5}, friction[] = {.2, .2, .07};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int kind = DEM_ROLLING_CONSTANT; kind <= DEM_ROLLING_EPSD; kind++)
            for (int k = 0; k < 3; k++) {
                double R = radius[k], mu = friction[k], m = sphere_mass(R, 2385);
                slope s = {.law = (dem_law)law,
                           .rolling = (dem_rolling)kind,
                           .R = R,
                           .friction = mu,
                           .damping = .3,
                           .density = 2385,
                           .stiffness = 2e4 * m * g / R};
                rig r;
                place(&r, s);
                double v = 1.3 * sqrt(g * R), slowing = mu * g / 1.4;
                roll(&r, s, v);
                rig_advance(&r, .1 * v / slowing, 0);
                double begin = spin(&r);
                rig_advance(&r, .6 * v / slowing, 0);
                double slope = (begin - spin(&r)) / (.6 * v / slowing);
                print_message("%s, %s, R %g m, mu_r %g: ", law ? "Hertz" : "linear",
                              kind == DEM_ROLLING_EPSD ? "epsd" : "constant", R, mu);
                report("spin lost, rad/s2", slope, mu * g / (1.4 * R));
                assert_close(slope, mu * g / (1.4 * R), 5e-3);
                if (k == 1) assert_close(slope, 539.01, 5e-3); /* verification.md */
                /* Then it stays where it is. */
                rig_advance(&r, .4 * v / slowing, 0);
                assert_within(spin(&r) * R, 0, 2e-3 * v);
                dem_free(r.sim);
            }
}

/* Below atan mu_r it rests, above it rolls with the acceleration of the closed form. */
static void threshold(void **state)
{
    (void)state;
    const double R = 1.7e-3, mu = .31, share[] = {.5, .97, 1.03, 1.4};
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++)
        for (int kind = DEM_ROLLING_CONSTANT; kind <= DEM_ROLLING_EPSD; kind++)
            for (int k = 0; k < 4; k++) {
                double m = sphere_mass(R, 1730);
                slope s = {.law = (dem_law)law,
                           .rolling = (dem_rolling)kind,
                           .R = R,
                           .angle = atan(share[k] * mu),
                           .friction = mu,
                           .damping = .4,
                           .density = 1730,
                           .stiffness = 2e4 * m * g / R};
                rig r;
                place(&r, s);
                roll(&r, s, 0);
                rig_advance(&r, .1, 0);
                double x0 = dem_particles(r.sim).x[0][0], w0 = spin(&r);
                rig_advance(&r, .1, 0);
                double x1 = dem_particles(r.sim).x[0][0], w1 = spin(&r);
                double steps = dem_last_report(r.sim).step, free = g * sin(s.angle);
                double down = (free - mu * g * cos(s.angle)) / 1.4;
                if (k > 1) {
                    report("Acceleration down the slope, m/s2", (w1 - w0) * R / .1, down);
                    assert_close((w1 - w0) * R / .1, down, 1e-2);
                } else if (kind == DEM_ROLLING_EPSD) {
                    print_message("at rest, moves by %.1e R in .1 s\n", (x1 - x0) / R);
                    assert_within(x1 - x0, 0, 1e-9 * R);
                } else {
                    /* I w/(6 dt) carries the weight: it creeps. */
                    report("Creep, rad/s", w1, 15 * free * steps / R);
                    assert_close(w1, 15 * free * steps / R, 2e-2);
                }
                dem_free(r.sim);
            }
}

/* Small oscillations: mu_r so small that k_r is far below k_t R^2, thus no slip in the springs. */
static void oscillation(void **state)
{
    (void)state;
    const double R = 3.1e-3, mu = .02, rho = 2385, m = sphere_mass(R, rho), damping[] = {0, .15};
    for (int k = 0; k < 2; k++) {
        slope s = {DEM_LINEAR, DEM_ROLLING_EPSD, R, 0, mu, damping[k], rho, 1e5 * m * g / R};
        rig r;
        place(&r, s);
        /* amplitude: a third of what the limit allows */
        double kr = 2.25 * s.stiffness * mu * mu * R * R, own = sqrt(kr / (1.4 * m * R * R));
        double most = mu * R * m * g / kr, now = own * sqrt(1 - damping[k] * damping[k]);
        roll(&r, s, .3 * most * own * R);
        double dt = 2 * M_PI / own / 4000, back = 0, forth = 0, first = 0, crossing = 0;
        double before = spin(&r);
        int crossings = 0;
        for (int n = 0; n < 24000 && crossings < 9; n++) {
            rig_advance(&r, dt, 0);
            double w = spin(&r);
            if (before * w <= 0 && before != 0) {
                crossing = dem_time(r.sim) - dt * w / (w - before);
                if (!crossings++) first = crossing;
            }
            if (crossings == 1) back = fmax(back, -w); /* largest spins */
            if (crossings == 2) forth = fmax(forth, w);
            before = w;
        }
        assert_int_equal(crossings, 9);
        report("Angular frequency of rocking, rad/s", 8 * M_PI / (crossing - first), now);
        assert_close(8 * M_PI / (crossing - first), now, 5e-3);
        double left = exp(-M_PI * damping[k] / sqrt(1 - damping[k] * damping[k]));
        report("Largest spin over that half a period before", forth / back, left);
        assert_close(forth / back, left, 1e-2);
        dem_free(r.sim);
    }
}

/* Thrown, it oscillates about rest and stops. */
static void comes_to_rest(void **state)
{
    (void)state;
    const double R = 2.2e-3, m = sphere_mass(R, 2500);
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        slope s = {(dem_law)law, DEM_ROLLING_EPSD, R, 0, .25, .3, 2500, 2e4 * m * g / R};
        rig r;
        place(&r, s);
        roll(&r, s, .2);
        int turns = 0;
        double before = spin(&r);
        for (int n = 0; n < 4000; n++) {
            rig_advance(&r, 1e-4, 0);
            turns += before * spin(&r) < 0;
            before = spin(&r);
        }
        double w = fabs(spin(&r)) * R / .2;
        print_message("turned %d times, spin left over spin at first %.1e\n", turns, w);
        assert_true(turns > 0 && w < 1e-8);
        dem_free(r.sim);
    }
}

/* ---- two spheres ----------------------------------------------------------------------------- */

typedef struct pressed {
    double R[2], m[2], I[2];
    double E, kn, radius; /* elastic force, its secant stiffness, R_eff */
    double w[2][3], n[3]; /* spins; from the first to the second */
} pressed;

/* Unequal spheres of two materials overlap, nearly at rest but for their spins. */
static pressed press(rig *r, dem_law law, dem_rolling rolling, double friction, double damping,
                     double faster)
{
    pressed p = {{3e-3, 1.2e-3}, {0}, {0}, 0, 0, 0, {{3, -1, 2}, {-1.5, 4, .5}}, {.6, .48, .64}};
    const double stiffness = 4e4, overlap = 2e-3 * p.R[1], density[2] = {2500, 7800};
    rig_init(r, law, 20 * p.R[0]);
    rig_hertz(r, 3e9, .27, density[0]);
    r->material[1].youngs_modulus = 8e9;
    r->material[1].density = density[1];
    rig_pairs(r, 1, 0, stiffness, 1);
    for (int k = 0; k < 4; k++) {
        r->pair[k].rolling_friction = friction;
        r->pair[k].rolling_damping = damping;
    }
    r->param.rolling = rolling;
    rig_start(r);
    double x[2][3] = {{0}, {0}};
    const int material[2] = {0, 1};
    for (int a = 0; a < 6; a++) p.w[a / 3][a % 3] *= faster;
    for (int a = 0; a < 3; a++) x[1][a] = (p.R[0] + p.R[1] - overlap) * p.n[a];
    for (int k = 0; k < 2; k++) {
        p.m[k] = sphere_mass(p.R[k], density[k]);
        p.I[k] = .4 * p.m[k] * p.R[k] * p.R[k];
    }
    assert_int_equal(dem_add(r->sim, 2, (const double(*)[3])x, NULL, (const double(*)[3])p.w, p.R,
                             material, NULL),
                     DEM_OK);
    p.radius = 1 / (1 / p.R[0] + 1 / p.R[1]);
    const double modulus = 1 / ((1 - .27 * .27) * (1 / 3e9 + 1 / 8e9));
    p.kn = law == DEM_LINEAR ? stiffness : 4. / 3 * modulus * sqrt(p.radius * overlap);
    p.E = p.kn * overlap;
    return p;
}

/* Difference of the spins without its component along n; its length. */
static double rolling_spin(const pressed *p, double w[3])
{
    double along = 0, square = 0;
    for (int a = 0; a < 3; a++) along += (p->w[0][a] - p->w[1][a]) * p->n[a];
    for (int a = 0; a < 3; a++) {
        w[a] = p->w[0][a] - p->w[1][a] - along * p->n[a];
        square += w[a] * w[a];
    }
    return sqrt(square);
}

/* Both get the same torque per relative spin, `per`, opposite to it, in the time dt: largest error
 * of a component, relative. */
static double torque_error(rig *r, const pressed *p, const double w[3], double per, double dt)
{
    const dem_view v = dem_particles(r->sim);
    double most = 0;
    for (size_t i = 0; i < 2; i++) {
        const int k = (int)v.id[i];
        for (int a = 0; a < 3; a++) {
            const double torque = (v.omega[i][a] - p->w[k][a]) * p->I[k] / dt;
            const double error = fabs(torque / ((k ? 1 : -1) * per * w[a]) - 1);
            if (!(error <= most)) most = error;
        }
    }
    return most;
}

static void assert_torque(rig *r, const pressed *p, const double w[3], double per, double dt,
                          const char *what)
{
    const double error = torque_error(r, p, w, per, dt);
    report(what, error, 0);
    assert_true(error < 1e-4);
}

/* Steps so short that overlap and spins stay: the torque itself, its three parts apart. */
static void pair(void **state)
{
    (void)state;
    const double mu = .13, eta = .37;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        rig r;
        double w[3];
        pressed p = press(&r, (dem_law)law, DEM_ROLLING_CONSTANT, mu, 0, 1);
        const double size = rolling_spin(&p, w), I = 1 / (1 / p.I[0] + 1 / p.I[1]);
        double dt = 1e-3 * I * size / (mu * p.radius * p.E);
        dt = fmin(dt, 1e-4 * sqrt(p.m[1] / p.kn));
        rig_advance(&r, dt, 1);
        assert_torque(&r, &p, w, mu * p.radius * p.E / size, dt,
                      "constant torque between spheres, error");
        dem_free(r.sim);

        /* The spring after n steps has grown to k_r w n dt: n (n + 1)/2 of them have acted. */
        const int n = 100;
        const double kr = 2.25 * p.kn * mu * mu * p.radius * p.radius;
        p = press(&r, (dem_law)law, DEM_ROLLING_EPSD, mu, 0, 1);
        dt = 1e-5 * fmin(sqrt(p.m[1] / p.kn), sqrt(I / kr));
        rig_advance(&r, n * dt, n);
        assert_torque(&r, &p, w, kr * .5 * (n + 1) * dt, n * dt, "spring between spheres, error");
        dem_free(r.sim);

        /* Inertia about the point of contact: 1/I_r = sum 1/(I + m R^2). */
        const double Ir =
            1 / (1 / (p.I[0] + p.m[0] * p.R[0] * p.R[0]) + 1 / (p.I[1] + p.m[1] * p.R[1] * p.R[1]));
        p = press(&r, (dem_law)law, DEM_ROLLING_EPSD, mu, eta, 1);
        dt *= .1;
        rig_advance(&r, dt, 1);
        assert_torque(&r, &p, w, 2 * eta * sqrt(Ir * kr) + kr * dt, dt,
                      "dashpot between spheres, error");
        dem_free(r.sim);

        /* Its limit, which spins so fast reach in one step. */
        p = press(&r, (dem_law)law, DEM_ROLLING_EPSD, mu, eta, 5e4);
        dt = 1e-2 * sqrt(p.m[1] / p.kn);
        const double fast = rolling_spin(&p, w), limit = mu * p.radius * p.E;
        assert_true(kr * fast * dt > 1.5 * limit);
        rig_advance(&r, dt, 1);
        assert_torque(&r, &p, w, limit / fast, dt, "limit between spheres, error");
        dem_free(r.sim);
    }
}

/* ---- many ------------------------------------------------------------------------------------ */

enum { MANY = 120 };

/* A heap of spheres of many sizes that falls into a box. */
static void fill(rig *r, dem_law law, dem_rolling rolling, double skin)
{
    const double R = 1.5e-3;
    rig_init(r, law, 12 * R);
    rig_hertz(r, 2e7, .3, 2500);
    r->material[1].youngs_modulus = 3e7;
    rig_pairs(r, .5, .4, 3e3, .8);
    for (int p = 0; p < 4; p++) {
        r->pair[p].rolling_friction = .2;
        r->pair[p].rolling_damping = .3;
    }
    r->param.rolling = rolling;
    r->param.skin = skin;
    r->param.gravity[2] = -g;
    r->wall[0].shape = dem_sdf_box((const double[3]){-4 * R, -4 * R, 0},
                                   (const double[3]){4 * R, 4 * R, 20 * R}, 1);
    r->wall[0].material = 1;
    r->param.n_wall = 1;
    rig_start(r);
    double x[MANY][3], radius[MANY];
    int material[MANY];
    for (int i = 0; i < MANY; i++) {
        int at[3] = {i % 5, i / 5 % 5, i / 25};
        for (int a = 0; a < 3; a++)
            x[i][a] = 1.5 * R * (a < 2 ? at[a] - 2 : at[a] + .5) + .05 * R * sin(17. * i + 5. * a);
        radius[i] = R * (.62 + .06 * sin(7. * i));
        material[i] = i % 2;
    }
    dem_status status =
        dem_add(r->sim, MANY, (const double(*)[3])x, NULL, NULL, radius, material, NULL);
    if (status) fail_msg("%s", dem_message(r->sim));
}

/* The list is made in every few steps or hardly ever: springs go along, whatever the order. */
static void carried_over(void **state)
{
    (void)state;
    for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
        static double where[2][MANY][6];
        int64_t builds[2];
        for (int k = 0; k < 2; k++) {
            rig r;
            fill(&r, (dem_law)law, DEM_ROLLING_EPSD, k ? .9 : .004);
            rig_advance(&r, 3e-2, 3000);
            dem_view p = dem_particles(r.sim);
            for (size_t i = 0; i < p.n; i++)
                for (int a = 0; a < 3; a++) {
                    where[k][p.id[i]][a] = p.x[i][a];
                    where[k][p.id[i]][3 + a] = p.omega[i][a];
                }
            builds[k] = dem_last_report(r.sim).rebuilds;
            assert_true(dem_last_report(r.sim).contacts > 20);
            dem_free(r.sim);
        }
        double most = 0, turn = 0;
        for (int i = 0; i < MANY; i++)
            for (int a = 0; a < 3; a++) {
                most = fmax(most, fabs(where[0][i][a] - where[1][i][a]));
                turn = fmax(turn, fabs(where[0][i][3 + a] - where[1][i][3 + a]));
            }
        print_message("lists built %d and %d times: places differ by %.1e m, spins by %.1e rad/s\n",
                      (int)builds[0], (int)builds[1], most, turn);
        assert_true(builds[0] > 10 * builds[1] && most < 1e-12 && turn < 1e-7);
    }
}

/* A block of spheres, pressed by the box it is in, each of which touches six others: their spins
 * die out. With a torque that could end the spin of a pair in one step they would not. */
static void quiet(void **state)
{
    (void)state;
    enum { SIDE = 4, BLOCK = SIDE * SIDE * SIDE };
    const double R = 1.5e-3, half = .5 * SIDE * 1.98 * R;
    for (int kind = DEM_ROLLING_CONSTANT; kind <= DEM_ROLLING_EPSD; kind++)
        for (int law = DEM_LINEAR; law <= DEM_HERTZ; law++) {
            rig r;
            rig_init(&r, (dem_law)law, 12 * R);
            rig_hertz(&r, 2e7, .3, 2500);
            rig_pairs(&r, .5, .4, 3e3, .8);
            for (int p = 0; p < 4; p++) {
                r.pair[p].rolling_friction = .2;
                r.pair[p].rolling_damping = .3;
            }
            r.param.rolling = (dem_rolling)kind;
            /* With six sticking contacts the linear law's tangential dashpots need it: of the mode
             * in which all spins are alike, w^2 + 2 gamma is 5.4 at 20 and must be below 4. */
            r.param.steps_per_period = 40;
            r.wall[0].shape = dem_sdf_box((const double[3]){-half, -half, -half},
                                          (const double[3]){half, half, half}, 1);
            r.wall[0].material = 1;
            r.param.n_wall = 1;
            rig_start(&r);
            double x[BLOCK][3], w[BLOCK][3], radius[BLOCK];
            int material[BLOCK] = {0};
            for (int i = 0; i < BLOCK; i++) {
                int at[3] = {i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE};
                for (int a = 0; a < 3; a++) {
                    x[i][a] = 1.98 * R * (at[a] + .5) - half;
                    w[i][a] = 20 * sin(17. * i + 5. * a);
                }
                radius[i] = R;
            }
            assert_int_equal(dem_add(r.sim, BLOCK, (const double(*)[3])x, NULL,
                                     (const double(*)[3])w, radius, material, NULL),
                             DEM_OK);
            double begin = 0, mass = sphere_mass(R, 2500);
            for (int i = 0; i < BLOCK; i++)
                for (int a = 0; a < 3; a++) begin += .2 * mass * R * R * w[i][a] * w[i][a];
            rig_advance(&r, .3, 0);
            double left = dem_last_report(r.sim).rotational_energy / begin;
            print_message("%s, %s: energy of spins left %.1e\n",
                          kind == DEM_ROLLING_EPSD ? "epsd" : "constant", law ? "Hertz" : "linear",
                          left);
            assert_true(left < 1e-12);
            dem_free(r.sim);
        }
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(decay),       cmocka_unit_test(threshold),
        cmocka_unit_test(oscillation), cmocka_unit_test(comes_to_rest),
        cmocka_unit_test(pair),        cmocka_unit_test(carried_over),
        cmocka_unit_test(quiet)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
