/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * contact.h - history of touching pairs, carried over rebuilds and sorting.
 *
 * Each entry of the neighbour list has a flag that the pair touched when the forces were last
 * summed. Pairs that did, and only they, have a tangential spring (see contact_law.h: force on i in
 * x y z, contact radius in the fourth place), in the order of the list. Elastic-plastic rolling
 * resistance has a spring more (contact_extra.h: torque on i, contact radius in the fourth place),
 * kept likewise.
 *
 * The springs lie in a ring. The sum of forces reads the old ones from its head and writes the new
 * ones, as many as touch now, some way in front of the head, so that what is written lies where was
 * read a moment ago and memory holds one copy only. A contact that ends is not written again, and
 * with that its history is gone. Where contacts form faster than others end the writer could catch
 * up with the reader; the ring is then made wider.
 *
 * Before the list is rebuilt the touching pairs are saved, that is, named; the springs stay where
 * they are. Afterwards the pairs are found again in the new rows. A touching pair is always in the
 * new list, so none can be lost.
 */
#ifndef DEM_CONTACT_H
#define DEM_CONTACT_H

#include "neighbour.h"

/* A contact taken out of the store, or on its way into it. */
typedef struct saved_contact {
    double spring[4], rolling[4];
    uint32_t i, j;
} saved_contact;

typedef struct contacts {
    int rolls;           /* nonzero: there are rolling springs */
    uint8_t *touch;      /* [entry of the neighbour list] */
    size_t n;            /* contacts, */
    uint32_t (*pair)[2]; /* [n] and their partners, from saving to restoring */

    double (*spring)[4];         /* [size] the ring; that of contact k is at contacts_at(k) */
    double (*rolling)[4];        /* [size], NULL unless `rolls` */
    size_t size, begin;          /* of the ring; where its head is */
    size_t gap;                  /* how far in front of the head is written, if there is room */
    uint32_t *before;            /* [row] contacts in the rows before; while restoring */
    size_t entries, pairs, rows; /* room in `touch`, `pair`, `before` */
} contacts;

/* Where the springs of contact k are. */
static inline size_t contacts_at(const contacts *c, size_t k)
{
    return c->begin + k < c->size ? c->begin + k : c->begin + k - c->size;
}

void contacts_free(contacts *c);
/* Name the touching pairs of the list as it is: c->pair. */
dem_status contacts_save(contacts *c, const neighbour *list);
/* Those saved, one by one. */
saved_contact contacts_get(const contacts *c, size_t k);
/* Contact `from` takes the place of the contact `to`; who leaves some out sets c->n then. */
void contacts_move(contacts *c, size_t to, size_t from);
/* One more, read from a file or brought by a particle from another rank. */
dem_status contacts_append(contacts *c, const saved_contact *s);
/* Particles have gone between the two: place[old] is a particle's new index, UINT32_MAX none. */
void contacts_renumber(contacts *c, const uint32_t *place);
/* Give every pair of the new list its history; list->place tells where particles went. */
dem_status contacts_restore(contacts *c, const neighbour *list);

/* ---- for the sum of forces ------------------------------------------------------------------- */

/* The springs on their way from the sum before to this one. */
typedef struct contact_stream {
    contacts *c;
    double (*spring)[4], (*rolling)[4]; /* the ring */
    size_t size, begin, to;             /* where in it the first is read, and written */
    size_t gap;                         /* places between the two */
    size_t read, written;               /* so far; those that have ended are among the read */
    int failed;                         /* there was no memory */
} contact_stream;

contact_stream contacts_open(contacts *c);
/* See that `more` springs can be written over none that is yet to be read; zero if they can. */
int contacts_widen(contact_stream *s, size_t more);
/* What was written is the history; in error, all of it is lost. */
dem_status contacts_close(contact_stream *s, const neighbour *list);

#endif
