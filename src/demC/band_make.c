/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * band_make.c - signed distances of a surface, sampled in a narrow band about it: making.
 *
 * Triangles are cut at their longest edges until they are of the size of a brick, and every brick
 * that a piece comes close to is noted in a hash set, so that the work grows with area and not with
 * volume. Of those the bricks are kept whose centre is near enough for some point of them to be
 * within the width. Then each node gets its distance by a search that starts at the triangle found
 * for the node before in its brick. The bricks are sorted, and what they hold depends on nothing
 * but surface, spacing and width.
 *
 * Several ranks divide each of these: triangles by their area, then the bricks to be looked at, the
 * bricks to be filled and those whose side is told, by their number. In between they show each
 * other what they found, and in the end all have all.
 */
#include "band.h"

#include "dem_internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What is made of what, and by whom. */
typedef struct making {
    band *band;
    const surface *surface;
    const sdf_progress *progress;
    dem_sim *sim; /* whose ranks share the work, or NULL */
    int rank, ranks;
    char *message; /* of `size` bytes */
    size_t size;
} making;

/* ---- among the ranks --------------------------------------------------------------------------
 */

static dem_status out_of_memory(const making *m)
{
    snprintf(m->message, m->size, "out of memory");
    return DEM_NO_MEMORY;
}

/* As agree(), of the message in `m`. */
static dem_status agreed(const making *m, dem_status status)
{
    if (m->sim == NULL || m->ranks == 1) return status;
    if (status) fail(m->sim, status, "%s", m->message);
    status = agree(m->sim, status);
    if (status) snprintf(m->message, m->size, "%s", m->sim->message);
    return status;
}

/* The rows of all ranks one after the other, in the place of those of this one. */
static dem_status gather_rows(const making *m, dem_status status, void **rows, size_t *n,
                              size_t size)
{
    if (m->sim == NULL || m->ranks == 1) return status;
    status = agreed(m, status);
    if (status) return status;
    parcel all;
    status = share_blocks(m->sim, DEM_OK, *n, *rows, size, &all);
    if (status) {
        snprintf(m->message, m->size, "%s", m->sim->message);
    } else {
        free(*rows);
        *rows = all.data;
        *n = all.n;
        all.data = NULL;
    }
    parcel_free(&all);
    return status;
}

/* ---- places of bricks -------------------------------------------------------------------------
 */

/* Places of bricks, without repetition. */
typedef struct places {
    int32_t (*at)[4]; /* [n] */
    size_t n, room;
    uint32_t *slot; /* [mask + 1], place + 1 */
    size_t mask;
} places;

static size_t hash_of(const int32_t c[4])
{
    uint64_t h = 1469598103934665603u;
    for (int k = 0; k < 4; k++) h = (h ^ (uint32_t)c[k]) * 0x9e3779b97f4a7c15u;
    return (size_t)(h >> 24);
}

static int grow(places *p)
{
    const size_t room = p->room ? 2 * p->room : 512;
    void *at = realloc(p->at, room * sizeof *p->at);
    if (at == NULL) return -1;
    p->at = at;
    p->room = room;
    free(p->slot);
    p->mask = 4 * room - 1;
    p->slot = calloc(p->mask + 1, sizeof *p->slot);
    if (p->slot == NULL) return -1;
    for (size_t i = 0; i < p->n; i++) {
        size_t k = hash_of(p->at[i]) & p->mask;
        while (p->slot[k] != 0) k = (k + 1) & p->mask;
        p->slot[k] = (uint32_t)i + 1;
    }
    return 0;
}

static int note(places *p, const int32_t c[4])
{
    if (p->n == p->room && grow(p)) return -1;
    size_t k = hash_of(c) & p->mask;
    for (; p->slot[k] != 0; k = (k + 1) & p->mask)
        if (memcmp(p->at[p->slot[k] - 1], c, sizeof *p->at) == 0) return 0;
    memcpy(p->at[p->n], c, sizeof *p->at);
    p->slot[k] = (uint32_t)++p->n;
    return 0;
}

/* Part, z, y, x. */
static int by_place(const void *left, const void *right)
{
    const int32_t *a = left, *b = right;
    for (int k = 3; k >= 0; k--)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

/* ---- which bricks ---------------------------------------------------------------------------- */

/* Note the bricks near a small triangle: near its box, and near its plane. */
static int note_near(const band *b, places *p, const double x[3][3], const double normal[3],
                     int32_t part)
{
    const double size = BRICK * b->spacing;
    const double thick =
        b->width + .5 * size * (fabs(normal[0]) + fabs(normal[1]) + fabs(normal[2]));
    int32_t low[3], high[3], c[4] = {0, 0, 0, part};
    for (int k = 0; k < 3; k++) {
        const double lo = fmin(fmin(x[0][k], x[1][k]), x[2][k]) - b->width;
        const double hi = fmax(fmax(x[0][k], x[1][k]), x[2][k]) + b->width;
        low[k] = (int32_t)floor((lo - b->origin[k]) / size);
        high[k] = (int32_t)floor((hi - b->origin[k]) / size);
    }
    for (c[2] = low[2]; c[2] <= high[2]; c[2]++)
        for (c[1] = low[1]; c[1] <= high[1]; c[1]++)
            for (c[0] = low[0]; c[0] <= high[0]; c[0]++) {
                double height = 0.;
                for (int k = 0; k < 3; k++)
                    height += normal[k] * (b->origin[k] + (c[k] + .5) * size - x[0][k]);
                if (fabs(height) <= thick * (1. + 1e-9) && note(p, c)) return -1;
            }
    return 0;
}

/* Cut a triangle in two at its longest edge while that is longer than two bricks. */
static int note_triangle(const band *b, places *p, const surface *s, size_t t, int32_t part)
{
    enum { STACK = 64 }; /* each cut adds one, and halves an edge every other time */
    double stack[STACK][3][3];
    const double limit = 2. * BRICK * b->spacing;
    int depth = 1;
    for (int v = 0; v < 3; v++) memcpy(stack[0][v], s->x[s->vertex[t][v]], sizeof stack[0][v]);
    while (depth > 0) {
        double x[3][3], longest = 0., middle[3];
        int edge = 0;
        memcpy(x, stack[--depth], sizeof x);
        for (int v = 0; v < 3; v++) {
            const double *a = x[v], *c = x[(v + 1) % 3];
            const double length = hypot(hypot(a[0] - c[0], a[1] - c[1]), a[2] - c[2]);
            if (length <= longest) continue;
            longest = length;
            edge = v;
        }
        if (longest <= limit || depth + 2 > STACK) {
            if (note_near(b, p, (const double(*)[3])x, s->normal[t], part)) return -1;
            continue;
        }
        const int other = (edge + 1) % 3;
        for (int k = 0; k < 3; k++) middle[k] = .5 * (x[edge][k] + x[other][k]);
        memcpy(stack[depth], x, sizeof x);
        memcpy(stack[depth++][other], middle, sizeof middle);
        memcpy(stack[depth], x, sizeof x);
        memcpy(stack[depth++][edge], middle, sizeof middle);
    }
    return 0;
}

static double area_of(const surface *s, size_t t)
{
    const double *a = s->x[s->vertex[t][0]], *b = s->x[s->vertex[t][1]], *c = s->x[s->vertex[t][2]];
    double sum = 0.;
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3;
        const double n = (b[k] - a[k]) * (c[l] - a[l]) - (b[l] - a[l]) * (c[k] - a[k]);
        sum += n * n;
    }
    return .5 * sqrt(sum);
}

/* Note the bricks near this rank's share of the triangles, by area. */
static dem_status note_share(const making *m, places *p)
{
    const surface *s = m->surface;
    const double from = s->measure * m->rank / m->ranks, to = s->measure * (m->rank + 1) / m->ranks;
    double sum = 0.;
    for (int part = 0; part < s->parts; part++)
        for (size_t t = s->first[part]; t < s->first[part + 1]; t++) {
            /* The last one takes what rounding leaves over. */
            const int mine = sum >= from && (sum < to || m->rank + 1 == m->ranks);
            if (mine && note_triangle(m->band, p, s, t, part)) return out_of_memory(m);
            sum += area_of(s, t);
        }
    return DEM_OK;
}

/* Sort, and leave each once. */
static void order(places *p)
{
    size_t kept = 0;
    if (p->n > 0) qsort(p->at, p->n, sizeof *p->at, by_place);
    for (size_t i = 0; i < p->n; i++)
        if (kept == 0 || by_place(p->at[i], p->at[kept - 1]) != 0)
            memmove(p->at[kept++], p->at[i], sizeof *p->at);
    p->n = kept;
}

/* Of this rank's share keep the bricks that reach into the band; their centres tell. */
static void sift_share(const making *m, places *p)
{
    const band *b = m->band;
    const double size = BRICK * b->spacing, reach = b->width + .5 * sqrt(3.) * size;
    const size_t from = slice(p->n, m->rank, m->ranks), to = slice(p->n, m->rank + 1, m->ranks);
    p->n = 0;
    for (size_t i = from; i < to; i++) {
        double x[3];
        surface_hit hit = {.d2 = reach * reach};
        for (int k = 0; k < 3; k++) x[k] = b->origin[k] + (p->at[i][k] + .5) * size;
        if (surface_nearest(m->surface, p->at[i][3], x, &hit))
            memmove(p->at[p->n++], p->at[i], sizeof *p->at);
    }
}

/* All bricks that the band consists of. */
static dem_status find_bricks(const making *m)
{
    band *b = m->band;
    places p = {.mask = 0};
    dem_status status = note_share(m, &p);
    status = gather_rows(m, status, (void **)&p.at, &p.n, sizeof *p.at);
    if (!status) order(&p);
    if (!status) sift_share(m, &p);
    status = gather_rows(m, status, (void **)&p.at, &p.n, sizeof *p.at);
    free(p.slot);
    b->place = p.at;
    b->n = p.n;
    return status;
}

/* ---- values ---------------------------------------------------------------------------------- */

/* Values of the brick at place c, and which of its cells are hidden. */
static void fill_brick(const band *b, const surface *s, const int32_t c[4],
                       double value[BRICK_NODES], uint64_t bits[BRICK_WORDS])
{
    enum { ROW = BRICK + 1 };
    unsigned char hidden[BRICK_NODES];
    /* Of triangles at the same distance the one looked at first answers: not one that was found
     * for another brick, which another rank may have. */
    uint32_t hint = (uint32_t)s->first[c[3]];
    for (int n = 0; n < BRICK_NODES; n++) {
        const int at[3] = {n % ROW, n / ROW % ROW, n / (ROW * ROW)};
        double x[3];
        int veiled;
        for (int k = 0; k < 3; k++) x[k] = b->origin[k] + b->spacing * (BRICK * c[k] + at[k]);
        value[n] = surface_sample(s, c[3], x, &veiled, &hint);
        hidden[n] = (unsigned char)veiled;
    }
    /* A cell is hidden when all its corners are. Across a ridge both parts have their feet on the
     * edge and the same distance: in a cell that is for either, the first of the two answers. */
    memset(bits, 0, BRICK_WORDS * sizeof *bits);
    for (int cell = 0; cell < BRICK * BRICK * BRICK; cell++) {
        const int n = (cell / (BRICK * BRICK) * ROW + cell / BRICK % BRICK) * ROW + cell % BRICK;
        int all = 1, later = 0;
        for (int corner = 0; corner < 8; corner++) {
            const int h =
                hidden[n + (corner & 1) + (corner >> 1 & 1) * ROW + (corner >> 2) * ROW * ROW];
            all &= h != 0;
            later |= h == 2;
        }
        if (all || later) bits[cell / 64] |= (uint64_t)1 << (cell % 64);
    }
}

/* This rank's share of the bricks, then all. */
static dem_status fill_bricks(const making *m)
{
    band *b = m->band;
    const size_t from = slice(b->n, m->rank, m->ranks), to = slice(b->n, m->rank + 1, m->ranks);
    size_t n_value = to - from, n_hidden = to - from;
    b->value = malloc(n_value * sizeof *b->value + 1);
    b->hidden = malloc(n_hidden * sizeof *b->hidden + 1);
    dem_status status = b->value && b->hidden ? DEM_OK : out_of_memory(m);
    const sdf_progress *told = m->progress;
    for (size_t i = from; i < to && !status; i++) {
        fill_brick(b, m->surface, b->place[i], b->value[i - from], b->hidden[i - from]);
        if (told && told->call && (i % 64 == 63 || i + 1 == to))
            told->call(told->context, "sampling", (double)(i + 1 - from) / (double)(to - from));
    }
    status = gather_rows(m, status, (void **)&b->value, &n_value, sizeof *b->value);
    return gather_rows(m, status, (void **)&b->hidden, &n_hidden, sizeof *b->hidden);
}

/* Places of bricks of any part, */
static dem_status find_sides(const making *m)
{
    band *b = m->band;
    b->side = malloc(b->n * sizeof *b->side + 1);
    if (b->side == NULL) return out_of_memory(m);
    places p = {.at = b->side, .n = b->n};
    memcpy(b->side, b->place, b->n * sizeof *b->side);
    for (size_t i = 0; i < b->n; i++) b->side[i][3] = 0;
    order(&p);
    b->n_side = p.n;
    return DEM_OK;
}

/* and on which side their faces towards greater x are: this rank's share, then all. */
static dem_status fill_sides(const making *m)
{
    band *b = m->band;
    dem_status status = find_sides(m);
    const size_t from = slice(b->n_side, m->rank, m->ranks);
    const size_t to = slice(b->n_side, m->rank + 1, m->ranks);
    for (size_t i = from; i < to && !status; i++) {
        int32_t *c = b->side[i];
        double x[3], g[3];
        int part;
        for (int k = 0; k < 3; k++)
            x[k] = b->origin[k] + BRICK * b->spacing * (c[k] + (k == 0 ? 1. : .5));
        c[3] = surface_distance(m->surface, x, g, &part) >= 0.;
    }
    if (!status) memmove(b->side, b->side + from, (to - from) * sizeof *b->side);
    if (!status) b->n_side = to - from;
    return gather_rows(m, status, (void **)&b->side, &b->n_side, sizeof *b->side);
}

/* ---- the whole --------------------------------------------------------------------------------
 */

/* Ranks that share the memory of this machine. */
static int ranks_here(dem_sim *sim)
{
    int n = 1;
    if (sim == NULL || sim->ranks == 1) return n;
    MPI_Comm here;
    MPI_Comm_split_type(sim->comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
    MPI_Comm_size(here, &n);
    MPI_Comm_free(&here);
    return n;
}

/* Too much is mostly a matter of units: say so before the memory is gone. */
static dem_status affordable(const making *m)
{
    const surface *s = m->surface;
    const band *b = m->band;
    const double side = BRICK * b->spacing;
    const double bricks = s->measure / (side * side) * (2. * b->width / side + 1.);
    const double bytes = bricks * (sizeof *b->value + sizeof *b->hidden + 2. * sizeof *b->place) *
                         ranks_here(m->sim);
    const double there = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGE_SIZE);
    const double extent = fmax(fmax(s->hi[0] - s->lo[0], s->hi[1] - s->lo[1]), s->hi[2] - s->lo[2]);
    if (bytes < .8 * there && extent / b->spacing < 1e9) return DEM_OK;
    snprintf(m->message, m->size,
             "its surface of %.3g m2 (extent %.3g m) sampled every %.3g m takes %.3g GB of "
             "memory, there are %.3g: wrong units (scale), or too fine a spacing",
             s->measure, extent, b->spacing, bytes / 1e9, there / 1e9);
    return DEM_NO_MEMORY;
}

/* An empty band and what is needed to make it; NULL on a rank without memory. */
static band *start(making *m, const surface *s, double spacing, double width,
                   const sdf_progress *progress, char *message, size_t size)
{
    dem_sim *sim = progress != NULL ? progress->sim : NULL;
    band *b = calloc(1, sizeof *b);
    *m = (making){.band = b,
                  .surface = s,
                  .progress = progress,
                  .sim = sim,
                  .rank = sim != NULL ? sim->rank : 0,
                  .ranks = sim != NULL ? sim->ranks : 1,
                  .message = message,
                  .size = size};
    if (b == NULL) return NULL;
    b->spacing = spacing;
    b->width = width;
    memcpy(b->origin, s->lo, sizeof b->origin);
    return b;
}

band *band_new(const surface *s, double spacing, double width, const sdf_progress *progress,
               char *message, size_t size)
{
    making m;
    band *b = start(&m, s, spacing, width, progress, message, size);
    dem_status status = agreed(&m, b == NULL ? out_of_memory(&m) : DEM_OK);
    if (!status) status = agreed(&m, affordable(&m));
    if (!status) status = find_bricks(&m);
    if (!status) status = fill_bricks(&m);
    if (!status) status = fill_sides(&m);
    if (!status) status = agreed(&m, band_index(b) ? out_of_memory(&m) : DEM_OK);
    if (!status) return b;
    band_free(b);
    return NULL;
}

band *band_share(band *b, const surface *s, double spacing, double width,
                 const sdf_progress *progress, dem_status *status, char *message, size_t size)
{
    making m;
    int64_t there = b != NULL;
    *status = DEM_OK;
    if (progress == NULL || progress->sim == NULL || progress->sim->ranks == 1) return b;
    sum_counts(progress->sim, &there, 1);
    if (!there) return NULL;
    band *mine = start(&m, s, spacing, width, progress, message, size);
    *status = agreed(&m, mine == NULL ? out_of_memory(&m) : DEM_OK);
    if (b != NULL) { /* the one who has it */
        band_free(mine);
        mine = b;
    }
    if (*status) {
        band_free(mine);
        return NULL;
    }
    size_t n = mine->n, n_hidden = mine->n;
    *status = gather_rows(&m, DEM_OK, (void **)&mine->place, &mine->n, sizeof *mine->place);
    if (!*status) *status = gather_rows(&m, DEM_OK, (void **)&mine->value, &n, sizeof *mine->value);
    if (!*status)
        *status = gather_rows(&m, DEM_OK, (void **)&mine->hidden, &n_hidden, sizeof *mine->hidden);
    if (!*status)
        *status = gather_rows(&m, DEM_OK, (void **)&mine->side, &mine->n_side, sizeof *mine->side);
    if (!*status && mine != b) *status = band_index(mine) ? out_of_memory(&m) : DEM_OK;
    *status = agreed(&m, *status);
    if (!*status) return mine;
    band_free(mine);
    return NULL;
}
