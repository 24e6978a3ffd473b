/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * motion.c - place and velocity of rigid walls as functions of time.
 *
 * A motion maps x to o + s(t) + R(t) (x - o) and knows the time derivatives in closed form, so
 * that place and velocity at any time need no history: a restart continues where it was, and the
 * velocity that friction feels is that with which the surface really goes.
 *
 *     translation   s = c T(t)                       T' = min(t/ramp, 1), T(0) = 0
 *     rotation      R = exp(rate T(t) [a])           about the axis a through o
 *     oscillation   s = c sin(2 pi f t + phase)
 *     rocking       R = exp(A sin(2 pi f t + phase) [a])
 *     table         s(t), rotation vector q(t): R = exp([q])
 *
 * A rotation vector of length b turns at W = q' + (1 - cos b)/b^2 q x q' + (b - sin b)/b^3
 * q x (q x q'), for which |W| <= |q'| (Chirikjian, Stochastic Models, Information Theory, and Lie
 * Groups 2, 2012, doi:10.1007/978-0-8176-4944-9, ch. 10).
 *
 * The rows of a table are joined by cubic splines with continuous acceleration. Their ends are
 * clamped, with the slope zero, because the wall rests before the first row and after the last: the
 * velocity has no jump anywhere (de Boor, A Practical Guide to Splines, 1978, ch. IV). With the
 * slopes m_i at the rows and D_i = (y_{i+1} - y_i)/h_i,
 *
 *     m_{i-1}/h_{i-1} + 2 (1/h_{i-1} + 1/h_i) m_i + m_{i+1}/h_i = 3 (D_{i-1}/h_{i-1} + D_i/h_i).
 *
 * Several motions are applied one after the other, x2 = T2(T1(x)): the axis of a later one stands
 * in space, that of an earlier one is carried along.
 */
#include "motion.h"

#include <gsl/gsl_linalg.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

dem_motion dem_motion_default(void)
{
    dem_motion m;
    memset(&m, 0, sizeof m);
    m.kind = DEM_TRANSLATION;
    m.end = INFINITY;
    return m;
}

/* ---- checks ---------------------------------------------------------------------------------- */

static int finite3(const double a[3])
{
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]);
}

static double length(const double a[3])
{
    return hypot(hypot(a[0], a[1]), a[2]);
}

__attribute__((format(printf, 3, 4))) static dem_status refuse(char *message, size_t size,
                                                               const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(message, size, format, list);
    va_end(list);
    return DEM_BAD_ARGUMENT;
}

static dem_status check_table(const dem_motion *m, char *message, size_t size)
{
    if (m->n < 2 || !m->time)
        return refuse(message, size, "a table of %zu rows, must have two or more", m->n);
    if (!m->shift && !m->turn)
        return refuse(message, size, "a table without shift or turn; one of them is needed");
    for (size_t i = 0; i < m->n; i++) {
        if (!isfinite(m->time[i]) || (i && !(m->time[i] > m->time[i - 1])))
            return refuse(message, size, "row %zu: time %g s must be finite and later than %g",
                          i + 1, m->time[i], i ? m->time[i - 1] : -INFINITY);
        if ((m->shift && !finite3(m->shift[i])) || (m->turn && !finite3(m->turn[i])))
            return refuse(message, size, "row %zu: shift and turn must be finite", i + 1);
    }
    return DEM_OK;
}

dem_status motion_check(const dem_motion *m, char *message, size_t size)
{
    const double *v = m->vector;
    int turns = m->kind == DEM_ROTATION || m->kind == DEM_ROCKING;
    int swings = m->kind == DEM_OSCILLATION || m->kind == DEM_ROCKING;
    if ((int)m->kind < DEM_TRANSLATION || m->kind > DEM_TABLE)
        return refuse(message, size,
                      "kind %d is none of translation, rotation, oscillation, "
                      "rocking, table",
                      (int)m->kind);
    if (!isfinite(m->begin) || !(m->end > m->begin))
        return refuse(message, size, "begin %g s must be finite and before end %g s", m->begin,
                      m->end);
    if (m->kind == DEM_TABLE) {
        if (!finite3(m->origin)) return refuse(message, size, "the origin must be finite");
        return check_table(m, message, size);
    }
    if (!(m->ramp >= 0) || !isfinite(m->ramp))
        return refuse(message, size, "ramp %g s must be >= 0", m->ramp);
    if (!finite3(v) || !finite3(m->origin))
        return refuse(message, size, "vector (%g %g %g) and origin (%g %g %g) must be finite", v[0],
                      v[1], v[2], m->origin[0], m->origin[1], m->origin[2]);
    if (turns && !(length(v) > 0))
        return refuse(message, size, "the axis (%g %g %g) has no direction", v[0], v[1], v[2]);
    if (m->kind == DEM_ROTATION && !isfinite(m->rate))
        return refuse(message, size, "rate %g rad/s must be finite", m->rate);
    if (swings && (!(m->frequency > 0) || !isfinite(m->frequency) || !isfinite(m->phase)))
        return refuse(message, size, "frequency %g Hz must be > 0 and phase %g rad finite",
                      m->frequency, m->phase);
    if (m->kind == DEM_ROCKING && !isfinite(m->amplitude))
        return refuse(message, size, "amplitude %g rad must be finite", m->amplitude);
    return DEM_OK;
}

/* ---- tables ---------------------------------------------------------------------------------- */

/* Slopes of the clamped spline through column c. `work` holds 4 n doubles. */
static int solve_slopes(leg *l, int c, double *work)
{
    size_t n = l->motion.n;
    double *diagonal = work, *above = work + n, *below = work + 2 * n, *right = work + 3 * n;
    diagonal[0] = diagonal[n - 1] = 1;
    above[0] = below[n - 2] = right[0] = right[n - 1] = 0;
    for (size_t i = 1; i + 1 < n; i++) {
        double h0 = l->time[i] - l->time[i - 1], h1 = l->time[i + 1] - l->time[i];
        double d0 = (l->value[i][c] - l->value[i - 1][c]) / h0;
        double d1 = (l->value[i + 1][c] - l->value[i][c]) / h1;
        diagonal[i] = 2 * (1 / h0 + 1 / h1);
        below[i - 1] = 1 / h0;
        above[i] = 1 / h1;
        right[i] = 3 * (d0 / h0 + d1 / h1);
    }
    gsl_vector_view vd = gsl_vector_view_array(diagonal, n), vr = gsl_vector_view_array(right, n);
    gsl_vector_view va = gsl_vector_view_array(above, n - 1);
    gsl_vector_view vb = gsl_vector_view_array(below, n - 1);
    gsl_vector_view slope = gsl_vector_view_array_with_stride(&l->slope[0][c], 6, n);
    return gsl_linalg_solve_tridiag(&vd.vector, &va.vector, &vb.vector, &vr.vector, &slope.vector);
}

/* Largest |dy/dt| of column c between rows i and i + 1: at an end or where y'' = 0. */
static double steepest(const leg *l, size_t i, int c)
{
    double h = l->time[i + 1] - l->time[i];
    double d = (l->value[i + 1][c] - l->value[i][c]) / h;
    double m0 = l->slope[i][c], m1 = l->slope[i + 1][c];
    /* y' = m0 + u (6 d - 4 m0 - 2 m1) + u^2 (3 m0 + 3 m1 - 6 d) */
    double b = 6 * d - 4 * m0 - 2 * m1, a = 3 * (m0 + m1 - 2 * d), u = -b / (2 * a);
    double most = fmax(fabs(m0), fabs(m1));
    return u > 0 && u < 1 ? fmax(most, fabs(m0 + u * (b + u * a))) : most;
}

static dem_status table_init(leg *l)
{
    const dem_motion *m = &l->motion;
    size_t n = m->n;
    double *work = malloc(4 * n * sizeof *work);
    l->time = malloc(n * sizeof *l->time);
    l->value = calloc(n, sizeof *l->value);
    l->slope = calloc(n, sizeof *l->slope);
    if (!work || !l->time || !l->value || !l->slope) {
        free(work);
        return DEM_NO_MEMORY;
    }
    memcpy(l->time, m->time, n * sizeof *l->time);
    for (size_t i = 0; i < n; i++)
        for (int a = 0; a < 3; a++) {
            l->value[i][a] = m->shift ? m->shift[i][a] : 0;
            l->value[i][3 + a] = m->turn ? m->turn[i][a] : 0;
        }
    int failed = 0;
    for (int c = 0; c < 6; c++) failed |= solve_slopes(l, c, work);
    free(work);
    for (size_t i = 0; i + 1 < n; i++) {
        double top[6];
        for (int c = 0; c < 6; c++) top[c] = steepest(l, i, c);
        l->speed = fmax(l->speed, length(top));
        l->spin = fmax(l->spin, length(top + 3));
    }
    l->motion.time = l->time;
    l->motion.shift = l->motion.turn = NULL; /* they are the caller's */
    return failed ? DEM_NO_MEMORY : DEM_OK;
}

/* Shift and rotation vector at the time t since `begin`, and their rates. */
static void table_at(const leg *l, double t, double y[6], double rate[6])
{
    size_t low = 0, high = l->motion.n - 1;
    double first = l->time[0], last = l->time[high];
    double moving = t > first && t < last;
    t = t < first ? first : t > last ? last : t;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (l->time[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    double h = l->time[high] - l->time[low], u = (t - l->time[low]) / h;
    for (int c = 0; c < 6; c++) {
        double y0 = l->value[low][c], step = l->value[high][c] - y0;
        double m0 = h * l->slope[low][c], m1 = h * l->slope[high][c];
        double b = 3 * step - 2 * m0 - m1, a = m0 + m1 - 2 * step;
        y[c] = y0 + u * (m0 + u * (b + u * a));
        rate[c] = moving * (m0 + u * (2 * b + u * 3 * a)) / h;
    }
}

/* ---- life cycle ------------------------------------------------------------------------------ */

static dem_status leg_init(leg *l, const dem_motion *m)
{
    l->motion = *m;
    l->motion.time = NULL;
    double full = length(m->vector), pulse = 2 * M_PI * m->frequency;
    switch (m->kind) {
    case DEM_TRANSLATION:
        l->speed = full;
        break;
    case DEM_OSCILLATION:
        l->speed = full * pulse;
        break;
    case DEM_ROTATION:
    case DEM_ROCKING:
        for (int a = 0; a < 3; a++) l->motion.vector[a] = m->vector[a] / full;
        l->spin = fabs(m->kind == DEM_ROTATION ? m->rate : m->amplitude * pulse);
        break;
    default:
        l->motion.time = m->time;
        return table_init(l);
    }
    return DEM_OK;
}

dem_status path_init(path *p, size_t n, const dem_motion *motion)
{
    memset(p, 0, sizeof *p);
    if (!n) return DEM_OK;
    p->leg = calloc(n, sizeof *p->leg);
    if (!p->leg) return DEM_NO_MEMORY;
    p->n = n;
    dem_status status = DEM_OK;
    for (size_t k = 0; k < n && !status; k++) status = leg_init(&p->leg[k], &motion[k]);
    return status;
}

void path_free(path *p)
{
    for (size_t k = 0; k < p->n; k++) {
        free(p->leg[k].time);
        free(p->leg[k].value);
        free(p->leg[k].slope);
    }
    free(p->leg);
    memset(p, 0, sizeof *p);
}

/* ---- place and velocity ---------------------------------------------------------------------- */

static const pose at_rest = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* R = 1 + sin(b)/b [q] + (1 - cos b)/b^2 [q]^2 with b = |q| (Rodrigues). */
static void set_rotation(const double q[3], double R[9])
{
    double b = length(q), s = b > 0 ? sin(b) / b : 1, half = b > 0 ? sin(.5 * b) / b : .5;
    double c = 2 * half * half; /* (1 - cos b)/b^2 without loss of digits */
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) R[3 * i + j] = (i == j) * (1 - c * b * b) + c * q[i] * q[j];
    R[1] -= s * q[2];
    R[2] += s * q[1];
    R[3] += s * q[2];
    R[5] -= s * q[0];
    R[6] -= s * q[1];
    R[7] += s * q[0];
}

/* Spin of the rotation vector q that changes at the rate dq. */
static void set_spin(const double q[3], const double dq[3], double w[3])
{
    double b = length(q), once[3], twice[3];
    cross(q, dq, once);
    cross(q, once, twice);
    double half = b > 0 ? sin(.5 * b) / b : .5, c = 2 * half * half;
    /* The closed form loses its digits where b is small; the next term of the series is b^4/5040.
     */
    double d = b < .01 ? 1. / 6 - b * b / 120 : (b - sin(b)) / (b * b * b);
    for (int a = 0; a < 3; a++) w[a] = dq[a] + c * once[a] + d * twice[a];
}

/* The angle q about the motion's axis, which changes at the rate dq. */
static void turn_about_axis(const dem_motion *m, double q, double dq, pose *p)
{
    double vector[3];
    for (int a = 0; a < 3; a++) {
        vector[a] = q * m->vector[a];
        p->spin[a] = dq * m->vector[a];
    }
    set_rotation(vector, p->rotation);
}

/* `ago` before `time`, but no earlier than it began if it has begun at `time`. */
static pose leg_pose(const leg *l, double time, double ago)
{
    const dem_motion *m = &l->motion;
    time = time >= m->begin && time - ago < m->begin ? m->begin : time - ago;
    pose p = at_rest;
    double y[6] = {0}, rate[6] = {0};
    double t = time < m->begin ? 0 : (time < m->end ? time : m->end) - m->begin;
    double angle = 2 * M_PI * m->frequency * t + m->phase, pulse = 2 * M_PI * m->frequency;
    double run = t < m->ramp ? .5 * t * t / m->ramp : t - .5 * m->ramp;
    double pace = t < m->ramp ? t / m->ramp : 1;
    double moving = time >= m->begin && time < m->end;
    switch (m->kind) {
    case DEM_TRANSLATION:
        for (int a = 0; a < 3; a++) y[a] = run * m->vector[a];
        for (int a = 0; a < 3; a++) rate[a] = pace * m->vector[a];
        break;
    case DEM_OSCILLATION:
        for (int a = 0; a < 3; a++) y[a] = sin(angle) * m->vector[a];
        for (int a = 0; a < 3; a++) rate[a] = pulse * cos(angle) * m->vector[a];
        break;
    case DEM_ROTATION:
        turn_about_axis(m, m->rate * run, m->rate * pace, &p);
        break;
    case DEM_ROCKING:
        turn_about_axis(m, m->amplitude * sin(angle), m->amplitude * pulse * cos(angle), &p);
        break;
    default:
        table_at(l, t, y, rate);
        set_rotation(y + 3, p.rotation);
        set_spin(y + 3, rate + 3, p.spin);
    }
    /* o + s + R (x - o); V is the velocity of the image of x = 0. */
    double back[3], lever[3], turning[3];
    pose_turn(&p, m->origin, back);
    for (int a = 0; a < 3; a++) {
        p.spin[a] *= moving;
        lever[a] = -back[a];
        p.place[a] = y[a] + (m->origin[a] - back[a]);
    }
    cross(p.spin, lever, turning);
    for (int a = 0; a < 3; a++) p.velocity[a] = moving * rate[a] + turning[a];
    return p;
}

/* `second` after `first`. */
static pose compose(const pose *first, const pose *second)
{
    pose p;
    pose_apply(second, first->place, p.place);
    double through[3], spin[3];
    pose_velocity(second, p.place, p.velocity);
    pose_turn(second, first->velocity, through);
    pose_turn(second, first->spin, spin);
    for (int a = 0; a < 3; a++) {
        p.velocity[a] += through[a];
        p.spin[a] = second->spin[a] + spin[a];
        for (int b = 0; b < 3; b++) {
            p.rotation[3 * a + b] = 0;
            for (int c = 0; c < 3; c++)
                p.rotation[3 * a + b] += second->rotation[3 * a + c] * first->rotation[3 * c + b];
        }
    }
    return p;
}

pose path_before(const path *path, double time, double ago)
{
    if (!path->n) return at_rest;
    pose p = leg_pose(&path->leg[0], time, ago);
    for (size_t k = 1; k < path->n; k++) {
        pose next = leg_pose(&path->leg[k], time, ago);
        p = compose(&p, &next);
    }
    return p;
}

pose path_pose(const path *path, double time)
{
    return path_before(path, time, 0);
}

/* Distance of x from the axis of a motion, or from the point it turns about. */
static double lever_of(const dem_motion *m, const double x[3])
{
    double d[3] = {x[0] - m->origin[0], x[1] - m->origin[1], x[2] - m->origin[2]}, off[3];
    if (m->kind == DEM_TABLE) return length(d);
    cross(m->vector, d, off);
    return length(off);
}

double path_speed(const path *path, double time, const double lo[3], const double hi[3])
{
    double most = 0;
    for (int corner = 0; corner < 8; corner++) {
        double x[3], y[3], sum = 0;
        for (int a = 0; a < 3; a++) x[a] = corner >> a & 1 ? hi[a] : lo[a];
        for (size_t k = 0; k < path->n; k++) {
            const leg *l = &path->leg[k];
            const dem_motion *m = &l->motion;
            int over =
                time >= m->end || (m->kind == DEM_TABLE && time - m->begin >= l->time[m->n - 1]);
            if (!over && l->spin > 0) sum += l->spin * lever_of(m, x);
            if (!over) sum += l->speed;
            pose p = leg_pose(l, time, 0);
            pose_apply(&p, x, y);
            memcpy(x, y, sizeof x);
        }
        most = fmax(most, sum);
    }
    return most;
}
