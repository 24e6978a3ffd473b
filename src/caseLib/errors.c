/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * errors.c - collects messages, so that a user sees all mistakes of a case at once.
 *
 * Two texts: errors, which forbid a run, and notes, which do not. A message is kept once however
 * often it is given. The nearest word is found by the distance of Damerau and Levenshtein
 * (insert, delete, replace, swap neighbours), F. J. Damerau, Commun. ACM 7 (1964) 171,
 * doi:10.1145/363958.363994.
 */
#include "tree.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct text {
    char *line; /* messages, each ended by a newline */
    size_t length, capacity;
    int count;
} text;

struct case_errors {
    text error, note;
};

/* Beyond this a file is not a case but rubbish: more messages help nobody. */
#define MOST_MESSAGES 200

case_errors *case_errors_new(void)
{
    size_t none = 0;
    case_errors *errors = grow(NULL, &none, 1, sizeof *errors);
    memset(errors, 0, sizeof *errors);
    return errors;
}

void case_errors_free(case_errors *errors)
{
    if (!errors) return;
    free(errors->error.line);
    free(errors->note.line);
    free(errors);
}

int case_errors_count(const case_errors *errors)
{
    return errors->error.count;
}

const char *case_errors_text(const case_errors *errors)
{
    return errors->error.line ? errors->error.line : "";
}

const char *case_notes_text(const case_errors *errors)
{
    return errors->note.line ? errors->note.line : "";
}

static int has_line(const text *text, const char *line)
{
    size_t length = strlen(line);
    for (const char *at = text->line; at && *at; at = strchr(at, '\n') + 1)
        if (strncmp(at, line, length) == 0) return 1;
    return 0;
}

static void add(text *text, const char *file, int line, const char *format, va_list values)
{
    char message[2048], where[1024], *end = message + sizeof message - 2;
    if (line > 0)
        snprintf(where, sizeof where, "%s:%d: ", file, line);
    else
        snprintf(where, sizeof where, "%s%s", file, *file ? ": " : "");
    char *at = stpcpy(message, where);
    vsnprintf(at, (size_t)(end - at), format, values);
    for (char *c = message; *c; c++) /* what a file holds may not spoil the terminal */
        if ((unsigned char)*c < ' ' || *c == 127) *c = '?';
    strcat(message, "\n");
    if (has_line(text, message)) return;
    if (text->count++ > MOST_MESSAGES) return;
    size_t length = strlen(message);
    text->line = grow(text->line, &text->capacity, text->length + length + 1, 1);
    memcpy(text->line + text->length, message, length + 1);
    text->length += length;
}

void case_error(case_errors *errors, const char *file, int line, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    add(&errors->error, file, line, format, values);
    va_end(values);
}

void case_note(case_errors *errors, const char *file, int line, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    add(&errors->note, file, line, format, values);
    va_end(values);
}

/* ---- nearest word ---------------------------------------------------------------------------- */

#define LONGEST 63

static int least(int a, int b)
{
    return a < b ? a : b;
}

/* Damerau and Levenshtein's distance, upper and lower case alike ("restricted" form). */
static int distance(const char *a, const char *b)
{
    int d[LONGEST + 2][LONGEST + 2], n = (int)strlen(a), m = (int)strlen(b);
    if (n > LONGEST || m > LONGEST) return LONGEST;
    for (int i = 0; i <= n; i++) d[i][0] = i;
    for (int j = 0; j <= m; j++) d[0][j] = j;
    for (int i = 1; i <= n; i++)
        for (int j = 1; j <= m; j++) {
            int p = tolower((unsigned char)a[i - 1]), q = tolower((unsigned char)b[j - 1]);
            d[i][j] = least(least(d[i - 1][j], d[i][j - 1]) + 1, d[i - 1][j - 1] + (p != q));
            if (i > 1 && j > 1 && p == tolower((unsigned char)b[j - 2]) &&
                q == tolower((unsigned char)a[i - 2]))
                d[i][j] = least(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[n][m];
}

const char *case_nearest(const char *word, const char *const *words)
{
    const char *nearest = NULL;
    int length = (int)strlen(word), best = 1 + least(3, length < 3 ? 1 : (length + 2) / 4 + 1);
    for (; *words; words++) {
        int d = distance(word, *words);
        if (d < best) {
            best = d;
            nearest = *words;
        }
    }
    return nearest;
}
