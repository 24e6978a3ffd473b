/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseValue.c - single values: defaults, ranges, units, messages with the nearest word.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseFixture.h"
#include "near.h"

static void numbers(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict =
        parsed("a 1.25; nu nu [0 2 -1 0 0 0 0] 1e-5; rho [1 -3 0] 997; u uniform 3;", errors);
    assert_near(case_scalar(dict, "a", NULL, case_any, errors), 1.25, 0);
    assert_near(case_scalar(dict, "nu", NULL, case_positive, errors), 1e-5, 0);
    assert_near(case_scalar(dict, "rho", NULL, case_positive, errors), 997, 0);
    assert_near(case_scalar(dict, "u", NULL, case_positive, errors), 3, 0);
    assert_near(case_scalar(dict, "none", &(double){4.5}, case_positive, errors), 4.5, 0);
    assert_int_equal(case_integer(dict, "rho", NULL, 0, 1000, errors), 997);
    assert_int_equal(case_integer(dict, "none", &(long){17}, 0, 1000, errors), 17);
    assert_clean(errors);
    case_dict_free(dict);
    case_errors_free(errors);
}

/* Each wrong value on a line of its own, and the message it must give. */
static void wrong_numbers(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict =
        parsed("zero 0;\nminus -1;\nbig 1e999;\nword nan;\ntwo 1 2;\nvector (1 2 3);\n"
               "dict { }\nhalf .5;\nnone;\nhex 0x10;",
               errors);
    const char *keys[] = {"zero",   "minus", "big",  "word", "two",
                          "vector", "dict",  "none", "hex",  "gone"};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        assert_true(isnan(case_scalar(dict, keys[i], NULL, case_positive, errors)));
    assert_int_equal(case_errors_count(errors), sizeof keys / sizeof *keys);
    assert_says(errors, "text:1: zero: found '0'; accepted: a number > 0\n");
    assert_says(errors, "text:2: minus: found '-1'");
    assert_says(errors, "text:3: big: found '1e999'");
    assert_says(errors, "text:4: word: found 'nan'");
    assert_says(errors, "text:5: two: found '1 2' (is a ';' missing?)");
    assert_says(errors, "text:6: vector: found '(1 2 3)'");
    assert_says(errors, "text:7: dict: found a dictionary");
    assert_says(errors, "text:9: none: found nothing");
    assert_says(errors, "text:1: gone: missing; accepted: a number > 0\n");
    case_integer(dict, "half", NULL, 0, 9, errors);
    assert_says(errors, "text:8: half: found '.5'; accepted: a whole number >= 0 and <= 9\n");
    case_scalar(dict, "zero", NULL, (case_range){0, 1, 1, 0}, errors);
    assert_says(errors, "text:1: zero: found '0'; accepted: a number > 0 and <= 1\n");
    case_dict_free(dict);
    case_errors_free(errors);
}

static void ranges(void **unused)
{
    (void)unused;
    const case_range half_open = {0, 1, 1, 0};
    const struct {
        const char *text;
        case_range range;
        int good;
    } cases[] = {{"a 0;", case_non_negative, 1},  {"a 0;", case_positive, 0},
                 {"a 0;", case_fraction, 1},      {"a 1;", case_fraction, 1},
                 {"a 1.0001;", case_fraction, 0}, {"a 0;", half_open, 0},
                 {"a 1;", half_open, 1},          {"a 1e-300;", half_open, 1},
                 {"a -1e300;", case_any, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        case_errors *errors = case_errors_new();
        case_dict *dict = parsed(cases[i].text, errors);
        case_scalar(dict, "a", NULL, cases[i].range, errors);
        assert_int_equal(case_errors_count(errors), !cases[i].good);
        case_dict_free(dict);
        case_errors_free(errors);
    }
}

/* A file that could not be read has been complained of: no crash, no second message. */
static void no_dictionary(void **unused)
{
    (void)unused;
    const char *const words[] = {"a", NULL};
    case_errors *errors = case_errors_new();
    double *value, vector[3];
    assert_true(isnan(case_scalar(NULL, "a", NULL, case_any, errors)));
    assert_int_equal(case_numbers(NULL, "a", &value, errors), 0);
    assert_int_equal(case_choice(NULL, "a", words, -1, errors), 0);
    case_vector(NULL, "a", NULL, vector, errors);
    assert_null(case_sub(NULL, "a", 1, errors));
    case_known(NULL, words, errors);
    assert_int_equal(case_dict_size(NULL) + case_list_size(NULL, "a"), 0);
    assert_clean(errors);
    case_errors_free(errors);
}

static void switches_vectors_words(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("a on; b no; c maybe; v (1 -2 3.5); u uniform (4 5 6); w (1 2); n -;\n"
                             "s \"a b\"; l linear; m heertz; x 5;",
                             errors);
    double v[3];
    assert_true(case_bool(dict, "a", NULL, errors));
    assert_false(case_bool(dict, "b", NULL, errors));
    assert_true(case_bool(dict, "none", &(int){1}, errors));
    case_vector(dict, "v", NULL, v, errors);
    assert_near(v[1], -2, 0);
    case_vector(dict, "u", NULL, v, errors);
    assert_near(v[2], 6, 0);
    case_vector(dict, "none", (const double[]){7, 8, 9}, v, errors);
    assert_near(v[0], 7, 0);
    assert_string_equal(case_word(dict, "s", NULL, 1, errors), "a b");
    const char *const laws[] = {"linear", "hertz", NULL};
    assert_int_equal(case_choice(dict, "l", laws, -1, errors), 0);
    assert_int_equal(case_choice(dict, "none", laws, 1, errors), 1);
    assert_clean(errors);
    case_bool(dict, "c", NULL, errors);
    case_vector(dict, "w", NULL, v, errors);
    case_choice(dict, "m", laws, -1, errors);
    assert_null(case_word(dict, "x", NULL, 1, errors));
    assert_null(case_sub(dict, "x", 0, errors));
    assert_says(errors, "c: found 'maybe'; accepted: yes, no, true, false, on, off");
    assert_says(errors, "w: found '(1 2)'; accepted: a vector (x y z)");
    assert_says(errors, "m: found 'heertz'; accepted: linear, hertz; did you mean 'hertz'?");
    assert_says(errors, "x: found '5'; accepted: a word");
    assert_says(errors, "x: found '5'; accepted: a dictionary");
    case_dict_free(dict);
    case_errors_free(errors);
}

static void unknown_keys(void **unused)
{
    (void)unused;
    const char *const known[] = {"density", "youngsModulus", "poissonRatio", NULL};
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("FoamFile { } variables { d 1; } m 2; a { densty 1; youngModulus 2;\n"
                             "poissonsRatio 3; colour 4; density $m; }",
                             errors);
    case_known(case_sub(dict, "a", 1, errors), known, errors);
    assert_int_equal(case_errors_count(errors), 4);
    assert_says(errors,
                "text:1: a.densty: unknown key; accepted: density, youngsModulus, poissonRatio; "
                "did you mean 'density'?");
    assert_says(errors, "did you mean 'youngsModulus'?");
    assert_says(errors, "did you mean 'poissonRatio'?");
    assert_says(errors,
                "text:2: a.colour: unknown key; accepted: density, youngsModulus, poissonRatio\n");
    const char *const top[] = {"a", NULL};
    case_known(dict, top, errors); /* m is known since a macro used it */
    assert_int_equal(case_errors_count(errors), 4);
    case_dict_free(dict);
    case_errors_free(errors);
}

/* The same mistake met twice is said once; many mistakes do not flood. */
static void messages(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_error(errors, "file", 3, "wrong %d", 5);
    case_error(errors, "file", 3, "wrong %d", 5);
    case_error(errors, "file", 0, "no line\x1b[31m\n");
    case_note(errors, "file", 4, "only a note");
    assert_int_equal(case_errors_count(errors), 2);
    assert_string_equal(case_errors_text(errors), "file:3: wrong 5\nfile: no line?[31m?\n");
    assert_string_equal(case_notes_text(errors), "file:4: only a note\n");
    for (int i = 0; i < 10000; i++) case_error(errors, "file", i + 10, "again");
    assert_true(strlen(case_errors_text(errors)) < 10000);
    assert_true(case_errors_count(errors) > 9000);
    case_errors_free(errors);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers),
        cmocka_unit_test(wrong_numbers),
        cmocka_unit_test(ranges),
        cmocka_unit_test(no_dictionary),
        cmocka_unit_test(switches_vectors_words),
        cmocka_unit_test(unknown_keys),
        cmocka_unit_test(messages),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
