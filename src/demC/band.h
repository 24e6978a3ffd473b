/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * band.h - signed distances of a surface, sampled in a narrow band about it.
 */
#ifndef BAND_H
#define BAND_H

#include "sdf.h"
#include "surface.h"

enum {
    BRICK = 8,                                             /* cells along a side of a brick */
    BRICK_NODES = (BRICK + 1) * (BRICK + 1) * (BRICK + 1), /* faces belong to both neighbours */
    BRICK_WORDS = BRICK * BRICK * BRICK / 64
};

/* Arrays over bricks, sorted by part, z, y, x. Node (i, j, k) of a brick at place (a, b, c) is at
 * origin + spacing (8 a + i, 8 b + j, 8 c + k) and its value at [(k 9 + j) 9 + i]. */
typedef struct band {
    double origin[3], spacing, width; /* m */
    size_t n;
    int32_t (*place)[4];             /* [n], x, y, z, part */
    double (*value)[BRICK_NODES];    /* [n], m */
    uint64_t (*hidden)[BRICK_WORDS]; /* [n], a bit for each cell (k 8 + j) 8 + i */
    size_t n_side;
    int32_t (*side)[4]; /* [n_side], places of bricks of any part, sorted by z, y, x; last: whether
                           their face towards greater x is in free space */
    uint32_t *slot;     /* [mask + 1], hash table of brick + 1, 0: none */
    size_t mask;
} band;

/* Whether there is a brick of part `part` at x. */
int band_has(const band *b, int part, const double x[3]);
/* Value and gradient there; 0 where there is no brick, -1 where the part is hidden, else 1. hint:
 * what the last call for about that place left there, 0 at first; or NULL. */
int band_eval(const band *b, int part, const double x[3], double *phi, double g[3], uint32_t *hint);
/* Ask memory for what band_eval() will read. */
void band_fetch(const band *b, const double x[3], uint32_t hint);
/* Whether x, which has no brick, is in free space; `outer`: whether far away is. */
int band_is_free(const band *b, const double x[3], int outer);
size_t band_memory(const band *b);
void band_free(band *b);
/* Build the hash table; 0, or -1: out of memory. */
int band_index(band *b);

/* Sample a surface; NULL in error, with the reason in `message`. Collective where progress->sim has
 * several ranks: they share the work, and in error all get NULL. */
band *band_new(const surface *s, double spacing, double width, const sdf_progress *progress,
               char *message, size_t size);

/* Read from or write to the cache directory the samples that band_new would make. Reading gives
 * NULL without a message when there are none, with one when they cannot be used. */
band *band_read(const surface *s, double spacing, double width, const char *directory,
                char *message, size_t size);
int band_write(const band *b, const surface *s, const char *directory, char *message, size_t size);
/* Give all ranks of progress->sim what one of them has read; b is NULL on the others, and the
 * result NULL on all if it is on that one, too. Consumes b. Collective. */
band *band_share(band *b, const surface *s, double spacing, double width,
                 const sdf_progress *progress, dem_status *status, char *message, size_t size);

#endif
