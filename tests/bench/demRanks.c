/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demRanks.c - time of the particle engine on several ranks, in ns per particle and step.
 *
 *     mpirun -np N demRanks <bed> <steps> rest     the settled bed of demSpeed
 *     mpirun -np N demRanks <bed> <steps> stir     the same, its particles at .3 m/s to and fro, so
 *                                                  that lists are rebuilt all the time
 *
 * Wall clock, for waiting counts. The digest of the final positions is the same on any number of
 * ranks.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dem.h"

enum { ACROSS = 40, LAYERS = 63, NUMBER = 100000, WARM = 50 };

static const double diameter = 1e-3, density = 2500, k = 1000, mu = .5, e = .3, skin = .15;

static void stop(const char *what)
{
    fprintf(stderr, "demRanks: %s\n", what);
    MPI_Abort(MPI_COMM_WORLD, 1);
}

static double step_length(void)
{
    return 2 * M_PI * sqrt(M_PI / 6 * diameter * diameter * diameter * density / k) / 20;
}

static dem_sim *make_box(void)
{
    dem_param p = dem_param_default();
    dem_material glass = {.name = "glass", .density = density};
    dem_pair pair = {.restitution = e, .friction = mu, .stiffness = k, .stiffness_ratio = 1};
    const double origin[3] = {0}, up[3] = {0, 0, 1};
    dem_wall floor = {.name = "floor", .shape = dem_sdf_plane(origin, up)};
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
    if (dem_new(MPI_COMM_WORLD, &p, &sim)) stop(dem_message(sim));
    return sim;
}

/* This rank's share of the bed. */
static void add_share(dem_sim *sim, const char *path, int stir)
{
    int rank, ranks;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const long begin = (long)NUMBER * rank / ranks, end = (long)NUMBER * (rank + 1) / ranks;
    const size_t n = (size_t)(end - begin);
    double(*x)[3] = malloc(n * sizeof *x), (*v)[3] = calloc(n, sizeof *v);
    double *radius = malloc(n * sizeof *radius);
    int *material = calloc(n, sizeof *material);
    FILE *f = fopen(path, "rb");
    if (!x || !v || !radius || !material || !f || fseek(f, begin * (long)sizeof *x, SEEK_SET) ||
        fread(x, sizeof *x, n, f) != n)
        stop("cannot read the bed");
    fclose(f);
    for (size_t i = 0; i < n; i++) {
        radius[i] = .5 * diameter;
        v[i][0] = stir ? .3 * sin(2e3 * x[i][2]) : 0;
    }
    if (dem_add(sim, n, (const double(*)[3])x, (const double(*)[3])v, NULL, radius, material, NULL))
        stop(dem_message(sim));
    free(x), free(v), free(radius), free(material);
}

/* Of ids and positions, whatever rank has them. */
static uint64_t digest(const dem_sim *sim)
{
    const dem_view p = dem_particles(sim);
    uint64_t sum = 0;
    for (size_t i = 0; i < p.n; i++) {
        uint64_t h = (uint64_t)p.id[i] * 0x9e3779b97f4a7c15u, bits;
        for (int a = 0; a < 3; a++) {
            memcpy(&bits, &p.x[i][a], sizeof bits);
            h = (h ^ bits ^ h >> 29) * 0xbf58476d1ce4e5b9u;
        }
        sum += h;
    }
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    return sum;
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    int rank, ranks;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (argc != 4) stop("usage: demRanks <bed> <steps> rest|stir");
    const int steps = atoi(argv[2]);
    dem_sim *sim = make_box();
    add_share(sim, argv[1], !strcmp(argv[3], "stir"));
    if (dem_advance(sim, WARM * step_length(), WARM)) stop(dem_message(sim));
    const int64_t built = dem_last_report(sim).rebuilds;
    const double begin = MPI_Wtime();
    if (dem_advance(sim, steps * step_length(), steps)) stop(dem_message(sim));
    const double per = 1e9 / NUMBER / steps, seconds = MPI_Wtime() - begin;
    const dem_report r = dem_last_report(sim);
    const uint64_t end = digest(sim);
    if (rank == 0)
        printf(
            "%d %s %.2f force %.1f lists %.1f exchange %.1f other %.1f rebuilds %lld ghosts %lld "
            "imbalance %.3f digest %016llx\n",
            ranks, argv[3], seconds * per, r.seconds_force * per, r.seconds_neighbour * per,
            r.seconds_exchange * per, r.seconds_other * per, (long long)(r.rebuilds - built),
            (long long)r.ghosts, r.imbalance, (unsigned long long)end);
    dem_free(sim);
    MPI_Finalize();
    return 0;
}
