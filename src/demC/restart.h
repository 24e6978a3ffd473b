/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart.h - the state of a simulation in a file, and back.
 */
#ifndef RESTART_H
#define RESTART_H

#include "dem_internal.h"
#include "restart_file.h"

/* In dem_new, of a simulation that has everything but particles: take all state from the file. The
 * status is the same on every rank, with the text in dem_message(). */
dem_status restart_read(dem_sim *sim, const char *path);

/* ---- for the files of the restart ------------------------------------------------------------ */

/* What is being saved or loaded. */
typedef struct restart_job {
    dem_sim *sim;
    restart_file *file;
    size_t n;          /* particles */
    uint32_t *row;     /* saving: row of the store of the k-th particle by id */
    const int64_t *id; /* loading: of the k-th row, increasing */
    int *material;     /* loading: [n_material] number here of that of the file, -1: none */
    const char (*material_name)[DEM_NAME]; /* loading: [n_material] */
    double *heavier;                       /* loading: [n_material] density here / in the file */
    size_t n_material;                     /* of the file */
} restart_job;

/* A member of a struct that is state: a dataset of one value a row. */
typedef enum restart_type { RECORD_REAL, RECORD_INT64, RECORD_INT } restart_type;
typedef struct restart_record {
    const char *set, *units;
    restart_type type;
    size_t at; /* offset of the member */
} restart_record;

/* Rows of n structs of `stride` bytes from `base` on. place[k]: which struct the row k of the file
 * belongs to, SIZE_MAX: none of them; NULL: the k-th. */
void restart_put_records(restart_job *job, const restart_record *table, size_t n_table,
                         const void *base, size_t stride, size_t n);
void restart_get_records(restart_job *job, const restart_record *table, size_t n_table, void *base,
                         size_t stride, size_t n, const size_t *place);
void restart_put_here(restart_job *job, const char *set, restart_kind kind, size_t n, int width,
                      const void *data, const char *units);
/* Which of n names the rows of the dataset `set` have: place[k], [*rows], SIZE_MAX: none. */
size_t *restart_match(restart_job *job, const char *set, size_t n, const char *names, size_t stride,
                      size_t *rows);
/* The row of the particle of that id, or job->n. */
size_t restart_find(const restart_job *job, int64_t id);
/* Room until the file is closed. */
void *restart_room(restart_job *job, size_t bytes);

/* restart_particles.c: particles, attached columns; the list built as it was, when all is loaded,
 * with the histories. */
void restart_save_particles(restart_job *job);
void restart_load_particles(restart_job *job);
void restart_save_columns(restart_job *job);
void restart_load_columns(restart_job *job);
dem_status restart_list_again(restart_job *job);
/* restart_history.c: contacts between particles and with walls. */
void restart_save_contacts(restart_job *job);
void restart_load_contacts(restart_job *job);
void restart_save_walls(restart_job *job);
void restart_load_walls(restart_job *job);
/* restart_flow.c: feeders and outlets. */
void restart_save_flow(restart_job *job);
void restart_load_flow(restart_job *job);

#endif
