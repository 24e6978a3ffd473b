/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * h5Edit.h - the input of a fuzzer taken as a list of changes to a good HDF5 file.
 *
 * Files that carry a checksum are only read when every byte is what was written, so that damage
 * never gets to HDF5, and HDF5's own behaviour on damaged bytes is not what is tested. What our
 * readers may meet are files that HDF5 finds in order, and that hold something else than they
 * should: numbers that make no sense, other types and shapes, datasets that are missing, exchanged,
 * groups, or links to nowhere. Such files are made here through HDF5, and signed by the caller.
 *
 * A change takes 14 bytes: what is done, to which dataset, with which other one, which row, which
 * element of it, which number, and eight bytes for a number of its own.
 */
#ifndef H5_EDIT_H
#define H5_EDIT_H

#include <hdf5.h>
#include <stddef.h>
#include <stdint.h>

enum { EDIT_BYTES = 14, EDIT_MOST = 6, EDIT_SETS = 160, EDIT_NAME = 128 };

/* The good file: its bytes, and the names of all datasets. */
typedef struct h5good {
    unsigned char *image;
    size_t size;
    char name[EDIT_SETS][EDIT_NAME];
    size_t n;
} h5good;

/* Look at the file. Takes possession of `image`. */
void h5good_set(h5good *good, unsigned char *image, size_t size);
/* A file in memory with the bytes of the good one, to be closed. */
hid_t h5good_open(const h5good *good);
/* Change it as the input says. */
void h5_edit(hid_t file, const h5good *good, const uint8_t *data, size_t n);
/* Its bytes now, which live until it is closed; NULL where HDF5 cannot write them. */
unsigned char *h5_image(hid_t file, size_t *size);

#endif
