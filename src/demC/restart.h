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

/* Rows that go to other ranks. */
typedef struct restart_route {
    size_t *first;    /* [ranks + 1] first[r]...first[r + 1] - 1 of those here go to the rank r */
    uint32_t *sorted; /* which of those that come is the k-th; NULL: as they come */
} restart_route;

/* A contact, with the ids of the partners, or of the particle, the wall and the part. */
typedef struct history {
    int64_t key[3];
    double spring[4], rolling[4];
} history;

/* What is being saved or loaded. */
typedef struct restart_job {
    dem_sim *sim;
    restart_file *file;
    size_t n;            /* particles of this rank */
    uint32_t *row;       /* saving: row of the store of the k-th particle by id */
    const int64_t *id;   /* loading: of the k-th row, increasing */
    h5rows slab;         /* rows of the particles that this rank writes or reads */
    restart_route route; /* of particles, between the slabs and their ranks */
    int64_t *bound;      /* [ranks] ids from bound[r] to below bound[r + 1] are in the slab of r */
    const int64_t *slab_id;  /* loading: [slab.n] */
    uint32_t *owner, *order; /* loading, several ranks: [slab.n] whose the particle is, and its
                                place when they are in the order of these ranks */
    history *contact;        /* loading: [n_contact] between particles, until the list is there */
    size_t n_contact;
    int *material; /* loading: [n_material] number here of that of the file, -1: none */
    const char (*material_name)[DEM_NAME]; /* loading: [n_material] */
    double *heavier;                       /* loading: [n_material] density here / in the file */
    size_t n_material;                     /* of the file */
} restart_job;

/* A member of a struct that is state: a dataset of one value a row. */
typedef enum restart_type {
    RECORD_REAL,  /* finite */
    RECORD_LIMIT, /* a real that may be infinite */
    RECORD_PART,  /* a real, finite, of which every rank has a part */
    RECORD_INT64,
    RECORD_INT
} restart_type;
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
/* A dataset that all ranks have alike. */
void restart_put_here(restart_job *job, const char *set, restart_kind kind, size_t n, int width,
                      const void *data, const char *units);
/* Which of n names the rows of the dataset `set` have: place[k], [*rows], SIZE_MAX: none. */
size_t *restart_match(restart_job *job, const char *set, size_t n, const char *names, size_t stride,
                      size_t *rows);
/* Where an id is among n that increase, or n. */
size_t restart_find(const int64_t *all, size_t n, int64_t id);
/* Room until the file is closed. */
void *restart_room(restart_job *job, size_t bytes);

/* restart_rows.c: rows among the ranks. A failure on one rank is one of all when these return. */
/* Who writes which particles, and how they get there. */
void restart_plan_saving(restart_job *job);
/* Who owns which of the particles of the slab, by their places (radius: for the division), and how
 * they get there. */
void restart_plan_loading(restart_job *job, const double (*x)[3], const double *radius);
void restart_route_free(restart_route *route);
/* The rank in whose slab an id is, if it is in any. */
int restart_slab_of(const restart_job *job, int64_t id);
/* to[k]: the rank that the k-th of n goes to, and on return its place when they are in that order;
 * the first of each rank, [ranks + 1], or NULL. */
size_t *restart_order_by_rank(const restart_job *job, size_t n, uint32_t *to);
/* Blocks of `size` bytes by a route; `data` is freed, what comes, *n of them, is to be freed. NULL
 * in error. On one rank `data` comes back, and *n stays. */
void *restart_send(restart_job *job, const restart_route *route, void *data, size_t size,
                   size_t *n);
/* Particles' rows of `width` values of eight bytes: those of this rank, in the order of job->row,
 * into the file (`data` is freed); those of the slab, from the file, to their owners. */
void restart_put_rows(restart_job *job, const char *set, restart_kind kind, int width, void *data,
                      const char *units);
void *restart_bring(restart_job *job, void *data, int width);
/* From the file to the owners at once. */
void *restart_fetch(restart_job *job, const char *set, restart_kind kind, int width);
/* Note that there is no memory; not collective. */
void restart_no_memory(restart_job *job);

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
/* Contacts loaded, to the particles and ghosts there are. */
dem_status restart_link_contacts(restart_job *job);
/* restart_flow.c: feeders and outlets. */
void restart_save_flow(restart_job *job);
void restart_load_flow(restart_job *job);

#endif
