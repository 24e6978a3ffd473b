/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * surface_search.c - nearest point and winding number of a surface of triangles.
 *
 * Each part has a tree of boxes, halved at the median centre along the longest side down to leaves
 * of a few triangles. The nearest point is found by descent into the nearer child first, with a
 * stack and the best distance so far as the bound.
 *
 * Side. Of the face, edge or vertex that is nearest, with its pseudonormal N (unit normal; sum of
 * the normals of two faces; sum weighted by angles): phi > 0 for (x - y).N > 0. Of a surface that
 * was mended, by the winding number w = sum Omega_i / 4 pi of the solid angles of its triangles
 * (Van Oosterom & Strackee), of far nodes of the tree by their dipole (Barill et al.).
 *
 * A part is hidden at x where its nearest point lies on an edge between parts and one that shares
 * it is nearer: x is beyond the end of the part. It is also hidden where x lies behind it and any
 * other part is nearer, as with the far side of a thin wall. What is left has the smallest distance
 * over the parts equal to the distance of the whole surface, and all of it is positive in free
 * space.
 *
 * References: C. Ericson, Real-Time Collision Detection, Morgan Kaufmann (2005), section 5.1;
 * Baerentzen & Aanaes, doi:10.1109/TVCG.2005.49; Van Oosterom & Strackee, IEEE Trans. Biomed. Eng.
 * 30 (1983) 125, doi:10.1109/TBME.1983.325207; Barill, Dickson, Schmidt, Levin & Jacobson, ACM
 * Trans. Graph. 37 (2018) 43, doi:10.1145/3197517.3201337.
 */
#include "surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF = 4, STACK = 128 }; /* triangles; twice the depth of a tree of 2^64 */

/* Distance over radius of a node beyond which its dipole stands for it: Barill et al., section 4 */
static const double FAR = 2.;
/* Relative difference of squared distances that rounding makes. */
static const double TIE = 1e-9;
static const double PI = 3.14159265358979323846;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void minus(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

/* ---- the tree -------------------------------------------------------------------------------- */

static double middle(const surface *s, uint32_t t, int axis)
{
    return s->x[s->vertex[t][0]][axis] + s->x[s->vertex[t][1]][axis] + s->x[s->vertex[t][2]][axis];
}

/* Partly sort so that order[k] is where it would be if all were: Hoare's selection. The number of
 * a triangle breaks ties, so that the result is one. */
static void select_median(const surface *s, uint32_t *order, long n, long k, int axis)
{
    long low = 0, high = n - 1;
    while (low < high) {
        const uint32_t pivot = order[(low + high) / 2];
        const double at = middle(s, pivot, axis);
        long i = low, j = high;
        while (i <= j) {
            for (;; i++) {
                const double m = middle(s, order[i], axis);
                if (!(m < at || (m == at && order[i] < pivot))) break;
            }
            for (;; j--) {
                const double m = middle(s, order[j], axis);
                if (!(m > at || (m == at && order[j] > pivot))) break;
            }
            if (i <= j) {
                const uint32_t o = order[i];
                order[i++] = order[j];
                order[j--] = o;
            }
        }
        if (k <= j)
            high = j;
        else if (k >= i)
            low = i;
        else
            return;
    }
}

/* Box of a node's triangles and their dipole. */
static void fill_node(surface *s, const uint32_t *order, uint32_t at, uint32_t first,
                      uint32_t count)
{
    surface_node *node = &s->node[at];
    surface_dipole *far = &s->dipole[at];
    double total = 0., sum[3] = {0, 0, 0};
    memset(far->area, 0, sizeof far->area);
    for (int k = 0; k < 3; k++) {
        node->lo[k] = INFINITY;
        node->hi[k] = -INFINITY;
    }
    for (uint32_t i = first; i < first + count; i++) {
        const uint32_t *v = s->vertex[order[i]];
        double a[3], b[3];
        minus(s->x[v[1]], s->x[v[0]], a);
        minus(s->x[v[2]], s->x[v[0]], b);
        double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                       a[0] * b[1] - a[1] * b[0]};
        const double area = .5 * sqrt(dot(n, n));
        total += area;
        for (int k = 0; k < 3; k++) {
            far->area[k] += .5 * n[k];
            sum[k] += area * (s->x[v[0]][k] + s->x[v[1]][k] + s->x[v[2]][k]) / 3.;
            for (int c = 0; c < 3; c++) {
                node->lo[k] = fmin(node->lo[k], s->x[v[c]][k]);
                node->hi[k] = fmax(node->hi[k], s->x[v[c]][k]);
            }
        }
    }
    double reach2 = 0.;
    for (int k = 0; k < 3; k++) {
        far->centre[k] = sum[k] / total;
        const double r = fmax(node->hi[k] - far->centre[k], far->centre[k] - node->lo[k]);
        reach2 += r * r;
    }
    far->radius = sqrt(reach2);
    node->first = first;
    node->count = count;
}

/* Build the tree of triangles order[first...first + count) below `root`. A leaf has those that
 * arrange() will put at `first` and after. */
static void build(surface *s, uint32_t *order, uint32_t root, uint32_t *used, size_t first,
                  size_t count)
{
    uint32_t stack[STACK];
    int depth = 0;
    fill_node(s, order, root, (uint32_t)first, (uint32_t)count);
    stack[depth++] = root;
    while (depth > 0) {
        surface_node *node = &s->node[stack[--depth]];
        if (node->count <= LEAF) continue;
        int axis = 0;
        for (int k = 1; k < 3; k++)
            if (node->hi[k] - node->lo[k] > node->hi[axis] - node->lo[axis]) axis = k;
        const uint32_t half = node->count / 2, begin = node->first, n = node->count;
        select_median(s, order + begin, n, half, axis);
        node->first = *used;
        node->count = 0;
        *used += 2;
        fill_node(s, order, node->first, begin, half);
        fill_node(s, order, node->first + 1, begin + half, n - half);
        stack[depth++] = node->first + 1;
        stack[depth++] = node->first;
    }
}

/* Give rows of `size` bytes the order row[i] = old row[from[i]]. */
static int permute(void *rows, size_t n, size_t size, const uint32_t *from)
{
    char *old = malloc(n * size);
    if (old == NULL) return -1;
    memcpy(old, rows, n * size);
    for (size_t i = 0; i < n; i++) memcpy((char *)rows + i * size, old + from[i] * size, size);
    free(old);
    return 0;
}

/* Put triangles and vertices in the order of the leaves: those that are near each other in space
 * are so in memory, too. */
static int arrange(surface *s, const uint32_t *order)
{
    uint32_t *to = malloc(s->n * sizeof *to), *vertex = malloc(s->n_vertex * sizeof *vertex),
             *from = malloc(s->n_vertex * sizeof *from), n = 0;
    int bad = !to || !vertex || !from;
    bad = bad || permute(s->vertex, s->n, sizeof *s->vertex, order) ||
          permute(s->beyond, s->n, sizeof *s->beyond, order) ||
          permute(s->normal, s->n, sizeof *s->normal, order);
    if (!bad) {
        for (size_t i = 0; i < s->n; i++) to[order[i]] = (uint32_t)i;
        memset(vertex, 0xff, s->n_vertex * sizeof *vertex);
        for (size_t i = 0; i < 3 * s->n; i++) {
            uint32_t *v = &s->vertex[i / 3][i % 3];
            int32_t *u = &s->beyond[i / 3][i % 3];
            if (vertex[*v] == UINT32_MAX) {
                from[n] = *v;
                vertex[*v] = n++;
            }
            *v = vertex[*v];
            if (*u >= 0) *u = (int32_t)to[*u];
            if (*u <= ACROSS) *u = ACROSS - (int32_t)to[ACROSS - *u];
        }
        bad = permute(s->x, n, sizeof *s->x, from) || permute(s->tip, n, sizeof *s->tip, from) ||
              permute(s->own, n, sizeof *s->own, from) ||
              permute(s->on_crease, n, sizeof *s->on_crease, from);
    }
    free(to);
    free(vertex);
    free(from);
    return bad ? -1 : 0;
}

int surface_index(surface *s)
{
    uint32_t used = 0, *order = malloc(s->n * sizeof *order);
    s->root = malloc((size_t)s->parts * sizeof *s->root);
    s->node = malloc(2 * s->n * sizeof *s->node);
    s->dipole = malloc(2 * s->n * sizeof *s->dipole);
    int bad = !order || !s->root || !s->node || !s->dipole;
    if (!bad) {
        for (size_t t = 0; t < s->n; t++) order[t] = (uint32_t)t;
        for (int p = 0; p < s->parts; p++) {
            s->root[p] = used++;
            build(s, order, s->root[p], &used, s->first[p], s->first[p + 1] - s->first[p]);
        }
        s->n_node = used;
        bad = arrange(s, order);
    }
    free(order);
    return bad ? -1 : 0;
}

size_t surface_memory(const surface *s)
{
    return sizeof *s + s->n_vertex * (sizeof *s->x + 2 * sizeof *s->tip + 1) +
           s->n * (sizeof *s->vertex + sizeof *s->beyond + sizeof *s->normal) +
           s->n_node * (sizeof *s->node + sizeof *s->dipole) +
           (size_t)s->parts * (2 * sizeof *s->first + 4);
}

/* ---- nearest point --------------------------------------------------------------------------- */

/* Nearest point of a triangle, by the region in whose shadow x lies: corner, edge or face. */
static void nearest_of_triangle(const surface *s, uint32_t t, const double x[3], surface_hit *hit)
{
    const double *a = s->x[s->vertex[t][0]], *b = s->x[s->vertex[t][1]], *c = s->x[s->vertex[t][2]];
    double ab[3], ac[3], ap[3], bp[3], cp[3];
    minus(b, a, ab);
    minus(c, a, ac);
    minus(x, a, ap);
    minus(x, b, bp);
    minus(x, c, cp);
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp),
                 d5 = dot(ab, cp), d6 = dot(ac, cp);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    double v = 0., w = 0.; /* y = a + v ab + w ac */
    hit->triangle = t;
    if (d1 <= 0. && d2 <= 0.) {
        hit->feature = 0;
    } else if (d3 >= 0. && d4 <= d3) {
        hit->feature = 1;
        v = 1.;
    } else if (d6 >= 0. && d5 <= d6) {
        hit->feature = 2;
        w = 1.;
    } else if (vc <= 0. && d1 >= 0. && d3 <= 0.) {
        hit->feature = 3;
        v = d1 / (d1 - d3);
    } else if (va <= 0. && d4 >= d3 && d5 >= d6) {
        hit->feature = 4;
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        v = 1. - w;
    } else if (vb <= 0. && d2 >= 0. && d6 <= 0.) {
        hit->feature = 5;
        w = d2 / (d2 - d6);
    } else {
        const double height = dot(ap, s->normal[t]);
        hit->feature = 6;
        hit->d2 = height * height;
        for (int k = 0; k < 3; k++) hit->y[k] = x[k] - height * s->normal[t][k];
        return;
    }
    double off[3];
    for (int k = 0; k < 3; k++) hit->y[k] = a[k] + v * ab[k] + w * ac[k];
    minus(x, hit->y, off);
    hit->d2 = dot(off, off);
}

static double box_distance2(const surface_node *node, const double x[3])
{
    double sum = 0.;
    for (int k = 0; k < 3; k++) {
        const double d = fmax(fmax(node->lo[k] - x[k], x[k] - node->hi[k]), 0.);
        sum += d * d;
    }
    return sum;
}

static int search(const surface *s, uint32_t root, const double x[3], surface_hit *hit)
{
    struct {
        uint32_t node;
        double d2;
    } stack[STACK];
    int depth = 0, found = 0;
    stack[depth].node = root;
    stack[depth++].d2 = box_distance2(&s->node[root], x);
    while (depth > 0) {
        const double d2 = stack[--depth].d2;
        if (d2 >= hit->d2) continue;
        const surface_node *node = &s->node[stack[depth].node];
        for (uint32_t i = 0; i < node->count; i++) {
            surface_hit h;
            nearest_of_triangle(s, node->first + i, x, &h);
            if (!(h.d2 < hit->d2)) continue;
            *hit = h;
            found = 1;
        }
        if (node->count > 0) continue;
        const double left = box_distance2(&s->node[node->first], x),
                     right = box_distance2(&s->node[node->first + 1], x);
        const int left_first = left <= right;
        stack[depth].node = node->first + (left_first ? 1 : 0);
        stack[depth++].d2 = left_first ? right : left;
        stack[depth].node = node->first + (left_first ? 0 : 1);
        stack[depth++].d2 = left_first ? left : right;
    }
    return found;
}

int surface_nearest(const surface *s, int part, const double x[3], surface_hit *hit)
{
    int found = 0;
    if (part >= 0) return search(s, s->root[part], x, hit);
    for (int p = 0; p < s->parts; p++) found |= search(s, s->root[p], x, hit);
    return found;
}

/* ---- winding number -------------------------------------------------------------------------- */

static double solid_angle(const surface *s, uint32_t t, const double x[3])
{
    double e[3][3], l[3];
    for (int k = 0; k < 3; k++) {
        minus(s->x[s->vertex[t][k]], x, e[k]);
        l[k] = sqrt(dot(e[k], e[k]));
    }
    const double n[3] = {e[1][1] * e[2][2] - e[1][2] * e[2][1],
                         e[1][2] * e[2][0] - e[1][0] * e[2][2],
                         e[1][0] * e[2][1] - e[1][1] * e[2][0]};
    const double below = l[0] * l[1] * l[2] + dot(e[0], e[1]) * l[2] + dot(e[1], e[2]) * l[0] +
                         dot(e[2], e[0]) * l[1];
    return 2. * atan2(dot(e[0], n), below);
}

double surface_winding(const surface *s, const double x[3])
{
    double sum = 0.;
    for (int p = 0; p < s->parts; p++) {
        uint32_t stack[STACK];
        int depth = 0;
        stack[depth++] = s->root[p];
        while (depth > 0) {
            const surface_node *node = &s->node[stack[--depth]];
            const surface_dipole *far = &s->dipole[stack[depth]];
            double d[3];
            minus(far->centre, x, d);
            const double d2 = dot(d, d);
            if (d2 > FAR * FAR * far->radius * far->radius) {
                sum += dot(far->area, d) / (d2 * sqrt(d2));
            } else if (node->count > 0) {
                for (uint32_t i = 0; i < node->count; i++)
                    sum += solid_angle(s, node->first + i, x);
            } else {
                stack[depth++] = node->first + 1;
                stack[depth++] = node->first;
            }
        }
    }
    return sum / (4. * PI);
}

/* ---- signed distance ------------------------------------------------------------------------- */

/* Normal of what was hit, not of unit length where faces meet. */
static void normal_of(const surface *s, const surface_hit *hit, double n[3])
{
    const uint32_t t = hit->triangle;
    memcpy(n, s->normal[t], 3 * sizeof *n);
    if (hit->feature < 3) {
        memcpy(n, s->tip[s->vertex[t][hit->feature]], 3 * sizeof *n);
    } else if (hit->feature < 6 && s->beyond[t][hit->feature - 3] != RIM) {
        const int32_t u = s->beyond[t][hit->feature - 3];
        const double *other = s->normal[u >= 0 ? u : ACROSS - u];
        for (int k = 0; k < 3; k++) n[k] += other[k];
    }
}

static int is_on_crease(const surface *s, const surface_hit *hit)
{
    if (hit->feature == 6) return 0;
    if (hit->feature > 2) return s->beyond[hit->triangle][hit->feature - 3] <= ACROSS;
    return s->on_crease[s->vertex[hit->triangle][hit->feature]];
}

/* On an edge or vertex where the surface is parted though it sticks out there. */
static int is_on_ridge(const surface *s, const surface_hit *hit)
{
    if (!is_on_crease(s, hit)) return 0;
    if (hit->feature > 2) return surface_is_ridge(s, hit->triangle, hit->feature - 3);
    return s->on_crease[s->vertex[hit->triangle][hit->feature]] & ON_RIDGE;
}

static int is_free(const surface *s, const double x[3], double height)
{
    if (!s->mended) return height >= 0.;
    /* normals point to the free side: inwards for a container, which turns the number's sign */
    return s->inside ? surface_winding(s, x) < -.5 : surface_winding(s, x) < .5;
}

/* From the nearest point to signed distance and gradient. */
static double signed_distance(const surface *s, const surface_hit *hit, const double x[3],
                              double g[3])
{
    double n[3], d[3];
    normal_of(s, hit, n);
    minus(x, hit->y, d);
    const double height = hit->feature == 6 ? dot(n, d) : dot(n, d) / sqrt(dot(n, n));
    const double sign = is_free(s, x, height) ? 1. : -1., distance = sqrt(hit->d2);
    const double size = fabs(x[0]) + fabs(x[1]) + fabs(x[2]);
    /* the way to the foot has no digits left close to the surface; its normal has */
    const int close = hit->feature == 6 || distance <= 1e-10 * size;
    const double length = sqrt(dot(n, n)), facing = height < 0. ? -sign : sign;
    for (int k = 0; k < 3; k++) g[k] = close ? facing * n[k] / length : sign * d[k] / distance;
    return sign * distance;
}

/* The part, but for `part`, that is nearer to x than sqrt(*least), or as near and before it, and
 * the nearest of those; -1: none. *least becomes the square of its distance. */
static int other_answers(const surface *s, int part, const double x[3], double *least, int touching)
{
    const size_t begin = touching ? s->touching_first[part] : 0,
                 end = touching ? s->touching_first[part + 1] : (size_t)s->parts;
    int nearest = -1;
    for (size_t i = begin; i < end; i++) {
        const int q = touching ? s->touching[i] : (int)i;
        if (q == part) continue;
        surface_hit h = {.d2 =
                             *least * (nearest < 0 && touching && q < part ? 1. + TIE : 1. - TIE)};
        if (!search(s, s->root[q], x, &h)) continue;
        nearest = q;
        *least = h.d2;
        if (!touching) break;
    }
    return nearest;
}

/* Signed distance of a part from its nearest point; which part answers there, and how far it is. */
static double eval_hit(const surface *s, int part, const surface_hit *hit, const double x[3],
                       double g[3], int *answers, double *distance)
{
    double d2 = hit->d2;
    const double phi = signed_distance(s, hit, x, g);
    *answers = part;
    *distance = fabs(phi);
    if (s->parts == 1) return phi;
    int other = is_on_crease(s, hit) ? other_answers(s, part, x, &d2, 1) : -1;
    if (other < 0 && phi < 0.) other = other_answers(s, part, x, &d2, 0);
    if (other >= 0) *answers = other;
    if (other >= 0) *distance = sqrt(d2);
    return phi;
}

double surface_eval(const surface *s, int part, const double x[3], double g[3], int *hidden)
{
    surface_hit hit = {.d2 = INFINITY};
    int answers;
    double distance;
    search(s, s->root[part], x, &hit);
    const double phi = eval_hit(s, part, &hit, x, g, &answers, &distance);
    *hidden = answers != part;
    return phi;
}

double surface_sample(const surface *s, int part, const double x[3], int *hidden, uint32_t *hint)
{
    surface_hit hit;
    double g[3], d[3], distance;
    int answers;
    nearest_of_triangle(s, *hint, x, &hit);
    search(s, s->root[part], x, &hit);
    *hint = hit.triangle;
    const double phi = eval_hit(s, part, &hit, x, g, &answers, &distance);
    const int ridge = is_on_ridge(s, &hit);
    *hidden = answers == part ? 0 : ridge && answers < part ? 2 : 1;
    /* In cells on both sides of a ridge one part stands for both: no step where the next begins. */
    if (ridge && *hidden) return distance;
    if (ridge || !is_on_crease(s, &hit) || (!*hidden && phi >= 0.)) return phi;
    const double *n =
        hit.feature < 3 ? s->own[s->vertex[hit.triangle][hit.feature]] : s->normal[hit.triangle];
    minus(x, hit.y, d);
    return dot(d, n) / sqrt(dot(n, n));
}

double surface_distance(const surface *s, const double x[3], double g[3], int *part)
{
    surface_hit hit = {.d2 = INFINITY};
    *part = 0;
    for (int p = 0; p < s->parts; p++)
        if (search(s, s->root[p], x, &hit)) *part = p;
    return signed_distance(s, &hit, x, g);
}
