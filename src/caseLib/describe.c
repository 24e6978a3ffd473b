/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * describe.c - walls, feeders, outlets and limits of a case in words, for the log of every program.
 */
#include "particles.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* A text that grows, whose lines start alike. */
typedef struct lines {
    FILE *file;
    char *text;
    size_t size;
    const char *indent;
} lines;

/* In place: the stream keeps the addresses of text and size. */
static void lines_open(lines *l, const char *indent)
{
    *l = (lines){.indent = indent};
    l->file = open_memstream(&l->text, &l->size);
}

/* To be freed; NULL when there is no memory. */
static char *lines_text(lines *l)
{
    if (l->file) fclose(l->file);
    return l->text;
}

static void put(lines *l, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    if (l->file) vfprintf(l->file, format, values);
    va_end(values);
}

/* A new line: of what is named, or one more of it. */
static void start(lines *l, const char *name)
{
    put(l, "%s%-16s ", l->indent, name);
}

static void put_box(lines *l, const double lo[3], const double hi[3])
{
    put(l, "(%g %g %g) to (%g %g %g) m", lo[0], lo[1], lo[2], hi[0], hi[1], hi[2]);
}

static void put_window(lines *l, double begin, double end)
{
    if (begin > 0) put(l, ", from %g s", begin);
    if (isfinite(end)) put(l, ", until %g s", end);
}

/* ---- walls ----------------------------------------------------------------------------------- */

static void put_motion(lines *l, const dem_motion *m)
{
    const double degree = 180 / 3.14159265358979323846;
    const double *v = m->vector, *o = m->origin;
    switch (m->kind) {
    case DEM_TRANSLATION:
        put(l, "translation, velocity (%g %g %g) m/s", v[0], v[1], v[2]);
        break;
    case DEM_ROTATION:
        put(l, "rotation about (%g %g %g) through (%g %g %g) m, %g rad/s = %g rpm", v[0], v[1],
            v[2], o[0], o[1], o[2], m->rate, m->rate * degree / 6);
        break;
    case DEM_OSCILLATION:
        put(l, "oscillation, amplitude (%g %g %g) m, %g Hz", v[0], v[1], v[2], m->frequency);
        break;
    case DEM_ROCKING:
        put(l, "rocking about (%g %g %g) through (%g %g %g) m, %g degrees, %g Hz", v[0], v[1], v[2],
            o[0], o[1], o[2], m->amplitude * degree, m->frequency);
        break;
    case DEM_TABLE:
        put(l, "by a table of %zu rows, %g to %g s", m->n, m->n ? m->time[0] : 0,
            m->n ? m->time[m->n - 1] : 0);
        break;
    }
    if (m->ramp > 0) put(l, ", ramp of %g s", m->ramp);
    put_window(l, m->begin, m->end);
    put(l, "\n");
}

static void put_wall(lines *l, const dem_param *param, const dem_wall *wall)
{
    const int parts = dem_sdf_parts(wall->shape);
    const size_t bytes = dem_sdf_memory(wall->shape);
    double lo[3], hi[3];
    start(l, wall->name);
    put(l, "of %s, %d face%s", param->material[wall->material].name, parts, parts == 1 ? "" : "s");
    dem_sdf_bounds(wall->shape, lo, hi);
    int bounded = 1; /* asked one by one: sums of infinities trap where felmiFoam runs */
    for (int a = 0; a < 3; a++) bounded = bounded && isfinite(lo[a]) && isfinite(hi[a]);
    if (bounded) {
        put(l, ", ");
        put_box(l, lo, hi);
    }
    if (bytes > 100000) put(l, ", %.3g MB", 1e-6 * (double)bytes);
    put(l, "\n");
    for (size_t i = 0; i < wall->n_motion; i++) {
        start(l, "");
        put_motion(l, &wall->motion[i]);
    }
}

char *case_describe_walls(const case_dem *dem, const char *indent)
{
    lines l;
    lines_open(&l, indent);
    for (size_t w = 0; w < dem->param.n_wall; w++) put_wall(&l, &dem->param, &dem->param.wall[w]);
    return lines_text(&l);
}

/* ---- feeders and outlets --------------------------------------------------------------------- */

static void put_species(lines *l, const dem_param *param, const dem_species *species)
{
    static const char *const law[] = {"",          "uniform",      "normal",
                                      "logNormal", "rosinRammler", "table"};
    const dem_size *size = &species->size;
    const double lo = size_least(size), hi = size_most(size);
    put(l, "%s, ", param->material[species->material].name);
    if (size->kind == DEM_SIZE_EQUAL)
        put(l, "%g m", size->mean);
    else
        put(l, "%s by %s, %s%g to %g m", law[size->kind], size->by_mass ? "mass" : "number",
            size->kind == DEM_SIZE_LOGNORMAL && !(size->hi > 0) ? "mostly " : "", lo, hi);
}

static void put_feeder(lines *l, const dem_param *param, const dem_feeder *feeder)
{
    start(l, feeder->name);
    if (feeder->mass_rate > 0)
        put(l, "%g kg/s", feeder->mass_rate);
    else
        put(l, "%g particles/s", feeder->number_rate);
    put(l, " into ");
    put_box(l, feeder->lo, feeder->hi);
    put_window(l, feeder->begin, feeder->end);
    if (isfinite(feeder->mass)) put(l, ", at most %g kg", feeder->mass);
    if (feeder->number >= 0) put(l, ", at most %lld particles", (long long)feeder->number);
    put(l, "\n");
    double all = 0;
    for (size_t i = 0; i < feeder->n_species; i++) all += feeder->species[i].share;
    for (size_t i = 0; i < feeder->n_species; i++) {
        start(l, "");
        put_species(l, param, &feeder->species[i]);
        if (feeder->n_species > 1)
            put(l, ", %.3g %% of the %s", 100 * feeder->species[i].share / all,
                feeder->share_by_mass ? "mass" : "number");
        put(l, "\n");
    }
}

char *case_describe_feeders(const case_dem *dem, const char *indent)
{
    lines l;
    lines_open(&l, indent);
    for (size_t i = 0; i < dem->param.n_feeder; i++)
        put_feeder(&l, &dem->param, &dem->param.feeder[i]);
    return lines_text(&l);
}

char *case_describe_outlets(const case_dem *dem, const char *indent)
{
    lines l;
    lines_open(&l, indent);
    for (size_t i = 0; i < dem->param.n_outlet; i++) {
        const dem_outlet *outlet = &dem->param.outlet[i];
        double lo[3], hi[3];
        dem_sdf_bounds(outlet->region, lo, hi);
        start(&l, outlet->name);
        put_box(&l, lo, hi);
        put_window(&l, outlet->begin, outlet->end);
        put(&l, "\n");
    }
    return lines_text(&l);
}

/* ---- limits ---------------------------------------------------------------------------------- */

char *case_describe_limits(const case_dem *dem, const dem_sim *sim, const char *indent)
{
    const dem_param *param = &dem->param;
    lines l;
    lines_open(&l, indent);
    for (size_t a = 0; a < param->n_material; a++)
        for (size_t b = a; b < param->n_material; b++) {
            double contact, rayleigh;
            char names[2 * DEM_NAME + 2];
            dem_pair_limits(sim, (int)a, (int)b, &contact, &rayleigh);
            if (!isfinite(contact) && !isfinite(rayleigh)) continue;
            snprintf(names, sizeof names, "%s %s", param->material[a].name,
                     param->material[b].name);
            start(&l, names);
            if (isfinite(contact)) put(&l, "contact %.4g s", contact);
            if (isfinite(rayleigh))
                put(&l, "%sRayleigh %.4g s", isfinite(contact) ? ", " : "", rayleigh);
            put(&l, "\n");
        }
    return lines_text(&l);
}
