/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * force_block.h - what the loop over pairs (force.c) keeps of the entries it works on, for those
 * who add to it: contact_extra.h through force_extra.c.
 */
#ifndef DEM_FORCE_BLOCK_H
#define DEM_FORCE_BLOCK_H

#include "force.h"

enum {
    BLOCK = 128, /* entries of the list in a block */
    WIDE = 8,    /* numbers in the widest vector; divides BLOCK */
    COEFFICIENTS = sizeof(coefficient) / sizeof(double),
};

typedef struct block {
    size_t first;                          /* entry of the list, and how many */
    int entries;                           /* from it on are in the block */
    uint32_t row[BLOCK];                   /* the particle i of their rows */
    _Alignas(64) double between[BLOCK][4]; /* x_i - x_j; r_i - r_j */
    double square[BLOCK];                  /* |x_i - x_j|^2 */
    double sum[BLOCK];                     /* r_i + r_j; unless uniform */

    int n;                /* pairs of these that touch */
    uint16_t from[BLOCK]; /* place among the entries above */
    uint32_t i[BLOCK], j[BLOCK];
    uint32_t old[BLOCK]; /* number of the contact in the last sum, */
    uint8_t was[BLOCK];  /* if there was one */
    double d2[BLOCK];    /* square and */
    double reach[BLOCK]; /* sum of the pair; unless uniform */
    double overlap[BLOCK];
    double mass[BLOCK], radius[BLOCK];      /* effective; unless uniform */
    _Alignas(64) double apart[BLOCK][4];    /* as between */
    _Alignas(64) double velocity[BLOCK][4]; /* v_i - v_j */
    _Alignas(64) double spin[BLOCK][4];     /* w_i + w_j */
    _Alignas(64) double twist[BLOCK][4];    /* (r_i - r_j)(w_i - w_j); unless uniform */
    _Alignas(64) double spring[BLOCK][4];   /* before the step */
    double lever[BLOCK];                    /* l_j / l_i; unless uniform */
    double q[COEFFICIENTS][BLOCK];          /* coefficients; unless of one material */
    /* What the law gives, component by component: it is written in whole vectors. */
    _Alignas(64) double after[4][BLOCK]; /* spring */
    _Alignas(64) double force[3][BLOCK];
    _Alignas(64) double torque[3][BLOCK]; /* on i */
} block;

/* What the extras need besides. */
typedef struct extra_block {
    double before[BLOCK][4];  /* spring */
    double rolling[BLOCK][4]; /* rolling spring */
    double torque[BLOCK][3];  /* of the rolling resistance, on i */
    double normal[BLOCK], elastic[BLOCK];
    int slides[BLOCK];
} extra_block;

/* The pointers of the loop, so that no store makes the compiler read one again. */
typedef struct arrays {
    const double (*restrict pos)[4];
    const double (*restrict vel)[8];
    double (*restrict force)[8];
    const int *restrict material;
    const size_t *restrict row;
    const uint32_t *restrict slot; /* particle of a row, NULL: the same */
    const uint32_t *restrict entry;
    const double (*restrict shift)[4];
    uint8_t *restrict touch;
    size_t n_own; /* particles; those behind are ghosts */
} arrays;

/* Place in the ring of the contact k of the last sum. */
DEM_INLINE size_t ring_at(const contact_stream *s, size_t k)
{
    return s->begin + k < s->size ? s->begin + k : s->begin + k - s->size;
}

/* Before the law: springs as they are. After it: what the models beyond it do; `x`, and the force
 * in `b`. In the scatter: that of pair c, whose place in the ring is `at`. */
void gather_extra(const block *b, extra_block *x, const contact_stream *s);
void apply_extra(block *b, extra_block *x, const arrays *a, pair_forces *job);
void scatter_extra(const block *b, const extra_block *x, const arrays *a, const contact_stream *s,
                   int c, size_t at);

#endif
