/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * memory.h - room for the large arrays.
 */
#ifndef DEM_MEMORY_H
#define DEM_MEMORY_H

#include <stddef.h>

/* Not cleared, aligned to cache lines; for free(). NULL: out of memory. */
void *room_for(size_t bytes);

#endif
