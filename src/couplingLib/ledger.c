/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * ledger.c - the books of volume and momentum, one row a coupled step.
 *
 * Four balances must close to rounding, whatever the flow does:
 *
 *     volume     mapped volume                       = volume of the particles
 *     exchange   what the fluid's equation lost      = what the particles were booked
 *     carry      carried - carried before            = booked - delivered - gone
 *     momentum   momentum of particles - before      = gravity + walls + delivered + supply
 *
 * Particles that come bring their momentum, those that leave take it: supply. What was owed to them
 * they take along too: what had been carried for them, less what was delivered to them in the step
 * and is booked to nobody any more.
 *
 * The residual of a balance is its difference (Euclidean norm) over a scale: the volume of the
 * particles, the magnitudes of the exchanged impulses, or the magnitudes of the particles' momenta
 * and impulses. A difference without a scale counts as infinite.
 *
 * The file is comma-separated text; lines that start with # explain the columns.
 */
#include "cpl.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VOLUME, EXCHANGE, CARRY, MOMENTUM, BALANCES };
static const char *const balance[BALANCES] = {"volume", "exchange", "carry", "particle momentum"};
static const char *const meaning[BALANCES] = {
    "solid volume on the mesh against the volume of the particles",
    "impulse lost by the fluid against the impulse booked for the particles",
    "change of the carried impulse against booked less delivered impulse, less what left",
    "change of the particles' momentum against gravity, walls, delivered impulse and supply"};

struct cpl_ledger {
    FILE *file;
    double tolerance;
    double residual[BALANCES];
    char message[512];
};

static const char header[] =
    "# Ledger of the coupling: one row a step, sums over the domain, SI units.\n"
    "# time: end of the step, s\n"
    "# particle_volume, mapped_volume: of the particles, and of the solid on the mesh, m3;\n"
    "#   moved_volume: moved to neighbour cells by the packing limit, m3\n"
    "# fluid_drag, fluid_pressure: impulse the fluid's equation lost by drag and by the pressure\n"
    "#   gradient on the solid fraction, N s; particle_force: impulse booked for the particles\n"
    "# delivered: impulse the particles received from the fluid's predicted force, N s\n"
    "# carried_before, carried: impulse booked and not yet delivered, N s\n"
    "# momentum_before, momentum: of the particles, kg m/s; gravity, walls: impulses on them, N s\n"
    "# supply: momentum of particles that came, less that of those that left, kg m/s;\n"
    "#   gone: impulse carried for those that left, less what they were delivered in the step, N "
    "s\n"
    "# scale, momentum_scale: sums of magnitudes the residuals are relative to, N s\n"
    "# residual_volume, _exchange, _carry, _momentum: relative residuals of the four balances\n"
    "time,particle_volume,mapped_volume,moved_volume,"
    "fluid_drag_x,fluid_drag_y,fluid_drag_z,fluid_pressure_x,fluid_pressure_y,fluid_pressure_z,"
    "particle_force_x,particle_force_y,particle_force_z,delivered_x,delivered_y,delivered_z,"
    "carried_before_x,carried_before_y,carried_before_z,carried_x,carried_y,carried_z,"
    "momentum_before_x,momentum_before_y,momentum_before_z,momentum_x,momentum_y,momentum_z,"
    "gravity_x,gravity_y,gravity_z,walls_x,walls_y,walls_z,supply_x,supply_y,supply_z,"
    "gone_x,gone_y,gone_z,scale,momentum_scale,"
    "residual_volume,residual_exchange,residual_carry,residual_momentum\n";

static cpl_status open_file(cpl_ledger *ledger, const char *directory, double from)
{
    if (directory[0] == 0) {
        snprintf(ledger->message, sizeof ledger->message,
                 "cannot write ledger.csv: no directory given");
        return CPL_IO;
    }
    const size_t size = strlen(directory) + sizeof "/ledger.csv";
    char *path = malloc(size);
    if (!path) return CPL_NO_MEMORY;
    snprintf(path, size, "%s/ledger.csv", directory);
    ledger->file = cpl_table_open(path, header, from, ledger->message, sizeof ledger->message);
    free(path);
    return ledger->file ? CPL_OK : CPL_IO;
}

cpl_status cpl_ledger_new(const char *directory, double tolerance, double from, cpl_ledger **result)
{
    cpl_ledger *ledger = *result = calloc(1, sizeof *ledger);
    if (!ledger) return CPL_NO_MEMORY;
    ledger->tolerance = tolerance;
    if (!(tolerance > 0)) {
        snprintf(ledger->message, sizeof ledger->message,
                 "tolerance of the ledger is %g and must be positive", tolerance);
        return CPL_BAD_ARGUMENT;
    }
    return directory ? open_file(ledger, directory, from) : CPL_OK;
}

void cpl_ledger_free(cpl_ledger *ledger)
{
    if (!ledger) return;
    if (ledger->file) fclose(ledger->file);
    free(ledger);
}

static double relative(double difference, double scale)
{
    if (difference == 0) return 0;
    return scale > 0 ? difference / scale : HUGE_VAL;
}

static double norm(const double d[3])
{
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static void balances(const cpl_entry *e, double residual[BALANCES])
{
    double exchange[3], carry[3], momentum[3];
    for (int a = 0; a < 3; a++) {
        exchange[a] = e->fluid_drag[a] + e->fluid_pressure[a] - e->particle_force[a];
        carry[a] = e->carried[a] - e->carried_before[a] - e->particle_force[a] + e->delivered[a] +
                   e->gone[a];
        momentum[a] = e->momentum[a] - e->momentum_before[a] - e->gravity[a] - e->walls[a] -
                      e->delivered[a] - e->supply[a];
    }
    residual[VOLUME] = relative(fabs(e->mapped_volume - e->particle_volume), e->particle_volume);
    residual[EXCHANGE] = relative(norm(exchange), e->scale);
    residual[CARRY] = relative(norm(carry), e->scale);
    residual[MOMENTUM] = relative(norm(momentum), e->momentum_scale);
}

static void write_row(FILE *file, const cpl_entry *e, const double residual[BALANCES])
{
    const double *vectors[] = {e->fluid_drag,      e->fluid_pressure, e->particle_force,
                               e->delivered,       e->carried_before, e->carried,
                               e->momentum_before, e->momentum,       e->gravity,
                               e->walls,           e->supply,         e->gone};
    fprintf(file, "%.12g,%.16g,%.16g,%.6g", e->time, e->particle_volume, e->mapped_volume,
            e->moved_volume);
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++)
        fprintf(file, ",%.16g,%.16g,%.16g", vectors[i][0], vectors[i][1], vectors[i][2]);
    fprintf(file, ",%.6g,%.6g", e->scale, e->momentum_scale);
    for (int b = 0; b < BALANCES; b++) fprintf(file, ",%.3e", residual[b]);
    fputc('\n', file);
}

cpl_status cpl_ledger_book(cpl_ledger *ledger, const cpl_entry *entry)
{
    balances(entry, ledger->residual);
    if (ledger->file) {
        write_row(ledger->file, entry, ledger->residual);
        if (fflush(ledger->file) != 0) { /* so that a run can be watched */
            snprintf(ledger->message, sizeof ledger->message,
                     "time %g s: the ledger cannot be written", entry->time);
            return CPL_IO;
        }
    }
    for (int b = 0; b < BALANCES; b++)
        if (!(ledger->residual[b] <= ledger->tolerance)) { /* a NaN does not balance */
            snprintf(ledger->message, sizeof ledger->message,
                     "time %.9g s: balance of %s is off by %.3e relative, tolerance %.1e (%s)",
                     entry->time, balance[b], ledger->residual[b], ledger->tolerance, meaning[b]);
            return CPL_IMBALANCE;
        }
    return CPL_OK;
}

double cpl_ledger_residual(const cpl_ledger *ledger)
{
    double largest = 0;
    for (int b = 0; b < BALANCES; b++) {
        if (isnan(ledger->residual[b])) return ledger->residual[b];
        largest = fmax(largest, ledger->residual[b]);
    }
    return largest;
}

const char *cpl_ledger_message(const cpl_ledger *ledger)
{
    return ledger ? ledger->message : "no memory";
}
