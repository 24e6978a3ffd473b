/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * start.c - what the log says of a case before the first step: domain, materials, contacts,
 * walls and every limit on the time step, so that a run can be judged by its log alone.
 */
#include "felmiDEM.h"
#include "banner.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void print_vector(const char *name, const double v[3], const char *units)
{
    printf("    %-16s (%g %g %g) %s\n", name, v[0], v[1], v[2], units);
}

static void print_materials(const dem_param *param)
{
    printf("\nMaterials%23s%12s%12s\n", "density", "E", "nu");
    printf("%32s%12s%12s\n", "kg/m3", "Pa", "-");
    for (size_t i = 0; i < param->n_material; i++) {
        const dem_material *m = &param->material[i];
        printf("    %-16s%12g", m->name, m->density);
        if (param->law == DEM_HERTZ)
            printf("%12g%12g\n", m->youngs_modulus, m->poisson_ratio);
        else
            printf("%12s%12s\n", "-", "-");
    }
}

/* Names or units of the columns that this case has. */
static void print_heads(const dem_param *param, int units)
{
    printf("%32s%12s", units ? "-" : "restitution", units ? "-" : "friction");
    if (param->law == DEM_LINEAR)
        printf("%12s%12s", units ? "N/m" : "stiffness", units ? "-" : "kt/kn");
    if (param->rolling != DEM_ROLLING_NONE) printf("%12s", units ? "-" : "rolling");
    if (param->rolling == DEM_ROLLING_EPSD) printf("%12s", units ? "-" : "damping");
    if (param->cohesion != DEM_COHESION_NONE) printf("%12s", units ? "J/m3" : "cohesion");
    puts("");
}

/* A pair that nobody described cannot meet: caseLib has made sure of it. */
static void print_contacts(const dem_param *param)
{
    static const char *const rolling[] = {
        [DEM_ROLLING_NONE] = "",
        [DEM_ROLLING_CONSTANT] = "; rolling against a constant torque",
        [DEM_ROLLING_EPSD] = "; rolling against an elastic-plastic spring and dashpot"};
    const int linear = param->law == DEM_LINEAR;
    printf("\nContacts: %s%s%s\n",
           linear ? "linear spring, dashpot and slider" : "Hertz and Mindlin",
           rolling[param->rolling],
           param->cohesion == DEM_COHESION_SJKR ? "; cohesion of the contact area (SJKR)" : "");
    print_heads(param, 0);
    print_heads(param, 1);
    for (size_t i = 0; i < param->n_material; i++)
        for (size_t j = i; j < param->n_material; j++) {
            const dem_pair *p = &param->pair[i * param->n_material + j];
            if (!(p->restitution > 0.)) continue;
            char names[2 * DEM_NAME + 2];
            snprintf(names, sizeof names, "%s %s", param->material[i].name,
                     param->material[j].name);
            printf("    %-16s%12g%12g", names, p->restitution, p->friction);
            if (linear) printf("%12g%12g", p->stiffness, p->stiffness_ratio);
            if (param->rolling != DEM_ROLLING_NONE) printf("%12g", p->rolling_friction);
            if (param->rolling == DEM_ROLLING_EPSD) printf("%12g", p->rolling_damping);
            if (param->cohesion != DEM_COHESION_NONE) printf("%12g", p->cohesion);
            puts("");
        }
}

static const char indent[] = "    ";

/* A title and lines of caseLib's under it, if there are any. */
static void print_lines(const char *title, char *lines)
{
    if (lines != NULL && *lines != '\0') printf("\n%s\n%s", title, lines);
    free(lines);
}

void start_case(const case_dem *dem, const case_control *control)
{
    const dem_param *param = &dem->param;
    puts("\nDomain");
    print_vector("min", param->lo, "m");
    print_vector("max", param->hi, "m");
    if (param->periodic[0] || param->periodic[1] || param->periodic[2])
        printf("    %-16s%s%s%s\n", "periodic", param->periodic[0] ? " x" : "",
               param->periodic[1] ? " y" : "", param->periodic[2] ? " z" : "");
    print_vector("gravity", param->gravity, "m/s2");
    print_materials(param);
    print_contacts(param);
    print_lines("Walls", case_describe_walls(dem, indent));
    print_lines("Feeders", case_describe_feeders(dem, indent));
    print_lines("Outlets", case_describe_outlets(dem, indent));
    printf("\nTime from %g to %g s, output every %g s\n", control->start_time, control->end_time,
           control->write_interval);
    fflush(stdout);
}

/* What surfaces take once they are sampled. */
static void print_memory(const dem_param *param)
{
    size_t bytes = 0;
    for (size_t w = 0; w < param->n_wall; w++) bytes += dem_sdf_memory(param->wall[w].shape);
    if (bytes > 1000000) printf("Walls take %.3g MB\n", 1e-6 * (double)bytes);
}

void start_time_step(const case_dem *dem, const dem_sim *sim, double delta_t)
{
    const dem_limits limits = dem_time_limits(sim);
    print_memory(&dem->param);
    print_lines("Limits of the time step by pairs of materials",
                case_describe_limits(dem, sim, indent));
    puts("\nLimits of the time step");
    banner_limit("contact", limits.contact, "period of a contact / stepsPerPeriod");
    banner_limit("Rayleigh", limits.rayleigh, "a fifth of the Rayleigh time, not imposed");
    banner_limit("wall", limits.wall, "a tenth of the smallest radius at the fastest wall's speed");
    banner_limit("skin", limits.skin, "half the skin at the fastest particle's speed, not imposed");
    banner_limit("user", limits.user, "timeStep.maximum");
    if (dem->param.fixed_step > 0.) banner_limit("fixed", dem->param.fixed_step, "timeStep.fixed");
    banner_limit("deltaT", delta_t, "one line of this log, in equal sub-steps");
    banner_limit("sub-step", delta_t / ceil(delta_t / limits.step * (1. - 1e-12)), "at first");
    banner_line();
    puts("");
    fflush(stdout);
}
