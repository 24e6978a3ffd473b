/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * settings.h - a case directory as felmiMAC needs it.
 */
#ifndef SETTINGS_H
#define SETTINGS_H

#include "case.h"
#include "mac.h"

/* Condition of one patch for U or p, as read. */
typedef struct mac_condition {
    const char *type; /* OpenFOAM's word, static */
    double value[3];  /* velocity (m/s) or kinematic pressure (m2/s2) of the types that have one */
} mac_condition;

/* A patch: its sides in the order of its faces in blockMeshDict. */
typedef struct mac_patch {
    char name[CASE_NAME];
    case_patch_type type;
    int sides, side[6];
    mac_condition U, p;
} mac_patch;

typedef struct mac_case {
    const char *directory;
    case_control control;
    case_mesh mesh;
    case_fluid fluid;
    int particles; /* constant/demProperties is there */
    case_dem dem;
    cpl_param coupling;
    mac_param flow;
    int patches;
    mac_patch patch[6]; /* in the order of blockMeshDict */
    double (*U)[3];     /* initial velocity, [cells], malloced */
    char start[32];     /* name of the time directory with the conditions */
} mac_case;

/* Read everything; what is wrong is added to errors. */
void mac_case_read(const char *directory, mac_case *c, case_errors *errors);
/* shapes: the walls' shapes too (of a case that no engine took over). */
void mac_case_free(mac_case *c, int shapes);

/* conditions.c: 0/U and 0/p into c->patch, c->flow.side and c->U. */
void mac_read_conditions(mac_case *c, case_errors *errors);
/* Name of a time directory. */
void mac_time_name(const mac_case *c, double time, char *name, size_t size);

#endif
