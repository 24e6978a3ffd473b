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

#define RESTART_ANY   SIZE_MAX
#define RESTART_MAGIC "felmiFoam restart\n" /* what such a file begins with */

typedef struct restart_file {
    h5file f;
    void **kept; /* [n_kept] buffers handed out */
    size_t n_kept;
} restart_file;

/* ---- writing; collective --------------------------------------------------------------------- */

/* Begin `<directory>/<name>.h5`, of about `bytes` bytes; the directory is made. */
void restart_create(restart_file *r, MPI_Comm comm, const char *directory, const char *name,
                    size_t bytes, char *message, size_t size);
/* A dataset "<group>/<name>", of which the ranks have these rows. Nothing is written unless all
 * ranks are well and have data for their rows; then all know. */
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
/* restart_older.c: all but the last `keep` of the restart files of the directory up to the path
 * `newest`, if its name is a number. For one rank. */
void restart_delete_older(const char *directory, const char *newest, size_t keep);

/* ---- reading --------------------------------------------------------------------------------- */

/* Open and check every byte, each rank its part. DEM_OK, or DEM_IO with the reason; collective, and
 * the same on all ranks. What comes next is not: h5file_agree() tells the others of a failure. */
dem_status restart_open(restart_file *r, MPI_Comm comm, const char *path, char *message,
                        size_t size);
int restart_has(const restart_file *r, const char *set);
/* All rows of a dataset; *rows: how many there must be, or RESTART_ANY, and then how many there
 * are. NULL in error. */
void *restart_get(restart_file *r, const char *set, restart_kind kind, int width, size_t *rows);
/* A rank's even share of the rows of a dataset. rows->total: how many there must be in all, or
 * RESTART_ANY, and then how many there are. NULL in error. */
void *restart_slab(restart_file *r, const char *set, restart_kind kind, int width, h5rows *rows);
/* Names and widths of the datasets of a group, [*n]; none if there is no such group. */
void restart_list(restart_file *r, const char *group, size_t *n, char (**name)[DEM_NAME],
                  int **width);
/* Room until restart_close, cleared; NULL in error. */
void *restart_hold(restart_file *r, size_t bytes);
/* The same of what was allocated elsewhere; NULL stays NULL. */
void *restart_adopt(restart_file *r, void *data);
/* What was handed out is needed no longer. */
void restart_drop(restart_file *r, void *data);
/* Refuse the file, printf style: DEM_IO. */
dem_status restart_refuse(restart_file *r, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void restart_close(restart_file *r);

#endif
