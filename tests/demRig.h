/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * demRig.h - small experiments with the particle engine, for the tests of it.
 *
 * A rig is a simulation in a large box with one material for particles (0) and one for walls (1).
 */
#ifndef DEM_RIG_H
#define DEM_RIG_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "dem.h"
#include "near.h"

typedef struct rig {
    dem_param param;
    dem_material material[2];
    dem_pair pair[4];
    dem_wall wall[8];
    dem_sim *sim;
} rig;

static inline void rig_init(rig *r, dem_law law, double half_width)
{
    memset(r, 0, sizeof *r);
    r->param = dem_param_default();
    r->param.law = law;
    for (int a = 0; a < 3; a++) {
        r->param.lo[a] = -half_width;
        r->param.hi[a] = half_width;
    }
    strcpy(r->material[0].name, "grain");
    strcpy(r->material[1].name, "steel");
    r->material[0].density = r->material[1].density = 2500;
    for (int p = 0; p < 4; p++)
        r->pair[p] = (dem_pair){.restitution = 1, .stiffness = 1000, .stiffness_ratio = 1};
}

/* The wall's Young's modulus is so large that it does not yield. */
static inline void rig_hertz(rig *r, double E, double nu, double density)
{
    r->material[0].youngs_modulus = E;
    r->material[0].poisson_ratio = nu;
    r->material[0].density = density;
    r->material[1] = r->material[0];
    r->material[1].youngs_modulus = 1e9 * E;
    strcpy(r->material[1].name, "rigid");
}

static inline void rig_pairs(rig *r, double e, double mu, double k, double ratio)
{
    for (int p = 0; p < 4; p++)
        r->pair[p] =
            (dem_pair){.restitution = e, .friction = mu, .stiffness = k, .stiffness_ratio = ratio};
}

static inline void rig_floor(rig *r)
{
    dem_wall *w = &r->wall[r->param.n_wall++];
    strcpy(w->name, "floor");
    w->shape = dem_sdf_plane((const double[3]){0, 0, 0}, (const double[3]){0, 0, 1});
    w->material = 1;
}

static inline void rig_start(rig *r)
{
    r->param.n_material = 2;
    r->param.material = r->material;
    r->param.pair = r->pair;
    r->param.wall = r->wall;
    dem_status status = dem_new(MPI_COMM_SELF, &r->param, &r->sim);
    if (status) fail_msg("dem_new: %s", dem_message(r->sim));
}

static inline void rig_ball(rig *r, double radius, double x, double y, double z, double vx,
                            double vy, double vz)
{
    const double p[1][3] = {{x, y, z}}, v[1][3] = {{vx, vy, vz}};
    const int material = 0;
    if (dem_add(r->sim, 1, p, v, NULL, &radius, &material, NULL))
        fail_msg("dem_add: %s", dem_message(r->sim));
}

static inline void rig_advance(rig *r, double dt, int substeps)
{
    if (dem_advance(r->sim, dt, substeps)) fail_msg("dem_advance: %s", dem_message(r->sim));
}

static inline double sphere_mass(double radius, double density)
{
    return 4. / 3 * M_PI * radius * radius * radius * density;
}

#define assert_close(value, expected, relative)                                                    \
    do {                                                                                           \
        double v_ = (value), e_ = (expected), d_ = fabs(v_ - e_);                                  \
        if (!(d_ <= (relative)*fabs(e_)))                                                          \
            fail_msg("%s:%d: %s is %.10g, expected %.10g (off by %.3g, allowed %.3g)", __FILE__,   \
                     __LINE__, #value, v_, e_, d_ / fabs(e_), (double)(relative));                 \
    } while (0)

#define assert_within(value, expected, absolute)                                                   \
    do {                                                                                           \
        double v_ = (value), e_ = (expected), d_ = fabs(v_ - e_);                                  \
        if (!(d_ <= (absolute)))                                                                   \
            fail_msg("%s:%d: %s is %.10g, expected %.10g (off by %.3g, allowed %.3g)", __FILE__,   \
                     __LINE__, #value, v_, e_, d_, (double)(absolute));                            \
    } while (0)

#endif
