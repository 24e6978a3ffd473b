/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * message.c - messages on stderr, after what the log has to say; on several ranks those of one.
 */
#include "message.h"

#include <limits.h>
#include <mpi.h>
#include <stdarg.h>

static FILE *aside; /* on ranks that do not speak: a stream into `text` */
static char *text;
static size_t length;

FILE *message_stream(void)
{
    return aside ? aside : stderr;
}

void message_stop(const char *program, const char *format, ...)
{
    va_list values;
    FILE *out = message_stream();
    fflush(stdout);
    fprintf(out, "%s: ", program);
    va_start(values, format);
    vfprintf(out, format, values);
    va_end(values);
    fputc('\n', out);
}

int message_case(const char *program, const case_errors *errors)
{
    const int count = case_errors_count(errors);
    fputs(case_notes_text(errors), stdout);
    if (count == 0) return 0;
    message_stop(program, "%d error%s in the case:", count, count == 1 ? "" : "s");
    fputs(case_errors_text(errors), message_stream());
    return count;
}

/* ---- several ranks --------------------------------------------------------------------------- */

int message_first_rank_speaks(void)
{
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (rank == 0) return 0;
    aside = open_memstream(&text, &length);
    return aside == NULL || freopen("/dev/null", "w", stdout) == NULL ? -1 : 0;
}

int message_agree(int failed)
{
    int rank, first;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    const int mine = failed ? rank : INT_MAX;
    MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    if (first == INT_MAX) return 0;
    static char heard[1 << 16]; /* more than that is nobody's to read */
    if (first > 0 && rank == first) {
        fflush(aside);
        const size_t n = length < sizeof heard ? length : sizeof heard;
        MPI_Send(text, (int)n, MPI_CHAR, 0, 0, MPI_COMM_WORLD);
    } else if (first > 0 && rank == 0) {
        MPI_Status status;
        int n;
        MPI_Recv(heard, sizeof heard, MPI_CHAR, first, 0, MPI_COMM_WORLD, &status);
        MPI_Get_count(&status, MPI_CHAR, &n);
        fflush(stdout);
        fwrite(heard, 1, (size_t)n, stderr);
    }
    return 1;
}
