/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * insert_lattice.c - points of a regular lattice that lie in a region.
 *
 * Point p of count[0] count[1] count[2], x first, is lo + (index + 1/2) spacing; those within the
 * region are meant. Whether two of them are too near follows from their indices: of a point only
 * those are looked at that are less than a diameter away along every axis, or along a periodic one
 * from an image of it. So each rank can make and check a share of its own.
 */
#include "insert.h"

#include <math.h>
#include <string.h>

/* A spacing of just one diameter is good, whatever rounding makes of it. */
static const double TOLERANCE = 1e-9;

int lattice_lay(lattice *l, const dem_insertion *ins)
{
    double total = 1.;
    l->region = ins->region;
    for (int a = 0; a < 3; a++) {
        l->lo[a] = ins->lo[a];
        l->spacing[a] = ins->spacing[a];
        /* A last one on the bound itself is not lost to rounding. */
        const double n = fmax(floor((ins->hi[a] - ins->lo[a]) / ins->spacing[a] + .5 + 1e-9), 0.);
        total *= n;
        if (!(total < 1e9)) return -1;
        l->count[a] = (size_t)n;
    }
    l->n = l->count[0] * l->count[1] * l->count[2];
    l->slack = 1e-9 * fmin(fmin(ins->spacing[0], ins->spacing[1]), ins->spacing[2]);
    return 0;
}

static void place_at(const lattice *l, const size_t index[3], double x[3])
{
    for (int a = 0; a < 3; a++) x[a] = l->lo[a] + ((double)index[a] + .5) * l->spacing[a];
}

int lattice_point(const lattice *l, size_t p, double x[3])
{
    const size_t index[3] = {p % l->count[0], p / l->count[0] % l->count[1],
                             p / (l->count[0] * l->count[1])};
    place_at(l, index, x);
    return dem_sdf_distance(l->region, x) >= -l->slack;
}

/* The indices along axis a that are less than `reach` from `index`, or from an image of it: in
 * from[k]...to[k]. How many such spans. */
static int find_spans(const lattice *l, const packing_room *room, int a, size_t index, double reach,
                      int64_t (*span)[2])
{
    const double length = room->hi[a] - room->lo[a], h = l->spacing[a];
    const int far = room->periodic[a] ? (int)ceil((double)l->count[a] * h / length) + 1 : 0;
    int n = 0;
    for (int image = -far; image <= far && n < LATTICE_SPANS; image++) {
        const double at = (double)index + image * length / h;
        const double low = fmax(ceil(at - reach / h), 0.);
        const double high = fmin(floor(at + reach / h), (double)l->count[a] - 1.);
        if (!(low <= high)) continue;
        span[n][0] = (int64_t)low;
        span[n++][1] = (int64_t)high;
    }
    return n;
}

static int is_taken(const lattice *l, const packing_room *room, const double x[3],
                    const size_t index[3], double reach)
{
    double y[3], d[3];
    place_at(l, index, y);
    packing_separation(room, x, y, d);
    if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] >= reach * reach) return 0;
    return dem_sdf_distance(l->region, y) >= -l->slack;
}

int lattice_crowded(const lattice *l, const packing_room *room, size_t p, double diameter)
{
    const double reach = diameter * (1. - TOLERANCE);
    const size_t at[3] = {p % l->count[0], p / l->count[0] % l->count[1],
                          p / (l->count[0] * l->count[1])};
    int64_t span[3][LATTICE_SPANS][2];
    int n[3];
    double x[3];
    place_at(l, at, x);
    for (int a = 0; a < 3; a++) n[a] = find_spans(l, room, a, at[a], reach, span[a]);
    for (int c = 0; c < n[0] * n[1] * n[2]; c++) {
        const int64_t *s[3] = {span[0][c % n[0]], span[1][c / n[0] % n[1]],
                               span[2][c / (n[0] * n[1])]};
        for (size_t k = (size_t)s[2][0]; k <= (size_t)s[2][1]; k++)
            for (size_t j = (size_t)s[1][0]; j <= (size_t)s[1][1]; j++)
                for (size_t i = (size_t)s[0][0]; i <= (size_t)s[0][1]; i++) {
                    const size_t index[3] = {i, j, k};
                    /* Of two it is the later one that is too near. */
                    if ((k * l->count[1] + j) * l->count[0] + i >= p) continue;
                    if (is_taken(l, room, x, index, reach)) return 1;
                }
    }
    return 0;
}
