/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * near.h - comparison of doubles for cmocka, whose own compares in single precision or not at all
 * before version 1.1.8, and the line in which a test says what it measured. A NaN is near nothing.
 * Include after cmocka.h.
 */
#ifndef NEAR_H
#define NEAR_H

#include <math.h>

#define assert_near(value, expected, tolerance)                                                    \
    near_check((value), (expected), (tolerance), #value, __FILE__, __LINE__)

static inline void near_check(double value, double expected, double tolerance, const char *what,
                              const char *file, int line)
{
    if (fabs(value - expected) <= tolerance) return;
    print_error("%s = %.16g, expected %.16g within %.3g: off by %.3g\n", what, value, expected,
                tolerance, value - expected);
    _fail(file, line);
}

/* What was measured beside its reference; the error is relative, or absolute where that is 0. */
static inline void report(const char *what, double measured, double expected)
{
    const double error = measured - expected;
    print_message("%-58s %13.8g, expected %13.8g, error %.1e\n", what, measured, expected,
                  expected != 0 ? error / expected : error);
}

#endif
