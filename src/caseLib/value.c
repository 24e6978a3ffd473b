/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * value.c - reads single values from a dictionary and says what is wrong with them.
 *
 * A message names file, line and full key, what was found, what is accepted (range and unit), and
 * the nearest accepted word. Words and dimension sets that OpenFOAM allows before a value are read
 * over: the key itself (nu nu [0 2 -1 0 0 0 0] 1e-5), "uniform" and "constant".
 */
#include "tree.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const case_range case_any = {-INFINITY, INFINITY, 1, 1};
const case_range case_positive = {0, INFINITY, 1, 1};
const case_range case_non_negative = {0, INFINITY, 0, 1};
const case_range case_fraction = {0, 1, 0, 0};

/* ---- messages -------------------------------------------------------------------------------- */

/* Append to a text of limited size, cutting what does not fit. */
static void put(char *text, size_t size, const char *format, ...)
{
    size_t used = strlen(text);
    va_list values;
    va_start(values, format);
    if (used < size) vsnprintf(text + used, size - used, format, values);
    va_end(values);
}

/* One step of a path for each scope; bounded because scopes are. */
static void put_scope(const case_dict *dict, char *path, size_t size)
{
    if (!dict || !dict->parent) return;
    put_scope(dict->parent, path, size);
    if (dict->list) put(path, size, "%s%s", *path ? "." : "", dict->list);
    if (dict->list && !*dict->name)
        put(path, size, "[%ld]", dict->index);
    else
        put(path, size, "%s%s", *path ? "." : "", dict->name);
}

void key_path(const case_dict *dict, const char *key, char *path, size_t size)
{
    *path = '\0';
    put_scope(dict, path, size);
    put(path, size, "%s%s", *path && *key ? "." : "", key);
}

void key_error(case_errors *errors, const case_dict *dict, const char *key, const char *format, ...)
{
    char path[512], message[1024];
    const entry *entry = dict_match(dict, key);
    if (!dict) return; /* its file could not be read, which has been said */
    va_list values;
    va_start(values, format);
    vsnprintf(message, sizeof message, format, values);
    va_end(values);
    key_path(dict, key, path, sizeof path);
    case_error(errors, entry ? entry->file : dict->file, entry ? entry->line : dict->line, "%s: %s",
               path, message);
}

static void describe_node(const node *node, char *text, size_t size)
{
    size_t shown = node->n * (node->width ? node->width : 1);
    switch (node->kind) {
    case NODE_NUMBER:
        if (node->text)
            put(text, size, "%s", node->text);
        else
            put(text, size, "%g", node->number);
        break;
    case NODE_STRING:
        put(text, size, "\"%s\"", node->text);
        break;
    case NODE_DICT:
        put(text, size, "{...}");
        break;
    case NODE_LIST:
        put(text, size, "(");
        if (node->first || node->width) put(text, size, "...");
        for (size_t i = 0; !node->first && !node->width && i < shown && i < 8; i++)
            put(text, size, i ? " %g" : "%g", node->value[i]);
        put(text, size, !node->first && !node->width && shown > 8 ? " ...)" : ")");
        break;
    default:
        put(text, size, "%s", node->text);
    }
}

void describe_value(const entry *entry, char *text, size_t size)
{
    *text = '\0';
    if (!entry || !entry->value)
        put(text, size, "nothing");
    else if (entry->value->kind == NODE_DICT)
        put(text, size, "a dictionary");
    else {
        put(text, size, "'");
        int tokens = 0;
        for (const node *node = entry->value; node && tokens < 6; node = node->next, tokens++) {
            if (node != entry->value) put(text, size, " ");
            describe_node(node, text, size - 40);
        }
        put(text, size, "'");
        if (tokens > 1 && entry->value->kind != NODE_DIMENSIONS)
            put(text, size, " (is a ';' missing?)");
    }
}

void describe_members(const node *node, char *text, size_t size)
{
    *text = '\0';
    if (node->kind != NODE_LIST || !node->first) {
        describe_node(node, text, size);
        return;
    }
    put(text, size, "(");
    for (const struct node *at = node->first; at; at = at->next) {
        if (at != node->first) put(text, size, " ");
        describe_node(at, text, size);
    }
    put(text, size, ")");
}

/* "found ...; accepted: ..." at a key. */
static void wrong_value(case_errors *errors, const case_dict *dict, const char *key,
                        const char *accepted)
{
    char found[256];
    const entry *entry = dict_match(dict, key);
    describe_value(entry, found, sizeof found);
    if (entry)
        key_error(errors, dict, key, "found %s; accepted: %s", found, accepted);
    else
        key_error(errors, dict, key, "missing; accepted: %s", accepted);
}

static void range_text(char *text, size_t size, const char *what, case_range range,
                       const char *unit)
{
    snprintf(text, size, "%s", what);
    if (isfinite(range.lo)) put(text, size, range.open_lo ? " > %g" : " >= %g", range.lo);
    if (isfinite(range.lo) && isfinite(range.hi)) put(text, size, " and");
    if (isfinite(range.hi)) put(text, size, range.open_hi ? " < %g" : " <= %g", range.hi);
    if (unit && *unit) put(text, size, " in %s", unit);
}

/* ---- values ---------------------------------------------------------------------------------- */

/* First node of a value that is not a name or a dimension set before it. */
static const node *skip_prefix(const entry *entry, const char *key)
{
    const node *node = entry->value;
    while (node && node->next &&
           (node->kind == NODE_DIMENSIONS ||
            (node->kind == NODE_WORD &&
             (strcmp(node->text, key) == 0 || strcmp(node->text, "uniform") == 0 ||
              strcmp(node->text, "constant") == 0 || strcmp(node->text, "nonuniform") == 0 ||
              strncmp(node->text, "List<", 5) == 0))))
        node = node->next;
    return node;
}

static int in_range(double x, case_range range)
{
    return isfinite(x) && (range.open_lo ? x > range.lo : x >= range.lo) &&
           (range.open_hi ? x < range.hi : x <= range.hi);
}

double read_number(const case_dict *dict, const char *key, const char *unit, const double *missing,
                   case_range range, case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    if (!entry && missing) return *missing;
    const node *node = entry ? skip_prefix(entry, key) : NULL;
    if (node && node->kind == NODE_NUMBER && !node->next && in_range(node->number, range))
        return node->number;
    char accepted[160];
    range_text(accepted, sizeof accepted, "a number", range, unit);
    wrong_value(errors, dict, key, accepted);
    return missing ? *missing : NAN;
}

double case_scalar(const case_dict *dict, const char *key, const double *missing, case_range range,
                   case_errors *errors)
{
    return read_number(dict, key, "", missing, range, errors);
}

long case_integer(const case_dict *dict, const char *key, const long *missing, long lo, long hi,
                  case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    if (!entry && missing) return *missing;
    const node *node = entry ? skip_prefix(entry, key) : NULL;
    /* The bounds of long are not doubles: stay within those that are exact. */
    case_range range = {fmax((double)lo, -9e15), fmin((double)hi, 9e15), 0, 0};
    if (node && node->kind == NODE_NUMBER && !node->next && node->number == floor(node->number) &&
        in_range(node->number, range))
        return (long)node->number;
    char accepted[160];
    range_text(accepted, sizeof accepted, "a whole number", range, "");
    wrong_value(errors, dict, key, accepted);
    return missing ? *missing : lo;
}

static int bool_word(const node *node)
{
    static const char *const words[] = {"no", "yes", "false", "true", "off", "on",
                                        "n",  "y",   "f",     "t",    NULL};
    if (!node || node->next || node->kind != NODE_WORD) return -1;
    for (int i = 0; words[i]; i++)
        if (strcmp(node->text, words[i]) == 0) return i % 2;
    return -1;
}

int case_bool(const case_dict *dict, const char *key, const int *missing, case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    if (!entry && missing) return *missing;
    int value = bool_word(entry ? entry->value : NULL);
    if (value >= 0) return value;
    wrong_value(errors, dict, key, "yes, no, true, false, on, off");
    return missing ? *missing : 0;
}

int read_vector(const case_dict *dict, const char *key, const char *unit, const double missing[3],
                double value[3], case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    const node *node = entry ? skip_prefix(entry, key) : NULL;
    int good = node && node->kind == NODE_LIST && !node->next && !node->first && !node->width &&
               node->n == 3;
    for (int i = 0; good && i < 3; i++) good = isfinite(node->value[i]);
    for (int i = 0; i < 3; i++) value[i] = good ? node->value[i] : missing ? missing[i] : NAN;
    if (good || (!entry && missing)) return 1;
    char accepted[160];
    snprintf(accepted, sizeof accepted, "a vector (x y z)%s%s", *unit ? " in " : "", unit);
    wrong_value(errors, dict, key, accepted);
    return 0;
}

void case_vector(const case_dict *dict, const char *key, const double missing[3], double value[3],
                 case_errors *errors)
{
    read_vector(dict, key, "", missing, value, errors);
}

const char *case_word(const case_dict *dict, const char *key, const char *missing, int required,
                      case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    if (!entry && !required) return missing;
    const node *node = entry ? entry->value : NULL;
    if (node && !node->next && (node->kind == NODE_WORD || node->kind == NODE_STRING))
        return node->text;
    wrong_value(errors, dict, key, "a word");
    return missing;
}

int case_choice(const case_dict *dict, const char *key, const char *const *accepted, int missing,
                case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    if (!entry && missing >= 0) return missing;
    const node *node = entry ? entry->value : NULL;
    int word = node && !node->next && (node->kind == NODE_WORD || node->kind == NODE_STRING);
    for (int i = 0; word && accepted[i]; i++)
        if (strcmp(node->text, accepted[i]) == 0) return i;
    char text[640] = "";
    for (int i = 0; accepted[i]; i++) put(text, sizeof text, i ? ", %s" : "%s", accepted[i]);
    const char *near = word ? case_nearest(node->text, accepted) : NULL;
    if (near) put(text, sizeof text, "; did you mean '%s'?", near);
    wrong_value(errors, dict, key, text);
    return missing >= 0 ? missing : 0;
}

/* ---- lists ----------------------------------------------------------------------------------- */

typedef struct numbers {
    double *value;
    size_t n, capacity;
} numbers;

/* Append all numbers of a chain; 0 when something else is in it. */
static int flatten(const node *node, numbers *all)
{
    for (; node; node = node->next) {
        const double *from = node->kind == NODE_NUMBER ? &node->number : node->value;
        size_t n = node->kind == NODE_NUMBER ? 1 : node->n * (node->width ? node->width : 1);
        if (node->kind == NODE_LIST && node->first) {
            if (!flatten(node->first, all)) return 0;
            continue;
        }
        if (node->kind != NODE_NUMBER && node->kind != NODE_LIST) return 0;
        if (n == 0) continue;
        all->value = grow(all->value, &all->capacity, all->n + n, sizeof(double));
        memcpy(all->value + all->n, from, n * sizeof(double));
        all->n += n;
    }
    return 1;
}

size_t case_numbers(const case_dict *dict, const char *key, double **value, case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    const node *node = entry ? skip_prefix(entry, key) : NULL;
    numbers all = {NULL, 0, 0};
    *value = NULL;
    if (node && node->kind == NODE_NUMBER && node->next && node->next->kind == NODE_LIST &&
        !node->next->next) {
        key_error(errors, dict, key, "the list says %g members but has %zu", node->number,
                  node->next->n);
        return 0;
    }
    int good = node && !node->next && flatten(node, &all);
    for (size_t i = 0; good && i < all.n; i++) good = isfinite(all.value[i]);
    if (good) {
        *value = all.value;
        return all.n;
    }
    free(all.value);
    wrong_value(errors, dict, key, "a list of numbers");
    return 0;
}

const node *list_value(const case_dict *dict, const char *key)
{
    const entry *entry = dict_match(dict, key);
    const node *list = entry ? entry->value : NULL;
    if (list && list->kind == NODE_NUMBER) list = list->next;
    return list && list->kind == NODE_LIST && !list->next ? list : NULL;
}

size_t case_list_size(const case_dict *dict, const char *key)
{
    const node *list = list_value(dict, key);
    size_t n = 0;
    for (const node *member = list ? list->first : NULL; member; member = member->next)
        n += member->kind == NODE_DICT;
    return n;
}

const case_dict *case_list_at(const case_dict *dict, const char *key, size_t i)
{
    const node *list = list_value(dict, key);
    for (const node *member = list ? list->first : NULL; member; member = member->next)
        if (member->kind == NODE_DICT && i-- == 0) return member->dict;
    return NULL;
}

/* ---- entries --------------------------------------------------------------------------------- */

const char *case_dict_file(const case_dict *dict)
{
    return dict->file;
}

const char *case_dict_name(const case_dict *dict)
{
    return dict->name;
}

int case_dict_line(const case_dict *dict, const char *key)
{
    const entry *entry = dict_match(dict, key);
    return entry ? entry->line : 0;
}

size_t case_dict_size(const case_dict *dict)
{
    return dict ? dict->n : 0;
}

const char *case_dict_key(const case_dict *dict, size_t i)
{
    return i < dict->n ? dict->entry[i]->key : NULL;
}

int case_has(const case_dict *dict, const char *key)
{
    return dict_match(dict, key) != NULL;
}

const case_dict *case_sub(const case_dict *dict, const char *key, int required, case_errors *errors)
{
    const entry *entry = dict_match(dict, key);
    if (entry && entry->value && entry->value->kind == NODE_DICT) return entry->value->dict;
    if (entry || required) wrong_value(errors, dict, key, "a dictionary { ... }");
    return NULL;
}

/* Keys that any dictionary may hold: the header, and a place for a user's own macros. */
static int always_known(const case_dict *dict, const entry *entry)
{
    if (entry->used || *entry->key == '\0') return 1;
    if (dict->parent) return 0;
    return strcmp(entry->key, "FoamFile") == 0 || strcmp(entry->key, "variables") == 0;
}

void case_known(const case_dict *dict, const char *const *known, case_errors *errors)
{
    for (size_t i = 0; dict && i < dict->n; i++) {
        const entry *entry = dict->entry[i];
        int found = always_known(dict, entry);
        for (const char *const *word = known; *word && !found; word++)
            found = strcmp(entry->key, *word) == 0;
        if (found) continue;
        const char *near = case_nearest(entry->key, known);
        /* OpenFOAM hands over the keys that its macros used among the others: at the top level
         * only what looks like a misspelling can be told from them. */
        if (dict->expanded && !dict->parent && !near) continue;
        char list[512] = "";
        for (const char *const *word = known; *word; word++)
            put(list, sizeof list, "%s%s", word == known ? "" : ", ", *word);
        if (near) put(list, sizeof list, "; did you mean '%s'?", near);
        key_error(errors, dict, entry->key, "unknown key; accepted: %s", list);
    }
}
