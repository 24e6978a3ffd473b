/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demScale.c - cost and memory of the particle engine by number, law, sizes and walls.
 *
 *     demScale settle <kind> <bed>     let a bed settle and keep its spheres in <bed>
 *     demScale cost <bed> <law> <wall> <tiles> <steps>
 *
 * Kinds: small (1e4 equal spheres), equal (1e5), sizes (5e4, diameters 1:4 in equal numbers),
 * boxed (1e5 equal ones between walls). Laws: linear, hertz. Walls: floor (periodic in x and y),
 * planes, box (an analytic shape), stl (the box as triangles, sampled). A bed on a floor is
 * periodic, so that tiles^2 copies of it beside each other are a settled bed again, as high as it
 * was and tiles times as wide.
 *
 * Prints, per particle and step, processor time and its parts by the engine's own clocks, memory,
 * and the floor: the time for streaming through as many bytes as a step must read and write, in the
 * same process.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dem.h"

static const double diameter = 1e-3, density = 2500, stiffness = 1000;

/* What a file holds: this, and n spheres x y z r. */
typedef struct bed {
    double width[2], height; /* m */
    int64_t n;
    double (*sphere)[4];
} bed;

static void stop(const char *what)
{
    fprintf(stderr, "demScale: %s\n", what);
    exit(1);
}

static void *room(size_t bytes)
{
    void *data = malloc(bytes);
    if (!data) stop("out of memory");
    return data;
}

/* ---- the simulation -------------------------------------------------------------------------- */

static const double corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                    {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};

/* The box as an STL file, normals outward. */
static void write_stl(const char *path, const double size[3])
{
    static const int face[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                    {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                    {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    FILE *f = fopen(path, "w");
    if (!f) stop("cannot write the STL file");
    fprintf(f, "solid box\n");
    for (int t = 0; t < 12; t++) {
        fprintf(f, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3; k++) {
            const double *c = corner[face[t][k]];
            fprintf(f, "vertex %.17g %.17g %.17g\n", c[0] * size[0], c[1] * size[1],
                    c[2] * size[2]);
        }
        fprintf(f, "endloop\nendfacet\n");
    }
    fprintf(f, "endsolid box\n");
    if (fclose(f)) stop("cannot write the STL file");
}

static int add_planes(dem_wall *wall, const double size[3])
{
    for (int k = 0; k < 5; k++) { /* floor and four sides */
        const int a = k ? (k - 1) / 2 : 2, up = k == 0 || k % 2;
        double point[3] = {0, 0, 0}, normal[3] = {0, 0, 0};
        if (!up) point[a] = size[a];
        normal[a] = up ? 1 : -1;
        snprintf(wall[k].name, DEM_NAME, "plane%d", k);
        wall[k].shape = dem_sdf_plane(point, normal);
    }
    return 5;
}

static int make_walls(dem_wall *wall, const char *kind, const double size[3])
{
    const double zero[3] = {0, 0, 0};
    memset(wall, 0, 5 * sizeof *wall);
    snprintf(wall->name, DEM_NAME, "%s", kind);
    if (!strcmp(kind, "planes")) return add_planes(wall, size);
    if (!strcmp(kind, "floor")) {
        wall->shape = dem_sdf_plane(zero, (const double[3]){0, 0, 1});
    } else if (!strcmp(kind, "box")) {
        wall->shape = dem_sdf_box(zero, size, 1);
    } else if (!strcmp(kind, "stl")) {
        char message[256];
        dem_stl stl = dem_stl_default();
        stl.path = "box.stl";
        stl.inside = 1;
        write_stl(stl.path, size);
        wall->shape = dem_sdf_stl(&stl, message, sizeof message);
        if (!wall->shape) stop(message);
    } else {
        stop("walls are floor, planes, box or stl");
    }
    return 1;
}

static dem_sim *make(const char *wall_kind, const char *law, const double size[3], double weight,
                     const dem_insertion *insertion)
{
    dem_param p = dem_param_default();
    /* Two of the same: a loop that looks them up does not know. */
    const dem_material glass = {
        .name = "glass", .density = density, .youngs_modulus = 1e8, .poisson_ratio = .3};
    const dem_pair alike = {
        .restitution = .3, .friction = .5, .stiffness = stiffness, .stiffness_ratio = 1};
    const dem_material material[2] = {glass, glass};
    const dem_pair pair[4] = {alike, alike, alike, alike};
    dem_wall wall[5];
    p.n_wall = (size_t)make_walls(wall, wall_kind, size);
    for (int a = 0; a < 3; a++) {
        p.periodic[a] = a < 2 && !strcmp(wall_kind, "floor");
        p.lo[a] = p.periodic[a] ? 0 : -4 * diameter;
        p.hi[a] = p.periodic[a] ? size[a] : size[a] + 4 * diameter;
    }
    p.gravity[2] = -9.81 * weight;
    p.law = !strcmp(law, "hertz") ? DEM_HERTZ : DEM_LINEAR;
    p.n_material = 2;
    p.material = material;
    p.pair = pair;
    p.wall = wall;
    p.insertion = insertion;
    p.n_insertion = insertion != NULL;
    dem_sim *sim;
    if (dem_new(MPI_COMM_SELF, &p, &sim)) stop(dem_message(sim));
    return sim;
}

/* ---- beds ------------------------------------------------------------------------------------ */

static void write_bed(const char *path, const double size[3], const dem_sim *sim)
{
    const dem_view all = dem_particles(sim), *view = &all;
    const bed b = {{size[0], size[1]}, size[2], (int64_t)view->n, NULL};
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(&b, sizeof b, 1, f) != 1) stop("cannot write the bed");
    for (size_t i = 0; i < view->n; i++) {
        const double s[4] = {view->x[i][0], view->x[i][1], view->x[i][2], view->radius[i]};
        if (fwrite(s, sizeof s, 1, f) != 1) stop("cannot write the bed");
    }
    if (fclose(f)) stop("cannot write the bed");
}

static bed read_bed(const char *path)
{
    bed b;
    FILE *f = fopen(path, "rb");
    if (!f || fread(&b, sizeof b, 1, f) != 1) stop("cannot read the bed");
    b.sphere = room((size_t)b.n * sizeof *b.sphere);
    if (fread(b.sphere, sizeof *b.sphere, (size_t)b.n, f) != (size_t)b.n) stop("the bed is short");
    fclose(f);
    return b;
}

/* Of tiles^2 copies of the bed, particles of so many materials. */
static void add_tiles(dem_sim *sim, const bed *b, int tiles, int materials)
{
    const size_t n = (size_t)(b->n * tiles * tiles);
    double(*x)[3] = room(n * sizeof *x), *radius = room(n * sizeof *radius);
    int *material = calloc(n, sizeof *material);
    if (!material) stop("out of memory");
    for (size_t k = 0; k < n; k++) {
        const double *s = b->sphere[k % (size_t)b->n];
        const size_t tile = k / (size_t)b->n;
        x[k][0] = s[0] + (double)(tile % (size_t)tiles) * b->width[0];
        x[k][1] = s[1] + (double)(tile / (size_t)tiles) * b->width[1];
        x[k][2] = s[2];
        radius[k] = s[3];
        material[k] = (int)k % materials;
    }
    if (dem_add(sim, n, (const double(*)[3])x, NULL, NULL, radius, material, NULL))
        stop(dem_message(sim));
    free(x);
    free(radius);
    free(material);
}

static void run_for(dem_sim *sim, int steps)
{
    for (int s = 0; s < steps; s += 200) {
        const double step = dem_time_limits(sim).step;
        if (dem_advance(sim, 200 * step, 200)) stop(dem_message(sim));
        const dem_report r = dem_last_report(sim);
        if (s + 200 >= steps)
            fprintf(stderr, "t %.4f s, %.2f contacts each, largest speed %.3g m/s\n", dem_time(sim),
                    2. * (double)r.contacts / (double)r.particles, r.speed);
    }
}

/* First under many times their weight, which is soon done, at last under their own. */
static void settle(const char *kind, const char *path)
{
    const int sizes = !strcmp(kind, "sizes"), boxed = !strcmp(kind, "boxed");
    const int64_t n = !strcmp(kind, "small") ? 10000 : sizes ? 50000 : 100000;
    const double d = diameter;
    /* Mean volume over d^3 of diameters 1:4 in equal numbers: (4^4 - 1)/(4 x 3). */
    const double bulk = (double)n * d * d * d * M_PI / 6 * (sizes ? 21.25 : 1) / .45;
    const double side = d * (sizes ? 160 : n < 100000 ? 13 * 1.04 : 40 * 1.04);
    const double size[3] = {side, side, 1.1 * bulk / (side * side)};
    const double lo[3] = {0, 0, 0}, hi[3] = {side, side, bulk / (side * side)};
    dem_species mixture = {.size = {.kind = DEM_SIZE_UNIFORM, .lo = d, .hi = 4 * d}, .share = 1};
    dem_insertion fill = {.name = "fill",
                          .kind = DEM_INSERT_RANDOM,
                          .region = dem_sdf_box(lo, hi, 1),
                          .number = n,
                          .diameter = d,
                          .species = &mixture,
                          .n_species = (size_t)sizes,
                          .seed = 7};
    memcpy(fill.lo, lo, sizeof lo);
    memcpy(fill.hi, hi, sizeof hi);
    /* What the spheres spring back with when the weight is taken off is stopped by beginning anew
     * from rest. */
    enum { STAGES = 24 };
    const double first = sizes ? 8 : 20;
    for (int k = 0; k < STAGES; k++) {
        const double weight = k ? fmax(1, first / pow(2, k)) : first;
        const int steps = k == 0 ? 6000 : k < STAGES - 1 ? 200 : 3000;
        dem_sim *sim = make(boxed ? "planes" : "floor", "linear", size, weight, k ? NULL : &fill);
        const bed b = k ? read_bed(path) : (bed){.n = 0};
        if (k) add_tiles(sim, &b, 1, 1);
        run_for(sim, steps);
        write_bed(path, size, sim);
        dem_free(sim);
        free(b.sphere);
    }
}

/* ---- cost ------------------------------------------------------------------------------------ */

/* Bytes of the process in memory, the most so far. */
static double peak(void)
{
    char line[256];
    double kib = 0;
    FILE *f = fopen("/proc/self/status", "r");
    while (f && fgets(line, sizeof line, f))
        if (!strncmp(line, "VmHWM:", 6)) kib = atof(line + 6);
    if (f) fclose(f);
    return 1024 * kib;
}

static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds for streaming once through n times the bytes that a step reads and writes of a particle:
 * position, velocity and force are changed, springs read and written, list and flags read. */
static double stream(size_t n, double contacts)
{
    const size_t change = (size_t)((double)n * (20 + 4 * contacts)), look = 3 * n;
    double *a = room(change * sizeof *a), *b = room(look * sizeof *b), least = INFINITY, sum = 0;
    for (size_t k = 0; k < change; k++) a[k] = 1;
    for (size_t k = 0; k < look; k++) b[k] = 1;
    for (int pass = 0; pass < 5; pass++) {
        const double begin = processor();
        for (size_t k = 0; k < change; k++) a[k] += 1e-3;
        double part[8] = {0};
        for (size_t k = 0; k + 8 <= look; k += 8)
            for (int c = 0; c < 8; c++) part[c] += b[k + (size_t)c];
        least = fmin(least, processor() - begin);
        sum += part[0] + part[7] + a[pass];
    }
    if (!(sum > 0)) stop("lost count");
    free(a);
    free(b);
    return least;
}

static void cost(const char *path, const char *law, const char *wall, int tiles, int steps)
{
    bed b = read_bed(path);
    const double size[3] = {tiles * b.width[0], tiles * b.width[1], b.height};
    const double before = peak();
    dem_sim *sim = make(wall, law, size, 1, NULL);
    add_tiles(sim, &b, tiles, !strcmp(law, "two") ? 2 : 1);
    const double step = dem_time_limits(sim).step, n = (double)dem_particles(sim).n;
    if (dem_advance(sim, 40 * step, 40)) stop(dem_message(sim));
    double least = INFINITY, force = 0, neighbour = 0, other = 0;
    const int64_t built = dem_last_report(sim).rebuilds;
    for (int pass = 0; pass < 12; pass++) {
        const double begin = processor();
        if (dem_advance(sim, steps * step, steps)) stop(dem_message(sim));
        const double took = processor() - begin;
        if (took >= least) continue;
        const dem_report r = dem_last_report(sim);
        least = took;
        force = r.seconds_force;
        neighbour = r.seconds_neighbour;
        other = r.seconds_other;
    }
    const dem_report r = dem_last_report(sim);
    const double per = 1e9 / n / steps, contacts = (double)r.contacts / n;
    const double bytes = (peak() - before) / n;
    const dem_memory m = dem_memory_used(sim);
    dem_free(sim);
    printf("%8.0f %-6s %-6s %5.2f contacts %7.1f ns (force %.1f neighbour %.1f other %.1f; %d "
           "rebuilds) floor %.1f ns %5.0f bytes (particles %.0f list %.0f contacts %.0f walls %.0f "
           "shapes %.0f)\n",
           n, law, wall, 2 * contacts, least * per, force * per, neighbour * per, other * per,
           (int)(r.rebuilds - built), 1e9 / n * stream((size_t)n, contacts), bytes,
           (double)m.particles / n, (double)m.neighbours / n, (double)m.contacts / n,
           (double)m.walls / n, (double)m.shapes / n);
    free(b.sphere);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    if (argc == 4 && !strcmp(argv[1], "settle"))
        settle(argv[2], argv[3]);
    else if (argc == 7 && !strcmp(argv[1], "cost"))
        cost(argv[2], argv[3], argv[4], atoi(argv[5]), atoi(argv[6]));
    else
        stop("usage: demScale settle <kind> <bed> | cost <bed> linear|hertz|two <wall> <tiles> "
             "<steps>; two: linear, two materials");
    MPI_Finalize();
    return 0;
}
