/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * dict.y - the grammar of OpenFOAM dictionaries.
 *
 *     file    = { entry | bare list }            a bare list: polyMesh/points, a vectorField
 *     entry   = key { value } ";" | key "{" { entry } "}" | $macro [";"]
 *     value   = number | word | string | [dimensions] | $macro | list | number "{" value "}"
 *     list    = "(" { value | "{" { entry } "}" } ")"
 *
 * Tree building is in parse.c.
 */
%define api.pure full
%define api.prefix {case_yy}
%define parse.error verbose
%param { void *scanner }
%parse-param { parser *parser }

%code requires {
#include "parse.h"
}

%union {
    node *node;
    chain chain;
}

%code {
#include <string.h>

/* Leave the parser after an error that was found while building the tree. */
#define CHECK                       \
    do {                            \
        if (parser->failed) YYABORT; \
    } while (0)

int case_yylex(CASE_YYSTYPE *value, void *scanner);
static void case_yyerror(void *scanner, parser *parser, const char *message);
}

%token <node> NUMBER "number" WORD "word" STRING "string" DIMENSIONS "dimension set"
%token <node> VARIABLE "$name"
%token BAD "bad character"
%token END 0 "end of file"
%type <node> key list items
%type <chain> value values item

%precedence ALONE
%precedence '{'

%%

file: %empty | file entry | file bare_list ;

bare_list:
    list                        { parse_bare_list(parser, $1); }
  | NUMBER list                 { parse_bare_list(parser, $2); }
  ;

entries: %empty | entries entry ;

entry:
    key ';'                     { parse_set(parser, $1, (chain){NULL, NULL}); CHECK; }
  | key values ';'              { parse_set(parser, $1, $2); CHECK; }
  | open entries '}'            { parse_close(parser); }
  | VARIABLE                    { parse_merge(parser, $1); CHECK; }
  | ';'
  ;

key:
    WORD                        { $$ = $1; parse_key(parser, $1); }
  | STRING                      { $$ = $1; parse_key(parser, $1); }
  ;

open: key '{'                   { parse_open(parser, $1); CHECK; } ;

values:
    value
  | values value                { $$ = chain_append($1, $2); }
  ;

value:
    NUMBER %prec ALONE          { $$ = (chain){$1, $1}; }
  | WORD                        { $$ = (chain){$1, $1}; }
  | STRING                      { $$ = (chain){$1, $1}; }
  | DIMENSIONS                  { $$ = (chain){$1, $1}; }
  | VARIABLE                    { $$ = parse_expand(parser, $1); CHECK; }
  | list                        { $$ = (chain){$1, $1}; }
  | NUMBER '{' value '}'        { node *list = parse_repeat(parser, $1, $3);
                                  CHECK;
                                  $$ = (chain){list, list}; }
  ;

list: '(' items ')'             { $$ = $2; } ;

items:
    %empty                      { $$ = node_new(parser->store, NODE_LIST, parser->source->line); }
  | items item                  { parse_member(parser, $1, $2); $$ = $1; }
  ;

item:
    value
  | member entries '}'          { node *dict = parse_close(parser); $$ = (chain){dict, dict}; }
  ;

member: '{'                     { parse_open_member(parser, parser->source->line); } ;

%%

static void case_yyerror(void *scanner, parser *parser, const char *message)
{
    (void)scanner;
    if (parser->failed) return;
    const char *comma = strchr(message, ','); /* "syntax error, unexpected ..." */
    message = comma ? comma + 2 : message;
    if (parser->brackets > 0 && strstr(message, "unexpected end of file")) {
        const struct bracket *open = &parser->bracket[parser->brackets - 1];
        parse_error(parser, open->line, "'%c' missing: the %s%s%s that begins here is never closed",
                    open->kind == '{' ? '}' : ')', open->kind == '{' ? "dictionary" : "list",
                    open->key ? " of " : "", open->key ? open->key : "");
        return;
    }
    const node *key = parser->reading[parser->open];
    if (key)
        parse_error(parser, parser->source->line,
                    "%s in the value of '%s', which begins in line %d; is a ';' missing?", message,
                    key->text, key->line);
    else parse_error(parser, parser->source->line, "%s", message);
}
