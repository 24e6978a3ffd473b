/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * felmiCheck - reads and checks a whole case without running it.
 *
 *     felmiCheck [-case <directory>]
 *
 * Prints all errors of the case and fails, or a summary: times, mesh, fluid, conditions, materials,
 * particles as the engine really creates them, cells in diameters, and the limits of the time step.
 * What a case is:
 *
 *     no constant/transportProperties    particles alone, for felmiDEM
 *     mesh one box of equal cells        for felmiMAC, whose own reader reads all of it; felmiFoam
 *                                        shares the files of constant and controlDict
 *     any other mesh                     for felmiFoam: those files, and what was not checked
 *
 * A case for felmiMAC without constant/demProperties is one of fluid alone.
 */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arguments.h"
#include "case.h"
#include "message.h"
#include "progress.h"
#include "settings.h"

static const char PROGRAM[] = "felmiCheck";
static const char HELP[] =
    "felmiCheck: reads and checks a case without running it\n\n"
    "usage: felmiCheck [-case <dir>] [-help] [-version]\n\n"
    "  -case <dir>  directory of the case, default: the current one\n"
    "  -help        this text\n"
    "  -version     version number\n\n"
    "Prints all errors of the case and fails, or a summary of what would be run. Where the mesh "
    "is\n"
    "one box of equal cells the case is checked as felmiMAC reads it, with 0/U, 0/p and the\n"
    "sub-dictionary felmiMAC of fvSolution; on other meshes, which only felmiFoam can use, as far\n"
    "as felmiFoam reads it by the same rules.\n";

typedef struct whole_case {
    const char *directory;
    int particles, flows; /* what the case has */
    int meshed;           /* the mesh is a box, and known */
    int general;          /* there is a mesh, which is no box ... */
    char why[1024];       /* ... because, with a newline */
    mac_case c;
    case_errors *errors;
} whole_case;

/* ---- reading --------------------------------------------------------------------------------- */

static int has_block_mesh(const char *directory)
{
    return case_file_exists(directory, "system/blockMeshDict") ||
           case_file_exists(directory, "constant/polyMesh/blockMeshDict");
}

/* Whether the case says that it is for felmiMAC. */
static int is_for_mac(const char *directory)
{
    case_errors *ignored = case_errors_new();
    case_dict *dict = case_read_file(directory, "system/controlDict", ignored);
    const char *application = dict ? case_word(dict, "application", "", 0, ignored) : NULL;
    int mac = application && strcmp(application, "felmiMAC") == 0;
    case_dict_free(dict);
    case_errors_free(ignored);
    return mac;
}

/* A mesh that felmiFoam alone can use: of blockMesh, but no box; cut by snappyHexMesh; or made
 * elsewhere. */
static int is_general(whole_case *w)
{
    const char *const d = w->directory, *made = NULL;
    if (case_file_exists(d, "system/snappyHexMeshDict"))
        made = "there is a system/snappyHexMeshDict";
    else if (!has_block_mesh(d) && case_file_exists(d, "constant/polyMesh/owner"))
        made = "there is no system/blockMeshDict";
    if (made || !has_block_mesh(d)) {
        snprintf(w->why, sizeof w->why, "%s\n", made ? made : "");
        return made != NULL;
    }
    case_mesh mesh;
    case_errors *why = case_errors_new();
    case_read_mesh(d, &mesh, why);
    snprintf(w->why, sizeof w->why, "%s", case_errors_text(why));
    case_errors_free(why);
    return mesh.general;
}

/* As felmiFoam reads them: times, of which it understands more than is checked here, and fluid. */
static void read_foam_flow(whole_case *w)
{
    mac_case *c = &w->c;
    case_dict *dict = case_read_file(w->directory, "system/controlDict", w->errors);
    if (dict) {
        double start = case_start_time(dict, w->directory, w->errors);
        case_control_of(dict, start, &c->control, w->errors);
        c->control.adjust_time_step = case_bool(dict, "adjustTimeStep", &(int){0}, w->errors);
        case_dict_free(dict);
    }
    dict = case_read_file(w->directory, "constant/transportProperties", w->errors);
    if (dict) case_fluid_of(dict, 0, &c->fluid, w->errors);
    case_dict_free(dict);
    case_read_gravity(w->directory, c->fluid.gravity, w->errors);
    dict = case_read_file(w->directory, "constant/couplingProperties", w->errors);
    if (dict) case_read_coupling(dict, &c->coupling, w->errors);
    case_dict_free(dict);
}

/* Cases that felmiMAC's reader is not for: of particles alone, and on general meshes. */
static void read_parts(whole_case *w)
{
    mac_case *c = &w->c;
    w->particles = 1;
    if (w->flows) {
        read_foam_flow(w);
    } else {
        case_read_control(w->directory, &c->control, w->errors);
        w->meshed = has_block_mesh(w->directory);
        if (w->meshed) case_read_mesh(w->directory, &c->mesh, w->errors);
        case_read_gravity(w->directory, c->fluid.gravity, w->errors);
    }
    const case_mesh *mesh = w->meshed || w->flows ? &c->mesh : NULL;
    case_dict *dict = case_read_file(w->directory, "constant/demProperties", w->errors);
    if (dict) case_read_dem(dict, w->directory, mesh, c->fluid.gravity, &c->dem, w->errors);
    case_dict_free(dict);
    if (case_errors_count(w->errors) == 0)
        case_check(&c->control, w->flows ? mesh : NULL, &c->dem, w->flows ? &c->coupling : NULL,
                   w->errors);
}

static void read_case(whole_case *w)
{
    w->flows = case_file_exists(w->directory, "constant/couplingProperties") ||
               case_file_exists(w->directory, "constant/transportProperties");
    w->general = w->flows && !is_for_mac(w->directory) && is_general(w);
    if (!w->flows || w->general) {
        read_parts(w);
        return;
    }
    mac_case_read(w->directory, &w->c, w->errors);
    w->particles = w->c.particles;
    w->meshed = 1;
}

/* ---- summary --------------------------------------------------------------------------------- */

static void print_mesh(const case_mesh *m)
{
    static const char *const type[] = {[CASE_PATCH] = "patch",
                                       [CASE_WALL] = "wall",
                                       [CASE_SYMMETRY] = "symmetry",
                                       [CASE_EMPTY] = "empty",
                                       [CASE_CYCLIC] = "cyclic"};
    static const char *const side[] = {"-x", "+x", "-y", "+y", "-z", "+z"};
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

static void print_flow(const whole_case *w)
{
    const mac_case *c = &w->c;
    printf("time       %g to %g s, deltaT %g s%s", c->control.start_time, c->control.end_time,
           c->control.delta_t, c->control.adjust_time_step ? " at first, adjusted" : "");
    if (w->general)
        puts("");
    else
        printf(", output every %g s\n", c->control.write_interval);
    if (w->meshed) print_mesh(&c->mesh);
    if (w->flows && isfinite(c->fluid.nu))
        printf("fluid      rho %g kg/m3, nu %g m2/s\n", c->fluid.rho, c->fluid.nu);
    else if (w->flows)
        printf("fluid      rho %g kg/m3\n", c->fluid.rho);
    for (int i = 0; i < c->patches; i++)
        printf("%s %-16s U %-28s p %s\n", i ? "          " : "conditions", c->patch[i].name,
               c->patch[i].U.type, c->patch[i].p.type);
    printf("gravity    (%g %g %g) m/s2\n", c->fluid.gravity[0], c->fluid.gravity[1],
           c->fluid.gravity[2]);
}

static int is_made(const dem_param *p, int material)
{
    for (size_t i = 0; i < p->n_insertion; i++) {
        const dem_insertion *in = &p->insertion[i];
        if (!in->n_species && in->material == material) return 1;
        for (size_t k = 0; k < in->n_species; k++)
            if (in->species[k].material == material) return 1;
    }
    for (size_t i = 0; i < p->n_feeder; i++)
        for (size_t k = 0; k < p->feeder[i].n_species; k++)
            if (p->feeder[i].species[k].material == material) return 1;
    return 0;
}

static void print_contacts(const dem_param *p)
{
    static const char *const rolling[] = {[DEM_ROLLING_NONE] = "",
                                          [DEM_ROLLING_CONSTANT] = ", rolling constantTorque",
                                          [DEM_ROLLING_EPSD] = ", rolling elasticPlastic"};
    const int rolls = p->rolling != DEM_ROLLING_NONE, sticks = p->cohesion != DEM_COHESION_NONE;
    printf("contacts   %-32s %13s %12s %9s", "", "stiffness N/m", "restitution", "friction");
    if (rolls) printf(" %16s", "rollingFriction");
    if (sticks) printf(" %22s", "cohesionEnergyDensity");
    printf("   (%s law%s%s)\n", p->law == DEM_LINEAR ? "linear" : "hertz", rolling[p->rolling],
           sticks ? ", cohesion sjkr" : "");
    for (size_t i = 0; i < p->n_material; i++)
        for (size_t j = i; j < p->n_material; j++) {
            if (!is_made(p, (int)i) && !is_made(p, (int)j)) continue; /* walls do not meet */
            const dem_pair *pair = &p->pair[i * p->n_material + j];
            char names[2 * DEM_NAME + 2];
            snprintf(names, sizeof names, "%s %s", p->material[i].name, p->material[j].name);
            printf("           %-32s %13g %12g %9g", names, pair->stiffness, pair->restitution,
                   pair->friction);
            if (rolls) printf(" %16g", pair->rolling_friction);
            if (sticks) printf(" %22g", pair->cohesion);
            puts("");
        }
}

/* A title and lines of caseLib's under it, if there are any. */
static void print_lines(const char *title, char *lines)
{
    if (lines && *lines) printf("%s\n%s", title, lines);
    free(lines);
}

static const char indent[] = "           ";

static void print_materials(const case_dem *dem)
{
    const dem_param *p = &dem->param;
    const int elastic = p->law == DEM_HERTZ;
    printf("materials  %-16s %14s", "", "density kg/m3");
    if (elastic) printf(" %18s %13s", "youngsModulus Pa", "poissonRatio");
    putchar('\n');
    for (size_t i = 0; i < p->n_material; i++) {
        const dem_material *m = &p->material[i];
        printf("           %-16s %14g", m->name, m->density);
        if (elastic) printf(" %18g %13g", m->youngs_modulus, m->poisson_ratio);
        putchar('\n');
    }
    print_contacts(p);
    print_lines("walls", case_describe_walls(dem, indent));
    print_lines("feeders", case_describe_feeders(dem, indent));
    print_lines("outlets", case_describe_outlets(dem, indent));
}

/* Surfaces are sampled when the simulation is made. */
static void print_memory(const dem_param *p)
{
    size_t bytes = 0;
    for (size_t w = 0; w < p->n_wall; w++) bytes += dem_sdf_memory(p->wall[w].shape);
    if (bytes > 1000000) printf("%swalls take %.3g MB\n", indent, 1e-6 * (double)bytes);
}

static void print_particles(const whole_case *w, const dem_sim *sim)
{
    const mac_case *c = &w->c;
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
    if (w->meshed && view.n)
        printf("cells      %.3g x %.3g x %.3g of the largest diameter\n", c->mesh.spacing[0] / most,
               c->mesh.spacing[1] / most, c->mesh.spacing[2] / most);
}

static void print_limits(const case_control *control, const case_dem *dem, const dem_sim *sim)
{
    print_lines("limits", case_describe_limits(dem, sim, indent));
    dem_limits limits = dem_time_limits(sim);
    const struct {
        const char *name;
        double value;
    } limit[] = {{"contact", limits.contact},
                 {"Rayleigh (not imposed)", limits.rayleigh},
                 {"wall", limits.wall},
                 {"timeStep.maximum", limits.user},
                 {"timeStep.fixed", dem->param.fixed_step}};
    for (int i = 0; i < 5; i++)
        if (isfinite(limit[i].value) && limit[i].value > 0)
            printf("%s  %-24s %g s\n", i ? "         " : "DEM step ", limit[i].name,
                   limit[i].value);
    if (isfinite(limits.step) && limits.step > 0)
        printf("           %.0f sub-steps in a step deltaT\n",
               fmax(1, ceil(control->delta_t / limits.step)));
}

/* ---- main ------------------------------------------------------------------------------------ */

/* The particles need a domain: that of a mesh, or their own. */
static int has_domain(const dem_param *p)
{
    double sum = 0;
    for (int a = 0; a < 3; a++) sum += p->lo[a] + p->hi[a];
    return isfinite(sum);
}

/* Make the particles as a run would; 0 with a message when the engine refuses. *taken: the engine
 * has the walls' shapes. */
static int make_particles(whole_case *w, int *taken)
{
    dem_sim *sim = NULL;
    const dem_param *param = &w->c.dem.param;
    progress progress;
    print_materials(&w->c.dem);
    progress_follow(&progress, &w->c.dem.param);
    if (!has_domain(param)) return 1;
    int good = *taken = dem_new(MPI_COMM_SELF, param, &sim) == DEM_OK;
    if (good) {
        print_particles(w, sim);
        if (*dem_message(sim)) printf("%s%s\n", indent, dem_message(sim));
        print_memory(param);
        print_limits(&w->c.control, &w->c.dem, sim);
    } else {
        message_stop(PROGRAM, "%s/constant/demProperties: %s", w->directory, dem_message(sim));
    }
    dem_free(sim);
    return good;
}

/* What the summary above vouches for, and what it does not. */
static void conclude(const whole_case *w)
{
    const char *const where = has_domain(&w->c.dem.param)
                                  ? "whether cells suit the particles"
                                  : "whether cells suit the particles, and\n"
                                    "            whether these lie in it";
    if (w->general)
        printf("not checked the mesh, which is not one box of equal cells: only felmiFoam can use "
               "it;\n            %s            %s;\n            0/U, 0/p, fvSchemes, fvSolution, "
               "turbulenceProperties\n"
               "No mistakes in what was checked.\n",
               w->why, where);
    else if (w->flows)
        puts("not checked what OpenFOAM alone reads: fvSchemes, solvers in fvSolution,\n"
             "            turbulenceProperties\n"
             "felmiMAC can run this case.");
    else
        puts("felmiDEM can run this case.");
}

/* felmiMAC knows fewer conditions than felmiFoam: whose the errors are. */
static void tell_apart(const whole_case *w)
{
    whole_case foam = {.directory = w->directory, .flows = 1, .errors = case_errors_new()};
    foam.c.mesh = w->c.mesh; /* particles and walls are compared with it there, too */
    read_parts(&foam);
    if (case_errors_count(foam.errors) == 0)
        fputs(
            "These are of felmiMAC's reader. What felmiFoam reads by the same rules (controlDict,\n"
            "transportProperties, g, demProperties, couplingProperties) is without mistakes; the\n"
            "rest of its case was not checked.\n",
            stderr);
    case_dem_free(&foam.c.dem, 1);
    case_errors_free(foam.errors);
}

static int check(const char *directory)
{
    whole_case w = {.directory = directory, .errors = case_errors_new()};
    int taken = 0;
    read_case(&w);
    const int read = message_case(PROGRAM, w.errors) == 0;
    int good = read;
    if (read) {
        print_flow(&w);
        if (w.particles) good = make_particles(&w, &taken);
    }
    if (good)
        conclude(&w);
    else if (!read && w.flows && !w.general && !is_for_mac(directory))
        tell_apart(&w);
    case_dem_free(&w.c.dem, !taken);
    w.c.particles = 0; /* they have been freed */
    mac_case_free(&w.c, 0);
    case_errors_free(w.errors);
    return good ? EXIT_SUCCESS : EXIT_FAILURE;
}

int main(int argc, char **argv)
{
    int status = EXIT_SUCCESS;
    const char *directory = arguments_read(argc, argv, PROGRAM, HELP, &status);
    if (!directory) return status;
    MPI_Init(&argc, &argv);
    status = check(directory);
    MPI_Finalize();
    return status;
}
