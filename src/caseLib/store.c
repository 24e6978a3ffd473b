/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * store.c - memory of a parsed file: blocks for small things, nodes, lists of numbers.
 *
 * Small objects are cut from blocks that live as long as the store. Nodes that a list has taken up
 * as plain numbers are used again, with their arrays, so that reading a million vectors needs three
 * million doubles and hardly more.
 */
#include "tree.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct block {
    struct block *below;
    size_t used, size;
    max_align_t data[];
} block;

#define BLOCK_SIZE ((size_t)16384)

static void *checked(void *memory)
{
    if (!memory) {
        fputs("caseLib: out of memory while reading the case\n", stderr);
        exit(EXIT_FAILURE);
    }
    return memory;
}

void *grow(void *array, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity) return array;
    size_t wanted = *capacity ? 2 * *capacity : 4;
    if (wanted < needed) wanted = needed;
    *capacity = wanted;
    return checked(realloc(array, wanted * size));
}

store *store_new(void)
{
    return checked(calloc(1, sizeof(store)));
}

void store_free(store *store)
{
    if (!store) return;
    for (node *node = store->nodes; node; node = node->owned) free(node->value);
    for (case_dict *dict = store->dicts; dict; dict = dict->owned) {
        free(dict->entry);
        free(dict->slot);
    }
    while (store->block) {
        block *below = store->block->below;
        free(store->block);
        store->block = below;
    }
    free(store);
}

void *store_alloc(store *store, size_t size)
{
    size = (size + sizeof(max_align_t) - 1) / sizeof(max_align_t) * sizeof(max_align_t);
    if (!store->block || store->block->size - store->block->used < size) {
        size_t room = size > BLOCK_SIZE ? size : BLOCK_SIZE;
        block *new = checked(malloc(sizeof(block) + room));
        *new = (block){.below = store->block, .size = room};
        store->block = new;
    }
    char *memory = (char *)store->block->data + store->block->used;
    store->block->used += size;
    return memset(memory, 0, size);
}

const char *store_text(store *store, const char *text, size_t length)
{
    char *copy = store_alloc(store, length + 1);
    memcpy(copy, text, length);
    return copy;
}

node *node_new(store *store, node_kind kind, int line)
{
    node *new = store->spare;
    if (new) {
        store->spare = new->next;
        *new = (node){.value = new->value, .capacity = new->capacity, .owned = new->owned};
    } else {
        new = store_alloc(store, sizeof(node));
        new->owned = store->nodes;
        store->nodes = new;
    }
    new->kind = kind;
    new->line = line;
    return new;
}

static void node_release(store *store, node *node)
{
    node->next = store->spare;
    store->spare = node;
}

chain chain_append(chain head, chain tail)
{
    if (!tail.first) return head;
    if (!head.first) return tail;
    head.last->next = tail.first;
    head.last = tail.last;
    return head;
}

/* ---- lists ----------------------------------------------------------------------------------- */

static void append_numbers(node *list, const double *value, size_t n)
{
    size_t used = list->n * (list->width ? list->width : 1);
    list->value = grow(list->value, &list->capacity, used + n, sizeof(double));
    memcpy(list->value + used, value, n * sizeof(double));
    list->n++;
}

static void append_node(node *list, node *member)
{
    chain whole = chain_append((chain){list->first, list->last}, (chain){member, member});
    list->first = whole.first;
    list->last = whole.last;
    list->n++;
}

/* Rewrite a list of numbers, or of rows, as a chain of nodes. */
static void unpack(store *store, node *list)
{
    size_t n = list->n, width = list->width;
    list->n = list->width = 0;
    for (size_t i = 0; i < n; i++) {
        node *member = node_new(store, width ? NODE_LIST : NODE_NUMBER, list->line);
        if (!width) member->number = list->value[i];
        for (size_t j = 0; j < width; j++) append_numbers(member, list->value + i * width + j, 1);
        append_node(list, member);
    }
}

/* "3 (a b c)": the count before a list says nothing new and is dropped. */
static void drop_count(store *store, node *list, size_t count)
{
    if (!list->n || list->width) return;
    if (!list->first) {
        if (list->value[list->n - 1] == (double)count) list->n--;
        return;
    }
    if (list->last->kind != NODE_NUMBER || list->last->number != (double)count) return;
    node *count_node = list->last, *before = NULL;
    for (node *member = list->first; member != count_node; member = member->next) before = member;
    if (before)
        before->next = NULL;
    else
        list->first = NULL;
    list->last = before;
    list->n--;
    node_release(store, count_node);
}

void list_append(store *store, node *list, node *member)
{
    if (member->kind == NODE_LIST) drop_count(store, list, member->n);
    int numbers = !list->first;
    int row = member->kind == NODE_LIST && !member->first && !member->width && member->n > 0;
    if (numbers && member->kind == NODE_NUMBER && (list->n == 0 || list->width == 0)) {
        append_numbers(list, &member->number, 1);
        node_release(store, member);
    } else if (numbers && row && (list->n == 0 || list->width == member->n)) {
        list->width = member->n;
        append_numbers(list, member->value, member->n);
        node_release(store, member);
    } else {
        if (numbers && list->n) unpack(store, list);
        member->next = NULL;
        append_node(list, member);
    }
}

int list_repeat(store *store, node *list, size_t times, const node *member)
{
    size_t width = member->kind == NODE_LIST ? member->n : 1;
    if (times > STORE_COPIES || store->copied + times * width > STORE_COPIES) return 0;
    store->copied += times * width;
    if (member->kind == NODE_LIST) list->width = width;
    for (size_t i = 0; i < times; i++)
        append_numbers(list, member->kind == NODE_LIST ? member->value : &member->number, width);
    return 1;
}
