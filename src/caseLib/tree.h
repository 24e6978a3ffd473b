/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * tree.h - a parsed dictionary in memory; private to caseLib.
 *
 * A dictionary is an array of entries with a hash table over their keys. The value of an entry is a
 * chain of nodes, the tokens as they stood in the file ("nu [0 2 -1 0 0 0 0] 1e-5" is a chain of
 * three), or one dictionary node. Lists of numbers, and of equal rows of numbers, are kept as flat
 * arrays of doubles, since a case holds them by the million; any other list is a chain of nodes.
 *
 * All memory of one parse belongs to one store and is freed with it, so that an error anywhere in
 * the grammar leaks nothing. Running out of memory while reading ends the process.
 */
#ifndef CASE_TREE_H
#define CASE_TREE_H

#include "case.h"

typedef enum node_kind {
    NODE_NUMBER,
    NODE_WORD,
    NODE_STRING,
    NODE_DIMENSIONS,
    NODE_LIST,
    NODE_DICT
} node_kind;

typedef struct node {
    node_kind kind;
    int line;
    const char *text;   /* as written; NULL for numbers within lists */
    double number;      /* NODE_NUMBER */
    size_t n;           /* NODE_LIST: members */
    size_t width;       /* numbers in a row; 0: the members are plain numbers */
    double *value;      /* [n * max(width, 1)], or the members are the chain `first` */
    size_t capacity;    /* of value, kept when a node is used again */
    struct node *first; /* members of a list that is not of numbers */
    struct node *last;
    case_dict *dict;    /* NODE_DICT */
    struct node *next;  /* in a chain, or in the store's list of spare nodes */
    struct node *owned; /* all nodes of a store */
} node;

typedef struct chain {
    node *first, *last;
} chain;

typedef struct entry {
    const char *key;
    const char *file;
    int line;
    int pattern; /* the key was quoted: a regular expression */
    int used;    /* a macro has referred to it */
    node *value; /* chain; NULL for "key;" */
} entry;

typedef struct store {
    struct block *block;
    node *nodes, *spare;
    case_dict *dicts;
    size_t copied; /* numbers, nodes and entries made by macros and N{x}: see STORE_COPIES */
} store;

/* Bound on what macros and uniform lists may create, so that a short file cannot ask for more
 * memory than a machine has (doubling "a ($b $b)" thirty times): 4e7 numbers are 320 MB. */
#define STORE_COPIES ((size_t)40000000)
/* Bound on the nesting of dictionaries and lists. Real cases stay below ten. */
#define NESTING 64

struct case_dict {
    store *store;
    case_dict *parent;
    const char *name; /* key in the parent, or of a list member the word before it, or "" */
    const char *list; /* key of the list of dictionaries it is in, NULL elsewhere */
    long index;       /* place in that list */
    const char *file;
    int line;
    int expanded; /* text handed over by OpenFOAM, macros already expanded */
    entry **entry;
    size_t n, capacity;
    size_t *slot; /* hash table: index of entry + 1, 0 empty */
    size_t slots; /* power of 2 */
    case_dict *owned;
};

/* store.c */
store *store_new(void);
void store_free(store *store);
void *store_alloc(store *store, size_t size);
const char *store_text(store *store, const char *text, size_t length);
node *node_new(store *store, node_kind kind, int line);
chain chain_append(chain head, chain tail);
void list_append(store *store, node *list, node *member);
/* 0 when it would pass STORE_COPIES. */
int list_repeat(store *store, node *list, size_t times, const node *member);
void *grow(void *array, size_t *capacity, size_t needed, size_t size);

/* dict.c */
case_dict *dict_new(store *store, case_dict *parent, const char *name, const char *file, int line);
entry *dict_find(const case_dict *dict, const char *key);  /* exact */
entry *dict_match(const case_dict *dict, const char *key); /* exact, else the last pattern */
/* Set key to value; a later value replaces an earlier one, two dictionaries are merged. */
void dict_set(case_dict *dict, const entry *entry);
/* 0 when the copy would pass STORE_COPIES or NESTING. */
int dict_merge(case_dict *into, const case_dict *from);
int chain_copy(case_dict *scope, const node *from, int depth, chain *copy);

/* value.c */
/* "materials.glass.density" */
void key_path(const case_dict *dict, const char *key, char *path, size_t size);
/* Error at a key, or, where it is absent, at its dictionary. */
void key_error(case_errors *errors, const case_dict *dict, const char *key, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* As case_scalar, with the unit for the message. */
double read_number(const case_dict *dict, const char *key, const char *unit, const double *missing,
                   case_range range, case_errors *errors);
/* As case_vector; required when missing is NULL. */
int read_vector(const case_dict *dict, const char *key, const char *unit, const double missing[3],
                double value[3], case_errors *errors);
/* The list that is the value of a key, NULL if it is none. A number before it is read over: of
 * blocks or patches, say, which are several members each. */
const node *list_value(const case_dict *dict, const char *key);
/* Write the value of a key as a user would recognise it. */
void describe_value(const entry *entry, char *text, size_t size);
/* A node, of a list its members too. */
void describe_members(const node *node, char *text, size_t size);

#endif
