/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * fuzzFile.h - what the fuzzers share: a directory of their own, files in it, a check that ends the
 * run.
 */
#ifndef FUZZ_FILE_H
#define FUZZ_FILE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A condition that a reader must fulfil whatever it is given. */
#define REQUIRE(condition)                                                                         \
    do {                                                                                           \
        if (condition) break;                                                                      \
        fprintf(stderr, "%s:%d: not fulfilled: %s\n", __FILE__, __LINE__, #condition);             \
        abort();                                                                                   \
    } while (0)

/* The directory: in memory where the caller of the fuzzer says so with TMPDIR. */
static inline const char *fuzz_directory(void)
{
    static char directory[256];
    if (directory[0] != '\0') return directory;
    const char *base = getenv("TMPDIR");
    snprintf(directory, sizeof directory, "%.200s/felmiFuzzXXXXXX", base ? base : "/tmp");
    REQUIRE(mkdtemp(directory) != NULL);
    return directory;
}

/* Path of a file in it; the latest eight are good. */
static inline const char *fuzz_path(const char *name)
{
    static char path[8][320];
    static unsigned turn;
    char *p = path[turn++ % 8];
    snprintf(p, sizeof *path, "%s/%s", fuzz_directory(), name);
    return p;
}

static inline void fuzz_write(const char *path, const void *data, size_t n)
{
    FILE *file = fopen(path, "wb");
    REQUIRE(file != NULL);
    REQUIRE(fwrite(data, 1, n, file) == n);
    REQUIRE(fclose(file) == 0);
}

static inline unsigned char *fuzz_read(const char *path, size_t *n)
{
    struct stat status;
    FILE *file = fopen(path, "rb");
    REQUIRE(file != NULL && fstat(fileno(file), &status) == 0);
    unsigned char *data = malloc((size_t)status.st_size + 1);
    REQUIRE(data != NULL);
    *n = fread(data, 1, (size_t)status.st_size, file);
    REQUIRE(*n == (size_t)status.st_size);
    fclose(file);
    return data;
}

#endif
