/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart.c - whatever a restart file holds, a simulation goes on from it or says why it cannot.
 *
 * The first byte of the input tells what the rest is:
 *
 *     0, 1   changes to a good file (h5Edit.h), with or without a neighbour list, then signed
 *     2      a whole file, its head and what follows, as it is
 *     3      a head, signed as it is, before the HDF5 part of a good file
 *
 * What is accepted can be advanced, written and read again: a reader that lets nonsense through
 * would be found here by the next one.
 */
#include "crc64.h"
#include "dem.h"
#include "fuzzFile.h"
#include "h5Edit.h"

#include <inttypes.h>
#include <math.h>
#include <sanitizer/lsan_interface.h>

enum { HEAD = 512, GRAINS = 14 };

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

/* ---- a small simulation in which everything occurs ------------------------------------------- */

typedef struct vessel {
    dem_param param;
    dem_material material[2];
    dem_pair pair[4];
    dem_wall wall[2];
    dem_motion motion;
    dem_species species;
    dem_feeder feeder;
    dem_outlet outlet;
    dem_sim *sim;
} vessel;

static const double LO[3] = {-.0035, -.0035, 0}, HI[3] = {.0035, .0035, .03};

static void fill_materials(vessel *b)
{
    strcpy(b->material[0].name, "grain");
    strcpy(b->material[1].name, "heavy");
    for (int k = 0; k < 2; k++) b->material[k].density = 1000 + 1500 * k;
    for (int k = 0; k < 4; k++)
        b->pair[k] = (dem_pair){.restitution = .6,
                                .friction = .4,
                                .stiffness = 150,
                                .stiffness_ratio = .8,
                                .rolling_friction = .1};
    b->param.n_material = 2;
    b->param.material = b->material;
    b->param.pair = b->pair;
}

static void fill_walls(vessel *b)
{
    b->motion = dem_motion_default();
    b->motion.kind = DEM_OSCILLATION;
    b->motion.vector[2] = .0005;
    b->motion.frequency = 20;
    strcpy(b->wall[0].name, "vessel");
    b->wall[0].shape = dem_sdf_box(LO, HI, 1);
    strcpy(b->wall[1].name, "ram");
    b->wall[1].shape = dem_sdf_sphere((const double[3]){0, 0, -.001}, .002, 0);
    b->wall[1].n_motion = 1;
    b->wall[1].motion = &b->motion;
    b->param.n_wall = 2;
    b->param.wall = b->wall;
}

static void fill_flow(vessel *b)
{
    static const double low[3] = {-.003, -.003, .014}, high[3] = {.003, .003, .029};
    b->species.size = (dem_size){.kind = DEM_SIZE_UNIFORM, .lo = .002, .hi = .003};
    b->species.share = 1;
    strcpy(b->feeder.name, "spout");
    b->feeder.region = dem_sdf_box(low, high, 1);
    memcpy(b->feeder.lo, low, sizeof low);
    memcpy(b->feeder.hi, high, sizeof high);
    b->feeder.n_species = 1;
    b->feeder.species = &b->species;
    b->feeder.number_rate = 400;
    b->feeder.end = 1;
    b->feeder.mass = INFINITY;
    b->feeder.number = GRAINS;
    b->param.n_feeder = 1;
    b->param.feeder = &b->feeder;
    strcpy(b->outlet.name, "drain");
    b->outlet.region = dem_sdf_sphere((const double[3]){.0035, .0035, 0}, .001, 1);
    b->outlet.end = 1;
    b->param.n_outlet = 1;
    b->param.outlet = &b->outlet;
}

/* DEM_OK, or the reason is there. */
static dem_status begin(vessel *b, const char *restart)
{
    memset(b, 0, sizeof *b);
    b->param = dem_param_default();
    b->param.restart = restart;
    memcpy(b->param.lo, LO, sizeof LO);
    memcpy(b->param.hi, HI, sizeof HI);
    b->param.gravity[2] = -9.81;
    b->param.rolling = DEM_ROLLING_EPSD;
    b->param.balance = 1;
    fill_materials(b);
    fill_walls(b);
    fill_flow(b);
    const dem_status status = dem_new(MPI_COMM_SELF, &b->param, &b->sim);
    REQUIRE(status == DEM_OK || (b->sim && dem_message(b->sim)[0]));
    return status;
}

static void end(vessel *b, dem_status status)
{
    dem_free(b->sim);
    if (status == DEM_OK) return; /* the shapes were the simulation's */
    dem_sdf_free(b->wall[0].shape);
    dem_sdf_free(b->wall[1].shape);
    dem_sdf_free(b->feeder.region);
    dem_sdf_free(b->outlet.region);
}

/* ---- good files ------------------------------------------------------------------------------ */

static h5good good[2]; /* with a list, and without one */

static void make_good(void)
{
    static const double force[GRAINS + 1][3], drag[GRAINS + 1];
    static const double place[1][3] = {{0, 0, .025}}, radius = .001, kept[3] = {1, 2, 3};
    static const int material = 1;
    vessel v;
    REQUIRE(begin(&v, NULL) == DEM_OK);
    REQUIRE(dem_attach(v.sim, "carried", 3) == 0);
    REQUIRE(dem_keep(v.sim, "mine", 3, kept) == DEM_OK);
    REQUIRE(dem_advance(v.sim, .15, 0) == DEM_OK);
    REQUIRE(dem_set_outside_force(v.sim, force, drag, force, NULL) == DEM_OK);
    REQUIRE(dem_advance(v.sim, 1e-4, 0) == DEM_OK);
    const dem_report report = dem_last_report(v.sim);
    REQUIRE(report.contacts > 5 && report.wall_contacts > 3 && report.particles <= GRAINS);
    for (int k = 0; k < 2; k++) {
        size_t size;
        if (k == 1)
            REQUIRE(dem_add(v.sim, 1, place, NULL, NULL, &radius, &material, NULL) == DEM_OK);
        REQUIRE(dem_write_restart(v.sim, fuzz_directory(), "good", 0) == DEM_OK);
        unsigned char *image = fuzz_read(fuzz_path("good.h5"), &size);
        h5good_set(&good[k], image, size);
    }
    end(&v, DEM_OK);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    setenv("OMPI_MCA_opal_signal", "", 1); /* libFuzzer reports what fails */
    __lsan_disable(); /* what Open MPI and HDF5 keep for the life of the process is not ours */
    MPI_Init(argc, argv);
    make_good();
    __lsan_enable();
    return 0;
}

/* ---- files from the input -------------------------------------------------------------------- */

/* Length and checksum into the head, whose lines before them are left as they are. */
static void sign(unsigned char *image, size_t size)
{
    char lines[HEAD + 1], last[40];
    crc64 c;
    memcpy(lines, image, HEAD);
    lines[HEAD] = '\0';
    char *length = strstr(lines, "length ");
    size_t n = length ? (size_t)(length - lines) : strlen(lines);
    if (n > HEAD - 64) n = HEAD - 64;
    n += (size_t)snprintf(lines + n, sizeof lines - n, "length %zu\n", size);
    crc64_begin(&c);
    crc64_add(&c, lines, n);
    crc64_add(&c, image + HEAD, size - HEAD);
    const int m = snprintf(last, sizeof last, "checksum %016" PRIx64 "\n", crc64_end(&c));
    memset(image, ' ', HEAD);
    memcpy(image, lines, n);
    memcpy(image + n, last, (size_t)m);
    image[HEAD - 1] = '\n';
}

/* Whether there is a file of that input. */
static int make_file(const char *path, const uint8_t *data, size_t n)
{
    const int kind = data[0] % 4;
    if (kind == 2) {
        fuzz_write(path, data + 1, n - 1);
        return 1;
    }
    const hid_t file = h5good_open(&good[kind % 2]);
    size_t size;
    if (kind < 2) h5_edit(file, &good[kind], data + 1, n - 1);
    unsigned char *image = h5_image(file, &size);
    if (image) {
        if (kind == 3) memcpy(image, data + 1, n - 1 < HEAD ? n - 1 : HEAD);
        sign(image, size);
        fuzz_write(path, image, size);
    }
    H5Fclose(file);
    return image != NULL;
}

/* A state that was accepted, and that some steps did not find bad, is a state like any other. */
static void go_on(vessel *v)
{
    vessel again;
    const char *path = fuzz_path("again.h5");
    double carried[3];
    dem_kept(v->sim, "mine", 3, carried);
    dem_attach(v->sim, "carried", 3);
    if (dem_advance(v->sim, 3e-5, 3) != DEM_OK) {
        REQUIRE(dem_message(v->sim)[0]);
        return;
    }
    const dem_view view = dem_particles(v->sim);
    REQUIRE((int64_t)view.n == dem_last_report(v->sim).particles);
    if (dem_write_restart(v->sim, fuzz_directory(), "again", 0) != DEM_OK) {
        REQUIRE(dem_message(v->sim)[0]);
        return;
    }
    const dem_status status = begin(&again, path);
    /* Numbers of absurd size may have overflown in the balance of energy. */
    if (status && !strstr(dem_message(again.sim), "is no such number")) {
        fprintf(stderr, "%s\n", dem_message(again.sim));
        abort();
    }
    REQUIRE(status || dem_particles(again.sim).n == view.n);
    end(&again, status);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    const char *path = fuzz_path("input.h5");
    vessel v;
    if (n == 0 || !make_file(path, data, n)) return 0;
    const dem_status status = begin(&v, path);
    REQUIRE(status != DEM_IO || strstr(dem_message(v.sim), path));
    if (status == DEM_OK) go_on(&v);
    end(&v, status);
    return 0;
}
