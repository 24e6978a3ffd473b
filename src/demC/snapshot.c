/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * snapshot.c - the particles of one instant in an HDF5 file.
 *
 *     /particles/id, material                              [n]     int64, int32
 *     /particles/position, velocity, angularVelocity, force [n][3] float64
 *     /particles/diameter, density                         [n]     float64
 *
 * Every dataset has an attribute `units`; the file has `time` (s), `version` of this layout and
 * `creator`, the group the names of the materials. Rank r writes the rows after those of rank r-1.
 *
 * One rank needs 124 bytes a particle for the moment of writing (h5file.c).
 *
 * Nothing is ever half there: both files are made under another name, synchronised with the disk
 * and renamed, the series (series.c) last. Ranks agree on the outcome after every stage.
 */
#include "snapshot.h"
#include "h5file.h"
#include "series.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { VERSION = 1 }; /* of the layout of the file */

typedef struct writer {
    h5file f;
    const dem_view *view;
    const dem_material *material;
    double time;
    h5rows rows;
    hid_t group;
    double *scratch; /* [n] */
} writer;

/* Names of the materials that occur, in the order of their numbers. */
static void put_materials(writer *w)
{
    int highest = -1;
    for (size_t i = 0; i < w->view->n; i++)
        if (w->view->material[i] > highest) highest = w->view->material[i];
    MPI_Allreduce(MPI_IN_PLACE, &highest, 1, MPI_INT, MPI_MAX, w->f.comm);
    if (highest < 0) return;
    const hsize_t count = (hsize_t)highest + 1;
    char(*names)[DEM_NAME] = calloc(count, sizeof *names);
    if (names == NULL) {
        h5file_fail(&w->f, "materials", "out of memory");
        return;
    }
    for (hsize_t m = 0; m < count; m++)
        snprintf(names[m], sizeof *names, "%s", w->material[m].name);
    const hid_t type = h5file_text_type(DEM_NAME), space = H5Screate_simple(1, &count, NULL);
    h5file_put_attribute(&w->f, w->group, "materials", type, space, names);
    H5Sclose(space);
    H5Tclose(type);
    free(names);
}

static void put_doubles(writer *w, const char *name, int width, const void *rows, const char *units)
{
    h5file_put_rows(&w->f, w->group, name, w->rows, width, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE, rows,
                    units);
}

static void put_particles(writer *w)
{
    const dem_view *view = w->view;
    h5file_put_rows(&w->f, w->group, "id", w->rows, 1, H5T_NATIVE_INT64, H5T_STD_I64LE, view->id,
                    "-");
    put_doubles(w, "position", 3, view->x, "m");
    put_doubles(w, "velocity", 3, view->v, "m/s");
    put_doubles(w, "angularVelocity", 3, view->omega, "rad/s");
    put_doubles(w, "force", 3, view->force, "N");
    for (size_t i = 0; i < view->n; i++) w->scratch[i] = 2. * view->radius[i];
    put_doubles(w, "diameter", 1, w->scratch, "m");
    for (size_t i = 0; i < view->n; i++) w->scratch[i] = w->material[view->material[i]].density;
    put_doubles(w, "density", 1, w->scratch, "kg/m3");
    h5file_put_rows(&w->f, w->group, "material", w->rows, 1, H5T_NATIVE_INT, H5T_STD_I32LE,
                    view->material, "-");
    put_materials(w);
}

static void write_file(writer *w)
{
    const int version = VERSION;
    h5file *f = &w->f;
    /* Rows of all datasets (id, four vectors, two scalars, material), and the rest of the file: the
     * names of materials can have 65536 bytes at most. */
    h5file_create(f, (size_t)w->rows.total * (8 + 4 * 24 + 2 * 8 + 4) + 2 * 65536, 0);
    if (h5file_agree(f)) {
        w->group = h5file_group(f, "particles");
        h5file_put_scalar(f, f->file, "time", H5T_NATIVE_DOUBLE, &w->time);
        h5file_put_scalar(f, f->file, "version", H5T_NATIVE_INT, &version);
        h5file_put_text(f, f->file, "creator", "felmiFoam");
        put_particles(w);
        h5file_check(f, H5Gclose(w->group), "particles");
    }
    h5file_close(f);
}

/* On the first rank: put the finished file in its place and enter it into the series. */
static void publish(writer *w, const char *directory, const char *name)
{
    char text[256];
    h5file *f = &w->f;
    h5file_synchronise(f);
    if (f->failed) return;
    series *s = series_begin(directory, name, w->time, w->rows.total, text, sizeof text);
    if (s == NULL) {
        h5file_fail(f, "series", text);
        return;
    }
    h5file_rename(f);
    if (f->failed)
        series_abandon(s);
    else if (series_commit(s, text, sizeof text) != 0)
        h5file_fail(f, "series", text);
}

dem_status snapshot_write(MPI_Comm comm, const dem_view *view, const dem_material *material,
                          double time, const char *directory, const char *name, char *message,
                          size_t size)
{
    writer w = {.view = view, .material = material, .time = time};
    h5file *f = &w.f;
    h5file_begin(f, comm, message, size);
    w.rows = h5file_rows(f, view->n);
    w.scratch = malloc((view->n + 1) * sizeof *w.scratch);
    if (w.scratch == NULL) h5file_fail(f, "write", "out of memory");
    if (h5file_name(f, directory, name) && f->rank == 0) h5file_make_directory(f, directory);
    if (h5file_agree(f)) {
        write_file(&w);
        if (h5file_agree(f) && f->rank == 0) publish(&w, directory, name);
        if (!h5file_agree(f)) {
            if (f->rank == 0) unlink(f->part);
            MPI_Barrier(comm); /* no rank finds the remains */
        }
    }
    h5file_end(f);
    free(w.scratch);
    return f->failed ? DEM_IO : DEM_OK;
}
