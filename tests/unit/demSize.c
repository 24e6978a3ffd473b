/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Distributions of sizes: laws, quantiles and means against GSL's and closed forms, by number and
 * by mass; samples by the test of Kolmogorov and Smirnov; mixtures; refusals.
 *
 * By number the distance D of n points' distribution from the law has sqrt(n) D < 1.628 in 99 of
 * 100 samples. By mass the points count with the weights w = d^3 and the distribution is F(x) =
 * sum_{d < x} w/sum w. With the increments dB of a Brownian motion of the variance E[w^2; d < x],
 *
 *     F_n(x) - F(x)  ->  (B(x) - F(x) B(infinity))/(sqrt(n) E w)
 *                     =  (bridge of G + (G - F) B(infinity))/(sqrt(n) E w),  G = E[w^2; d < x]/E
 * w^2
 *
 * so that with n_eff = n (E w)^2/E w^2, the sample size of Kish (Survey Sampling (1965) 8.2),
 * sqrt(n_eff) D is below Kolmogorov's 1.628 plus the normal deviate's 2.576 times max |G - F| in
 * 98 of 100 samples or more.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_integration.h>
#include <gsl/gsl_sf_gamma.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "near.h"
#include "size.h"

enum { SAMPLE = 20000 };

static const double TABLE_D[5] = {.0011, .0019, .0032, .0047, .0071};
static const double TABLE_P[5] = {0, .21, .47, .47, 1};

static dem_size law_of(dem_size_kind kind, int by_mass)
{
    dem_size s = {.kind = kind, .by_mass = by_mass, .mean = .0037, .lo = .0013, .hi = .0089};
    s.deviation = kind == DEM_SIZE_LOGNORMAL ? .41 : .0012;
    s.exponent = 2.3;
    s.n = 5;
    s.diameter = TABLE_D;
    s.cumulative = TABLE_P;
    if (kind == DEM_SIZE_TABLE) s.lo = .0015, s.hi = .0066;
    return s;
}

/* ---- closed forms ---------------------------------------------------------------------------- */

static double table_below(double d)
{
    if (d <= TABLE_D[0]) return 0;
    for (int k = 1; k < 5; k++)
        if (d < TABLE_D[k])
            return TABLE_P[k - 1] + (TABLE_P[k] - TABLE_P[k - 1]) * (d - TABLE_D[k - 1]) /
                                        (TABLE_D[k] - TABLE_D[k - 1]);
    return 1;
}

/* The given law, not cut off. */
static double given_below(const dem_size *s, double d)
{
    switch (s->kind) {
    case DEM_SIZE_NORMAL:
        return gsl_cdf_gaussian_P(d - s->mean, s->deviation);
    case DEM_SIZE_LOGNORMAL:
        return gsl_cdf_lognormal_P(d, log(s->mean), s->deviation);
    case DEM_SIZE_ROSIN_RAMMLER:
        return gsl_cdf_weibull_P(d, s->mean, s->exponent);
    case DEM_SIZE_TABLE:
        return table_below(d);
    default:
        return d;
    }
}

static double inverse_cube(double d, void *context)
{
    const dem_size *s = context;
    return exp(-.5 * pow((d - s->mean) / s->deviation, 2)) / (d * d * d);
}

/* An integral of f/d^3, up to a factor. */
static double number_of_mass(const dem_size *s, double d)
{
    const double t = pow(d / s->mean, s->exponent), a = 1 - 3 / s->exponent;
    double sum = 0, error;
    switch (s->kind) {
    case DEM_SIZE_LOGNORMAL: /* Hatch & Choate */
        return gsl_cdf_lognormal_P(d, log(s->mean) - 3 * s->deviation * s->deviation, s->deviation);
    case DEM_SIZE_ROSIN_RAMMLER:
        /* Gamma(a, t) with a < 0 from that of a + 1: GSL's own has 1e-9 there */
        return (pow(t, a) * exp(-t) - gsl_sf_gamma_inc(a + 1, t)) / a;
    case DEM_SIZE_TABLE:
        for (int k = 1; k < 5; k++) {
            const double b = fmin(fmax(d, TABLE_D[k - 1]), TABLE_D[k]);
            sum += (TABLE_P[k] - TABLE_P[k - 1]) / (TABLE_D[k] - TABLE_D[k - 1]) *
                   (pow(TABLE_D[k - 1], -2) - pow(b, -2));
        }
        return sum;
    case DEM_SIZE_NORMAL: {
        gsl_integration_workspace *w = gsl_integration_workspace_alloc(100);
        gsl_function f = {inverse_cube, (void *)s};
        gsl_integration_qag(&f, s->lo, d, 0, 1e-12, 100, GSL_INTEG_GAUSS61, w, &sum, &error);
        gsl_integration_workspace_free(w);
        return sum;
    }
    default:
        return -1 / (d * d);
    }
}

static double cut(double (*below)(const dem_size *, double), const dem_size *s, double d)
{
    const double a = below(s, s->lo), b = below(s, s->hi);
    return (below(s, d) - a) / (b - a);
}

/* ---- laws ------------------------------------------------------------------------------------ */

static size_law made(const dem_size *s)
{
    size_law law;
    char reason[256] = "";
    assert_int_equal(size_init(&law, s, reason, sizeof reason), DEM_OK);
    assert_string_equal(reason, "");
    return law;
}

static void exact(void **unused)
{
    (void)unused;
    for (dem_size_kind kind = DEM_SIZE_UNIFORM; kind <= DEM_SIZE_TABLE; kind++)
        for (int by_mass = 0; by_mass < 2; by_mass++) {
            const dem_size s = law_of(kind, by_mass);
            size_law law = made(&s);
            for (int k = 1; k < 400; k++) {
                const double d = s.lo + (s.hi - s.lo) * k / 400;
                const double u = cut(by_mass ? number_of_mass : given_below, &s, d);
                assert_near(size_below(&law, d), u, 1e-11);
                const double back = size_quantile(&law, u), inside = d > .0032 && d < .0047;
                if (kind != DEM_SIZE_TABLE || !inside) assert_near(back / d, 1, 1e-9);
            }
            assert_near(size_quantile(&law, 0), s.lo, 1e-12 * s.lo);
            assert_near(size_quantile(&law, 1 - 1e-16), s.hi, 1e-9 * s.hi);
            size_free(&law);
        }
}

/* Far tails, narrow peaks, wide spans. */
static void extremes(void **unused)
{
    (void)unused;
    dem_size s = {
        .kind = DEM_SIZE_NORMAL, .mean = .005, .deviation = .0002, .lo = .011, .hi = .0131};
    size_law law = made(&s); /* 30 deviations away: 5e-198 of all */
    const double a = gsl_cdf_gaussian_Q(s.lo - s.mean, s.deviation);
    for (double d = .011001; d < .01102; d += 1e-6) {
        const double u = (a - gsl_cdf_gaussian_Q(d - s.mean, s.deviation)) / a;
        assert_near(size_below(&law, d), u, 1e-9);
    }
    size_free(&law);
    s = (dem_size){.kind = DEM_SIZE_NORMAL, .mean = .005, .deviation = 5e-11, .lo = 1e-5, .hi = .1};
    law = made(&s);
    assert_near(law.cube / pow(.005, 3), 1, 1e-12);
    assert_near(size_quantile(&law, .5), .005, 1e-14);
    size_free(&law);
    s = (dem_size){.kind = DEM_SIZE_UNIFORM, .by_mass = 1, .lo = 1e-6, .hi = 1e-2};
    law = made(&s);
    assert_near(size_below(&law, 2e-6), (1e12 - 2.5e11) / (1e12 - 1e4), 1e-11);
    /* mean of d^3: mass over number */
    assert_near(law.cube / (2 * (1e-2 - 1e-6) / (1e12 - 1e4)), 1, 1e-11);
    size_free(&law);
    s = (dem_size){
        .kind = DEM_SIZE_ROSIN_RAMMLER, .mean = .003, .exponent = .31, .lo = 1e-9, .hi = .1};
    law = made(&s);
    assert_near(size_below(&law, 1e-5), cut(given_below, &s, 1e-5), 1e-11);
    size_free(&law);
}

static void means(void **unused)
{
    (void)unused;
    /* <d^3> of a log-normal law; of the number law that belongs to one by mass. Its cut takes 1e-9
     * from each. */
    for (int by_mass = 0; by_mass < 2; by_mass++) {
        dem_size s = law_of(DEM_SIZE_LOGNORMAL, by_mass);
        s.lo = s.hi = 0;
        size_law law = made(&s);
        const double median = s.mean * exp(by_mass ? -3 * .41 * .41 : 0);
        assert_near(law.cube / (pow(median, 3) * exp(4.5 * .41 * .41)), 1, 1e-8);
        size_free(&law);
    }
    dem_size s = law_of(DEM_SIZE_UNIFORM, 0);
    size_law law = made(&s);
    const double b2 = s.hi * s.hi, a2 = s.lo * s.lo;
    assert_near(law.cube / ((b2 * b2 - a2 * a2) / (4 * (s.hi - s.lo))), 1, 1e-12);
    size_free(&law);
    s = (dem_size){.kind = DEM_SIZE_EQUAL, .mean = .0043};
    law = made(&s);
    assert_near(law.cube / pow(.0043, 3), 1, 1e-15);
    assert_true(size_quantile(&law, .37) == .0043);
    size_free(&law);
}

/* ---- samples --------------------------------------------------------------------------------- */

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void draw(const dem_size *s, unsigned long seed, double *d)
{
    size_law law = made(s);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, seed);
    for (int i = 0; i < SAMPLE; i++) d[i] = size_quantile(&law, gsl_rng_uniform(rng));
    gsl_rng_free(rng);
    size_free(&law);
    qsort(d, SAMPLE, sizeof *d, ascending);
}

/* Distance of the sample from the given law times the root of its effective size, over its bound;
 * weights 1, or d^3 by mass. */
static double distance(const dem_size *s, const double *d, int by_mass)
{
    double sum = 0, squares = 0, below = 0, square = 0, most = 0, skew = 0;
    for (int i = 0; i < SAMPLE; i++) {
        const double w = by_mass ? pow(d[i], 3) : 1;
        sum += w;
        squares += w * w;
    }
    for (int i = 0; i < SAMPLE; i++) {
        const double w = by_mass ? pow(d[i], 3) : 1, law = cut(given_below, s, d[i]);
        most = fmax(most, fabs(below / sum - law));
        below += w;
        square += w * w;
        most = fmax(most, fabs(below / sum - law));
        skew = fmax(skew, fabs(square / squares - law));
    }
    return most * sqrt(sum * sum / squares) / (1.628 + (by_mass ? 2.576 * skew : 0));
}

static void samples(void **unused)
{
    (void)unused;
    static double d[SAMPLE];
    for (dem_size_kind kind = DEM_SIZE_UNIFORM; kind <= DEM_SIZE_TABLE; kind++)
        for (int by_mass = 0; by_mass < 2; by_mass++) {
            dem_size s = law_of(kind, by_mass);
            draw(&s, 4711 + (unsigned long)kind, d);
            const double good = distance(&s, d, by_mass);
            /* a sample of the other law is found out */
            dem_size other = s;
            other.by_mass = !by_mass;
            draw(&other, 4711, d);
            const double wrong = distance(&s, d, by_mass);
            print_message("law %d %s: distance %.2f of the bound, of the other law %.1f\n", kind,
                          by_mass ? "by mass  " : "by number", good, wrong);
            assert_true(good < 1);
            assert_true(wrong > 5);
        }
    /* and so is one whose sizes are 5 % too large */
    dem_size s = law_of(DEM_SIZE_ROSIN_RAMMLER, 1), wide = s;
    wide.mean *= 1.05;
    draw(&wide, 4711, d);
    assert_true(distance(&s, d, 1) > 1);
}

/* ---- mixtures -------------------------------------------------------------------------------- */

static void mixtures(void **unused)
{
    (void)unused;
    const dem_material material[2] = {{.density = 2470}, {.density = 7830}};
    const dem_species species[3] = {{1, law_of(DEM_SIZE_LOGNORMAL, 0), 2.5},
                                    {0, {.kind = DEM_SIZE_EQUAL, .mean = .0043}, 1},
                                    {0, law_of(DEM_SIZE_ROSIN_RAMMLER, 1), .7}};
    for (int by_mass = 0; by_mass < 2; by_mass++) {
        mixture m;
        char reason[256];
        assert_int_equal(mixture_init(&m, 3, species, by_mass, 2, material, reason, sizeof reason),
                         DEM_OK);
        gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
        mixture_start(&m, rng);
        double mass[2] = {0}, equal = 0, number[2] = {0}, all = 0;
        for (int i = 0; i < 100000; i++) {
            double d;
            int of;
            mixture_draw(&m, rng, &d, &of);
            const double one = M_PI / 6 * d * d * d * material[of].density;
            mass[of] += one;
            number[of]++;
            all += one;
            if (d == .0043) equal += by_mass ? one : 1;
            assert_true(d >= m.smallest && d <= m.largest);
            /* by number, shares hold at any moment within a few */
            if (!by_mass) {
                const double part = 2.5 / 4.2 * (i + 1);
                assert_near(number[1], part, 4);
            }
        }
        const double *amount = by_mass ? mass : number;
        const double whole = amount[0] + amount[1];
        assert_near(amount[1] / whole, 2.5 / 4.2, by_mass ? .02 : 1e-4);
        assert_near(equal / whole, 1 / 4.2, by_mass ? .02 : 1e-4);
        assert_near(all / 100000 / m.mass, 1, .01);
        gsl_rng_free(rng);
        mixture_free(&m);
    }
}

/* ---- refusals -------------------------------------------------------------------------------- */

static void refused(const dem_size *s, const char *text)
{
    size_law law;
    char reason[256] = "";
    assert_int_equal(size_init(&law, s, reason, sizeof reason), DEM_BAD_ARGUMENT);
    if (!strstr(reason, text)) fail_msg("'%s' not in '%s'", text, reason);
}

static void refusals(void **unused)
{
    (void)unused;
    dem_size s = {.kind = DEM_SIZE_EQUAL};
    refused(&s, "diameter 0 m is not positive");
    s = law_of(DEM_SIZE_NORMAL, 0);
    s.deviation = 0;
    refused(&s, "deviation 0");
    s = law_of(DEM_SIZE_NORMAL, 0);
    s.lo = s.hi = 0;
    refused(&s, "needs a smallest and a largest diameter");
    s.lo = .02, s.hi = .01;
    refused(&s, "0 < smallest < largest");
    s.lo = -.02;
    refused(&s, "0 < smallest < largest");
    s = law_of(DEM_SIZE_ROSIN_RAMMLER, 1);
    s.exponent = -1;
    refused(&s, "exponent -1");
    s = law_of(DEM_SIZE_TABLE, 1);
    s.n = 1;
    refused(&s, "two rows or more");
    s.n = 4;
    refused(&s, "from 0 to 1, found 0 to 0.47");
    s = law_of(DEM_SIZE_TABLE, 0);
    s.lo = .0081, s.hi = .009;
    refused(&s, "nothing of the distribution lies between 0.0081 and 0.009 m");
    const double twice[5] = {.0011, .0019, .0019, .0047, .0071}, falls[5] = {0, .3, .2, .5, 1};
    s = law_of(DEM_SIZE_TABLE, 0);
    s.diameter = twice;
    refused(&s, "row 3 of the table of sizes must be above 0.0019");
    s = law_of(DEM_SIZE_TABLE, 0);
    s.cumulative = falls;
    refused(&s, "must not fall");
    s = law_of((dem_size_kind)17, 0);
    refused(&s, "kind 17");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact),   cmocka_unit_test(extremes), cmocka_unit_test(means),
        cmocka_unit_test(samples), cmocka_unit_test(mixtures), cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
