/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * mesh_box.c - a box of equal cells as a cpl_mesh.
 *
 * Cells are numbered with x fastest, then y, then z. Neighbours share a face, across periodic
 * sides too; a cell is not its own neighbour and no neighbour is listed twice, which matters where
 * a periodic direction has one or two cells. A part of it names neighbours by their numbers in the
 * box.
 */
#include "map.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int box_locate(const cpl_mesh *b, const double x[3])
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
    for (size_t p = 0; p < m; p++) cell[p] = box_locate(context, x[p]);
}

/* Neighbours of the cell at `at`, appended to list; returns how many. */
static size_t neighbours_of(const cpl_mesh *b, const int at[3], int *list)
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

/* The arrays of a mesh, not borrowed here. */
typedef struct arrays {
    double *volume, (*centre)[3], (*lo)[3], (*hi)[3];
    size_t *offset;
    int *neighbour;
    int64_t *id, *neighbour_id;
} arrays;

/* Cell c of the mesh is the one with the number `id` of the box. */
static void fill_cell(const cpl_mesh *b, arrays *m, size_t c, int id)
{
    const int nx = b->cells[0], ny = b->cells[1];
    const int at[3] = {id % nx, id / nx % ny, id / nx / ny};
    for (int a = 0; a < 3; a++) {
        m->lo[c][a] = b->origin[a] + b->spacing[a] * at[a];
        m->hi[c][a] = b->origin[a] + b->spacing[a] * (at[a] + 1);
        m->centre[c][a] = b->origin[a] + b->spacing[a] * (at[a] + .5);
    }
    m->volume[c] = b->spacing[0] * b->spacing[1] * b->spacing[2];
    m->offset[c + 1] = m->offset[c] + neighbours_of(b, at, m->neighbour + m->offset[c]);
}

/* The box alone; its number of cells, 0 if there is none. */
static size_t describe(cpl_mesh *mesh, const int cells[3], const double origin[3],
                       const double spacing[3], const int periodic[3])
{
    memset(mesh, 0, sizeof *mesh);
    double count = 1;
    for (int a = 0; a < 3; a++) {
        if (cells[a] < 1 || !(spacing[a] > 0) || !isfinite(spacing[a]) || !isfinite(origin[a]))
            return 0;
        count *= cells[a];
        mesh->cells[a] = cells[a];
        mesh->origin[a] = origin[a];
        mesh->spacing[a] = spacing[a];
        mesh->periodic[a] = periodic[a] != 0;
    }
    return count > INT_MAX ? 0 : (size_t)count;
}

/* Arrays for n cells of the box that `mesh` describes, the neighbours not filled. */
static cpl_status allocate(cpl_mesh *mesh, size_t n, arrays *m)
{
    const size_t bytes = n ? n : 1;
    cpl_mesh *box = malloc(sizeof *box); /* for locate, so that the mesh may be copied */
    m->volume = malloc(bytes * sizeof *m->volume);
    m->centre = malloc(bytes * sizeof *m->centre);
    m->lo = malloc(bytes * sizeof *m->lo);
    m->hi = malloc(bytes * sizeof *m->hi);
    m->offset = calloc(n + 1, sizeof *m->offset);
    m->neighbour = malloc(6 * bytes * sizeof *m->neighbour);
    if (box) *box = *mesh;
    mesh->n = n;
    mesh->volume = m->volume;
    mesh->centre = (const double(*)[3])m->centre;
    mesh->lo = (const double(*)[3])m->lo;
    mesh->hi = (const double(*)[3])m->hi;
    mesh->offset = m->offset;
    mesh->neighbour = m->neighbour;
    mesh->locate = locate;
    mesh->context = box;
    if (box && m->volume && m->centre && m->lo && m->hi && m->offset && m->neighbour) return CPL_OK;
    cpl_mesh_free(mesh);
    return CPL_NO_MEMORY;
}

cpl_status cpl_mesh_box(cpl_mesh *mesh, const int cells[3], const double origin[3],
                        const double spacing[3], const int periodic[3])
{
    arrays m;
    const size_t n = describe(mesh, cells, origin, spacing, periodic);
    const cpl_status status = n ? allocate(mesh, n, &m) : CPL_BAD_ARGUMENT;
    for (size_t c = 0; c < n && !status; c++) fill_cell(mesh, &m, c, (int)c);
    return status;
}

/* Whether the part is all of the box, in order: then its neighbours are places, too. */
static int whole(size_t all, size_t n, const int64_t *id)
{
    for (size_t c = 0; c < n && n == all; c++)
        if (id[c] != (int64_t)c) return 0;
    return n == all;
}

cpl_status cpl_mesh_box_part(cpl_mesh *mesh, const int cells[3], const double origin[3],
                             const double spacing[3], const int periodic[3], size_t n,
                             const int64_t *id)
{
    arrays m;
    const size_t all = describe(mesh, cells, origin, spacing, periodic);
    for (size_t c = 0; c < n; c++)
        if (id[c] < 0 || (uint64_t)id[c] >= all) return CPL_BAD_ARGUMENT;
    const cpl_status status = all ? allocate(mesh, n, &m) : CPL_BAD_ARGUMENT;
    if (status) return status;
    for (size_t c = 0; c < n; c++) fill_cell(mesh, &m, c, (int)id[c]);
    const size_t links = m.offset[n];
    mesh->id = m.id = malloc(n * sizeof *m.id + 1);
    mesh->neighbour_id = m.neighbour_id = malloc(links * sizeof *m.neighbour_id + 1);
    if (!m.id || !m.neighbour_id) {
        cpl_mesh_free(mesh);
        return CPL_NO_MEMORY;
    }
    if (n) memcpy(m.id, id, n * sizeof *id);
    for (size_t k = 0; k < links; k++) m.neighbour_id[k] = m.neighbour[k];
    if (!whole(all, n, id)) {
        free(m.neighbour);
        mesh->neighbour = NULL;
        mesh->locate = NULL;
    }
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
    free((void *)mesh->id);
    free((void *)mesh->neighbour_id);
    free(mesh->context);
    memset(mesh, 0, sizeof *mesh);
}
