/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * parse.c - builds the tree while the grammar recognises it: scopes, brackets, macros.
 *
 * A dictionary that opens becomes `current`; when it closes it is set in its parent, where it is
 * merged with an earlier one of that name. A macro $name is replaced at once by a copy of what the
 * name means so far: in the scope it stands in, else in the scopes around it, else in the
 * environment. $:a.b starts at the top of the file, $.a here, $..a one scope up.
 */
#include "parse.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void parse_error(parser *parser, int line, const char *format, ...)
{
    char message[1024];
    va_list values;
    if (parser->failed) return;
    parser->failed = 1;
    va_start(values, format);
    vsnprintf(message, sizeof message, format, values);
    va_end(values);
    case_error(parser->errors, parser->source ? parser->source->name : "", line, "%s", message);
}

/* ---- brackets -------------------------------------------------------------------------------- */

/* Key whose value a bracket belongs to, NULL if none is known. */
static const char *reading(const parser *parser)
{
    return parser->reading[parser->open] ? parser->reading[parser->open]->text : NULL;
}

int parse_bracket_open(parser *parser, char kind)
{
    if (parser->brackets == NESTING) {
        parse_error(parser, parser->source->line, "brackets nested more than %d deep", NESTING);
        return 0;
    }
    parser->bracket[parser->brackets++] = (struct bracket){
        .kind = kind,
        .line = parser->source->line,
        .file = parser->source->name,
        .key = reading(parser),
    };
    return 1;
}

int parse_bracket_close(parser *parser, char kind)
{
    char opening = kind == '}' ? '{' : '(';
    if (parser->brackets == parser->source->depth) {
        parse_error(parser, parser->source->line, "'%c' closes nothing that this file has opened",
                    kind);
        return 0;
    }
    const struct bracket *open = &parser->bracket[parser->brackets - 1];
    if (open->kind != opening) {
        parse_error(parser, parser->source->line,
                    "'%c' found, but the '%c' of line %d%s%s%s is open", kind, open->kind,
                    open->line, open->key ? " (key '" : "", open->key ? open->key : "",
                    open->key ? "')" : "");
        return 0;
    }
    parser->brackets--;
    return 1;
}

/* ---- dictionaries ---------------------------------------------------------------------------- */

static void open_dict(parser *parser, const char *name, int line, entry pending)
{
    if (parser->open > NESTING) { /* cannot be: the brackets have been counted */
        parse_error(parser, line, "dictionaries nested more than %d deep", NESTING);
        return;
    }
    parser->pending[parser->open++] = pending;
    parser->current = dict_new(parser->store, parser->current, name, parser->source->name, line);
    parser->reading[parser->open] = NULL;
}

void parse_key(parser *parser, const node *key)
{
    parser->reading[parser->open] = key;
}

void parse_open(parser *parser, const node *key)
{
    open_dict(parser, key->text, key->line,
              (entry){.key = key->text,
                      .file = parser->source->name,
                      .line = key->line,
                      .pattern = key->kind == NODE_STRING});
}

void parse_open_member(parser *parser, int line)
{
    open_dict(parser, "", line, (entry){0});
}

node *parse_close(parser *parser)
{
    entry pending = parser->pending[--parser->open];
    node *value = node_new(parser->store, NODE_DICT, parser->current->line);
    value->dict = parser->current;
    parser->current = parser->current->parent;
    if (!pending.key) return value;
    parser->reading[parser->open] = NULL;
    pending.value = value;
    dict_set(parser->current, &pending);
    return NULL;
}

void parse_member(parser *parser, node *list, chain members)
{
    for (node *member = members.first, *next; member; member = next) {
        next = member->next;
        if (member->kind == NODE_DICT) {
            const node *before = list->last;
            int named = before && (before->kind == NODE_WORD || before->kind == NODE_STRING);
            member->dict->name = named ? before->text : "";
            member->dict->index = 0;
            for (const node *other = list->first; other; other = other->next)
                member->dict->index += other->kind == NODE_DICT;
        }
        list_append(parser->store, list, member);
    }
}

node *parse_repeat(parser *parser, const node *count, chain member)
{
    node *list = node_new(parser->store, NODE_LIST, count->line), *value = member.first;
    int numbers = value && !value->next &&
                  (value->kind == NODE_NUMBER ||
                   (value->kind == NODE_LIST && !value->first && !value->width));
    if (!numbers || count->number < 0 || count->number != floor(count->number))
        parse_error(parser, count->line,
                    "a uniform list is N { x }: a count N and a number or a list "
                    "of numbers");
    else if (count->number > (double)STORE_COPIES ||
             !list_repeat(parser->store, list, (size_t)count->number, value))
        parse_error(parser, count->line, "a uniform list of %g members is too long", count->number);
    return list;
}

/* "key 3 (a b c)": the count says nothing new. */
static void drop_counts(chain *value)
{
    for (node *at = value->first, *before = NULL; at; at = at->next) {
        if (at->kind == NODE_NUMBER && at->next && at->next->kind == NODE_LIST &&
            at->number == (double)at->next->n) {
            if (before)
                before->next = at->next;
            else
                value->first = at->next;
        } else {
            before = at;
        }
    }
}

void parse_set(parser *parser, const node *key, chain value)
{
    parser->reading[parser->open] = NULL;
    drop_counts(&value);
    node *first = value.first;
    if (first && first->kind == NODE_DICT) {
        if (first->next) {
            parse_error(parser, key->line, "'%s' is a dictionary followed by more", key->text);
            return;
        }
        first->dict->name = key->text;
    }
    if (first && first->kind == NODE_LIST && !first->next)
        for (node *member = first->first; member; member = member->next)
            if (member->kind == NODE_DICT) member->dict->list = key->text;
    dict_set(parser->current, &(entry){.key = key->text,
                                       .file = parser->source->name,
                                       .line = key->line,
                                       .pattern = key->kind == NODE_STRING,
                                       .value = first});
}

void parse_bare_list(parser *parser, node *list)
{
    dict_set(parser->root,
             &(entry){.key = "", .file = parser->source->name, .line = list->line, .value = list});
}

/* ---- macros ---------------------------------------------------------------------------------- */

/* "a.b.c" in a scope: the whole as a key, else dictionary by dictionary. */
static entry *find_scoped(const case_dict *scope, const char *name)
{
    char part[256];
    entry *found = dict_match(scope, name);
    while (!found) {
        const char *dot = strchr(name, '.');
        if (!dot || (size_t)(dot - name) >= sizeof part) return NULL;
        memcpy(part, name, (size_t)(dot - name));
        part[dot - name] = '\0';
        entry *step = dict_match(scope, part);
        if (!step || !step->value || step->value->kind != NODE_DICT) return NULL;
        step->used = 1;
        scope = step->value->dict;
        name = dot + 1;
        found = dict_match(scope, name);
    }
    return found;
}

static entry *find_variable(const parser *parser, const char *name)
{
    const case_dict *scope = parser->current;
    if (*name == ':') return find_scoped(parser->root, name + 1);
    if (*name == '.') {
        for (name++; *name == '.' && scope; name++) scope = scope->parent;
        return scope ? find_scoped(scope, name) : NULL;
    }
    for (entry *found; scope; scope = scope->parent)
        if ((found = find_scoped(scope, name))) return found;
    return NULL;
}

static entry *look_up(parser *parser, const node *variable)
{
    entry *found = find_variable(parser, variable->text);
    if (found) found->used = 1;
    return found;
}

chain parse_expand(parser *parser, const node *variable)
{
    chain copy = {NULL, NULL};
    entry *found = look_up(parser, variable);
    if (found) {
        if (!chain_copy(parser->current, found->value, 0, &copy))
            parse_error(parser, variable->line, "'$%s' would make the case too large",
                        variable->text);
        return copy;
    }
    const char *value = getenv(variable->text);
    if (!value) {
        parse_error(parser, variable->line,
                    "'$%s' is neither a key above this line nor an environment variable",
                    variable->text);
        return copy;
    }
    char *end;
    double number = strtod(value, &end);
    int numeric = end != value && *end == '\0' && isfinite(number);
    node *node = node_new(parser->store, numeric ? NODE_NUMBER : NODE_STRING, variable->line);
    node->number = numeric ? number : 0;
    node->text = store_text(parser->store, value, strlen(value));
    return (chain){node, node};
}

void parse_merge(parser *parser, const node *variable)
{
    entry *found = look_up(parser, variable);
    if (!found || !found->value || found->value->kind != NODE_DICT) {
        parse_error(parser, variable->line,
                    found ? "'$%s' stands alone but is not a dictionary"
                          : "'$%s' is not a key above this line",
                    variable->text);
        return;
    }
    if (!dict_merge(parser->current, found->value->dict))
        parse_error(parser, variable->line, "'$%s' would make the case too large", variable->text);
}
