/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * plan.c - steps, outputs and restart files in time.
 *
 * deltaT is shortened so that output falls on whole steps. The ends of steps are counted from where
 * the run once began, and rounded to 15 digits, as many as a number in a dictionary keeps: so they
 * do not depend on how often the run was interrupted, and a run that ended at .3 and goes on to .6
 * has gone through the same times as one that went to .6 at once. A restart that does not lie on
 * the steps of the plan, because deltaT has changed or the run ended between them, counts from
 * there.
 */
#include "felmiDEM.h"

#include <math.h>
#include <stdlib.h>

static double rounded(double time)
{
    char text[32];
    snprintf(text, sizeof text, "%.15g", time);
    return strtod(text, NULL);
}

static long whole(double number)
{
    return (long)fmin(fmax(ceil(number * (1. - 1e-9)), 1.), 1e9);
}

static plan plan_from(const case_control *control, double origin)
{
    plan p = {.origin = origin, .end = control->end_time};
    const double span = p.end - p.origin;
    const double interval = fmin(control->write_interval, span);
    p.per_output = whole(interval / control->delta_t);
    p.delta_t = interval / (double)p.per_output;
    p.steps = (long)ceil(span / p.delta_t * (1. - 1e-9));
    p.per_restart = control->restart_write ? whole(control->restart_interval / p.delta_t) : 0;
    return p;
}

plan plan_of(const case_control *control, double origin, double now)
{
    plan p = plan_from(control, origin);
    p.first = lrint((now - origin) / p.delta_t);
    if (fabs(origin + (double)p.first * p.delta_t - now) <= 1e-6 * p.delta_t) return p;
    return plan_from(control, now);
}

double plan_time(const plan *p, long step)
{
    return step >= p->steps ? p->end : rounded(p->origin + (double)step * p->delta_t);
}
