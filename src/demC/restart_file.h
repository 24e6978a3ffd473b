/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_file.h - a file of named datasets that is whole or refused.
 *
 * As with h5file.h the first failure is kept, and what is called after it does no harm: ask
 * `failed` at the end of a stage. What restart_get hands out belongs to the file and lives until
 * restart_close.
 */
#ifndef RESTART_FILE_H
#define RESTART_FILE_H

#include "dem.h"
#include "h5file.h"

typedef enum restart_kind {
    RESTART_REAL,  /* double */
    RESTART_WHOLE, /* int64_t */
    RESTART_TEXT,  /* char[DEM_NAME] */
    RESTART_BYTES  /* unsigned char */
} restart_kind;

#define RESTART_ANY SIZE_MAX

typedef struct restart_file {
    h5file f;
    void **kept; /* [n_kept] buffers handed out */
    size_t n_kept;
} restart_file;

/* ---- writing; collective --------------------------------------------------------------------- */

/* Begin `<directory>/<name>.h5`, of about `bytes` bytes; the directory is made. */
void restart_create(restart_file *r, MPI_Comm comm, const char *directory, const char *name,
                    size_t bytes, char *message, size_t size);
/* A dataset "<group>/<name>". */
void restart_put(restart_file *r, const char *set, restart_kind kind, h5rows rows, int width,
                 const void *data, const char *units);
/**
 * Head and checksum, to the disk, to its place; then all but the last `keep` (0: none) of the
 * restart files of the directory that are not later than this one are deleted, and the remains of
 * runs that were killed. DEM_OK or DEM_IO with the reason: then the files that were there still
 * are.
 */
dem_status restart_finish(restart_file *r, const char *directory, double time, int64_t particles,
                          int keep);

/* ---- reading --------------------------------------------------------------------------------- */

/* Open and check every byte. DEM_OK, or DEM_IO with the reason. */
dem_status restart_open(restart_file *r, MPI_Comm comm, const char *path, char *message,
                        size_t size);
int restart_has(const restart_file *r, const char *set);
/* All rows of a dataset; *rows: how many there must be, or RESTART_ANY, and then how many there
 * are. NULL in error. */
void *restart_get(restart_file *r, const char *set, restart_kind kind, int width, size_t *rows);
/* Names and widths of the datasets of a group, [*n]; none if there is no such group. */
void restart_list(restart_file *r, const char *group, size_t *n, char (**name)[DEM_NAME],
                  int **width);
/* Room until restart_close, cleared; NULL in error. */
void *restart_hold(restart_file *r, size_t bytes);
/* Refuse the file, printf style: DEM_IO. */
dem_status restart_refuse(restart_file *r, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void restart_close(restart_file *r);

#endif
