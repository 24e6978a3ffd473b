/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Snapshots: what was written is read back with HDF5 itself, the series is complete and well
 * nested, and a failure leaves the files that were there as they were. Runs on any number of ranks.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <dirent.h>
#include <hdf5.h>
#include <math.h>
#include <mpi.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dem.h"
#include "near.h"
#include "snapshot.h"

enum { MOST = 4000, TEXT = 1 << 16 };

static int rank, ranks;
static char directory[256];

static const dem_material MATERIAL[2] = {{.name = "glass", .density = 2526.},
                                         {.name = "steel", .density = 7811.}};

/* n particles here, their numbers and states made from the rank and the row. */
typedef struct rows {
    int64_t id[MOST];
    double x[MOST][3], v[MOST][3], omega[MOST][3], radius[MOST], mass[MOST], force[MOST][3];
    int material[MOST];
} rows;

static rows data;

static double made(int64_t id, int column, int k)
{
    return sin(.37 * (double)id + 1.71 * column + .59 * k) * pow(10., column - 4);
}

static dem_view make(size_t n, int64_t first)
{
    for (size_t i = 0; i < n; i++) {
        const int64_t id = first + (int64_t)i;
        data.id[i] = id;
        data.radius[i] = 1e-3 * (1. + .5 * made(id, 4, 0));
        data.material[i] = id % 3 == 0;
        data.mass[i] = 1.;
        for (int k = 0; k < 3; k++) {
            data.x[i][k] = made(id, 0, k);
            data.v[i][k] = made(id, 1, k);
            data.omega[i][k] = made(id, 2, k);
            data.force[i][k] = made(id, 3, k);
        }
    }
    return (dem_view){.n = n,
                      .id = data.id,
                      .x = (const double(*)[3])data.x,
                      .v = (const double(*)[3])data.v,
                      .omega = (const double(*)[3])data.omega,
                      .radius = data.radius,
                      .mass = data.mass,
                      .material = data.material,
                      .force = (const double(*)[3])data.force};
}

static dem_status write_at(double time, const char *name, const dem_view *view, char message[512])
{
    return snapshot_write(MPI_COMM_WORLD, view, MATERIAL, time, directory, name, message, 512);
}

static void expect_written(double time, const char *name, size_t n, int64_t first)
{
    char message[512];
    const dem_view view = make(n, first);
    const dem_status status = write_at(time, name, &view, message);
    assert_string_equal(message, "");
    assert_int_equal(status, DEM_OK);
}

/* Rows of rank r and where they start, uneven on purpose. */
static size_t count_of(int r)
{
    return 7 + 13 * (size_t)r;
}

static int64_t start_of(int r)
{
    int64_t first = 0;
    for (int i = 0; i < r; i++) first += (int64_t)count_of(i);
    return first;
}

static char *read_text(const char *name)
{
    static char text[TEXT];
    char path[512];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    const size_t got = fread(text, 1, sizeof text - 1, f);
    text[got] = '\0';
    fclose(f);
    return text;
}

static int occurrences(const char *text, const char *what)
{
    int n = 0;
    for (const char *at = strstr(text, what); at != NULL; at = strstr(at + 1, what)) n++;
    return n;
}

/* Every element closed in order: enough of XML for a file without comments inside elements. */
static void check_nesting(const char *text)
{
    char open[64][64];
    int depth = 0;
    for (const char *at = strchr(text, '<'); at != NULL; at = strchr(at + 1, '<')) {
        if (at[1] == '?' || at[1] == '!') continue;
        const char *end = strchr(at, '>');
        char name[64];
        assert_non_null(end);
        if (at[1] == '/') {
            assert_int_equal(sscanf(at, "</%63[A-Za-z]>", name), 1);
            assert_true(depth > 0);
            assert_string_equal(name, open[--depth]);
        } else if (end[-1] != '/') {
            assert_true(depth < 64);
            assert_int_equal(sscanf(at, "<%63[A-Za-z]", open[depth++]), 1);
        }
    }
    assert_int_equal(depth, 0);
}

/* Files of the directory; none may be left over from writing. */
static int files(void)
{
    DIR *d = opendir(directory);
    assert_non_null(d);
    int n = 0;
    for (struct dirent *e = readdir(d); e != NULL; e = readdir(d)) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
        assert_null(strstr(e->d_name, ".part"));
        n++;
    }
    closedir(d);
    return n;
}

static void empty_directory(void)
{
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == 0) {
        DIR *d = opendir(directory);
        for (struct dirent *e = d ? readdir(d) : NULL; e != NULL; e = readdir(d)) {
            char path[600];
            snprintf(path, sizeof path, "%s/%s", directory, e->d_name);
            if (e->d_name[0] != '.' || e->d_name[1] == 'p') unlink(path);
        }
        if (d) closedir(d);
    }
    MPI_Barrier(MPI_COMM_WORLD);
}

/* ---- tests ----------------------------------------------------------------------------------- */

static void read_set(hid_t file, const char *name, hid_t type, size_t n, int width, void *out)
{
    char path[64];
    hsize_t dims[2] = {0, 1};
    snprintf(path, sizeof path, "/particles/%s", name);
    const hid_t set = H5Dopen2(file, path, H5P_DEFAULT);
    assert_true(set >= 0);
    const hid_t space = H5Dget_space(set);
    assert_int_equal(H5Sget_simple_extent_ndims(space), width > 1 ? 2 : 1);
    H5Sget_simple_extent_dims(space, dims, NULL);
    assert_int_equal(dims[0], n);
    assert_int_equal(dims[1], width);
    assert_true(H5Aexists(set, "units") > 0);
    assert_true(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out) >= 0);
    H5Sclose(space);
    H5Dclose(set);
}

static void check_columns(hid_t file, size_t n)
{
    static const char *vector[] = {"position", "velocity", "angularVelocity", "force"};
    double(*three)[3] = malloc(n * sizeof *three), *one = malloc(n * sizeof *one);
    int64_t *id = malloc(n * sizeof *id);
    int *material = malloc(n * sizeof *material);
    assert_true(three && one && id && material);
    read_set(file, "id", H5T_NATIVE_INT64, n, 1, id);
    for (size_t i = 0; i < n; i++) assert_int_equal(id[i], i);
    for (int c = 0; c < 4; c++) {
        read_set(file, vector[c], H5T_NATIVE_DOUBLE, n, 3, three);
        for (size_t i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) assert_true(three[i][k] == made((int64_t)i, c, k));
    }
    read_set(file, "diameter", H5T_NATIVE_DOUBLE, n, 1, one);
    for (size_t i = 0; i < n; i++)
        assert_near(one[i], 2e-3 * (1. + .5 * made((int64_t)i, 4, 0)), 1e-18);
    read_set(file, "density", H5T_NATIVE_DOUBLE, n, 1, one);
    read_set(file, "material", H5T_NATIVE_INT, n, 1, material);
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(material[i], i % 3 == 0);
        assert_near(one[i], i % 3 == 0 ? 7811. : 2526., 0.);
    }
    free(three);
    free(one);
    free(id);
    free(material);
}

static void test_read_back(void **state)
{
    (void)state;
    empty_directory();
    expect_written(.3125, "0.3125", count_of(rank), start_of(rank));
    char path[512];
    snprintf(path, sizeof path, "%s/0.3125.h5", directory);
    const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(file >= 0);
    double time;
    const hid_t a = H5Aopen(file, "time", H5P_DEFAULT);
    assert_true(H5Aread(a, H5T_NATIVE_DOUBLE, &time) >= 0);
    H5Aclose(a);
    assert_true(time == .3125);
    assert_true(H5Aexists(file, "version") > 0);
    check_columns(file, (size_t)start_of(ranks));

    char names[2][DEM_NAME];
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, DEM_NAME);
    const hid_t m = H5Aopen_by_name(file, "particles", "materials", H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Aread(m, type, names) >= 0);
    assert_string_equal(names[0], "glass");
    assert_string_equal(names[1], "steel");
    H5Aclose(m);
    H5Tclose(type);
    H5Fclose(file);
    assert_int_equal(files(), 2);
}

static void test_series(void **state)
{
    (void)state;
    empty_directory();
    const char *name[] = {"0", "0.1", "0.2", "0.3"};
    for (int i = 0; i < 4; i++) expect_written(.1 * i, name[i], count_of(rank), start_of(rank));
    const char *text = read_text("particles.xmf");
    check_nesting(text);
    assert_int_equal(occurrences(text, "GridType=\"Uniform\""), 4);
    assert_int_equal(occurrences(text, "<Time Value="), 4);
    char expected[128];
    snprintf(expected, sizeof expected, "Dimensions=\"%d 3\">0.2.h5:/particles/position<",
             (int)start_of(ranks));
    assert_int_equal(occurrences(text, expected), 1);
    assert_int_equal(occurrences(text, "CollectionType=\"Temporal\""), 1);
    for (int i = 1; i < 4; i++) assert_true(strstr(text, name[i - 1]) < strstr(text, name[i]));
    MPI_Barrier(MPI_COMM_WORLD);

    /* Restart at .1 with another step: .2 and .3 belong to the old future. */
    expect_written(.1 * (1. + 1e-12), "0.1", count_of(rank), start_of(rank));
    expect_written(.15, "0.15", count_of(rank), start_of(rank));
    text = read_text("particles.xmf");
    check_nesting(text);
    assert_int_equal(occurrences(text, "GridType=\"Uniform\""), 3);
    assert_int_equal(occurrences(text, "0.2.h5"), 0);
    assert_int_equal(occurrences(text, "<Time Value=\"0.15\"/>"), 1);
    assert_int_equal(occurrences(text, "<Grid Name=\"0.1\""), 1);
    MPI_Barrier(MPI_COMM_WORLD);

    /* A rank without particles takes part all the same. */
    expect_written(.155, "0.155", rank == 0 ? 5 : 0, 0);
    assert_int_equal(occurrences(read_text("particles.xmf"), "<Time Value="), 4);
    MPI_Barrier(MPI_COMM_WORLD);

    /* No particles at all: the file exists, the series is still sound. */
    expect_written(.16, "0.16", 0, 0);
    text = read_text("particles.xmf");
    check_nesting(text);
    assert_int_equal(occurrences(text, "GridType=\"Uniform\""), 4);
    assert_int_equal(files(), 8);
}

/* The run must not go on with a broken file: DEM_IO, reason told, old files whole, nothing left. */
static void expect_failure(double time, const char *name, size_t n, const char *reason)
{
    char message[512], *before = strdup(read_text("particles.xmf"));
    const int had = files();
    MPI_Barrier(MPI_COMM_WORLD);
    const dem_view view = make(n, 0);
    assert_int_equal(write_at(time, name, &view, message), DEM_IO);
    if (strstr(message, reason) == NULL) fail_msg("'%s' not in '%s'", reason, message);
    assert_non_null(strstr(message, directory));
    assert_string_equal(read_text("particles.xmf"), before);
    assert_int_equal(files(), had);
    free(before);
    MPI_Barrier(MPI_COMM_WORLD); /* nobody changes the directory while another one looks */
}

/* A limit on the size of files acts like a full disk, in the middle of writing. */
static void test_full_disk(void **state)
{
    (void)state;
    empty_directory();
    expect_written(0., "0", count_of(rank), start_of(rank));
    struct rlimit old, small;
    signal(SIGXFSZ, SIG_IGN);
    for (rlim_t size = 1024; size < (rlim_t)ranks * 4000 * 124; size = size * 7 / 3) {
        getrlimit(RLIMIT_FSIZE, &old);
        small = old;
        small.rlim_cur = size;
        setrlimit(RLIMIT_FSIZE, &small);
        expect_failure(0., "0", MOST, "write: File too large");
        setrlimit(RLIMIT_FSIZE, &old);
    }
    if (ranks > 1) { /* one rank alone cannot write its part */
        small.rlim_cur = 30000;
        if (rank == 1) setrlimit(RLIMIT_FSIZE, &small);
        expect_failure(0., "0", MOST, "file write failed");
        setrlimit(RLIMIT_FSIZE, &old);
    }
    const hid_t file =
        H5Fopen(strcat(strcpy((char[512]){0}, directory), "/0.h5"), H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(file >= 0);
    check_columns(file, (size_t)start_of(ranks));
    H5Fclose(file);
    expect_written(.1, "0.1", count_of(rank), start_of(rank)); /* and it recovers */
}

static void test_unwritable(void **state)
{
    (void)state;
    empty_directory();
    expect_written(0., "0", count_of(rank), start_of(rank));
    expect_failure(.1, "", 3, "is not a name");
    expect_failure(.1, "a/b", 3, "is not a name");

    /* Root may write anywhere: a folder in the place of the file stops it as well. */
    char path[512], message[512];
    snprintf(path, sizeof path, "%s/.0.1.h5.part", directory);
    if (rank == 0) assert_int_equal(mkdir(path, 0777), 0);
    MPI_Barrier(MPI_COMM_WORLD);
    const dem_view view = make(3, 0);
    assert_int_equal(write_at(.1, "0.1", &view, message), DEM_IO);
    assert_non_null(strstr(message, "create"));
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == 0) rmdir(path);
    assert_int_equal(occurrences(read_text("particles.xmf"), "<Time Value="), 1);

    if (geteuid() != 0 && rank == 0) chmod(directory, 0555);
    MPI_Barrier(MPI_COMM_WORLD);
    if (geteuid() != 0) expect_failure(.1, "0.1", 3, "ermission denied");
    MPI_Barrier(MPI_COMM_WORLD);
    if (geteuid() != 0 && rank == 0) chmod(directory, 0755);

    /* A file in the place of the directory. */
    char nested[512];
    snprintf(nested, sizeof nested, "%s/0.h5/dem", directory);
    assert_int_equal(
        snapshot_write(MPI_COMM_WORLD, &view, MATERIAL, .1, nested, "0", message, sizeof message),
        DEM_IO);
    assert_non_null(strstr(message, "Not a directory"));
    assert_int_equal(files(), 2);
    MPI_Barrier(MPI_COMM_WORLD);
}

static void test_makes_directories(void **state)
{
    (void)state;
    char deep[300], message[512];
    snprintf(deep, sizeof deep, "%s/p1/p2/dem", directory);
    const dem_view view = make(5, 0);
    assert_int_equal(snapshot_write(MPI_COMM_WORLD, &view, MATERIAL, 1., deep, "1", message, 512),
                     DEM_OK);
    char path[600];
    for (int i = 0; i < 5 && rank == 0; i++) {
        static const char *const made_there[] = {"p1/p2/dem/1.h5", "p1/p2/dem/particles.xmf",
                                                 "p1/p2/dem", "p1/p2", "p1"};
        snprintf(path, sizeof path, "%s/%s", directory, made_there[i]);
        assert_int_equal(remove(path), 0);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_read_back),         cmocka_unit_test(test_series),
        cmocka_unit_test(test_full_disk),         cmocka_unit_test(test_unwritable),
        cmocka_unit_test(test_makes_directories),
    };
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (rank == 0) {
        const char *base = getenv("TMPDIR");
        snprintf(directory, sizeof directory, "%.200s/felmiSnapshot.XXXXXX", base ? base : "/tmp");
        if (mkdtemp(directory) == NULL) MPI_Abort(MPI_COMM_WORLD, 1);
    }
    MPI_Bcast(directory, sizeof directory, MPI_CHAR, 0, MPI_COMM_WORLD);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    empty_directory();
    if (rank == 0) rmdir(directory);
    MPI_Finalize();
    return failed;
}
