/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * failingMemory.h - allocation that fails when the test says so. Included before all else by the
 * sources under test (tests/CMakeLists.txt); the test defines the functions.
 */
#ifndef FAILING_MEMORY_H
#define FAILING_MEMORY_H

#include <stdlib.h>

void *failing_malloc(size_t size);
void *failing_calloc(size_t n, size_t size);
void *failing_realloc(void *block, size_t size);

#define malloc  failing_malloc
#define calloc  failing_calloc
#define realloc failing_realloc

#endif
