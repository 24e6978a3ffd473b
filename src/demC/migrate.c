/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * migrate.c - particles go to the ranks that own their places, with their histories and columns.
 *
 * A particle travels as the fields of the store, one after the other. Every rank that owns one of
 * two partners has the history of their contact. So a particle that leaves takes a copy of all its
 * contacts along, by the ids of the partners; the rank it comes to finds the partner among its
 * ghosts, or among those who came too, or has the history itself already. What a rank keeps of
 * contacts with ghosts is found again by their ids as well, since ghosts are made anew; contacts
 * between particles that both stay, nearly all, are only renumbered.
 */
#include "migrate.h"

#include "dem_internal.h"

#include <stdlib.h>
#include <string.h>

/* History on its way, and of a contact with a partner who has no row for now. */
typedef struct travelling_contact {
    int64_t first, second;
    saved_contact c;
} travelling_contact;

typedef struct travelling_entry {
    int64_t particle;
    wall_entry e;
} travelling_entry;

/* A growing array of records. */
typedef struct heap {
    size_t n, capacity, size;
    char *data;
} heap;

typedef struct known {
    int64_t id;
    uint32_t row;
} known;

typedef struct moving {
    dem_sim *sim;
    size_t n_before; /* particles that were here */
    int *owner;      /* [n] of the particles that were here */
    uint32_t *place; /* [n] where they are now, UINT32_MAX: gone */
    uint32_t *order; /* [n] those who stay */
    size_t stride;   /* bytes of a particle on its way */
    heap foreign;    /* travelling_contact: kept here, between rows that are looked for by id */
    heap contacts, entries, to_contact, to_entry; /* that leave, and where to */
    parcel in_particles, in_contacts, in_entries;
    known *known; /* [n_known] those who came and ghosts, by id */
    size_t n_known;
} moving;

/* Room for one more record, or NULL. */
static void *grow(heap *h, size_t size)
{
    h->size = size;
    if (h->n == h->capacity) {
        const size_t room = 2 * h->n + 64;
        char *grown = realloc(h->data, room * size);
        if (!grown) return NULL;
        h->data = grown;
        h->capacity = room;
    }
    return h->data + size * h->n++;
}

static dem_status find_owners(moving *m)
{
    const particles *p = &m->sim->particles;
    m->owner = malloc((p->n + 1) * sizeof *m->owner);
    m->place = malloc((p->n + 1) * sizeof *m->place);
    m->order = malloc((p->n + 1) * sizeof *m->order);
    if (!m->owner || !m->place || !m->order) return no_memory(m->sim);
    const domain *d = &m->sim->domain;
    for (size_t i = 0; i < p->n; i++) {
        const double *x = p->pos[i];
        int inside = 1;
        for (int a = 0; a < 3; a++) inside &= x[a] > d->lo[a] && x[a] < d->hi[a];
        m->owner[i] = inside ? m->sim->rank : domain_owner(m->sim, x);
    }
    return DEM_OK;
}

/* ---- what leaves ----------------------------------------------------------------------------- */

static int leaves(const moving *m, uint32_t i)
{
    return i < m->sim->particles.n && m->owner[i] != m->sim->rank;
}

static dem_status send_contact(moving *m, const travelling_contact *c, int rank)
{
    travelling_contact *out = grow(&m->contacts, sizeof *out);
    int *to = grow(&m->to_contact, sizeof *to);
    if (!out || !to) return no_memory(m->sim);
    *out = *c;
    *to = rank;
    return DEM_OK;
}

/* Contacts whose partners do not both stay: a copy to the new owners, and one that is kept. */
static dem_status part_contacts(moving *m)
{
    const particles *p = &m->sim->particles;
    contacts *c = &m->sim->contacts;
    dem_status status = DEM_OK;
    size_t kept = 0;
    for (size_t k = 0; k < c->n && !status; k++) {
        const uint32_t i = c->pair[k][0], j = c->pair[k][1];
        if (i < p->n && j < p->n && !leaves(m, i) && !leaves(m, j)) {
            contacts_move(c, kept++, k);
            continue;
        }
        travelling_contact t;
        memset(&t, 0, sizeof t);
        t.first = p->id[i];
        t.second = p->id[j];
        t.c = contacts_get(c, k);
        if (leaves(m, i)) status = send_contact(m, &t, m->owner[i]);
        if (!status && leaves(m, j) && !(leaves(m, i) && m->owner[i] == m->owner[j]))
            status = send_contact(m, &t, m->owner[j]);
        travelling_contact *own = grow(&m->foreign, sizeof *own);
        if (!own) return no_memory(m->sim);
        *own = t;
    }
    c->n = kept;
    return status;
}

static dem_status part_entries(moving *m)
{
    const walls *w = &m->sim->walls;
    for (size_t k = 0; k < w->n_entry; k++) {
        const wall_entry *e = &w->entry[k];
        if (!e->touch || !leaves(m, e->particle)) continue;
        travelling_entry *out = grow(&m->entries, sizeof *out);
        int *to = grow(&m->to_entry, sizeof *to);
        if (!out || !to) return no_memory(m->sim);
        memset(out, 0, sizeof *out);
        out->particle = m->sim->particles.id[e->particle];
        out->e = *e;
        *to = m->owner[e->particle];
    }
    return DEM_OK;
}

static size_t stride_of(const particles *p)
{
    size_t bytes = 0;
    for (const field *f = p->field; f < p->field + p->n_field; f++) bytes += f->stays ? 0 : f->size;
    return bytes;
}

/* The fields of a row to `data`, or from there. */
static void copy_row(particles *p, size_t i, char *data, int to_store)
{
    for (const field *f = p->field; f < p->field + p->n_field; f++) {
        char *row = (char *)(f->slot ? *f->slot : f->data) + i * f->size;
        if (f->stays) {
            if (to_store) memset(row, 0, f->size);
            continue;
        }
        memcpy(to_store ? row : data, to_store ? data : row, f->size);
        data += f->size;
    }
}

/* Records in the order of their ranks, and sent. */
static dem_status send_by_rank(moving *m, dem_status status, const heap *records, const int *to,
                               size_t size, parcel *in)
{
    size_t *first = NULL, *place = NULL;
    char *out = malloc(records->n * size + 1);
    if (!status) status = order_by_rank(m->sim, records->n, to, &first, &place);
    if (!status && !out) status = no_memory(m->sim);
    for (size_t k = 0; k < records->n && !status; k++)
        memcpy(out + size * place[k], records->data + size * k, size);
    status = send_blocks(m->sim, status, first, out, size, in);
    free(first), free(place), free(out);
    return status;
}

static dem_status send_particles(moving *m, dem_status status)
{
    particles *p = &m->sim->particles;
    heap out = {0}, to = {0};
    m->stride = stride_of(p);
    for (size_t i = 0; i < p->n && !status; i++) {
        if (m->owner[i] == m->sim->rank) continue;
        char *data = grow(&out, m->stride);
        int *rank = grow(&to, sizeof *rank);
        if (!data || !rank) {
            status = no_memory(m->sim);
            break;
        }
        copy_row(p, i, data, 0);
        *rank = m->owner[i];
    }
    const int *ranks = (const int *)(const void *)to.data;
    status = send_by_rank(m, status, &out, ranks, m->stride, &m->in_particles);
    free(out.data);
    free(to.data);
    return status;
}

/* ---- what stays and comes -------------------------------------------------------------------- */

static dem_status close_ranks(moving *m)
{
    dem_sim *sim = m->sim;
    particles *p = &sim->particles;
    size_t kept = 0;
    for (size_t i = 0; i < p->n; i++) {
        m->place[i] = m->owner[i] == sim->rank ? (uint32_t)kept : UINT32_MAX;
        if (m->owner[i] == sim->rank) m->order[kept++] = (uint32_t)i;
    }
    contacts_renumber(&sim->contacts, m->place);
    walls_renumber(&sim->walls, m->place);
    p->n_ghost = 0;
    if (kept < p->n && particles_keep(p, m->order, kept)) return no_memory(sim);
    const parcel *in = &m->in_particles;
    if (particles_reserve(p, p->n + in->n)) return no_memory(sim);
    for (size_t k = 0; k < in->n; k++) copy_row(p, p->n++, (char *)in->data + k * m->stride, 1);
    if (in->n) p->revision++;
    return DEM_OK;
}

/* ---- histories ------------------------------------------------------------------------------- */

static int by_id(const void *a, const void *b)
{
    const int64_t x = ((const known *)a)->id, y = ((const known *)b)->id;
    return (x > y) - (x < y);
}

static dem_status learn(moving *m)
{
    const particles *p = &m->sim->particles;
    const size_t begin = p->n - m->in_particles.n, end = p->n + p->n_ghost;
    m->n_known = end - begin;
    m->known = malloc((m->n_known + 1) * sizeof *m->known);
    if (!m->known) return no_memory(m->sim);
    for (size_t i = begin; i < end; i++) m->known[i - begin] = (known){p->id[i], (uint32_t)i};
    qsort(m->known, m->n_known, sizeof *m->known, by_id);
    return DEM_OK;
}

/* The row of one who came or of a ghost, or UINT32_MAX. */
static uint32_t row_of(const moving *m, int64_t id)
{
    const known key = {id, 0};
    const known *k = bsearch(&key, m->known, m->n_known, sizeof key, by_id);
    return k ? k->row : UINT32_MAX;
}

static dem_status keep_contact(moving *m, const travelling_contact *t, uint32_t i, uint32_t j)
{
    if (i == UINT32_MAX || j == UINT32_MAX) return DEM_OK;
    saved_contact s = t->c;
    s.i = i;
    s.j = j;
    return contacts_append(&m->sim->contacts, &s) ? no_memory(m->sim) : DEM_OK;
}

static int by_pair(const void *a, const void *b)
{
    const travelling_contact *x = a, *y = b;
    if (x->first != y->first) return x->first < y->first ? -1 : 1;
    return (x->second > y->second) - (x->second < y->second);
}

static dem_status find_histories(moving *m)
{
    dem_status status = DEM_OK;
    const travelling_contact *own = (const travelling_contact *)(const void *)m->foreign.data;
    const size_t n = m->sim->particles.n - m->in_particles.n; /* those who stayed */
    for (size_t k = 0; k < m->foreign.n && !status; k++) {
        uint32_t row[2];
        const uint32_t before[2] = {own[k].c.i, own[k].c.j};
        const int64_t id[2] = {own[k].first, own[k].second};
        for (int s = 0; s < 2; s++) {
            const uint32_t stayed = before[s] < m->n_before ? m->place[before[s]] : UINT32_MAX;
            row[s] = stayed != UINT32_MAX ? stayed : row_of(m, id[s]);
        }
        /* Of two ghosts: a pair that others look after. */
        if (row[0] < n || row[1] < n) status = keep_contact(m, &own[k], row[0], row[1]);
    }
    /* Two partners that came from different ranks have each brought it. */
    travelling_contact *came = m->in_contacts.data;
    if (m->in_contacts.n) qsort(came, m->in_contacts.n, sizeof *came, by_pair);
    for (size_t k = 0; k < m->in_contacts.n && !status; k++)
        if (k == 0 || by_pair(&came[k], &came[k - 1]) != 0)
            status = keep_contact(m, &came[k], row_of(m, came[k].first), row_of(m, came[k].second));
    const travelling_entry *entry = m->in_entries.data;
    for (size_t k = 0; k < m->in_entries.n && !status; k++) {
        wall_entry e = entry[k].e;
        e.particle = row_of(m, entry[k].particle);
        status = walls_append(&m->sim->walls, &e) ? no_memory(m->sim) : DEM_OK;
    }
    return status;
}

dem_status migrate(dem_sim *sim, double reach)
{
    moving m = {.sim = sim, .n_before = sim->particles.n};
    dem_status status = find_owners(&m);
    if (!status) status = part_contacts(&m);
    if (!status) status = part_entries(&m);
    status = send_particles(&m, status);
    if (!status)
        status = send_by_rank(&m, DEM_OK, &m.contacts, (const int *)(const void *)m.to_contact.data,
                              sizeof(travelling_contact), &m.in_contacts);
    if (!status)
        status = send_by_rank(&m, DEM_OK, &m.entries, (const int *)(const void *)m.to_entry.data,
                              sizeof(travelling_entry), &m.in_entries);
    if (!status) status = agree(sim, close_ranks(&m));
    if (!status) status = halo_make(sim, reach);
    if (!status) status = learn(&m);
    if (!status) status = find_histories(&m);
    status = agree(sim, status);
    free(m.owner), free(m.place), free(m.order), free(m.known);
    free(m.foreign.data), free(m.contacts.data), free(m.entries.data);
    free(m.to_contact.data), free(m.to_entry.data);
    parcel_free(&m.in_particles), parcel_free(&m.in_contacts), parcel_free(&m.in_entries);
    return status;
}
