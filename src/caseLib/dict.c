/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * dict.c - dictionaries as OpenFOAM understands them: order, lookup, patterns, merging, copying.
 *
 * Entries keep the order of the file. Keys are found through an open-addressing hash table
 * (FNV-1a), filled to one half at most. A quoted key is a POSIX extended regular expression that
 * has to match the whole word; exact keys go before patterns, later patterns before earlier ones.
 */
#include "tree.h"

#include <regex.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

case_dict *dict_new(store *store, case_dict *parent, const char *name, const char *file, int line)
{
    case_dict *dict = store_alloc(store, sizeof *dict);
    *dict = (case_dict){.store = store,
                        .parent = parent,
                        .name = name,
                        .file = file,
                        .line = line,
                        .expanded = parent ? parent->expanded : 0,
                        .owned = store->dicts};
    store->dicts = dict;
    return dict;
}

/* ---- lookup ---------------------------------------------------------------------------------- */

static size_t hash(const char *key)
{
    uint64_t h = 14695981039346656037u;
    for (; *key; key++) h = (h ^ (unsigned char)*key) * 1099511628211u;
    return (size_t)(h ^ h >> 32);
}

/* Slot that holds key, or the empty one where it belongs. */
static size_t *find_slot(const case_dict *dict, const char *key)
{
    size_t mask = dict->slots - 1, i = hash(key) & mask;
    while (dict->slot[i] && strcmp(dict->entry[dict->slot[i] - 1]->key, key) != 0)
        i = (i + 1) & mask;
    return &dict->slot[i];
}

entry *dict_find(const case_dict *dict, const char *key)
{
    if (!dict || !dict->slots) return NULL;
    size_t at = *find_slot(dict, key);
    return at ? dict->entry[at - 1] : NULL;
}

/* Bounds and back references can make the C library's matcher use unbounded time and memory. */
static int pattern_is_tame(const char *pattern)
{
    if (strlen(pattern) > 200 || strchr(pattern, '{')) return 0;
    for (const char *c = pattern; (c = strchr(c, '\\')); c += c[1] ? 2 : 1)
        if (c[1] >= '0' && c[1] <= '9') return 0;
    return 1;
}

static int pattern_matches(const char *pattern, const char *word)
{
    char whole[256];
    regex_t regex;
    if (!pattern_is_tame(pattern)) return 0;
    snprintf(whole, sizeof whole, "^(%s)$", pattern);
    if (regcomp(&regex, whole, REG_EXTENDED | REG_NOSUB) != 0) return 0;
    int matches = regexec(&regex, word, 0, NULL, 0) == 0;
    regfree(&regex);
    return matches;
}

entry *dict_match(const case_dict *dict, const char *key)
{
    entry *exact = dict_find(dict, key);
    if (exact || !dict) return exact;
    for (size_t i = dict->n; i-- > 0;)
        if (dict->entry[i]->pattern && pattern_matches(dict->entry[i]->key, key))
            return dict->entry[i];
    return NULL;
}

/* ---- building -------------------------------------------------------------------------------- */

static void rehash(case_dict *dict)
{
    dict->slots = dict->slots ? 2 * dict->slots : 8;
    free(dict->slot);
    size_t none = 0;
    dict->slot = grow(NULL, &none, dict->slots, sizeof *dict->slot);
    memset(dict->slot, 0, dict->slots * sizeof *dict->slot);
    for (size_t i = 0; i < dict->n; i++) *find_slot(dict, dict->entry[i]->key) = i + 1;
}

static case_dict *as_dict(const entry *entry)
{
    return entry->value && entry->value->kind == NODE_DICT ? entry->value->dict : NULL;
}

void dict_set(case_dict *dict, const entry *new)
{
    entry *old = dict_find(dict, new->key);
    if (old && as_dict(old) && as_dict(new) && as_dict(old) != as_dict(new)) {
        case_dict *from = as_dict(new);
        for (size_t i = 0; i < from->n; i++) {
            case_dict *moved = as_dict(from->entry[i]);
            if (moved) moved->parent = as_dict(old);
            dict_set(as_dict(old), from->entry[i]);
        }
        return;
    }
    if (old) {
        int used = old->used;
        *old = *new;
        old->used = used;
        return;
    }
    if (2 * (dict->n + 1) > dict->slots) rehash(dict);
    dict->entry = grow(dict->entry, &dict->capacity, dict->n + 1, sizeof *dict->entry);
    entry *copy = store_alloc(dict->store, sizeof *copy);
    *copy = *new;
    *find_slot(dict, new->key) = dict->n + 1; /* the slot is compared only once it is filled */
    dict->entry[dict->n++] = copy;
}

/* ---- copying --------------------------------------------------------------------------------- */

static int spend(store *store, size_t amount)
{
    store->copied += amount;
    return store->copied <= STORE_COPIES;
}

static int dict_copy_into(case_dict *into, const case_dict *from, int depth)
{
    size_t n = from->n; /* fixed: `into` may be inside `from` */
    for (size_t i = 0; i < n; i++) {
        entry copy = *from->entry[i];
        chain value = {NULL, NULL};
        if (!spend(into->store, 1) || !chain_copy(into, copy.value, depth, &value)) return 0;
        copy.value = value.first;
        if (as_dict(&copy)) as_dict(&copy)->name = copy.key;
        dict_set(into, &copy);
    }
    return 1;
}

static node *node_copy(case_dict *scope, const node *from, int depth)
{
    store *store = scope->store;
    node *to = node_new(store, from->kind, from->line);
    to->text = from->text;
    to->number = from->number;
    to->n = from->n;
    to->width = from->width;
    if (from->kind == NODE_DICT) {
        const case_dict *old = from->dict;
        to->dict = dict_new(store, scope, old->name, old->file, old->line);
        to->dict->list = old->list;
        to->dict->index = old->index;
        return dict_copy_into(to->dict, old, depth + 1) ? to : NULL;
    }
    if (from->kind != NODE_LIST) return to;
    if (from->first) {
        chain members = {NULL, NULL};
        if (!chain_copy(scope, from->first, depth + 1, &members)) return NULL;
        to->first = members.first;
        to->last = members.last;
    } else if (from->n) {
        size_t n = from->n * (from->width ? from->width : 1);
        if (!spend(store, n)) return NULL;
        to->value = grow(to->value, &to->capacity, n, sizeof(double));
        memcpy(to->value, from->value, n * sizeof(double));
    }
    return to;
}

int chain_copy(case_dict *scope, const node *from, int depth, chain *copy)
{
    if (depth > NESTING) return 0;
    for (; from; from = from->next) {
        node *to = spend(scope->store, 1) ? node_copy(scope, from, depth) : NULL;
        if (!to) return 0;
        *copy = chain_append(*copy, (chain){to, to});
    }
    return 1;
}

int dict_merge(case_dict *into, const case_dict *from)
{
    return into == from || dict_copy_into(into, from, 0);
}
