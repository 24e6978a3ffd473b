/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseFuzz.c - random damage to valid dictionaries never crashes the reader.
 *
 * Bytes are changed, removed, doubled and exchanged for pieces of the grammar, with a fixed seed,
 * and the result is read and translated in every way. Meant to run under the sanitizers; without
 * them it still finds crashes, hangs and results that are neither an error nor a case.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseFixture.h"
#include "near.h"

static uint64_t state = 20260117;

/* xorshift64* (Vigna, ACM Trans. Math. Softw. 42 (2016) 30, doi:10.1145/2845077) */
static uint64_t random_number(uint64_t below)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (state * 2685821657736338717u >> 16) % below;
}

static const char *const pieces[] = {"{",          "}",           "(",
                                     ")",          ";",           "\"",
                                     "/*",         "*/",          "//",
                                     "\n",         "$",           "$..",
                                     "${",         "$:a.b",       "#include \"x\"",
                                     "#line 9\n",  "#calc",       "[0 1",
                                     "]",          "1e999",       "-",
                                     "nan",        "99999{1}",    "3(1 2 3)",
                                     "((",         "))",          "\\",
                                     "\xff",       "\x01",        "FoamFile",
                                     "$materials", "$insertion;", "\"(a*)*b\" 1;",
                                     "inside",     "uniform",     "0",
                                     "-1",         "type"};

static void damage(char *text, size_t *n, size_t room)
{
    size_t at = random_number(*n), length = random_number(30);
    const char *piece = pieces[random_number(sizeof pieces / sizeof *pieces)];
    switch (random_number(4)) {
    case 0:
        text[at] = (char)(1 + random_number(255));
        break;
    case 1: /* remove */
        if (at + length > *n) length = *n - at;
        memmove(text + at, text + at + length, *n - at - length);
        *n -= length;
        break;
    case 2: /* insert a piece of grammar */
        length = strlen(piece);
        if (*n + length >= room) break;
        memmove(text + at + length, text + at, *n - at);
        memcpy(text + at, piece, length);
        *n += length;
        break;
    default: /* double a part */
        if (at + length > *n || *n + length >= room) break;
        memmove(text + at + length, text + at, *n - at);
        *n += length;
    }
    if (*n == 0) text[(*n)++] = ' ';
    text[*n] = '\0';
}

static void translate(const case_dict *dict, case_errors *errors)
{
    case_mesh mesh = {.cells = {2, 3, 4}, .hi = {.1, .2, .4}, .spacing = {.05, .05, .1}};
    case_dem dem;
    cpl_param coupling;
    case_read_dem(dict, "/nonexistent", &mesh, (const double[]){0, 0, 0}, &dem, errors);
    case_read_coupling(dict, &coupling, errors);
    case_check(NULL, &mesh, &dem, &coupling, errors);
    case_dem_free(&dem, 1);
    for (size_t i = 0; i < case_dict_size(dict); i++) {
        double *value, vector[3];
        const char *key = case_dict_key(dict, i);
        case_numbers(dict, key, &value, errors);
        free(value);
        case_vector(dict, key, NULL, vector, errors);
        case_word(dict, key, NULL, 1, errors);
        case_list_at(dict, key, 1);
    }
}

static char *read_whole(const char *path, size_t *n, size_t room)
{
    char *text = malloc(room);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    *n = fread(text, 1, room / 2, file);
    text[*n] = '\0';
    fclose(file);
    return text;
}

static void fuzz(const char *path, int rounds)
{
    const size_t room = 20000;
    size_t length;
    int refused = 0, read = 0;
    char *text = read_whole(path, &length, room), *copy = malloc(room);
    for (int i = 0; i < rounds; i++) {
        size_t n = length;
        memcpy(copy, text, length + 1);
        for (uint64_t k = 1 + random_number(1 + (uint64_t)i % 12); k > 0; k--)
            damage(copy, &n, room);
        case_errors *errors = case_errors_new();
        case_dict *dict = case_dict_parse(copy, "fuzzed", errors);
        assert_true((dict == NULL) == (case_errors_count(errors) > 0));
        refused += !dict;
        read += dict != NULL;
        if (dict) translate(dict, errors);
        case_dict_free(dict);
        case_errors_free(errors);
    }
    /* damage that is always, or never, noticed would mean that nothing was tested */
    assert_true(refused > rounds / 20 && read > rounds / 20);
    free(text);
    free(copy);
}

static void properties(void **unused)
{
    (void)unused;
    fuzz(FELMI_SOURCE_DIR "/tutorials/goldschmidtBed/constant/demProperties", 3000);
}

static void schemes(void **unused)
{
    (void)unused;
    fuzz(FELMI_SOURCE_DIR "/tutorials/goldschmidtBed/system/fvSolution", 1500);
}

/* blockMeshDict is read from its file, so that zero bytes occur too. */
static void meshes(void **unused)
{
    (void)unused;
    const size_t room = 20000;
    size_t length;
    char *text = read_whole(FELMI_SOURCE_DIR "/tutorials/goldschmidtBed/system/blockMeshDict",
                            &length, room);
    char *copy = malloc(room), path[128];
    fixture f = fixture_new();
    snprintf(path, sizeof path, "%s/system/blockMeshDict", f.directory);
    for (int i = 0; i < 1500; i++) {
        size_t n = length;
        memcpy(copy, text, length + 1);
        for (uint64_t k = 1 + random_number(3); k > 0; k--) damage(copy, &n, room);
        if (i % 50 == 0) copy[random_number(n)] = '\0';
        FILE *file = fopen(path, "wb");
        assert_int_equal(fwrite(copy, 1, n, file), n);
        fclose(file);
        case_errors *errors = case_errors_new();
        case_mesh mesh;
        case_read_mesh(f.directory, &mesh, errors);
        if (i % 50 == 0) assert_says(errors, "holds a zero byte");
        if (case_errors_count(errors) == 0)
            for (int a = 0; a < 3; a++) assert_true(mesh.cells[a] >= 1 && mesh.spacing[a] > 0);
        case_errors_free(errors);
    }
    free(text);
    free(copy);
    fixture_free(&f);
}

static void noise(void **unused)
{
    (void)unused;
    char text[400];
    for (int i = 0; i < 5000; i++) {
        size_t n = random_number(sizeof text - 1);
        for (size_t k = 0; k < n; k++) text[k] = (char)(1 + random_number(i % 2 ? 255 : 126));
        text[n] = '\0';
        case_errors *errors = case_errors_new();
        case_dict *dict = case_dict_parse(text, "noise", errors);
        assert_true((dict == NULL) == (case_errors_count(errors) > 0));
        case_dict_free(dict);
        case_errors_free(errors);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(properties),
        cmocka_unit_test(schemes),
        cmocka_unit_test(meshes),
        cmocka_unit_test(noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
