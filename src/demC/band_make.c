/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * band_make.c - signed distances of a surface, sampled in a narrow band about it: making.
 *
 * Triangles are cut at their longest edges until they are of the size of a brick, and every brick
 * that a piece comes close to is noted in a hash set, so that the work grows with area and not with
 * volume. Of those the bricks are kept whose centre is near enough for some point of them to be
 * within the width. Then each node gets its distance by a search that starts at the triangle found
 * for the node before. The bricks are sorted, and what they hold depends on nothing but surface,
 * spacing and width.
 */
#include "band.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Places of bricks, without repetition. */
typedef struct places {
    int32_t (*at)[4]; /* [n] */
    size_t n, room;
    uint32_t *slot; /* [mask + 1], place + 1 */
    size_t mask;
} places;

static size_t hash_of(const int32_t c[4])
{
    uint64_t h = 1469598103934665603u;
    for (int k = 0; k < 4; k++) h = (h ^ (uint32_t)c[k]) * 0x9e3779b97f4a7c15u;
    return (size_t)(h >> 24);
}

static int grow(places *p)
{
    const size_t room = p->room ? 2 * p->room : 512;
    void *at = realloc(p->at, room * sizeof *p->at);
    if (at == NULL) return -1;
    p->at = at;
    p->room = room;
    free(p->slot);
    p->mask = 4 * room - 1;
    p->slot = calloc(p->mask + 1, sizeof *p->slot);
    if (p->slot == NULL) return -1;
    for (size_t i = 0; i < p->n; i++) {
        size_t k = hash_of(p->at[i]) & p->mask;
        while (p->slot[k] != 0) k = (k + 1) & p->mask;
        p->slot[k] = (uint32_t)i + 1;
    }
    return 0;
}

static int note(places *p, const int32_t c[4])
{
    if (p->n == p->room && grow(p)) return -1;
    size_t k = hash_of(c) & p->mask;
    for (; p->slot[k] != 0; k = (k + 1) & p->mask)
        if (memcmp(p->at[p->slot[k] - 1], c, sizeof *p->at) == 0) return 0;
    memcpy(p->at[p->n], c, sizeof *p->at);
    p->slot[k] = (uint32_t)++p->n;
    return 0;
}

static void places_free(places *p)
{
    free(p->at);
    free(p->slot);
}

/* Part, z, y, x. */
static int by_place(const void *left, const void *right)
{
    const int32_t *a = left, *b = right;
    for (int k = 3; k >= 0; k--)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

/* ---- which bricks ---------------------------------------------------------------------------- */

/* Note the bricks near a small triangle: near its box, and near its plane. */
static int note_near(const band *b, places *p, const double x[3][3], const double normal[3],
                     int32_t part)
{
    const double size = BRICK * b->spacing;
    const double thick =
        b->width + .5 * size * (fabs(normal[0]) + fabs(normal[1]) + fabs(normal[2]));
    int32_t low[3], high[3], c[4] = {0, 0, 0, part};
    for (int k = 0; k < 3; k++) {
        const double lo = fmin(fmin(x[0][k], x[1][k]), x[2][k]) - b->width;
        const double hi = fmax(fmax(x[0][k], x[1][k]), x[2][k]) + b->width;
        low[k] = (int32_t)floor((lo - b->origin[k]) / size);
        high[k] = (int32_t)floor((hi - b->origin[k]) / size);
    }
    for (c[2] = low[2]; c[2] <= high[2]; c[2]++)
        for (c[1] = low[1]; c[1] <= high[1]; c[1]++)
            for (c[0] = low[0]; c[0] <= high[0]; c[0]++) {
                double height = 0.;
                for (int k = 0; k < 3; k++)
                    height += normal[k] * (b->origin[k] + (c[k] + .5) * size - x[0][k]);
                if (fabs(height) <= thick * (1. + 1e-9) && note(p, c)) return -1;
            }
    return 0;
}

/* Cut a triangle in two at its longest edge while that is longer than two bricks. */
static int note_triangle(const band *b, places *p, const surface *s, size_t t, int32_t part)
{
    enum { STACK = 64 }; /* each cut adds one, and halves an edge every other time */
    double stack[STACK][3][3];
    const double limit = 2. * BRICK * b->spacing;
    int depth = 1;
    for (int v = 0; v < 3; v++) memcpy(stack[0][v], s->x[s->vertex[t][v]], sizeof stack[0][v]);
    while (depth > 0) {
        double x[3][3], longest = 0., middle[3];
        int edge = 0;
        memcpy(x, stack[--depth], sizeof x);
        for (int v = 0; v < 3; v++) {
            const double *a = x[v], *c = x[(v + 1) % 3];
            const double length = hypot(hypot(a[0] - c[0], a[1] - c[1]), a[2] - c[2]);
            if (length <= longest) continue;
            longest = length;
            edge = v;
        }
        if (longest <= limit || depth + 2 > STACK) {
            if (note_near(b, p, (const double(*)[3])x, s->normal[t], part)) return -1;
            continue;
        }
        const int other = (edge + 1) % 3;
        for (int k = 0; k < 3; k++) middle[k] = .5 * (x[edge][k] + x[other][k]);
        memcpy(stack[depth], x, sizeof x);
        memcpy(stack[depth++][other], middle, sizeof middle);
        memcpy(stack[depth], x, sizeof x);
        memcpy(stack[depth++][edge], middle, sizeof middle);
    }
    return 0;
}

/* Keep the bricks that reach into the band; their centres tell. */
static void sift(const band *b, places *p, const surface *s)
{
    size_t kept = 0;
    const double size = BRICK * b->spacing, reach = b->width + .5 * sqrt(3.) * size;
    for (size_t i = 0; i < p->n; i++) {
        double x[3];
        surface_hit hit = {.d2 = reach * reach};
        for (int k = 0; k < 3; k++) x[k] = b->origin[k] + (p->at[i][k] + .5) * size;
        if (surface_nearest(s, p->at[i][3], x, &hit))
            memmove(p->at[kept++], p->at[i], sizeof *p->at);
    }
    p->n = kept;
    if (kept > 0) qsort(p->at, kept, sizeof *p->at, by_place);
}

/* ---- values ---------------------------------------------------------------------------------- */

static void fill_brick(band *b, const surface *s, size_t i, uint32_t *hint)
{
    enum { ROW = BRICK + 1 };
    unsigned char hidden[BRICK_NODES];
    const int32_t *c = b->place[i];
    if (*hint < s->first[c[3]] || *hint >= s->first[c[3] + 1]) *hint = (uint32_t)s->first[c[3]];
    for (int n = 0; n < BRICK_NODES; n++) {
        const int at[3] = {n % ROW, n / ROW % ROW, n / (ROW * ROW)};
        double x[3];
        int veiled;
        for (int k = 0; k < 3; k++) x[k] = b->origin[k] + b->spacing * (BRICK * c[k] + at[k]);
        b->value[i][n] = surface_sample(s, c[3], x, &veiled, hint);
        hidden[n] = (unsigned char)veiled;
    }
    /* A cell is hidden when all its corners are. Across a ridge both parts have their feet on the
     * edge and the same distance: in a cell that is for either, the first of the two answers. */
    memset(b->hidden[i], 0, sizeof b->hidden[i]);
    for (int cell = 0; cell < BRICK * BRICK * BRICK; cell++) {
        const int n = (cell / (BRICK * BRICK) * ROW + cell / BRICK % BRICK) * ROW + cell % BRICK;
        int all = 1, later = 0;
        for (int corner = 0; corner < 8; corner++) {
            const int h =
                hidden[n + (corner & 1) + (corner >> 1 & 1) * ROW + (corner >> 2) * ROW * ROW];
            all &= h != 0;
            later |= h == 2;
        }
        if (all || later) b->hidden[i][cell / 64] |= (uint64_t)1 << (cell % 64);
    }
}

/* Places of bricks of any part, and on which side their faces towards greater x are. */
static int fill_sides(band *b, const surface *s)
{
    b->side = malloc(b->n * sizeof *b->side + 1);
    if (b->side == NULL) return -1;
    memcpy(b->side, b->place, b->n * sizeof *b->side);
    for (size_t i = 0; i < b->n; i++) b->side[i][3] = 0;
    if (b->n > 0) qsort(b->side, b->n, sizeof *b->side, by_place);
    for (size_t i = 0; i < b->n; i++) {
        const int32_t *c = b->side[i];
        if (i > 0 && memcmp(c, b->side[b->n_side - 1], 3 * sizeof *c) == 0) continue;
        memmove(b->side[b->n_side++], c, sizeof *b->side);
    }
    for (size_t i = 0; i < b->n_side; i++) {
        int32_t *c = b->side[i];
        double x[3], g[3];
        int part;
        for (int k = 0; k < 3; k++)
            x[k] = b->origin[k] + BRICK * b->spacing * (c[k] + (k == 0 ? 1. : .5));
        c[3] = surface_distance(s, x, g, &part) >= 0.;
    }
    return 0;
}

static int refuse(char *message, size_t size, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static int refuse(char *message, size_t size, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    if (size > 0) vsnprintf(message, size, format, list);
    va_end(list);
    return -1;
}

/* Too much is mostly a matter of units: say so before the memory is gone. */
static int affordable(const surface *s, const band *b, char *message, size_t size)
{
    const double side = BRICK * b->spacing;
    const double bricks = s->measure / (side * side) * (2. * b->width / side + 1.);
    const double bytes = bricks * (sizeof *b->value + sizeof *b->hidden + 2. * sizeof *b->place);
    const double there = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGE_SIZE);
    const double extent = fmax(fmax(s->hi[0] - s->lo[0], s->hi[1] - s->lo[1]), s->hi[2] - s->lo[2]);
    if (bytes < .8 * there && extent / b->spacing < 1e9) return 0;
    return refuse(message, size,
                  "its surface of %.3g m2 (extent %.3g m) sampled every %.3g m takes %.3g GB of "
                  "memory, there are %.3g: wrong units (scale), or too fine a spacing",
                  s->measure, extent, b->spacing, bytes / 1e9, there / 1e9);
}

band *band_new(const surface *s, double spacing, double width, const sdf_progress *progress,
               char *message, size_t size)
{
    places p = {.mask = 0};
    band *b = calloc(1, sizeof *b);
    int bad = b == NULL;
    if (!bad) {
        b->spacing = spacing;
        b->width = width;
        memcpy(b->origin, s->lo, sizeof b->origin);
        if (affordable(s, b, message, size)) {
            free(b);
            return NULL;
        }
    }
    for (int part = 0; part < s->parts && !bad; part++)
        for (size_t t = s->first[part]; t < s->first[part + 1] && !bad; t++)
            bad = note_triangle(b, &p, s, t, part);
    if (!bad) sift(b, &p, s);
    if (!bad) {
        b->n = p.n;
        b->value = malloc(b->n * sizeof *b->value + 1);
        b->hidden = malloc(b->n * sizeof *b->hidden + 1);
        b->place = malloc(b->n * sizeof *b->place + 1);
        bad = !b->value || !b->hidden || !b->place;
    }
    if (!bad) memcpy(b->place, p.at, b->n * sizeof *b->place);
    uint32_t hint = 0;
    for (size_t i = 0; i < p.n && !bad; i++) {
        fill_brick(b, s, i, &hint);
        if (progress && progress->call && (i % 64 == 63 || i + 1 == b->n))
            progress->call(progress->context, "sampling", (double)(i + 1) / (double)b->n);
    }
    places_free(&p);
    if (!bad && fill_sides(b, s) == 0 && band_index(b) == 0) return b;
    band_free(b);
    refuse(message, size, "out of memory");
    return NULL;
}
