/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demSpeed.c - cost of the particle engine on a settled bed, in ns per particle and step.
 *
 * 100 000 equal spheres, linear law with tangential history, periodic in x and y, on a floor.
 *
 *     demSpeed settle <bed>          let a bed settle and keep its positions in <bed>
 *     demSpeed run <bed> <steps>     time that many steps from there
 *     demSpeed lammps <bed> <data>   write it as a data file that LAMMPS and LIGGGHTS read
 *     demSpeed stiffness             print k, damping rate, friction, step, skin, box for the
 * scripts
 *
 * Processor time, so that other work on the machine disturbs little.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dem.h"

enum { ACROSS = 40, LAYERS = 63, NUMBER = 100000 };

static const double diameter = 1e-3, density = 2500, k = 1000, mu = .5, e = .3, skin = .15;

static double ball_mass(void)
{
    return M_PI / 6 * diameter * diameter * diameter * density;
}

static double step_length(void)
{
    return 2 * M_PI * sqrt(ball_mass() / k) / 20;
}

static void stop(const char *what)
{
    fprintf(stderr, "demSpeed: %s\n", what);
    exit(1);
}

static dem_sim *make_box(void)
{
    dem_param p = dem_param_default();
    dem_material glass = {.name = "glass", .density = density};
    dem_pair pair = {.restitution = e, .friction = mu, .stiffness = k, .stiffness_ratio = 1};
    dem_wall floor = {.name = "floor",
                      .shape =
                          dem_sdf_plane((const double[3]){0, 0, 0}, (const double[3]){0, 0, 1})};
    for (int a = 0; a < 2; a++) {
        p.hi[a] = ACROSS * diameter * 1.04;
        p.periodic[a] = 1;
    }
    p.lo[2] = -diameter;
    p.hi[2] = 4 * LAYERS * diameter;
    p.gravity[2] = -9.81;
    p.n_material = p.n_wall = 1;
    p.material = &glass;
    p.pair = &pair;
    p.wall = &floor;
    p.skin = skin;
    dem_sim *sim;
    if (dem_new(MPI_COMM_SELF, &p, &sim)) stop(dem_message(sim));
    return sim;
}

static void add_balls(dem_sim *sim, const double (*x)[3], const double (*v)[3])
{
    double *radius = malloc(NUMBER * sizeof *radius);
    int *material = calloc(NUMBER, sizeof *material);
    if (!radius || !material) stop("out of memory");
    for (int i = 0; i < NUMBER; i++) radius[i] = .5 * diameter;
    if (dem_add(sim, NUMBER, x, v, NULL, radius, material, NULL)) stop(dem_message(sim));
    free(radius);
    free(material);
}

static void settle(const char *path)
{
    double(*x)[3] = malloc(NUMBER * sizeof *x), (*v)[3] = malloc(NUMBER * sizeof *v);
    if (!x || !v) stop("out of memory");
    uint64_t random = 2385;
    for (int i = 0; i < NUMBER; i++) {
        int at[3] = {i % ACROSS, i / ACROSS % ACROSS, i / ACROSS / ACROSS};
        for (int a = 0; a < 3; a++) {
            /* xorshift64: any scatter will do that breaks the lattice up */
            random ^= random << 13, random ^= random >> 7, random ^= random << 17;
            x[i][a] = diameter * 1.04 * (at[a] + .5);
            v[i][a] = .2 * ((double)(random >> 11) / 9007199254740992. - .5);
        }
    }
    dem_sim *sim = make_box();
    add_balls(sim, (const double(*)[3])x, (const double(*)[3])v);
    for (int s = 0; s < 60; s++) {
        if (dem_advance(sim, 200 * step_length(), 200)) stop(dem_message(sim));
        dem_report r = dem_last_report(sim);
        if (s % 10 == 9)
            fprintf(stderr, "t %.4f s, %.2f contacts each, largest speed %.3g m/s\n", dem_time(sim),
                    2. * (double)r.contacts / NUMBER, r.speed);
    }
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(dem_particles(sim).x, sizeof *x, NUMBER, f) != NUMBER || fclose(f))
        stop("cannot write the bed");
    dem_free(sim);
    free(x);
    free(v);
}

static double (*read_bed(const char *path))[3]
{
    double(*x)[3] = malloc(NUMBER * sizeof *x);
    FILE *f = fopen(path, "rb");
    if (!x || !f || fread(x, sizeof *x, NUMBER, f) != NUMBER) stop("cannot read the bed");
    fclose(f);
    return x;
}

static void run(const char *path, int steps)
{
    double(*x)[3] = read_bed(path);
    dem_sim *sim = make_box();
    add_balls(sim, (const double(*)[3])x, NULL);
    if (dem_advance(sim, 50 * step_length(), 50)) stop(dem_message(sim));
    clock_t begin = clock();
    int64_t built = dem_last_report(sim).rebuilds;
    if (dem_advance(sim, steps * step_length(), steps)) stop(dem_message(sim));
    double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    dem_report r = dem_last_report(sim);
    double per = 1e9 / NUMBER / steps;
    fprintf(stderr,
            "%.2f contacts each, %lld rebuilds; wall clock: force %.1f, neighbour %.1f, other "
            "%.1f ns\n",
            2. * (double)r.contacts / NUMBER, (long long)(r.rebuilds - built),
            r.seconds_force * per, r.seconds_neighbour * per, r.seconds_other * per);
    printf("%.1f\n", seconds * per);
    dem_free(sim);
    free(x);
}

static void write_lammps(const char *bed, const char *path)
{
    double(*x)[3] = read_bed(bed);
    FILE *f = fopen(path, "w");
    if (!f) stop("cannot write the data file");
    double side = ACROSS * diameter * 1.04;
    fprintf(f, "settled bed\n\n%d atoms\n1 atom types\n\n0 %.17g xlo xhi\n0 %.17g ylo yhi\n",
            NUMBER, side, side);
    fprintf(f, "%.17g %.17g zlo zhi\n\nAtoms\n\n", -diameter, 4 * LAYERS * diameter);
    for (int i = 0; i < NUMBER; i++)
        fprintf(f, "%d 1 %.17g %.17g %.17g %.17g %.17g\n", i + 1, diameter, density, x[i][0],
                x[i][1], x[i][2]);
    if (fclose(f)) stop("cannot write the data file");
    free(x);
}

static void print_constants(void)
{
    double l = -log(e), m_eff = .5 * ball_mass();
    double rate = 2 * l / sqrt(M_PI * M_PI + l * l) * sqrt(k / m_eff);
    printf("%g %.10g %g %.10g %g %.10g\n", k, rate, mu, step_length(), skin * diameter, diameter);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    if (argc == 3 && !strcmp(argv[1], "settle"))
        settle(argv[2]);
    else if (argc == 4 && !strcmp(argv[1], "run"))
        run(argv[2], atoi(argv[3]));
    else if (argc == 4 && !strcmp(argv[1], "lammps"))
        write_lammps(argv[2], argv[3]);
    else if (argc == 2 && !strcmp(argv[1], "stiffness"))
        print_constants();
    else
        stop("usage: demSpeed settle <bed> | run <bed> <steps> | lammps <bed> <data> | stiffness");
    MPI_Finalize();
    return 0;
}
