/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiCheck - reads and checks a whole case without running it.
 *
 *     felmiCheck [-case <directory>]
 *
 * Prints all errors of the case and fails, or a summary: times, mesh, fluid, materials, particles
 * as the engine really creates them, cells in diameters, and the limits of the DEM time step. A
 * case without constant/transportProperties is one of particles alone, one without
 * constant/demProperties of fluid alone.
 */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "case.h"

typedef struct whole_case {
    const char *directory;
    int particles, flows, meshed; /* what the case has */
    case_control control;
    case_mesh mesh;
    case_fluid fluid;
    case_dem dem;
    cpl_param coupling;
    case_errors *errors;
} whole_case;

/* ---- reading --------------------------------------------------------------------------------- */

static int has_file(const char *directory, const char *name)
{
    char path[4096];
    return snprintf(path, sizeof path, "%s/%s", directory, name) < (int)sizeof path &&
           access(path, F_OK) == 0;
}

static case_dict *read_dict(const whole_case *c, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", c->directory, name);
    return case_dict_read(path, c->errors);
}

static void read_particles(whole_case *c)
{
    const case_mesh *mesh = c->meshed ? &c->mesh : NULL;
    case_dict *dict;
    if (c->flows && (dict = read_dict(c, "constant/couplingProperties"))) {
        case_read_coupling(dict, &c->coupling, c->errors);
        case_dict_free(dict);
    }
    if ((dict = read_dict(c, "constant/demProperties"))) {
        case_read_dem(dict, c->directory, mesh, c->fluid.gravity, &c->dem, c->errors);
        case_dict_free(dict);
    }
    case_check(&c->control, mesh, &c->dem, c->flows ? &c->coupling : NULL, c->errors);
}

static void read_case(whole_case *c)
{
    int coupled = has_file(c->directory, "constant/couplingProperties");
    c->flows = coupled || has_file(c->directory, "constant/transportProperties");
    c->particles = coupled || !c->flows || has_file(c->directory, "constant/demProperties");
    c->meshed = c->flows || has_file(c->directory, "system/blockMeshDict");
    case_read_control(c->directory, &c->control, c->errors);
    if (c->meshed) case_read_mesh(c->directory, &c->mesh, c->errors);
    if (c->flows)
        case_read_fluid(c->directory, &c->fluid, c->errors);
    else
        case_read_gravity(c->directory, c->fluid.gravity, c->errors);
    if (c->particles) read_particles(c);
}

/* ---- summary --------------------------------------------------------------------------------- */

static void print_flow(const whole_case *c)
{
    static const char *const type[] = {[CASE_PATCH] = "patch",
                                       [CASE_WALL] = "wall",
                                       [CASE_SYMMETRY] = "symmetry",
                                       [CASE_EMPTY] = "empty",
                                       [CASE_CYCLIC] = "cyclic"};
    static const char *const side[] = {"-x", "+x", "-y", "+y", "-z", "+z"};
    const case_mesh *m = &c->mesh;
    printf("time       %g to %g s, deltaT %g s%s, output every %g s\n", c->control.start_time,
           c->control.end_time, c->control.delta_t,
           c->control.adjust_time_step ? " at first, adjusted" : "", c->control.write_interval);
    if (c->meshed) {
        printf("mesh       %d x %d x %d = %d cells of %g x %g x %g m\n", m->cells[0], m->cells[1],
               m->cells[2], m->cells[0] * m->cells[1] * m->cells[2], m->spacing[0], m->spacing[1],
               m->spacing[2]);
        printf("           (%g %g %g) to (%g %g %g) m\n          ", m->lo[0], m->lo[1], m->lo[2],
               m->hi[0], m->hi[1], m->hi[2]);
        for (int i = 0; i < 6; i++)
            printf(" %s %s (%s)%s", side[i], m->side[i].patch, type[m->side[i].type],
                   i == 5   ? "\n"
                   : i == 2 ? "\n          "
                            : "");
    }
    if (c->flows) printf("fluid      rho %g kg/m3, nu %g m2/s\n", c->fluid.rho, c->fluid.nu);
    printf("gravity    (%g %g %g) m/s2\n", c->fluid.gravity[0], c->fluid.gravity[1],
           c->fluid.gravity[2]);
}

static int is_inserted(const dem_param *p, size_t material)
{
    for (size_t i = 0; i < p->n_insertion; i++)
        if (p->insertion[i].material == (int)material) return 1;
    return 0;
}

static void print_materials(const dem_param *p)
{
    printf("materials  %-16s %14s %18s %13s\n", "", "density kg/m3", "youngsModulus Pa",
           "poissonRatio");
    for (size_t i = 0; i < p->n_material; i++)
        printf("           %-16s %14g %18g %13g\n", p->material[i].name, p->material[i].density,
               p->material[i].youngs_modulus, p->material[i].poisson_ratio);
    printf("contacts   %-32s %13s %12s %9s   (%s law)\n", "", "stiffness N/m", "restitution",
           "friction", p->law == DEM_LINEAR ? "linear" : "hertz");
    for (size_t i = 0; i < p->n_material; i++)
        for (size_t j = i; j < p->n_material; j++) {
            if (!is_inserted(p, i) && !is_inserted(p, j)) continue; /* walls do not meet */
            const dem_pair *pair = &p->pair[i * p->n_material + j];
            char names[2 * DEM_NAME + 2];
            snprintf(names, sizeof names, "%s %s", p->material[i].name, p->material[j].name);
            printf("           %-32s %13g %12g %9g\n", names, pair->stiffness, pair->restitution,
                   pair->friction);
        }
    for (size_t i = 0; i < p->n_wall; i++)
        printf("wall       %s of %s\n", p->wall[i].name, p->material[p->wall[i].material].name);
}

static void print_particles(const whole_case *c, const dem_sim *sim)
{
    const double pi = 3.14159265358979323846;
    const dem_param *p = &c->dem.param;
    dem_view view = dem_particles(sim);
    double mass = 0, volume = 0, least = INFINITY, most = 0;
    for (size_t i = 0; i < view.n; i++) {
        double d = 2 * view.radius[i];
        mass += view.mass[i];
        volume += pi / 6 * d * d * d;
        least = fmin(least, d);
        most = fmax(most, d);
    }
    printf("particles  %zu, %g kg", view.n, mass);
    if (view.n) printf(", diameter %g to %g m", least, most);
    double room = 1;
    for (int a = 0; a < 3; a++) room *= p->hi[a] - p->lo[a];
    printf(", %.3g of the domain\n", volume / room);
    if (c->meshed && view.n)
        printf("cells      %.3g x %.3g x %.3g of the largest diameter\n", c->mesh.spacing[0] / most,
               c->mesh.spacing[1] / most, c->mesh.spacing[2] / most);
}

static void print_limits(const whole_case *c, const dem_sim *sim)
{
    dem_limits limits = dem_time_limits(sim);
    const struct {
        const char *name;
        double value;
    } limit[] = {{"contact", limits.contact},
                 {"Rayleigh (not imposed)", limits.rayleigh},
                 {"timeStep.maximum", limits.user}};
    for (int i = 0; i < 3; i++)
        if (isfinite(limit[i].value) && limit[i].value > 0)
            printf("%s  %-24s %g s\n", i ? "         " : "DEM step ", limit[i].name,
                   limit[i].value);
    if (isfinite(limits.step) && limits.step > 0)
        printf("           %.0f sub-steps in a step deltaT\n",
               fmax(1, ceil(c->control.delta_t / limits.step)));
}

/* ---- main ------------------------------------------------------------------------------------ */

/* Make the particles as a run would; 0 with a message when the engine refuses. */
static int summarise(const whole_case *c)
{
    dem_sim *sim = NULL;
    print_flow(c);
    if (!c->particles) return 1;
    print_materials(&c->dem.param);
    fflush(stdout);
    int good = dem_new(MPI_COMM_SELF, &c->dem.param, &sim) == DEM_OK;
    if (good) {
        print_particles(c, sim);
        print_limits(c, sim);
    } else {
        fprintf(stderr, "%s/constant/demProperties: %s\n", c->directory, dem_message(sim));
    }
    dem_free(sim);
    return good;
}

static int check(const char *directory)
{
    whole_case c = {.directory = directory, .errors = case_errors_new()};
    read_case(&c);
    int errors = case_errors_count(c.errors), made = 0;
    fputs(case_notes_text(c.errors), stdout);
    if (errors) {
        fputs(case_errors_text(c.errors), stderr);
        fprintf(stderr, "felmiCheck: %d error%s in the case %s\n", errors, errors > 1 ? "s" : "",
                directory);
    } else {
        made = summarise(&c);
    }
    case_dem_free(&c.dem, !made);
    case_errors_free(c.errors);
    if (made) puts("The case is ready to run.");
    return made ? EXIT_SUCCESS : EXIT_FAILURE;
}

/* The directory, or NULL when there is nothing to check; *status is the exit code then. */
static const char *read_arguments(int argc, char **argv, int *status)
{
    static const char *const help =
        "felmiCheck: reads and checks a case without running it\n\n"
        "usage: felmiCheck [-case <dir>] [-help] [-version]\n\n"
        "  -case <dir>  directory of the case, default: the current one\n"
        "  -help        this text\n"
        "  -version     version number\n\n"
        "Prints all errors of the case and fails, or a summary of what would be run.\n";
    const char *directory = ".";
    for (int i = 1; i < argc; i++) {
        const char *argument = argv[i] + (strncmp(argv[i], "--", 2) == 0); /* --help as well */
        int asked = strcmp(argument, "-help") == 0 || strcmp(argument, "-h") == 0;
        if (asked || strcmp(argument, "-version") == 0) {
            puts(asked ? help : FELMI_VERSION);
            *status = EXIT_SUCCESS;
            return NULL;
        }
        if (strcmp(argument, "-case") != 0 || i + 1 == argc) {
            fprintf(stderr, "felmiCheck: %s '%s'\n\n%s",
                    strcmp(argument, "-case") == 0 ? "a directory must follow" : "unknown argument",
                    argv[i], help);
            *status = 2;
            return NULL;
        }
        directory = argv[++i];
    }
    return directory;
}

int main(int argc, char **argv)
{
    int status = EXIT_SUCCESS;
    const char *directory = read_arguments(argc, argv, &status);
    if (!directory) return status;
    MPI_Init(&argc, &argv);
    status = check(directory);
    MPI_Finalize();
    return status;
}
