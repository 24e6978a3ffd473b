/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * mesh_box.c - a box of equal cells as a cpl_mesh.
 *
 * Cells are numbered with x fastest, then y, then z. Neighbours share a face, across periodic
 * sides too; a cell is not its own neighbour and no neighbour is listed twice, which matters where
 * a periodic direction has one or two cells.
 */
#include "cpl.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What locate needs, apart from the mesh so that the mesh may be copied. */
typedef struct box {
    int cells[3], periodic[3];
    double origin[3], spacing[3];
} box;

static int locate_one(const box *b, const double x[3])
{
    int i[3];
    for (int a = 0; a < 3; a++) {
        double s = (x[a] - b->origin[a]) / b->spacing[a];
        if (b->periodic[a]) s -= b->cells[a] * floor(s / b->cells[a]);
        if (!(s >= 0 && s <= b->cells[a])) return -1; /* written so that a NaN is outside */
        i[a] = (int)s;
        if (i[a] == b->cells[a]) i[a]--; /* the upper face belongs to the last cell */
    }
    return i[0] + b->cells[0] * (i[1] + b->cells[1] * i[2]);
}

static void locate(void *context, size_t m, const double (*x)[3], int *cell)
{
    for (size_t p = 0; p < m; p++) cell[p] = locate_one(context, x[p]);
}

/* Neighbours of the cell at `at`, appended to list; returns how many. */
static size_t neighbours_of(const box *b, const int at[3], int *list)
{
    size_t count = 0;
    const int stride[3] = {1, b->cells[0], b->cells[0] * b->cells[1]};
    const int self = at[0] + stride[1] * at[1] + stride[2] * at[2];
    for (int a = 0; a < 3; a++)
        for (int side = -1; side <= 1; side += 2) {
            int j = at[a] + side;
            if (b->periodic[a]) j = (j + b->cells[a]) % b->cells[a];
            if (j < 0 || j >= b->cells[a]) continue;
            const int other = self + (j - at[a]) * stride[a];
            const int twice = side == 1 && b->periodic[a] && b->cells[a] == 2;
            if (other != self && !twice) list[count++] = other;
        }
    return count;
}

static void fill(cpl_mesh *mesh, const box *b, double *volume, double (*centre)[3], double (*lo)[3],
                 double (*hi)[3], size_t *offset, int *neighbour)
{
    size_t c = 0;
    offset[0] = 0;
    for (int k = 0; k < b->cells[2]; k++)
        for (int j = 0; j < b->cells[1]; j++)
            for (int i = 0; i < b->cells[0]; i++, c++) {
                const int at[3] = {i, j, k};
                for (int a = 0; a < 3; a++) {
                    lo[c][a] = b->origin[a] + b->spacing[a] * at[a];
                    hi[c][a] = b->origin[a] + b->spacing[a] * (at[a] + 1);
                    centre[c][a] = b->origin[a] + b->spacing[a] * (at[a] + .5);
                }
                volume[c] = b->spacing[0] * b->spacing[1] * b->spacing[2];
                offset[c + 1] = offset[c] + neighbours_of(b, at, neighbour + offset[c]);
            }
    mesh->volume = volume;
    mesh->centre = (const double(*)[3])centre;
    mesh->lo = (const double(*)[3])lo;
    mesh->hi = (const double(*)[3])hi;
    mesh->offset = offset;
    mesh->neighbour = neighbour;
}

cpl_status cpl_mesh_box(cpl_mesh *mesh, const int cells[3], const double origin[3],
                        const double spacing[3], const int periodic[3])
{
    memset(mesh, 0, sizeof *mesh);
    double count = 1;
    for (int a = 0; a < 3; a++) {
        if (cells[a] < 1 || !(spacing[a] > 0) || !isfinite(spacing[a]) || !isfinite(origin[a]))
            return CPL_BAD_ARGUMENT;
        count *= cells[a];
    }
    if (count > INT_MAX) return CPL_BAD_ARGUMENT;
    const size_t n = (size_t)count;
    box *b = malloc(sizeof *b);
    double *volume = malloc(n * sizeof *volume);
    double(*centre)[3] = malloc(n * sizeof *centre);
    double(*lo)[3] = malloc(n * sizeof *lo);
    double(*hi)[3] = malloc(n * sizeof *hi);
    size_t *offset = malloc((n + 1) * sizeof *offset);
    int *neighbour = malloc(6 * n * sizeof *neighbour);
    if (!b || !volume || !centre || !lo || !hi || !offset || !neighbour) {
        free(b), free(volume), free(centre), free(lo), free(hi), free(offset), free(neighbour);
        return CPL_NO_MEMORY;
    }
    for (int a = 0; a < 3; a++) {
        mesh->cells[a] = b->cells[a] = cells[a];
        mesh->origin[a] = b->origin[a] = origin[a];
        mesh->spacing[a] = b->spacing[a] = spacing[a];
        mesh->periodic[a] = b->periodic[a] = periodic[a] != 0;
    }
    mesh->n = n;
    mesh->locate = locate;
    mesh->context = b;
    fill(mesh, b, volume, centre, lo, hi, offset, neighbour);
    return CPL_OK;
}

void cpl_mesh_free(cpl_mesh *mesh)
{
    free((void *)mesh->volume);
    free((void *)mesh->centre);
    free((void *)mesh->lo);
    free((void *)mesh->hi);
    free((void *)mesh->offset);
    free((void *)mesh->neighbour);
    free(mesh->context);
    memset(mesh, 0, sizeof *mesh);
}
