/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * dem_internal.h - what a simulation consists of; for the engine's own files.
 */
#ifndef DEM_INTERNAL_H
#define DEM_INTERNAL_H

#include "balance.h"
#include "comm.h"
#include "contact.h"
#include "contact_extra.h"
#include "domain.h"
#include "feed.h"
#include "halo.h"
#include "integrate.h"
#include "material.h"
#include "neighbour.h"
#include "outlet.h"
#include "particles.h"
#include "sdf.h"
#include "wall.h"

typedef struct kept_numbers {
    char name[DEM_NAME];
    size_t n;
    double *value; /* [n], owned */
} kept_numbers;

struct dem_sim {
    MPI_Comm comm;
    int rank, ranks;
    char message[512];

    /* copied from dem_param */
    double lo[3], hi[3];
    int periodic[3];
    double gravity[3];
    dem_law law;
    int n_material;
    dem_material *material;
    dem_pair *pair;         /* [n_material * n_material] */
    coefficient *table;     /* likewise */
    resistance *resistance; /* likewise */
    double steps_per_period, time_step, impact_speed, skin, fixed_step, imbalance;
    extras extras;
    int vectors;   /* of the force loop, what all ranks have */
    int any_extra; /* the plain force loops do not do */

    particles particles;
    int64_t total; /* particles of all ranks */
    domain domain;
    halo halo;
    neighbour list;
    contacts contacts;
    walls walls;
    feeders feeders;
    outlets outlets;
    balance balance;
    char *sdf_cache;       /* directory, or NULL */
    sdf_progress progress; /* while dem_new is at work */
    int owns_shapes;       /* set when dem_new has succeeded */

    double smallest_any, median_radius, largest_radius; /* m; 0 without particles */
    double *smallest_mass, *smallest_radius; /* [n_material], infinite without particles */
    int one_material, the_material;          /* all particles are of one, which is that; */
    int uniform;                             /* moreover of one radius and one mass, */
    double uniform_mass;                     /* which is this */
    double mass;                             /* of all particles, kg */
    double coming_radius, coming_speed;      /* of what feeders may yet bring: largest, m, m/s */
    double speed;                            /* no particle is faster, m/s */
    double overlap;                          /* largest / smaller radius, when last looked at, - */
    double held_step; /* that the engine chose last, kept while the limit is little above it, s */

    int outside;        /* an outside force is set */
    kept_numbers *kept; /* [n_kept] of dem_keep */
    size_t n_kept;
    double time;
    dem_report report;
};

/* Sets the message, printf style; returns `status`. */
dem_status fail(dem_sim *sim, dem_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
dem_status no_memory(dem_sim *sim);
/* Smallest and largest particles, and whether all are alike; after particles came or went. */
void take_stock(dem_sim *sim);
/* Sort particles and ghosts and list their pairs, with histories. Collective, not agreed upon. */
dem_status list_pairs(dem_sim *sim);
double mass_of_sphere(const dem_sim *sim, double radius, int material);
/* As dem_add, of particles that need no check; they are not published. */
dem_status admit_particles(dem_sim *sim, size_t n, const double (*x)[3], const double (*v)[3],
                           const double (*omega)[3], const double *radius, const int *material,
                           const int64_t *id);
/* Take out the particles in the rows i with gone[i], and book what leaves with them. */
dem_status remove_particles(dem_sim *sim, const uint8_t *gone);

#endif
