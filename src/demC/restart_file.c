/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_file.c - a file of named datasets that is whole or refused.
 *
 * HDF5 behind a head of HEAD bytes, its "user block", that says in plain text what the file is:
 *
 *     felmiFoam restart
 *     version 1
 *     time 0.25
 *     particles 1000
 *     length 356352
 *     checksum 8d3f5c0a91b7e246
 *
 * and blanks up to a newline at its end. The checksum (crc64.h) is that of the lines before it and
 * of all bytes behind the head; the rest of the head must be what it should be. So not a byte of
 * the file can change unseen, whatever HDF5 makes of it, and a file that was cut off, is of a newer
 * version or not of this kind at all is told apart before HDF5 looks at it.
 *
 * The checksum is made and checked by reading the file back, each rank its part.
 *
 * Complete or absent: the file is made under another name, synchronised with the disk, renamed,
 * and the directory synchronised, before an older one is deleted.
 */
#include "restart_file.h"

#include "comm.h"
#include "crc64.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { VERSION = 1, HEAD = 512 };

static const char MAGIC[] = RESTART_MAGIC;

static hid_t memory_type(restart_kind kind)
{
    return kind == RESTART_REAL    ? H5Tcopy(H5T_NATIVE_DOUBLE)
           : kind == RESTART_WHOLE ? H5Tcopy(H5T_NATIVE_INT64)
           : kind == RESTART_TEXT  ? h5file_text_type(DEM_NAME)
                                   : H5Tcopy(H5T_NATIVE_UCHAR);
}

static hid_t file_type(restart_kind kind)
{
    return kind == RESTART_REAL    ? H5Tcopy(H5T_IEEE_F64LE)
           : kind == RESTART_WHOLE ? H5Tcopy(H5T_STD_I64LE)
           : kind == RESTART_TEXT  ? h5file_text_type(DEM_NAME)
                                   : H5Tcopy(H5T_STD_U8LE);
}

static size_t size_of(restart_kind kind)
{
    return kind == RESTART_TEXT ? DEM_NAME : kind == RESTART_BYTES ? 1 : 8;
}

/* ---- writing --------------------------------------------------------------------------------- */

void restart_create(restart_file *r, MPI_Comm comm, const char *directory, const char *name,
                    size_t bytes, char *message, size_t size)
{
    h5file *f = &r->f;
    memset(r, 0, sizeof *r);
    h5file_begin(f, comm, message, size);
    if (h5file_name(f, directory, name) && f->rank == 0) h5file_make_directory(f, directory);
    if (!h5file_agree(f)) return;
    h5file_create(f, bytes, HEAD);
    if (h5file_agree(f)) h5file_put_text(f, f->file, "creator", "felmiFoam");
}

void restart_put(restart_file *r, const char *set, restart_kind kind, h5rows rows, int width,
                 const void *data, const char *units)
{
    h5file *f = &r->f;
    if (rows.n > 0 && data == NULL) h5file_fail(f, set, "out of memory");
    if (!h5file_agree(f)) return;
    char group[2 * DEM_NAME];
    snprintf(group, sizeof group, "%s", set);
    char *slash = strchr(group, '/');
    *slash = '\0';
    const hid_t where = H5Lexists(f->file, group, H5P_DEFAULT) > 0
                            ? H5Gopen2(f->file, group, H5P_DEFAULT)
                            : h5file_group(f, group);
    if (h5file_check(f, where, set) < 0) return;
    const hid_t memory = memory_type(kind), file = file_type(kind);
    h5file_put_rows(f, where, slash + 1, rows, width, memory, file, data, units);
    H5Tclose(memory);
    H5Tclose(file);
    H5Gclose(where);
}

/* The head of a file with these lines before the checksum. */
static void make_head(const char *lines, size_t n, uint64_t checksum, char head[HEAD])
{
    char last[32];
    const int length = snprintf(last, sizeof last, "checksum %016" PRIx64 "\n", checksum);
    memset(head, ' ', HEAD);
    memcpy(head, lines, n);
    memcpy(head + n, last, (size_t)length);
    head[HEAD - 1] = '\n';
}

/* The checksum of the bytes from..to-1 of a file: 0, -1 if it ends before, or an error. */
static int sum_part(const char *path, uint64_t from, uint64_t to, uint64_t *sum)
{
    const size_t room = 1 << 20;
    unsigned char *bytes = malloc(room);
    FILE *file = fopen(path, "rb");
    crc64 c;
    crc64_begin(&c);
    int error = 0;
    if (bytes == NULL || file == NULL || fseeko(file, (off_t)from, SEEK_SET) != 0)
        error = bytes ? errno : ENOMEM;
    while (!error && from < to) {
        const size_t want = to - from < room ? (size_t)(to - from) : room;
        const size_t got = fread(bytes, 1, want, file);
        if (got == 0) error = ferror(file) ? errno : -1;
        crc64_add(&c, bytes, got);
        from += got;
    }
    if (file) fclose(file);
    free(bytes);
    *sum = crc64_end(&c);
    return error;
}

/* The checksum of the bytes behind the head of a file of `size` bytes, on all ranks. What is wrong
 * here as above. */
static int sum_body(const h5file *f, const char *path, uint64_t size, uint64_t *sum)
{
    const uint64_t body = size - HEAD, ranks = (uint64_t)f->ranks, rank = (uint64_t)f->rank;
    const uint64_t from = body * rank / ranks, to = body * (rank + 1) / ranks;
    uint64_t part;
    const int error = sum_part(path, HEAD + from, HEAD + to, &part);
    /* Checksums are linear: joined, they are the sum of all that are moved to their places. */
    part = crc64_join(part, 0, body - to);
    MPI_Allreduce(&part, sum, 1, MPI_UINT64_T, MPI_BXOR, f->comm);
    return error;
}

static uint64_t sum_lines(const char *lines, size_t n)
{
    crc64 c;
    crc64_begin(&c);
    crc64_add(&c, lines, n);
    return crc64_end(&c);
}

/* Onto the finished file, which has its temporary name still. */
static void put_head(restart_file *r, double time, int64_t particles)
{
    h5file *f = &r->f;
    struct stat status = {0};
    if (f->rank == 0 && stat(f->part, &status) != 0) h5file_fail(f, "read back", strerror(errno));
    if (!h5file_agree(f)) return;
    uint64_t size = (uint64_t)status.st_size, sum;
    MPI_Bcast(&size, 1, MPI_UINT64_T, 0, f->comm);
    const int error = sum_body(f, f->part, size, &sum);
    if (error) h5file_fail(f, "read back", error < 0 ? "it is too short" : strerror(error));
    if (!h5file_agree(f) || f->rank != 0) return;
    char lines[HEAD], head[HEAD];
    const int n = snprintf(lines, sizeof lines,
                           "%sversion %d\ntime %.17g\nparticles %" PRId64 "\nlength %" PRIu64 "\n",
                           MAGIC, VERSION, time, particles, size);
    make_head(lines, (size_t)n, crc64_join(sum_lines(lines, (size_t)n), sum, size - HEAD), head);
    FILE *file = fopen(f->part, "r+b");
    int bad = file == NULL || fwrite(head, 1, HEAD, file) != HEAD;
    if (file != NULL) bad |= fclose(file) != 0;
    if (bad) h5file_fail(f, "write", strerror(errno));
}

dem_status restart_finish(restart_file *r, const char *directory, double time, int64_t particles,
                          int keep)
{
    h5file *f = &r->f;
    h5file_agree(f);
    h5file_close(f);
    if (h5file_agree(f)) put_head(r, time, particles);
    if (h5file_agree(f) && f->rank == 0) h5file_synchronise(f);
    if (h5file_agree(f) && f->rank == 0) {
        h5file_rename(f);
        if (!f->failed) h5file_synchronise_directory(directory);
    }
    const int good = h5file_agree(f);
    if (f->rank == 0) {
        if (!good && f->part[0] != '\0') unlink(f->part);
        if (good && keep > 0) restart_delete_older(directory, f->path, (size_t)keep);
    }
    MPI_Barrier(f->comm); /* no rank finds the remains */
    h5file_end(f);
    return good ? DEM_OK : DEM_IO;
}

/* ---- reading --------------------------------------------------------------------------------- */

dem_status restart_refuse(restart_file *r, const char *format, ...)
{
    h5file *f = &r->f;
    if (f->failed) return DEM_IO;
    char reason[512];
    va_list list;
    va_start(list, format);
    vsnprintf(reason, sizeof reason, format, list);
    va_end(list);
    snprintf(f->message, f->size, "restart file %s: %s", f->path, reason);
    f->failed = 1;
    return DEM_IO;
}

/* The value of a line "<key> <value>" of the head; NULL if there is none. */
static const char *line_of(const char *head, const char *key)
{
    const char *at = strstr(head, key);
    return at != NULL && at > head && at[-1] == '\n' ? at + strlen(key) : NULL;
}

static int read_head(restart_file *r, char head[HEAD + 1])
{
    FILE *file = fopen(r->f.path, "rb");
    if (file == NULL) return restart_refuse(r, "cannot be opened: %s", strerror(errno));
    const size_t got = fread(head, 1, HEAD, file);
    const int bad = ferror(file) ? errno : 0;
    fclose(file);
    if (bad) return restart_refuse(r, "cannot be read: %s", strerror(bad));
    head[got] = '\0';
    const size_t magic = sizeof MAGIC - 1;
    if (got == 0) return restart_refuse(r, "is empty");
    if (memcmp(head, MAGIC, got < magic ? got : magic) != 0) {
        const int other = got >= 8 && memcmp(head, "\211HDF\r\n\032\n", 8) == 0;
        return restart_refuse(r, other ? "is an HDF5 file, but not a restart file"
                                       : "is not a restart file");
    }
    if (got < HEAD) return restart_refuse(r, "is truncated: it has %zu bytes", got);
    const char *version = line_of(head, "version ");
    const long layout = version ? strtol(version, NULL, 10) : 0;
    if (layout > VERSION)
        return restart_refuse(r, "was written by a newer version: layout %ld, this one reads %d",
                              layout, VERSION);
    if (layout != VERSION) return restart_refuse(r, "is damaged: its head has no known version");
    return 0;
}

/* Every byte is what was written. `head` has been read and found good, everywhere. */
static void check_bytes(restart_file *r, const char *head)
{
    h5file *f = &r->f;
    const char *length_at = line_of(head, "length "), *end = strstr(head, "checksum ");
    struct stat status;
    if (!length_at || !end || end - head > HEAD - 40)
        restart_refuse(r, "is damaged: its head is not complete");
    else if (stat(f->path, &status) != 0)
        restart_refuse(r, "cannot be read: %s", strerror(errno));
    if (!h5file_agree(f)) return;
    const uint64_t length = strtoull(length_at, NULL, 10), size = (uint64_t)status.st_size;
    if (size < length)
        restart_refuse(r, "is truncated: it has %" PRIu64 " bytes of %" PRIu64, size, length);
    if (!h5file_agree(f)) return;
    uint64_t sum;
    const int error = sum_body(f, f->path, size, &sum);
    if (error) restart_refuse(r, "cannot be read: %s", strerror(error < 0 ? EIO : error));
    char expected[HEAD];
    const size_t n = (size_t)(end - head);
    make_head(head, n, crc64_join(sum_lines(head, n), sum, size - HEAD), expected);
    if (size != length || memcmp(head, expected, HEAD) != 0)
        restart_refuse(r, "is damaged: its checksum is not that of its contents");
}

dem_status restart_open(restart_file *r, MPI_Comm comm, const char *path, char *message,
                        size_t size)
{
    h5file *f = &r->f;
    char head[HEAD + 1];
    memset(r, 0, sizeof *r);
    h5file_begin(f, comm, message, size);
    snprintf(f->path, sizeof f->path, "%s", path);
    read_head(r, head);
    if (h5file_agree(f)) check_bytes(r, head);
    if (!h5file_agree(f)) return DEM_IO;
    /* By each rank on its own: what one cannot read keeps no other waiting. */
    f->file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (f->file < 0) restart_refuse(r, "HDF5 cannot open it");
    return h5file_agree(f) ? DEM_OK : DEM_IO;
}

int restart_has(const restart_file *r, const char *set)
{
    char group[2 * DEM_NAME];
    snprintf(group, sizeof group, "%s", set);
    char *slash = strchr(group, '/');
    if (slash) *slash = '\0';
    return r->f.file >= 0 && H5Lexists(r->f.file, group, H5P_DEFAULT) > 0 &&
           (!slash || H5Lexists(r->f.file, set, H5P_DEFAULT) > 0);
}

void *restart_adopt(restart_file *r, void *data)
{
    if (data == NULL) return NULL;
    void **more = realloc(r->kept, (r->n_kept + 1) * sizeof *more);
    if (more == NULL) {
        free(data);
        restart_refuse(r, "out of memory");
        return NULL;
    }
    r->kept = more;
    return r->kept[r->n_kept++] = data;
}

void *restart_hold(restart_file *r, size_t bytes)
{
    if (r->f.failed) return NULL; /* and `bytes` may be of a number that was not found */
    void *data = calloc(1, bytes ? bytes : 1);
    if (data == NULL) restart_refuse(r, "out of memory");
    return restart_adopt(r, data);
}

void restart_drop(restart_file *r, void *data)
{
    size_t k = r->n_kept;
    while (k > 0 && r->kept[k - 1] != data) k--;
    if (k == 0) return;
    free(data);
    r->kept[k - 1] = r->kept[--r->n_kept];
}

/* Numbers of the kind in rows of that width; how many rows. */
static int shape_is_right(hid_t set, restart_kind kind, int width, size_t *rows)
{
    static const H5T_class_t class_of[] = {H5T_FLOAT, H5T_INTEGER, H5T_STRING, H5T_INTEGER};
    const hid_t space = H5Dget_space(set), type = H5Dget_type(set);
    hsize_t dims[2] = {0, 1};
    const int rank = H5Sget_simple_extent_ndims(space);
    int good = rank == (width > 1 ? 2 : 1);
    if (good) H5Sget_simple_extent_dims(space, dims, NULL);
    good = good && dims[1] == (hsize_t)width && H5Tget_class(type) == class_of[kind] &&
           H5Tget_size(type) == size_of(kind) &&
           (kind != RESTART_TEXT || H5Tis_variable_str(type) == 0);
    *rows = (size_t)dims[0];
    H5Tclose(type);
    H5Sclose(space);
    return good;
}

/* The rows first...first + n - 1 of all. */
static void *read_rows(restart_file *r, hid_t set, const char *name, restart_kind kind, int width,
                       const h5rows *rows)
{
    char *data = restart_hold(r, rows->n * (size_t)width * size_of(kind));
    if (data == NULL || rows->n == 0) return data;
    const int rank = width > 1 ? 2 : 1;
    const hsize_t start[2] = {rows->first, 0}, count[2] = {rows->n, (hsize_t)width};
    const hid_t type = memory_type(kind), here = H5Screate_simple(rank, count, NULL);
    const hid_t there = H5Dget_space(set);
    if (H5Sselect_hyperslab(there, H5S_SELECT_SET, start, NULL, count, NULL) < 0 ||
        H5Dread(set, type, here, there, H5P_DEFAULT, data) < 0) {
        restart_refuse(r, "dataset %s cannot be read", name);
        data = NULL;
    }
    H5Sclose(there);
    H5Sclose(here);
    H5Tclose(type);
    return data;
}

/* Of all rows the share of one of so many ranks. */
static void *get(restart_file *r, const char *name, restart_kind kind, int width, h5rows *rows,
                 int rank, int ranks)
{
    if (r->f.failed) return NULL;
    const hid_t set = restart_has(r, name) ? H5Dopen2(r->f.file, name, H5P_DEFAULT) : -1;
    size_t found = 0;
    void *data = NULL;
    if (set < 0) {
        restart_refuse(r, "dataset %s is missing", name);
        return NULL;
    }
    if (!shape_is_right(set, kind, width, &found)) {
        restart_refuse(r, "dataset %s is not of the kind it should be", name);
    } else if (rows->total != RESTART_ANY && rows->total != found) {
        restart_refuse(r, "dataset %s has %zu rows, not %zu", name, found, (size_t)rows->total);
    } else if (found > PTRDIFF_MAX / size_of(kind) / (size_t)width / (size_t)ranks) {
        restart_refuse(r, "dataset %s has %zu rows, more than fit in memory", name, found);
    } else {
        rows->total = found;
        rows->first = slice(found, rank, ranks);
        rows->n = slice(found, rank + 1, ranks) - rows->first;
        data = read_rows(r, set, name, kind, width, rows);
    }
    H5Dclose(set);
    return data;
}

void *restart_get(restart_file *r, const char *set, restart_kind kind, int width, size_t *rows)
{
    h5rows all = {.total = *rows};
    void *data = get(r, set, kind, width, &all, 0, 1);
    *rows = (size_t)all.total;
    return data;
}

void *restart_slab(restart_file *r, const char *set, restart_kind kind, int width, h5rows *rows)
{
    return get(r, set, kind, width, rows, r->f.rank, r->f.ranks);
}

typedef struct listing {
    char (*name)[DEM_NAME];
    int *width;
    hsize_t n, room;
} listing;

static herr_t list_one(hid_t group, const char *name, const H5L_info_t *info, void *context)
{
    (void)info;
    listing *l = context;
    const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
    if (set < 0 || l->n == l->room || strlen(name) >= DEM_NAME) return -1;
    const hid_t space = H5Dget_space(set);
    hsize_t dims[2] = {0, 1};
    if (H5Sget_simple_extent_ndims(space) <= 2) H5Sget_simple_extent_dims(space, dims, NULL);
    snprintf(l->name[l->n], DEM_NAME, "%s", name);
    l->width[l->n++] = dims[1] <= INT_MAX ? (int)dims[1] : 0;
    H5Sclose(space);
    H5Dclose(set);
    return 0;
}

void restart_list(restart_file *r, const char *group, size_t *n, char (**name)[DEM_NAME],
                  int **width)
{
    *n = 0;
    if (r->f.failed || !restart_has(r, group)) return;
    const hid_t where = H5Gopen2(r->f.file, group, H5P_DEFAULT);
    H5G_info_t info;
    if (where < 0 || H5Gget_info(where, &info) < 0) {
        restart_refuse(r, "%s is not a group", group);
        return;
    }
    listing l = {.room = info.nlinks};
    l.name = restart_hold(r, l.room * sizeof *l.name);
    l.width = restart_hold(r, l.room * sizeof *l.width);
    if (!r->f.failed && H5Literate(where, H5_INDEX_NAME, H5_ITER_INC, NULL, list_one, &l) < 0)
        restart_refuse(r, "group %s cannot be read", group);
    H5Gclose(where);
    *n = (size_t)l.n;
    *name = l.name;
    *width = l.width;
}

void restart_close(restart_file *r)
{
    if (r->f.file >= 0) H5Fclose(r->f.file);
    for (size_t k = 0; k < r->n_kept; k++) free(r->kept[k]);
    free(r->kept);
    h5file_end(&r->f);
    memset(r, 0, sizeof *r);
    r->f.file = -1;
}
