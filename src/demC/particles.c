/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * particles.c - the store of particles: add, remove, grow, sort, attached columns.
 *
 * Arrays grow by half, large ones by an eighth. Memory is first touched where particles are, so
 * that room to spare costs addresses only. Sorting gathers each field through the array of forces,
 * in slices that fit its width; it happens only when the neighbour list is rebuilt, when forces are
 * zero. What is published is made anew at the end of dem_advance: it stays where it is.
 */
#include "particles.h"

#include "memory.h"

#include "periodic.h"

#include <stdlib.h>
#include <string.h>

#define SLICE sizeof(double[8]) /* of a row: no wider than the force */

static void **address(field *f)
{
    return f->slot ? f->slot : &f->data;
}

static int enter(particles *p, void **slot, size_t size, const char *name)
{
    field *grown = realloc(p->field, (p->n_field + 1) * sizeof *grown);
    if (!grown) return -1;
    p->field = grown;
    field *f = &p->field[p->n_field];
    memset(f, 0, sizeof *f);
    f->slot = slot;
    f->size = size;
    strncpy(f->name, name, DEM_NAME - 1);
    void *data = room_for(p->capacity * size);
    if (!data) return -1;
    memset(data, 0, p->n * size);
    *address(f) = data;
    return (int)p->n_field++;
}

dem_status particles_init(particles *p)
{
    memset(p, 0, sizeof *p);
    const struct {
        void **slot;
        size_t size;
        const char *name;
        int stays, ghosts;
    } table[] = {{(void **)&p->pos, sizeof *p->pos, "pos", 0, 1},
                 {(void **)&p->vel, sizeof *p->vel, "vel", 0, 1},
                 {(void **)&p->force, sizeof *p->force, "force", 1, 1},
                 {(void **)&p->built, sizeof *p->built, "built", 1, 0},
                 {(void **)&p->id, sizeof *p->id, "id", 0, 1},
                 {(void **)&p->radius, sizeof *p->radius, "radius", 0, 0},
                 {(void **)&p->mass, sizeof *p->mass, "mass", 0, 0},
                 {(void **)&p->material, sizeof *p->material, "material", 0, 1},
                 {(void **)&p->x, sizeof *p->x, "x", 1, 0},
                 {(void **)&p->v, sizeof *p->v, "v", 1, 0},
                 {(void **)&p->omega, sizeof *p->omega, "omega", 1, 0},
                 {(void **)&p->last, sizeof *p->last, "last", 0, 0},
                 {(void **)&p->impulse, sizeof *p->impulse, "impulse", 0, 0}};
    for (size_t f = 0; f < sizeof table / sizeof *table; f++) {
        if (enter(p, table[f].slot, table[f].size, table[f].name) < 0) return DEM_NO_MEMORY;
        p->field[f].stays = table[f].stays;
        p->field[f].ghosts = table[f].ghosts;
    }
    p->n_fixed = p->n_field;
    return DEM_OK;
}

void particles_free(particles *p)
{
    for (size_t f = 0; f < p->n_field; f++) {
        free(*address(&p->field[f]));
        free(p->field[f].removed);
    }
    free(p->field);
    memset(p, 0, sizeof *p);
}

dem_status particles_reserve(particles *p, size_t capacity)
{
    if (capacity <= p->capacity) return DEM_OK;
    const size_t more = p->capacity / (p->capacity < 100000 ? 2 : 8);
    if (capacity < p->capacity + more) capacity = p->capacity + more;
    for (size_t f = 0; f < p->n_field; f++) {
        void **slot = address(&p->field[f]);
        void *data = room_for(capacity * p->field[f].size);
        /* Fields already grown merely have room to spare. */
        if (!data) return DEM_NO_MEMORY;
        const size_t n = p->field[f].ghosts ? p->n + p->n_ghost : p->n;
        if (n) memcpy(data, *slot, n * p->field[f].size);
        free(*slot);
        *slot = data;
    }
    p->capacity = capacity;
    return DEM_OK;
}

dem_status particles_open_outside(particles *p)
{
    if (p->outside) return DEM_OK;
    if (enter(p, (void **)&p->outside, sizeof *p->outside, "outside") < 0) return DEM_NO_MEMORY;
    /* In front of the columns, whose handles count from there. */
    const field f = p->field[p->n_field - 1];
    memmove(p->field + p->n_fixed + 1, p->field + p->n_fixed,
            (p->n_field - 1 - p->n_fixed) * sizeof f);
    p->field[p->n_fixed++] = f;
    return DEM_OK;
}

/* `wide` bytes of n rows of the size `size`, in the new order. */
static inline __attribute__((always_inline)) void
gather(char *to, const char *from, const uint32_t *order, size_t n, size_t size, size_t wide)
{
    for (size_t i = 0; i < n; i++) memcpy(to + wide * i, from + size * order[i], wide);
}

static void permute(char *data, char *room, const uint32_t *order, size_t n, size_t size)
{
    /* The common sizes get a loop of their own, so that the copy is a few moves. */
    if (size == 8)
        gather(room, data, order, n, 8, 8);
    else if (size == 24)
        gather(room, data, order, n, 24, 24);
    else if (size == 32)
        gather(room, data, order, n, 32, 32);
    else if (size == 64)
        gather(room, data, order, n, 64, 64);
    if (size == 8 || size == 24 || size == 32 || size == 64) {
        memcpy(data, room, n * size);
        return;
    }
    for (size_t at = 0; at < size; at += SLICE) {
        const size_t wide = size - at < SLICE ? size - at : SLICE;
        gather(room, data + at, order, n, size, wide);
        for (size_t i = 0; i < n; i++) memcpy(data + at + size * i, room + wide * i, wide);
    }
}

dem_status particles_permute(particles *p, const uint32_t *order)
{
    const size_t all = p->n + p->n_ghost;
    for (const field *f = p->field; f < p->field + p->n_field; f++)
        if (!f->stays)
            permute(f->slot ? *f->slot : f->data, (char *)p->force, order, f->ghosts ? all : p->n,
                    f->size);
    if (all) memset(p->force, 0, all * sizeof *p->force);
    p->revision++;
    return DEM_OK;
}

dem_status particles_keep(particles *p, const uint32_t *order, size_t n)
{
    p->n = n;
    return particles_permute(p, order);
}

void particles_push_ghosts(particles *p, size_t n)
{
    for (size_t f = 0; f < p->n_field; f++) {
        const size_t size = p->field[f].size;
        char *data = *address(&p->field[f]);
        if (p->field[f].ghosts)
            memmove(data + (p->n + n) * size, data + p->n * size, p->n_ghost * size);
    }
}

int particles_attach(particles *p, const char *name, int width)
{
    for (size_t k = p->n_fixed; k < p->n_field; k++) {
        field *f = &p->field[k];
        if (f->restored != 1 || strncmp(f->name, name, DEM_NAME - 1) != 0) continue;
        if (f->size != (size_t)width * sizeof(double)) return -1;
        f->restored = 2;
        return (int)(k - p->n_fixed);
    }
    double *removed = calloc((size_t)width, sizeof *removed);
    int f = removed ? enter(p, NULL, (size_t)width * sizeof(double), name) : -1;
    if (f < 0) {
        free(removed);
        return -1;
    }
    p->field[f].removed = removed;
    return f - (int)p->n_fixed;
}

void particles_detach(particles *p, int handle)
{
    field *f = &p->field[p->n_fixed + (size_t)handle];
    if (f->restored) {
        f->restored = 1;
        return;
    }
    free(f->data);
    free(f->removed);
    p->n_field--;
}

void particles_clear_removed(particles *p)
{
    for (size_t f = p->n_fixed; f < p->n_field; f++)
        memset(p->field[f].removed, 0, p->field[f].size);
}

void particles_count_removed(particles *p, size_t i)
{
    for (field *f = p->field + p->n_fixed; f < p->field + p->n_field; f++) {
        size_t width = f->size / sizeof(double);
        const double *row = (const double *)f->data + i * width;
        for (size_t c = 0; c < width; c++) f->removed[c] += row[c];
    }
}

double *particles_column(particles *p, int handle)
{
    size_t f = p->n_fixed + (size_t)handle;
    return handle < 0 || f >= p->n_field ? NULL : p->field[f].data;
}

void particles_append(particles *p, const double x[3], const double v[3], const double omega[3],
                      double radius, double mass, int material, int64_t id)
{
    size_t i = p->n++;
    for (size_t f = 0; f < p->n_field; f++)
        memset((char *)*address(&p->field[f]) + i * p->field[f].size, 0, p->field[f].size);
    for (int a = 0; a < 3; a++) {
        p->pos[i][a] = x[a];
        p->vel[i][a] = v ? v[a] : 0;
        p->vel[i][4 + a] = omega ? omega[a] : 0;
    }
    p->pos[i][3] = radius;
    p->vel[i][3] = 1 / mass;
    p->vel[i][7] = 1 / (.4 * mass * radius * radius);
    p->radius[i] = radius;
    p->mass[i] = mass;
    p->material[i] = material;
    p->id[i] = id;
    if (id >= p->next_id) p->next_id = id + 1;
    p->revision++;
}

void particles_publish(particles *p, const double lo[3], const double hi[3], const int periodic[3])
{
    for (size_t i = 0; i < p->n; i++)
        for (int a = 0; a < 3; a++) {
            const double x = p->pos[i][a];
            /* Between rebuilds a particle may be a little beyond a periodic side. */
            p->x[i][a] = periodic[a] ? wrap_along(x, lo[a], hi[a]) : x;
            p->v[i][a] = p->vel[i][a];
            p->omega[i][a] = p->vel[i][4 + a];
        }
}
