/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * band_cache.c - samples of surfaces, kept in HDF5 files for the next run.
 *
 * A file has the name of a hash of all that its samples depend on: triangles, parts, side, spacing,
 * width and version of the layout and of the method. It holds
 *
 *     place [n][4] int32, value [n][729] float64, hidden [n][8] uint64, side [m][4] int32
 *
 * and attributes `key` (that hash), `checksum` (of the data) and `version`. It is made in memory,
 * written under another name, synchronised with the disk and renamed, so that runs that make it at
 * the same time do not disturb each other. What is read is believed only when key, sizes, order
 * and checksum are right; otherwise the samples are made again, with a note.
 *
 * The hash: two rounds of 64 bits with different multipliers over 8-byte words, each word mixed as
 * in the finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014, doi:10.1145/2660193.2660195).
 * It guards against accidents, not against malice.
 */
#include "band.h"

#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { VERSION = 3 }; /* of the layout, and of what band_new computes */

typedef struct key {
    uint64_t a, b;
} key;

static uint64_t mix(uint64_t z)
{
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static void add(key *k, const void *data, size_t bytes)
{
    const unsigned char *p = data;
    for (size_t i = 0; i < bytes; i += 8) {
        uint64_t word = 0;
        memcpy(&word, p + i, bytes - i < 8 ? bytes - i : 8);
        k->a = mix(k->a ^ word) * 0x9e3779b97f4a7c15u + 1;
        k->b = mix(k->b + word) * 0xc2b2ae3d27d4eb4fu + bytes;
    }
}

static key key_of(const surface *s, double spacing, double width)
{
    const int64_t head[5] = {VERSION, s->inside, s->mended, s->parts, (int64_t)s->n};
    const double number[2] = {spacing, width};
    key k = {0x243f6a8885a308d3u, 0x13198a2e03707344u}; /* digits of pi */
    add(&k, head, sizeof head);
    add(&k, number, sizeof number);
    add(&k, s->first, ((size_t)s->parts + 1) * sizeof *s->first);
    for (size_t t = 0; t < s->n; t++) {
        for (int v = 0; v < 3; v++) add(&k, s->x[s->vertex[t][v]], sizeof *s->x);
        add(&k, s->beyond[t], sizeof *s->beyond);
    }
    return k;
}

static key checksum(const band *b)
{
    key k = {1, 2};
    add(&k, b->place, b->n * sizeof *b->place);
    add(&k, b->value, b->n * sizeof *b->value);
    add(&k, b->hidden, b->n * sizeof *b->hidden);
    add(&k, b->side, b->n_side * sizeof *b->side);
    return k;
}

static void path_of(key k, const char *directory, char path[PATH_MAX])
{
    snprintf(path, PATH_MAX, "%s/%016" PRIx64 "%016" PRIx64 ".h5", directory, k.a, k.b);
}

/* HDF5 prints its errors unless told not to. */
typedef struct silence {
    H5E_auto2_t function;
    void *data;
} silence;

static silence hush(void)
{
    silence s;
    H5Eget_auto2(H5E_DEFAULT, &s.function, &s.data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return s;
}

static void unhush(silence s)
{
    H5Eset_auto2(H5E_DEFAULT, s.function, s.data);
}

/* ---- reading --------------------------------------------------------------------------------- */

static int get_attribute(hid_t file, const char *name, hid_t type, hssize_t n, void *value)
{
    const hid_t a = H5Aopen(file, name, H5P_DEFAULT);
    if (a < 0) return -1;
    const hid_t space = H5Aget_space(a);
    const int bad = H5Sget_simple_extent_npoints(space) != n || H5Aread(a, type, value) < 0;
    H5Sclose(space);
    H5Aclose(a);
    return bad ? -1 : 0;
}

/* Rows of `width` elements; *n out. NULL when it is not there, of other shape or cut short. */
static void *get_rows(hid_t file, const char *name, hid_t type, hsize_t width, size_t *n)
{
    const hid_t d = H5Dopen2(file, name, H5P_DEFAULT);
    if (d < 0) return NULL;
    hsize_t dims[2] = {0, 0};
    void *rows = NULL;
    const hid_t space = H5Dget_space(d);
    if (H5Sget_simple_extent_ndims(space) == 2 &&
        H5Sget_simple_extent_dims(space, dims, NULL) == 2 && dims[1] == width &&
        dims[0] < UINT32_MAX) {
        *n = (size_t)dims[0];
        rows = malloc(*n * width * H5Tget_size(type) + 1);
        if (rows != NULL && *n > 0 && H5Dread(d, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows) < 0) {
            free(rows);
            rows = NULL;
        }
    }
    H5Sclose(space);
    H5Dclose(d);
    return rows;
}

/* What is wrong with the contents, or NULL. */
static const char *load(hid_t file, band *b, key wanted)
{
    uint64_t name[2] = {0, 0}, sum[2] = {0, 0};
    int version = 0;
    size_t n_value = 0, n_hidden = 0;
    if (get_attribute(file, "version", H5T_NATIVE_INT, 1, &version) || version != VERSION)
        return "another version";
    if (get_attribute(file, "key", H5T_NATIVE_UINT64, 2, name) || name[0] != wanted.a ||
        name[1] != wanted.b)
        return "made of other data";
    b->place = get_rows(file, "place", H5T_NATIVE_INT32, 4, &b->n);
    b->value = get_rows(file, "value", H5T_NATIVE_DOUBLE, BRICK_NODES, &n_value);
    b->hidden = get_rows(file, "hidden", H5T_NATIVE_UINT64, BRICK_WORDS, &n_hidden);
    b->side = get_rows(file, "side", H5T_NATIVE_INT32, 4, &b->n_side);
    if (!b->place || !b->value || !b->hidden || !b->side || n_value != b->n || n_hidden != b->n)
        return "incomplete";
    const key k = checksum(b);
    if (get_attribute(file, "checksum", H5T_NATIVE_UINT64, 2, sum) || sum[0] != k.a ||
        sum[1] != k.b)
        return "damaged";
    return NULL;
}

band *band_read(const surface *s, double spacing, double width, const char *directory,
                char *message, size_t size)
{
    char path[PATH_MAX];
    const key k = key_of(s, spacing, width);
    path_of(k, directory, path);
    if (access(path, F_OK) != 0) return NULL;
    band *b = calloc(1, sizeof *b);
    if (b == NULL) return NULL;
    const char *wrong = "no HDF5 file";
    const silence quiet = hush();
    const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file >= 0) {
        wrong = load(file, b, k);
        H5Fclose(file);
    }
    unhush(quiet);
    b->spacing = spacing;
    b->width = width;
    memcpy(b->origin, s->lo, sizeof b->origin);
    if (wrong == NULL && band_index(b) == 0) return b;
    snprintf(message, size, "%s: %s; the samples are made again", path,
             wrong ? wrong : "out of memory");
    band_free(b);
    return NULL;
}

/* ---- writing --------------------------------------------------------------------------------- */

static int put_attribute(hid_t file, const char *name, hid_t type, hsize_t n, const void *value)
{
    const hid_t space = H5Screate_simple(1, &n, NULL);
    const hid_t a = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    const int bad = a < 0 || H5Awrite(a, type, value) < 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
    return bad;
}

static int put_rows(hid_t file, const char *name, hid_t type, size_t n, hsize_t width,
                    const void *rows)
{
    const hsize_t dims[2] = {n, width};
    const hid_t space = H5Screate_simple(2, dims, NULL);
    const hid_t d = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const int bad = d < 0 || (n > 0 && H5Dwrite(d, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows) < 0);
    if (d >= 0) H5Dclose(d);
    H5Sclose(space);
    return bad;
}

/* The whole file, in memory: HDF5 1.10 cannot close a file whose disk is full. */
static void *image(const band *b, key k, size_t *bytes)
{
    const key sum = checksum(b);
    const uint64_t name[2] = {k.a, k.b}, check[2] = {sum.a, sum.b};
    const int version = VERSION;
    void *data = NULL;
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, (size_t)1 << 20, 0);
    const hid_t file = H5Fcreate("band", H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pclose(access);
    if (file < 0) return NULL;
    int bad = put_attribute(file, "version", H5T_NATIVE_INT, 1, &version);
    bad |= put_attribute(file, "key", H5T_NATIVE_UINT64, 2, name);
    bad |= put_attribute(file, "checksum", H5T_NATIVE_UINT64, 2, check);
    bad |= put_attribute(file, "spacing", H5T_NATIVE_DOUBLE, 1, &b->spacing);
    bad |= put_attribute(file, "width", H5T_NATIVE_DOUBLE, 1, &b->width);
    bad |= put_attribute(file, "origin", H5T_NATIVE_DOUBLE, 3, b->origin);
    bad |= put_rows(file, "place", H5T_NATIVE_INT32, b->n, 4, b->place);
    bad |= put_rows(file, "value", H5T_NATIVE_DOUBLE, b->n, BRICK_NODES, b->value);
    bad |= put_rows(file, "hidden", H5T_NATIVE_UINT64, b->n, BRICK_WORDS, b->hidden);
    bad |= put_rows(file, "side", H5T_NATIVE_INT32, b->n_side, 4, b->side);
    bad |= H5Fflush(file, H5F_SCOPE_GLOBAL) < 0;
    const ssize_t n = bad ? -1 : H5Fget_file_image(file, NULL, 0);
    if (n > 0) data = malloc((size_t)n);
    if (data != NULL && H5Fget_file_image(file, data, (size_t)n) < 0) {
        free(data);
        data = NULL;
    }
    H5Fclose(file);
    *bytes = data != NULL ? (size_t)n : 0;
    return data;
}

/* Make the directory and those above it. */
static int make_directory(const char *directory)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof path, "%s", directory) >= (int)sizeof path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    for (char *p = path + 1; *p != '\0'; p++) {
        if (*p != '/') continue;
        *p = '\0';
        if (mkdir(path, 0777) != 0 && errno != EEXIST) return -1;
        *p = '/';
    }
    return mkdir(path, 0777) != 0 && errno != EEXIST ? -1 : 0;
}

/* Write whole under another name, then rename; errno on failure. */
static int put_file(const char *path, const void *data, size_t bytes)
{
    char part[PATH_MAX + 32];
    snprintf(part, sizeof part, "%s.%ld.part", path, (long)getpid());
    const int fd = open(part, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (fd < 0) return -1;
    const char *p = data;
    int bad = 0;
    while (bytes > 0 && !bad) {
        const ssize_t n = write(fd, p, bytes < (size_t)1 << 30 ? bytes : (size_t)1 << 30);
        if (n < 0 && errno == EINTR) continue;
        bad = n <= 0;
        if (bad) break;
        p += n;
        bytes -= (size_t)n;
    }
    bad = bad || fsync(fd) != 0;
    bad = close(fd) != 0 || bad;
    if (!bad && rename(part, path) == 0) return 0;
    const int why = errno;
    unlink(part);
    errno = why;
    return -1;
}

int band_write(const band *b, const surface *s, const char *directory, char *message, size_t size)
{
    char path[PATH_MAX];
    size_t bytes;
    const key k = key_of(s, b->spacing, b->width);
    path_of(k, directory, path);
    const silence quiet = hush();
    void *data = image(b, k, &bytes);
    unhush(quiet);
    errno = ENOMEM;
    const int bad = data == NULL || make_directory(directory) || put_file(path, data, bytes);
    if (bad) snprintf(message, size, "%s: samples not kept: %s", path, strerror(errno));
    free(data);
    return bad ? -1 : 0;
}
