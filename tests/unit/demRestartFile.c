/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Restart files that are no good are refused by name with the reason: cut off at any length, one
 * bit wrong anywhere, of another kind, of a newer version, without one of their datasets, or with
 * contents that make no sense. A full disk leaves the files that were there; older ones go only
 * when the newer one is complete.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <dirent.h>
#include <hdf5.h>
#include <inttypes.h>
#include <math.h>
#include <mpi.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "crc64.h"
#include "dem.h"

enum { HEAD = 512, GRAINS = 60 };

static char directory[256];

/* ---- a small simulation in which everything occurs --------------------------------------------
 */

typedef struct vessel {
    dem_param param;
    dem_material material;
    dem_pair pair;
    dem_wall wall;
    dem_species species;
    dem_feeder feeder;
    dem_outlet outlet;
    dem_sim *sim;
} vessel;

static void vessel_init(vessel *b, const char *restart)
{
    static const double lo[3] = {-.006, -.006, 0}, hi[3] = {.006, .006, .04};
    static const double low[3] = {-.005, -.005, .028}, high[3] = {.005, .005, .039};
    memset(b, 0, sizeof *b);
    dem_param *p = &b->param;
    *p = dem_param_default();
    p->restart = restart;
    memcpy(p->lo, lo, sizeof lo);
    memcpy(p->hi, hi, sizeof hi);
    p->gravity[2] = -9.81;
    p->rolling = DEM_ROLLING_EPSD;
    p->balance = 1;
    strcpy(b->material.name, "grain");
    b->material.density = 2385;
    b->pair = (dem_pair){.restitution = .6,
                         .friction = .4,
                         .stiffness = 150,
                         .stiffness_ratio = .8,
                         .rolling_friction = .1};
    p->n_material = 1;
    p->material = &b->material;
    p->pair = &b->pair;
    strcpy(b->wall.name, "vessel");
    b->wall.shape = dem_sdf_box(lo, hi, 1);
    p->n_wall = 1;
    p->wall = &b->wall;
    b->species.size = (dem_size){.kind = DEM_SIZE_UNIFORM, .lo = .002, .hi = .003};
    b->species.share = 1;
    strcpy(b->feeder.name, "spout");
    b->feeder.region = dem_sdf_box(low, high, 1);
    memcpy(b->feeder.lo, low, sizeof low);
    memcpy(b->feeder.hi, high, sizeof high);
    b->feeder.n_species = 1;
    b->feeder.species = &b->species;
    b->feeder.number_rate = 700;
    b->feeder.end = .1;
    b->feeder.mass = INFINITY;
    b->feeder.number = GRAINS;
    p->n_feeder = 1;
    p->feeder = &b->feeder;
    strcpy(b->outlet.name, "drain");
    b->outlet.region = dem_sdf_sphere((const double[3]){.006, .006, 0}, .003, 1);
    b->outlet.end = .15;
    p->n_outlet = 1;
    p->outlet = &b->outlet;
}

static void vessel_free(vessel *b, int shapes)
{
    dem_free(b->sim);
    if (!shapes) return;
    dem_sdf_free(b->wall.shape);
    dem_sdf_free(b->feeder.region);
    dem_sdf_free(b->outlet.region);
}

static void fill(vessel *b)
{
    vessel_init(b, NULL);
    if (dem_new(MPI_COMM_SELF, &b->param, &b->sim)) fail_msg("%s", dem_message(b->sim));
    assert_int_equal(dem_attach(b->sim, "carried", 3), 0);
    if (dem_advance(b->sim, .3, 0)) fail_msg("%s", dem_message(b->sim));
    const dem_report report = dem_last_report(b->sim);
    if (report.contacts < 20 || report.wall_contacts < 10)
        fail_msg("%d contacts, %d with walls, %d particles", (int)report.contacts,
                 (int)report.wall_contacts, (int)report.particles);
}

/* ---- files ------------------------------------------------------------------------------------
 */

typedef struct bytes {
    unsigned char *data;
    size_t n;
} bytes;

static const char *path_of(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    return path;
}

static bytes read_file(const char *name)
{
    FILE *file = fopen(path_of(name), "rb");
    bytes b = {NULL, 0};
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    b.n = (size_t)ftell(file);
    b.data = malloc(b.n + 1);
    rewind(file);
    assert_int_equal(fread(b.data, 1, b.n, file), b.n);
    fclose(file);
    return b;
}

static void write_file(const char *name, const void *data, size_t n)
{
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, n, file), n);
    assert_int_equal(fclose(file), 0);
}

/* The good file, made once. */
static const bytes *good(void)
{
    static bytes b;
    if (b.data) return &b;
    vessel v;
    fill(&v);
    if (dem_write_restart(v.sim, directory, "good", 0)) fail_msg("%s", dem_message(v.sim));
    vessel_free(&v, 0);
    b = read_file("good.h5");
    return &b;
}

/* Reading `name` fails with DEM_IO; the message names the file and, if not NULL, says `reason`. */
static void expect_refused(const char *name, const char *reason)
{
    vessel v;
    char path[512];
    snprintf(path, sizeof path, "%s", path_of(name));
    vessel_init(&v, path);
    const dem_status status = dem_new(MPI_COMM_SELF, &v.param, &v.sim);
    const char *message = dem_message(v.sim);
    if (status != DEM_IO || !strstr(message, path) || (reason && !strstr(message, reason)))
        fail_msg("%s: '%s' expected, status %d: %s", name, reason ? reason : "", status, message);
    vessel_free(&v, 1);
}

static void expect_good(const char *name)
{
    vessel v;
    char path[512];
    snprintf(path, sizeof path, "%s", path_of(name));
    vessel_init(&v, path);
    if (dem_new(MPI_COMM_SELF, &v.param, &v.sim)) fail_msg("%s", dem_message(v.sim));
    if (dem_advance(v.sim, .001, 0)) fail_msg("%s", dem_message(v.sim));
    vessel_free(&v, 0);
}

/* ---- tests ------------------------------------------------------------------------------------
 */

static uint64_t sum_of(const void *data, size_t n)
{
    static crc64 c;
    crc64_begin(&c);
    crc64_add(&c, data, n);
    return crc64_end(&c);
}

/* The check value of the catalogue of CRC algorithms for CRC-64/XZ, in one piece, in two, and of
 * two that are summed apart. */
static void test_checksum(void **state)
{
    (void)state;
    static crc64 c;
    static unsigned char large[300007];
    for (size_t k = 0; k < sizeof large; k++) large[k] = (unsigned char)(k * k % 251);
    for (size_t cut = 1; cut < sizeof large; cut = 3 * cut + 7)
        assert_true(sum_of(large, sizeof large) ==
                    crc64_join(sum_of(large, cut), sum_of(large + cut, sizeof large - cut),
                               sizeof large - cut));
    for (size_t cut = 0; cut <= 9; cut++) {
        crc64_begin(&c);
        crc64_add(&c, "123456789", cut);
        crc64_add(&c, "123456789" + cut, 9 - cut);
        assert_true(crc64_end(&c) == UINT64_C(0x995dc9bbdf1939fa));
        assert_true(crc64_join(sum_of("123456789", cut), sum_of("123456789" + cut, 9 - cut),
                               9 - cut) == UINT64_C(0x995dc9bbdf1939fa));
    }
}

static void test_good(void **state)
{
    (void)state;
    good();
    expect_good("good.h5");
}

static void test_truncated(void **state)
{
    (void)state;
    const bytes *b = good();
    size_t lengths = 0;
    for (size_t n = 0; n < b->n; n += n < HEAD ? 29 : 1 + b->n / 97, lengths++) {
        write_file("bad.h5", b->data, n);
        expect_refused("bad.h5", n == 0 ? "is empty" : "truncated");
    }
    write_file("bad.h5", b->data, b->n - 1);
    expect_refused("bad.h5", "truncated");
    assert_true(lengths > 100);
}

static void test_flipped(void **state)
{
    (void)state;
    const bytes *b = good();
    unsigned char *copy = malloc(b->n + 1);
    memcpy(copy, b->data, b->n);
    unsigned seed = 12345;
    for (int k = 0; k < HEAD + 600; k++) {
        seed = seed * 1664525u + 1013904223u; /* Numerical Recipes' quick generator */
        const size_t at = k < HEAD ? (size_t)k : HEAD + (size_t)(seed >> 8) % (b->n - HEAD);
        const unsigned char bit = (unsigned char)(1u << (seed >> 4) % 8);
        copy[at] ^= bit;
        write_file("bad.h5", copy, b->n);
        expect_refused("bad.h5", k < HEAD ? NULL : "damaged");
        copy[at] ^= bit;
    }
    copy[b->n] = 0;
    write_file("bad.h5", copy, b->n + 1);
    expect_refused("bad.h5", "damaged");
    free(copy);
}

static void test_foreign(void **state)
{
    (void)state;
    const bytes *b = good();
    expect_refused("none.h5", "No such file");
    char text[2048];
    for (size_t k = 0; k < sizeof text; k++) text[k] = (char)(37 * k + k / 7);
    write_file("bad.h5", text, sizeof text);
    expect_refused("bad.h5", "is not a restart file");
    write_file("bad.h5", text, 3);
    expect_refused("bad.h5", "is not a restart file");
    write_file("bad.h5", b->data + HEAD, b->n - HEAD);
    expect_refused("bad.h5", "is an HDF5 file, but not a restart file");
    mkdir(path_of("folder.h5"), 0777);
    expect_refused("folder.h5", NULL);
    rmdir(path_of("folder.h5"));
}

/* Give a file that was changed the head of one that was not, with another version if asked. */
static void sign(const char *name, int version)
{
    bytes b = read_file(name);
    static crc64 c;
    char lines[HEAD], last[40];
    const int n = snprintf(lines, sizeof lines,
                           "felmiFoam restart\nversion %d\ntime 0.15\nparticles 1\nlength %zu\n",
                           version, b.n);
    crc64_begin(&c);
    crc64_add(&c, lines, (size_t)n);
    crc64_add(&c, b.data + HEAD, b.n - HEAD);
    const int m = snprintf(last, sizeof last, "checksum %016" PRIx64 "\n", crc64_end(&c));
    memset(b.data, ' ', HEAD);
    memcpy(b.data, lines, (size_t)n);
    memcpy(b.data + n, last, (size_t)m);
    b.data[HEAD - 1] = '\n';
    write_file(name, b.data, b.n);
    free(b.data);
}

static void test_version(void **state)
{
    (void)state;
    const bytes *b = good();
    write_file("bad.h5", b->data, b->n);
    sign("bad.h5", 1);
    expect_good("bad.h5"); /* signing is as it should be */
    sign("bad.h5", 2);
    expect_refused("bad.h5", "newer version: layout 2, this one reads 1");
}

typedef struct names {
    char (*name)[128];
    int n;
} names;

static herr_t take_name(hid_t file, const char *name, const H5O_info_t *info, void *context)
{
    (void)file;
    names *all = context;
    assert_true(all->n < 200);
    if (info->type == H5O_TYPE_DATASET) snprintf(all->name[all->n++], 128, "%s", name);
    return 0;
}

static hid_t open_copy(void)
{
    const bytes *b = good();
    write_file("bad.h5", b->data, b->n);
    const hid_t file = H5Fopen(path_of("bad.h5"), H5F_ACC_RDWR, H5P_DEFAULT);
    assert_true(file >= 0);
    return file;
}

static void test_missing(void **state)
{
    (void)state;
    names all = {calloc(200, 128), 0};
    hid_t file = open_copy();
    H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, take_name, &all);
    H5Fclose(file);
    int optional = 0;
    for (int k = 0; k < all.n; k++) {
        file = open_copy();
        assert_true(H5Ldelete(file, all.name[k], H5P_DEFAULT) >= 0);
        H5Fclose(file);
        sign("bad.h5", 1);
        char reason[200];
        snprintf(reason, sizeof reason, "dataset %s is missing", all.name[k]);
        /* A column that was not attached is not missed. */
        if (strncmp(all.name[k], "columns/", 8) == 0)
            optional++;
        else
            expect_refused("bad.h5", reason);
    }
    assert_int_equal(optional, 1);
    assert_true(all.n > 60);
    free(all.name);
}

/* Contents that a checksum cannot know to be wrong. */
static void test_senseless(void **state)
{
    (void)state;
    static const struct {
        const char *set;
        int whole;
        double value; /* of its first number */
        const char *reason;
    } bad[] = {
        {"particles/id", 1, 1e9, "out of order"},
        {"particles/material", 1, 7, "no material 7"},
        {"particles/radius", 0, -1, "particle"},
        {"particles/position", 0, NAN, "particle"},
        {"contacts/first", 1, 1e9, "a contact is between"},
        {"contacts/spring", 0, NAN, "row 0 of dataset contacts/spring is no such number"},
        {"state/moved", 0, INFINITY, "row 0 of dataset state/moved is no such number"},
        {"state/rebuilds", 1, 9.1e18, "row 0 of dataset state/rebuilds is no such number"},
        {"state/listed", 1, 1e12, "row 0 of dataset state/listed is no such number"},
        {"wallContacts/particle", 1, -3, "a contact is of particle"},
        {"wallContacts/wall", 1, 12, "a contact is of particle"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const hid_t file = open_copy();
        const hid_t set = H5Dopen2(file, bad[k].set, H5P_DEFAULT), space = H5Dget_space(set);
        const hsize_t first[2] = {0, 0}, one[2] = {1, 1};
        H5Sselect_hyperslab(space, H5S_SELECT_SET, first, NULL, one, NULL);
        const hid_t memory = H5Screate_simple(1, one, NULL);
        const int64_t whole = (int64_t)(bad[k].whole ? bad[k].value : 0);
        assert_true(H5Dwrite(set, bad[k].whole ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE, memory,
                             space, H5P_DEFAULT,
                             bad[k].whole ? (const void *)&whole : &bad[k].value) >= 0);
        H5Sclose(memory);
        H5Sclose(space);
        H5Dclose(set);
        H5Fclose(file);
        sign("bad.h5", 1);
        expect_refused("bad.h5", bad[k].reason);
    }
    /* So many rows that their bytes, counted in 64 bits, are none; in chunks they take no room. */
    const hsize_t rows = (hsize_t)1 << 61, chunk = 16;
    hid_t file = open_copy(), space = H5Screate_simple(1, &rows, NULL);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &chunk);
    H5Ldelete(file, "particles/id", H5P_DEFAULT);
    H5Dclose(H5Dcreate2(file, "particles/id", H5T_NATIVE_INT64, space, H5P_DEFAULT, creation,
                        H5P_DEFAULT));
    H5Pclose(creation);
    H5Sclose(space);
    H5Fclose(file);
    sign("bad.h5", 1);
    expect_refused("bad.h5", "more than fit in memory");
    /* A dataset of another kind in the place of one. */
    file = open_copy();
    space = H5Screate(H5S_SCALAR);
    H5Ldelete(file, "contacts/spring", H5P_DEFAULT);
    H5Dclose(H5Dcreate2(file, "contacts/spring", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, H5P_DEFAULT,
                        H5P_DEFAULT));
    H5Sclose(space);
    H5Fclose(file);
    sign("bad.h5", 1);
    expect_refused("bad.h5", "contacts/spring is not of the kind");
}

static int exists(const char *name)
{
    return access(path_of(name), F_OK) == 0;
}

/* Names are sorted as numbers; what is not a restart file is never deleted. */
static void test_keep(void **state)
{
    (void)state;
    vessel v;
    fill(&v);
    static const char *const name[] = {"9", "10", "10.5", "1e2", "-2"};
    for (int k = 0; k < 5; k++)
        assert_int_equal(dem_write_restart(v.sim, directory, name[k], 0), DEM_OK);
    write_file("8.h5", "mine", 4);
    write_file(".7.h5.part", "remains of a run that was killed", 32);
    assert_int_equal(dem_write_restart(v.sim, directory, "11", 2), DEM_OK);
    assert_true(exists("11.h5") && exists("10.5.h5")); /* the last two up to 11 */
    assert_true(!exists("10.h5") && !exists("9.h5") && !exists("-2.h5"));
    assert_true(exists("1e2.h5"));                    /* of later: another run's */
    assert_true(exists("8.h5") && exists("good.h5")); /* not a restart file; not a number */
    assert_true(!exists(".7.h5.part"));
    assert_int_equal(dem_write_restart(v.sim, directory, "11", 2), DEM_OK);
    assert_true(exists("11.h5") && exists("10.5.h5"));
    vessel_free(&v, 0);
    static const char *const left[] = {"8.h5", "10.5.h5", "11.h5", "1e2.h5"};
    for (int k = 0; k < 4; k++) unlink(path_of(left[k]));
}

static void test_full_disk(void **state)
{
    (void)state;
    vessel v;
    fill(&v);
    assert_int_equal(dem_write_restart(v.sim, directory, "1", 1), DEM_OK);
    const bytes before = read_file("1.h5");
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit old, small;
    getrlimit(RLIMIT_FSIZE, &old);
    for (rlim_t size = 100; size < before.n; size = size * 3) {
        small = old;
        small.rlim_cur = size;
        setrlimit(RLIMIT_FSIZE, &small);
        /* Under its own name, and as a newer one. */
        for (int k = 1; k <= 2; k++) {
            const dem_status status = dem_write_restart(v.sim, directory, k == 1 ? "1" : "2", 1);
            assert_int_equal(status, DEM_IO);
            assert_non_null(strstr(dem_message(v.sim), "write: File too large"));
            assert_non_null(strstr(dem_message(v.sim), k == 1 ? "/1.h5" : "/2.h5"));
        }
        setrlimit(RLIMIT_FSIZE, &old);
        assert_true(!exists("2.h5") && !exists(".2.h5.part") && !exists(".1.h5.part"));
        const bytes after = read_file("1.h5");
        assert_int_equal(after.n, before.n);
        assert_memory_equal(after.data, before.data, after.n);
        free(after.data);
    }
    expect_good("1.h5");
    assert_int_equal(dem_write_restart(v.sim, directory, "2", 1), DEM_OK); /* and it recovers */
    assert_true(exists("2.h5") && !exists("1.h5"));
    unlink(path_of("2.h5"));
    free(before.data);
    assert_int_equal(dem_write_restart(v.sim, directory, "a/b", 1), DEM_IO);
    assert_int_equal(dem_write_restart(v.sim, path_of("good.h5"), "1", 1), DEM_IO);
    assert_non_null(strstr(dem_message(v.sim), "in the way"));
    vessel_free(&v, 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_checksum),  cmocka_unit_test(test_good),
        cmocka_unit_test(test_truncated), cmocka_unit_test(test_flipped),
        cmocka_unit_test(test_foreign),   cmocka_unit_test(test_version),
        cmocka_unit_test(test_missing),   cmocka_unit_test(test_senseless),
        cmocka_unit_test(test_keep),      cmocka_unit_test(test_full_disk),
    };
    MPI_Init(&argc, &argv);
    const char *base = getenv("TMPDIR");
    snprintf(directory, sizeof directory, "%.200s/felmiRestart.XXXXXX", base ? base : "/tmp");
    if (mkdtemp(directory) == NULL) return 1;
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    free(good()->data);
    unlink(path_of("good.h5"));
    unlink(path_of("bad.h5"));
    rmdir(directory);
    MPI_Finalize();
    return failed;
}
