/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * surface_parts.c - a surface of triangles: parted at its concave creases.
 *
 * Triangles are joined across every edge but those where the surface, seen from the free side,
 * bends towards the viewer by more than feature_angle; what hangs together is a part. A box seen
 * from within has six, from outside one; a drum of many facets one, its lifters one each.
 *
 * The two sides of a crease may hang together round some ridge, where the surface bends away as
 * sharply: those of a bin of thick sheets, round its rim. One contact could not feel both, and a
 * sphere in the corner would never come to rest. So patches without sharp edges are made first, and
 * those on both sides of a ridge are joined one after the other, unless a crease lies between what
 * they already hang together with. Lists of creases are merged into the longer one, which costs
 * n log n.
 *
 * A vertex on an edge that parts is there once for each part, with the normal of the part, in which
 * it goes on beyond its end, and that of the whole surface, which tells the side (a crease may end
 * at a vertex that sticks out).
 */
#include "surface_build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- parts ----------------------------------------------------------------------------------- */

static uint32_t root_of(uint32_t *label, uint32_t t)
{
    while (label[t] != t) {
        label[t] = label[label[t]];
        t = label[t];
    }
    return t;
}

static void join(uint32_t *label, uint32_t a, uint32_t b)
{
    a = root_of(label, a);
    b = root_of(label, b);
    if (a < b)
        label[b] = a;
    else
        label[a] = b;
}

enum { RIDGE = -1, SMOOTH, CREASE };

/* How the surface bends from t across its edge k to u, seen from the free side. */
static int bend_of(const builder *b, size_t t, int k, size_t u)
{
    double across[3] = {0., 0., 0.}, bend[3];
    const uint32_t a = b->vertex[t][k], c = b->vertex[t][(k + 1) % 3];
    for (int j = 0; j < 3; j++) {
        const uint32_t v = b->vertex[u][j];
        if (v == a || v == c) continue;
        minus(b->x[v], b->x[a], across);
    }
    cross(b->normal[t], b->normal[u], bend);
    const double angle = atan2(sqrt(dot(bend, bend)), dot(b->normal[t], b->normal[u]));
    if (!(angle > b->angle)) return SMOOTH;
    return dot(across, b->normal[t]) > 0. ? CREASE : RIDGE;
}

/* Patches: what hangs together without sharp edges. */
static void find_patches(builder *b)
{
    for (size_t t = 0; t < b->n; t++) b->label[t] = (uint32_t)t;
    for (size_t t = 0; t < b->n; t++)
        for (int k = 0; k < 3; k++) {
            const int32_t u = b->mate[t][k];
            b->bend[t][k] = u >= 0 ? (signed char)bend_of(b, t, k, (size_t)u) : SMOOTH;
            if (u >= 0 && b->bend[t][k] == SMOOTH) join(b->label, (uint32_t)t, (uint32_t)u);
        }
    for (size_t i = 0, j; i < b->n_edge; i = j) { /* edges of many triangles do not part */
        const edge *e = &b->edges[i];
        for (j = i + 1; j < b->n_edge && b->edges[j].a == e->a && b->edges[j].b == e->b;) j++;
        for (size_t k = 1; j - i > 2 && k < j - i; k++) join(b->label, e->triangle, e[k].triangle);
    }
}

/* Creases of what hangs together below a root: a list through the edges 3 t + k of the triangles on
 * this side. */
typedef struct creases {
    size_t *first, *last; /* [triangles], of roots; NONE: empty */
    size_t *count;
    size_t *next; /* [3 * triangles] */
} creases;

static const size_t NONE = SIZE_MAX;

static void creases_free(creases *c)
{
    free(c->first);
    free(c->last);
    free(c->count);
    free(c->next);
}

static int list_creases(builder *b, creases *c)
{
    c->first = malloc(b->n * sizeof *c->first + 1);
    c->last = malloc(b->n * sizeof *c->last + 1);
    c->count = calloc(b->n + 1, sizeof *c->count);
    c->next = malloc(3 * b->n * sizeof *c->next + 1);
    if (!c->first || !c->last || !c->count || !c->next) return -1;
    for (size_t t = 0; t < b->n; t++) c->first[t] = c->last[t] = NONE;
    for (size_t e = 0; e < 3 * b->n; e++) {
        c->next[e] = NONE;
        if (b->bend[e / 3][e % 3] != CREASE) continue;
        const uint32_t r = root_of(b->label, (uint32_t)(e / 3));
        if (c->first[r] == NONE)
            c->first[r] = e;
        else
            c->next[c->last[r]] = e;
        c->last[r] = e;
        c->count[r]++;
    }
    return 0;
}

/* Join what is below two roots, unless a crease lies between. */
static void join_roots(builder *b, creases *c, uint32_t p, uint32_t q)
{
    if (p == q) return;
    const uint32_t shorter = c->count[p] < c->count[q] ? p : q, other = shorter == p ? q : p;
    for (size_t e = c->first[shorter]; e != NONE; e = c->next[e])
        if (root_of(b->label, (uint32_t)b->mate[e / 3][e % 3]) == other) return;
    join(b->label, p, q);
    const uint32_t root = p < q ? p : q, gone = p < q ? q : p;
    if (c->first[root] == NONE)
        c->first[root] = c->first[gone];
    else
        c->next[c->last[root]] = c->first[gone];
    if (c->last[gone] != NONE) c->last[root] = c->last[gone];
    c->count[root] += c->count[gone];
}

/* Label the triangles with their parts, numbered by their first triangles: how many; 0: out of
 * memory. */
static int find_parts(builder *b)
{
    creases c = {NULL, NULL, NULL, NULL};
    find_patches(b);
    if (list_creases(b, &c)) {
        creases_free(&c);
        return 0;
    }
    for (size_t t = 0; t < b->n; t++)
        for (int k = 0; k < 3; k++)
            if (b->bend[t][k] == RIDGE)
                join_roots(b, &c, root_of(b->label, (uint32_t)t),
                           root_of(b->label, (uint32_t)b->mate[t][k]));
    creases_free(&c);
    for (size_t t = 0; t < b->n; t++) b->label[t] = root_of(b->label, (uint32_t)t);
    int parts = 0;
    for (size_t t = 0; t < b->n; t++) /* a root is the lowest of its part */
        b->place[t] = b->label[t] == t ? (uint32_t)parts++ : b->place[b->label[t]];
    memcpy(b->label, b->place, b->n * sizeof *b->label);
    return parts;
}

/* ---- the surface ----------------------------------------------------------------------------- */

static void *table(size_t n, size_t size)
{
    return calloc(n ? n : 1, size);
}

/* Triangles by part; vertices once for each part. */
static int sort_by_part(builder *b, surface *s)
{
    uint32_t *seen = table(b->n_vertex, sizeof *seen), *last = table(b->n_vertex, sizeof *last);
    uint32_t *source = table(b->n, sizeof *source);
    if (!seen || !last || !source) {
        free(seen);
        free(last);
        free(source);
        return -1;
    }
    for (size_t t = 0; t < b->n; t++) s->first[b->label[t] + 1]++;
    for (int p = 0; p < s->parts; p++) s->first[p + 1] += s->first[p];
    for (size_t t = 0; t < b->n; t++) { /* first[p] is where the next one of p goes */
        b->place[t] = (uint32_t)s->first[b->label[t]]++;
        source[b->place[t]] = (uint32_t)t;
    }
    for (int p = s->parts; p > 0; p--) s->first[p] = s->first[p - 1];
    s->first[0] = 0;
    for (size_t i = 0; i < b->n; i++) {
        const uint32_t t = source[i], part = b->label[t];
        memcpy(s->normal[i], b->normal[t], sizeof *s->normal);
        for (int k = 0; k < 3; k++) {
            const uint32_t v = b->vertex[t][k];
            const int32_t u = b->mate[t][k];
            const int parted = u >= 0 && b->label[u] != part;
            if (seen[v] != part + 1) {
                seen[v] = part + 1;
                last[v] = (uint32_t)s->n_vertex++;
                b->base[last[v]] = v;
                memcpy(s->x[last[v]], b->x[v], sizeof *s->x);
            }
            s->vertex[i][k] = last[v];
            const int32_t there = u < 0 ? RIM : (int32_t)b->place[u];
            s->beyond[i][k] = parted ? ACROSS - there : there;
        }
    }
    free(seen);
    free(last);
    free(source);
    return 0;
}

/* Angle-weighted normals of vertices, area and extent. */
static void measure(const builder *b, surface *s, double (*whole)[3])
{
    for (int k = 0; k < 3; k++) {
        s->lo[k] = INFINITY;
        s->hi[k] = -INFINITY;
    }
    for (size_t t = 0; t < s->n; t++)
        for (int k = 0; k < 3; k++) {
            const uint32_t v = s->vertex[t][k], w = s->vertex[t][(k + 1) % 3];
            double a[3], c[3], n[3];
            minus(s->x[w], s->x[v], a);
            minus(s->x[s->vertex[t][(k + 2) % 3]], s->x[v], c);
            cross(a, c, n);
            const double twice = sqrt(dot(n, n)), angle = atan2(twice, dot(a, c));
            if (k == 0) s->measure += .5 * twice;
            if (s->beyond[t][k] <= ACROSS) {
                const unsigned char kind = surface_is_ridge(s, t, k) ? ON_RIDGE : ON_CREASE;
                s->on_crease[v] |= kind;
                s->on_crease[w] |= kind;
            }
            for (int i = 0; i < 3; i++) {
                s->own[v][i] += angle * s->normal[t][i];
                whole[b->base[v]][i] += angle * s->normal[t][i];
                s->lo[i] = fmin(s->lo[i], s->x[v][i]);
                s->hi[i] = fmax(s->hi[i], s->x[v][i]);
            }
        }
    for (size_t v = 0; v < s->n_vertex; v++) memcpy(s->tip[v], whole[b->base[v]], sizeof *s->tip);
}

typedef struct tie {
    uint32_t a, b;
} tie;

static int by_tie(const void *left, const void *right)
{
    const tie *p = left, *q = right;
    if (p->a != q->a) return p->a < q->a ? -1 : 1;
    return (p->b > q->b) - (p->b < q->b);
}

/* Ties between parts that share a vertex on a crease: sorted, without repetition. */
static tie *find_ties(const builder *b, const surface *s, size_t *n_tie)
{
    size_t n = 0, room = 0;
    tie *at = malloc((s->n * 3 + 1) * sizeof *at); /* vertex, part */
    for (size_t t = 0, p = 0; t < s->n && at != NULL; t++) {
        while (t >= s->first[p + 1]) p++;
        for (int k = 0; k < 3; k++)
            if (s->on_crease[s->vertex[t][k]])
                at[n++] = (tie){b->base[s->vertex[t][k]], (uint32_t)p};
    }
    if (at == NULL) return NULL;
    qsort(at, n, sizeof *at, by_tie);
    size_t kept = 0;
    for (size_t i = 0; i < n; i++)
        if (i == 0 || by_tie(&at[i - 1], &at[i]) != 0) at[kept++] = at[i];
    for (size_t i = 0, j; i < kept; i = j) {
        for (j = i; j < kept && at[j].a == at[i].a;) j++;
        room += (j - i) * (j - i - 1);
    }
    tie *ties = malloc((room + 1) * sizeof *ties);
    *n_tie = 0;
    for (size_t i = 0, j; i < kept && ties != NULL; i = j) {
        for (j = i; j < kept && at[j].a == at[i].a;) j++;
        for (size_t p = i; p < j; p++)
            for (size_t q = i; q < j; q++)
                if (p != q) ties[(*n_tie)++] = (tie){at[p].b, at[q].b};
    }
    free(at);
    if (ties != NULL) qsort(ties, *n_tie, sizeof *ties, by_tie);
    return ties;
}

static int find_touching(const builder *b, surface *s)
{
    size_t n, kept = 0;
    tie *ties = find_ties(b, s, &n);
    if (ties == NULL) return -1;
    s->touching = table(n, sizeof *s->touching);
    for (size_t i = 0; i < n && s->touching != NULL; i++) {
        if (i > 0 && by_tie(&ties[i - 1], &ties[i]) == 0) continue;
        s->touching[kept++] = (int)ties[i].b;
        s->touching_first[ties[i].a + 1] = kept;
    }
    for (int p = 0; p < s->parts; p++)
        if (s->touching_first[p + 1] < s->touching_first[p])
            s->touching_first[p + 1] = s->touching_first[p];
    free(ties);
    return s->touching == NULL ? -1 : 0;
}

int surface_assemble(builder *b, surface *s)
{
    s->n = b->n;
    s->parts = find_parts(b);
    if (s->parts == 0) return -1;
    s->x = table(3 * s->n, sizeof *s->x);
    s->tip = table(3 * s->n, sizeof *s->tip);
    s->own = table(3 * s->n, sizeof *s->own);
    s->on_crease = table(3 * s->n, 1);
    s->vertex = table(s->n, sizeof *s->vertex);
    s->beyond = table(s->n, sizeof *s->beyond);
    s->normal = table(s->n, sizeof *s->normal);
    s->first = table((size_t)s->parts + 1, sizeof *s->first);
    s->touching_first = table((size_t)s->parts + 1, sizeof *s->touching_first);
    if (!s->x || !s->tip || !s->own || !s->on_crease || !s->vertex || !s->beyond || !s->normal ||
        !s->first || !s->touching_first || sort_by_part(b, s))
        return -1;
    double(*whole)[3] = calloc(b->n_vertex, sizeof *whole); /* by welded vertex */
    if (whole == NULL) return -1;
    measure(b, s, whole);
    free(whole);
    return find_touching(b, s) || surface_index(s) ? -1 : 0;
}
