/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Restart on several ranks: a file does not tell how many wrote it, and a run that is read on any
 * number of them goes on to the last bit as the straight one does. What is wrong with a file, or
 * with the disk, is told alike by all ranks, and none waits for another.
 *
 * All in one program of up to four ranks, of which the first one, two, three and four are at work
 * by turns; alone it tests those numbers that it has. Run by demRestartRanks.sh.
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
#include <unistd.h>

#include "dem.h"

enum { GRAINS = 300, MOST = 4, STOP = 6, END = 9 };

static int rank, ranks;
static char directory[256];
static MPI_Comm team[MOST + 1]; /* of the first so many ranks; MPI_COMM_NULL on the others */

/* ---- grains that fall on a rotating bar, carry numbers, come and go ---------------------------
 */

typedef struct box {
    dem_param param;
    dem_material material[2];
    dem_pair pair[4];
    dem_wall wall[2];
    dem_motion motion;
    dem_insertion insertion;
    dem_species species;
    dem_feeder feeder;
    dem_outlet outlet;
    dem_sim *sim;
    MPI_Comm comm;
    int column;
} box;

typedef struct variant {
    const char *name;
    dem_law law;
    dem_rolling rolling;
    int periodic, feeding;
} variant;

static const variant VARIANT[] = {
    {"rolling", DEM_HERTZ, DEM_ROLLING_EPSD, 1, 0},
    {"feeding", DEM_LINEAR, DEM_ROLLING_NONE, 0, 1},
};
enum { VARIANTS = sizeof VARIANT / sizeof *VARIANT };

static dem_sdf *take_box(double lo[3], double hi[3], const double from[3], const double to[3])
{
    memcpy(lo, from, 3 * sizeof *lo);
    memcpy(hi, to, 3 * sizeof *hi);
    return dem_sdf_box(from, to, 1);
}

static void add_flow(box *b)
{
    dem_feeder *f = &b->feeder;
    strcpy(f->name, "spout");
    f->region = take_box(f->lo, f->hi, (const double[3]){-.015, -.015, .045},
                         (const double[3]){.015, .015, .066});
    f->n_species = 1;
    f->species = &b->species;
    f->number_rate = 900;
    f->end = 1;
    f->mass = INFINITY;
    f->number = -1;
    f->velocity[2] = -.9;
    f->velocity_spread = .11;
    f->seed = 99;
    b->param.n_feeder = 1;
    b->param.feeder = f;
    strcpy(b->outlet.name, "drain");
    b->outlet.region =
        dem_sdf_box((const double[3]){.012, -.02, 0}, (const double[3]){.022, 0, .006}, 1);
    b->outlet.end = INFINITY;
    b->param.n_outlet = 1;
    b->param.outlet = &b->outlet;
}

static void box_init(box *b, const variant *v, MPI_Comm comm, const char *restart)
{
    memset(b, 0, sizeof *b);
    dem_param *p = &b->param;
    b->comm = comm;
    *p = dem_param_default();
    p->law = v->law;
    p->rolling = v->rolling;
    p->restart = restart;
    p->imbalance = 1.05;
    const double lo[3] = {-.021, -.019, 0}, hi[3] = {.021, .019, .07};
    memcpy(p->lo, lo, sizeof lo);
    memcpy(p->hi, hi, sizeof hi);
    p->periodic[0] = v->periodic;
    p->gravity[0] = 2.1;
    p->gravity[2] = -9.66;
    strcpy(b->material[0].name, "grain");
    strcpy(b->material[1].name, "steel");
    for (int m = 0; m < 2; m++) {
        b->material[m].density = 2385 + 3000 * m;
        b->material[m].youngs_modulus = 2.7e5;
        b->material[m].poisson_ratio = .29;
    }
    for (int k = 0; k < 4; k++)
        b->pair[k] = (dem_pair){.restitution = .61,
                                .friction = .37,
                                .stiffness = 93,
                                .stiffness_ratio = .81,
                                .rolling_friction = .09,
                                .rolling_damping = .3};
    p->n_material = 2;
    p->material = b->material;
    p->pair = b->pair;
    p->n_wall = 2;
    p->wall = b->wall;
    const double wide = v->periodic ? .03 : .0205;
    strcpy(b->wall[0].name, "vessel");
    b->wall[0].shape = dem_sdf_box((const double[3]){-wide, -.0185, .0005},
                                   (const double[3]){wide, .0185, .069}, 1);
    strcpy(b->wall[1].name, "bar");
    b->wall[1].shape = dem_sdf_cylinder((const double[3]){0, -.018, .008},
                                        (const double[3]){0, .018, .008}, .004, 1, 0);
    b->wall[0].material = b->wall[1].material = 1;
    b->motion = dem_motion_default();
    b->motion.kind = DEM_ROTATION;
    b->motion.vector[1] = 1;
    b->motion.origin[0] = .003;
    b->motion.origin[2] = .011;
    b->motion.rate = 23;
    b->wall[1].n_motion = 1;
    b->wall[1].motion = &b->motion;
    b->species.share = 1;
    b->species.size = (dem_size){.kind = DEM_SIZE_UNIFORM, .lo = .0014, .hi = .0041};
    dem_insertion *i = &b->insertion;
    strcpy(i->name, "fill");
    i->kind = DEM_INSERT_RANDOM;
    i->region = take_box(i->lo, i->hi, (const double[3]){-.02, -.018, .013},
                         (const double[3]){.02, .018, .044});
    i->number = GRAINS;
    i->n_species = 1;
    i->species = &b->species;
    i->velocity[2] = -.4;
    i->velocity_spread = .3;
    i->seed = 4711;
    p->n_insertion = 1;
    p->insertion = i;
    if (v->feeding) add_flow(b);
}

static void box_new(box *b, const variant *v, MPI_Comm comm, const char *restart)
{
    box_init(b, v, comm, restart);
    if (dem_new(comm, &b->param, &b->sim)) fail_msg("%s", dem_message(b->sim));
    b->column = dem_attach(b->sim, "carried", 2);
    assert_true(b->column >= 0);
    assert_int_equal(dem_column_restored(b->sim, b->column), restart != NULL);
    double number = 17;
    if (!restart) dem_keep(b->sim, "number", 1, &number);
    assert_int_equal(dem_kept(b->sim, "number", 1, &number), 1);
    assert_true(number == 17);
}

static void box_advance(box *b, int from, int to)
{
    for (int c = from; c < to; c++) {
        const dem_view view = dem_particles(b->sim);
        double *carried = dem_column(b->sim, b->column);
        for (size_t i = 0; i < view.n; i++) {
            carried[2 * i] = (double)view.id[i];
            carried[2 * i + 1] = .5 * carried[2 * i + 1] + view.x[i][0];
        }
        if (dem_advance(b->sim, .0061, 0)) fail_msg("%s", dem_message(b->sim));
    }
}

/* Shapes are the simulation's if there was one. */
static void box_free(box *b, int good)
{
    dem_free(b->sim);
    if (good) return;
    for (int w = 0; w < 2; w++) dem_sdf_free(b->wall[w].shape);
    dem_sdf_free(b->insertion.region);
    if (b->param.n_feeder) dem_sdf_free(b->feeder.region);
    if (b->param.n_outlet) dem_sdf_free(b->outlet.region);
}

static char *path_of(const char *name, char path[512])
{
    snprintf(path, 512, "%s/%s.h5", directory, name);
    return path;
}

static void write_restart(box *b, const char *name)
{
    if (dem_write_restart(b->sim, directory, name, 0)) fail_msg("%s", dem_message(b->sim));
}

/* ---- what is in two files --------------------------------------------------------------------
 */

typedef struct comparison {
    hid_t other;
    const char *names;
    int sets, sums; /* sums: over the ranks, the same but for rounding */
} comparison;

static void *read_set(hid_t set, size_t *bytes)
{
    const hid_t space = H5Dget_space(set), type = H5Dget_type(set);
    *bytes = (size_t)H5Sget_simple_extent_npoints(space) * H5Tget_size(type);
    char *data = malloc(*bytes + 1);
    if (*bytes > 0) assert_true(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    H5Tclose(type);
    H5Sclose(space);
    return data;
}

/* Sums over particles or contacts, in whatever order they are. */
static int is_sum(const char *name)
{
    static const char *const sums[] = {"walls/load", "state/mass", "balance/", "outlets/mass"};
    for (size_t k = 0; k < sizeof sums / sizeof *sums; k++)
        if (strncmp(name, sums[k], strlen(sums[k])) == 0) return 1;
    return 0;
}

static herr_t compare_set(hid_t file, const char *name, const H5O_info_t *info, void *context)
{
    comparison *c = context;
    /* The order in the store is a matter of the ranks. */
    if (info->type != H5O_TYPE_DATASET || strcmp(name, "particles/place") == 0) return 0;
    const hid_t a = H5Dopen2(file, name, H5P_DEFAULT), b = H5Dopen2(c->other, name, H5P_DEFAULT);
    assert_true(a >= 0 && b >= 0);
    size_t n[2];
    double *x = read_set(a, &n[0]), *y = read_set(b, &n[1]);
    if (n[0] != n[1]) fail_msg("%s: %s has %zu and %zu bytes", c->names, name, n[0], n[1]);
    int same = memcmp(x, y, n[0]) == 0;
    if (!same && c->sums && is_sum(name)) {
        double apart = 0, size = 0;
        for (size_t k = 0; k < n[0] / sizeof *x; k++) {
            apart = fmax(apart, fabs(x[k] - y[k]));
            size = fmax(size, fabs(x[k]));
        }
        same = apart <= 1e-12 * size;
    }
    if (!same) fail_msg("%s: %s differs", c->names, name);
    free(x);
    free(y);
    H5Dclose(a);
    H5Dclose(b);
    c->sets++;
    return 0;
}

static void expect_same_contents(const char *one, const char *two, int sums)
{
    char path[512], names[64];
    if (rank != 0) return;
    snprintf(names, sizeof names, "%s and %s", one, two);
    const hid_t file = H5Fopen(path_of(one, path), H5F_ACC_RDONLY, H5P_DEFAULT);
    comparison c = {.other = H5Fopen(path_of(two, path), H5F_ACC_RDONLY, H5P_DEFAULT),
                    .names = names,
                    .sums = sums};
    assert_true(file >= 0 && c.other >= 0);
    assert_true(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, compare_set, &c) >= 0);
    assert_true(c.sets > 50);
    H5Fclose(file);
    H5Fclose(c.other);
}

/* ---- bit for bit ------------------------------------------------------------------------------
 */

static void expect_history(const box *b, const variant *v)
{
    const dem_report r = dem_last_report(b->sim);
    if (r.contacts < 50 || r.wall_contacts < 10 || r.rebuilds < 20 || r.particles < 100)
        fail_msg("%s: %d contacts, %d with walls, %d lists", v->name, (int)r.contacts,
                 (int)r.wall_contacts, (int)r.rebuilds);
}

/* Straight runs, each on another number of ranks: restart files at the start, where there is no
 * list, and on the way, "<ranks>.at" and "<ranks>.start", and one at the end. */
static void run_straight(const variant *v, int n)
{
    char name[32];
    box b;
    box_new(&b, v, team[n], NULL);
    snprintf(name, sizeof name, "%d.start", n);
    write_restart(&b, name);
    box_advance(&b, 0, STOP);
    snprintf(name, sizeof name, "%d.at", n);
    write_restart(&b, name);
    write_restart(&b, "twice"); /* writing changes nothing */
    expect_same_contents(name, "twice", 0);
    box_advance(&b, STOP, END);
    expect_history(&b, v);
    snprintf(name, sizeof name, "%d.end", n);
    write_restart(&b, name);
    box_free(&b, 1);
}

static void go_on(const variant *v, const char *from, int at, int n)
{
    char path[512];
    box b;
    box_new(&b, v, team[n], path_of(from, path));
    write_restart(&b, "again"); /* nor does reading */
    expect_same_contents(from, "again", 0);
    box_advance(&b, at, END);
    write_restart(&b, "again");
    expect_same_contents("1.end", "again", 1);
    box_free(&b, 1);
}

static void test_bit_for_bit(void **state)
{
    (void)state;
    char name[32];
    for (const variant *v = VARIANT; v < VARIANT + VARIANTS; v++) {
        for (int n = 1; n <= ranks; n++) {
            if (team[n] != MPI_COMM_NULL) run_straight(v, n);
            MPI_Barrier(MPI_COMM_WORLD);
            static const char *const when[] = {"start", "at", "end"};
            for (int k = 0; k < 3; k++) {
                char one[32];
                snprintf(one, sizeof one, "1.%s", when[k]);
                snprintf(name, sizeof name, "%d.%s", n, when[k]);
                expect_same_contents(one, name, 1);
            }
        }
        for (int n = 1; n <= ranks; n++)
            for (int from = 1; from <= ranks; from++) {
                if (team[n] != MPI_COMM_NULL) {
                    snprintf(name, sizeof name, "%d.at", from);
                    go_on(v, name, STOP, n);
                    snprintf(name, sizeof name, "%d.start", from);
                    if (from + n == 1 + ranks) go_on(v, name, 0, n);
                }
                MPI_Barrier(MPI_COMM_WORLD);
            }
    }
}

/* ---- failures ---------------------------------------------------------------------------------
 */

static void expect_same_message(const char *message, const char *reason)
{
    char first[512];
    snprintf(first, sizeof first, "%s", message);
    MPI_Bcast(first, sizeof first, MPI_CHAR, 0, MPI_COMM_WORLD);
    assert_string_equal(message, first);
    if (!strstr(message, reason)) fail_msg("'%s' expected: %s", reason, message);
}

static void expect_refused(const char *name, const char *reason)
{
    char path[512];
    box b;
    box_init(&b, &VARIANT[0], MPI_COMM_WORLD, path_of(name, path));
    assert_int_equal(dem_new(MPI_COMM_WORLD, &b.param, &b.sim), DEM_IO);
    expect_same_message(dem_message(b.sim), reason);
    assert_non_null(strstr(dem_message(b.sim), path));
    box_free(&b, 0);
    MPI_Barrier(MPI_COMM_WORLD);
}

static char *read_whole(const char *name, size_t *size)
{
    char path[512];
    FILE *file = fopen(path_of(name, path), "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    char *bytes = malloc(*size + 1);
    rewind(file);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

/* By the first rank. */
static void write_bad(const char *bytes, size_t size)
{
    char path[512];
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == 0) {
        FILE *file = fopen(path_of("bad", path), "wb");
        assert_non_null(file);
        assert_int_equal(fwrite(bytes, 1, size, file), size);
        assert_int_equal(fclose(file), 0);
    }
    MPI_Barrier(MPI_COMM_WORLD);
}

static void test_bad_files(void **state)
{
    (void)state;
    size_t size;
    box b;
    box_new(&b, &VARIANT[0], MPI_COMM_WORLD, NULL);
    box_advance(&b, 0, STOP);
    write_restart(&b, "good");
    box_free(&b, 1);
    expect_refused("none", "No such file");
    char *bytes = read_whole("good", &size);
    for (int k = 1; k < 40; k++) { /* in the part of every rank */
        const size_t at = size * (size_t)k / 40;
        bytes[at] ^= 16;
        write_bad(bytes, size);
        expect_refused("bad", "damaged");
        bytes[at] ^= 16;
    }
    write_bad(bytes, size - 1);
    expect_refused("bad", "truncated");
    write_bad(bytes + 512, size - 512);
    expect_refused("bad", "not a restart file");
    write_bad(bytes, size);
    box_init(&b, &VARIANT[0], MPI_COMM_WORLD, NULL);
    char path[512];
    b.param.restart = path_of("bad", path);
    strcpy(b.material[0].name, "gravel");
    assert_int_equal(dem_new(MPI_COMM_WORLD, &b.param, &b.sim), DEM_IO);
    expect_same_message(dem_message(b.sim), "is none of this simulation's");
    box_free(&b, 0);
    free(bytes);
}

static int files(void)
{
    int n = 0;
    DIR *d = opendir(directory);
    assert_non_null(d);
    for (struct dirent *e; (e = readdir(d)) != NULL;) n += strcmp(e->d_name, ".") != 0;
    closedir(d);
    return n;
}

/* A limit on the size of files acts like a full disk: from no room at all to a byte too little. */
static void test_full_disk(void **state)
{
    (void)state;
    size_t size, same;
    box b;
    box_new(&b, &VARIANT[1], MPI_COMM_WORLD, NULL);
    box_advance(&b, 0, 6);
    write_restart(&b, "6");
    MPI_Barrier(MPI_COMM_WORLD);
    char *before = read_whole("6", &size);
    const int had = files();
    struct rlimit old, small;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    for (int k = 0; k <= 5; k++) {
        small = old;
        small.rlim_cur = k == 0 ? 100 : k == 5 ? size - 1 : size * (size_t)k / 5;
        MPI_Barrier(MPI_COMM_WORLD);
        setrlimit(RLIMIT_FSIZE, &small);
        const dem_status status = dem_write_restart(b.sim, directory, "6", 1);
        setrlimit(RLIMIT_FSIZE, &old);
        assert_int_equal(status, DEM_IO);
        expect_same_message(dem_message(b.sim), "write: File too large");
        assert_int_equal(files(), had);
        char *after = read_whole("6", &same);
        assert_int_equal(same, size);
        assert_memory_equal(before, after, size);
        free(after);
    }
    /* One rank alone cannot write its part. */
    small.rlim_cur = size / 4;
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == ranks - 1) setrlimit(RLIMIT_FSIZE, &small);
    assert_int_equal(dem_write_restart(b.sim, directory, "6", 1), DEM_IO);
    setrlimit(RLIMIT_FSIZE, &old);
    expect_same_message(dem_message(b.sim), ranks > 1 ? "write failed" : "write: File too large");
    assert_int_equal(files(), had);
    MPI_Barrier(MPI_COMM_WORLD);
    write_restart(&b, "6"); /* and it recovers */
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == 0) expect_same_contents("6", "6", 0);
    box_free(&b, 1);
    free(before);
}

static void test_no_particles(void **state)
{
    (void)state;
    char path[512];
    box b, again;
    box_init(&b, &VARIANT[1], MPI_COMM_WORLD, NULL);
    b.param.n_insertion = 0;
    dem_sdf_free(b.insertion.region);
    b.feeder.begin = .02;
    if (dem_new(MPI_COMM_WORLD, &b.param, &b.sim)) fail_msg("%s", dem_message(b.sim));
    write_restart(&b, "empty");
    box_init(&again, &VARIANT[1], MPI_COMM_WORLD, path_of("empty", path));
    again.feeder.begin = .02;
    if (dem_new(MPI_COMM_WORLD, &again.param, &again.sim)) fail_msg("%s", dem_message(again.sim));
    assert_true(dem_last_report(again.sim).particles == 0);
    if (dem_advance(again.sim, .05, 0)) fail_msg("%s", dem_message(again.sim));
    assert_true(dem_last_report(again.sim).particles > 10);
    dem_free(b.sim);
    dem_free(again.sim);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bit_for_bit), cmocka_unit_test(test_bad_files),
        cmocka_unit_test(test_full_disk), cmocka_unit_test(test_no_particles)};
    char clean[300];
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    assert_true(ranks <= MOST);
    for (int n = 1; n <= ranks; n++)
        MPI_Comm_split(MPI_COMM_WORLD, rank < n ? 0 : MPI_UNDEFINED, rank, &team[n]);
    snprintf(directory, sizeof directory, "/tmp/felmiRestartRanks.XXXXXX");
    if (rank == 0) assert_non_null(mkdtemp(directory));
    MPI_Bcast(directory, sizeof directory, MPI_CHAR, 0, MPI_COMM_WORLD);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Barrier(MPI_COMM_WORLD);
    snprintf(clean, sizeof clean, "rm -r '%s'", directory);
    if (rank == 0) assert_int_equal(system(clean), 0);
    for (int n = 1; n <= ranks; n++)
        if (team[n] != MPI_COMM_NULL) MPI_Comm_free(&team[n]);
    MPI_Finalize();
    return failed;
}
