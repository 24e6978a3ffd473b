/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * particles.c - the store of particles: add, remove, grow, sort, attached columns.
 *
 * Arrays are aligned to 64 bytes and grow by half. Sorting gathers each field through a scratch
 * array; it happens only when the neighbour list is rebuilt. Forces are zero then, and what is
 * published is made anew at the end of dem_advance: they stay where they are.
 */
#include "particles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ALIGNMENT 64

static void **address(field *f)
{
    return f->slot ? f->slot : &f->data;
}

static void *aligned_zero(size_t size)
{
    void *data = NULL;
    if (posix_memalign(&data, ALIGNMENT, size ? size : ALIGNMENT)) return NULL;
    memset(data, 0, size);
    return data;
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
    void *data = aligned_zero(p->capacity * size);
    if (!data) return -1;
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
                 {(void **)&p->outside, sizeof *p->outside, "outside", 0, 0},
                 {(void **)&p->gain, sizeof *p->gain, "gain", 0, 0},
                 {(void **)&p->built, sizeof *p->built, "built", 1, 0},
                 {(void **)&p->id, sizeof *p->id, "id", 0, 1},
                 {(void **)&p->radius, sizeof *p->radius, "radius", 0, 0},
                 {(void **)&p->mass, sizeof *p->mass, "mass", 0, 0},
                 {(void **)&p->material, sizeof *p->material, "material", 0, 1},
                 {(void **)&p->x, sizeof *p->x, "x", 1, 0},
                 {(void **)&p->v, sizeof *p->v, "v", 1, 0},
                 {(void **)&p->omega, sizeof *p->omega, "omega", 1, 0},
                 {(void **)&p->last, sizeof *p->last, "last", 0, 0},
                 {(void **)&p->impulse, sizeof *p->impulse, "impulse", 1, 0}};
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
    free(p->scratch);
    memset(p, 0, sizeof *p);
}

dem_status particles_reserve(particles *p, size_t capacity)
{
    if (capacity <= p->capacity) return DEM_OK;
    if (capacity < p->capacity + p->capacity / 2) capacity = p->capacity + p->capacity / 2;
    for (size_t f = 0; f < p->n_field; f++) {
        void **slot = address(&p->field[f]);
        void *data = aligned_zero(capacity * p->field[f].size);
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

static void gather(void *to, const void *from, const uint32_t *order, size_t n, size_t size)
{
    /* The common sizes get a loop of their own, so that the copy is a few moves. */
    if (size == 8)
        for (size_t i = 0; i < n; i++)
            memcpy((char *)to + 8 * i, (const char *)from + 8 * (size_t)order[i], 8);
    else if (size == 32)
        for (size_t i = 0; i < n; i++)
            memcpy((char *)to + 32 * i, (const char *)from + 32 * (size_t)order[i], 32);
    else if (size == 64)
        for (size_t i = 0; i < n; i++)
            memcpy((char *)to + 64 * i, (const char *)from + 64 * (size_t)order[i], 64);
    else
        for (size_t i = 0; i < n; i++)
            memcpy((char *)to + size * i, (const char *)from + size * (size_t)order[i], size);
}

dem_status particles_permute(particles *p, const uint32_t *order)
{
    size_t widest = 0;
    for (size_t f = 0; f < p->n_field; f++)
        if (p->field[f].size > widest) widest = p->field[f].size;
    if (p->scratch_size < p->capacity * widest) {
        free(p->scratch);
        p->scratch_size = p->capacity * widest;
        p->scratch = malloc(p->scratch_size);
        if (!p->scratch) {
            p->scratch_size = 0;
            return DEM_NO_MEMORY;
        }
    }
    for (size_t f = 0; f < p->n_field; f++) {
        void *data = *address(&p->field[f]);
        const size_t size = p->field[f].size, n = p->field[f].ghosts ? p->n + p->n_ghost : p->n;
        if (p->field[f].stays) continue;
        gather(p->scratch, data, order, n, size);
        memcpy(data, p->scratch, n * size);
    }
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
            double x = p->pos[i][a];
            /* Between rebuilds a particle may be a little beyond a periodic side. */
            if (periodic[a]) x -= floor((x - lo[a]) / (hi[a] - lo[a])) * (hi[a] - lo[a]);
            p->x[i][a] = x;
            p->v[i][a] = p->vel[i][a];
            p->omega[i][a] = p->vel[i][4 + a];
            p->impulse[i][a] = p->gain[i][a];
        }
}
