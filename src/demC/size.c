/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * size.c - distributions of diameters, and mixtures of species that have one each.
 *
 * A distribution is given by its density f(d), of the number of particles or of their mass. Spheres
 * of one density have a mass that goes with d^3, so the number density is
 *
 *     g(d) ~ f(d) by number,    g(d) ~ f(d)/d^3 by mass,    cut off at lo and hi
 *
 * and it is g that particles are drawn from: d = G^-1(u), u uniform in [0, 1), one number of the
 * generator for a particle. Nothing is rejected and no tail is lost, however little of f lies
 * between lo and hi. The mean mass of a particle follows from the mean of d^3 over g.
 *
 * G is found once: [ln lo, ln hi] is divided into intervals, halved until Gauss's rule of eight
 * points and the same on both halves agree to 1e-12 of the whole, for the number and for the mass.
 * Within an interval the same rule gives G to any x, and Newton's method, kept between bounds, its
 * inverse. The logarithm of the density is computed and its largest value taken off, so that the
 * far tail of a distribution does not underflow.
 *
 * Log-normal: without lo and hi it is cut off at six deviations of ln d below the median number and
 * above the median mass: a share of 1e-9 each. The two medians differ by the factor exp(3 s^2)
 * (Hatch & Choate, J. Franklin Inst. 207 (1929) 369, doi:10.1016/S0016-0032(29)91451-4).
 * Rosin-Rammler: Rosin & Rammler, J. Inst. Fuel 7 (1933) 29; the mass below d is
 * 1 - exp(-(d/mean)^exponent).
 *
 * Species take turns by the multiples of the golden section, the sequence that divides any number
 * of them most evenly: after n particles the count of a species is off its share by little more
 * than one (Knuth, The Art of Computer Programming 3, 6.4, theorem S).
 */
#include "size.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { START = 64, DEEPEST = 40 }; /* intervals at first, halvings */
static const double CUT = 6;       /* deviations at which a log-normal law ends by itself */
static const double GOLDEN = 0.6180339887498949;
static const double AGREED = 1e-12; /* of the whole */

__attribute__((format(printf, 3, 4))) static dem_status refuse(char *reason, size_t room,
                                                               const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(reason, room, format, list);
    va_end(list);
    return DEM_BAD_ARGUMENT;
}

/* ---- the density ----------------------------------------------------------------------------- */

void size_range(const dem_size *size, double *lo, double *hi)
{
    *lo = size->lo;
    *hi = size->hi;
    if (size->kind == DEM_SIZE_EQUAL) {
        *lo = *hi = size->mean;
    } else if (size->kind == DEM_SIZE_TABLE && size->n > 0 && size->diameter) {
        *lo = fmax(size->lo, size->diameter[0]);
        *hi = size->diameter[size->n - 1];
        if (size->hi > 0) *hi = fmin(size->hi, *hi);
    } else if (size->kind == DEM_SIZE_LOGNORMAL && !(size->hi > 0)) {
        const double s = size->deviation, apart = exp(3 * s * s);
        *lo = size->mean * exp(-CUT * s) / (size->by_mass ? apart : 1);
        *hi = size->mean * exp(CUT * s) * (size->by_mass ? 1 : apart);
    }
}

/* ln (f d), without constant factors: the given density in ln d. */
static double log_given(const dem_size *s, double d)
{
    const double t = (d - s->mean) / s->deviation;
    const double l = log(d / s->mean);
    switch (s->kind) {
    case DEM_SIZE_NORMAL:
        return -.5 * t * t + l;
    case DEM_SIZE_LOGNORMAL:
        return -.5 * (l / s->deviation) * (l / s->deviation);
    case DEM_SIZE_ROSIN_RAMMLER:
        return s->exponent * l - exp(s->exponent * l);
    case DEM_SIZE_TABLE: {
        size_t k = 1;
        while (k + 1 < s->n && d > s->diameter[k]) k++;
        return log((s->cumulative[k] - s->cumulative[k - 1]) /
                   (s->diameter[k] - s->diameter[k - 1])) +
               log(d);
    }
    default:
        return log(d);
    }
}

/* Density of the number in x = ln(d/hi), scaled. */
static double density(const size_law *law, double x)
{
    const double l = log_given(&law->given, law->hi * exp(x));
    return exp(l - (law->given.by_mass ? 3 * x : 0) - law->top);
}

/* ---- the law --------------------------------------------------------------------------------- */

typedef struct pair_sum {
    double number, mass;
} pair_sum;

/* Gauss's rule of eight points from a to b. Abscissae and weights on [-1, 1]: Abramowitz & Stegun,
 * Handbook of Mathematical Functions, table 25.4. */
static pair_sum integrate(const size_law *law, double a, double b)
{
    static const double at[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                 0.9602898564975363};
    static const double weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                     0.1012285362903763};
    const double half = .5 * (b - a), middle = a + half;
    pair_sum sum = {0, 0};
    for (int k = 0; k < 8; k++) {
        const double x = middle + half * (k % 2 ? at[k / 2] : -at[k / 2]);
        const double part = half * weight[k / 2] * density(law, x);
        sum.number += part;
        sum.mass += part * exp(3 * x);
    }
    return sum;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Edges that no peak slips through: an even division, that of the table, and some around the
 * middle of the given law and of the number's, 1, 2, 4, 8 widths away. */
static size_t first_edges(const size_law *law, double *edge)
{
    const dem_size *s = &law->given;
    const double begin = log(law->lo / law->hi);
    double middle[2] = {log(s->mean / law->hi), 0}, width = 0;
    if (s->kind == DEM_SIZE_NORMAL) width = s->deviation / s->mean;
    if (s->kind == DEM_SIZE_LOGNORMAL) width = s->deviation;
    if (s->kind == DEM_SIZE_ROSIN_RAMMLER) width = 1 / s->exponent;
    middle[1] = middle[0] - (s->by_mass ? 3 : 0) * width * width;
    size_t n = 0;
    for (int k = 0; k <= START; k++) edge[n++] = begin * (1 - (double)k / START);
    for (size_t k = 0; s->kind == DEM_SIZE_TABLE && k < s->n; k++)
        edge[n++] = log(s->diameter[k] / law->hi);
    for (int m = 0; width > 0 && m < 2; m++)
        for (int k = -4; k <= 4; k++)
            edge[n++] = middle[m] + width * (k ? copysign(ldexp(.5, abs(k)), k) : 0);
    qsort(edge, n, sizeof *edge, ascending);
    size_t kept = 0;
    for (size_t k = 0; k < n; k++)
        if (edge[k] >= begin && edge[k] <= 0 && (!kept || edge[k] > edge[kept - 1]))
            edge[kept++] = edge[k];
    return kept;
}

static dem_status append(size_law *law, size_t *capacity, double edge, double number)
{
    if (law->n + 2 > *capacity) {
        *capacity *= 2;
        double *e = realloc(law->edge, *capacity * sizeof *e);
        if (e) law->edge = e;
        double *b = realloc(law->below, *capacity * sizeof *b);
        if (b) law->below = b;
        if (!e || !b) return DEM_NO_MEMORY;
    }
    law->n++;
    law->edge[law->n] = edge;
    law->below[law->n] = law->below[law->n - 1] + number;
    return DEM_OK;
}

typedef struct dividing {
    size_law *law;
    size_t capacity;
    pair_sum whole; /* a first guess */
    double mass;    /* so far */
} dividing;

static dem_status divide(dividing *g, double a, double b, int depth)
{
    const double c = .5 * (a + b);
    const pair_sum one = integrate(g->law, a, b);
    const pair_sum left = integrate(g->law, a, c);
    const pair_sum right = integrate(g->law, c, b);
    const double number = left.number + right.number, mass = left.mass + right.mass;
    if (depth < DEEPEST && (fabs(one.number - number) > AGREED * g->whole.number ||
                            fabs(one.mass - mass) > AGREED * g->whole.mass)) {
        const dem_status status = divide(g, a, c, depth + 1);
        return status ? status : divide(g, c, b, depth + 1);
    }
    g->mass += mass;
    return append(g->law, &g->capacity, b, number);
}

static dem_status tabulate(size_law *law, const double *edge, size_t n, char *reason, size_t room)
{
    dividing g = {.law = law};
    law->top = -INFINITY;
    for (size_t k = 0; k < 2 * n - 1; k++) {
        const double x = k % 2 ? .5 * (edge[k / 2] + edge[k / 2 + 1]) : edge[k / 2];
        law->top = fmax(law->top, log_given(&law->given, law->hi * exp(x)) -
                                      (law->given.by_mass ? 3 * x : 0));
    }
    if (!isfinite(law->top))
        return refuse(reason, room, "nothing of the distribution lies between %g and %g m", law->lo,
                      law->hi);
    for (size_t k = 0; k + 1 < n; k++) {
        const pair_sum s = integrate(law, edge[k], edge[k + 1]);
        g.whole.number += s.number;
        g.whole.mass += s.mass;
    }
    g.capacity = n + 64;
    law->edge = malloc(g.capacity * sizeof *law->edge);
    law->below = malloc(g.capacity * sizeof *law->below);
    if (!law->edge || !law->below) return DEM_NO_MEMORY;
    law->edge[0] = edge[0];
    law->below[0] = 0;
    dem_status status = DEM_OK;
    for (size_t k = 0; k + 1 < n && !status; k++) status = divide(&g, edge[k], edge[k + 1], 0);
    if (status) return status;
    law->total = law->below[law->n];
    law->cube = law->hi * law->hi * law->hi * g.mass / law->total;
    for (size_t k = 0; k <= law->n; k++) law->below[k] /= law->total;
    law->below[law->n] = 1;
    return DEM_OK;
}

/* ---- checks ---------------------------------------------------------------------------------- */

static dem_status check_table(const dem_size *s, char *reason, size_t room)
{
    if (s->n < 2 || !s->diameter || !s->cumulative)
        return refuse(reason, room, "a table of sizes needs two rows or more, found %zu", s->n);
    for (size_t k = 0; k < s->n; k++) {
        if (!(s->diameter[k] > (k ? s->diameter[k - 1] : 0)) || !isfinite(s->diameter[k]))
            return refuse(reason, room,
                          "diameter %g m in row %zu of the table of sizes must be above %g",
                          s->diameter[k], k + 1, k ? s->diameter[k - 1] : 0);
        if (!(s->cumulative[k] >= (k ? s->cumulative[k - 1] : 0)))
            return refuse(reason, room,
                          "share %g in row %zu of the table of sizes must not fall: %g before",
                          s->cumulative[k], k + 1, k ? s->cumulative[k - 1] : 0);
    }
    if (fabs(s->cumulative[0]) > 1e-9 || fabs(s->cumulative[s->n - 1] - 1) > 1e-9)
        return refuse(reason, room,
                      "the shares of a table of sizes must go from 0 to 1, found %g "
                      "to %g",
                      s->cumulative[0], s->cumulative[s->n - 1]);
    return DEM_OK;
}

static dem_status check_cut(const dem_size *s, char *reason, size_t room)
{
    const int none = s->lo == 0 && s->hi == 0;
    if (none && s->kind != DEM_SIZE_LOGNORMAL && s->kind != DEM_SIZE_TABLE)
        return refuse(reason, room, "the distribution needs a smallest and a largest diameter");
    if (!none && (!(s->lo > 0) || !(s->lo < s->hi) || !isfinite(s->hi)))
        return refuse(reason, room,
                      "smallest diameter %g m and largest %g m must obey 0 < smallest < largest",
                      s->lo, s->hi);
    double lo, hi;
    size_range(s, &lo, &hi);
    if (!(lo < hi) || !(lo > 0) || !isfinite(hi))
        return refuse(reason, room, "nothing of the distribution lies between %g and %g m", s->lo,
                      s->hi);
    return DEM_OK;
}

static dem_status check(const dem_size *s, char *reason, size_t room)
{
    if ((int)s->kind < 0 || s->kind > DEM_SIZE_TABLE)
        return refuse(reason, room, "kind %d of a distribution of sizes is unknown", (int)s->kind);
    if (s->kind != DEM_SIZE_UNIFORM && s->kind != DEM_SIZE_TABLE &&
        (!(s->mean > 0) || !isfinite(s->mean)))
        return refuse(reason, room, "diameter %g m is not positive", s->mean);
    if ((s->kind == DEM_SIZE_NORMAL || s->kind == DEM_SIZE_LOGNORMAL) &&
        (!(s->deviation > 0) || !isfinite(s->deviation)))
        return refuse(reason, room, "deviation %g of the diameter is not positive", s->deviation);
    if (s->kind == DEM_SIZE_ROSIN_RAMMLER && (!(s->exponent > 0) || !isfinite(s->exponent)))
        return refuse(reason, room, "exponent %g of the Rosin-Rammler distribution is not positive",
                      s->exponent);
    if (s->kind == DEM_SIZE_EQUAL) return DEM_OK;
    const dem_status status = s->kind == DEM_SIZE_TABLE ? check_table(s, reason, room) : DEM_OK;
    return status ? status : check_cut(s, reason, room);
}

/* ---- one distribution ------------------------------------------------------------------------ */

static dem_status copy_table(size_law *law, const dem_size *size)
{
    law->given.diameter = law->given.cumulative = NULL;
    if (size->kind != DEM_SIZE_TABLE) return DEM_OK;
    double *diameter = malloc(size->n * sizeof *diameter);
    double *cumulative = malloc(size->n * sizeof *cumulative);
    law->given.diameter = diameter;
    law->given.cumulative = cumulative;
    if (!diameter || !cumulative) return DEM_NO_MEMORY;
    memcpy(diameter, size->diameter, size->n * sizeof *diameter);
    memcpy(cumulative, size->cumulative, size->n * sizeof *cumulative);
    return DEM_OK;
}

dem_status size_init(size_law *law, const dem_size *size, char *reason, size_t room)
{
    memset(law, 0, sizeof *law);
    dem_status status = check(size, reason, room);
    if (status) return status;
    law->given = *size;
    status = copy_table(law, size);
    size_range(size, &law->lo, &law->hi);
    law->cube = law->hi * law->hi * law->hi;
    if (!status && size->kind != DEM_SIZE_EQUAL) {
        double *edge = malloc((START + 32 + size->n) * sizeof *edge);
        status = edge ? tabulate(law, edge, first_edges(law, edge), reason, room) : DEM_NO_MEMORY;
        free(edge);
    }
    if (status == DEM_NO_MEMORY) refuse(reason, room, "out of memory");
    if (status) size_free(law);
    return status;
}

void size_free(size_law *law)
{
    free((void *)law->given.diameter);
    free((void *)law->given.cumulative);
    free(law->edge);
    free(law->below);
    memset(law, 0, sizeof *law);
}

/* Share of the number between the edge k and x. */
static double beyond(const size_law *law, size_t k, double x)
{
    return integrate(law, law->edge[k], x).number / law->total;
}

double size_below(const size_law *law, double d)
{
    if (law->n == 0 || d <= law->lo) return d >= law->hi;
    if (d >= law->hi) return 1;
    const double x = log(d / law->hi);
    size_t low = 0, high = law->n;
    while (high - low > 1) {
        const size_t k = (low + high) / 2;
        *(law->edge[k] <= x ? &low : &high) = k;
    }
    return law->below[low] + beyond(law, low, x);
}

double size_quantile(const size_law *law, double u)
{
    if (law->n == 0) return law->hi;
    size_t k = 0, end = law->n;
    while (end - k > 1) {
        const size_t middle = (k + end) / 2;
        *(law->below[middle] <= u ? &k : &end) = middle;
    }
    double a = law->edge[k], b = law->edge[k + 1], share = law->below[k + 1] - law->below[k];
    if (!(share > 0)) return law->hi * exp(a);
    double x = a + (b - a) * (u - law->below[k]) / share;
    for (int n = 0; n < 60 && b - a > 4 * DBL_EPSILON * fabs(a); n++) {
        const double off = law->below[k] + beyond(law, k, x) - u;
        *(off > 0 ? &b : &a) = x;
        const double newton = x - off * law->total / density(law, x);
        const double next = newton > a && newton < b ? newton : .5 * (a + b);
        if (fabs(next - x) < 1e-15 * (1 + fabs(x))) break;
        x = next;
    }
    return fmin(fmax(law->hi * exp(x), law->lo), law->hi);
}

/* ---- mixtures -------------------------------------------------------------------------------- */

static dem_status check_species(const dem_species *s, size_t k, size_t n_material, char *reason,
                                size_t room)
{
    if (s->material < 0 || (size_t)s->material >= n_material)
        return refuse(reason, room, "species %zu: material %d is none of the %zu", k + 1,
                      s->material, n_material);
    if (!(s->share > 0) || !isfinite(s->share))
        return refuse(reason, room, "species %zu: share %g is not positive", k + 1, s->share);
    return DEM_OK;
}

static dem_status add_species(mixture *m, const dem_species *s, int by_mass, double density,
                              char *reason, size_t room)
{
    char why[256] = "";
    const size_t k = m->n;
    const dem_status status = size_init(&m->size[k], &s->size, why, sizeof why);
    if (status) {
        refuse(reason, room, "species %zu: %s", k + 1, why);
        return status;
    }
    const double volume = M_PI / 6 * m->size[k].cube;
    const double number = by_mass ? s->share / (density * volume) : s->share;
    m->material[k] = s->material;
    m->below[k + 1] = m->below[k] + number;
    m->volume += number * volume;
    m->mass += number * volume * density;
    m->smallest = fmin(m->smallest, m->size[k].lo);
    m->largest = fmax(m->largest, m->size[k].hi);
    m->n++;
    return DEM_OK;
}

dem_status mixture_init(mixture *m, size_t n, const dem_species *species, int share_by_mass,
                        size_t n_material, const dem_material *material, char *reason, size_t room)
{
    memset(m, 0, sizeof *m);
    m->smallest = INFINITY;
    if (n == 0 || !species) return refuse(reason, room, "no species is given");
    m->material = malloc(n * sizeof *m->material);
    m->size = malloc(n * sizeof *m->size);
    m->below = calloc(n + 1, sizeof *m->below);
    dem_status status = m->material && m->size && m->below ? DEM_OK : DEM_NO_MEMORY;
    if (status) refuse(reason, room, "out of memory");
    for (size_t k = 0; k < n && !status; k++) {
        status = check_species(&species[k], k, n_material, reason, room);
        if (!status)
            status = add_species(m, &species[k], share_by_mass,
                                 material[species[k].material].density, reason, room);
    }
    if (status) {
        mixture_free(m);
        return status;
    }
    const double all = m->below[n];
    m->volume /= all;
    m->mass /= all;
    for (size_t k = 1; k <= n; k++) m->below[k] /= all;
    return DEM_OK;
}

void mixture_free(mixture *m)
{
    for (size_t k = 0; k < m->n; k++) size_free(&m->size[k]);
    free(m->material);
    free(m->size);
    free(m->below);
    memset(m, 0, sizeof *m);
}

void mixture_start(mixture *m, const gsl_rng *rng)
{
    m->turn = gsl_rng_uniform(rng);
}

void mixture_draw(mixture *m, const gsl_rng *rng, double *diameter, int *material)
{
    size_t k = 0;
    while (k + 1 < m->n && m->turn >= m->below[k + 1]) k++;
    m->turn += GOLDEN;
    m->turn -= floor(m->turn);
    *diameter = size_quantile(&m->size[k], gsl_rng_uniform(rng));
    *material = m->material[k];
}
