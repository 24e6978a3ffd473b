/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * series.c - the XDMF file that strings snapshots together to a time series.
 *
 * A temporal collection of point clouds (Polyvertex), each a grid that refers to the datasets of
 * one HDF5 file beside it. The file itself is the record of what was written: grids of earlier
 * times are carried over as text, so that a restarted run continues the series it finds. An instant
 * without particles has no grid: readers of XDMF stumble over empty arrays.
 *
 * XDMF model and format, version 3: https://www.xdmf.org/index.php/XDMF_Model_and_Format
 */
#include "series.h"
#include "h5file.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct series {
    char directory[PATH_MAX], path[PATH_MAX], part[PATH_MAX];
};

static const char HEAD[] = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                           "<!-- particles over time, written by felmiFoam -->\n"
                           "<Xdmf Version=\"3.0\">\n"
                           "  <Domain>\n"
                           "    <Grid Name=\"particles\" GridType=\"Collection\" "
                           "CollectionType=\"Temporal\">\n";
static const char TAIL[] = "    </Grid>\n  </Domain>\n</Xdmf>\n";
static const char OPEN[] = "      <Grid Name=\"", CLOSE[] = "      </Grid>\n";
static const char TIME[] = "<Time Value=\"";

/* A name as XML wants it. */
static void escape(const char *name, char *out, size_t size)
{
    size_t used = 0;
    for (; *name != '\0' && used + 7 < size; name++) {
        const char *as = *name == '&'   ? "&amp;"
                         : *name == '<' ? "&lt;"
                         : *name == '>' ? "&gt;"
                         : *name == '"' ? "&quot;"
                                        : NULL;
        if (as != NULL)
            used += (size_t)sprintf(out + used, "%s", as);
        else
            out[used++] = *name;
    }
    out[used] = '\0';
}

/* The shortest text that reads back as the same number. */
static void number_text(double value, char text[32])
{
    for (int digits = 9; digits <= 17; digits++) {
        snprintf(text, 32, "%.*g", digits, value);
        if (strtod(text, NULL) == value) return;
    }
}

static void put_item(FILE *f, const char *name, unsigned long long n, int width, const char *type,
                     int bytes, const char *set)
{
    fprintf(f, "          <DataItem Format=\"HDF\" NumberType=\"%s\" Precision=\"%d\" ", type,
            bytes);
    if (width > 1)
        fprintf(f, "Dimensions=\"%llu %d\">", n, width);
    else
        fprintf(f, "Dimensions=\"%llu\">", n);
    fprintf(f, "%s.h5:/particles/%s</DataItem>\n", name, set);
}

static void put_grid(FILE *f, const char *name, double time, unsigned long long n)
{
    static const struct {
        const char *set, *type;
        int width, bytes;
    } columns[] = {{"velocity", "Float", 3, 8}, {"angularVelocity", "Float", 3, 8},
                   {"force", "Float", 3, 8},    {"diameter", "Float", 1, 8},
                   {"density", "Float", 1, 8},  {"material", "Int", 1, 4},
                   {"id", "Int", 1, 8}};
    char text[32];
    number_text(time, text);
    fprintf(f, "%s%s\" GridType=\"Uniform\">\n        %s%s\"/>\n", OPEN, name, TIME, text);
    fprintf(f,
            "        <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%llu\" "
            "NodesPerElement=\"1\"/>\n        <Geometry GeometryType=\"XYZ\">\n",
            n);
    put_item(f, name, n, 3, "Float", 8, "position");
    fprintf(f, "        </Geometry>\n");
    for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) {
        fprintf(f, "        <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">\n",
                columns[c].set, columns[c].width == 3 ? "Vector" : "Scalar");
        put_item(f, name, n, columns[c].width, columns[c].type, columns[c].bytes, columns[c].set);
        fprintf(f, "        </Attribute>\n");
    }
    fprintf(f, "%s", CLOSE);
}

/* Copy the grids of `old` that come before `time` and have another name. */
static void keep_earlier(FILE *f, const char *old, const char *name, double time)
{
    /* Times a rounding apart are the same instant computed twice. */
    const double before = time - 1e-9 * fabs(time);
    for (const char *grid = strstr(old, OPEN); grid != NULL; grid = strstr(grid + 1, OPEN)) {
        const char *end = strstr(grid, CLOSE), *t = strstr(grid, TIME);
        if (end == NULL || t == NULL || t > end) continue;
        const char *its_name = grid + strlen(OPEN);
        const size_t length = strlen(name);
        const int same = strncmp(its_name, name, length) == 0 && its_name[length] == '"';
        if (!same && strtod(t + strlen(TIME), NULL) < before)
            fwrite(grid, 1, (size_t)(end - grid) + strlen(CLOSE), f);
    }
}

/* The whole text of a file, "" if there is none; NULL on error (errno). */
static char *read_whole(const char *path)
{
    FILE *f = fopen(path, "r");
    if (f == NULL) return errno == ENOENT ? calloc(1, 1) : NULL;
    char *text = NULL;
    size_t used = 0, capacity = 0, got = 0;
    do {
        if (capacity - used < 4096) {
            capacity = 2 * capacity + 65536;
            char *more = realloc(text, capacity);
            if (more == NULL) break;
            text = more;
        }
        got = fread(text + used, 1, capacity - used - 1, f);
        used += got;
    } while (got > 0);
    const int bad = ferror(f) || got > 0;
    fclose(f);
    if (bad) {
        free(text);
        return NULL;
    }
    text[used] = '\0';
    return text;
}

static int write_whole(const series *s, const char *old, const char *name, double time,
                       unsigned long long n)
{
    FILE *f = fopen(s->part, "w");
    if (f == NULL) return -1;
    fputs(HEAD, f);
    keep_earlier(f, old, name, time);
    if (n > 0) put_grid(f, name, time, n);
    fputs(TAIL, f);
    const int bad = fflush(f) != 0 || ferror(f) || fsync(fileno(f)) != 0;
    const int saved = errno;
    const int closed = fclose(f);
    if (bad) errno = saved;
    return bad || closed != 0 ? -1 : 0;
}

series *series_begin(const char *directory, const char *name, double time, unsigned long long n,
                     char *message, size_t size)
{
    series *s = calloc(1, sizeof *s);
    char escaped[6 * 256 + 8];
    if (s == NULL) {
        snprintf(message, size, "out of memory");
        return NULL;
    }
    snprintf(s->directory, sizeof s->directory, "%s", directory);
    const int a = snprintf(s->path, sizeof s->path, "%s/particles.xmf", directory);
    const int b = snprintf(s->part, sizeof s->part, "%s/.particles.xmf.part", directory);
    errno = ENAMETOOLONG;
    const int fits = a < (int)sizeof s->path && b < (int)sizeof s->part;
    escape(name, escaped, sizeof escaped);
    char *old = fits ? read_whole(s->path) : NULL;
    if (old == NULL || write_whole(s, old, escaped, time, n) != 0) {
        snprintf(message, size, "particles.xmf: %s", strerror(errno));
        free(old);
        series_abandon(s);
        return NULL;
    }
    free(old);
    return s;
}

int series_commit(series *s, char *message, size_t size)
{
    if (rename(s->part, s->path) != 0) {
        snprintf(message, size, "particles.xmf: %s", strerror(errno));
        series_abandon(s);
        return -1;
    }
    h5file_synchronise_directory(s->directory); /* with it the renaming itself */
    free(s);
    return 0;
}

void series_abandon(series *s)
{
    unlink(s->part);
    free(s);
}
