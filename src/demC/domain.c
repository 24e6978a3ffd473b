/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * domain.c - which rank has which part of space.
 *
 * Recursive coordinate bisection by Zoltan: space is cut in two across its longest side so that the
 * ranks of each half get their share of the weights, and so on. The cuts are kept on every rank, a
 * tree of as many leaves as ranks, by which the owner of a point and the parts that a box touches
 * are found in a few comparisons. Berger & Bokhari, IEEE Trans. Comput. C-36 (1987) 570,
 * doi:10.1109/TC.1987.1676942; Devine et al., Comput. Sci. Eng. 4(2) (2002) 90,
 * doi:10.1109/5992.988653.
 *
 * Work. What forces and motion took on a rank since the last look is spread over its particles in
 * proportion to their rows: a look at every pair of the list, and as much as OWN of them for the
 * motion of the particle itself. When the busiest rank works `imbalance` times as long as the mean,
 * space is divided anew by these weights. A look waits until the ranks have worked WINDOW times as
 * long as a division costs, so that dividing takes a few per cent of the time at most.
 */
#include "domain.h"

#include "dem_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zoltan.h>

static const double WINDOW = 20;
static const float OWN = 3;

typedef struct points {
    size_t n;
    const double (*pos)[4];
    const float *weight;
} points;

static int count_points(void *data, int *status)
{
    *status = ZOLTAN_OK;
    return (int)((const points *)data)->n;
}

static void list_points(void *data, int gid_size, int lid_size, ZOLTAN_ID_PTR gid,
                        ZOLTAN_ID_PTR lid, int weights, float *weight, int *status)
{
    (void)gid_size;
    (void)lid_size;
    const points *p = data;
    for (size_t i = 0; i < p->n; i++) {
        gid[i] = lid[i] = (ZOLTAN_ID_TYPE)i; /* never sent: no lists are asked for */
        if (weights) weight[i] = p->weight ? p->weight[i] : 1;
    }
    *status = ZOLTAN_OK;
}

static int dimensions(void *data, int *status)
{
    (void)data;
    *status = ZOLTAN_OK;
    return 3;
}

static void coordinates(void *data, int gid_size, int lid_size, int n, ZOLTAN_ID_PTR gid,
                        ZOLTAN_ID_PTR lid, int dim, double *x, int *status)
{
    (void)gid_size;
    (void)lid_size;
    (void)gid;
    const points *p = data;
    for (int k = 0; k < n; k++) memcpy(x + k * dim, p->pos[lid[k]], 3 * sizeof *x);
    *status = ZOLTAN_OK;
}

dem_status domain_init(dem_sim *sim)
{
    domain *d = &sim->domain;
    if (sim->ranks == 1) return DEM_OK;
    const size_t ranks = (size_t)sim->ranks;
    float version;
    d->near = calloc(ranks, sizeof *d->near);
    d->found = calloc(ranks, sizeof *d->found);
    d->seen = calloc(ranks, sizeof *d->seen);
    if (Zoltan_Initialize(0, NULL, &version) == ZOLTAN_OK) d->zoltan = Zoltan_Create(sim->comm);
    const int well = d->near && d->found && d->seen && d->zoltan;
    if (!well) return no_memory(sim);
    /* The level of talk first: others are told aloud. */
    static const char *const set[][2] = {
        {"DEBUG_LEVEL", "0"},     {"LB_METHOD", "RCB"},       {"KEEP_CUTS", "1"},
        {"AVERAGE_CUTS", "1"},    {"RETURN_LISTS", "NONE"},   {"RCB_OUTPUT_LEVEL", "0"},
        {"OBJ_WEIGHT_DIM", "1"},  {"CHECK_GEOM", "0"},        {"NUM_GID_ENTRIES", "1"},
        {"NUM_LID_ENTRIES", "1"}, {"REDUCE_DIMENSIONS", "0"}, {"IMBALANCE_TOL", "1.01"}};
    for (size_t k = 0; k < sizeof set / sizeof *set; k++)
        Zoltan_Set_Param(d->zoltan, set[k][0], set[k][1]);
    return DEM_OK;
}

void domain_free(domain *d)
{
    if (d->zoltan) Zoltan_Destroy(&d->zoltan);
    free(d->near);
    free(d->found);
    free(d->seen);
    memset(d, 0, sizeof *d);
}

dem_status domain_divide(dem_sim *sim, size_t n, const double (*pos)[4], const float *weight)
{
    domain *d = &sim->domain;
    if (sim->ranks == 1) return DEM_OK;
    points p = {n, pos, weight};
    Zoltan_Set_Num_Obj_Fn(d->zoltan, count_points, &p);
    Zoltan_Set_Obj_List_Fn(d->zoltan, list_points, &p);
    Zoltan_Set_Num_Geom_Fn(d->zoltan, dimensions, &p);
    Zoltan_Set_Geom_Multi_Fn(d->zoltan, coordinates, &p);
    int changes, gids, lids, in, out, *in_rank, *in_part, *out_rank, *out_part, dim;
    ZOLTAN_ID_PTR in_gid, in_lid, out_gid, out_lid;
    const int result =
        Zoltan_LB_Partition(d->zoltan, &changes, &gids, &lids, &in, &in_gid, &in_lid, &in_rank,
                            &in_part, &out, &out_gid, &out_lid, &out_rank, &out_part);
    Zoltan_LB_Free_Part(&in_gid, &in_lid, &in_rank, &in_part);
    Zoltan_LB_Free_Part(&out_gid, &out_lid, &out_rank, &out_part);
    double *lo = d->lo, *hi = d->hi;
    const int bad = (result != ZOLTAN_OK && result != ZOLTAN_WARN) ||
                    Zoltan_RCB_Box(d->zoltan, sim->rank, &dim, &lo[0], &lo[1], &lo[2], &hi[0],
                                   &hi[1], &hi[2]) != ZOLTAN_OK;
    const dem_status status =
        agree(sim, bad ? fail(sim, DEM_NO_MEMORY, "the domain cannot be divided among %d ranks",
                              sim->ranks)
                       : DEM_OK);
    d->divided = !status;
    sim->report.divisions++;
    return status;
}

int domain_owner(const dem_sim *sim, const double x[3])
{
    if (sim->ranks == 1) return 0;
    double at[3] = {x[0], x[1], x[2]};
    int rank = sim->rank, part;
    Zoltan_LB_Point_PP_Assign(sim->domain.zoltan, at, &rank, &part);
    return rank;
}

/* Enter the ranks whose parts the box touches, each once. */
static int find_touched(dem_sim *sim, const double lo[3], const double hi[3], int n)
{
    domain *d = &sim->domain;
    int found = 0;
    Zoltan_LB_Box_Assign(d->zoltan, lo[0], lo[1], lo[2], hi[0], hi[1], hi[2], d->found, &found);
    for (int k = 0; k < found; k++) {
        const int r = d->found[k];
        if (r == sim->rank || d->seen[r] == d->search) continue;
        d->seen[r] = d->search;
        d->near[n++] = r;
    }
    return n;
}

int domain_near(dem_sim *sim, const double x[3], double reach)
{
    domain *d = &sim->domain;
    double lo[3], hi[3], length[3];
    int images[3][2], inside = 1, n = 0; /* of every direction: from, to */
    for (int a = 0; a < 3; a++) {
        lo[a] = x[a] - reach;
        hi[a] = x[a] + reach;
        inside &= lo[a] > d->lo[a] && hi[a] < d->hi[a];
        length[a] = sim->hi[a] - sim->lo[a];
        images[a][0] = sim->periodic[a] && hi[a] >= sim->hi[a] ? -1 : 0;
        images[a][1] = sim->periodic[a] && lo[a] <= sim->lo[a] ? 1 : 0;
        inside &= images[a][0] == 0 && images[a][1] == 0;
    }
    if (inside) return 0;
    d->search++;
    for (int i = images[0][0]; i <= images[0][1]; i++)
        for (int j = images[1][0]; j <= images[1][1]; j++)
            for (int k = images[2][0]; k <= images[2][1]; k++) {
                const double shift[3] = {i * length[0], j * length[1], k * length[2]};
                double from[3], to[3];
                for (int a = 0; a < 3; a++) {
                    from[a] = lo[a] + shift[a];
                    to[a] = hi[a] + shift[a];
                }
                n = find_touched(sim, from, to, n);
            }
    return n;
}

/* Weights from the work measured and the rows of the list that was. */
static dem_status divide_by_work(dem_sim *sim, double busy)
{
    const particles *p = &sim->particles;
    const neighbour *list = &sim->list;
    float *weight = malloc((p->n + 1) * sizeof *weight);
    dem_status status = agree(sim, weight ? DEM_OK : no_memory(sim));
    double sum = 0;
    for (size_t i = 0; i < p->n && !status; i++) {
        weight[i] = OWN;
        if (list->valid) {
            const uint32_t r = neighbour_row(list, (uint32_t)i);
            weight[i] += (float)(list->row[r + 1] - list->row[r]);
        }
        sum += weight[i];
    }
    for (size_t i = 0; i < p->n && !status; i++) weight[i] *= (float)(busy / sum);
    if (!status) status = domain_divide(sim, p->n, (const double(*)[4])p->pos, weight);
    free(weight);
    return status;
}

dem_status domain_balance(dem_sim *sim)
{
    domain *d = &sim->domain;
    if (!d->divided)
        return domain_divide(sim, sim->particles.n, (const double(*)[4])sim->particles.pos, NULL);
    double most = d->busy, sum = d->busy;
    max_reals(sim, &most, 1);
    sum_reals(sim, &sum, 1);
    /* All ranks have the same numbers from here on. */
    MPI_Bcast(&sum, 1, MPI_DOUBLE, 0, sim->comm);
    const double mean = sum / sim->ranks;
    if (!(mean > WINDOW * d->cost)) return DEM_OK;
    const double busy = d->busy;
    sim->report.imbalance = most / mean;
    d->busy = 0;
    return most > sim->imbalance * mean ? divide_by_work(sim, fmax(busy, 1e-9 * mean)) : DEM_OK;
}
