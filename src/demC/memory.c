/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * memory.c - room for the large arrays, and what the arrays of a simulation take, by purpose.
 *
 * The loop over pairs looks at particles that are some layers apart, each on pages of its own. Of
 * small pages these are more than the processor can keep the addresses of; so large arrays ask for
 * large pages, as far as they fill them.
 *
 * Counted is what is in use, not the room to spare behind it, which is hardly ever touched and so
 * takes addresses but no memory (particles.c).
 */
#include "memory.h"

#include "dem_internal.h"

#include <stdlib.h>
#include <sys/mman.h>

#define LINE 64
#define PAGE ((size_t)1 << 21)

void *room_for(size_t bytes)
{
    void *data = NULL;
    if (posix_memalign(&data, bytes >= PAGE ? PAGE : LINE, bytes ? bytes : LINE)) return NULL;
#ifdef MADV_HUGEPAGE
    /* A wish: where it is not granted the array is there all the same. */
    if (bytes >= PAGE) madvise(data, bytes / PAGE * PAGE, MADV_HUGEPAGE);
#endif
    return data;
}

static size_t of_list(const neighbour *l, size_t n)
{
    const size_t entries = l->row ? l->row[l->n_row] : 0;
    size_t bytes = (l->grid.n + 1) * sizeof *l->cell_first + entries * sizeof *l->entry +
                   n * (sizeof *l->cell + sizeof *l->order + sizeof *l->place) +
                   (l->n_row + 1) * sizeof *l->row;
    if (l->shared)
        bytes +=
            l->n_row * (sizeof *l->slot + sizeof *l->row_of + sizeof *l->sorted + sizeof *l->own);
    return bytes + l->pair_capacity * sizeof *l->pair;
}

static size_t of_contacts(const contacts *c, const neighbour *l)
{
    const size_t entries = l->row ? l->row[l->n_row] : 0;
    const size_t spring = sizeof *c->spring + (c->rolls ? sizeof *c->rolling : 0);
    return entries * sizeof *c->touch + c->size * spring + c->pairs * sizeof *c->pair +
           c->rows * sizeof *c->before;
}

dem_memory dem_memory_used(const dem_sim *sim)
{
    const particles *p = &sim->particles;
    const balance *b = &sim->balance;
    const size_t rows = p->n + p->n_ghost;
    dem_memory m = {.contacts = of_contacts(&sim->contacts, &sim->list),
                    .neighbours = of_list(&sim->list, rows)};
    for (size_t k = 0; k < p->n_field; k++) {
        const field *f = &p->field[k];
        const size_t bytes = f->size * (f->ghosts ? rows : p->n);
        *(k < p->n_fixed ? &m.particles : &m.columns) += bytes;
    }
    if (b->capacity)
        m.balance =
            rows * (sizeof *b->damped + sizeof *b->slid + sizeof *b->rolled + sizeof *b->before);
    m.walls = (sim->walls.n_entry + sim->walls.n_before) * sizeof *sim->walls.entry;
    for (size_t k = 0; k < sim->walls.n; k++) m.shapes += dem_sdf_memory(sim->walls.wall[k].shape);
    m.all = m.particles + m.columns + m.neighbours + m.contacts + m.balance + m.walls + m.shapes;
    return m;
}
