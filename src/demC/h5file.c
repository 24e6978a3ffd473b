/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * h5file.c - HDF5 files that are written whole: under another name, synchronised with the disk,
 * then renamed.
 *
 * One rank lets HDF5 make the file in memory and writes it out itself: HDF5 1.10 does not survive
 * a disk that is full, it crashes when the program ends because its file could not be closed.
 * Several ranks write by MPI-IO, each its rows after those of the ranks before. There the first
 * rank lays an empty file and has the disk set aside what the whole will take, before HDF5 opens
 * it: a disk without that much room is an error of ours, and HDF5 never meets a full one. On
 * closing the file is cut to what it really takes.
 *
 * Each rank writes its rows by itself: they lie together in the file, so that there is nothing to
 * gain from collecting them, and a collective write that fails on one rank keeps the others waiting
 * for ever. All descriptions are written by the first rank, for the same reason.
 */
#include "h5file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- errors ---------------------------------------------------------------------------------- */

void h5file_begin(h5file *f, MPI_Comm comm, char *message, size_t size)
{
    memset(f, 0, sizeof *f);
    f->comm = comm;
    f->message = message;
    f->size = size;
    f->file = f->transfer = -1;
    MPI_Comm_rank(comm, &f->rank);
    MPI_Comm_size(comm, &f->ranks);
    if (size > 0) message[0] = '\0';
    H5Eget_auto2(H5E_DEFAULT, &f->printer, &f->context);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

void h5file_end(h5file *f)
{
    H5Eset_auto2(H5E_DEFAULT, f->printer, f->context);
}

/* Only the first failure is told: the others follow from it. */
void h5file_fail(h5file *f, const char *what, const char *why)
{
    if (!f->failed) snprintf(f->message, f->size, "%s: %s: %s", f->path, what, why);
    f->failed = 1;
}

static herr_t innermost(unsigned n, const H5E_error2_t *error, void *text)
{
    if (n == 0) snprintf(text, 256, "%s", error->desc ? error->desc : "error without text");
    return 0;
}

hid_t h5file_check(h5file *f, hid_t result, const char *what)
{
    if (result < 0 && !f->failed) {
        char text[256] = "unknown error of HDF5";
        H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, text);
        h5file_fail(f, what, text);
    }
    return result;
}

int h5file_agree(h5file *f)
{
    const int mine = f->failed ? f->rank : INT_MAX;
    int first;
    MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, f->comm);
    if (first == INT_MAX) return 1;
    f->failed = 1;
    if (f->size > 0) MPI_Bcast(f->message, (int)f->size, MPI_CHAR, first, f->comm);
    return 0;
}

/* ---- names ----------------------------------------------------------------------------------- */

int h5file_name(h5file *f, const char *directory, const char *name)
{
    snprintf(f->path, sizeof f->path, "%s", directory);
    if (name[0] == '\0' || strchr(name, '/') != NULL) {
        h5file_fail(f, name, "is not a name of a file");
        return 0;
    }
    const int a = snprintf(f->path, sizeof f->path, "%s/%s.h5", directory, name);
    const int b = snprintf(f->part, sizeof f->part, "%s/.%s.h5.part", directory, name);
    if (a >= (int)sizeof f->path || b >= (int)sizeof f->part) {
        h5file_fail(f, "path", strerror(ENAMETOOLONG));
        return 0;
    }
    return 1;
}

void h5file_make_directory(h5file *f, const char *directory)
{
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s", directory);
    for (char *c = path + 1; *c != '\0'; c++) {
        if (*c != '/') continue;
        *c = '\0';
        mkdir(path, 0777); /* what really is missing shows at the last one */
        *c = '/';
    }
    struct stat status;
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
        h5file_fail(f, "create directory", strerror(errno));
    else if (stat(path, &status) == 0 && !S_ISDIR(status.st_mode))
        h5file_fail(f, "create directory", "a file of that name is in the way");
}

h5rows h5file_rows(const h5file *f, size_t n)
{
    unsigned long long mine = n, before = 0, all = 0;
    MPI_Exscan(&mine, &before, 1, MPI_UNSIGNED_LONG_LONG, MPI_SUM, f->comm);
    MPI_Allreduce(&mine, &all, 1, MPI_UNSIGNED_LONG_LONG, MPI_SUM, f->comm);
    return (h5rows){mine, f->rank > 0 ? before : 0 /* undefined on the first rank */, all};
}

/* ---- in memory ------------------------------------------------------------------------------- */

static int write_all(int fd, const unsigned char *bytes, size_t n)
{
    while (n > 0) {
        const ssize_t written = write(fd, bytes, n);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return -1;
        bytes += written;
        n -= (size_t)written;
    }
    return 0;
}

unsigned char *h5file_image(h5file *f, size_t *size)
{
    void **image = NULL;
    hsize_t bytes = 0;
    if (f->failed || f->file < 0) return NULL;
    /* Once: who has looked at the bytes means those, and HDF5 may tidy up each time. */
    if (!f->flushed) h5file_check(f, H5Fflush(f->file, H5F_SCOPE_GLOBAL), "write");
    f->flushed = 1;
    h5file_check(f, H5Fget_filesize(f->file, &bytes), "write");
    h5file_check(f, H5Fget_vfd_handle(f->file, H5P_DEFAULT, (void **)&image), "write");
    *size = (size_t)bytes;
    return f->failed ? NULL : *image;
}

/* Write out the file that HDF5 holds in memory: open still, or negative. */
static int store_image(h5file *f)
{
    size_t size;
    const unsigned char *image = h5file_image(f, &size);
    if (image == NULL) return -1;
    const int fd = open(f->part, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (fd < 0) h5file_fail(f, "create", strerror(errno));
    if (fd >= 0 && write_all(fd, image, size) != 0) h5file_fail(f, "write", strerror(errno));
    return fd;
}

/* ---- contents -------------------------------------------------------------------------------- */

static hid_t creation_list(h5file *f, hsize_t head)
{
    const hid_t list = h5file_check(f, H5Pcreate(H5P_FILE_CREATE), "create");
    /* There is no time of day in it: the same state makes the same file. */
    h5file_check(f, H5Pset_obj_track_times(list, 0), "create");
    if (head > 0) h5file_check(f, H5Pset_userblock(list, head), "create");
    return list;
}

static hid_t access_list(h5file *f)
{
    const hid_t list = h5file_check(f, H5Pcreate(H5P_FILE_ACCESS), "create");
    /* Closing the file closes whatever a failure left open in it. */
    h5file_check(f, H5Pset_fclose_degree(list, H5F_CLOSE_STRONG), "create");
    /* Nothing in the file is left to chance: older formats have rooms for names that show what was
     * in memory before. */
    h5file_check(f, H5Pset_libver_bounds(list, H5F_LIBVER_V18, H5F_LIBVER_V18), "create");
    return list;
}

/* A file in memory; it grows by, and its size is rounded to, `more` bytes. */
static void create_here(h5file *f, hsize_t head, size_t more)
{
    const hid_t creation = creation_list(f, head), access = access_list(f);
    h5file_check(f, H5Pset_fapl_core(access, more, 0), "create");
    f->file = h5file_check(f, H5Fcreate(f->part, H5F_ACC_TRUNC, creation, access), "create");
    H5Pclose(creation);
    H5Pclose(access);
}

/* An empty file on the disk, with room for `bytes`. */
static void lay_file(h5file *f, size_t bytes, hsize_t head)
{
    create_here(f, head, 8192);
    const int fd = store_image(f);
    const int error = fd < 0 ? 0 : posix_fallocate(fd, 0, (off_t)bytes);
    if (error) h5file_fail(f, "write", strerror(error));
    if (fd >= 0 && close(fd) != 0) h5file_fail(f, "write", strerror(errno));
    if (f->file >= 0) h5file_check(f, H5Fclose(f->file), "create");
    f->file = -1;
    f->flushed = 0;
}

void h5file_create(h5file *f, size_t bytes, hsize_t head)
{
    f->transfer = h5file_check(f, H5Pcreate(H5P_DATASET_XFER), "create");
    if (f->ranks == 1) {
        create_here(f, head, 8192 * (1 + bytes / (64 * 8192))); /* few steps, without much air */
        return;
    }
    if (f->rank == 0) lay_file(f, bytes, head);
    if (!h5file_agree(f)) return;
    const hid_t access = access_list(f);
    h5file_check(f, H5Pset_fapl_mpio(access, f->comm, MPI_INFO_NULL), "create");
    h5file_check(f, H5Pset_dxpl_mpio(f->transfer, H5FD_MPIO_INDEPENDENT), "create");
    H5AC_cache_config_t cache = {.version = H5AC__CURR_CACHE_CONFIG_VERSION};
    h5file_check(f, H5Pget_mdc_config(access, &cache), "create");
    cache.metadata_write_strategy = H5AC_METADATA_WRITE_STRATEGY__PROCESS_0_ONLY;
    h5file_check(f, H5Pset_mdc_config(access, &cache), "create");
    f->file = h5file_check(f, H5Fopen(f->part, H5F_ACC_RDWR, access), "create");
    H5Pclose(access);
}

hid_t h5file_group(h5file *f, const char *name)
{
    const hid_t creation = h5file_check(f, H5Pcreate(H5P_GROUP_CREATE), name);
    h5file_check(f, H5Pset_obj_track_times(creation, 0), name);
    h5file_check(f, H5Pset_link_phase_change(creation, 1000, 1000), name); /* one small list */
    const hid_t group =
        h5file_check(f, H5Gcreate2(f->file, name, H5P_DEFAULT, creation, H5P_DEFAULT), name);
    H5Pclose(creation);
    return group;
}

void h5file_put_attribute(h5file *f, hid_t where, const char *name, hid_t type, hid_t space,
                          const void *value)
{
    const hid_t a =
        h5file_check(f, H5Acreate2(where, name, type, space, H5P_DEFAULT, H5P_DEFAULT), name);
    if (a < 0) return;
    h5file_check(f, H5Awrite(a, type, value), name);
    h5file_check(f, H5Aclose(a), name);
}

void h5file_put_scalar(h5file *f, hid_t where, const char *name, hid_t type, const void *value)
{
    const hid_t space = h5file_check(f, H5Screate(H5S_SCALAR), name);
    if (space < 0) return;
    h5file_put_attribute(f, where, name, type, space, value);
    H5Sclose(space);
}

hid_t h5file_text_type(size_t length)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, length);
    H5Tset_strpad(type, H5T_STR_NULLTERM);
    return type;
}

void h5file_put_text(h5file *f, hid_t where, const char *name, const char *text)
{
    const hid_t type = h5file_text_type(strlen(text) + 1);
    h5file_put_scalar(f, where, name, type, text);
    H5Tclose(type);
}

void h5file_put_rows(h5file *f, hid_t group, const char *name, h5rows rows, int width,
                     hid_t memory_type, hid_t file_type, const void *data, const char *units)
{
    const int rank = width > 1 ? 2 : 1;
    const hsize_t all[2] = {rows.total, (hsize_t)width}, here[2] = {rows.n, (hsize_t)width};
    const hsize_t start[2] = {rows.first, 0};
    const hid_t file_space = h5file_check(f, H5Screate_simple(rank, all, NULL), name);
    const hid_t memory_space = h5file_check(f, H5Screate_simple(rank, here, NULL), name);
    const hid_t creation = h5file_check(f, H5Pcreate(H5P_DATASET_CREATE), name);
    h5file_check(f, H5Pset_obj_track_times(creation, 0), name);
    const hid_t set = h5file_check(
        f, H5Dcreate2(group, name, file_type, file_space, H5P_DEFAULT, creation, H5P_DEFAULT),
        name);
    H5Pclose(creation);
    if (set >= 0) {
        if (rows.n > 0) {
            h5file_check(
                f, H5Sselect_hyperslab(file_space, H5S_SELECT_SET, start, NULL, here, NULL), name);
            h5file_check(f, H5Dwrite(set, memory_type, memory_space, file_space, f->transfer, data),
                         name);
        }
        h5file_put_text(f, set, "units", units);
        h5file_check(f, H5Dclose(set), name);
    }
    if (memory_space >= 0) H5Sclose(memory_space);
    if (file_space >= 0) H5Sclose(file_space);
}

/* ---- to the disk ----------------------------------------------------------------------------- */

void h5file_close(h5file *f)
{
    if (f->file >= 0 && f->ranks == 1) {
        const int fd = store_image(f);
        if (fd >= 0 && close(fd) != 0) h5file_fail(f, "write", strerror(errno));
    } else if (f->file >= 0) {
        h5file_check(f, H5Fflush(f->file, H5F_SCOPE_GLOBAL), "write");
    }
    if (f->file >= 0) h5file_check(f, H5Fclose(f->file), "close");
    if (f->transfer >= 0) H5Pclose(f->transfer);
    f->file = f->transfer = -1;
}

void h5file_synchronise(h5file *f)
{
    const int fd = open(f->part, O_RDWR);
    if (fd < 0 || fsync(fd) != 0) h5file_fail(f, "synchronise with the disk", strerror(errno));
    if (fd >= 0) close(fd);
}

void h5file_rename(h5file *f)
{
    if (rename(f->part, f->path) != 0) h5file_fail(f, "rename", strerror(errno));
}

/* Where a file system cannot synchronise a directory, it does so by itself. */
void h5file_synchronise_directory(const char *directory)
{
    const int fd = open(directory, O_RDONLY | O_DIRECTORY);
    if (fd < 0) return;
    fsync(fd);
    close(fd);
}
