/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * start.c - what the log says of a case before the first step: domain, materials, contacts,
 * walls and every limit on the time step, so that a run can be judged by its log alone.
 */
#include "felmiDEM.h"
#include "banner.h"

#include <math.h>
#include <stdio.h>

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

/* A pair that nobody described cannot meet: caseLib has made sure of it. */
static void print_contacts(const dem_param *param)
{
    const int linear = param->law == DEM_LINEAR;
    printf("\nContacts: %s\n", linear ? "linear spring, dashpot and slider" : "Hertz and Mindlin");
    printf("%32s%12s", "restitution", "friction");
    printf(linear ? "%12s%12s\n%56s%12s\n" : "\n", "stiffness", "kt/kn", "N/m", "-");
    for (size_t i = 0; i < param->n_material; i++)
        for (size_t j = i; j < param->n_material; j++) {
            const dem_pair *p = &param->pair[i * param->n_material + j];
            if (!(p->restitution > 0.)) continue;
            char names[2 * DEM_NAME + 2];
            snprintf(names, sizeof names, "%s %s", param->material[i].name,
                     param->material[j].name);
            printf("    %-16s%12g%12g", names, p->restitution, p->friction);
            if (linear) printf("%12g%12g", p->stiffness, p->stiffness_ratio);
            puts("");
        }
}

void start_case(const dem_param *param, const case_control *control)
{
    puts("\nDomain");
    print_vector("min", param->lo, "m");
    print_vector("max", param->hi, "m");
    if (param->periodic[0] || param->periodic[1] || param->periodic[2])
        printf("    %-16s%s%s%s\n", "periodic", param->periodic[0] ? " x" : "",
               param->periodic[1] ? " y" : "", param->periodic[2] ? " z" : "");
    print_vector("gravity", param->gravity, "m/s2");
    print_materials(param);
    print_contacts(param);
    if (param->n_wall > 0) puts("\nWalls");
    for (size_t w = 0; w < param->n_wall; w++)
        printf("    %-16s of %s, %d face%s\n", param->wall[w].name,
               param->material[param->wall[w].material].name, dem_sdf_parts(param->wall[w].shape),
               dem_sdf_parts(param->wall[w].shape) == 1 ? "" : "s");
    printf("\nTime from %g to %g s, output every %g s\n", control->start_time, control->end_time,
           control->write_interval);
    fflush(stdout);
}

void start_time_step(const dem_limits *limits, double delta_t)
{
    puts("\nLimits of the time step");
    banner_limit("contact", limits->contact, "period of a contact / stepsPerPeriod");
    banner_limit("Rayleigh", limits->rayleigh, "a fifth of the Rayleigh time, not imposed");
    banner_limit("user", limits->user, "timeStep.maximum");
    banner_limit("deltaT", delta_t, "one line of this log, in equal sub-steps");
    banner_limit("sub-step", delta_t / ceil(delta_t / limits->step * (1. - 1e-12)), "at first");
    banner_line();
    puts("");
    fflush(stdout);
}
