/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * log.c - start of the log, line of a step, table of times, and the time series of the flow.
 *
 * The limits of the time step are those of the explicit terms: convection and viscosity of the
 * fluid (mac_limits) and contacts of the particles. Explicit drag is limited by
 *     dt < 2 rho eps / (d(K u)/du),
 * between one and two times rho eps / K, since K grows at most linearly with u; the running
 * measure in the log is K dt/(rho eps).
 */
#include "log.h"
#include "banner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- the case -------------------------------------------------------------------------------- */

static void log_sides(const mac_case *c)
{
    static const char *const name[6] = {"-x", "+x", "-y", "+y", "-z", "+z"};
    puts("\nPatches");
    for (int i = 0; i < c->patches; i++) {
        const mac_patch *patch = &c->patch[i];
        char sides[32] = "";
        for (int s = 0; s < patch->sides; s++) {
            strcat(sides, " ");
            strcat(sides, name[patch->side[s]]);
        }
        printf("    %-16s%-14s U %-30s p %s\n", patch->name, sides, patch->U.type, patch->p.type);
    }
}

static void log_equations(const mac_case *c)
{
    static const char *const convection[] = {"hybrid: central up to cell Peclet number 2, upwind "
                                             "above",
                                             "upwind", "central"};
    const mac_param *p = &c->flow;
    puts("\nEquations (u interstitial, p full pressure, shared by both phases)");
    puts("    d(eps)/dt + div(eps u) = 0");
    puts(c->particles ? "    d(eps rho u)/dt + div(eps rho u u) = -eps grad p + S - K u\n"
                        "        + div(eps mu (grad u + grad u^T)) + eps rho g"
                      : "    with eps = 1:  d(rho u)/dt + div(rho u u) = -grad p\n"
                        "        + div(mu (grad u + grad u^T)) + rho g");
    printf("    %-16s%s\n", "convection", convection[p->convection]);
    printf("    %-16s%s\n", "time", "explicit, first order; pressure and continuity implicit");
    if (c->particles)
        printf("    %-16s%s\n", "drag",
               c->coupling.scheme == CPL_EXPLICIT ? "explicit" : "implicit in u");
    printf("    %-16sconjugate gradients, multigrid %c-cycle, to %g\n", "pressure",
           p->cycle == MAC_W_CYCLE ? 'W' : 'V', p->tolerance);
    for (int d = 0; d < 3; d++)
        if (p->hold_flux[d])
            printf("    %-16s%c, eps u + (1 - eps) v kept at %g m/s\n", "mean flux", "xyz"[d],
                   p -> mean_flux[d]);
}

void mac_log_case(const mac_case *c)
{
    const case_mesh *m = &c->mesh;
    puts("\nMesh");
    printf("    %-16s%d x %d x %d = %ld\n", "cells", m->cells[0], m->cells[1], m->cells[2],
           (long)m->cells[0] * m->cells[1] * m->cells[2]);
    printf("    %-16s(%g %g %g) to (%g %g %g) m\n", "box", m->lo[0], m->lo[1], m->lo[2], m->hi[0],
           m->hi[1], m->hi[2]);
    printf("    %-16s(%g %g %g) m\n", "spacing", m->spacing[0], m->spacing[1], m->spacing[2]);
    puts("\nFluid");
    printf("    %-16s%g kg/m3\n", "density", c->flow.rho);
    printf("    %-16s%g Pa s\n", "viscosity", c->flow.mu);
    printf("    %-16s(%g %g %g) m/s2\n", "gravity", c->flow.gravity[0], c->flow.gravity[1],
           c->flow.gravity[2]);
    log_sides(c);
    log_equations(c);
    fflush(stdout);
}

/* A title and lines of caseLib's under it, if there are any. */
static void log_lines(const char *title, char *lines)
{
    if (lines && *lines) printf("\n%s\n%s", title, lines);
    free(lines);
}

static void log_particles(const mac_case *c, const mac_coupled *coupled)
{
    static const char *const law[] = {"none", "Ergun, Wen and Yu", "Di Felice",
                                      "Schiller and Naumann"};
    const phase_report r = phase_last_report(coupled->particles);
    const dem_view view = dem_particles(phase_engine(coupled->particles));
    double smallest = INFINITY, largest = 0;
    for (size_t i = 0; i < view.n; i++) {
        smallest = fmin(smallest, 2 * view.radius[i]);
        largest = fmax(largest, 2 * view.radius[i]);
    }
    puts("\nParticles");
    printf("    %-16s%zu\n", "number", view.n);
    if (view.n) printf("    %-16s%g to %g m\n", "diameter", smallest, largest);
    printf("    %-16s%s\n", "contact law", c->dem.param.law == DEM_HERTZ ? "hertz" : "linear");
    printf("    %-16s%s\n", "drag law", law[c->coupling.drag]);
    printf("    %-16s%g to %g\n", "void fraction", r.map.eps_min, r.map.eps_max);
    if (r.map.full_cells)
        printf("    %-16s%g of %g m3 moved to neighbours by the packing limit %g\n", "full cells",
               r.map.moved_volume, r.map.solid_volume, c->coupling.packing_limit);
    log_lines("Walls", case_describe_walls(&c->dem, "    "));
    log_lines("Feeders", case_describe_feeders(&c->dem, "    "));
    log_lines("Outlets", case_describe_outlets(&c->dem, "    "));
    log_lines("Limits of the DEM step by pairs of materials",
              case_describe_limits(&c->dem, phase_engine(coupled->particles), "    "));
}

void mac_log_limits(const mac_case *c, const mac_coupled *coupled, double dt)
{
    double convective, viscous;
    mac_limits(coupled->fluid, &convective, &viscous);
    if (coupled->particles) log_particles(c, coupled);
    puts("\nLimits of the time step");
    banner_limit("convection", convective, "Courant number 1, at the start's velocity");
    banner_limit("viscosity", viscous, "rho / (4 mu sum 1/h^2)");
    if (coupled->particles) {
        const dem_limits limits = dem_time_limits(phase_engine(coupled->particles));
        double K = 0;
        const double *Kc = phase_K(coupled->particles), *eps = phase_voidage(coupled->particles);
        for (size_t i = 0; i < coupled->cells; i++) K = fmax(K, Kc[i] / (c->flow.rho * eps[i]));
        banner_limit("drag", K > 0 ? 1 / K : INFINITY,
                     c->coupling.scheme == CPL_EXPLICIT
                         ? "rho eps / K, fluid moving with particles"
                         : "rho eps / K, not a limit: drag is implicit");
        banner_limit("contact", limits.contact, "period of a contact / stepsPerPeriod: sub-steps");
        banner_limit("Rayleigh", limits.rayleigh, "a fifth of the Rayleigh time, not imposed");
        banner_limit("user", limits.user, "timeStep.maximum");
        banner_limit("sub-step", dt / ceil(dt / limits.step * (1 - 1e-12)), "at first");
    }
    banner_limit("deltaT", dt, c->control.adjust_time_step ? "at first, then by maxCo" : "fixed");
    printf("\nTime from %g to %g s, output every %g s\n", c->control.start_time,
           c->control.end_time, c->control.write_interval);
    banner_line();
    puts("");
    fflush(stdout);
}

void mac_log_step(const mac_case *c, const mac_coupled *coupled, double time, double dt,
                  double seconds_elapsed)
{
    const mac_report *r = &coupled->fluid->report;
    const case_control *control = &c->control;
    char text[512];
    if (coupled->particles) {
        phase_log(coupled->particles, text, sizeof text, time, control->end_time, r->courant,
                  coupled->seconds_fluid, seconds_elapsed, control->start_time);
        printf("%s  p %d it\n", text, r->iterations);
        fflush(stdout);
        return;
    }
    long left = lrint(seconds_elapsed * (control->end_time - time) / (time - control->start_time));
    printf("Time = %-9.6g s  dt %-8.3g  Co %-6.3g  p %d it, residual %.1e  continuity %.1e  "
           "[fluid %.1f ms]  left %ld:%02ld:%02ld\n",
           time, dt, r->courant, r->iterations, r->residual, r->continuity,
           1e3 * coupled->seconds_fluid, left / 3600, left / 60 % 60, left % 60);
    fflush(stdout);
}

void mac_log_shares(const mac_coupled *coupled, double seconds_elapsed)
{
    char text[1024];
    if (!coupled->particles) return;
    phase_shares(coupled->particles, text, sizeof text, coupled->seconds_fluid_all,
                 seconds_elapsed);
    printf("\n%s", text);
}

/* ---- time series ----------------------------------------------------------------------------- */

FILE *mac_series_open(const mac_case *c, double from, char *message, size_t size)
{
    char path[4200], head[6 * (CASE_NAME + 3) + 80];
    int n = snprintf(head, sizeof head, "time,deltaT,courant,iterations,residual");
    for (int i = 0; i < c->patches; i++)
        if (c->patch[i].type == CASE_PATCH)
            n += snprintf(head + n, sizeof head - (size_t)n, ",p_%s", c->patch[i].name);
    snprintf(head + n, sizeof head - (size_t)n, ",height\n");
    snprintf(path, sizeof path, "%s/postProcessing/felmiMAC/solver.csv", c->directory);
    return cpl_table_open(path, head, from, message, size);
}

int mac_series_write(FILE *file, const mac_case *c, const mac_coupled *coupled, double time,
                     double dt)
{
    const mac *m = coupled->fluid;
    fprintf(file, "%.14g,%.14g,%.6g,%d,%.3g", time, dt, m->report.courant, m->report.iterations,
            m->report.residual);
    for (int i = 0; i < c->patches; i++) {
        const mac_patch *patch = &c->patch[i];
        if (patch->type != CASE_PATCH) continue;
        double sum = 0, area = 0;
        for (int s = 0; s < patch->sides; s++) {
            int d = patch->side[s] / 2;
            double A = 1;
            for (int e = 0; e < 3; e++)
                if (e != d) A *= c->mesh.hi[e] - c->mesh.lo[e];
            sum += A * mac_side_pressure(m, patch->side[s]);
            area += A;
        }
        fprintf(file, ",%.14g", sum / area);
    }
    double height = coupled->particles ? phase_last_report(coupled->particles).height : 0;
    fprintf(file, ",%.14g\n", height);
    return fflush(file) ? -1 : 0;
}
