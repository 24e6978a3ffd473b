/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * stlFuzz.c - random damage to valid STL files never crashes the reader.
 *
 * Bytes of ASCII and binary files are changed, removed, doubled and exchanged for pieces of the
 * format, with a fixed seed. What comes out is a shape that can be asked, or no shape and a reason.
 * Meant to run under the sanitizers.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "near.h"
#include "stlFixture.h"

enum { ROUNDS = 3000, ROOM = 1 << 14 };

static uint64_t state = 20260117;

/* xorshift64* (Vigna, ACM Trans. Math. Softw. 42 (2016) 30, doi:10.1145/2845077) */
static uint64_t random_number(uint64_t below)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (state * 2685821657736338717u >> 16) % below;
}

static const char *const pieces[] = {"solid",   "solid x\n", "facet",     "endfacet", "vertex ",
                                     "nan",     "-inf",      "1e999",     "endsolid", "\n",
                                     " 0 0 0 ", "normal",    "endloop\n", "\"",       "1e-320",
                                     "0x1p3 ",  "-",         "\xff\xff"};

static size_t damage(char *text, size_t n)
{
    const size_t at = random_number(n);
    size_t length = random_number(120);
    const char *piece = pieces[random_number(sizeof pieces / sizeof *pieces)];
    switch (random_number(5)) {
    case 0:
        text[at] = (char)random_number(256);
        return n;
    case 1:
        text[at] = (char)(text[at] ^ 1 << random_number(8));
        return n;
    case 2: /* remove */
        if (at + length > n) length = n - at;
        memmove(text + at, text + at + length, n - at - length);
        return n - length ? n - length : 1;
    case 3: /* insert */
        length = strlen(piece);
        if (n + length >= ROOM) return n;
        memmove(text + at + length, text + at, n - at);
        memcpy(text + at, piece, length);
        return n + length;
    default: /* copy from somewhere else */
        if (at + length > n) length = n - at;
        memmove(text + at, text + random_number(n - length + 1), length);
        return n;
    }
}

static size_t load(const char *path, char *text)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    const size_t n = fread(text, 1, ROOM, f);
    assert_true(n > 0 && n < ROOM);
    fclose(f);
    return n;
}

static void store(const char *path, const char *text, size_t n)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(text, 1, n, f), n);
    fclose(f);
}

static void test_fuzz(void **unused)
{
    (void)unused;
    static char valid[2][ROOM], text[ROOM];
    char path[512], message[256];
    size_t length[2];
    int shapes = 0;
    const double o[3] = {.1, .2, -.3};
    body b = ball_body(o, .4, 2, .1);
    snprintf(path, sizeof path, "%s", scratch_path("fuzz.stl"));
    write_ascii(&b, path);
    length[0] = load(path, valid[0]);
    write_binary(&b, path, "solid but binary");
    length[1] = load(path, valid[1]);
    body_free(&b);
    for (int round = 0; round < ROUNDS; round++) {
        const int which = round % 2;
        size_t n = length[which];
        memcpy(text, valid[which], n);
        for (uint64_t i = random_number(4); i > 0; i--) n = damage(text, n);
        store(path, text, n);
        dem_stl stl = dem_stl_default();
        stl.path = path;
        stl.inside = round % 3 == 0;
        stl.mend = round % 4 < 2;
        message[0] = '\0';
        dem_sdf *s = dem_sdf_stl(&stl, message, sizeof message);
        if (s == NULL) {
            assert_true(strlen(message) > strlen(path));
            continue;
        }
        shapes++;
        for (int q = 0; q < 5; q++) {
            double x[3], g[3];
            for (int k = 0; k < 3; k++) x[k] = (double)random_number(2000) / 1000. - 1.;
            assert_true(isfinite(dem_sdf_distance(s, x)));
            for (int p = 0; p < dem_sdf_parts(s); p++) {
                assert_true(isfinite(dem_sdf_eval(s, p, x, g)));
                assert_true(isfinite(g[0] + g[1] + g[2]));
            }
        }
        dem_sdf_free(s);
    }
    remove(path);
    print_message("%d of %d damaged files still gave shapes\n", shapes, (int)ROUNDS);
    assert_true(shapes > ROUNDS / 10 && shapes < ROUNDS * 9 / 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_fuzz)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
