/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * snapshot.c - the particles of one instant in an HDF5 file.
 *
 *     /particles/id, material                              [n]     int64, int32
 *     /particles/position, velocity, angularVelocity, force [n][3] float64
 *     /particles/diameter, density                         [n]     float64
 *
 * Every dataset has an attribute `units`; the file has `time` (s), `version` of this layout and
 * `creator`, the group the names of the materials. Rank r writes the rows after those of rank r-1.
 *
 * One rank lets HDF5 make the file in memory (124 bytes a particle, for the moment of writing) and
 * writes it out itself: HDF5 1.10 does not survive a disk that is full, it crashes when the
 * program ends because its file could not be closed. Several ranks write collectively by MPI-IO.
 *
 * Nothing is ever half there: both files are made under another name, synchronised with the disk
 * and renamed, the series (series.c) last. HDF5's own error print is switched off meanwhile and its
 * innermost message becomes ours; ranks agree on the outcome after every stage.
 */
#include "snapshot.h"
#include "series.h"

#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { VERSION = 1 }; /* of the layout of the file */

typedef struct writer {
    MPI_Comm comm;
    int rank, ranks;
    int failed; /* here; the message says why */
    char *message;
    size_t size;
    const dem_view *view;
    const dem_material *material;
    double time;
    hsize_t n, first, total; /* rows here, before this rank, on all */
    hid_t file, group, transfer;
    double *scratch; /* [n] */
    char path[PATH_MAX], part[PATH_MAX];
} writer;

/* ---- errors ---------------------------------------------------------------------------------- */

/* Only the first failure is told: the others follow from it. */
static void fail(writer *w, const char *what, const char *why)
{
    if (!w->failed) snprintf(w->message, w->size, "%s: %s: %s", w->path, what, why);
    w->failed = 1;
}

static herr_t innermost(unsigned n, const H5E_error2_t *error, void *text)
{
    if (n == 0) snprintf(text, 256, "%s", error->desc ? error->desc : "error without text");
    return 0;
}

/* Check what an HDF5 call returned, and hand it on. */
static hid_t h5(writer *w, hid_t result, const char *what)
{
    if (result < 0 && !w->failed) {
        char text[256] = "unknown error of HDF5";
        H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, text);
        fail(w, what, text);
    }
    return result;
}

/* Whether all ranks are well; if not, all get the message of the first one that is not. */
static int agree(writer *w)
{
    const int mine = w->failed ? w->rank : INT_MAX;
    int first;
    MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, w->comm);
    if (first == INT_MAX) return 1;
    w->failed = 1;
    if (w->size > 0) MPI_Bcast(w->message, (int)w->size, MPI_CHAR, first, w->comm);
    return 0;
}

/* ---- attributes ------------------------------------------------------------------------------ */

static void put_attribute(writer *w, hid_t where, const char *name, hid_t type, hid_t space,
                          const void *value)
{
    const hid_t a =
        h5(w, H5Acreate2(where, name, type, space, H5P_DEFAULT, H5P_DEFAULT), "attribute");
    if (a < 0) return;
    h5(w, H5Awrite(a, type, value), "attribute");
    h5(w, H5Aclose(a), "attribute");
}

static void put_scalar(writer *w, hid_t where, const char *name, hid_t type, const void *value)
{
    const hid_t space = h5(w, H5Screate(H5S_SCALAR), "attribute");
    if (space < 0) return;
    put_attribute(w, where, name, type, space, value);
    H5Sclose(space);
}

static hid_t text_type(size_t length)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, length);
    H5Tset_strpad(type, H5T_STR_NULLTERM);
    return type;
}

static void put_text(writer *w, hid_t where, const char *name, const char *text)
{
    const hid_t type = text_type(strlen(text) + 1);
    put_scalar(w, where, name, type, text);
    H5Tclose(type);
}

/* Names of the materials that occur, in the order of their numbers. */
static void put_materials(writer *w)
{
    int highest = -1;
    for (size_t i = 0; i < w->view->n; i++)
        if (w->view->material[i] > highest) highest = w->view->material[i];
    MPI_Allreduce(MPI_IN_PLACE, &highest, 1, MPI_INT, MPI_MAX, w->comm);
    if (highest < 0) return;
    const hsize_t count = (hsize_t)highest + 1;
    char(*names)[DEM_NAME] = calloc(count, sizeof *names);
    if (names == NULL) {
        fail(w, "materials", "out of memory");
        return;
    }
    for (hsize_t m = 0; m < count; m++)
        snprintf(names[m], sizeof *names, "%s", w->material[m].name);
    const hid_t type = text_type(DEM_NAME), space = H5Screate_simple(1, &count, NULL);
    put_attribute(w, w->group, "materials", type, space, names);
    H5Sclose(space);
    H5Tclose(type);
    free(names);
}

/* ---- datasets -------------------------------------------------------------------------------- */

/* One dataset of `width` values a row; memory and file hold the same kind of number. */
static void put_rows(writer *w, const char *name, int width, hid_t memory_type, hid_t file_type,
                     const void *rows, const char *units)
{
    const int rank = width > 1 ? 2 : 1;
    const hsize_t all[2] = {w->total, (hsize_t)width}, here[2] = {w->n, (hsize_t)width};
    const hsize_t start[2] = {w->first, 0};
    const hid_t file_space = h5(w, H5Screate_simple(rank, all, NULL), name);
    const hid_t memory_space = h5(w, H5Screate_simple(rank, here, NULL), name);
    const hid_t set = h5(
        w, H5Dcreate2(w->group, name, file_type, file_space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        name);
    if (set >= 0) {
        if (w->n > 0) {
            h5(w, H5Sselect_hyperslab(file_space, H5S_SELECT_SET, start, NULL, here, NULL), name);
        } else {
            h5(w, H5Sselect_none(file_space), name);
            h5(w, H5Sselect_none(memory_space), name);
        }
        /* Collective: a rank without rows, or that failed before, still has to take part. */
        if (w->total > 0)
            h5(w, H5Dwrite(set, memory_type, memory_space, file_space, w->transfer, rows), name);
        put_text(w, set, "units", units);
        h5(w, H5Dclose(set), name);
    }
    if (memory_space >= 0) H5Sclose(memory_space);
    if (file_space >= 0) H5Sclose(file_space);
}

static void put_doubles(writer *w, const char *name, int width, const void *rows, const char *units)
{
    put_rows(w, name, width, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE, rows, units);
}

static void put_particles(writer *w)
{
    const dem_view *view = w->view;
    put_rows(w, "id", 1, H5T_NATIVE_INT64, H5T_STD_I64LE, view->id, "-");
    put_doubles(w, "position", 3, view->x, "m");
    put_doubles(w, "velocity", 3, view->v, "m/s");
    put_doubles(w, "angularVelocity", 3, view->omega, "rad/s");
    put_doubles(w, "force", 3, view->force, "N");
    for (size_t i = 0; i < view->n; i++) w->scratch[i] = 2. * view->radius[i];
    put_doubles(w, "diameter", 1, w->scratch, "m");
    for (size_t i = 0; i < view->n; i++) w->scratch[i] = w->material[view->material[i]].density;
    put_doubles(w, "density", 1, w->scratch, "kg/m3");
    put_rows(w, "material", 1, H5T_NATIVE_INT, H5T_STD_I32LE, view->material, "-");
    put_materials(w);
}

/* ---- the file -------------------------------------------------------------------------------- */

static hid_t open_file(writer *w)
{
    /* Rows of all datasets (id, four vectors, two scalars, material), and the rest of the file. */
    const size_t bytes = (size_t)w->total * (8 + 4 * 24 + 2 * 8 + 4) + 65536;
    const hid_t access = h5(w, H5Pcreate(H5P_FILE_ACCESS), "create");
    /* Closing the file closes whatever a failure left open in it. */
    h5(w, H5Pset_fclose_degree(access, H5F_CLOSE_STRONG), "create");
    w->transfer = h5(w, H5Pcreate(H5P_DATASET_XFER), "create");
    if (w->ranks > 1) {
        h5(w, H5Pset_fapl_mpio(access, w->comm, MPI_INFO_NULL), "create");
        h5(w, H5Pset_dxpl_mpio(w->transfer, H5FD_MPIO_COLLECTIVE), "create");
    } else {
        h5(w, H5Pset_fapl_core(access, bytes, 0), "create");
    }
    const hid_t file = h5(w, H5Fcreate(w->part, H5F_ACC_TRUNC, H5P_DEFAULT, access), "create");
    H5Pclose(access);
    return file;
}

static int write_all(int fd, const char *bytes, size_t n)
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

/* Write out the file that HDF5 holds in memory. */
static void store_image(writer *w)
{
    void **image = NULL;
    hsize_t size = 0;
    h5(w, H5Fget_filesize(w->file, &size), "write");
    h5(w, H5Fget_vfd_handle(w->file, H5P_DEFAULT, (void **)&image), "write");
    if (w->failed) return;
    const int fd = open(w->part, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (fd < 0) {
        fail(w, "create", strerror(errno));
        return;
    }
    if (write_all(fd, *image, size) != 0) fail(w, "write", strerror(errno));
    if (close(fd) != 0) fail(w, "write", strerror(errno));
}

static void write_file(writer *w)
{
    const int version = VERSION;
    w->file = open_file(w);
    if (agree(w)) {
        w->group = h5(w, H5Gcreate2(w->file, "particles", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                      "particles");
        put_scalar(w, w->file, "time", H5T_NATIVE_DOUBLE, &w->time);
        put_scalar(w, w->file, "version", H5T_NATIVE_INT, &version);
        put_text(w, w->file, "creator", "felmiFoam");
        put_particles(w);
        h5(w, H5Gclose(w->group), "particles");
        h5(w, H5Fflush(w->file, H5F_SCOPE_GLOBAL), "write");
        if (w->ranks == 1 && !w->failed) store_image(w);
    }
    if (w->file >= 0) h5(w, H5Fclose(w->file), "close");
    if (w->transfer >= 0) H5Pclose(w->transfer);
}

static void make_directory(writer *w, const char *directory)
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
        fail(w, "create directory", strerror(errno));
    else if (stat(path, &status) == 0 && !S_ISDIR(status.st_mode))
        fail(w, "create directory", "a file of that name is in the way");
}

/* On the first rank: put the finished file in its place and enter it into the series. */
static void publish(writer *w, const char *directory, const char *name)
{
    char text[256];
    const int fd = open(w->part, O_RDWR);
    if (fd < 0 || fsync(fd) != 0) fail(w, "synchronise with the disk", strerror(errno));
    if (fd >= 0) close(fd);
    if (w->failed) return;
    series *s = series_begin(directory, name, w->time, w->total, text, sizeof text);
    if (s == NULL) {
        fail(w, "series", text);
        return;
    }
    if (rename(w->part, w->path) != 0) {
        fail(w, "rename", strerror(errno));
        series_abandon(s);
    } else if (series_commit(s, text, sizeof text) != 0) {
        fail(w, "series", text);
    }
}

static int name_paths(writer *w, const char *directory, const char *name)
{
    snprintf(w->path, sizeof w->path, "%s", directory);
    if (name[0] == '\0' || strchr(name, '/') != NULL) {
        fail(w, name, "is not a name of a file");
        return 0;
    }
    const int a = snprintf(w->path, sizeof w->path, "%s/%s.h5", directory, name);
    const int b = snprintf(w->part, sizeof w->part, "%s/.%s.h5.part", directory, name);
    if (a >= (int)sizeof w->path || b >= (int)sizeof w->part) {
        fail(w, "path", strerror(ENAMETOOLONG));
        return 0;
    }
    return 1;
}

static void count_rows(writer *w)
{
    unsigned long long mine = w->view->n, before = 0, all = 0;
    MPI_Exscan(&mine, &before, 1, MPI_UNSIGNED_LONG_LONG, MPI_SUM, w->comm);
    MPI_Allreduce(&mine, &all, 1, MPI_UNSIGNED_LONG_LONG, MPI_SUM, w->comm);
    w->n = mine;
    w->first = w->rank > 0 ? before : 0; /* undefined on the first rank */
    w->total = all;
    w->scratch = malloc((w->view->n + 1) * sizeof *w->scratch);
    if (w->scratch == NULL) fail(w, "write", "out of memory");
}

dem_status snapshot_write(MPI_Comm comm, const dem_view *view, const dem_material *material,
                          double time, const char *directory, const char *name, char *message,
                          size_t size)
{
    writer w = {.comm = comm, .message = message, .size = size, .view = view};
    w.material = material;
    w.time = time;
    w.file = w.group = w.transfer = -1;
    MPI_Comm_rank(comm, &w.rank);
    MPI_Comm_size(comm, &w.ranks);
    if (size > 0) message[0] = '\0';

    H5E_auto2_t printer;
    void *context;
    H5Eget_auto2(H5E_DEFAULT, &printer, &context);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    count_rows(&w);
    if (name_paths(&w, directory, name) && w.rank == 0) make_directory(&w, directory);
    if (agree(&w)) {
        write_file(&w);
        if (agree(&w) && w.rank == 0) publish(&w, directory, name);
        if (!agree(&w)) {
            if (w.rank == 0) unlink(w.part);
            MPI_Barrier(comm); /* no rank finds the remains */
        }
    }
    H5Eset_auto2(H5E_DEFAULT, printer, context);
    free(w.scratch);
    return w.failed ? DEM_IO : DEM_OK;
}
