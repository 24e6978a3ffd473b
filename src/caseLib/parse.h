/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * parse.h - what scanner and grammar share while a file is read; private to caseLib.
 *
 * The scanner (dict.l) cuts the text into tokens, follows #include by a stack of sources and counts
 * lines; the grammar (dict.y) builds the tree through the functions below. The first error in the
 * grammar ends the reading of a file: what follows it could only be guessed.
 */
#ifndef CASE_PARSE_H
#define CASE_PARSE_H

#include "tree.h"

/* Files within files. OpenFOAM cases nest three deep at most. */
#define INCLUDE_DEPTH 20
/* Includes in all, so that files that include each other twice cannot go on for ever. */
#define INCLUDE_COUNT 500

/* A file, or text, that is being scanned. */
typedef struct source {
    const char *name; /* in messages */
    char *path;       /* resolved, NULL for a text */
    char *text;       /* owned */
    int line;         /* the scanner is in */
    int depth;        /* open brackets when it began */
    struct source *below;
} source;

typedef struct parser {
    store *store;
    case_errors *errors;
    source *source;
    void *scanner;
    const char *case_directory; /* stands for $FOAM_CASE, NULL for a text */
    case_dict *root, *current;
    entry pending[NESTING + 1]; /* keys of the dictionaries that are open; key NULL: list member */
    int open;                   /* number of them */
    struct bracket {
        char kind;
        int line;
        const char *file, *key;
    } bracket[NESTING + 1];
    int brackets;
    int includes;
    int failed;
    char word[1024]; /* the word the scanner is in */
    size_t word_length;
    int word_brackets;
    const node *reading[NESTING + 2]; /* key whose value is being read, by number of open ones */
} parser;

/* An error in the text: reported once, ends the parsing. */
void parse_error(parser *parser, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Scanner's side. All return 0 after an error. */
int parse_bracket_open(parser *parser, char kind);
int parse_bracket_close(parser *parser, char kind);
int parse_include(parser *parser, const char *name, int optional);
/* At the end of a source: 1 when there is one below to go on with. */
int parse_source_end(parser *parser);

/* Grammar's side. */
void parse_key(parser *parser, const node *key);
void parse_open(parser *parser, const node *key);
void parse_open_member(parser *parser, int line);
node *parse_close(parser *parser); /* of a member: its node; else NULL */
void parse_set(parser *parser, const node *key, chain value);
void parse_bare_list(parser *parser, node *list);
void parse_merge(parser *parser, const node *variable);
chain parse_expand(parser *parser, const node *variable);
void parse_member(parser *parser, node *list, chain members);
node *parse_repeat(parser *parser, const node *count, chain member);

/* dict.l */
int scan_begin(parser *parser);
int scan_push(parser *parser); /* parser->source on top of the scanner's stack */
void scan_pop(parser *parser);
void scan_end(parser *parser);

#endif
