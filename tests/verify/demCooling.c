/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demCooling.c - homogeneous cooling of a granular gas: Haff's law.
 *
 * Smooth inelastic spheres without gravity in a periodic box, T = <v^2>/3. Each sphere has
 * w = 4 n d^2 chi sqrt(pi T) collisions per unit time (Enskog), a collision takes (1 - e^2) of the
 * energy along its normal:
 *
 *     dT/dt = -(1 - e^2)/3 w T,   sqrt(T0/T) = 1 + (1 - e^2)/6 w0 t
 *
 * with chi = (1 - phi/2)/(1 - phi)^3 (Carnahan & Starling): for phi = .15, e = .9, d = 1 and T0 = 9
 * the slope is .29063. The law is one for hard spheres in equilibrium, so contacts are made short
 * (a fiftieth of the time between two) and the same spheres first collide without loss until their
 * positions and velocities are those of a gas, which is tested by the fourth moment of v, 15 T^2.
 *
 * P. K. Haff, J. Fluid Mech. 134 (1983) 401, doi:10.1017/S0022112083003419; N. F. Carnahan & K. E.
 * Starling, J. Chem. Phys. 51 (1969) 635, doi:10.1063/1.1672048; of inelastic hard spheres and
 * where the law ends: N. V. Brilliantov & T. Poeschel, Kinetic Theory of Granular Gases (2004),
 * doi:10.1093/acprof:oso/9780198530381.001.0001.
 */
#include "demRig.h"

#include <stdlib.h>

static const double solids = .15, side = 30, T0 = 9, slope = .29063;

typedef struct gas {
    size_t n;
    double (*x)[3], (*v)[3];
} gas;

/* Unit diameter and mass. A contact at the speed 6 takes 2e-3 with either law. */
static void gas_init(rig *r, dem_law law, double e)
{
    rig_init(r, law, .5 * side);
    for (int a = 0; a < 3; a++) r->param.periodic[a] = 1;
    const double time = 2e-3, speed = 6, overlap = time * speed / 2.943275;
    const double E_star = 1.25 * .5 * speed * speed / pow(overlap, 2.5) / (4. / 3 * sqrt(.25));
    rig_hertz(r, E_star * 2 * (1 - .3 * .3), .3, 6 / M_PI);
    rig_pairs(r, e, 0, .5 * pow(M_PI / time, 2), 1);
    r->param.steps_per_period = 40;
    r->param.skin = .4;
}

static double moment(const gas *g, int power)
{
    double sum = 0;
    for (size_t i = 0; i < g->n; i++) {
        const double *v = g->v[i], v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        sum += power == 2 ? v2 : v2 * v2;
    }
    return sum / (double)g->n;
}

static void gas_from(gas *g, const rig *r)
{
    dem_view p = dem_particles(r->sim);
    g->n = p.n;
    g->x = malloc(p.n * sizeof *g->x);
    g->v = malloc(p.n * sizeof *g->v);
    assert_non_null(g->x);
    assert_non_null(g->v);
    memcpy(g->x, p.x, p.n * sizeof *g->x);
    memcpy(g->v, p.v, p.n * sizeof *g->v);
}

static void gas_free(gas *g)
{
    free(g->x);
    free(g->v);
}

/* The mean taken off, then all scaled to the temperature T0. */
static void gas_at_rest(gas *g)
{
    double mean[3] = {0, 0, 0};
    for (size_t i = 0; i < g->n; i++)
        for (int a = 0; a < 3; a++) mean[a] += g->v[i][a] / (double)g->n;
    for (size_t i = 0; i < g->n; i++)
        for (int a = 0; a < 3; a++) g->v[i][a] -= mean[a];
    const double scale = sqrt(3 * T0 / moment(g, 2));
    for (size_t i = 0; i < g->n; i++)
        for (int a = 0; a < 3; a++) g->v[i][a] *= scale;
}

static void gas_add(rig *r, const gas *g)
{
    double *radius = malloc(g->n * sizeof *radius);
    int *material = calloc(g->n, sizeof *material);
    assert_non_null(radius);
    assert_non_null(material);
    for (size_t i = 0; i < g->n; i++) radius[i] = .5;
    if (dem_add(r->sim, g->n, (const double(*)[3])g->x, (const double(*)[3])g->v, NULL, radius,
                material, NULL))
        fail_msg("dem_add: %s", dem_message(r->sim));
    free(radius);
    free(material);
}

static double temperature(const rig *r)
{
    dem_report p = dem_last_report(r->sim);
    return 2 * p.kinetic_energy / (double)p.particles / 3;
}

/* Random places and velocities of equal size, in random directions, until they are a gas. */
static void equilibrate(gas *g, dem_law law)
{
    rig r;
    gas_init(&r, law, 1);
    const double half = .5 * side;
    dem_insertion random = {.name = "gas",
                            .kind = DEM_INSERT_RANDOM,
                            .region = dem_sdf_box((const double[3]){-half, -half, -half},
                                                  (const double[3]){half, half, half}, 1),
                            .lo = {-half, -half, -half},
                            .hi = {half, half, half},
                            .number = lround(solids * side * side * side / (M_PI / 6)),
                            .diameter = 1,
                            .velocity_spread = sqrt(T0),
                            .seed = 2385};
    r.param.n_insertion = 1;
    r.param.insertion = &random;
    rig_start(&r);
    gas_from(g, &r);
    dem_free(r.sim);

    for (size_t i = 0; i < g->n; i++) {
        double *v = g->v[i], size = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int a = 0; a < 3; a++) v[a] /= size;
    }
    gas_at_rest(g);
    double fourth = moment(g, 4) / (15 * T0 * T0);
    gas_init(&r, law, 1);
    rig_start(&r);
    gas_add(&r, g);
    gas_free(g);
    rig_advance(&r, .8, 0);
    report("    temperature after some seven elastic collisions each", temperature(&r), T0);
    /* Some of the energy is in springs: the share of the time spent in contact. */
    assert_close(temperature(&r), T0, 3e-2);
    gas_from(g, &r);
    dem_free(r.sim);
    gas_at_rest(g);
    print_message("    <v^4>/15 T^2 at first %.4f\n", fourth);
    report("    <v^4>/15 T^2 then", moment(g, 4) / (15 * T0 * T0), 1);
    assert_within(fourth, .6, .01);
    /* Of n normal vectors it scatters by sqrt((63/15 - 1)/n), 2 %. */
    assert_within(moment(g, 4) / (15 * T0 * T0), 1, .06);
}

static void cooling(dem_law law)
{
    rig r;
    gas g;
    print_message("Cooling gas, %s\n", law == DEM_LINEAR ? "linear" : "Hertz");
    equilibrate(&g, law);
    gas_init(&r, law, .9);
    rig_start(&r);
    gas_add(&r, &g);
    double worst = 0, t = 0, found = 1, momentum = 0;
    for (int k = 1; k <= 12; k++) {
        rig_advance(&r, .5, 0);
        t = dem_time(r.sim);
        found = sqrt(T0 / temperature(&r));
        double off = found / (1 + slope * t) - 1;
        if (fabs(off) > fabs(worst)) worst = off;
        dem_report p = dem_last_report(r.sim);
        for (int a = 0; a < 3; a++)
            momentum = fmax(momentum, fabs(p.momentum[a]) / ((double)p.particles * sqrt(T0)));
    }
    report("    sqrt(T0/T) at 6", found, 1 + slope * t);
    report("    slope up to there", (found - 1) / t, slope);
    report("    furthest from the law on the way", 1 + worst, 1);
    report("    largest momentum over mass and thermal speed", momentum, 0);
    assert_close((found - 1) / t, slope, .1);
    assert_within(worst, 0, .1);
    assert_within(momentum, 0, 1e-12);
    dem_free(r.sim);
    gas_free(&g);
}

static void haff_linear(void **state)
{
    (void)state;
    cooling(DEM_LINEAR);
}

static void haff_hertz(void **state)
{
    (void)state;
    cooling(DEM_HERTZ);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(haff_linear), cmocka_unit_test(haff_hertz)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
