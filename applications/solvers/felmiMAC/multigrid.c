/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * multigrid.c - one multigrid cycle for a symmetric 7-point operator.
 *
 * Smoother: red-black Gauss-Seidel, (red, black) before and (black, red) after the coarse
 * correction, so that the cycle is a symmetric operator. Within a colour the periodic ghosts keep
 * their old values; a colour's step is then diagonal even where an odd periodic direction makes
 * neighbours of one colour, and the symmetry holds there too.
 *
 * Coarsening: cells are paired along every direction whose coupling is strong, one direction after
 * the other; the grids in between only carry the transfer and are not smoothed. What is left over
 * in an odd direction stays single.
 *
 * Transfer and coarse operator see a line of cells as resistances in series. The coefficient of a
 * coarse face is that of the line between the centres of two pairs,
 *     1/c = (1/2)/c_inside + 1/c_face + (1/2)/c_inside',
 * lines in parallel are added, and a cell takes from the pair beyond its outer face the weight
 *     w = (1/2) c / c_inside,
 * the value at its place when the same flux runs through the whole line. For constant coefficients
 * this is linear interpolation (3/4, 1/4) and the operator of the coarse grid; at the surface of a
 * bed, where coefficients jump by 1e3, the cell follows the side it is joined to. Since the
 * interpolated function never has more energy than the coarse operator gives it, the correction
 * does not overshoot and a W-cycle stays positive. Restriction is the transpose.
 *
 * References: U. Trottenberg, C. Oosterlee & A. Schueller, Multigrid (2001), 2.4, 5.1, 7.7;
 * R. E. Alcouffe, A. Brandt, J. E. Dendy & J. W. Painter, SIAM J. Sci. Stat. Comput. 2 (1981) 430,
 * doi:10.1137/0902035 (interpolation that follows jumping coefficients).
 */
#include "multigrid.h"

#include <stdlib.h>
#include <string.h>

/* A direction is paired when its coupling is at least this share of the strongest: point smoothing
 * damps all errors that the paired grid cannot see while anisotropy stays below about three
 * (Trottenberg et al. 5.1). */
static const double pair_share = 0.3;

/* ---- life cycle ------------------------------------------------------------------------------ */

static int level_init(mac_level *l, const int n[3], const int periodic[3], int smoothed)
{
    memset(l, 0, sizeof *l);
    for (int d = 0; d < 3; d++) {
        l->n[d] = n[d];
        l->periodic[d] = periodic[d] && n[d] > 1; /* a single cell would be its own neighbour */
    }
    l->merge = -1;
    l->smoothed = smoothed;
    l->stride[0] = 1;
    l->stride[1] = (size_t)n[0] + 2;
    l->stride[2] = l->stride[1] * ((size_t)n[1] + 2);
    l->size = l->stride[2] * ((size_t)n[2] + 2);
    double **array[8] = {&l->c[0], &l->c[1], &l->c[2], &l->inv, &l->x, &l->b, &l->w, &l->r};
    for (int a = 0; a < 8; a++) {
        *array[a] = calloc(l->size, sizeof **array[a]);
        if (!*array[a]) return -1;
    }
    return 0;
}

void mac_multigrid_free(mac_multigrid *mg)
{
    for (int l = 0; l < mg->levels; l++) {
        mac_level *lv = &mg->level[l];
        for (int d = 0; d < 3; d++) free(lv->c[d]);
        free(lv->inv);
        free(lv->w);
        free(lv->x);
        free(lv->b);
        free(lv->r);
    }
    mg->levels = 0;
}

static int add_level(mac_multigrid *mg, const int n[3], const int periodic[3], int smoothed)
{
    if (mg->levels == MAC_LEVELS) return -1;
    return level_init(&mg->level[mg->levels++], n, periodic, smoothed);
}

int mac_multigrid_init(mac_multigrid *mg, const int n[3], const double h[3], const int periodic[3],
                       mac_cycle cycle)
{
    int size[3] = {n[0], n[1], n[2]};
    double coupling[3];
    for (int d = 0; d < 3; d++) coupling[d] = 1 / (h[d] * h[d]);
    mg->levels = 0;
    mg->cycle = cycle;
    int failed = add_level(mg, size, periodic, 1);
    while (!failed) {
        double strongest = 0;
        for (int d = 0; d < 3; d++)
            if (size[d] > 1 && coupling[d] > strongest) strongest = coupling[d];
        if (strongest == 0) return 0;
        /* z first: the long vectors are then added row by row */
        for (int d = 2; d >= 0 && !failed; d--) {
            if (size[d] == 1 || coupling[d] < pair_share * strongest) continue;
            size[d] = (size[d] + 1) / 2;
            coupling[d] /= 4;
            mg->level[mg->levels - 1].merge = d;
            failed = add_level(mg, size, periodic, 0);
        }
        mg->level[mg->levels - 1].smoothed = 1;
    }
    mac_multigrid_free(mg);
    return -1;
}

void mac_level_wrap(const mac_level *l, double *x)
{
    for (int d = 0; d < 3; d++) {
        if (!l->periodic[d]) continue;
        int a = (d + 1) % 3, b = (d + 2) % 3;
        size_t shift = (size_t)l->n[d] * l->stride[d];
        for (int q = 0; q <= l->n[b] + 1; q++)
            for (int p = 0; p <= l->n[a] + 1; p++) {
                double *ghost = x + (size_t)p * l->stride[a] + (size_t)q * l->stride[b];
                ghost[0] = ghost[shift];
                ghost[shift + l->stride[d]] = ghost[l->stride[d]];
            }
    }
}

/* ---- operators ------------------------------------------------------------------------------- */

static void invert_diagonal(mac_level *l)
{
    size_t s1 = l->stride[1], s2 = l->stride[2];
    for (int k = 1; k <= l->n[2]; k++)
        for (int j = 1; j <= l->n[1]; j++)
            for (int i = 1; i <= l->n[0]; i++) {
                size_t m = (size_t)i + (size_t)j * s1 + (size_t)k * s2;
                double sum = l->c[0][m] + l->c[0][m + 1] + l->c[1][m] + l->c[1][m + s1] +
                             l->c[2][m] + l->c[2][m + s2];
                l->inv[m] = sum > 0 ? 1 / sum : 0;
            }
}

/* Coarse coefficients and weights of one line of fine cells, both starting at index 0 of the line.
 * c, w: fine, stride s; coarse: stride t. */
static void pair_line(int n, int periodic, const double *c, double *w, size_t s, double *coarse,
                      size_t t)
{
    int pairs = (n + 1) / 2;
    int closed = periodic && pairs == 1; /* the pair would be its own neighbour */
    for (int I = 1; I <= pairs + 1; I++) {
        int i = I <= pairs ? 2 * I - 1 : n + 1; /* first cell above the face */
        int above = I, below = I - 1;
        if (periodic && I == 1) below = pairs;
        if (periodic && I > pairs) above = 1, i = 1;
        double face = c[(size_t)i * s], up = 0, down = 0, sum = 0;
        if (face > 0 && !closed) {
            if (above <= pairs && 2 * above <= n) up = 0.5 / c[(size_t)(2 * above) * s];
            if (below >= 1 && 2 * below <= n) down = 0.5 / c[(size_t)(2 * below) * s];
            sum = 1 / (up + 1 / face + down);
        }
        coarse[(size_t)I * t] = sum;
        /* the cells on both sides of the face; a single one (up or down 0) takes no share */
        if (above <= pairs) w[(size_t)(2 * above - 1) * s] = up * sum;
        if (below >= 1 && 2 * below <= n) w[(size_t)(2 * below) * s] = down * sum;
    }
}

/* Weights in the ghosts beside a line, so that a face there finds two cells. */
static void extend_weights(const mac_level *f, double *w)
{
    for (int e = 0; e < 3; e++) {
        if (e == f->merge || f->periodic[e]) continue;
        int a = (e + 1) % 3, b = (e + 2) % 3;
        for (int q = 0; q <= f->n[b] + 1; q++)
            for (int p = 0; p <= f->n[a] + 1; p++) {
                double *line = w + (size_t)p * f->stride[a] + (size_t)q * f->stride[b];
                size_t last = (size_t)f->n[e] * f->stride[e];
                line[0] = line[f->stride[e]];
                line[last + f->stride[e]] = line[last];
            }
    }
    mac_level_wrap(f, w);
}

/* Coefficient across the line: every fine face gives its coefficient to the pairs its cells take
 * their values from. */
static double across(const mac_level *f, int e, size_t m, int single)
{
    size_t s = f->stride[f->merge], t = f->stride[e];
    const double *c = f->c[e], *w = f->w;
    double sum = (1 - 0.5 * (w[m] + w[m - t])) * c[m] + 0.5 * (w[m - s] + w[m - s - t]) * c[m - s];
    m += s;
    if (!single) {
        sum += (1 - 0.5 * (w[m] + w[m - t])) * c[m];
        m += s;
    }
    return sum + 0.5 * (w[m] + w[m - t]) * c[m];
}

static void pair_level(mac_level *f, mac_level *g)
{
    int d = f->merge, a = (d + 1) % 3, b = (d + 2) % 3;
    for (int q = 1; q <= g->n[b]; q++)
        for (int p = 1; p <= g->n[a]; p++) {
            size_t line = (size_t)p * f->stride[a] + (size_t)q * f->stride[b];
            size_t coarse = (size_t)p * g->stride[a] + (size_t)q * g->stride[b];
            pair_line(f->n[d], f->periodic[d], f->c[d] + line, f->w + line, f->stride[d],
                      g->c[d] + coarse, g->stride[d]);
        }
    extend_weights(f, f->w);
    for (int e = 0; e < 3; e++) {
        if (e == d) continue;
        mac_level_wrap(f, f->c[e]);
        for (int k = 1; k <= g->n[2] + (e == 2); k++)
            for (int j = 1; j <= g->n[1] + (e == 1); j++)
                for (int i = 1; i <= g->n[0] + (e == 0); i++) {
                    int at[3] = {i, j, k};
                    int single = 2 * at[d] > f->n[d];
                    at[d] = 2 * at[d] - 1;
                    size_t m =
                        (size_t)at[0] + (size_t)at[1] * f->stride[1] + (size_t)at[2] * f->stride[2];
                    g->c[e][(size_t)i + (size_t)j * g->stride[1] + (size_t)k * g->stride[2]] =
                        across(f, e, m, single);
                }
    }
}

void mac_multigrid_assemble(mac_multigrid *mg)
{
    invert_diagonal(&mg->level[0]);
    for (int l = 1; l < mg->levels; l++) {
        pair_level(&mg->level[l - 1], &mg->level[l]);
        if (mg->level[l].smoothed) invert_diagonal(&mg->level[l]);
    }
}

/* ---- cycle ----------------------------------------------------------------------------------- */

/* First i of a colour in row (j, k): cells with i + j + k of the given parity. */
static size_t first_of_colour(int parity, int j, int k)
{
    return (1 + j + k + parity) % 2 == 0 ? 1 : 2;
}

/* One colour of the plane k. */
static void smooth_plane(const mac_level *l, int parity, int k)
{
    size_t s1 = l->stride[1], s2 = l->stride[2];
    const double *restrict inv = l->inv, *restrict b = l->b;
    const double *restrict cx = l->c[0], *restrict cy = l->c[1], *restrict cz = l->c[2];
    double *x = l->x;
    for (int j = 1; j <= l->n[1]; j++) {
        size_t row = (size_t)j * s1 + (size_t)k * s2, end = row + (size_t)l->n[0];
        for (size_t m = row + first_of_colour(parity, j, k); m <= end; m += 2)
            x[m] = inv[m] * (b[m] + cx[m] * x[m - 1] + cx[m + 1] * x[m + 1] + cy[m] * x[m - s1] +
                             cy[m + s1] * x[m + s1] + cz[m] * x[m - s2] + cz[m + s2] * x[m + s2]);
    }
}

/* Two colours, the first one plane ahead of the second: one pass through memory. */
static void smooth(const mac_level *l, int first)
{
    if (l->periodic[0] || l->periodic[1] || l->periodic[2]) {
        for (int pass = 0; pass < 2; pass++) {
            mac_level_wrap(l, l->x);
            for (int k = 1; k <= l->n[2]; k++) smooth_plane(l, pass ? !first : first, k);
        }
        return;
    }
    for (int k = 1; k <= l->n[2] + 1; k++) {
        if (k <= l->n[2]) smooth_plane(l, first, k);
        if (k > 1) smooth_plane(l, !first, k - 1);
    }
}

/* The first sweep on x = 0: the red half has no neighbours to read, and neither x before it nor
 * its zeros are touched. */
static void smooth_fresh(const mac_level *l)
{
    if (l->periodic[0] || l->periodic[1] || l->periodic[2]) {
        memset(l->x, 0, l->size * sizeof *l->x);
        smooth(l, 0);
        return;
    }
    for (int k = 1; k <= l->n[2] + 1; k++) {
        for (int j = 1; k <= l->n[2] && j <= l->n[1]; j++) {
            size_t row = (size_t)j * l->stride[1] + (size_t)k * l->stride[2];
            for (size_t m = row + first_of_colour(0, j, k); m <= row + (size_t)l->n[0]; m += 2)
                l->x[m] = l->inv[m] * l->b[m];
        }
        if (k > 1) smooth_plane(l, 1, k - 1);
    }
}

static void residual(const mac_level *l)
{
    size_t s1 = l->stride[1], s2 = l->stride[2];
    const double *restrict cx = l->c[0], *restrict cy = l->c[1], *restrict cz = l->c[2];
    mac_level_wrap(l, l->x);
    const double *restrict x = l->x, *restrict b = l->b;
    double *restrict r = l->r;
    for (int k = 1; k <= l->n[2]; k++)
        for (int j = 1; j <= l->n[1]; j++) {
            size_t row = (size_t)j * s1 + (size_t)k * s2;
            for (size_t m = row + 1; m <= row + (size_t)l->n[0]; m++) {
                double v = x[m];
                r[m] = b[m] - cx[m] * (v - x[m - 1]) - cx[m + 1] * (v - x[m + 1]) -
                       cy[m] * (v - x[m - s1]) - cy[m + s1] * (v - x[m + s1]) -
                       cz[m] * (v - x[m - s2]) - cz[m + s2] * (v - x[m + s2]);
            }
        }
    mac_level_wrap(l, r);
}

/* g->b = transpose of the interpolation applied to r of the finer level f. */
static void restrict_to(const mac_level *f, const double *r, mac_level *g)
{
    int d = f->merge, n = f->n[d];
    size_t s = f->stride[d];
    const double *w = f->w;
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++) {
            int I = d == 1 ? j : k; /* pair of this row, unless pairs lie along it */
            int J = d == 1 ? 2 * j - 1 : j, K = d == 2 ? 2 * k - 1 : k;
            double *restrict b = g->b + (size_t)j * g->stride[1] + (size_t)k * g->stride[2];
            const size_t row = (size_t)J * f->stride[1] + (size_t)K * f->stride[2];
            /* beyond an odd end there is a single cell, and the cell above it is a ghost */
            if (d == 0) {
                for (int i = 1; i <= g->n[0]; i++) {
                    size_t m = row + (size_t)(2 * i - 1);
                    double sum = (1 - w[m]) * r[m] + w[m - 1] * r[m - 1];
                    if (2 * i <= n)
                        sum += (1 - w[m + 1]) * r[m + 1] + w[m + 2] * r[m + 2];
                    else
                        sum += w[m + 1] * r[m + 1];
                    b[i] = sum;
                }
            } else if (2 * I <= n) {
                for (int i = 1; i <= g->n[0]; i++) {
                    size_t m = row + (size_t)i;
                    b[i] = (1 - w[m]) * r[m] + w[m - s] * r[m - s] + (1 - w[m + s]) * r[m + s] +
                           w[m + 2 * s] * r[m + 2 * s];
                }
            } else {
                for (int i = 1; i <= g->n[0]; i++) {
                    size_t m = row + (size_t)i;
                    b[i] = (1 - w[m]) * r[m] + w[m - s] * r[m - s] + w[m + s] * r[m + s];
                }
            }
        }
}

/* x of the finer level f plus the interpolated x of g. */
static void add_correction(mac_level *f, const mac_level *g)
{
    int d = f->merge;
    size_t t = g->stride[d];
    mac_level_wrap(g, g->x);
    for (int k = 1; k <= f->n[2]; k++)
        for (int j = 1; j <= f->n[1]; j++) {
            int J = d == 1 ? (j + 1) / 2 : j, K = d == 2 ? (k + 1) / 2 : k;
            size_t row = (size_t)j * f->stride[1] + (size_t)k * f->stride[2];
            double *restrict x = f->x + row;
            const double *restrict w = f->w + row;
            const double *restrict own = g->x + (size_t)J * g->stride[1] + (size_t)K * g->stride[2];
            if (d == 0) {
                for (int i = 1; i <= f->n[0]; i++) {
                    double near = own[(i + 1) / 2], far = own[i % 2 ? (i - 1) / 2 : i / 2 + 1];
                    x[i] += near + w[i] * (far - near);
                }
                continue;
            }
            const double *restrict far = (d == 1 ? j : k) % 2 ? own - t : own + t;
            for (int i = 1; i <= f->n[0]; i++) x[i] += own[i] + w[i] * (far[i] - own[i]);
        }
}

/* Improve x of the smoothed level `at` for its b; fresh: x = 0, whatever is stored there. */
static void cycle(mac_multigrid *mg, int at, int fresh)
{
    mac_level *l = &mg->level[at];
    if (fresh)
        smooth_fresh(l);
    else
        smooth(l, 0);
    if (at + 1 < mg->levels) {
        residual(l);
        const double *r = l->r;
        int next = at;
        for (;;) {
            mac_level *f = &mg->level[next++], *g = f + 1;
            restrict_to(f, r, g);
            if (g->smoothed) break;
            memset(g->x, 0, g->size * sizeof *g->x); /* collects the correction */
            mac_level_wrap(g, g->b);
            r = g->b;
        }
        int visits = next + 1 < mg->levels ? (int)mg->cycle : 1;
        for (int v = 0; v < visits; v++) cycle(mg, next, v == 0);
        for (; next > at; next--) add_correction(&mg->level[next - 1], &mg->level[next]);
    }
    smooth(l, 1);
}

void mac_multigrid_apply(mac_multigrid *mg)
{
    cycle(mg, 0, 1);
}
