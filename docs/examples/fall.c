/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * fall.c - the particle engine and a drag law in a program of your own: a sphere falls for a tenth
 * of a second. Fails unless it fell g t^2/2 and the law gives Stokes' drag.
 */
#include <cpl.h>
#include <dem.h>
#include <math.h>
#include <stdio.h>

static const double g = 9.81, duration = .1;

/* A sphere in a box of 4 m, let go at z = .3 m; *fallen: how far it came. */
static dem_status fall(double *fallen)
{
    const dem_material glass = {.name = "glass", .density = 2385};
    const dem_pair pair = {
        .restitution = .9, .friction = .3, .stiffness = 731, .stiffness_ratio = 1};
    dem_param param = dem_param_default();
    for (int a = 0; a < 3; a++) {
        param.lo[a] = -2;
        param.hi[a] = 2;
    }
    param.gravity[2] = -g;
    param.n_material = 1;
    param.material = &glass;
    param.pair = &pair;

    const double x[1][3] = {{.1, .2, .3}}, radius = .0113;
    const int material = 0;
    dem_sim *sim = NULL;
    dem_status status = dem_new(MPI_COMM_WORLD, &param, &sim);
    if (status == DEM_OK) status = dem_add(sim, 1, x, NULL, NULL, &radius, &material, NULL);
    if (status == DEM_OK) status = dem_advance(sim, duration, 1000); /* 1000 sub-steps */
    if (status == DEM_OK) *fallen = x[0][2] - dem_particles(sim).x[0][2];
    if (status != DEM_OK) fprintf(stderr, "%s\n", dem_message(sim));
    dem_free(sim);
    return status;
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    double fallen = 0;
    const dem_status status = fall(&fallen);
    MPI_Finalize();

    const double d = 1e-3, slip = 0, eps = 1, rho = 1.2, mu = 1.8e-5;
    const double drag = cpl_drag(CPL_SCHILLER_NAUMANN, eps, slip, d, rho, mu);
    printf("fell %.6f m, Stokes drag %.6e kg/s\n", fallen, drag);
    const int as_expected = fabs(fallen / (.5 * g * duration * duration) - 1) < 2e-3 &&
                            fabs(drag / (3 * acos(-1) * mu * d) - 1) < 1e-12;
    return !(status == DEM_OK && as_expected);
}
