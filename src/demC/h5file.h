/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * h5file.h - HDF5 files that are written whole: under another name, synchronised with the disk,
 * then renamed. What snapshots and restart files have in common.
 *
 * The first failure is kept with its reason, in the caller's message; calls after it do no harm, so
 * that a writer need only ask h5file_agree() after each stage. HDF5's own error print is switched
 * off between h5file_begin and h5file_end. Unless said otherwise all functions are collective.
 */
#ifndef H5FILE_H
#define H5FILE_H

#include <hdf5.h>
#include <limits.h>
#include <mpi.h>

typedef struct h5file {
    MPI_Comm comm;
    int rank, ranks;
    int failed; /* here; the message says why */
    char *message;
    size_t size;
    char path[PATH_MAX], part[PATH_MAX]; /* of the file, and while it is made */
    hid_t file, transfer;                /* negative: none */
    int flushed;                         /* HDF5 is done with its bytes */
    H5E_auto2_t printer;
    void *context;
} h5file;

/* Rows of a dataset: here, those of the ranks before, on all ranks. */
typedef struct h5rows {
    hsize_t n, first, total;
} h5rows;

void h5file_begin(h5file *f, MPI_Comm comm, char *message, size_t size);
void h5file_end(h5file *f);

/* Not collective: note a failure; check what an HDF5 call returned, and hand it on. */
void h5file_fail(h5file *f, const char *what, const char *why);
hid_t h5file_check(h5file *f, hid_t result, const char *what);
/* Whether all ranks are well; if not, all get the message of the first one that is not. */
int h5file_agree(h5file *f);

/* `<directory>/<name>.h5` and its name while it is made. 0: `name` is none. Not collective. */
int h5file_name(h5file *f, const char *directory, const char *name);
/* With those above it. For one rank. */
void h5file_make_directory(h5file *f, const char *directory);
/* Where n rows here come among those of all ranks. */
h5rows h5file_rows(const h5file *f, size_t n);

/* Create the file under its temporary name, with `head` bytes (0, or a power of two from 512 on)
 * before those of HDF5. `bytes`: what it will take; on one rank about, on several no less. */
void h5file_create(h5file *f, size_t bytes, hsize_t head);
/* A new group, to be closed. */
hid_t h5file_group(h5file *f, const char *name);
void h5file_put_attribute(h5file *f, hid_t where, const char *name, hid_t type, hid_t space,
                          const void *value);
void h5file_put_scalar(h5file *f, hid_t where, const char *name, hid_t type, const void *value);
void h5file_put_text(h5file *f, hid_t where, const char *name, const char *text);
/* A text of fixed length, terminated with zero; to be closed. */
hid_t h5file_text_type(size_t length);
/* One dataset of `width` values a row; memory and file hold the same kind of number. */
void h5file_put_rows(h5file *f, hid_t group, const char *name, h5rows rows, int width,
                     hid_t memory_type, hid_t file_type, const void *data, const char *units);
/* On one rank the file is in memory until it is written out: its bytes, in *size. NULL in error.
 * What a caller puts into the head goes to the disk with the rest. */
unsigned char *h5file_image(h5file *f, size_t *size);
/* Everything to the file; HDF5's part is over. */
void h5file_close(h5file *f);

/* Not collective. The finished file, under its temporary name, to the disk; */
void h5file_synchronise(h5file *f);
/* to its place; and the names in a directory to the disk. */
void h5file_rename(h5file *f);
void h5file_synchronise_directory(const char *directory);

#endif
