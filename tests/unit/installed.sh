#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The installed libraries serve a stranger: a program that uses demC and couplingLib builds against
# an installed copy by pkg-config and by CMake, and a sphere falls g t^2/2 in it.
set -e
build=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" >/dev/null

cat >"$work/fall.c" <<'C'
#include <cpl.h>
#include <dem.h>
#include <math.h>
#include <stdio.h>

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    const dem_material glass = {.name = "glass", .density = 2385};
    const dem_pair pair = {.restitution = .9, .friction = .3, .stiffness = 731, .stiffness_ratio = 1};
    dem_param param = dem_param_default();
    for (int a = 0; a < 3; a++) {
        param.lo[a] = -2;
        param.hi[a] = 2;
    }
    param.gravity[2] = -9.81;
    param.n_material = 1;
    param.material = &glass;
    param.pair = &pair;
    dem_sim *sim;
    const double x[1][3] = {{.1, .2, .3}}, radius = .0113;
    const int material = 0;
    if (dem_new(MPI_COMM_WORLD, &param, &sim) != DEM_OK ||
        dem_add(sim, 1, x, NULL, NULL, &radius, &material, NULL) != DEM_OK ||
        dem_advance(sim, .1, 1000) != DEM_OK) {
        fprintf(stderr, "%s\n", dem_message(sim));
        return 1;
    }
    const double fallen = .3 - dem_particles(sim).x[0][2];
    dem_free(sim);
    MPI_Finalize();
    const double drag = cpl_drag(CPL_SCHILLER_NAUMANN, 1, 0, 1e-3, 1.2, 1.8e-5);
    printf("fell %.6f m, Stokes drag %.6e kg/s\n", fallen, drag);
    return !(fabs(fallen / (.5 * 9.81 * .01) - 1) < 2e-3 &&
             fabs(drag / (3 * acos(-1) * 1.8e-5 * 1e-3) - 1) < 1e-12);
}
C

export PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name demC.pc)")
libdir=$(dirname "$PKG_CONFIG_PATH")
# shellcheck disable=SC2046
cc -o "$work/fall" "$work/fall.c" $(pkg-config --cflags --libs demC couplingLib) -lm
LD_LIBRARY_PATH=$libdir "$work/fall"

cat >"$work/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.18)
project(fall LANGUAGES C)
find_package(felmi REQUIRED)
add_executable(fall fall.c)
target_link_libraries(fall PRIVATE felmi::demC felmi::couplingLib m)
CMAKE
cmake -S "$work" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
cmake --build "$work/build" >/dev/null
"$work/build/fall"
