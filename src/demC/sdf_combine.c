/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * sdf_combine.c - shapes of shapes: union, intersection, complement, transform.
 *
 * Every shape is the union of its parts, each a solid with a distance of its own. A union lists
 * the parts of its members one after the other. An intersection distributes over the parts of its
 * members, (A1 u A2) n B = (A1 n B) u (A2 n B), so that its parts are all choices of one part of
 * each member; a surface of triangles counts as one there. Complements go down to the leaves by De
 * Morgan's laws.
 *
 * Union. A contact is hidden when the foot of its perpendicular, y = x - phi n, lies within
 * another member, where the surface is not bare, or upon it; of two whose feet are upon each other
 * the first one answers. (Who is nearer does not decide: distances differ by the square of the way
 * past a seam only.) So two flush solids make one contact on either side of their seam, and a
 * sphere that rolls across changes from one to the other where both are equally far: its force does
 * not step. In a concave corner both feet are bare and both members are felt.
 *
 * Intersection. With phi_k of the members at x: within, all phi_k <= 0, the largest is exact.
 * Outside, the largest is a lower bound and exact when its foot lies in all other members;
 * otherwise the nearest point is on an edge or corner where two or three surfaces meet. There
 *
 *     min |y - x|^2  with  c_i(y) <= 0
 *
 * is solved by successive linearisation of the c_i (each step a projection on a polyhedron of at
 * most three active planes), with Aitken's relaxation of the motion along a curved edge. Boxes and
 * closed bodies of revolution enter by their smooth faces.
 *
 * References: Ricci, Comput. J. 16 (1973) 157, doi:10.1093/comjnl/16.2.157 (solids by min and
 * max); Nocedal & Wright, Numerical Optimization, Springer (2006), ch. 16, 18,
 * doi:10.1007/978-0-387-40065-5.
 */
#include "band.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_FACES = 64,  /* of a part of an intersection */
    MOST_PARTS = 4096 /* of an intersection */
};

/* Of lengths compared: what rounding does to points of files in single precision and to sums. */
static const double FLUSH = 1e-7, ROUNDING = 1e-12;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double size_of(const double x[3])
{
    return fabs(x[0]) + fabs(x[1]) + fabs(x[2]);
}

/* ---- transform ------------------------------------------------------------------------------- */

static void to_member(const dem_sdf *s, const double x[3], double y[3])
{
    const double d[3] = {x[0] - s->shift[0], x[1] - s->shift[1], x[2] - s->shift[2]};
    for (int i = 0; i < 3; i++)
        y[i] = (s->turn[i] * d[0] + s->turn[3 + i] * d[1] + s->turn[6 + i] * d[2]) / s->scale;
}

static void from_member(const dem_sdf *s, double g[3])
{
    const double m[3] = {g[0], g[1], g[2]};
    for (int i = 0; i < 3; i++) g[i] = dot(s->turn + 3 * i, m);
}

/* ---- bare parts, nothing hidden -------------------------------------------------------------- */

static double bare_eval(const dem_sdf *s, int part, const double x[3], double g[3]);

/* Parts when only solids matter and no concave creases: what an intersection is made of. */
static int bare_parts(const dem_sdf *s)
{
    long n = 0;
    if (s->kind == SURFACE) return 1;
    if (s->n == 0) return s->parts;
    if (s->kind == INTERSECTION) n = 1;
    for (size_t k = 0; k < s->n; k++) {
        const int m = bare_parts(s->member[k]);
        n = s->kind == INTERSECTION ? n * m : n + m;
        if (n > MOST_PARTS) return MOST_PARTS + 1;
    }
    return (int)n;
}

/* The member of a union that has part *part, which becomes its number there. */
static const dem_sdf *member_of(const dem_sdf *s, int *part, int (*parts)(const dem_sdf *),
                                size_t *which)
{
    size_t k = 0;
    for (; k + 1 < s->n; k++) {
        const int m = parts(s->member[k]);
        if (*part < m) break;
        *part -= m;
    }
    if (which != NULL) *which = k;
    return s->member[k];
}

/* Part of member k that belongs to part `part` of an intersection: its digit. */
static int digit(const dem_sdf *s, int part, size_t k)
{
    for (size_t j = 0; j < k; j++) part /= bare_parts(s->member[j]);
    return part % bare_parts(s->member[k]);
}

/* Smooth faces c(x) <= 0 whose common solid is a part: their number, and values with gradients. */
static int faces(const dem_sdf *s, int part, const double x[3], int n, double c[],
                 double gradient[][3])
{
    if (s->kind == INTERSECTION) {
        for (size_t k = 0; k < s->n; k++)
            n = faces(s->member[k], digit(s, part, k), x, n, c, gradient);
        return n;
    }
    if (s->kind == UNION) {
        const dem_sdf *member = member_of(s, &part, bare_parts, NULL);
        return faces(member, part, x, n, c, gradient);
    }
    if (s->kind == TRANSFORM) {
        double y[3];
        const int first = n;
        to_member(s, x, y);
        n = faces(s->member[0], part, y, n, c, gradient);
        for (int i = first; i < n; i++) {
            c[i] *= s->scale;
            from_member(s, gradient[i]);
        }
        return n;
    }
    const int solid = s->kind == BOX || s->kind == REVOLVED;
    dem_sdf container;
    if (solid) {
        container = *s;
        sdf_turn_simple(&container);
    }
    for (int f = 0; f < (solid ? container.parts : 1) && n < MOST_FACES; f++, n++) {
        c[n] = solid ? -dem_sdf_eval(&container, f, x, gradient[n])
                     : bare_eval(s, part, x, gradient[n]);
        for (int i = 0; solid && i < 3; i++) gradient[n][i] = -gradient[n][i];
    }
    return n;
}

/* Not more than a part of the shape can have. */
static int most_faces(const dem_sdf *s)
{
    int sum = 0, most = s->kind == BOX ? 6 : s->kind == REVOLVED ? 3 : 1;
    for (size_t k = 0; k < s->n; k++) {
        const int m = most_faces(s->member[k]);
        sum += m;
        most = m > most ? m : most;
    }
    return s->kind == INTERSECTION ? sum : most;
}

/* ---- the nearest point of an edge or corner -------------------------------------------------- */

typedef struct corner {
    int n; /* planes, c[i] + g[i].(z - y) <= 0 */
    double c[MOST_FACES], g[MOST_FACES][3];
    int active[3], n_active;
    double z[3];
} corner;

/* Solve the symmetric system a u = b of order n <= 3; 0 when it is singular. */
static int solve(int n, double a[3][3], double b[3], double u[3])
{
    for (int i = 0; i < n; i++) {
        if (!(a[i][i] > 1e-10)) return 0; /* of unit normals: they lie in one plane */
        for (int j = i + 1; j < n; j++) {
            const double f = a[j][i] / a[i][i];
            for (int k = i; k < n; k++) a[j][k] -= f * a[i][k];
            b[j] -= f * b[i];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        u[i] = b[i];
        for (int j = i + 1; j < n; j++) u[i] -= a[i][j] * u[j];
        u[i] /= a[i][i];
    }
    return 1;
}

/* Project x on the meet of the planes in `set`; whether x is pulled on by each of them. */
static int project(const corner *q, const double x[3], const double y[3], int n, const int set[3],
                   double z[3])
{
    double a[3][3], b[3], pull[3];
    for (int i = 0; i < n; i++) {
        const double *gi = q->g[set[i]];
        b[i] = q->c[set[i]];
        for (int k = 0; k < 3; k++) b[i] += gi[k] * (x[k] - y[k]);
        for (int j = 0; j < n; j++) a[i][j] = dot(gi, q->g[set[j]]);
    }
    if (!solve(n, a, b, pull)) return 0;
    memcpy(z, x, 3 * sizeof *z);
    for (int i = 0; i < n; i++) {
        if (pull[i] < 0.) return 0;
        for (int k = 0; k < 3; k++) z[k] -= pull[i] * q->g[set[i]][k];
    }
    return 1;
}

static double violation(const corner *q, int i, const double y[3], const double z[3])
{
    return q->c[i] + q->g[i][0] * (z[0] - y[0]) + q->g[i][1] * (z[1] - y[1]) +
           q->g[i][2] * (z[2] - y[2]);
}

/* With one more plane: the subset of at most three out of four that projects x into all four. */
static int exchange(corner *q, const double x[3], const double y[3], int more, double slack)
{
    int pool[4], n = q->n_active;
    memcpy(pool, q->active, sizeof q->active);
    pool[n++] = more;
    for (int subset = 1; subset < 1 << n; subset++) {
        int set[3], m = 0, good = 1;
        double z[3];
        for (int i = 0; i < n && m < 4; i++)
            if (subset >> i & 1) {
                if (m < 3) set[m] = pool[i];
                m++;
            }
        if (m > 3 || !project(q, x, y, m, set, z)) continue;
        for (int i = 0; i < n && good; i++) good = violation(q, pool[i], y, z) <= slack;
        if (!good) continue;
        memcpy(q->active, set, sizeof set);
        q->n_active = m;
        memcpy(q->z, z, sizeof z);
        return 1;
    }
    return 0;
}

/* The point of the polyhedron nearest to x: q->z. The distance grows with every exchange, so none
 * comes back. */
static int nearest_of_polyhedron(corner *q, const double x[3], const double y[3], double slack)
{
    q->n_active = 0;
    memcpy(q->z, x, sizeof q->z);
    for (int turn = 0; turn < 4 * MOST_FACES; turn++) {
        int worst = -1;
        double most = slack;
        for (int i = 0; i < q->n; i++) {
            const double v = violation(q, i, y, q->z);
            if (v > most) {
                most = v;
                worst = i;
            }
        }
        if (worst < 0) return 1;
        if (!exchange(q, x, y, worst, slack)) return 0;
    }
    return 0;
}

/* The part of `step` along which the active planes do not change. */
static void along_edge(const corner *q, const double step[3], double tangent[3])
{
    double a[3][3], b[3], u[3];
    memcpy(tangent, step, 3 * sizeof *tangent);
    if (q->n_active == 3) memset(tangent, 0, 3 * sizeof *tangent);
    if (q->n_active == 3 || q->n_active == 0) return;
    for (int i = 0; i < q->n_active; i++) {
        b[i] = dot(q->g[q->active[i]], step);
        for (int j = 0; j < q->n_active; j++) a[i][j] = dot(q->g[q->active[i]], q->g[q->active[j]]);
    }
    if (!solve(q->n_active, a, b, u)) return;
    for (int i = 0; i < q->n_active; i++)
        for (int k = 0; k < 3; k++) tangent[k] -= u[i] * q->g[q->active[i]][k];
}

/* Nearest point y of part `part` of an intersection, y starting from a guess; 0: none found. */
static int nearest_corner(const dem_sdf *s, int part, const double x[3], double y[3])
{
    enum { TURNS = 60 };
    const double slack = 1e-15 * (size_of(x) + size_of(y)) + 1e-300;
    double before[3] = {0, 0, 0}, relax = 1.;
    corner q;
    for (int turn = 0; turn < TURNS; turn++) {
        q.n = faces(s, part, y, 0, q.c, q.g);
        if (!nearest_of_polyhedron(&q, x, y, 4. * slack)) return 0;
        double step[3], tangent[3], change[3];
        for (int k = 0; k < 3; k++) step[k] = q.z[k] - y[k];
        along_edge(&q, step, tangent);
        for (int k = 0; k < 3; k++) change[k] = tangent[k] - before[k];
        if (turn > 0 && dot(change, change) > 0.) { /* Aitken */
            relax *= -dot(before, change) / dot(change, change);
            relax = fmin(fmax(relax, .1), 3.);
        }
        memcpy(before, tangent, sizeof tangent);
        double length2 = 0.;
        for (int k = 0; k < 3; k++) {
            y[k] += step[k] - tangent[k] + relax * tangent[k];
            length2 += step[k] * step[k];
        }
        if (sqrt(length2) <= 16. * slack) return 1;
    }
    return 0;
}

/* ---- evaluation of bare parts ---------------------------------------------------------------- */

/* Largest distance over the members, its gradient, and which member it is. */
static double largest(const dem_sdf *s, int part, const double x[3], double g[3], size_t *which)
{
    double most = -INFINITY, gradient[3];
    for (size_t k = 0; k < s->n; k++) {
        const double phi = bare_eval(s->member[k], digit(s, part, k), x, gradient);
        if (!(phi > most)) continue;
        most = phi;
        *which = k;
        memcpy(g, gradient, sizeof gradient);
    }
    return most;
}

static double eval_intersection(const dem_sdf *s, int part, const double x[3], double g[3])
{
    size_t which = 0;
    const double most = largest(s, part, x, g, &which);
    if (most <= 0.) return most;
    double y[3], gradient[3];
    for (int k = 0; k < 3; k++) y[k] = x[k] - most * g[k];
    const double slack = ROUNDING * (size_of(x) + most);
    int within = 1;
    for (size_t k = 0; k < s->n && within; k++)
        within = k == which || bare_eval(s->member[k], digit(s, part, k), y, gradient) <=
                                   slack + sdf_fuzz(s->member[k]);
    if (within || !nearest_corner(s, part, x, y)) return most;
    const double d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
    const double distance = sqrt(dot(d, d));
    if (distance > slack)
        for (int k = 0; k < 3; k++) g[k] = d[k] / distance;
    return distance;
}

static double bare_eval(const dem_sdf *s, int part, const double x[3], double g[3])
{
    double y[3];
    switch (s->kind) {
    case UNION:
        s = member_of(s, &part, bare_parts, NULL);
        return bare_eval(s, part, x, g);
    case INTERSECTION:
        return eval_intersection(s, part, x, g);
    case TRANSFORM:
        to_member(s, x, y);
        const double phi = s->scale * bare_eval(s->member[0], part, y, g);
        from_member(s, g);
        return phi;
    case SURFACE:
        return sdf_eval_surface(s, -1, x, g, NULL); /* the nearest of its parts */
    default:
        return dem_sdf_eval(s, part, x, g);
    }
}

/* ---- what is felt ---------------------------------------------------------------------------- */

/* Distance of sibling j of a part: member of a union, part of an intersection. */
static double sibling(const dem_sdf *s, int j, const double x[3])
{
    double g[3];
    return s->kind == UNION ? dem_sdf_distance(s->member[j], x) : eval_intersection(s, j, x, g);
}

static void foot_of(const double x[3], double phi, const double g[3], double y[3])
{
    const double steep = sqrt(dot(g, g));
    for (int k = 0; k < 3; k++) y[k] = x[k] - phi * g[k] / steep;
}

/* The point of sibling j that is nearest to x. */
static void sibling_foot(const dem_sdf *s, int j, const double x[3], double y[3])
{
    double g[3], least = INFINITY;
    if (s->kind == INTERSECTION) {
        least = eval_intersection(s, j, x, g);
        foot_of(x, least, g, y);
        return;
    }
    for (int part = 0; part < dem_sdf_parts(s->member[j]); part++) {
        const double phi = dem_sdf_eval(s->member[j], part, x, g);
        if (!(phi < least)) continue;
        least = phi;
        foot_of(x, phi, g, y);
    }
}

/* Room for rounding, and for the error of samples, in telling that points are on sibling j. */
static double flush(const dem_sdf *s, int mine, int j, const double x[3], double phi)
{
    const double slack = ROUNDING * size_of(x) + FLUSH * fabs(phi);
    return s->kind == UNION ? slack + sdf_fuzz(s->member[mine]) + sdf_fuzz(s->member[j]) : slack;
}

/* Whether sibling `mine`, at distance phi from x with gradient g, is hidden by another one: its
 * foot is within that one, or upon it and not the other way round with `mine` the first. */
static int is_hidden(const dem_sdf *s, int mine, double phi, const double x[3], const double g[3])
{
    const int n = s->kind == UNION ? (int)s->n : s->parts;
    if (n == 1) return 0;
    double y[3], other[3];
    foot_of(x, phi, g, y);
    for (int j = 0; j < n; j++) {
        if (j == mine) continue;
        const double slack = flush(s, mine, j, x, phi);
        int off = 0;
        for (int k = 0; k < 3 && s->kind == UNION; k++)
            off |= y[k] < s->box[j][k] - slack || y[k] > s->box[j][3 + k] + slack;
        if (off) continue;
        const double depth = sibling(s, j, y);
        if (depth > slack) continue;
        if (depth < -slack || j < mine) return 1;
        sibling_foot(s, j, x, other);
        if (sibling(s, mine, other) > slack) return 1;
    }
    return 0;
}

double sdf_eval_combined(const dem_sdf *s, int part, const double x[3], double g[3])
{
    double y[3], phi;
    size_t which = (size_t)part;
    if (s->kind == TRANSFORM) {
        to_member(s, x, y);
        phi = dem_sdf_eval(s->member[0], part, y, g);
        from_member(s, g);
        return phi < SDF_HIDDEN ? s->scale * phi : SDF_HIDDEN;
    }
    if (s->kind == UNION) {
        const dem_sdf *member = member_of(s, &part, dem_sdf_parts, &which);
        phi = dem_sdf_eval(member, part, x, g);
    } else {
        phi = eval_intersection(s, part, x, g);
    }
    if (phi >= SDF_HIDDEN || is_hidden(s, (int)which, phi, x, g)) return SDF_HIDDEN;
    return phi;
}

double sdf_distance_combined(const dem_sdf *s, const double x[3])
{
    double y[3], least = INFINITY;
    if (s->kind == TRANSFORM) {
        to_member(s, x, y);
        return s->scale * dem_sdf_distance(s->member[0], y);
    }
    const int n = s->kind == UNION ? (int)s->n : s->parts;
    for (int j = 0; j < n; j++) least = fmin(least, sibling(s, j, x));
    return least;
}

int sdf_near_combined(const dem_sdf *s, int part, const double x[3], double reach)
{
    double y[3], g[3];
    size_t which;
    if (s->kind == TRANSFORM) {
        to_member(s, x, y);
        return sdf_near(s->member[0], part, y, reach / s->scale);
    }
    if (s->kind == INTERSECTION) return largest(s, part, x, g, &which) < reach;
    const dem_sdf *member = member_of(s, &part, dem_sdf_parts, NULL);
    return sdf_near(member, part, x, reach);
}

double sdf_fuzz(const dem_sdf *s)
{
    double most = 0.;
    if (s->kind == SURFACE) return s->band != NULL ? .25 * s->band->spacing : 0.;
    for (size_t k = 0; k < s->n; k++) most = fmax(most, sdf_fuzz(s->member[k]));
    return s->kind == TRANSFORM ? s->scale * most : most;
}

int sdf_count_parts(const dem_sdf *s)
{
    long n = 0;
    if (s->kind == INTERSECTION) {
        const int m = bare_parts(s);
        return m > MOST_PARTS || most_faces(s) > MOST_FACES ? 0 : m;
    }
    for (size_t k = 0; k < s->n; k++) n += s->member[k]->parts;
    return n > INT_MAX ? 0 : (int)n;
}
