/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * restart_rows.c - the rows of a restart file among the ranks.
 *
 * The file has particles in the order of their ids, whatever rank they are on. Every rank writes an
 * even share of these rows, its slab, and reads one: no rank holds more than that and its own
 * particles. Saving, the ids at which the slabs meet are found by bisection, all of them at once,
 * with as many sums over the ranks as ids have bits; then rows go to the rank of their slab, where
 * they are sorted. Loading, they go from there to the ranks that own their places. Slabs lie behind
 * each other in the order of the ranks and rows keep their order on the way, so they come in the
 * order of ids. What is known of a particle by its id alone, its owner, is asked of the rank in
 * whose slab the id is.
 */
#include "periodic.h"
#include "restart.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static dem_status status_of(const restart_job *job)
{
    return job->file->f.failed ? DEM_IO : DEM_OK;
}

/* Ranks agreed on a failure, the message is there. */
static int well(restart_job *job, dem_status status)
{
    if (status) job->file->f.failed = 1;
    return !status;
}

void restart_no_memory(restart_job *job)
{
    h5file_fail(&job->file->f, job->row ? "write" : "read", "out of memory");
}

/* ---- which slab an id is in ------------------------------------------------------------------ */

int restart_slab_of(const restart_job *job, int64_t id)
{
    int low = 0, high = job->sim->ranks - 1;
    while (low < high) { /* the last bound that is not above it */
        const int middle = low + (high - low + 1) / 2;
        if (job->bound[middle] <= id)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

/* How many of this rank's ids are below `id`. */
static size_t count_below(const restart_job *job, int64_t id)
{
    const int64_t *all = job->sim->particles.id;
    size_t low = 0, high = job->n;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (all[job->row[middle]] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static int64_t half_way(int64_t low, int64_t high)
{
    return low + (int64_t)(((uint64_t)high - (uint64_t)low) / 2);
}

/* bound[r]: the lowest id with as many below it as the slabs before r hold. */
static dem_status find_bounds(restart_job *job, int64_t total)
{
    const dem_sim *sim = job->sim;
    const size_t ranks = (size_t)sim->ranks;
    const int64_t *id = sim->particles.id;
    int64_t end[2] = {job->n ? id[job->row[0]] : INT64_MAX,
                      job->n ? -1 - id[job->row[job->n - 1]] : INT64_MAX};
    MPI_Allreduce(MPI_IN_PLACE, end, 2, MPI_INT64_T, MPI_MIN, sim->comm);
    int64_t *high = malloc(ranks * sizeof *high), *below = malloc(ranks * sizeof *below);
    const dem_status status = agree(job->sim, high && below ? DEM_OK : no_memory(job->sim));
    for (size_t r = 0; r < ranks && !status; r++) {
        job->bound[r] = end[0];
        high[r] = -1 - end[1];
    }
    for (int open = !status && total > 0; open;) {
        for (size_t r = 0; r < ranks; r++)
            below[r] = (int64_t)count_below(job, half_way(job->bound[r], high[r]));
        sum_counts(sim, below, (int)ranks);
        open = 0;
        for (size_t r = 0; r < ranks; r++) {
            const int64_t middle = half_way(job->bound[r], high[r]);
            if (below[r] >= (int64_t)slice((size_t)total, (int)r, sim->ranks))
                high[r] = middle;
            else
                job->bound[r] = middle + 1;
            open |= job->bound[r] < high[r];
        }
    }
    if (!status) job->bound[0] = INT64_MIN;
    free(high);
    free(below);
    return status;
}

/* ---- rows on their way ----------------------------------------------------------------------- */

void *restart_send(restart_job *job, const restart_route *route, void *data, size_t size, size_t *n)
{
    dem_sim *sim = job->sim;
    if (sim->ranks == 1) return data;
    if (!data) restart_no_memory(job);
    parcel in;
    const int good = well(job, send_blocks(sim, status_of(job), route->first, data, size, &in));
    char *sorted = route->sorted && good ? malloc(in.n * size + 1) : NULL;
    free(data);
    void *came = in.data;
    in.data = NULL;
    if (!good) {
        free(came);
        came = NULL;
    } else if (route->sorted) {
        for (size_t k = 0; k < in.n && sorted; k++)
            memcpy(sorted + k * size, (char *)came + route->sorted[k] * size, size);
        if (!sorted) restart_no_memory(job);
        free(came);
        came = sorted;
    }
    *n = came ? in.n : 0;
    parcel_free(&in);
    return came;
}

size_t *restart_order_by_rank(const restart_job *job, size_t n, uint32_t *to)
{
    const int ranks = job->sim->ranks;
    size_t *first = calloc((size_t)ranks + 2, sizeof *first);
    if (!first) return NULL;
    size_t *next = first + 1; /* runs from the begin of a rank to its end */
    for (size_t k = 0; k < n; k++) next[to[k]]++;
    counts_to_first(next, ranks);
    for (size_t k = 0; k < n; k++) to[k] = (uint32_t)next[to[k]]++;
    first[0] = 0;
    return first;
}

void restart_route_free(restart_route *route)
{
    free(route->first);
    free(route->sorted);
    memset(route, 0, sizeof *route);
}

/* ---- saving ---------------------------------------------------------------------------------- */

typedef struct by_id {
    int64_t id;
    uint32_t row;
} by_id;

static int compare_ids(const void *a, const void *b)
{
    const int64_t x = ((const by_id *)a)->id, y = ((const by_id *)b)->id;
    return (x > y) - (x < y);
}

/* The places of n ids in their order, or NULL. */
static uint32_t *sort_ids(const int64_t *id, size_t n)
{
    by_id *all = malloc((n + 1) * sizeof *all);
    uint32_t *row = malloc((n + 1) * sizeof *row);
    for (size_t i = 0; i < n && all; i++) all[i] = (by_id){id[i], (uint32_t)i};
    if (all && n) qsort(all, n, sizeof *all, compare_ids);
    for (size_t i = 0; i < n && all && row; i++) row[i] = all[i].row;
    if (!all) {
        free(row);
        row = NULL;
    }
    free(all);
    return row;
}

void restart_plan_saving(restart_job *job)
{
    dem_sim *sim = job->sim;
    const particles *p = &sim->particles;
    const size_t ranks = (size_t)sim->ranks;
    h5file *f = &job->file->f;
    job->row = sort_ids(p->id, p->n);
    job->n = job->row ? p->n : 0;
    job->bound = malloc(ranks * sizeof *job->bound);
    job->route.first = malloc((ranks + 1) * sizeof *job->route.first);
    if (!job->row || !job->bound || !job->route.first) h5file_fail(f, "write", "out of memory");
    job->slab = (h5rows){job->n, 0, job->n};
    if (sim->ranks == 1 || !h5file_agree(f)) return;
    int64_t total = (int64_t)job->n;
    sum_counts(sim, &total, 1);
    if (!well(job, find_bounds(job, total))) return;
    for (size_t r = 0; r < ranks; r++)
        job->route.first[r] = r ? count_below(job, job->bound[r]) : 0;
    job->route.first[ranks] = job->n;
    /* Where the ids come tells where all else does. */
    int64_t *id = malloc((job->n + 1) * sizeof *id);
    for (size_t k = 0; k < job->n && id; k++) id[k] = p->id[job->row[k]];
    if (!id) restart_no_memory(job);
    parcel in;
    if (!well(job, send_blocks(sim, status_of(job), job->route.first, id, sizeof *id, &in)))
        in.n = 0;
    if (!f->failed) job->route.sorted = sort_ids(in.data, in.n);
    if (!f->failed && !job->route.sorted) restart_no_memory(job);
    job->slab = h5file_rows(f, in.n);
    parcel_free(&in);
    free(id);
}

void restart_put_rows(restart_job *job, const char *set, restart_kind kind, int width, void *data,
                      const char *units)
{
    size_t n;
    data = restart_send(job, &job->route, data, 8 * (size_t)width, &n);
    restart_put(job->file, set, kind, job->slab, width, data, units);
    free(data);
}

/* ---- loading --------------------------------------------------------------------------------- */

/* Ids of the slabs of all ranks must rise; bound[] is then where each begins. */
static void learn_bounds(restart_job *job)
{
    const int64_t mine[2] = {(int64_t)job->slab.n, job->slab.n ? job->slab_id[0] : 0};
    const int ranks = job->sim->ranks;
    job->bound = restart_room(job, (size_t)ranks * sizeof *job->bound);
    parcel in;
    if (well(job, share_blocks(job->sim, status_of(job), 1, mine, sizeof mine, &in))) {
        const int64_t(*all)[2] = in.data;
        for (int r = ranks - 1; r >= 0; r--) /* slabs that are empty: as the one behind */
            job->bound[r] = all[r][0] ? all[r][1] : r == ranks - 1 ? INT64_MAX : job->bound[r + 1];
        const int behind = job->sim->rank + 1;
        if (behind < ranks && job->slab.n && job->bound[behind] < INT64_MAX &&
            job->slab_id[job->slab.n - 1] >= job->bound[behind])
            restart_refuse(job->file, "particle id %lld is out of order",
                           (long long)job->bound[behind]);
        job->bound[0] = INT64_MIN;
    }
    parcel_free(&in);
}

void restart_plan_loading(restart_job *job, const double (*x)[3], const double *radius)
{
    dem_sim *sim = job->sim;
    const size_t n = job->slab.n;
    job->n = n;
    if (sim->ranks == 1) return;
    learn_bounds(job);
    double(*pos)[4] = malloc((n + 1) * sizeof *pos);
    job->owner = restart_room(job, (n + 1) * sizeof *job->owner);
    job->order = restart_room(job, (n + 1) * sizeof *job->order);
    if (!pos) restart_no_memory(job);
    if (!h5file_agree(&job->file->f)) {
        free(pos);
        return;
    }
    for (size_t k = 0; k < n; k++) {
        memcpy(pos[k], x[k], sizeof *x);
        pos[k][3] = radius[k];
        wrap_into(pos[k], sim->lo, sim->hi, sim->periodic);
    }
    dem_status status = DEM_OK;
    if (job->slab.total) status = domain_divide(sim, n, (const double(*)[4])pos, NULL);
    for (size_t k = 0; k < n && !status; k++)
        job->owner[k] = job->order[k] = (uint32_t)domain_owner(sim, pos[k]);
    free(pos);
    if (!status && !(job->route.first = restart_order_by_rank(job, n, job->order)))
        status = no_memory(sim);
    well(job, agree(sim, status));
}

void *restart_bring(restart_job *job, void *data, int width)
{
    const size_t size = 8 * (size_t)width;
    if (job->sim->ranks == 1) return data;
    char *out = malloc(job->slab.n * size + 1);
    for (size_t k = 0; k < job->slab.n && out && data; k++)
        memcpy(out + job->order[k] * size, (char *)data + k * size, size);
    restart_drop(job->file, data);
    return restart_adopt(job->file, restart_send(job, &job->route, out, size, &job->n));
}

void *restart_fetch(restart_job *job, const char *set, restart_kind kind, int width)
{
    return restart_bring(job, restart_slab(job->file, set, kind, width, &job->slab), width);
}
