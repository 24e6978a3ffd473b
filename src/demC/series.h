/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * series.h - the XDMF file that strings snapshots together to a time series.
 */
#ifndef SERIES_H
#define SERIES_H

#include <stddef.h>

typedef struct series series;

/**
 * Write `<directory>/particles.xmf` with one more instant under a temporary name: `<name>.h5` with
 * n particles at `time`. Instants at or after `time` and those of the same name are left out,
 * earlier ones kept. NULL on error, with the reason in `message`. series_commit or series_abandon
 * ends it.
 */
series *series_begin(const char *directory, const char *name, double time, unsigned long long n,
                     char *message, size_t size);
/* Put it in its place: 0, or -1 with the reason in `message`. */
int series_commit(series *s, char *message, size_t size);
void series_abandon(series *s);

#endif
