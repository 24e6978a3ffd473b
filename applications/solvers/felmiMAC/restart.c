/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart.c - the fluid and the clock of a run in the restart file of its particles: one file, that
 * is whole or refused, so that particles and fluid are always of the same moment.
 *
 * State of the fluid are the velocities of the faces and the solutions that the next solve of the
 * pressure equation starts from. All else is found in the step: void fraction, drag and its source
 * from the particles, pressure and its gradient from the velocities.
 */
#include "restart.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIELDS = 7, MESH = 9, CLOCK = sizeof(mac_clock) / sizeof(double) };

/* The arrays that are state; absent ones are NULL. */
static void fields_of(const mac *m, double *array[FIELDS], size_t length[FIELDS])
{
    for (int d = 0; d < 3; d++) {
        array[d] = m->u[d];
        length[d] = m->grid.size;
        array[4 + d] = m->response[d];
        length[4 + d] = m->poisson.mg.level[0].size;
    }
    array[3] = m->poisson.x;
    length[3] = m->poisson.mg.level[0].size;
}

static const char *const NAME[FIELDS] = {"fluid.velocityX", "fluid.velocityY", "fluid.velocityZ",
                                         "fluid.pressure",  "fluid.responseX", "fluid.responseY",
                                         "fluid.responseZ"};

/* Numbers of cells, corner and spacing. */
static void mesh_of(const mac *m, double mesh[MESH])
{
    for (int d = 0; d < 3; d++) {
        mesh[d] = m->grid.n[d];
        mesh[3 + d] = m->grid.lo[d];
        mesh[6 + d] = m->grid.h[d];
    }
}

/* Hand the state to the engine for a file, or take it back from there to spare the memory. */
static int keep(mac_coupled *c, const mac_clock *clock, int on)
{
    dem_sim *engine = phase_engine(c->particles);
    double *array[FIELDS], mesh[MESH];
    size_t length[FIELDS];
    int failed = 0;
    fields_of(c->fluid, array, length);
    mesh_of(c->fluid, mesh);
    failed |= dem_keep(engine, "fluid.mesh", MESH, mesh);
    failed |= dem_keep(engine, "fluid.clock", CLOCK, (const double *)clock);
    for (int k = 0; k < FIELDS; k++)
        failed |= array[k] && dem_keep(engine, NAME[k], on ? length[k] : 0, array[k]);
    return failed;
}

int mac_restart_write(mac_coupled *c, const mac_clock *clock, const char *directory,
                      const char *name, int keep_files, char *message, size_t size)
{
    dem_sim *engine = phase_engine(c->particles);
    int failed = keep(c, clock, 1);
    if (!failed) failed = dem_write_restart(engine, directory, name, keep_files);
    if (failed) snprintf(message, size, "%s", dem_message(engine));
    keep(c, clock, 0);
    return failed ? -1 : 0;
}

static int refuse(char *message, size_t size, const char *file, const char *why)
{
    snprintf(message, size, "restart file %s: %s", file, why);
    return -1;
}

int mac_restart_read(mac_coupled *c, mac_clock *clock, const char *file, char *message, size_t size)
{
    const dem_sim *engine = phase_engine(c->particles);
    const double interval = clock->interval;
    double *array[FIELDS], here[MESH], there[MESH];
    size_t length[FIELDS];
    fields_of(c->fluid, array, length);
    mesh_of(c->fluid, here);
    if (dem_kept(engine, "fluid.mesh", MESH, there) != MESH ||
        dem_kept(engine, "fluid.clock", CLOCK, (double *)clock) != CLOCK)
        return refuse(message, size, file, "has no fluid of felmiMAC in it: another program's?");
    if (memcmp(here, there, sizeof here) != 0)
        return refuse(message, size, file, "its fluid is on another mesh than blockMeshDict's");
    for (int k = 0; k < FIELDS; k++) {
        if (!array[k]) continue;
        const size_t found = dem_kept(engine, NAME[k], length[k], array[k]);
        /* a mean flux may be held from now on: its responses are guesses, and begin at zero */
        if (found != length[k] && !(k > 3 && found == 0))
            return refuse(message, size, file, "its fluid is not complete");
    }
    if (clock->interval != interval) {
        clock->interval = interval;
        clock->next_write = clock->time + interval;
    }
    return 0;
}
