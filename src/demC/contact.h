/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * contact.h - history of touching pairs, carried over rebuilds and sorting.
 *
 * Each entry of the neighbour list has a slot for its tangential spring (see contact_law.h: force
 * on i in x y z, contact radius in the fourth place) and a flag that it touched when the forces
 * were last summed. A contact that ends loses its flag, and with it its history. Before the list
 * is rebuilt the touching pairs are saved; afterwards they are found again in the new rows. A
 * touching pair is always in the new list, so none can be lost.
 *
 * Elastic-plastic rolling resistance has a spring more (contact_extra.h: torque on i, contact
 * radius in the fourth place), with slots of its own that exist only where it is in use.
 */
#ifndef DEM_CONTACT_H
#define DEM_CONTACT_H

#include "neighbour.h"

typedef struct saved_contact {
    double spring[4], rolling[4];
    uint32_t i, j;
} saved_contact;

typedef struct contacts {
    int rolls;            /* nonzero: there are rolling springs */
    double (*spring)[4];  /* [entry of the neighbour list] */
    double (*rolling)[4]; /* [entry], NULL unless `rolls` */
    uint8_t *touch;       /* [entry] */
    size_t capacity;
    saved_contact *saved;
    size_t n_saved, saved_capacity;
} contacts;

void contacts_free(contacts *c);
/* Remember the touching pairs of the list as it is. */
dem_status contacts_save(contacts *c, const neighbour *list);
/* Remember one more, brought by a particle from another rank. */
dem_status contacts_append(contacts *c, const saved_contact *s);
/* Particles have gone between the two: place[old] is a particle's new index, UINT32_MAX none. */
void contacts_renumber(contacts *c, const uint32_t *place);
/* Give every pair of the new list its history; list->place tells where particles went. */
dem_status contacts_restore(contacts *c, const neighbour *list);

#endif
