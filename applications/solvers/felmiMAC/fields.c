/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * fields.c - writes cell fields and their boundary values as OpenFOAM volFields in ascii.
 *
 * Order of cells: x fastest, then y, then z, as blockMesh numbers one block. Order of faces of a
 * patch: side after side as in blockMeshDict; within a side the first of two loops below is the
 * outer one: (z, y) on the sides in x, (x, z) in y, (x, y) in z.
 *
 * Format: OpenFOAM User Guide, "Basic input/output file format" and "Field files".
 */
#include "fields.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* What one file needs: `width` components and the name of its class. */
typedef struct output {
    const mac_case *c;
    const mac *m;
    FILE *file;
} output;

static void header(FILE *file, const char *class, const char *location, const char *object,
                   const char *dimensions)
{
    fprintf(file,
            "FoamFile\n{\n    version     2.0;\n    format      ascii;\n    class       %s;\n"
            "    location    \"%s\";\n    object      %s;\n}\n\ndimensions      %s;\n\n",
            class, location, object, dimensions);
}

static void put_scalar(const output *o, double x)
{
    fprintf(o->file, "%.*g\n", o->c->control.write_precision, x);
}

static void put_vector(const output *o, const double x[3])
{
    const int n = o->c->control.write_precision;
    fprintf(o->file, "(%.*g %.*g %.*g)\n", n, x[0], n, x[1], n, x[2]);
}

/* Index of the cell inside face (outer, inner) of a side, both counted from 1. */
static void loops_of(const mac_grid *g, int side, int *outer, int *inner, int *n_outer,
                     int *n_inner)
{
    static const int order[3][2] = {{2, 1}, {0, 2}, {0, 1}};
    *outer = order[side / 2][0];
    *inner = order[side / 2][1];
    *n_outer = g->n[*outer];
    *n_inner = g->n[*inner];
}

/* ---- values on a side ------------------------------------------------------------------------ */

/* Velocity on the face of a side next to cell q: its own normal component, the mean of inside and
 * ghost for the others. */
static void side_velocity(const mac *m, int side, size_t q, double U[3])
{
    const mac_grid *g = &m->grid;
    int d = side / 2;
    size_t face = q + (side % 2 ? g->stride[d] : 0);
    size_t ghost = side % 2 ? q + g->stride[d] : q - g->stride[d];
    for (int c = 0; c < 3; c++) {
        size_t s = g->stride[c];
        const double *u = m->u[c];
        U[c] = c == d ? u[face] : 0.25 * (u[q] + u[q + s] + u[ghost] + u[ghost + s]);
    }
}

typedef enum what { VELOCITY, PRESSURE, GRADIENT } what;

/* "key nonuniform List<...> n ( ... );" of a patch. */
static void patch_list(const output *o, const mac_patch *patch, const char *key, what what)
{
    const mac_grid *g = &o->m->grid;
    size_t faces = 0;
    int outer, inner, no, ni;
    for (int s = 0; s < patch->sides; s++) {
        loops_of(g, patch->side[s], &outer, &inner, &no, &ni);
        faces += (size_t)no * (size_t)ni;
    }
    fprintf(o->file, "        %-15s nonuniform List<%s>\n%zu\n(\n", key,
            what == VELOCITY ? "vector" : "scalar", faces);
    for (int s = 0; s < patch->sides; s++) {
        int side = patch->side[s], d = side / 2;
        loops_of(g, side, &outer, &inner, &no, &ni);
        for (int a = 1; a <= no; a++)
            for (int b = 1; b <= ni; b++) {
                size_t q = (size_t)(side % 2 ? g->n[d] : 1) * g->stride[d] +
                           (size_t)a * g->stride[outer] + (size_t)b * g->stride[inner];
                double rho = o->m->param.rho, U[3];
                if (what == VELOCITY) {
                    side_velocity(o->m, side, q, U);
                    put_vector(o, U);
                } else if (what == PRESSURE) {
                    put_scalar(o, mac_face_pressure(o->m, side, q) / rho);
                } else { /* along the outward normal */
                    double dp = o->m->dp[d][q + (side % 2 ? g->stride[d] : 0)];
                    put_scalar(o, (side % 2 ? dp : -dp) / rho);
                }
            }
    }
    fprintf(o->file, ")\n;\n");
}

static int is(const mac_condition *condition, const char *type)
{
    return strcmp(condition->type, type) == 0;
}

static void velocity_patch(const output *o, const mac_patch *patch)
{
    const mac_condition *U = &patch->U;
    const char *key = is(U, "inletOutlet")                                 ? "inletValue"
                      : is(U, "interstitialInletVelocity")                 ? "inletVelocity"
                      : is(U, "fixedValue") || is(U, "movingWallVelocity") ? "value"
                                                                           : NULL;
    if (key)
        fprintf(o->file, "        %-15s uniform (%.10g %.10g %.10g);\n", key, U->value[0],
                U->value[1], U->value[2]);
    if (is(U, "interstitialInletVelocity"))
        fprintf(o->file, "        alpha           voidfraction;\n");
    if (is(U, "inletOutlet") || is(U, "pressureInletOutletVelocity") ||
        is(U, "interstitialInletVelocity"))
        patch_list(o, patch, "value", VELOCITY);
}

static void pressure_patch(const output *o, const mac_patch *patch)
{
    const mac_condition *p = &patch->p;
    if (is(p, "fixedValue"))
        fprintf(o->file, "        value           uniform %.10g;\n", p->value[0]);
    if (!is(p, "fixedFluxPressure")) return;
    patch_list(o, patch, "gradient", GRADIENT);
    patch_list(o, patch, "value", PRESSURE);
}

/* ---- files ----------------------------------------------------------------------------------- */

typedef enum field { FIELD_U, FIELD_P, FIELD_VOIDFRACTION, FIELD_US } field;

static void boundary_field(const output *o, field field)
{
    fprintf(o->file, "boundaryField\n{\n");
    for (int i = 0; i < o->c->patches; i++) {
        const mac_patch *patch = &o->c->patch[i];
        const char *type = field == FIELD_U ? patch->U.type : patch->p.type;
        if (field > FIELD_P && patch->type < CASE_SYMMETRY) type = "zeroGradient";
        fprintf(o->file, "    %s\n    {\n        type            %s;\n", patch->name, type);
        if (field == FIELD_U) velocity_patch(o, patch);
        if (field == FIELD_P) pressure_patch(o, patch);
        fprintf(o->file, "    }\n");
    }
    fprintf(o->file, "}\n");
}

static void internal_scalar(const output *o, const double *q, double scale)
{
    const mac_grid *g = &o->m->grid;
    fprintf(o->file, "internalField   nonuniform List<scalar>\n%zu\n(\n",
            (size_t)g->n[0] * (size_t)g->n[1] * (size_t)g->n[2]);
    for (int k = 1; k <= g->n[2]; k++)
        for (int j = 1; j <= g->n[1]; j++)
            for (int i = 1; i <= g->n[0]; i++) put_scalar(o, scale * q[mac_at(g, i, j, k)]);
    fprintf(o->file, ")\n;\n\n");
}

static void internal_vector(const output *o, size_t cells, const double (*q)[3])
{
    fprintf(o->file, "internalField   nonuniform List<vector>\n%zu\n(\n", cells);
    for (size_t i = 0; i < cells; i++) put_vector(o, q[i]);
    fprintf(o->file, ")\n;\n\n");
}

static int write_field(const mac_case *c, const mac_coupled *coupled, const char *time, field field,
                       char *message, size_t size)
{
    static const char *const name[] = {"U", "p", "voidfraction", "Us"};
    static const char *const class[] = {"volVectorField", "volScalarField", "volScalarField",
                                        "volVectorField"};
    static const char *const dimensions[] = {"[0 1 -1 0 0 0 0]", "[0 2 -2 0 0 0 0]",
                                             "[0 0 0 0 0 0 0]", "[0 1 -1 0 0 0 0]"};
    char path[4200], temporary[4210];
    snprintf(path, sizeof path, "%s/%s/%s", c->directory, time, name[field]);
    snprintf(temporary, sizeof temporary, "%s.tmp", path);
    output o = {.c = c, .m = coupled->fluid, .file = fopen(temporary, "w")};
    if (!o.file) {
        snprintf(message, size, "%s cannot be written: %s", temporary, strerror(errno));
        return -1;
    }
    header(o.file, class[field], time, name[field], dimensions[field]);
    if (field == FIELD_U) {
        mac_cell_velocity(o.m, coupled->U);
        internal_vector(&o, coupled->cells, (const double(*)[3])coupled->U);
    } else if (field == FIELD_US)
        internal_vector(&o, coupled->cells, phase_Us(coupled->particles));
    else if (field == FIELD_P)
        internal_scalar(&o, o.m->p, 1 / o.m->param.rho);
    else
        internal_scalar(&o, o.m->eps, 1);
    boundary_field(&o, field);
    int failed = ferror(o.file);
    failed |= fclose(o.file);
    if (!failed) failed = rename(temporary, path);
    if (failed) snprintf(message, size, "%s could not be written: %s", path, strerror(errno));
    return failed ? -1 : 0;
}

int mac_write_fields(const mac_case *c, const mac_coupled *coupled, double time, char *message,
                     size_t size)
{
    char name[32], path[4200];
    mac_time_name(c, time, name, sizeof name);
    snprintf(path, sizeof path, "%s/%s", c->directory, name);
    if (mkdir(path, 0777) && errno != EEXIST) {
        snprintf(message, size, "%s cannot be made: %s", path, strerror(errno));
        return -1;
    }
    /* p of a run that starts anew at 0 would overwrite the case's own conditions */
    field last = coupled->particles ? FIELD_US : FIELD_P;
    for (field field = FIELD_U; field <= last; field++)
        if (write_field(c, coupled, name, field, message, size)) return -1;
    return 0;
}
