/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * files.h - files of a case directory; private to caseLib.
 */
#ifndef CASE_FILES_H
#define CASE_FILES_H

#include "case.h"

/* Read <directory>/<name>; NULL with an error. */
case_dict *read_case_file(const char *directory, const char *name, case_errors *errors);
int case_file_exists(const char *directory, const char *name);
/* In a dictionary that others add keys to: an error for what looks like a misspelling. */
void suspect_keys(const case_dict *dict, const char *const *known, case_errors *errors);

#endif
