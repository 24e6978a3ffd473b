/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * size.h - distributions of diameters, and mixtures of species that have one each.
 */
#ifndef SIZE_H
#define SIZE_H

#include "dem.h"

#include <gsl/gsl_rng.h>

/* The smallest and the largest diameter that a distribution makes, m; it need not be valid. */
void size_range(const dem_size *size, double *lo, double *hi);

/* The number of particles below a diameter, by intervals of x = ln(d/hi). */
typedef struct size_law {
    dem_size given; /* with tables of its own */
    double lo, hi;  /* m */
    double top;     /* logarithm that its density is scaled by */
    size_t n;       /* intervals */
    double *edge;   /* [n + 1] x, increasing */
    double *below;  /* [n + 1] number below, of 1 */
    double total;   /* integral of the scaled density */
    double cube;    /* mean of d^3 over the particles, m3 */
} size_law;

/* DEM_BAD_ARGUMENT, with the reason in `reason` of `room` bytes, or DEM_NO_MEMORY. */
dem_status size_init(size_law *law, const dem_size *size, char *reason, size_t room);
void size_free(size_law *law);
/* Share of the number of particles below d, and the diameter that the share u is below, m. */
double size_below(const size_law *law, double d);
double size_quantile(const size_law *law, double u);

/* Several species; who comes next. */
typedef struct mixture {
    size_t n;
    int *material;
    size_law *size;
    double *below;            /* [n + 1] shares of the number, summed up */
    double volume, mass;      /* mean of a particle, m3, kg */
    double smallest, largest; /* diameter, m */
    double turn;              /* [0, 1): tells the next species */
} mixture;

/* Shares of mass or of number; the densities are those of `material`. As size_init. */
dem_status mixture_init(mixture *m, size_t n, const dem_species *species, int share_by_mass,
                        size_t n_material, const dem_material *material, char *reason, size_t room);
void mixture_free(mixture *m);
/* Where the turns begin. */
void mixture_start(mixture *m, const gsl_rng *rng);
void mixture_draw(mixture *m, const gsl_rng *rng, double *diameter, int *material);

#endif
