/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * stlFixture.h - triangulated bodies for tests, and STL files of them. Include after cmocka.h.
 */
#ifndef STL_FIXTURE_H
#define STL_FIXTURE_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dem.h"

/* Triangles, corners anticlockwise seen from outside. */
typedef struct body {
    size_t n, room;
    double (*x)[3][3];
} body;

static inline void body_free(body *b)
{
    free(b->x);
    memset(b, 0, sizeof *b);
}

static inline void add_triangle(body *b, const double p[3], const double q[3], const double r[3])
{
    if (b->n == b->room) {
        b->room = b->room ? 2 * b->room : 64;
        b->x = realloc(b->x, b->room * sizeof *b->x);
        assert_non_null(b->x);
    }
    memcpy(b->x[b->n][0], p, sizeof b->x[0][0]);
    memcpy(b->x[b->n][1], q, sizeof b->x[0][0]);
    memcpy(b->x[b->n++][2], r, sizeof b->x[0][0]);
}

/* The parallelogram p + s a + t b, 0 <= s, t <= 1, in n x n halved cells; its normal is a x b. */
static inline void add_face(body *body, const double p[3], const double a[3], const double b[3],
                            int n)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double c[4][3];
            for (int v = 0; v < 4; v++)
                for (int k = 0; k < 3; k++)
                    c[v][k] = p[k] + a[k] * (i + (v == 1 || v == 2)) / n + b[k] * (j + (v > 1)) / n;
            add_triangle(body, c[0], c[1], c[2]);
            add_triangle(body, c[0], c[2], c[3]);
        }
}

static inline body box_body(const double lo[3], const double hi[3], int n)
{
    body b = {0, 0, NULL};
    for (int a = 0; a < 3; a++)
        for (int upper = 0; upper < 2; upper++) {
            const int u = (a + 1) % 3, v = (a + 2) % 3;
            double p[3], s[3] = {0, 0, 0}, t[3] = {0, 0, 0};
            memcpy(p, lo, sizeof p);
            if (upper) p[a] = hi[a];
            s[u] = hi[u] - lo[u];
            t[v] = hi[v] - lo[v];
            add_face(&b, p, upper ? s : t, upper ? t : s, n);
        }
    return b;
}

/* A torus about z; with radius `ring` = 0 a sphere is not meant: use ball_body. */
static inline body torus_body(double ring, double tube, int m, int n)
{
    const double pi = acos(-1.);
    body b = {0, 0, NULL};
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            double c[4][3];
            for (int v = 0; v < 4; v++) {
                const double p = 2. * pi * ((i + (v == 1 || v == 2)) % m) / m,
                             q = 2. * pi * ((j + (v > 1)) % n) / n, s = ring + tube * cos(q);
                c[v][0] = s * cos(p);
                c[v][1] = s * sin(p);
                c[v][2] = tube * sin(q);
            }
            add_triangle(&b, c[0], c[1], c[2]);
            add_triangle(&b, c[0], c[2], c[3]);
        }
    return b;
}

/* An octahedron whose faces are cut in n^2 and blown up to a sphere; `rough` roughens it by waves
 * into a body that is not convex. */
static inline body ball_body(const double centre[3], double radius, int n, double rough)
{
    body b = {0, 0, NULL};
    for (int octant = 0; octant < 8; octant++)
        for (int i = 0; i < n; i++)
            for (int j = 0; i + j < n; j++)
                for (int half = 0; half < (i + j + 1 < n ? 2 : 1); half++) {
                    const int u[3] = {i + half, i + 1, i}, w[3] = {j + half, j, j + 1};
                    const int order = octant == 0 || octant == 3 || octant == 5 || octant == 6;
                    double c[3][3];
                    for (int v = 0; v < 3; v++) {
                        double d[3] = {u[v], w[v], n - u[v] - w[v]}, l = 0.;
                        for (int k = 0; k < 3; k++) {
                            if (octant >> k & 1) d[k] = -d[k];
                            l += d[k] * d[k];
                        }
                        l = sqrt(l);
                        const double r = radius * (1. + rough * sin(5.1 * d[0] / l) *
                                                            cos(3.7 * d[1] / l + 6.3 * d[2] / l));
                        for (int k = 0; k < 3; k++) c[v][k] = centre[k] + r * d[k] / l;
                    }
                    /* (i+1,j+1), (i+1,j), (i,j+1) turn the other way than (i,j), ... */
                    if (order != half)
                        add_triangle(&b, c[0], c[1], c[2]);
                    else
                        add_triangle(&b, c[0], c[2], c[1]);
                }
    return b;
}

/* Turn by `angle` about an odd axis and shift. */
static inline void move_body(body *b, double angle, const double shift[3])
{
    const double length = sqrt(.3 * .3 + .9 * .9 + .5 * .5), c = cos(angle), s = sin(angle);
    const double a[3] = {.3 / length, -.9 / length, .5 / length};
    for (size_t i = 0; i < 3 * b->n; i++) {
        double *x = b->x[i / 3][i % 3], y[3];
        const double along = a[0] * x[0] + a[1] * x[1] + a[2] * x[2];
        for (int k = 0; k < 3; k++) {
            const int p = (k + 1) % 3, q = (k + 2) % 3;
            y[k] = c * x[k] + (1. - c) * along * a[k] + s * (a[p] * x[q] - a[q] * x[p]) + shift[k];
        }
        memcpy(x, y, sizeof y);
    }
}

static inline double body_volume(const body *b)
{
    double sum = 0.;
    for (size_t i = 0; i < b->n; i++) {
        const double *p = b->x[i][0], *q = b->x[i][1], *r = b->x[i][2];
        for (int k = 0; k < 3; k++)
            sum += p[k] * (q[(k + 1) % 3] * r[(k + 2) % 3] - q[(k + 2) % 3] * r[(k + 1) % 3]) / 6.;
    }
    return sum;
}

/* A file name of this process in the directory of temporary files. */
static inline const char *scratch_path(const char *name)
{
    static char path[4][512];
    static int next;
    const char *folder = getenv("TMPDIR");
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/felmi-%ld-%s", folder ? folder : "/tmp",
             (long)getpid(), name);
    return path[next];
}

/* Coordinates with all digits of a double, so that a flat face stays flat. */
static inline void write_ascii(const body *b, const char *path)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fprintf(f, "solid body\n");
    for (size_t i = 0; i < b->n; i++) {
        fprintf(f, " facet normal 0 0 0\n  outer loop\n");
        for (int v = 0; v < 3; v++)
            fprintf(f, "   vertex %.17g %.17g %.17g\n", b->x[i][v][0], b->x[i][v][1],
                    b->x[i][v][2]);
        fprintf(f, "  endloop\n endfacet\n");
    }
    fprintf(f, "endsolid body\n");
    assert_int_equal(fclose(f), 0);
}

static inline void put_little(FILE *f, uint32_t u, int bytes)
{
    for (int k = 0; k < bytes; k++) fputc((int)(u >> (8 * k) & 255), f);
}

static inline void write_binary(const body *b, const char *path, const char *header)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    for (int k = 0; k < 80; k++) fputc(k < (int)strlen(header) ? header[k] : 0, f);
    put_little(f, (uint32_t)b->n, 4);
    for (size_t i = 0; i < b->n; i++) {
        for (int k = 0; k < 3; k++) put_little(f, 0, 4);
        for (int k = 0; k < 9; k++) {
            const float value = (float)b->x[i][k / 3][k % 3];
            uint32_t bits;
            memcpy(&bits, &value, sizeof bits);
            put_little(f, bits, 4);
        }
        put_little(f, 0, 2);
    }
    assert_int_equal(fclose(f), 0);
}

/* The body as a shape, by way of a file. Fails the test with the reader's message. */
static inline dem_sdf *stl_shape(const body *b, int inside)
{
    const char *path = scratch_path("body.stl");
    char message[256];
    dem_stl stl = dem_stl_default();
    stl.path = path;
    stl.inside = inside;
    write_ascii(b, path);
    dem_sdf *s = dem_sdf_stl(&stl, message, sizeof message);
    if (s == NULL) print_error("%s\n", message);
    assert_non_null(s);
    remove(path);
    return s;
}

#endif
