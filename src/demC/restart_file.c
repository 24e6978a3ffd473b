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
 * Complete or absent: the file is made under another name, synchronised with the disk, renamed,
 * and the directory synchronised, before an older one is deleted.
 */
#include "restart_file.h"
#include "crc64.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { VERSION = 1, HEAD = 512 };

static const char MAGIC[] = "felmiFoam restart\n";

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
    if (f->file < 0) return;
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

static void put_head(restart_file *r, double time, int64_t particles)
{
    size_t size;
    unsigned char *image = h5file_image(&r->f, &size);
    if (image == NULL) return;
    char lines[HEAD];
    const int n = snprintf(lines, sizeof lines,
                           "%sversion %d\ntime %.17g\nparticles %" PRId64 "\nlength %zu\n", MAGIC,
                           VERSION, time, particles, size);
    crc64 c;
    crc64_begin(&c);
    crc64_add(&c, lines, (size_t)n);
    crc64_add(&c, image + HEAD, size - HEAD);
    make_head(lines, (size_t)n, crc64_end(&c), (char *)image);
}

/* The number of a name "<number>.h5", NAN if it is none of that form. */
static double number_of(const char *name)
{
    char text[64], *end;
    const size_t length = strlen(name);
    if (length < 4 || length >= sizeof text || strcmp(name + length - 3, ".h5") != 0) return NAN;
    snprintf(text, sizeof text, "%.*s", (int)length - 3, name);
    const double number = strtod(text, &end);
    return *end == '\0' && isfinite(number) ? number : NAN;
}

static int later_first(const void *a, const void *b)
{
    const double x = number_of(*(char *const *)a), y = number_of(*(char *const *)b);
    return (x < y) - (x > y);
}

/* Nothing is deleted that does not say what it is. */
static int is_restart_file(const char *path)
{
    char begin[sizeof MAGIC - 1];
    FILE *file = fopen(path, "rb");
    if (file == NULL) return 0;
    const size_t got = fread(begin, 1, sizeof begin, file);
    fclose(file);
    return got == sizeof begin && memcmp(begin, MAGIC, sizeof begin) == 0;
}

/* Names "<number>.h5" in the directory up to `last`, the latest first; remains of writing go. */
static size_t find_files(const char *directory, double last, char ***names)
{
    size_t n = 0;
    DIR *folder = opendir(directory);
    for (struct dirent *e = folder ? readdir(folder) : NULL; e != NULL; e = readdir(folder)) {
        char path[PATH_MAX];
        const size_t length = strlen(e->d_name);
        if (snprintf(path, sizeof path, "%s/%s", directory, e->d_name) >= (int)sizeof path)
            continue;
        if (e->d_name[0] == '.' && length > 8 && strcmp(e->d_name + length - 8, ".h5.part") == 0)
            unlink(path);
        if (!(number_of(e->d_name) <= last) || !is_restart_file(path)) continue;
        char **more = realloc(*names, (n + 1) * sizeof *more);
        if (more == NULL) break;
        *names = more;
        more[n] = strdup(e->d_name);
        if (more[n] == NULL) break;
        n++;
    }
    if (folder) closedir(folder);
    if (n > 0) qsort(*names, n, sizeof **names, later_first);
    return n;
}

/* A file that cannot be deleted merely stays. */
static void delete_older(const char *directory, double last, size_t keep)
{
    char **names = NULL, path[PATH_MAX];
    const size_t n = find_files(directory, last, &names);
    for (size_t k = 0; k < n; k++) {
        if (k >= keep && snprintf(path, sizeof path, "%s/%s", directory, names[k]) < PATH_MAX)
            unlink(path);
        free(names[k]);
    }
    free(names);
}

dem_status restart_finish(restart_file *r, const char *directory, double time, int64_t particles,
                          int keep)
{
    h5file *f = &r->f;
    if (h5file_agree(f)) put_head(r, time, particles);
    h5file_close(f);
    if (h5file_agree(f) && f->rank == 0) h5file_synchronise(f);
    if (h5file_agree(f) && f->rank == 0) {
        h5file_rename(f);
        if (!f->failed) h5file_synchronise_directory(directory);
    }
    const int good = h5file_agree(f);
    if (f->rank == 0) {
        if (!good && f->part[0] != '\0') unlink(f->part);
        const char *name = strrchr(f->path, '/');
        const double last = name ? number_of(name + 1) : NAN;
        if (good && keep > 0 && !isnan(last)) delete_older(directory, last, (size_t)keep);
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

static int read_head(restart_file *r, FILE *file, char head[HEAD + 1])
{
    const size_t got = fread(head, 1, HEAD, file);
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

/* Every byte is what was written. */
static int check_bytes(restart_file *r, FILE *file, const char *head)
{
    const char *length_at = line_of(head, "length "), *end = strstr(head, "checksum ");
    if (!length_at || !end) return restart_refuse(r, "is damaged: its head is not complete");
    const unsigned long long length = strtoull(length_at, NULL, 10);
    const size_t room = 1 << 20;
    unsigned char *bytes = malloc(room);
    crc64 c;
    if (bytes == NULL) return restart_refuse(r, "out of memory");
    crc64_begin(&c);
    crc64_add(&c, head, (size_t)(end - head));
    unsigned long long total = HEAD;
    for (size_t got; (got = fread(bytes, 1, room, file)) > 0; total += got)
        crc64_add(&c, bytes, got);
    const int bad = ferror(file);
    free(bytes);
    if (bad) return restart_refuse(r, "cannot be read: %s", strerror(errno));
    if (total < length)
        return restart_refuse(r, "is truncated: it has %llu bytes of %llu", total, length);
    char expected[HEAD];
    if ((size_t)(end - head) > HEAD - 40)
        return restart_refuse(r, "is damaged: its head is not complete");
    make_head(head, (size_t)(end - head), crc64_end(&c), expected);
    if (total != length || memcmp(head, expected, HEAD) != 0)
        return restart_refuse(r, "is damaged: its checksum is not that of its contents");
    return 0;
}

dem_status restart_open(restart_file *r, MPI_Comm comm, const char *path, char *message,
                        size_t size)
{
    h5file *f = &r->f;
    char head[HEAD + 1];
    memset(r, 0, sizeof *r);
    h5file_begin(f, comm, message, size);
    snprintf(f->path, sizeof f->path, "%s", path);
    FILE *file = fopen(path, "rb");
    if (file == NULL) return restart_refuse(r, "cannot be opened: %s", strerror(errno));
    if (read_head(r, file, head) == 0) check_bytes(r, file, head);
    fclose(file);
    if (f->failed) return DEM_IO;
    f->file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    return f->file < 0 ? restart_refuse(r, "HDF5 cannot open it") : DEM_OK;
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

void *restart_hold(restart_file *r, size_t bytes)
{
    if (r->f.failed) return NULL; /* and `bytes` may be of a number that was not found */
    void *data = calloc(1, bytes ? bytes : 1);
    void **more = realloc(r->kept, (r->n_kept + 1) * sizeof *more);
    if (more != NULL) r->kept = more;
    if (data == NULL || more == NULL) {
        free(data);
        restart_refuse(r, "out of memory");
        return NULL;
    }
    r->kept[r->n_kept++] = data;
    return data;
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

void *restart_get(restart_file *r, const char *name, restart_kind kind, int width, size_t *rows)
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
    } else if (*rows != RESTART_ANY && *rows != found) {
        restart_refuse(r, "dataset %s has %zu rows, not %zu", name, found, *rows);
    } else if ((data = restart_hold(r, found * (size_t)width * size_of(kind))) != NULL) {
        const hid_t type = memory_type(kind);
        if (found > 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) {
            restart_refuse(r, "dataset %s cannot be read", name);
            data = NULL;
        }
        H5Tclose(type);
    }
    H5Dclose(set);
    *rows = found;
    return data;
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
