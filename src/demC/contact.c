/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * contact.c - history of touching pairs, carried over rebuilds and sorting.
 *
 * Matching goes through the permutation of the sort: the pair (i, j) becomes (place[i], place[j]);
 * then looked up in its row. Where the order of the rows within a pair swaps, the springs, force
 * and torque on the first of the two, change sign. Then the springs are put in the order of the new
 * list, each swapped to its place.
 */
#include "contact.h"

#include "memory.h"

#include <stdlib.h>
#include <string.h>

void contacts_free(contacts *c)
{
    free(c->spring);
    free(c->rolling);
    free(c->touch);
    free(c->pair);
    free(c->before);
    memset(c, 0, sizeof *c);
}

/* ---- the ring -------------------------------------------------------------------------------- */

/* n springs of a ring of the size `size`, from `begin` on, to the place `at` of one that is wide
 * enough to have them in a row. */
static void unroll(double (*to)[4], size_t at, const double (*from)[4], size_t size, size_t begin,
                   size_t n)
{
    if (!n) return;
    if (begin >= size) begin -= size;
    const size_t front = n < size - begin ? n : size - begin;
    memcpy(to + at, from + begin, front * sizeof *to);
    if (n > front) memcpy(to + at + front, from, (n - front) * sizeof *to);
}

/* A ring of `size`, with the springs `read` and following of the old one behind `gap` places, and
 * the `written` ones that are at `to` in front. */
static dem_status replace(contacts *c, double (**ring)[4], size_t size, size_t gap, size_t read,
                          size_t written, size_t to)
{
    void *fresh = room_for(size * sizeof **ring);
    if (!fresh) return DEM_NO_MEMORY;
    unroll(fresh, 0, (const double(*)[4]) * ring, c->size, to, written);
    unroll(fresh, gap + read, (const double(*)[4]) * ring, c->size, c->begin + read, c->n - read);
    free(*ring);
    *ring = fresh;
    return DEM_OK;
}

static dem_status relay(contacts *c, size_t size, size_t gap, size_t read, size_t written,
                        size_t to)
{
    dem_status status = replace(c, &c->spring, size, gap, read, written, to);
    if (!status && c->rolls) status = replace(c, &c->rolling, size, gap, read, written, to);
    if (status) { /* the two may differ: what they hold is lost, as the run is */
        c->n = c->size = c->begin = 0;
        return status;
    }
    c->size = size;
    c->begin = gap;
    return DEM_OK;
}

/* Room for n contacts and a little, and not for many more. */
static dem_status fit(contacts *c, size_t n)
{
    c->gap = 1024 + n / 256;
    if (c->size >= n + c->gap && c->size < 2 * (n + c->gap)) return DEM_OK;
    return relay(c, n + n / 16 + c->gap, 0, 0, 0, 0);
}

/* ---- for the sum of forces ------------------------------------------------------------------- */

static void look_at_ring(contact_stream *s)
{
    s->spring = s->c->spring;
    s->rolling = s->c->rolling;
    s->size = s->c->size;
    s->begin = s->c->begin;
}

contact_stream contacts_open(contacts *c)
{
    contact_stream s = {.c = c};
    const size_t room = c->size - c->n;
    look_at_ring(&s);
    s.gap = c->gap < room ? c->gap : room;
    s.to = s.begin >= s.gap ? s.begin - s.gap : s.begin + s.size - s.gap;
    return s;
}

int contacts_widen(contact_stream *s, size_t more)
{
    contacts *c = s->c;
    const size_t ahead = s->written + more - s->read, half = c->n / 8 + 1024;
    const size_t gap = ahead + (ahead < half ? ahead : half) + s->written / 8 + 1024;
    if (relay(c, c->n + gap, gap, s->read, s->written, s->to)) return s->failed = 1;
    c->gap = s->gap = gap;
    s->to = 0;
    look_at_ring(s);
    return 0;
}

dem_status contacts_close(contact_stream *s, const neighbour *list)
{
    contacts *c = s->c;
    if (s->failed) {
        memset(c->touch, 0, list->row[list->n_row]);
        return DEM_NO_MEMORY;
    }
    c->n = s->written;
    c->begin = s->to;
    return DEM_OK;
}

/* ---- across a rebuild ------------------------------------------------------------------------ */

static int grow(void *slot, size_t bytes)
{
    void *grown = realloc(*(void **)slot, bytes ? bytes : 1);
    if (!grown) return 0;
    *(void **)slot = grown;
    return 1;
}

static dem_status reserve_pairs(contacts *c, size_t n)
{
    if (n <= c->pairs) return DEM_OK;
    const size_t room = n + n / 16 + 64;
    if (!grow(&c->pair, room * sizeof *c->pair)) return DEM_NO_MEMORY;
    c->pairs = room;
    return DEM_OK;
}

dem_status contacts_save(contacts *c, const neighbour *list)
{
    if (!list->row || !c->touch) return DEM_OK;
    if (reserve_pairs(c, c->n)) return DEM_NO_MEMORY;
    size_t n = 0;
    for (size_t r = 0; r < list->n_row; r++)
        for (size_t k = list->row[r]; k < list->row[r + 1]; k++) {
            if (!c->touch[k]) continue;
            c->pair[n][0] = neighbour_slot(list, (uint32_t)r);
            c->pair[n++][1] = list->entry[k] & NEIGHBOUR_MASK;
        }
    return DEM_OK;
}

saved_contact contacts_get(const contacts *c, size_t k)
{
    const size_t at = contacts_at(c, k);
    saved_contact s = {.i = c->pair[k][0], .j = c->pair[k][1]};
    memcpy(s.spring, c->spring[at], sizeof s.spring);
    if (c->rolls) memcpy(s.rolling, c->rolling[at], sizeof s.rolling);
    return s;
}

static void put(contacts *c, size_t k, const saved_contact *s)
{
    const size_t at = contacts_at(c, k);
    memcpy(c->spring[at], s->spring, sizeof s->spring);
    if (c->rolls) memcpy(c->rolling[at], s->rolling, sizeof s->rolling);
    c->pair[k][0] = s->i;
    c->pair[k][1] = s->j;
}

void contacts_move(contacts *c, size_t to, size_t from)
{
    if (to == from) return;
    const saved_contact s = contacts_get(c, from);
    put(c, to, &s);
}

dem_status contacts_append(contacts *c, const saved_contact *s)
{
    if (reserve_pairs(c, c->n + 1)) return DEM_NO_MEMORY;
    if (c->n == c->size && relay(c, c->n + c->n / 8 + 1024, 0, 0, 0, 0)) return DEM_NO_MEMORY;
    put(c, c->n++, s);
    return DEM_OK;
}

void contacts_renumber(contacts *c, const uint32_t *place)
{
    size_t kept = 0;
    for (size_t k = 0; k < c->n; k++) {
        const uint32_t i = place[c->pair[k][0]], j = place[c->pair[k][1]];
        if (i == UINT32_MAX || j == UINT32_MAX) continue;
        contacts_move(c, kept, k);
        c->pair[kept][0] = i;
        c->pair[kept++][1] = j;
    }
    c->n = kept;
}

static dem_status reserve(contacts *c, size_t entries, size_t rows)
{
    if (entries > c->entries) {
        const size_t room = entries + entries / 16 + 64;
        free(c->touch);
        c->touch = malloc(room);
        c->entries = c->touch ? room : 0;
        if (!c->touch) return DEM_NO_MEMORY;
    }
    if (rows > c->rows) {
        if (!grow(&c->before, rows * sizeof *c->before)) return DEM_NO_MEMORY;
        c->rows = rows;
    }
    return reserve_pairs(c, c->n);
}

static void turn_about(double spring[4])
{
    for (int a = 0; a < 3; a++) spring[a] = -spring[a];
}

/* Flag the entries of the pairs saved; c->pair is then the row, and the place in it. */
static void find_again(contacts *c, const neighbour *list)
{
    size_t kept = 0;
    for (size_t k = 0; k < c->n; k++) {
        uint32_t i = list->place[c->pair[k][0]], j = list->place[c->pair[k][1]];
        const int swapped = neighbour_row(list, i) > neighbour_row(list, j);
        if (swapped) {
            uint32_t other = i;
            i = j;
            j = other;
        }
        const uint32_t row = neighbour_row(list, i);
        const size_t entry = neighbour_find(list, i, j);
        if (entry == list->row[row + 1] || c->touch[entry]) continue;
        c->touch[entry] = 1;
        contacts_move(c, kept, k);
        if (swapped) turn_about(c->spring[contacts_at(c, kept)]);
        if (swapped && c->rolls) turn_about(c->rolling[contacts_at(c, kept)]);
        c->pair[kept][0] = row;
        c->pair[kept++][1] = (uint32_t)(entry - list->row[row]);
    }
    c->n = kept;
}

/* pair[k][0]: where contact k belongs in the order of the list. */
static void rank(contacts *c, const neighbour *list)
{
    uint32_t n = 0;
    for (size_t r = 0; r < list->n_row; r++) {
        c->before[r] = n;
        for (size_t k = list->row[r]; k < list->row[r + 1]; k++) n += c->touch[k];
    }
    for (size_t k = 0; k < c->n; k++) {
        const uint32_t row = c->pair[k][0];
        const uint8_t *touch = c->touch + list->row[row];
        uint32_t at = c->before[row];
        for (uint32_t e = 0; e < c->pair[k][1]; e++) at += touch[e];
        c->pair[k][0] = at;
    }
}

static void exchange(double a[4], double b[4])
{
    double kept[4];
    memcpy(kept, a, sizeof kept);
    memcpy(a, b, sizeof kept);
    memcpy(b, kept, sizeof kept);
}

static void put_in_order(contacts *c)
{
    for (size_t k = 0; k < c->n; k++)
        while (c->pair[k][0] != k) {
            const uint32_t to = c->pair[k][0];
            const size_t a = contacts_at(c, k), b = contacts_at(c, to);
            exchange(c->spring[a], c->spring[b]);
            if (c->rolls) exchange(c->rolling[a], c->rolling[b]);
            c->pair[k][0] = c->pair[to][0];
            c->pair[to][0] = to;
        }
}

dem_status contacts_restore(contacts *c, const neighbour *list)
{
    const size_t entries = list->row[list->n_row];
    dem_status status = reserve(c, entries, list->n_row);
    if (status) return status;
    if (entries) memset(c->touch, 0, entries);
    find_again(c, list);
    rank(c, list);
    put_in_order(c);
    return fit(c, c->n);
}
