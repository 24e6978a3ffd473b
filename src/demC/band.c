/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * band.c - signed distances of a surface, sampled in a narrow band about it: evaluation.
 *
 * Samples are on a cubic grid of spacing h, in bricks of 8^3 cells. Only bricks that come within
 * the width of the band are there, so memory grows with the area over h^2. A brick has the nodes of
 * all its faces: an evaluation finds one brick by a hash table and reads eight neighbouring values.
 * Who comes back step after step keeps the number of the brick, which need only be confirmed: the
 * search waits for memory twice before the values can be asked for.
 *
 *     phi = sum_ijk w_i(a) w_j(b) w_k(c) phi_ijk,  w_0(a) = 1 - a, w_1(a) = a
 *
 * with the exact gradient of just this phi, so that the contact force k (r - phi) grad phi is that
 * of a potential and conserves energy (whatever the errors of phi).
 *
 * Side without bricks. Space between bricks does not meet the surface, so that along a row of
 * bricks in x the side changes within bricks only: the last brick before x tells it.
 *
 * References: Shigeto & Sakai, Chem. Eng. J. 231 (2013) 464, doi:10.1016/j.cej.2013.07.073; for
 * bricks: Museth, ACM Trans. Graph. 32 (2013) 27, doi:10.1145/2487228.2487235.
 */
#include "band.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t hash_of(const int32_t c[3], int32_t part)
{
    uint64_t h = (uint32_t)c[0] * 0x9e3779b97f4a7c15u ^ (uint32_t)c[1] * 0xc2b2ae3d27d4eb4fu ^
                 (uint32_t)c[2] * 0x165667b19e3779f9u ^ (uint32_t)part * 0xd6e8feb86659fd93u;
    h ^= h >> 32;
    return (size_t)(h * 0x9fb21c651e98df25u >> 24);
}

int band_index(band *b)
{
    b->mask = 15;
    while (b->mask < 2 * b->n) b->mask = 2 * b->mask + 1;
    free(b->slot);
    b->slot = calloc(b->mask + 1, sizeof *b->slot);
    if (b->slot == NULL) return -1;
    for (size_t i = 0; i < b->n; i++) {
        size_t at = hash_of(b->place[i], b->place[i][3]) & b->mask;
        while (b->slot[at] != 0) at = (at + 1) & b->mask;
        b->slot[at] = (uint32_t)i + 1;
    }
    return 0;
}

/* Brick at a place, or -1. */
static int64_t find_brick(const band *b, const int32_t c[3], int32_t part)
{
    for (size_t at = hash_of(c, part) & b->mask; b->slot[at] != 0; at = (at + 1) & b->mask) {
        const int32_t *p = b->place[b->slot[at] - 1];
        if (p[0] == c[0] && p[1] == c[1] && p[2] == c[2] && p[3] == part)
            return (int64_t)b->slot[at] - 1;
    }
    return -1;
}

/* Place of the brick of x, the cell in it and the place in the cell, 0...1; 0: absurdly far. */
static int locate(const band *b, const double x[3], int32_t c[3], int cell[3], double f[3])
{
    const double per_m = 1 / b->spacing;
    for (int k = 0; k < 3; k++) {
        const double t = (x[k] - b->origin[k]) * per_m, whole = floor(t);
        if (!(fabs(t) < 1e9)) return 0;
        const int32_t i = (int32_t)whole;
        c[k] = i >= 0 ? i / BRICK : -((BRICK - 1 - i) / BRICK);
        cell[k] = i - BRICK * c[k];
        f[k] = t - whole;
    }
    return 1;
}

int band_has(const band *b, int part, const double x[3])
{
    int32_t c[3];
    int cell[3];
    double f[3];
    return locate(b, x, c, cell, f) && find_brick(b, c, part) >= 0;
}

/* Brick at a place, or -1. */
static int64_t find_again(const band *b, const int32_t c[3], int32_t part, uint32_t *hint)
{
    if (*hint > 0 && *hint <= b->n) {
        const int32_t *p = b->place[*hint - 1];
        if (p[0] == c[0] && p[1] == c[1] && p[2] == c[2] && p[3] == part) return (int64_t)*hint - 1;
    }
    const int64_t brick = find_brick(b, c, part);
    *hint = (uint32_t)(brick + 1);
    return brick;
}

enum { ROW = BRICK + 1, LAYER = ROW * ROW };

void band_fetch(const band *b, const double x[3], uint32_t hint)
{
    int32_t c[3];
    int cell[3];
    double f[3];
    if (hint == 0 || hint > b->n || !locate(b, x, c, cell, f)) return;
    const size_t brick = hint - 1;
    const double *v = b->value[brick] + (cell[2] * ROW + cell[1]) * ROW + cell[0];
    __builtin_prefetch(b->place[brick]);
    __builtin_prefetch(&b->hidden[brick][cell[2] * BRICK * BRICK / 64]);
    __builtin_prefetch(v);
    __builtin_prefetch(v + ROW);
    __builtin_prefetch(v + LAYER);
    __builtin_prefetch(v + LAYER + ROW);
}

int band_eval(const band *b, int part, const double x[3], double *phi, double g[3], uint32_t *hint)
{
    int32_t c[3];
    int cell[3];
    double f[3];
    if (!locate(b, x, c, cell, f)) return 0;
    const int64_t brick = hint ? find_again(b, c, part, hint) : find_brick(b, c, part);
    if (brick < 0) return 0;
    const int bit = (cell[2] * BRICK + cell[1]) * BRICK + cell[0];
    if (b->hidden[brick][bit / 64] >> (bit % 64) & 1) return -1;
    const double *v = b->value[brick] + (cell[2] * ROW + cell[1]) * ROW + cell[0];
    const double a = f[0], d = f[1], e = f[2];
    /* along x first: values and slopes of the four edges */
    const double s00 = v[1] - v[0], s10 = v[ROW + 1] - v[ROW], s01 = v[LAYER + 1] - v[LAYER],
                 s11 = v[LAYER + ROW + 1] - v[LAYER + ROW];
    const double v00 = v[0] + a * s00, v10 = v[ROW] + a * s10, v01 = v[LAYER] + a * s01,
                 v11 = v[LAYER + ROW] + a * s11;
    const double low = v00 + d * (v10 - v00), high = v01 + d * (v11 - v01);
    const double slope_low = s00 + d * (s10 - s00), slope_high = s01 + d * (s11 - s01);
    *phi = low + e * (high - low);
    const double per_m = 1 / b->spacing;
    g[0] = (slope_low + e * (slope_high - slope_low)) * per_m;
    g[1] = ((v10 - v00) + e * ((v11 - v01) - (v10 - v00))) * per_m;
    g[2] = (high - low) * per_m;
    return 1;
}

/* Order of sides: z, y, x. */
static int before(const int32_t p[3], const int32_t q[3])
{
    if (p[2] != q[2]) return p[2] < q[2];
    if (p[1] != q[1]) return p[1] < q[1];
    return p[0] < q[0];
}

int band_is_free(const band *b, const double x[3], int outer)
{
    int32_t c[3];
    int cell[3];
    double f[3];
    if (!locate(b, x, c, cell, f)) return outer;
    size_t low = 0, high = b->n_side; /* sides [0, low) are before x */
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (before(b->side[middle], c))
            low = middle + 1;
        else
            high = middle;
    }
    if (low == 0) return outer;
    const int32_t *last = b->side[low - 1];
    return last[2] == c[2] && last[1] == c[1] ? last[3] : outer;
}

size_t band_memory(const band *b)
{
    return sizeof *b + b->n * (sizeof *b->place + sizeof *b->value + sizeof *b->hidden) +
           b->n_side * sizeof *b->side + (b->mask + 1) * sizeof *b->slot;
}

void band_free(band *b)
{
    if (b == NULL) return;
    free(b->place);
    free(b->value);
    free(b->hidden);
    free(b->side);
    free(b->slot);
    free(b);
}
