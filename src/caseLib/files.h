/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * files.h - files of a case directory; private to caseLib.
 */
#ifndef CASE_FILES_H
#define CASE_FILES_H

#include "case.h"

/* In a dictionary that others add keys to: an error for what looks like a misspelling. */
void suspect_keys(const case_dict *dict, const char *const *known, case_errors *errors);

#endif
