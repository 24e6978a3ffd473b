/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * stl.c - triangles from an STL file, ASCII or binary.
 *
 *     binary: 80 bytes of anything, uint32 n, n times { float normal[3], corner[3][3]; uint16 }
 *     ASCII:  solid [name] { facet normal a b c outer loop 3 x { vertex x y z } endloop endfacet }
 *             endsolid [name], any number of solids one after the other
 *
 * all little-endian. Binary headers may begin with "solid", so the size decides first: a file of
 * exactly 84 + 50 n bytes is binary. Else it is ASCII when it begins with "solid" and its first
 * bytes are text; what remains is a binary file that is cut short or has too much. Normals are not
 * used: the order of the corners has the orientation.
 *
 * Reference: M. Burns, Automated Fabrication, Prentice Hall (1993), section 6.5.
 */
#include "stl.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { HEADER = 84, RECORD = 50 };

typedef struct reader {
    const char *path;
    char *text; /* [size], and a zero after it */
    size_t size;
    const char *at; /* ASCII: where we are */
    long line;
    double scale;
    soup *soup;
    size_t capacity;
    char *message;
    size_t message_size;
} reader;

static int __attribute__((format(printf, 2, 3))) refuse(reader *r, const char *format, ...)
{
    char why[256];
    va_list list;
    va_start(list, format);
    vsnprintf(why, sizeof why, format, list);
    va_end(list);
    if (r->message_size > 0) snprintf(r->message, r->message_size, "%s: %s", r->path, why);
    return -1;
}

void soup_free(soup *s)
{
    free(s->x);
    memset(s, 0, sizeof *s);
}

static int read_all(reader *r)
{
    FILE *f = fopen(r->path, "rb");
    if (f == NULL) return refuse(r, "cannot be opened: %s", strerror(errno));
    size_t room = 1 << 16, got;
    r->text = malloc(room + 1);
    while (r->text != NULL) {
        got = fread(r->text + r->size, 1, room - r->size, f);
        r->size += got;
        if (r->size < room) break;
        room *= 2;
        char *grown = realloc(r->text, room + 1);
        if (grown == NULL) free(r->text);
        r->text = grown;
    }
    const int bad = ferror(f), why = errno;
    fclose(f);
    if (r->text == NULL) return refuse(r, "out of memory");
    if (bad) return refuse(r, "cannot be read: %s", strerror(why));
    if (r->size == 0) return refuse(r, "the file is empty");
    r->text[r->size] = '\0';
    return 0;
}

static int append(reader *r, const double x[3][3])
{
    soup *s = r->soup;
    if (s->n == r->capacity) {
        const size_t room = r->capacity ? 2 * r->capacity : 256;
        void *grown = realloc(s->x, room * sizeof *s->x);
        if (grown == NULL) return refuse(r, "out of memory");
        s->x = grown;
        r->capacity = room;
    }
    memcpy(s->x[s->n++], x, sizeof *s->x);
    return 0;
}

/* ---- binary ---------------------------------------------------------------------------------- */

static uint32_t little(const char *bytes)
{
    const unsigned char *b = (const unsigned char *)bytes;
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static int read_binary(reader *r)
{
    if (r->size < HEADER)
        return refuse(r,
                      "neither ASCII STL (no \"solid\" with facets) nor binary STL (%zu bytes, "
                      "but its header alone has %d)",
                      r->size, HEADER);
    const uint32_t n = little(r->text + 80);
    const size_t held = (r->size - HEADER) / RECORD, wanted = HEADER + (size_t)n * RECORD;
    if (r->size < wanted)
        return refuse(r,
                      "binary STL cut short: its header promises %u triangles (%zu bytes), the "
                      "file holds %zu (%zu bytes)",
                      (unsigned)n, wanted, held, r->size);
    if (r->size > wanted)
        return refuse(r, "binary STL with %zu bytes after its %u triangles: damaged, or no STL",
                      r->size - wanted, (unsigned)n);
    for (uint32_t i = 0; i < n; i++) {
        double x[3][3];
        const char *record = r->text + HEADER + (size_t)i * RECORD;
        for (int k = 0; k < 9; k++) {
            const uint32_t bits = little(record + 12 + 4 * k);
            float value;
            memcpy(&value, &bits, sizeof value);
            if (!isfinite(value))
                return refuse(r, "triangle %u (byte %zu): coordinate %g is not a finite number",
                              (unsigned)i, HEADER + (size_t)i * RECORD + 12 + 4 * k, (double)value);
            x[k / 3][k % 3] = r->scale * (double)value;
        }
        if (append(r, (const double(*)[3])x)) return -1;
    }
    return 0;
}

/* ---- ASCII ----------------------------------------------------------------------------------- */

static void skip_blanks(reader *r)
{
    for (; isspace((unsigned char)*r->at); r->at++) r->line += *r->at == '\n';
}

static void skip_line(reader *r)
{
    while (*r->at != '\0' && *r->at != '\n') r->at++;
}

/* The next word as it stands in the text. */
static size_t word(reader *r, const char **begin)
{
    skip_blanks(r);
    *begin = r->at;
    while (*r->at != '\0' && !isspace((unsigned char)*r->at)) r->at++;
    return (size_t)(r->at - *begin);
}

static int is(const char *begin, size_t n, const char *keyword)
{
    return n == strlen(keyword) && strncasecmp(begin, keyword, n) == 0;
}

static int unexpected(reader *r, const char *begin, size_t n, const char *wanted)
{
    if (n == 0)
        return refuse(r, "line %ld: the file ends where \"%s\" should stand", r->line, wanted);
    return refuse(r, "line %ld: expected \"%s\", found \"%.*s\"", r->line, wanted,
                  n > 40 ? 40 : (int)n, begin);
}

static int expect(reader *r, const char *keyword)
{
    const char *begin;
    const size_t n = word(r, &begin);
    return is(begin, n, keyword) ? 0 : unexpected(r, begin, n, keyword);
}

static int number(reader *r, const char *what, int must_be_finite, double *value)
{
    const char *begin;
    char *end;
    const size_t n = word(r, &begin);
    if (n == 0) return unexpected(r, begin, n, what);
    *value = strtod(begin, &end);
    if (end != r->at) return unexpected(r, begin, n, what);
    if (must_be_finite && !isfinite(*value))
        return refuse(r, "line %ld, triangle %zu: coordinate \"%.*s\" is not a finite number",
                      r->line, r->soup->n, n > 40 ? 40 : (int)n, begin);
    return 0;
}

static int read_facet(reader *r)
{
    double x[3][3], unused;
    if (expect(r, "normal")) return -1;
    for (int k = 0; k < 3; k++)
        if (number(r, "component of a normal", 0, &unused)) return -1;
    if (expect(r, "outer") || expect(r, "loop")) return -1;
    for (int v = 0; v < 3; v++) {
        if (expect(r, "vertex")) return -1;
        for (int k = 0; k < 3; k++) {
            if (number(r, "coordinate", 1, &x[v][k])) return -1;
            x[v][k] *= r->scale;
        }
    }
    if (expect(r, "endloop") || expect(r, "endfacet")) return -1;
    return append(r, (const double(*)[3])x);
}

static int read_ascii(reader *r)
{
    r->at = r->text;
    r->line = 1;
    for (;;) {
        const char *begin;
        size_t n = word(r, &begin);
        if (n == 0 && r->at == r->text + r->size) return 0;
        if (!is(begin, n, "solid")) return unexpected(r, begin, n, "solid");
        skip_line(r); /* its name */
        while (n = word(r, &begin), is(begin, n, "facet"))
            if (read_facet(r)) return -1;
        if (!is(begin, n, "endsolid")) return unexpected(r, begin, n, "facet or endsolid");
        skip_line(r);
    }
}

/* Text that begins with "solid" and goes on with a facet or an end. */
static int looks_ascii(const reader *r)
{
    const char *p = r->text;
    while (isspace((unsigned char)*p)) p++;
    if (strncasecmp(p, "solid", 5) != 0) return 0;
    const size_t n = r->size < 512 ? r->size : 512;
    return memchr(r->text, '\0', n) == NULL;
}

int stl_read(const char *path, double scale, soup *s, char *message, size_t size)
{
    reader r = {.path = path, .scale = scale, .soup = s, .message = message, .message_size = size};
    memset(s, 0, sizeof *s);
    int status = read_all(&r);
    if (status == 0) {
        const size_t n = r.size >= HEADER ? little(r.text + 80) : 0;
        const int binary = r.size >= HEADER && r.size == HEADER + n * RECORD;
        status = binary || !looks_ascii(&r) ? read_binary(&r) : read_ascii(&r);
    }
    free(r.text);
    if (status == 0 && s->n == 0) status = refuse(&r, "no triangle in it");
    if (status == 0 && s->n > UINT32_MAX / 8)
        status = refuse(&r, "%zu triangles are too many", s->n);
    return status;
}
