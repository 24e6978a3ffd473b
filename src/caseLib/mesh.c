/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * mesh.c - system/blockMeshDict as a box of equal cells, which is what felmiMAC can compute on.
 *
 * One block "hex (v0 ... v7) (nx ny nz) simpleGrading (1 1 1)", whose local axes 1, 2, 3 (v0 to v1,
 * v1 to v2, v0 to v4) are x, y, z. The vertices may stand in any order. Each side of the box is
 * one face of one patch; a patch may have several sides. Whatever a box cannot be is an error that
 * says so: such a case is for felmiFoam.
 */
#include "files.h"
#include "tree.h"

#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const side_name[6] = {"-x", "+x", "-y", "+y", "-z", "+z"};

/* Corners of a hex in OpenFOAM's order, as 0/1 along the local axes, and the corners of each side,
 * in the order of its faces (etc/cellModels: x-min, x-max, y-min, y-max, z-min, z-max). */
static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

typedef struct box {
    const case_dict *dict;
    case_errors *errors;
    case_mesh *mesh;
    size_t n_vertices;
    double (*vertex)[3];
    int hex[8];  /* vertices of the block */
    int line[6]; /* where each side got its patch, 0: not yet */
} box;

/* ---- vertices and block ---------------------------------------------------------------------- */

static int read_vertices(box *box)
{
    double scale =
        read_number(box->dict, case_has(box->dict, "scale") ? "scale" : "convertToMeters", "",
                    &(double){1}, case_positive, box->errors);
    const node *list = list_value(box->dict, "vertices");
    if (list && (list->width != 3 || list->n == 0)) {
        key_error(box->errors, box->dict, "vertices", "accepted: a list of points (x y z)");
        return 0;
    }
    double *value;
    size_t n = case_numbers(box->dict, "vertices", &value, box->errors);
    if (!value) return 0;
    box->vertex = (double(*)[3])value;
    box->n_vertices = n / 3;
    for (size_t i = 0; i < n; i++) value[i] *= scale;
    return 1;
}

static int refuse_block(box *box, const char *why)
{
    key_error(box->errors, box->dict, "blocks",
              "%s; accepted: one block 'hex (8 vertices) (nx ny nz) "
              "simpleGrading (1 1 1)' with its axes along x, y, z",
              why);
    return 0;
}

/* blockMesh can make it, but it is not one box of equal cells. */
static int refuse_general(box *box, const char *why)
{
    box->mesh->general = 1;
    return refuse_block(box, why);
}

static int is_numbers(const node *node, size_t n)
{
    return node && node->kind == NODE_LIST && !node->first && !node->width && node->n == n;
}

static int is_word(const node *node, const char *text)
{
    return node && node->kind == NODE_WORD && strcmp(node->text, text) == 0;
}

/* Grading 1 in every direction: the list holds nothing but ones. */
static int is_uniform(const node *grading)
{
    if (grading->kind != NODE_LIST || grading->first || grading->width) return 0;
    for (size_t i = 0; i < grading->n; i++)
        if (grading->value[i] != 1) return 0;
    return 1;
}

static int read_cells(box *box, const node *counts)
{
    double product = 1;
    for (int a = 0; a < 3; a++) {
        double n = counts->value[a];
        product *= n;
        if (!(n >= 1 && n <= INT32_MAX && n == floor(n)))
            return refuse_block(box, "the numbers of cells must be whole and at least 1");
        box->mesh->cells[a] = (int)n;
    }
    if (product > INT32_MAX) return refuse_block(box, "more than 2147483647 cells");
    return 1;
}

static int read_block(box *box)
{
    const node *list = list_value(box->dict, "blocks");
    if (!list) return refuse_block(box, "no list found");
    const node *at = list->first;
    if (!is_word(at, "hex")) return refuse_block(box, "the block is not a hex");
    at = at->next;
    if (!is_numbers(at, 8)) return refuse_block(box, "the hex has not 8 vertices");
    for (int i = 0; i < 8; i++) {
        double label = at->value[i];
        if (!(label >= 0 && label < (double)box->n_vertices && label == floor(label)))
            return refuse_block(box, "the hex names a vertex that is not there");
        box->hex[i] = (int)label;
    }
    at = at->next;
    if (at && at->kind == NODE_WORD && is_numbers(at->next, 3)) at = at->next; /* cell zone */
    if (!is_numbers(at, 3)) return refuse_block(box, "no (nx ny nz) found");
    if (!read_cells(box, at)) return 0;
    at = at->next;
    if (at && !is_word(at, "hex")) {
        int graded = is_word(at, "simpleGrading") || is_word(at, "edgeGrading");
        if (!graded || !at->next || !is_uniform(at->next))
            return refuse_general(box, "the cells are not all equal");
        at = at->next->next;
    }
    if (is_word(at, "hex")) return refuse_general(box, "more than one block");
    return at ? refuse_block(box, "unknown words after the block") : 1;
}

/* The hex must be an axis-aligned box with its corners in OpenFOAM's order. */
static int read_bounds(box *box)
{
    const double *lo = box->vertex[box->hex[0]], *hi = box->vertex[box->hex[6]];
    case_mesh *mesh = box->mesh;
    double size = 0;
    for (int a = 0; a < 3; a++) size = fmax(size, fabs(hi[a] - lo[a]));
    for (int a = 0; a < 3; a++) {
        mesh->lo[a] = lo[a];
        mesh->hi[a] = hi[a];
        mesh->spacing[a] = (hi[a] - lo[a]) / mesh->cells[a];
        /* rounding of decimal coordinates, no more */
        for (int i = 0; i < 8; i++) {
            double x = box->vertex[box->hex[i]][a], wanted = corner[i][a] ? hi[a] : lo[a];
            if (fabs(x - wanted) > 1e-10 * size)
                return refuse_general(box, "the vertices are not those of a box whose first, "
                                           "second and third axis are x, y and z");
        }
        if (!(hi[a] - lo[a] > 1e-10 * size))
            return refuse_block(box, "an edge of the block has no length or points backwards");
    }
    return 1;
}

/* ---- patches --------------------------------------------------------------------------------- */

/* Side of a face given by 4 vertices, or (OpenFOAM's other form) by block and face; -1: none. */
static int side_of(const box *box, const double *label, size_t n)
{
    if (n == 2) return label[0] == 0 && label[1] >= 0 && label[1] <= 5 ? (int)label[1] : -1;
    for (int side = 0; n == 4 && side < 6; side++) {
        int found = 0;
        for (int i = 0; i < 8; i++) {
            if (corner[i][side / 2] != side % 2) continue;
            for (size_t j = 0; j < n; j++)
                if (label[j] == (double)box->hex[i]) {
                    found++;
                    break;
                }
        }
        if (found == 4) return side;
    }
    return -1;
}

static void set_side(box *box, int side, const char *name, case_patch_type type, int line)
{
    case_side *to = &box->mesh->side[side];
    if (box->line[side]) {
        case_error(box->errors, box->dict->file, line,
                   "side %s of the box is in two patches: '%s' (line %d) and '%s'; accepted: each "
                   "side wholly in one patch",
                   side_name[side], to->patch, box->line[side], name);
        return;
    }
    snprintf(to->patch, sizeof to->patch, "%s", name);
    to->type = type;
    box->line[side] = line;
}

static void set_faces(box *box, const node *faces, const char *name, case_patch_type type, int line)
{
    if (!faces || faces->kind != NODE_LIST ||
        (faces->n && faces->width != 4 && faces->width != 2)) {
        case_error(box->errors, box->dict->file, line,
                   "patch '%s': accepted as faces: a list of (v0 v1 v2 v3)", name);
        return;
    }
    for (size_t i = 0; i < faces->n; i++) {
        int side = side_of(box, faces->value + i * faces->width, faces->width);
        if (side >= 0)
            set_side(box, side, name, type, line);
        else
            case_error(box->errors, box->dict->file, line,
                       "patch '%s': its face %zu is not a side of the block", name, i);
    }
}

static const char *const type_words[] = {"patch",  "wall",          "symmetry", "empty",
                                         "cyclic", "symmetryPlane", NULL};
static const case_patch_type types[] = {CASE_PATCH, CASE_WALL,   CASE_SYMMETRY,
                                        CASE_EMPTY, CASE_CYCLIC, CASE_SYMMETRY};

static void patch_name_fits(box *box, const char *name, int line)
{
    if (strlen(name) < CASE_NAME) return;
    case_error(box->errors, box->dict->file, line, "the name of patch '%.40s...' is longer than %d",
               name, CASE_NAME - 1);
}

/* boundary ( name { type ...; faces (...); } ... ) */
static void read_boundary(box *box)
{
    size_t n = case_list_size(box->dict, "boundary");
    for (size_t i = 0; i < n; i++) {
        const case_dict *patch = case_list_at(box->dict, "boundary", i);
        patch_name_fits(box, patch->name, patch->line);
        for (size_t j = 0; j < i; j++)
            if (strcmp(case_list_at(box->dict, "boundary", j)->name, patch->name) == 0)
                case_error(box->errors, patch->file, patch->line, "a second patch '%s'",
                           patch->name);
        int type = case_choice(patch, "type", type_words, -1, box->errors);
        const entry *faces = dict_match(patch, "faces");
        if (!faces)
            key_error(box->errors, patch, "faces", "missing; accepted: a list of (v0 v1 v2 v3)");
        else
            set_faces(box, faces->value, patch->name, types[type], faces->line);
    }
}

/* patches ( type name ((v0 v1 v2 v3) ...) ... ), the form before OpenFOAM 2 */
static void read_patches(box *box)
{
    const node *list = list_value(box->dict, "patches");
    const node *at = list ? list->first : NULL;
    for (; at && at->next && at->next->next; at = at->next->next->next) {
        const node *name = at->next, *faces = name->next;
        int type = 0;
        while (type_words[type] && !is_word(at, type_words[type])) type++;
        if (!type_words[type] || name->kind != NODE_WORD) {
            case_error(box->errors, box->dict->file, at->line,
                       "patches: accepted: type name ((v0 v1 v2 v3) ...), with the types patch, "
                       "wall, symmetry, empty, cyclic, symmetryPlane");
            return;
        }
        patch_name_fits(box, name->text, name->line);
        set_faces(box, faces, name->text, types[type], name->line);
    }
}

/* Sides that no patch claims: defaultPatch, or as in OpenFOAM "defaultFaces" of type empty. */
static void set_default_sides(box *box)
{
    const case_dict *patch = case_sub(box->dict, "defaultPatch", 0, box->errors);
    const char *name =
        patch ? case_word(patch, "name", "defaultFaces", 0, box->errors) : "defaultFaces";
    int type = patch ? case_choice(patch, "type", type_words, 3, box->errors) : 3;
    for (int side = 0; side < 6; side++) {
        if (box->line[side]) continue;
        if (!patch && box->mesh->cells[side / 2] != 1)
            key_error(box->errors, box->dict, "boundary", "side %s of the box is in no patch",
                      side_name[side]);
        else
            set_side(box, side, name, types[type], patch ? patch->line : 1);
    }
}

static void check_sides(const box *box)
{
    for (int a = 0; a < 3; a++) {
        const case_side *low = &box->mesh->side[2 * a], *high = low + 1;
        int cyclic = (low->type == CASE_CYCLIC) + (high->type == CASE_CYCLIC);
        int empty = (low->type == CASE_EMPTY) + (high->type == CASE_EMPTY);
        if (cyclic == 1 || empty == 1)
            case_error(box->errors, box->dict->file, box->line[2 * a],
                       "patches '%s' and '%s' face each other, but only one of them is %s",
                       low->patch, high->patch, cyclic == 1 ? "cyclic" : "empty");
        if (empty == 2 && box->mesh->cells[a] != 1)
            case_error(box->errors, box->dict->file, box->line[2 * a],
                       "patch '%s' is empty, but there are %d cells across it; accepted: 1",
                       low->patch, box->mesh->cells[a]);
    }
}

/* ---- the file -------------------------------------------------------------------------------- */

static void refuse_entries(box *box, const char *key)
{
    const entry *entry = dict_match(box->dict, key);
    if (!entry || !entry->value || (entry->value->kind == NODE_LIST && entry->value->n == 0))
        return;
    box->mesh->general = 1;
    key_error(box->errors, box->dict, key,
              "accepted: an empty list; the mesh of felmiMAC is a "
              "plain box");
}

static void read_box(box *box)
{
    static const char *const known[] = {
        "FoamFile", "scale",   "convertToMeters", "vertices",     "blocks",   "edges",     "faces",
        "boundary", "patches", "mergePatchPairs", "defaultPatch", "geometry", "mergeType", NULL};
    suspect_keys(box->dict, known, box->errors);
    refuse_entries(box, "edges");
    refuse_entries(box, "mergePatchPairs");
    if (!read_vertices(box) || !read_block(box) || !read_bounds(box)) return;
    int before = case_errors_count(box->errors);
    if (case_has(box->dict, "boundary") || !case_has(box->dict, "patches"))
        read_boundary(box);
    else
        read_patches(box);
    if (case_errors_count(box->errors) > before) return;
    set_default_sides(box);
    check_sides(box);
}

void case_read_mesh(const char *directory, case_mesh *mesh, case_errors *errors)
{
    /* Until OpenFOAM 2.3 the file lay with the mesh. */
    static const char *const old = "constant/polyMesh/blockMeshDict";
    int use_old =
        !case_file_exists(directory, "system/blockMeshDict") && case_file_exists(directory, old);
    memset(mesh, 0, sizeof *mesh);
    case_dict *dict = case_read_file(directory, use_old ? old : "system/blockMeshDict", errors);
    if (!dict) return;
    box box = {.dict = dict, .errors = errors, .mesh = mesh};
    int before = case_errors_count(errors);
    read_box(&box);
    if (case_errors_count(errors) > before) *mesh = (case_mesh){.general = mesh->general};
    free(box.vertex);
    case_dict_free(dict);
}
