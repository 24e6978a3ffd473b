/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * h5Edit.c - changes to a good HDF5 file; h5Edit.h says why.
 *
 * HDF5 may refuse a change: then the file stays as it was.
 */
#include "h5Edit.h"
#include "fuzzFile.h"

#include <float.h>
#include <math.h>

enum { ROOM = 1 << 20 }; /* bytes of the largest dataset whose contents are changed */

typedef struct edit {
    hid_t file;
    const char *set, *other;
    unsigned row, element, choice;
    uint8_t own[8];
} edit;

static const double REAL[] = {0,      -0.,   -1,      NAN,     INFINITY, -INFINITY,
                              1e-300, 1e300, DBL_MAX, DBL_MIN, 1,        1e9};
static const int64_t WHOLE[] = {
    0,      -1, 1, 2, 7, INT64_MAX, INT64_MIN, INT32_MAX, INT32_MIN, UINT32_MAX, (int64_t)1 << 40,
    1000000};
static const hsize_t ROWS[] = {0, 1, 2, 1000, (hsize_t)1 << 32, (hsize_t)1 << 61};

#define LENGTH(table) (sizeof table / sizeof *table)

/* ---- contents -------------------------------------------------------------------------------- */

/* All of a dataset with numbers or texts of fixed length; the caller closes type and frees. */
static unsigned char *get_all(hid_t set, hid_t *type, size_t *bytes, size_t *width)
{
    hsize_t dims[H5S_MAX_RANK] = {1};
    const hid_t space = H5Dget_space(set);
    const int rank = H5Sget_simple_extent_dims(space, dims, NULL);
    const hssize_t n = H5Sget_simple_extent_npoints(space);
    H5Sclose(space);
    *type = H5Dget_type(set);
    const size_t size = H5Tget_size(*type);
    unsigned char *all = NULL;
    if (n > 0 && size > 0 && (size_t)n < ROOM / size && H5Tdetect_class(*type, H5T_VLEN) <= 0 &&
        H5Tis_variable_str(*type) <= 0)
        all = calloc((size_t)n, size);
    *bytes = (size_t)n * size;
    *width = rank > 1 ? (size_t)dims[1] * size : size;
    if (all && H5Dread(set, *type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all) >= 0) return all;
    free(all);
    return NULL;
}

static void put_number(const edit *e, hid_t type, unsigned char *at)
{
    const size_t size = H5Tget_size(type);
    const unsigned k = e->choice;
    if (H5Tget_class(type) == H5T_FLOAT && size == 8 && k < LENGTH(REAL))
        memcpy(at, &REAL[k], 8);
    else if (H5Tget_class(type) == H5T_INTEGER && size <= 8 && k < LENGTH(WHOLE))
        memcpy(at, &WHOLE[k], size);
    else if (k % 4 == 3 && size <= 8) /* a bit */
        at[e->own[0] % size] ^= (unsigned char)(1u << e->own[1] % 8);
    else
        memcpy(at, e->own, size < 8 ? size : 8);
}

typedef enum change { NUMBER, COLUMN_OF_IT, COPY_ROW, ALL_ALIKE } change;

static void change_contents(const edit *e, change what)
{
    const hid_t set = H5Dopen2(e->file, e->set, H5P_DEFAULT);
    if (set < 0) return;
    hid_t type;
    size_t bytes, width;
    unsigned char *all = get_all(set, &type, &bytes, &width);
    if (all) {
        const size_t size = H5Tget_size(type), rows = bytes / width;
        unsigned char *row = all + e->row % rows * width;
        const size_t at = e->element % (width / size) * size;
        if (what == NUMBER) put_number(e, type, row + at);
        for (size_t k = 0; k < rows && what == COLUMN_OF_IT; k++)
            put_number(e, type, all + k * width + at);
        if (what == COPY_ROW) memmove(row, all + e->element % rows * width, width);
        for (size_t k = 0; k < rows && what == ALL_ALIKE; k++) memmove(all + k * width, row, width);
        H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all);
    }
    free(all);
    H5Tclose(type);
    H5Dclose(set);
}

/* ---- shapes and types ------------------------------------------------------------------------ */

/* In chunks, so that rows without number take no room. */
static void make(const edit *e, const char *name, hid_t type, int rank, const hsize_t *dims,
                 const void *contents)
{
    const hsize_t chunk[3] = {16, rank > 1 && dims[1] < 64 && dims[1] > 0 ? dims[1] : 1, 1};
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    const hid_t space = rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, dims, NULL);
    if (rank > 0 && !contents) H5Pset_chunk(creation, rank, chunk);
    H5Ldelete(e->file, name, H5P_DEFAULT);
    const hid_t set = H5Dcreate2(e->file, name, type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    if (set >= 0 && contents) H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, contents);
    if (set >= 0) H5Dclose(set);
    if (space >= 0) H5Sclose(space);
    H5Pclose(creation);
}

/* The same numbers in more or fewer rows or columns. */
static void reshape(const edit *e)
{
    hsize_t dims[H5S_MAX_RANK] = {1, 1};
    hid_t type;
    size_t bytes, width;
    const hid_t set = H5Dopen2(e->file, e->set, H5P_DEFAULT);
    if (set < 0) return;
    const hid_t space = H5Dget_space(set);
    int rank = H5Sget_simple_extent_dims(space, dims, NULL);
    unsigned char *all = get_all(set, &type, &bytes, &width);
    H5Sclose(space);
    H5Dclose(set);
    if (rank <= 2 && e->choice < LENGTH(ROWS)) {
        dims[0] = ROWS[e->choice];
    } else if (rank <= 2) {
        const int by = (int)(e->element % 5) - 2;
        hsize_t *d = &dims[rank > 1 && e->row % 2];
        *d = by < 0 && *d < (hsize_t)-by ? 0 : *d + (hsize_t)by;
        if (e->row % 7 == 6) rank = (rank + 1) % 3;
    }
    const hsize_t n = rank == 0 ? 1 : rank == 1 ? dims[0] : dims[0] * dims[1];
    const size_t size = H5Tget_size(type);
    unsigned char *more = n > 0 && n < ROOM / size ? calloc((size_t)n, size) : NULL;
    if (more && all) memcpy(more, all, bytes < n * size ? bytes : (size_t)n * size);
    if (rank >= 0 && rank <= 2) make(e, e->set, type, rank, dims, more);
    free(more);
    free(all);
    H5Tclose(type);
}

static void retype(const edit *e)
{
    hsize_t dims[H5S_MAX_RANK] = {1, 1};
    const hid_t set = H5Dopen2(e->file, e->set, H5P_DEFAULT);
    if (set < 0) return;
    const hid_t space = H5Dget_space(set);
    const int rank = H5Sget_simple_extent_dims(space, dims, NULL);
    H5Sclose(space);
    H5Dclose(set);
    const hid_t known[] = {H5T_NATIVE_FLOAT, H5T_IEEE_F64BE, H5T_STD_I64BE,   H5T_STD_U64LE,
                           H5T_NATIVE_UCHAR, H5T_C_S1,       H5T_STD_REF_OBJ, H5T_NATIVE_LDOUBLE};
    const unsigned k = e->choice % (LENGTH(known) + 4);
    hid_t type;
    if (k < LENGTH(known)) {
        type = H5Tcopy(known[k]);
    } else if (k == LENGTH(known)) {
        type = H5Tvlen_create(H5T_NATIVE_INT);
    } else if (k == LENGTH(known) + 1) {
        type = H5Tcopy(H5T_C_S1);
        H5Tset_size(type, H5T_VARIABLE);
    } else if (k == LENGTH(known) + 2) {
        type = H5Tcreate(H5T_OPAQUE, 64);
    } else {
        type = H5Tcreate(H5T_COMPOUND, 64);
        H5Tinsert(type, "a", 0, H5T_NATIVE_DOUBLE);
        H5Tinsert(type, "b", 56, H5T_NATIVE_INT64);
    }
    if (rank >= 0 && rank <= 2) make(e, e->set, type, rank, dims, NULL);
    H5Tclose(type);
}

/* ---- links ----------------------------------------------------------------------------------- */

static void relink(const edit *e)
{
    char group[EDIT_NAME], *slash;
    snprintf(group, sizeof group, "%s", e->set);
    slash = strchr(group, '/');
    if (slash) *slash = '\0';
    const char *name = e->row % 4 == 3 ? group : e->set; /* sometimes the group itself */
    H5Ldelete(e->file, name, H5P_DEFAULT);
    hid_t made;
    switch (e->choice % 6) {
    case 0: /* none */
        break;
    case 1: /* to nowhere, or in a circle */
        H5Lcreate_soft(e->row % 2 ? "/nowhere" : name, e->file, name, H5P_DEFAULT, H5P_DEFAULT);
        break;
    case 2: /* another one in its place, or its own group */
        H5Lcreate_hard(e->file, e->row % 8 ? e->other : "/", e->file, name, H5P_DEFAULT,
                       H5P_DEFAULT);
        break;
    case 3:
        H5Lcreate_external("nowhere.h5", "/x", e->file, name, H5P_DEFAULT, H5P_DEFAULT);
        break;
    case 4: /* a type */
        made = H5Tcopy(H5T_NATIVE_DOUBLE);
        H5Tcommit2(e->file, name, made, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        H5Tclose(made);
        break;
    default: /* a group */
        made = H5Gcreate2(e->file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        if (made >= 0) H5Gclose(made);
    }
}

/* A dataset more beside the other one, with a name of some length. */
static void add(const edit *e)
{
    char name[3 * EDIT_NAME];
    snprintf(name, sizeof name, "%s", e->other);
    char *slash = strrchr(name, '/');
    slash = slash ? slash + 1 : name;
    const size_t length = 1 + e->own[0];
    memset(slash, 'a' + (int)(e->row % 26), length);
    slash[length] = '\0';
    const hsize_t dims[2] = {e->element, ROWS[e->choice % LENGTH(ROWS)]};
    make(e, name, e->own[1] % 2 ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64, 1 + e->own[2] % 2, dims,
         NULL);
}

/* ---- the whole ------------------------------------------------------------------------------- */

static herr_t take_name(hid_t file, const char *name, const H5O_info_t *info, void *context)
{
    (void)file;
    h5good *good = context;
    if (info->type != H5O_TYPE_DATASET) return 0;
    REQUIRE(good->n < EDIT_SETS && strlen(name) < EDIT_NAME);
    strcpy(good->name[good->n++], name);
    return 0;
}

void h5good_set(h5good *good, unsigned char *image, size_t size)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    memset(good, 0, sizeof *good);
    good->image = image;
    good->size = size;
    const hid_t file = h5good_open(good);
    REQUIRE(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, take_name, good) >= 0 && good->n > 0);
    H5Fclose(file);
}

hid_t h5good_open(const h5good *good)
{
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    H5Pset_fapl_core(access, 1 << 16, 0);
    H5Pset_file_image(access, good->image, good->size);
    const hid_t file = H5Fopen("good.h5", H5F_ACC_RDWR, access);
    H5Pclose(access);
    REQUIRE(file >= 0);
    return file;
}

void h5_edit(hid_t file, const h5good *good, const uint8_t *data, size_t n)
{
    for (int k = 0; k < EDIT_MOST && n >= EDIT_BYTES; k++, data += EDIT_BYTES, n -= EDIT_BYTES) {
        edit e = {.file = file,
                  .set = good->name[data[1] % good->n],
                  .other = good->name[data[2] % good->n],
                  .row = data[3],
                  .element = data[4],
                  .choice = data[5]};
        memcpy(e.own, data + 6, sizeof e.own);
        switch (data[0] % 8) {
        case NUMBER:
        case COLUMN_OF_IT:
        case COPY_ROW:
        case ALL_ALIKE:
            change_contents(&e, (change)(data[0] % 8));
            break;
        case 4:
            reshape(&e);
            break;
        case 5:
            retype(&e);
            break;
        case 6:
            relink(&e);
            break;
        default:
            add(&e);
        }
    }
}

unsigned char *h5_image(hid_t file, size_t *size)
{
    void *image = NULL;
    hsize_t bytes = 0;
    if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0 || H5Fget_filesize(file, &bytes) < 0 ||
        H5Fget_vfd_handle(file, H5P_DEFAULT, &image) < 0)
        return NULL;
    *size = (size_t)bytes;
    return *(void **)image;
}
