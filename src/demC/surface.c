/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * surface.c - a surface of triangles: welded, checked, oriented.
 *
 * Corners that are the same point to single precision become one vertex. Then every edge must have
 * two triangles that run through it in opposite ways: the surface is closed and oriented, and the
 * sign of the distance is told by the pseudonormal of the nearest face, edge or vertex (Baerentzen
 * & Aanaes). With `mend`, edges may also have one triangle (a hole) or more than two, and the side
 * is told by the winding number (surface_search.c). A closed surface of negative volume was
 * inside out and is turned about. Zero area means a height that single precision cannot tell
 * from zero: such a triangle has no normal, and is refused.
 *
 * Reference: J. A. Baerentzen & H. Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243,
 * doi:10.1109/TVCG.2005.49.
 */
#include "surface_build.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Relative to the size of the surface; single precision has 6e-8. */
static const double WELD = 2e-7;
/* Height of a triangle by its longest edge that counts as none. */
static const double FLAT = 1e-7;

static int __attribute__((format(printf, 2, 3))) refuse(builder *b, const char *format, ...)
{
    char why[320];
    va_list list;
    va_start(list, format);
    vsnprintf(why, sizeof why, format, list);
    va_end(list);
    if (b->size > 0) snprintf(b->message, b->size, "%s: %s", b->name, why);
    return -1;
}

/* ---- welding --------------------------------------------------------------------------------- */

typedef struct weld {
    double cell, tolerance, lo[3];
    uint32_t *head, *next; /* chains of vertices by cell; UINT32_MAX ends one */
    size_t mask;
} weld;

static size_t hash_cell(const weld *w, const int64_t c[3])
{
    uint64_t h = (uint64_t)c[0] * 0x9e3779b97f4a7c15u ^ (uint64_t)c[1] * 0xc2b2ae3d27d4eb4fu ^
                 (uint64_t)c[2] * 0x165667b19e3779f9u;
    h ^= h >> 29;
    return (size_t)(h * 0xbf58476d1ce4e5b9u >> 20) & w->mask;
}

/* The lowest vertex within the tolerance, or UINT32_MAX. */
static uint32_t find_vertex(const builder *b, const weld *w, const double x[3])
{
    int64_t low[3], high[3], c[3];
    uint32_t found = UINT32_MAX;
    for (int k = 0; k < 3; k++) {
        low[k] = (int64_t)floor((x[k] - w->tolerance - w->lo[k]) / w->cell);
        high[k] = (int64_t)floor((x[k] + w->tolerance - w->lo[k]) / w->cell);
    }
    for (c[0] = low[0]; c[0] <= high[0]; c[0]++)
        for (c[1] = low[1]; c[1] <= high[1]; c[1]++)
            for (c[2] = low[2]; c[2] <= high[2]; c[2]++)
                for (uint32_t v = w->head[hash_cell(w, c)]; v != UINT32_MAX; v = w->next[v])
                    if (v < found && fabs(b->x[v][0] - x[0]) <= w->tolerance &&
                        fabs(b->x[v][1] - x[1]) <= w->tolerance &&
                        fabs(b->x[v][2] - x[2]) <= w->tolerance)
                        found = v;
    return found;
}

static int weld_corners(builder *b, const soup *s)
{
    double hi[3], extent = 0.;
    weld w = {.mask = 1023};
    for (int k = 0; k < 3; k++) {
        w.lo[k] = hi[k] = s->x[0][0][k];
        for (size_t i = 0; i < 3 * s->n; i++) {
            w.lo[k] = fmin(w.lo[k], s->x[i / 3][i % 3][k]);
            hi[k] = fmax(hi[k], s->x[i / 3][i % 3][k]);
        }
        extent = fmax(extent, hi[k] - w.lo[k]);
    }
    if (!(extent > 0.) || !isfinite(extent)) return refuse(b, "its extent is %g m", extent);
    w.tolerance = WELD * extent;
    w.cell = 4. * w.tolerance;
    while (w.mask < 3 * s->n) w.mask = 2 * w.mask + 1;
    w.head = malloc((w.mask + 1) * sizeof *w.head);
    w.next = malloc(3 * s->n * sizeof *w.next);
    const int failed = w.head == NULL || w.next == NULL;
    if (!failed) memset(w.head, 0xff, (w.mask + 1) * sizeof *w.head);
    for (size_t i = 0; i < 3 * s->n && !failed; i++) {
        const double *x = s->x[i / 3][i % 3];
        uint32_t v = find_vertex(b, &w, x);
        if (v == UINT32_MAX) {
            v = (uint32_t)b->n_vertex++;
            int64_t c[3];
            for (int k = 0; k < 3; k++) c[k] = (int64_t)floor((x[k] - w.lo[k]) / w.cell);
            memcpy(b->x[v], x, sizeof *b->x);
            uint32_t *head = &w.head[hash_cell(&w, c)];
            w.next[v] = *head;
            *head = v;
        }
        b->vertex[i / 3][i % 3] = v;
    }
    free(w.head);
    free(w.next);
    return failed ? refuse(b, "out of memory") : 0;
}

/* ---- checks ---------------------------------------------------------------------------------- */

static int find_normals(builder *b)
{
    size_t flat = 0, first = 0;
    for (size_t t = 0; t < b->n; t++) {
        double e[3][3], n[3], longest2 = 0.;
        for (int k = 0; k < 3; k++) {
            minus(b->x[b->vertex[t][(k + 1) % 3]], b->x[b->vertex[t][k]], e[k]);
            longest2 = fmax(longest2, dot(e[k], e[k]));
        }
        cross(e[0], e[1], n);
        const double twice = sqrt(dot(n, n));
        if (!(twice > FLAT * longest2) && flat++ == 0) first = t;
        /* No 0/0 for a flat one, which is refused below: some programs trap it. */
        for (int k = 0; k < 3; k++) b->normal[t][k] = twice > 0 ? n[k] / twice : 0;
    }
    if (flat == 0) return 0;
    const double *x = b->x[b->vertex[first][0]];
    return refuse(b, "%zu of %zu triangles have no area, the first is number %zu at (%g %g %g) m",
                  flat, b->n, first, x[0], x[1], x[2]);
}

static int by_vertices(const void *left, const void *right)
{
    const edge *a = left, *b = right;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    if (a->b != b->b) return a->b < b->b ? -1 : 1;
    return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

/* Edges in order of their vertices; mates of those that have two triangles. */
static int pair_edges(builder *b)
{
    size_t open = 0, many = 0, alike = 0;
    const edge *first_open = NULL, *first_many = NULL, *first_alike = NULL;
    for (size_t i = 0; i < b->n_edge; i++) {
        const size_t t = i / 3;
        const int k = (int)(i % 3);
        const uint32_t from = b->vertex[t][k], to = b->vertex[t][(k + 1) % 3];
        b->edges[i] =
            (edge){from < to ? from : to, from < to ? to : from, (uint32_t)t, k, from < to};
        b->mate[t][k] = RIM;
    }
    qsort(b->edges, b->n_edge, sizeof *b->edges, by_vertices);
    for (size_t i = 0, j; i < b->n_edge; i = j) {
        const edge *e = &b->edges[i];
        for (j = i + 1; j < b->n_edge && b->edges[j].a == e->a && b->edges[j].b == e->b; j++) {
        }
        if (j - i == 1 && open++ == 0) first_open = e;
        if (j - i > 2 && many++ == 0) first_many = e;
        if (j - i != 2) continue;
        if (e[0].forward == e[1].forward && alike++ == 0) first_alike = e;
        b->mate[e[0].triangle][e[0].k] = (int32_t)e[1].triangle;
        b->mate[e[1].triangle][e[1].k] = (int32_t)e[0].triangle;
    }
    b->n_open = open + many;
    const edge *e = first_alike ? first_alike : first_many ? first_many : first_open;
    if (e == NULL || (b->mend && !alike)) return 0;
    const double *p = b->x[e->a], *q = b->x[e->b];
    const double at[3] = {.5 * (p[0] + q[0]), .5 * (p[1] + q[1]), .5 * (p[2] + q[2])};
    if (alike)
        return refuse(b,
                      "not oriented: at %zu edges, the first at (%g %g %g) m, one triangle "
                      "faces out and its neighbour in",
                      alike, at[0], at[1], at[2]);
    if (many)
        return refuse(b,
                      "not a simple surface: %zu edges, the first at (%g %g %g) m, have more "
                      "than two triangles (mend accepts them)",
                      many, at[0], at[1], at[2]);
    return refuse(b,
                  "not closed: %zu edges, the first at (%g %g %g) m, have one triangle only "
                  "(mend accepts holes)",
                  open, at[0], at[1], at[2]);
}

static double volume(const builder *b)
{
    double sum = 0.;
    for (size_t t = 0; t < b->n; t++) {
        double p[3], q[3], r[3], n[3]; /* from one vertex: no cancellation far from the origin */
        minus(b->x[b->vertex[t][0]], b->x[0], p);
        minus(b->x[b->vertex[t][1]], b->x[0], q);
        minus(b->x[b->vertex[t][2]], b->x[0], r);
        cross(p, q, n);
        sum += dot(n, r) / 6.;
    }
    return sum;
}

/* Turn the surface about. Edge k of a triangle becomes edge (1 - k) mod 3 ... of 0 2 1: 0-2 was
 * edge 2, 2-1 was edge 1, 1-0 was edge 0. */
static void turn_about(builder *b)
{
    for (size_t t = 0; t < b->n; t++) {
        const uint32_t v = b->vertex[t][1];
        const int32_t m = b->mate[t][0];
        b->vertex[t][1] = b->vertex[t][2];
        b->vertex[t][2] = v;
        b->mate[t][0] = b->mate[t][2];
        b->mate[t][2] = m;
        for (int k = 0; k < 3; k++) b->normal[t][k] = -b->normal[t][k];
    }
}

/* ---- the surface ----------------------------------------------------------------------------- */

static void *table(size_t n, size_t size)
{
    return calloc(n ? n : 1, size);
}

static void builder_free(builder *b)
{
    free(b->x);
    free(b->vertex);
    free(b->normal);
    free(b->mate);
    free(b->bend);
    free(b->label);
    free(b->place);
    free(b->base);
    free(b->edges);
}

surface *surface_new(const soup *soup, const char *name, int inside, int mend, double angle,
                     char *message, size_t size)
{
    const size_t n = soup->n;
    builder b = {.name = name, .message = message, .size = size, .mend = mend, .angle = angle};
    surface *s = calloc(1, sizeof *s);
    b.n = n;
    b.n_edge = 3 * n;
    b.x = table(3 * n, sizeof *b.x);
    b.vertex = table(n, sizeof *b.vertex);
    b.normal = table(n, sizeof *b.normal);
    b.mate = table(n, sizeof *b.mate);
    b.bend = table(n, sizeof *b.bend);
    b.label = table(n, sizeof *b.label);
    b.place = table(n, sizeof *b.place);
    b.base = table(3 * n, sizeof *b.base);
    b.edges = table(3 * n, sizeof *b.edges);
    int status = 0;
    if (!s || !b.x || !b.vertex || !b.normal || !b.mate || !b.bend || !b.label || !b.place ||
        !b.base || !b.edges)
        status = refuse(&b, "out of memory");
    if (!status) status = weld_corners(&b, soup);
    if (!status) status = find_normals(&b);
    if (!status) status = pair_edges(&b);
    if (!status && b.n_open == 0 && volume(&b) < 0.) {
        turn_about(&b);
        refuse(&b, "the surface was inside out (negative volume) and has been turned about");
    }
    if (!status && inside) turn_about(&b);
    if (!status) {
        s->inside = inside;
        s->mended = mend;
        s->feature_angle = angle;
        if (surface_assemble(&b, s)) status = refuse(&b, "out of memory");
    }
    builder_free(&b);
    if (!status) return s;
    surface_free(s);
    return NULL;
}

surface *surface_turned(const surface *s)
{
    char unused[8];
    soup soup = {.n = s->n, .x = malloc(s->n * sizeof *soup.x)};
    if (soup.x == NULL) return NULL;
    for (size_t t = 0; t < s->n; t++) /* outward again */
        for (int k = 0; k < 3; k++)
            memcpy(soup.x[t][s->inside ? (3 - k) % 3 : k], s->x[s->vertex[t][k]], sizeof *s->x);
    surface *turned =
        surface_new(&soup, "", !s->inside, s->mended, s->feature_angle, unused, sizeof unused);
    soup_free(&soup);
    return turned;
}

void surface_free(surface *s)
{
    if (s == NULL) return;
    free(s->x);
    free(s->tip);
    free(s->own);
    free(s->on_crease);
    free(s->vertex);
    free(s->beyond);
    free(s->normal);
    free(s->first);
    free(s->touching_first);
    free(s->touching);
    free(s->node);
    free(s->dipole);
    free(s->root);
    free(s);
}
