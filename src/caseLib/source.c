/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * source.c - files and texts that a dictionary is read from, and the stack of #include.
 *
 * A name in #include is relative to the directory of the file it stands in. $NAME and ${NAME} in it
 * are taken from the environment; $FOAM_CASE, <case>, <constant> and <system> mean the case that
 * the first file belongs to. A file that includes itself, however indirectly, is an error.
 */
#include "parse.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

int case_yyparse(void *scanner, parser *parser);

/* The scanner counts in int; a dictionary near this size is a mistake. */
#define LARGEST_FILE ((off_t)1 << 30)

/* ---- files ----------------------------------------------------------------------------------- */

/* Whole file as a string to be freed, or NULL with the reason. */
static char *read_file(const char *path, char *reason, size_t size)
{
    struct stat status;
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    if (!file || fstat(fileno(file), &status) != 0) {
        snprintf(reason, size, "cannot be read: %s", strerror(errno));
    } else if (!S_ISREG(status.st_mode)) {
        snprintf(reason, size, "is not a regular file");
    } else if (status.st_size > LARGEST_FILE) {
        snprintf(reason, size, "is larger than 1 GiB");
    } else {
        size_t none = 0, length;
        text = grow(NULL, &none, (size_t)status.st_size + 1, 1);
        length = fread(text, 1, (size_t)status.st_size, file);
        text[length] = '\0';
        char *nul = memchr(text, '\0', length);
        if (nul) {
            int line = 1;
            for (char *c = text; c < nul; c++) line += *c == '\n';
            snprintf(reason, size, "holds a zero byte in line %d: only format ascii is read", line);
            free(text);
            text = NULL;
        }
    }
    if (file) fclose(file);
    return text;
}

static void push(parser *parser, const char *name, char *path, char *text)
{
    static const char mark[] = "\xEF\xBB\xBF"; /* of UTF-8, by some editors */
    source *source = store_alloc(parser->store, sizeof *source);
    if (strncmp(text, mark, 3) == 0) memset(text, ' ', 3);
    source->name = store_text(parser->store, name, strlen(name));
    source->path = path;
    source->text = text;
    source->line = 1;
    source->depth = parser->brackets;
    source->below = parser->source;
    parser->source = source;
    if (!scan_push(parser)) parse_error(parser, 0, "out of memory");
    free(source->text); /* the scanner has its own copy */
    source->text = NULL;
}

static void pop(parser *parser)
{
    free(parser->source->path);
    parser->source = parser->source->below;
}

/* ---- include --------------------------------------------------------------------------------- */

/* Append at most what fits; 0 when it does not. */
static int append(char *to, size_t size, const char *text, size_t length)
{
    size_t used = strlen(to);
    if (used + length >= size) return 0;
    memcpy(to + used, text, length);
    to[used + length] = '\0';
    return 1;
}

static const char *variable(const parser *parser, const char *name)
{
    if (strcmp(name, "FOAM_CASE") == 0 && parser->case_directory) return parser->case_directory;
    return getenv(name);
}

/* Write `name` with its variables replaced; 0 with an error. */
static int expand_name(parser *parser, const char *name, char *path, size_t size)
{
    int line = parser->source->line, fits = 1;
    *path = '\0';
    if (*name == '<' && strchr(name, '>') && parser->case_directory) {
        size_t length = strcspn(name, ">") + 1;
        int whole = strncmp(name, "<case>", length) == 0;
        fits = append(path, size, parser->case_directory, strlen(parser->case_directory)) &&
               (whole || (append(path, size, "/", 1) && append(path, size, name + 1, length - 2)));
        name += length;
    }
    while (*name && fits) {
        if (*name != '$') {
            size_t length = strcspn(name, "$");
            fits = append(path, size, name, length);
            name += length;
            continue;
        }
        char key[128];
        int brace = name[1] == '{';
        const char *begin = name + 1 + brace, *end = begin;
        while (isalnum((unsigned char)*end) || *end == '_') end++;
        if (end == begin || (size_t)(end - begin) >= sizeof key || (brace && *end != '}')) {
            parse_error(parser, line, "'%s' is not the name of a variable", name);
            return 0;
        }
        memcpy(key, begin, (size_t)(end - begin));
        key[end - begin] = '\0';
        const char *value = variable(parser, key);
        if (!value) {
            parse_error(parser, line, "the environment variable %s is not set", key);
            return 0;
        }
        fits = append(path, size, value, strlen(value));
        name = end + brace;
    }
    if (!fits) parse_error(parser, line, "the name of the included file is too long");
    return fits;
}

/* Path of an included file: relative to the file that includes it. */
static int included_path(parser *parser, const char *name, char *path, size_t size)
{
    char expanded[2048];
    if (!expand_name(parser, name, expanded, sizeof expanded)) return 0;
    const char *slash = strrchr(parser->source->name, '/');
    int directory = slash && *expanded != '/' ? (int)(slash - parser->source->name + 1) : 0;
    if (snprintf(path, size, "%.*s%s", directory, parser->source->name, expanded) >= (int)size) {
        parse_error(parser, parser->source->line, "the name of the included file is too long");
        return 0;
    }
    return 1;
}

int parse_include(parser *parser, const char *name, int optional)
{
    char path[2560], reason[256];
    int line = parser->source->line, depth = 0;
    if (!included_path(parser, name, path, sizeof path)) return 0;
    char *real = realpath(path, NULL);
    if (!real && optional) return 1;
    for (const source *source = parser->source; source; source = source->below, depth++) {
        if (!real || !source->path || strcmp(source->path, real) != 0) continue;
        parse_error(parser, line,
                    "#include \"%s\" goes round in a circle: %s is being read already", name,
                    source->name);
        free(real);
        return 0;
    }
    if (depth >= INCLUDE_DEPTH || ++parser->includes > INCLUDE_COUNT) {
        parse_error(parser, line,
                    "#include \"%s\": more than %d files in one another, or %d in all", name,
                    INCLUDE_DEPTH, INCLUDE_COUNT);
        free(real);
        return 0;
    }
    char *text = read_file(path, reason, sizeof reason);
    if (!text) {
        parse_error(parser, line, "#include \"%s\": the file %s %s", name, path, reason);
        free(real);
        return 0;
    }
    push(parser, path, real, text);
    return !parser->failed;
}

int parse_source_end(parser *parser)
{
    const source *source = parser->source;
    if (!source->below) return 0;
    if (parser->brackets > source->depth) {
        const struct bracket *open = &parser->bracket[parser->brackets - 1];
        parse_error(parser, open->line, "'%c' missing: what begins here is never closed",
                    open->kind == '{' ? '}' : ')');
        return 0;
    }
    scan_pop(parser);
    pop(parser);
    return 1;
}

/* ---- reading --------------------------------------------------------------------------------- */

/* Directory of the case that a file belongs to: above system, constant or a time directory. */
static const char *case_of(store *store, const char *real)
{
    const char *slash = real ? strrchr(real, '/') : NULL;
    if (!slash || slash == real) return NULL;
    const char *above = slash - 1;
    while (above > real && *above != '/') above--;
    char folder[64];
    snprintf(folder, sizeof folder, "%.*s", (int)(slash - above - 1), above + 1);
    char *end;
    strtod(folder, &end);
    int inside = strcmp(folder, "system") == 0 || strcmp(folder, "constant") == 0 || *end == '\0';
    return store_text(store, real, (size_t)((inside ? above : slash) - real));
}

static case_dict *parse(store *store, const char *name, char *path, char *text, case_errors *errors)
{
    parser parser = {.store = store, .errors = errors};
    parser.case_directory = case_of(store, path);
    const char *own_name = store_text(store, name, strlen(name));
    parser.root = parser.current = dict_new(store, NULL, "", own_name, 1);
    parser.root->expanded = !path && strstr(text, "#line ") != NULL;
    if (!scan_begin(&parser)) {
        case_error(errors, name, 0, "out of memory");
        parser.failed = 1;
        free(path);
        free(text);
    } else {
        push(&parser, name, path, text);
        if (!parser.failed && case_yyparse(parser.scanner, &parser) != 0 && !parser.failed)
            parse_error(&parser, 0, "cannot be read: nested too deep or out of memory");
    }
    while (parser.source) pop(&parser);
    scan_end(&parser);
    if (!parser.failed) return parser.root;
    store_free(store);
    return NULL;
}

case_dict *case_dict_read(const char *path, case_errors *errors)
{
    char reason[256];
    char *text = read_file(path, reason, sizeof reason);
    if (!text) {
        case_error(errors, path, 0, "the file %s", reason);
        return NULL;
    }
    return parse(store_new(), path, realpath(path, NULL), text, errors);
}

case_dict *case_dict_parse(const char *text, const char *name, case_errors *errors)
{
    size_t none = 0, length = strlen(text);
    char *copy = grow(NULL, &none, length + 1, 1);
    memcpy(copy, text, length + 1);
    return parse(store_new(), name, NULL, copy, errors);
}

void case_dict_free(case_dict *dict)
{
    if (dict) store_free(dict->store);
}
