/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * samples.c - whatever the file of a surface's samples holds, it is used, or made again with a
 * note.
 *
 * The input is a list of changes to a good file (h5Edit.h). If its first byte is odd the checksum
 * is then made anew of what the file holds, as far as that has the right shape, so that the samples
 * get past it.
 */
#include "band_cache.c" /* for its checksum */

#include "fuzzFile.h"
#include "h5Edit.h"

#include <math.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static const double SPACING = .05, WIDTH = .1;

static surface *tetrahedron;
static h5good good;
static char file_path[PATH_MAX];

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    static double corner[4][3][3] = {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}},
                                     {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}},
                                     {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                                     {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const soup s = {4, corner};
    char message[256] = "";
    size_t size;
    (void)argc, (void)argv;
    tetrahedron = surface_new(&s, "tetrahedron", 0, 0, .7, message, sizeof message);
    REQUIRE(tetrahedron != NULL);
    band *b = band_new(tetrahedron, SPACING, WIDTH, NULL, message, sizeof message);
    REQUIRE(b != NULL && b->n > 4);
    REQUIRE(band_write(b, tetrahedron, fuzz_directory(), message, sizeof message) == 0);
    band_free(b);
    path_of(key_of(tetrahedron, SPACING, WIDTH), fuzz_directory(), file_path);
    unsigned char *image = fuzz_read(file_path, &size);
    h5good_set(&good, image, size);
    return 0;
}

static void sign(hid_t file)
{
    band b = {.n = 0};
    size_t n_value = 0, n_hidden = 0;
    b.place = get_rows(file, "place", H5T_NATIVE_INT32, 4, &b.n);
    b.value = get_rows(file, "value", H5T_NATIVE_DOUBLE, BRICK_NODES, &n_value);
    b.hidden = get_rows(file, "hidden", H5T_NATIVE_UINT64, BRICK_WORDS, &n_hidden);
    b.side = get_rows(file, "side", H5T_NATIVE_INT32, 4, &b.n_side);
    if (b.place && b.value && b.hidden && b.side && n_value == b.n && n_hidden == b.n) {
        const key k = checksum(&b);
        const uint64_t sum[2] = {k.a, k.b};
        H5Adelete(file, "checksum");
        put_attribute(file, "checksum", H5T_NATIVE_UINT64, 2, sum);
    }
    free(b.place);
    free(b.value);
    free(b.hidden);
    free(b.side);
}

/* Everywhere, near the surface and far away. */
static void ask(const band *b)
{
    for (int q = 0; q < 200; q++) {
        double phi = 0, g[3] = {0, 0, 0}, x[3];
        for (int a = 0; a < 3; a++)
            x[a] = q < 190 ? -.2 + .007 * ((q * (31 + 6 * a)) % 200) : 1e9 * (a - 1);
        for (int p = 0; p < tetrahedron->parts; p++) {
            const int known = band_eval(b, p, x, &phi, g, NULL);
            REQUIRE(known >= -1 && known <= 1);
            REQUIRE((known != 0) == (band_has(b, p, x) != 0));
        }
        band_is_free(b, x, q % 2);
    }
    REQUIRE(band_memory(b) > 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    char message[512] = "";
    size_t size;
    if (n == 0) return 0;
    const hid_t file = h5good_open(&good);
    h5_edit(file, &good, data + 1, n - 1);
    if (data[0] % 2) sign(file);
    const unsigned char *image = h5_image(file, &size);
    if (image) fuzz_write(file_path, image, size);
    H5Fclose(file);
    if (!image) return 0;
    band *b = band_read(tetrahedron, SPACING, WIDTH, fuzz_directory(), message, sizeof message);
    REQUIRE(b != NULL || strstr(message, file_path) == message);
    if (b) ask(b);
    band_free(b);
    return 0;
}
