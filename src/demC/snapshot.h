/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * snapshot.h - writes the particles of one instant to HDF5 and keeps the XDMF time series.
 */
#ifndef SNAPSHOT_H
#define SNAPSHOT_H

#include "dem.h"

/**
 * Write `<directory>/<name>.h5` and enter it into `<directory>/particles.xmf` (both made whole
 * under a temporary name, synchronised with the disk, then renamed; the directory is created).
 * Times at or after `time` that the series held are replaced, earlier ones kept. `material` is
 * indexed by view->material. Collective; the status is the same on every rank. On DEM_IO, with the
 * reason in `message` (of `size` bytes), the files that existed are as they were.
 */
dem_status snapshot_write(MPI_Comm comm, const dem_view *view, const dem_material *material,
                          double time, const char *directory, const char *name, char *message,
                          size_t size);

#endif
