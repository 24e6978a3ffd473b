/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * series.c - time series in <case>/postProcessing, which go on after a restart (cpl_table_open).
 */
#include "cpl.h"
#include "felmiDEM.h"
#include "message.h"

#include <stdlib.h>

FILE *series_open(const char *directory, const char *name, const char *head, double from)
{
    char path[4096], message[4500];
    snprintf(path, sizeof path, "%s/postProcessing/%s", directory, name);
    FILE *file = cpl_table_open(path, head, from, message, sizeof message);
    if (file == NULL)
        message_stop("felmiDEM", "%s", message);
    else if (message[0] != '\0')
        printf("%s: %s\n", path, message);
    return file;
}

char *head_of(void (*write)(FILE *file, const dem_sim *sim), const dem_sim *sim)
{
    char *head = NULL;
    size_t length;
    FILE *file = open_memstream(&head, &length);
    if (file != NULL) write(file, sim);
    if (file != NULL && fclose(file) == 0) return head;
    free(head);
    message_stop("felmiDEM", "out of memory");
    return NULL;
}
