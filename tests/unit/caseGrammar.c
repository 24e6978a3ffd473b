/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseGrammar.c - OpenFOAM's dictionary language: what is understood, and what is refused how.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseFixture.h"
#include "near.h"

static void comments_words_and_nesting(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("/* a\n b */ FoamFile { version 2.0; }\n"
                             "div(alphaPhi,U) Gauss linear; // c\n"
                             "div(((a*b)*dev2(T(grad(U))))) upwind;\n"
                             "outer { inner { x -2.5e-3; y word; } } ;\n"
                             "\"(U|k)(Final)?\" { tol 1e-7; }\n"
                             "empty; path \"a/b \\\"c\\\"\";",
                             errors);
    assert_int_equal(case_dict_size(dict), 7);
    assert_string_equal(case_dict_key(dict, 2), "div(((a*b)*dev2(T(grad(U)))))");
    assert_string_equal(case_word(dict, "div(((a*b)*dev2(T(grad(U)))))", NULL, 1, errors),
                        "upwind");
    assert_int_equal(case_dict_line(dict, "outer"), 5);
    const case_dict *inner = case_sub(case_sub(dict, "outer", 1, errors), "inner", 1, errors);
    assert_near(case_scalar(inner, "x", NULL, case_any, errors), -2.5e-3, 0);
    assert_string_equal(case_word(inner, "y", NULL, 1, errors), "word");
    assert_clean(errors);
    case_dict_free(dict);
    case_errors_free(errors);
}

/* A quoted key is a regular expression for whole words; an exact key goes first, then the last. */
static void patterns(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("wall1 1; \"wall.*\" 2; \"(U|k)(Final)?\" 3; \".*2\" 4;", errors);
    const struct {
        const char *key;
        double value;
    } expected[] = {{"wall1", 1}, {"wall7", 2}, {"wall2", 4}, {"UFinal", 3}, {"k", 3}};
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
        assert_near(case_scalar(dict, expected[i].key, NULL, case_any, errors), expected[i].value,
                    0);
    assert_false(case_has(dict, "xU"));
    assert_false(case_has(dict, "FinalU"));
    case_dict_free(dict);
    case_errors_free(errors);
}

static void lists(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("flat (1 2.5 -3);counted 3 (1 2 3); rows ((1 2 3) (4 5 6));\n"
                             "uneven ((1 2) (3 4 5) 6); uniform 4 { 7.5 }; vectors 2 { (1 2 3) };\n"
                             "field nonuniform List<vector> 2 ((1 2 3)\n(4 5 6));\n"
                             "none (); deep (((1 2) (3 4)) ((5 6) (7 8)));\n"
                             "nested 2 (2 (1 2) 3 (3 4 5)); short 4 (1 2 3);\n"
                             "dicts ({ a 1; } name { a 2; });",
                             errors);
    const struct {
        const char *key;
        size_t n;
        double last;
    } expected[] = {{"flat", 3, -3},  {"counted", 3, 3},   {"rows", 6, 6},
                    {"uneven", 6, 6}, {"uniform", 4, 7.5}, {"vectors", 6, 3},
                    {"field", 6, 6},  {"deep", 8, 8},      {"nested", 5, 5}};
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        double *value = NULL;
        assert_int_equal(case_numbers(dict, expected[i].key, &value, errors), expected[i].n);
        assert_clean(errors);
        assert_near(value[expected[i].n - 1], expected[i].last, 0);
        free(value);
    }
    assert_int_equal(case_list_size(dict, "dicts"), 2);
    assert_string_equal(case_dict_name(case_list_at(dict, "dicts", 1)), "name");
    assert_near(case_scalar(case_list_at(dict, "dicts", 1), "a", NULL, case_any, errors), 2, 0);
    double *value;
    assert_int_equal(case_numbers(dict, "none", &value, errors), 0);
    assert_clean(errors);
    case_numbers(dict, "short", &value, errors);
    assert_null(value);
    assert_says(errors, "text:6: short: the list says 4 members but has 3");
    case_dict_free(dict);
    case_errors_free(errors);
}

/* Later values replace earlier ones, dictionaries are merged. */
static void duplicates(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("a 1; b { x 1; y { z 1; } } a 2;\nb { y { w 5; } v 3; x 4; }", errors);
    assert_near(case_scalar(dict, "a", NULL, case_any, errors), 2, 0);
    const case_dict *b = case_sub(dict, "b", 1, errors), *y = case_sub(b, "y", 1, errors);
    assert_near(case_scalar(b, "x", NULL, case_any, errors), 4, 0);
    assert_near(case_scalar(b, "v", NULL, case_any, errors), 3, 0);
    assert_near(case_scalar(y, "z", NULL, case_any, errors), 1, 0);
    assert_near(case_scalar(y, "w", NULL, case_any, errors), 5, 0);
    assert_int_equal(case_dict_size(dict), 2);
    case_scalar(y, "no", NULL, case_any, errors);
    assert_says(errors, "b.y.no: missing");
    case_dict_free(dict);
    case_errors_free(errors);
}

static void macros(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    setenv("FELMI_TEST_NUMBER", "12.5", 1);
    case_dict *dict = parsed("d 0.0025; a 1;\n"
                             "base { d 3; sub { e (1 2 3); } }\n"
                             "one { x $d; y $:base.d; a 7; z $a; inner { up $..a; top ${d}; } }\n"
                             "two { $base; d 4; }\n"
                             "three $base;\n"
                             "four ($d $base.sub.e $FELMI_TEST_NUMBER);\n"
                             "three { d 5; }",
                             errors);
    const case_dict *one = case_sub(dict, "one", 1, errors);
    const case_dict *inner = case_sub(one, "inner", 1, errors);
    assert_near(case_scalar(one, "x", NULL, case_any, errors), .0025, 0);
    assert_near(case_scalar(one, "y", NULL, case_any, errors), 3, 0);
    assert_near(case_scalar(one, "z", NULL, case_any, errors), 7, 0);
    assert_near(case_scalar(inner, "up", NULL, case_any, errors), 7, 0);
    assert_near(case_scalar(inner, "top", NULL, case_any, errors), .0025, 0);
    const case_dict *two = case_sub(dict, "two", 1, errors),
                    *three = case_sub(dict, "three", 1, errors);
    assert_near(case_scalar(two, "d", NULL, case_any, errors), 4, 0);
    assert_near(case_scalar(three, "d", NULL, case_any, errors), 5, 0);
    assert_near(case_scalar(case_sub(dict, "base", 1, errors), "d", NULL, case_any, errors), 3, 0);
    assert_true(case_has(case_sub(two, "sub", 1, errors), "e"));
    double *value;
    assert_int_equal(case_numbers(dict, "four", &value, errors), 5);
    assert_near(value[0] + value[3] + value[4], .0025 + 3 + 12.5, 1e-15);
    free(value);
    assert_clean(errors);
    case_dict_free(dict);
    case_errors_free(errors);
}

static void includes(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    char path[128];
    put_file(&f, "constant/main",
             "a 1;\n#include \"more\"\nb { #include \"../system/values\" }\n"
             "#includeIfPresent \"absent\"\n#includeEtc \"any\"\nlast $c;\n"
             "list ( #include \"$FOAM_CASE/system/numbers\" );");
    put_file(&f, "constant/more", "c 3; #include \"<system>/values\"");
    put_file(&f, "system/values", "d 4;\n\ne 5;");
    put_file(&f, "system/numbers", "1 2 3");
    snprintf(path, sizeof path, "%s/constant/main", f.directory);
    case_dict *dict = case_dict_read(path, f.errors);
    assert_clean(f.errors);
    assert_near(case_scalar(dict, "last", NULL, case_any, f.errors), 3, 0);
    assert_near(case_scalar(dict, "d", NULL, case_any, f.errors), 4, 0);
    const case_dict *b = case_sub(dict, "b", 1, f.errors);
    double *value;
    assert_int_equal(case_numbers(dict, "list", &value, f.errors), 3);
    free(value);
    case_scalar(b, "e", NULL, (case_range){6, 7, 0, 0}, f.errors); /* said where it stands */
    assert_says(f.errors, "system/values:3: b.e: found '5'; accepted: a number >= 6 and <= 7");
    case_dict_free(dict);
    fixture_free(&f);
}

static void wrong_includes(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    char path[128];
    snprintf(path, sizeof path, "%s/constant/main", f.directory);
    put_file(&f, "constant/main", "\n#include \"other\"");
    assert_null(case_dict_read(path, f.errors));
    assert_says(f.errors, "main:2: #include \"other\": the file ");
    assert_says(f.errors, "No such file");
    put_file(&f, "constant/other", "\n\n#include \"main\"");
    assert_null(case_dict_read(path, f.errors));
    assert_says(f.errors, "other:3: #include \"main\" goes round in a circle");
    put_file(&f, "constant/other", "a { b 1;\n c 2;");
    assert_null(case_dict_read(path, f.errors));
    assert_says(f.errors, "other:1: '}' missing");
    put_file(&f, "constant/main", "a {\n#include \"other\"\n");
    put_file(&f, "constant/other", "b 1; }");
    assert_null(case_dict_read(path, f.errors));
    assert_says(f.errors, "other:1: '}' closes nothing that this file has opened");
    put_file(&f, "constant/main", "#include \"$FELMI_NO_SUCH_NAME/x\"");
    assert_null(case_dict_read(path, f.errors));
    assert_says(f.errors, "environment variable FELMI_NO_SUCH_NAME is not set");
    assert_null(case_dict_read("/tmp", f.errors));
    assert_says(f.errors, "is not a regular file");
    fixture_free(&f);
}

/* Files that include each other twice over would be read 2^20 times. */
static void include_bomb(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    char path[128], name[32], text[64];
    for (int i = 0; i < 15; i++) {
        snprintf(name, sizeof name, "constant/f%d", i);
        snprintf(text, sizeof text, "#include \"f%d\"\n#include \"f%d\"\n", i + 1, i + 1);
        put_file(&f, name, text);
    }
    put_file(&f, "constant/f15", "a 1;");
    snprintf(path, sizeof path, "%s/constant/f0", f.directory);
    assert_null(case_dict_read(path, f.errors));
    assert_says(f.errors, "files in one another");
    fixture_free(&f);
}

static void bare_list(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict =
        parsed("FoamFile { class vectorField; }\n2\n(\n(1 2 3)\n(4 5 6.5)\n)\n", errors);
    double *value;
    assert_int_equal(case_numbers(dict, "", &value, errors), 6);
    assert_near(value[5], 6.5, 0);
    free(value);
    case_dict_free(dict);
    case_errors_free(errors);
}

/* Lines as OpenFOAM hands them over with its expanded dictionaries. */
static void line_marks(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    case_dict *dict = parsed("#line 7\na 1;\n#line 31\nb {\n#line 33\nc -1; }\nuser 5;", errors);
    assert_int_equal(case_dict_line(dict, "a"), 7);
    assert_int_equal(case_dict_line(dict, "b"), 31);
    case_scalar(case_sub(dict, "b", 1, errors), "c", NULL, case_positive, errors);
    assert_says(errors, "text:33: b.c: found '-1'; accepted: a number > 0");
    case_dict_free(dict);
    case_errors_free(errors);
}

static void syntax_errors(void **unused)
{
    (void)unused;
    assert_refused("a 1;\nb { c 2;\n", "text:2: '}' missing: the dictionary of b");
    assert_refused("a\n( 1 2", "text:2: ')' missing: the list of a");
    assert_refused("a ( 1 2 };", "'}' found, but the '(' of line 1 (key 'a') is open");
    assert_refused("a 1; }", "'}' closes nothing");
    assert_refused("\n\na \"bc\n d", "text:3: the string that begins here has no closing quote");
    assert_refused("a 1; /* b", "the comment that begins here has no end");
    assert_refused("a (1 2)\nb { c 1; }",
                   "text:2: unexpected '{' in the value of 'a', which begins "
                   "in line 1; is a ';' missing?");
    assert_refused("a hex(1 2 3);", "')' missing in the word 'hex(1'");
    assert_refused("x #calc \"1 + 1\";", "'#calc' needs OpenFOAM's own reader");
    assert_refused("#codeStream { }", "'#codeStream' needs OpenFOAM's own reader");
    assert_refused("#incude \"a\"", "unknown directive '#incude'; accepted: #include "
                                    "#includeIfPresent; did you mean '#include'?");
    assert_refused("a $nothing;", "'$nothing' is neither a key above this line nor an environment");
    assert_refused("a 1; b { $a; }", "'$a' stands alone but is not a dictionary");
    assert_refused("a -5 { 1 };", "a uniform list is N { x }");
    assert_refused("a 1e12 { 1 };", "too long");
    assert_refused("a /b;", "found '/'");
}

/* Depth, doubling macros: refused, not run into. */
static void size_limits(void **unused)
{
    (void)unused;
    char text[4096] = "";
    for (int i = 0; i < 500; i++) strcat(text, "a{");
    assert_refused(text, "nested more than");
    text[0] = '\0';
    for (int i = 0; i < 500; i++) strcat(text, i ? "(" : "a (");
    assert_refused(text, "nested more than");
    strcpy(text, "a0 (1 (2) 3);");
    for (int i = 1; i < 60; i++) {
        char line[64];
        snprintf(line, sizeof line, "a%d ($a%d x $a%d);", i, i - 1, i - 1);
        strcat(text, line);
    }
    assert_refused(text, "would make the case too large");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(comments_words_and_nesting),
        cmocka_unit_test(patterns),
        cmocka_unit_test(lists),
        cmocka_unit_test(duplicates),
        cmocka_unit_test(macros),
        cmocka_unit_test(includes),
        cmocka_unit_test(wrong_includes),
        cmocka_unit_test(include_bomb),
        cmocka_unit_test(bare_list),
        cmocka_unit_test(line_marks),
        cmocka_unit_test(syntax_errors),
        cmocka_unit_test(size_limits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
