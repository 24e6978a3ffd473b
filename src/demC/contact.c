/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * contact.c - history of touching pairs, carried over rebuilds and sorting.
 *
 * Matching goes through the permutation of the sort: the pair (i, j) becomes (place[i], place[j]);
 * then looked up in its row. Where the order of the rows within a pair swaps, the springs, force
 * and torque on the first of the two, change sign.
 */
#include "contact.h"

#include <stdlib.h>
#include <string.h>

void contacts_free(contacts *c)
{
    free(c->spring);
    free(c->rolling);
    free(c->touch);
    free(c->saved);
    memset(c, 0, sizeof *c);
}

dem_status contacts_save(contacts *c, const neighbour *list)
{
    c->n_saved = 0;
    if (!list->row || !c->touch) return DEM_OK;
    size_t touching = 0;
    for (size_t k = 0; k < list->row[list->n_row]; k++) touching += c->touch[k];
    if (touching > c->saved_capacity) {
        size_t room = touching + touching / 2;
        saved_contact *grown = realloc(c->saved, room * sizeof *grown);
        if (!grown) return DEM_NO_MEMORY;
        c->saved = grown;
        c->saved_capacity = room;
    }
    for (size_t r = 0; r < list->n_row; r++)
        for (size_t k = list->row[r]; k < list->row[r + 1]; k++) {
            if (!c->touch[k]) continue;
            saved_contact *s = &c->saved[c->n_saved++];
            memcpy(s->spring, c->spring[k], sizeof s->spring);
            if (c->rolls) memcpy(s->rolling, c->rolling[k], sizeof s->rolling);
            s->i = neighbour_slot(list, (uint32_t)r);
            s->j = list->entry[k] & NEIGHBOUR_MASK;
        }
    return DEM_OK;
}

static dem_status reserve(contacts *c, size_t entries)
{
    if (entries <= c->capacity) return DEM_OK;
    size_t room = entries + entries / 4;
    void *spring = NULL;
    free(c->spring);
    free(c->rolling);
    free(c->touch);
    c->spring = c->rolling = NULL;
    c->capacity = 0;
    c->touch = malloc(room);
    if (!c->touch || posix_memalign(&spring, 64, room * sizeof *c->spring)) return DEM_NO_MEMORY;
    c->spring = spring;
    if (c->rolls && !(c->rolling = malloc(room * sizeof *c->rolling))) return DEM_NO_MEMORY;
    c->capacity = room;
    return DEM_OK;
}

dem_status contacts_append(contacts *c, const saved_contact *s)
{
    if (c->n_saved == c->saved_capacity) {
        size_t room = c->n_saved + c->n_saved / 8 + 64;
        saved_contact *grown = realloc(c->saved, room * sizeof *grown);
        if (!grown) return DEM_NO_MEMORY;
        c->saved = grown;
        c->saved_capacity = room;
    }
    c->saved[c->n_saved++] = *s;
    return DEM_OK;
}

void contacts_renumber(contacts *c, const uint32_t *place)
{
    size_t kept = 0;
    for (size_t s = 0; s < c->n_saved; s++) {
        saved_contact old = c->saved[s];
        old.i = place[old.i];
        old.j = place[old.j];
        if (old.i != UINT32_MAX && old.j != UINT32_MAX) c->saved[kept++] = old;
    }
    c->n_saved = kept;
}

dem_status contacts_restore(contacts *c, const neighbour *list)
{
    size_t entries = list->row[list->n_row];
    dem_status status = reserve(c, entries);
    if (status) return status;
    if (entries) {
        /* Springs without the flag are never read as such, but are multiplied by it. */
        memset(c->touch, 0, entries);
        memset(c->spring, 0, entries * sizeof *c->spring);
        if (c->rolls) memset(c->rolling, 0, entries * sizeof *c->rolling);
    }
    for (size_t s = 0; s < c->n_saved; s++) {
        const saved_contact *old = &c->saved[s];
        uint32_t i = list->place[old->i], j = list->place[old->j];
        double sign = 1;
        if (neighbour_row(list, i) > neighbour_row(list, j)) {
            uint32_t swap = i;
            i = j;
            j = swap;
            sign = -1;
        }
        size_t k = neighbour_find(list, i, j);
        if (k == list->row[neighbour_row(list, i) + 1]) continue;
        for (int a = 0; a < 4; a++) {
            double turn = a < 3 ? sign : 1;
            c->spring[k][a] = turn * old->spring[a];
            if (c->rolls) c->rolling[k][a] = turn * old->rolling[a];
        }
        c->touch[k] = 1;
    }
    return DEM_OK;
}
