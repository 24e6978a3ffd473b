/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * book.c - sums over the particles of a step and its entry in the ledger.
 *
 * Sums that are compared are compensated (tally.h), so that a residual of 1e-12 means something with
 * a million particles; their scales are plain sums of magnitudes. The exchange is measured against
 * kappa (|u| + |v|) + V |grad p| rather than the net force, because that is what the fluid's
 * equation rounds: at high stiffness K U and S nearly cancel.
 */
#include "state.h"
#include "tally.h"

#include <math.h>

static double size(const double x[3])
{
    return fabs(x[0]) + fabs(x[1]) + fabs(x[2]);
}

static void add(tally s[3], double factor, const double x[3])
{
    for (int a = 0; a < 3; a++) tally_add(&s[a], factor * x[a]);
}

static void total(const tally s[3], double x[3])
{
    for (int a = 0; a < 3; a++) x[a] = tally_total(&s[a]);
}

/* Sums of this rank. The exchange scale needs u and grad_p of phase_settle and is added there. */
static phase_sums local_sums(const phase *ph)
{
    const dem_view p = dem_particles(ph->dem);
    const vector *C = (const vector *)dem_column(ph->dem, ph->carried);
    const vector *L = (const vector *)dem_column(ph->dem, ph->force);
    tally momentum[3] = {{0, 0}}, carried[3] = {{0, 0}}, delivered[3] = {{0, 0}};
    tally force[3] = {{0, 0}};
    phase_sums s = {.mass = 0};
    for (size_t i = 0; i < p.n; i++) {
        add(momentum, p.mass[i], p.v[i]);
        add(carried, 1, C[i]);
        add(delivered, 1, p.impulse[i]);
        add(force, 1, L[i]);
        s.speed_scale += p.mass[i] * size(p.v[i]);
        s.carried_scale += size(C[i]);
        s.impulse_scale += size(p.impulse[i]);
        s.mass += p.mass[i];
        for (int a = 0; a < 3; a++) s.moment += p.mass[i] * ph->up[a] * p.x[i][a];
    }
    total(momentum, s.momentum);
    total(carried, s.carried);
    total(delivered, s.delivered);
    total(force, s.force);
    dem_removed_column(ph->dem, ph->carried, s.gone);
    return s;
}

static phase_sums reduce(const phase *ph, const phase_sums *local)
{
    phase_sums all;
    MPI_Allreduce(local, &all, PHASE_SUMS, MPI_DOUBLE, MPI_SUM, ph->comm);
    return all;
}

phase_sums phase_sum(const phase *ph)
{
    const phase_sums local = local_sums(ph);
    return reduce(ph, &local);
}

/* N, this rank: magnitudes of all that passed between fluid and particles. */
static double exchange_scale(const phase *ph)
{
    const dem_view p = dem_particles(ph->dem);
    const double *kappa = dem_column(ph->dem, ph->kappa);
    double sum = 0;
    for (size_t i = 0; i < p.n; i++)
        sum += kappa[i] * (size(ph->u[i]) + size(p.v[i])) + ph->V[i] * size(ph->grad_p[i]);
    return sum;
}

int phase_book(phase *ph, const double fluid_drag[3], const double fluid_pressure[3])
{
    phase_sums local = local_sums(ph);
    local.exchange_scale = exchange_scale(ph);
    const phase_sums now = reduce(ph, &local), start = ph->at_start;
    const dem_report dem = dem_last_report(ph->dem);
    cpl_entry e = {.time = dem_time(ph->dem),
                   .particle_volume = ph->report.map.solid_volume,
                   .mapped_volume = ph->report.map.mapped_volume,
                   .moved_volume = ph->report.map.moved_volume};
    for (int a = 0; a < 3; a++) {
        e.fluid_drag[a] = fluid_drag[a] * ph->dt;
        e.fluid_pressure[a] = fluid_pressure[a] * ph->dt;
        e.particle_force[a] = now.force[a] * ph->dt;
        e.delivered[a] = now.delivered[a] + dem.removed_impulse[a];
        e.carried_before[a] = start.carried[a];
        e.carried[a] = now.carried[a];
        e.momentum_before[a] = start.momentum[a];
        e.momentum[a] = now.momentum[a];
        e.gravity[a] = dem.gravity_impulse[a];
        e.walls[a] = dem.wall_impulse[a];
        e.supply[a] = dem.fed_momentum[a] - dem.removed_momentum[a];
        e.gone[a] = now.gone[a] - dem.removed_impulse[a];
    }
    const double impulses = now.impulse_scale + size(dem.removed_impulse);
    e.scale = now.exchange_scale * ph->dt + now.carried_scale + start.carried_scale + impulses;
    e.momentum_scale = now.speed_scale + start.speed_scale + impulses + size(e.gravity) +
                       size(e.walls) + size(dem.fed_momentum) + size(dem.removed_momentum);
    ph->report.height =
        now.mass > 0 && size(ph->up) > 0 ? 2 * (now.moment / now.mass - ph->floor) : 0;
    ph->at_start = now;
    ph->revision = dem_particles(ph->dem).revision;
    const cpl_status status = cpl_ledger_book(ph->ledger, &e);
    ph->report.ledger_residual = cpl_ledger_residual(ph->ledger);
    const int failed =
        status ? phase_fail(ph, DEM_IO + status, "%s", cpl_ledger_message(ph->ledger)) : 0;
    return phase_agree(ph, failed, NULL); /* the first rank alone writes the file */
}
