/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * stl.h - triangles from an STL file.
 */
#ifndef STL_H
#define STL_H

#include <stddef.h>

/* Triangles as the file gives them, corners anticlockwise seen from outside. */
typedef struct soup {
    size_t n;
    double (*x)[3][3]; /* [n], m */
} soup;

/* Read `path`, ASCII or binary, numbers times `scale`: 0, or -1 with the reason, which has the line
 * or byte, in `message`. soup_free in either case. */
int stl_read(const char *path, double scale, soup *s, char *message, size_t size);
void soup_free(soup *s);

#endif
