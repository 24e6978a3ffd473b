/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * phase.c - the particle side of a coupled step, between the engine, the map and a flow solver.
 *
 *     advance   F = L + g C/dt + k (v^n - v) + M (a - dv/dt)  in every sub-step -> impulse J
 *               W at the new positions, void fraction
 *     drag      kappa(eps, |u - v|);  K = scatter kappa,  S = scatter kappa v
 *     settle    L = kappa (u - T v) - V grad p,   C = C + L dt - J
 *
 * (method: couplingLib's force.c). Particles that feeders bring within a step feel the fluid from
 * its end on: they are in the map and in the drag, and what the fluid exerts on them is carried in
 * C. Those that outlets take leave with their momentum and with what was owed to them, which the
 * ledger books. A particle that has not met the fluid yet, at the start or created later, begins
 * with the buoyancy of a fluid at rest, L = -rho V g, and with C = 0; at the start with the drag
 * coefficient of a fluid that moves with it, so that a stiff particle resists from the beginning.
 * What the fluid turns out to exert in that step is carried in C like any other error of
 * prediction.
 */
#include "state.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Below this solid fraction a cell has no mean particle velocity: rounding of 1 - eps. */
static const double no_solid = 1e-12;

int phase_fail(phase *ph, int code, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(ph->message, sizeof ph->message, format, list);
    va_end(list);
    return code;
}

int phase_agree(phase *ph, int failed, int *flag)
{
    int rank, ranks, all[2];
    MPI_Comm_rank(ph->comm, &rank);
    MPI_Comm_size(ph->comm, &ranks);
    /* The largest is that of the first rank that fails. */
    const int mine[2] = {failed ? ranks - rank : 0, flag ? *flag : 0};
    MPI_Allreduce(mine, all, 2, MPI_INT, MPI_MAX, ph->comm);
    if (flag) *flag = all[1];
    if (all[0]) {
        MPI_Bcast(&failed, 1, MPI_INT, ranks - all[0], ph->comm);
        MPI_Bcast(ph->message, sizeof ph->message, MPI_CHAR, ranks - all[0], ph->comm);
    }
    return failed;
}

static int dem_failed(phase *ph, dem_status status)
{
    return phase_fail(ph, status, "%s", dem_message(ph->dem));
}

/* Errors of the coupling are numbered after those of the engine. */
static int cpl_failed(phase *ph, cpl_status status, const char *text)
{
    return phase_fail(ph, DEM_IO + status, "%s", text);
}

/* s, of this rank with the others over cells since the map was built. */
static double seconds_exchange(const phase *ph)
{
    return cpl_map_last_report(ph->map).seconds_exchange;
}

/* ---- life cycle ------------------------------------------------------------------------------ */

static int check(phase *ph, const phase_param *param)
{
    const cpl_param *c = param->coupling;
    if (!(param->rho > 0 && param->mu > 0 && isfinite(param->rho) && isfinite(param->mu)))
        return phase_fail(ph, DEM_BAD_ARGUMENT,
                          "density and viscosity of the fluid must be positive, found %g kg/m3 and "
                          "%g Pa s",
                          param->rho, param->mu);
    if (!(c->carry_gain > 0 && c->carry_gain <= 1))
        return phase_fail(ph, DEM_BAD_ARGUMENT, "carry gain is %g and must lie in (0, 1]",
                          c->carry_gain);
    if (!(c->added_mass_above >= 0))
        return phase_fail(ph, DEM_BAD_ARGUMENT, "threshold of the added mass is %g, below zero",
                          c->added_mass_above);
    return 0;
}

/* Direction against gravity and the lowest point of the mesh along it. */
static void find_floor(phase *ph)
{
    const double *down = ph->gravity;
    const double g = sqrt(down[0] * down[0] + down[1] * down[1] + down[2] * down[2]);
    for (int a = 0; a < 3; a++) ph->up[a] = g > 0 ? -down[a] / g : 0;
    double lowest = HUGE_VAL;
    for (size_t c = 0; c < ph->mesh.n; c++) {
        double height = 0;
        for (int a = 0; a < 3; a++)
            height += ph->up[a] * (ph->up[a] > 0 ? ph->mesh.lo[c][a] : ph->mesh.hi[c][a]);
        lowest = fmin(lowest, height);
    }
    MPI_Allreduce(&lowest, &ph->floor, 1, MPI_DOUBLE, MPI_MIN, ph->comm);
}

/* Whether M of cpl_predict can be switched on for any material, in a cell at the packing limit. */
static int inertia_matters(const phase_param *param)
{
    const double solid = param->coupling->packing_limit;
    for (size_t i = 0; i < param->dem->n_material; i++)
        if (param->rho * solid / ((1 - solid) * param->dem->material[i].density) >
            param->coupling->added_mass_above)
            return param->coupling->scheme != CPL_EXPLICIT;
    return 0;
}

/* In the order of their names, as a restart file brings them: then the files of a run do not
 * depend on how often it was interrupted. */
static int attach(phase *ph)
{
    ph->acceleration = ph->inertia ? dem_attach(ph->dem, "acceleration", 3) : 0;
    ph->carried = dem_attach(ph->dem, "carried", 3);
    ph->kappa = dem_attach(ph->dem, "dragCoefficient", 1);
    ph->force = dem_attach(ph->dem, "fluidForce", 3);
    ph->before = ph->inertia ? dem_attach(ph->dem, "velocityBefore", 3) : 0;
    ph->eps_p = dem_attach(ph->dem, "voidFraction", 1);
    return ph->carried < 0 || ph->force < 0 || ph->kappa < 0 || ph->eps_p < 0 ||
           ph->acceleration < 0 || ph->before < 0;
}

static int allocate_cells(phase *ph)
{
    const size_t n = ph->mesh.n + 1; /* a rank may have no cell, and still memory */
    ph->eps = calloc(n, sizeof *ph->eps);
    ph->eps_before = calloc(n, sizeof *ph->eps_before);
    ph->K = calloc(n, sizeof *ph->K);
    ph->mass_cell = calloc(n, sizeof *ph->mass_cell);
    ph->S = calloc(n, sizeof *ph->S);
    ph->Us = calloc(n, sizeof *ph->Us);
    ph->vector_cell = calloc(n, sizeof *ph->vector_cell);
    return !ph->eps || !ph->eps_before || !ph->K || !ph->mass_cell || !ph->S || !ph->Us ||
           !ph->vector_cell;
}

/* Scratch for n particles, carved from one block. */
static int reserve(phase *ph, size_t n)
{
    if (ph->block && n <= ph->capacity) return 0;
    const size_t m = n + n / 4 + 64;
    free(ph->block);
    double *b = ph->block = malloc(24 * m * sizeof *b);
    ph->capacity = b ? m : 0;
    if (!b) return phase_fail(ph, DEM_NO_MEMORY, "no memory to couple %zu particles", n);
    ph->V = b, ph->k = b + m, ph->M = b + 2 * m;
    ph->f = (vector *)(b + 3 * m), ph->u = (vector *)(b + 6 * m);
    ph->grad_p = (vector *)(b + 9 * m), ph->s = (vector *)(b + 12 * m);
    ph->tensor = b + 15 * m;
    return 0;
}

/* Scratch and volumes for the particles as they are. *changed: whether any rank has others than
 * those at_start holds for. */
static int find_volumes(phase *ph, int *changed)
{
    static const double pi = 3.14159265358979323846;
    const dem_view p = dem_particles(ph->dem);
    *changed = ph->revision != p.revision;
    const int failed = phase_agree(ph, reserve(ph, p.n), changed);
    if (failed) return failed;
    for (size_t i = 0; i < p.n; i++)
        ph->V[i] = 4. / 3 * pi * p.radius[i] * p.radius[i] * p.radius[i];
    return 0;
}

static int map_particles(phase *ph)
{
    const dem_view p = dem_particles(ph->dem);
    int changed;
    const int failed = find_volumes(ph, &changed);
    if (failed) return failed;
    const cpl_status status = cpl_map_build(ph->map, p.n, p.x, p.radius, ph->V);
    if (status) return cpl_failed(ph, status, cpl_map_message(ph->map));
    double *eps = ph->eps_before;
    ph->eps_before = ph->eps;
    ph->eps = eps;
    cpl_voidage(ph->map, ph->eps);
    return 0;
}

/* Mean particle velocity of the cells. */
static void find_velocity(phase *ph)
{
    const dem_view p = dem_particles(ph->dem);
    for (size_t i = 0; i < p.n; i++)
        for (int a = 0; a < 3; a++) ph->s[i][a] = ph->V[i] * p.v[i][a];
    cpl_scatter(ph->map, 3, ph->s[0], ph->Us[0]);
    for (size_t c = 0; c < ph->mesh.n; c++) {
        const double solid = 1 - ph->eps[c];
        for (int a = 0; a < 3; a++) ph->Us[c][a] = solid > no_solid ? ph->Us[c][a] / solid : 0;
    }
}

/* Particles that have not met the fluid yet: their void fraction is still zero. */
static void welcome(phase *ph)
{
    const dem_view p = dem_particles(ph->dem);
    double *eps = dem_column(ph->dem, ph->eps_p);
    vector *L = (vector *)dem_column(ph->dem, ph->force);
    for (size_t i = 0; i < p.n; i++) {
        if (eps[i] > 0) continue;
        eps[i] = 1;
        for (int a = 0; a < 3; a++) L[i][a] = -ph->rho * ph->V[i] * ph->gravity[a];
    }
}

static int build(phase *ph, const phase_param *param)
{
    const dem_status made = dem_new(ph->comm, param->dem, &ph->dem);
    if (made) return dem_failed(ph, made);
    const cpl_status mapped = cpl_map_new_ranks(ph->comm, &ph->mesh, ph->coupling.map,
                                                ph->coupling.packing_limit, &ph->map);
    if (mapped) return cpl_failed(ph, mapped, cpl_map_message(ph->map));
    int rank;
    MPI_Comm_rank(ph->comm, &rank);
    const cpl_status opened =
        cpl_ledger_new(rank == 0 ? param->ledger : NULL, ph->coupling.ledger_tolerance,
                       param->dem->restart ? dem_time(ph->dem) : NAN, &ph->ledger);
    int failed = opened ? cpl_failed(ph, opened, cpl_ledger_message(ph->ledger)) : 0;
    if (attach(ph) || allocate_cells(ph))
        failed = phase_fail(ph, DEM_NO_MEMORY, "no memory for the particle phase");
    return phase_agree(ph, failed, NULL);
}

/* The particles meet the fluid for the first time. */
static int begin(phase *ph)
{
    welcome(ph);
    find_velocity(ph);
    return phase_drag(ph, (const double(*)[3])ph->Us);
}

/* The particles come from a restart file with what the fluid has done to them. */
static int go_on(phase *ph, const char *file)
{
    const int state[] = {ph->carried, ph->force, ph->kappa, ph->eps_p};
    int failed = 0;
    for (size_t k = 0; k < sizeof state / sizeof *state; k++)
        if (!dem_column_restored(ph->dem, state[k]))
            failed =
                phase_fail(ph, DEM_IO,
                           "restart file %s: is of a run of particles alone, with no forces of a "
                           "fluid",
                           file);
    failed = phase_agree(ph, failed, NULL);
    if (failed) return failed;
    find_velocity(ph);
    cpl_scatter(ph->map, 1, dem_column(ph->dem, ph->kappa), ph->K);
    return 0;
}

int phase_new(MPI_Comm comm, const phase_param *param, phase **result)
{
    phase *ph = *result = calloc(1, sizeof *ph);
    int lacking = !ph, any; /* nobody may wait for one that has not even this much */
    MPI_Allreduce(&lacking, &any, 1, MPI_INT, MPI_MAX, comm);
    if (any) {
        free(ph);
        *result = NULL;
        return DEM_NO_MEMORY;
    }
    MPI_Comm_dup(comm, &ph->comm);
    ph->coupling = *param->coupling;
    ph->mesh = *param->mesh;
    ph->rho = param->rho;
    ph->mu = param->mu;
    ph->inertia = inertia_matters(param);
    int failed = phase_agree(ph, check(ph, param), NULL);
    if (!failed) failed = build(ph, param);
    if (!failed) failed = map_particles(ph);
    if (failed) return failed;
    memcpy(ph->gravity, param->dem->gravity, sizeof ph->gravity);
    find_floor(ph);
    memcpy(ph->eps_before, ph->eps, ph->mesh.n * sizeof *ph->eps);
    failed = param->dem->restart ? go_on(ph, param->dem->restart) : begin(ph);
    ph->revision = UINT64_MAX;
    ph->report.map = cpl_map_last_report(ph->map);
    return failed;
}

void phase_free(phase *ph)
{
    if (!ph) return;
    cpl_map_free(ph->map);
    cpl_ledger_free(ph->ledger);
    if (ph->dem) dem_free(ph->dem);
    free(ph->block);
    free(ph->eps), free(ph->eps_before), free(ph->K), free(ph->mass_cell);
    free(ph->S), free(ph->Us), free(ph->vector_cell);
    MPI_Comm_free(&ph->comm);
    free(ph);
}

/* ---- advance --------------------------------------------------------------------------------- */

/* Hand the engine its prediction of the fluid's force; w is the velocity now. */
static int predict(phase *ph, double dt)
{
    const dem_view p = dem_particles(ph->dem);
    double *eps = dem_column(ph->dem, ph->eps_p);
    welcome(ph);
    const vector *a = ph->inertia ? (const vector *)dem_column(ph->dem, ph->acceleration) : NULL;
    if (!a) memset(ph->s, 0, p.n * sizeof *ph->s);
    cpl_predict(&ph->coupling, p.n, dt, ph->rho, eps, dem_column(ph->dem, ph->kappa), ph->V, p.mass,
                (const vector *)dem_column(ph->dem, ph->force),
                (const vector *)dem_column(ph->dem, ph->carried), a ? a : (const vector *)ph->s,
                ph->f, ph->k, ph->M);
    if (ph->inertia && p.n) memcpy(dem_column(ph->dem, ph->before), p.v, p.n * sizeof *p.v);
    const dem_status status = dem_set_outside_force(ph->dem, (const vector *)ph->f, ph->k, p.v,
                                                    ph->inertia ? ph->M : NULL);
    return status ? dem_failed(ph, status) : 0;
}

/* Mean acceleration of the particles around each in the step that was, mass-weighted. */
static void find_acceleration(phase *ph, double dt)
{
    const dem_view p = dem_particles(ph->dem);
    const vector *before = (const vector *)dem_column(ph->dem, ph->before);
    const double *eps = dem_column(ph->dem, ph->eps_p);
    for (size_t i = 0; i < p.n; i++) {
        const int came = !(eps[i] > 0); /* in this step: where it comes from says nothing */
        for (int a = 0; a < 3; a++)
            ph->s[i][a] = came ? 0 : p.mass[i] * (p.v[i][a] - before[i][a]) / dt;
    }
    cpl_scatter(ph->map, 3, ph->s[0], ph->vector_cell[0]);
    cpl_scatter(ph->map, 1, p.mass, ph->mass_cell);
    for (size_t c = 0; c < ph->mesh.n; c++)
        for (int a = 0; a < 3; a++)
            ph->vector_cell[c][a] =
                ph->mass_cell[c] > 0 ? ph->vector_cell[c][a] / ph->mass_cell[c] : 0;
    cpl_gather(ph->map, 3, ph->vector_cell[0], dem_column(ph->dem, ph->acceleration));
}

int phase_advance(phase *ph, double dt)
{
    if (!(dt > 0 && isfinite(dt)))
        return phase_fail(ph, DEM_BAD_ARGUMENT, "time step is %g s and must be positive", dt);
    const double start = MPI_Wtime();
    int changed; /* particles may have been added */
    int failed = find_volumes(ph, &changed);
    if (failed) return failed;
    ph->dt = dt;
    if (changed) ph->at_start = phase_sum(ph);
    failed = predict(ph, dt);
    if (failed) return failed;
    ph->revision = UINT64_MAX; /* none, until the step is booked */
    const dem_status moved = dem_advance(ph->dem, dt, 0);
    if (moved) return dem_failed(ph, moved);
    const double middle = MPI_Wtime();
    failed = map_particles(ph);
    if (failed) return failed;
    find_velocity(ph);
    if (ph->inertia) find_acceleration(ph, dt);
    ph->report.map = cpl_map_last_report(ph->map);
    ph->report.seconds_dem = middle - start;
    ph->report.seconds_exchange = seconds_exchange(ph);
    ph->report.seconds_map = MPI_Wtime() - middle - ph->report.seconds_exchange;
    ph->report.seconds_drag = 0;
    return 0;
}

/* ---- drag ------------------------------------------------------------------------------------ */

static void find_stiffness(phase *ph)
{
    double largest = 0;
    for (size_t c = 0; c < ph->mesh.n; c++)
        largest = fmax(largest, ph->K[c] * ph->dt / (ph->rho * ph->eps[c]));
    MPI_Allreduce(&largest, &ph->report.stiffness, 1, MPI_DOUBLE, MPI_MAX, ph->comm);
}

/* Book the time since `start`, when the exchange since the build had taken `exchange`. */
static void book_drag_time(phase *ph, double start, double exchange)
{
    const double spent = seconds_exchange(ph) - exchange;
    ph->report.seconds_exchange += spent;
    ph->report.seconds_drag += MPI_Wtime() - start - spent;
}

int phase_drag(phase *ph, const double (*U)[3])
{
    const double start = MPI_Wtime(), exchange = seconds_exchange(ph);
    const dem_view p = dem_particles(ph->dem);
    const int explicit = ph->coupling.scheme == CPL_EXPLICIT;
    double *eps = dem_column(ph->dem, ph->eps_p), *kappa = dem_column(ph->dem, ph->kappa);
    cpl_gather(ph->map, 1, ph->eps, eps);
    cpl_gather(ph->map, 3, U[0], ph->u[0]);
    for (size_t i = 0; i < p.n; i++) {
        const double d[3] = {ph->u[i][0] - p.v[i][0], ph->u[i][1] - p.v[i][1],
                             ph->u[i][2] - p.v[i][2]};
        const double slip = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        kappa[i] = cpl_drag(ph->coupling.drag, eps[i], slip, 2 * p.radius[i], ph->rho, ph->mu);
        for (int a = 0; a < 3; a++) ph->s[i][a] = kappa[i] * (explicit ? -d[a] : p.v[i][a]);
    }
    cpl_scatter(ph->map, 1, kappa, ph->K);
    cpl_scatter(ph->map, 3, ph->s[0], ph->S[0]);
    find_stiffness(ph);
    if (explicit) memset(ph->K, 0, ph->mesh.n * sizeof *ph->K);
    book_drag_time(ph, start, exchange);
    return 0;
}

/* ---- settle ---------------------------------------------------------------------------------- */

/* The particle velocity that the fluid's equation saw: v itself, or T v. */
static const vector *seen_velocity(phase *ph, const dem_view *p, const double (*tensor)[9])
{
    if (!tensor) return p->v;
    cpl_gather(ph->map, 9, tensor[0], ph->tensor);
    for (size_t i = 0; i < p->n; i++)
        for (int a = 0; a < 3; a++) {
            const double *row = ph->tensor + 9 * i + 3 * a;
            ph->s[i][a] = row[0] * p->v[i][0] + row[1] * p->v[i][1] + row[2] * p->v[i][2];
        }
    return (const vector *)ph->s;
}

static void add_seconds(phase *ph)
{
    const phase_report *r = &ph->report;
    const double part[] = {r->seconds_dem, r->seconds_map, r->seconds_exchange, r->seconds_drag};
    for (int k = 0; k < PHASE_PARTS; k++) ph->seconds[k] += part[k];
}

int phase_settle(phase *ph, const double (*u)[3], const double (*grad_p)[3],
                 const double (*tensor)[9], const double fluid_drag[3],
                 const double fluid_pressure[3])
{
    const double start = MPI_Wtime(), exchange = seconds_exchange(ph);
    const dem_view p = dem_particles(ph->dem);
    const int explicit = ph->coupling.scheme == CPL_EXPLICIT;
    /* The explicit source was made of the velocities of phase_drag, and so is the force. */
    if (!explicit) cpl_gather(ph->map, 3, u[0], ph->u[0]);
    cpl_gather(ph->map, 3, grad_p[0], ph->grad_p[0]);
    const vector *v = seen_velocity(ph, &p, explicit ? NULL : tensor);
    const double *kappa = dem_column(ph->dem, ph->kappa);
    cpl_settle(p.n, ph->dt, kappa, ph->V, (const vector *)ph->u, v, (const vector *)ph->grad_p,
               p.impulse, (vector *)dem_column(ph->dem, ph->force),
               (vector *)dem_column(ph->dem, ph->carried));
    const int failed = phase_book(ph, fluid_drag, fluid_pressure);
    book_drag_time(ph, start, exchange);
    add_seconds(ph);
    return failed;
}

/* ---- views ----------------------------------------------------------------------------------- */

const char *phase_message(const phase *ph)
{
    return ph ? ph->message : "no memory";
}

dem_sim *phase_engine(phase *ph)
{
    return ph->dem;
}

const double *phase_voidage(const phase *ph)
{
    return ph->eps;
}

const double *phase_voidage_before(const phase *ph)
{
    return ph->eps_before;
}

const double *phase_K(const phase *ph)
{
    return ph->K;
}

const double (*phase_S(const phase *ph))[3]
{
    return (const double(*)[3])ph->S;
}

const double (*phase_Us(const phase *ph))[3]
{
    return (const double(*)[3])ph->Us;
}

const double (*phase_force(const phase *ph))[3]
{
    return (const double(*)[3])dem_column(ph->dem, ph->force);
}

phase_report phase_last_report(const phase *ph)
{
    phase_report report = ph->report;
    report.dem = dem_last_report(ph->dem);
    return report;
}
