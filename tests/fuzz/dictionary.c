/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * dictionary.c - whatever the bytes of a dictionary are, reading a case of it does no harm.
 *
 * The input is taken as a text handed over by OpenFOAM, and as every file of a case at once: each
 * translation reads what it finds. A dictionary that cannot be read is an error and nothing else;
 * what is translated without an error is within the ranges that the documentation promises.
 *
 * Reference: libFuzzer, https://llvm.org/docs/LibFuzzer.html
 */
#include "case.h"
#include "fuzzFile.h"

#include <math.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    static const char *const name[] = {"system/controlDict", "system/blockMeshDict",
                                       "constant/transportProperties", "constant/g"};
    (void)argc, (void)argv;
    mkdir(fuzz_path("system"), 0777);
    mkdir(fuzz_path("constant"), 0777);
    for (size_t k = 0; k < sizeof name / sizeof *name; k++)
        REQUIRE(symlink("../input", fuzz_path(name[k])) == 0);
    return 0;
}

/* What the engine is told is in its range. */
static void check_dem(const dem_param *p)
{
    for (int a = 0; a < 3; a++) REQUIRE(p->lo[a] < p->hi[a] && isfinite(p->hi[a] - p->lo[a]));
    for (size_t k = 0; k < p->n_material; k++)
        REQUIRE(p->material[k].density > 0 && isfinite(p->material[k].density));
    for (size_t k = 0; k < p->n_wall; k++) {
        REQUIRE(p->wall[k].shape != NULL);
        REQUIRE(p->wall[k].material >= 0 && (size_t)p->wall[k].material < p->n_material);
    }
    for (size_t k = 0; k < p->n_feeder; k++)
        REQUIRE(p->feeder[k].region != NULL && p->feeder[k].n_species > 0);
    REQUIRE(p->skin > 0 && p->steps_per_period > 0);
}

static void check_texts(const case_dem *dem)
{
    free(case_describe_walls(dem, "  "));
    free(case_describe_feeders(dem, "  "));
    free(case_describe_outlets(dem, "  "));
}

/* Every entry by every way of asking. */
static void ask(const case_dict *dict, case_errors *errors)
{
    static const char *const words[] = {"linear", "hertz", NULL};
    const double number = 1;
    const int yes = 1;
    for (size_t i = 0; i < case_dict_size(dict); i++) {
        double *value, vector[3];
        const char *key = case_dict_key(dict, i);
        const size_t count = case_numbers(dict, key, &value, errors);
        for (size_t k = 0; k < count && value; k++) REQUIRE(isfinite(value[k]));
        free(value);
        case_scalar(dict, key, &number, case_any, errors);
        case_integer(dict, key, NULL, -5, 5, errors);
        case_bool(dict, key, &yes, errors);
        case_vector(dict, key, NULL, vector, errors);
        case_word(dict, key, NULL, 1, errors);
        case_choice(dict, key, words, 0, errors);
        for (size_t k = case_list_size(dict, key); k > 0; k--)
            REQUIRE(case_list_at(dict, key, k - 1) != NULL);
    }
    case_known(dict, words, errors);
}

static void translate(const case_dict *dict, const case_mesh *mesh)
{
    case_errors *errors = case_errors_new();
    case_dem dem;
    cpl_param coupling;
    case_control control;
    case_fluid fluid;
    case_read_dem(dict, fuzz_directory(), mesh, (const double[]){0, 0, -9.81}, &dem, errors);
    if (case_errors_count(errors) == 0) {
        check_dem(&dem.param);
        check_texts(&dem);
    }
    case_read_coupling(dict, &coupling, errors);
    case_check(NULL, mesh, &dem, &coupling, errors);
    case_dem_free(&dem, 1);
    case_control_of(dict, 0, &control, errors);
    case_fluid_of(dict, 1, &fluid, errors);
    case_start_time(dict, fuzz_directory(), errors);
    ask(dict, errors);
    case_errors_text(errors);
    case_notes_text(errors);
    case_errors_free(errors);
}

/* The files of a case, each by its own reader. */
static void read_case(void)
{
    const char *directory = fuzz_directory();
    case_errors *errors = case_errors_new();
    case_mesh mesh;
    case_control control;
    case_fluid fluid;
    case_read_mesh(directory, &mesh, errors);
    if (case_errors_count(errors) == 0 && !mesh.general)
        for (int a = 0; a < 3; a++) REQUIRE(mesh.cells[a] >= 1 && mesh.spacing[a] > 0);
    case_errors_free(errors);
    errors = case_errors_new();
    case_read_control(directory, &control, errors);
    if (case_errors_count(errors) == 0) {
        char name[CASE_NAME];
        REQUIRE(control.delta_t > 0 && control.end_time >= control.start_time);
        case_time_name(&control, control.end_time, control.delta_t, name, sizeof name);
        case_find_restart(directory, &control);
    }
    case_read_fluid(directory, &fluid, errors);
    case_read_gravity(directory, fluid.gravity, errors);
    case_errors_free(errors);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static const case_mesh box = {
        .cells = {2, 3, 4}, .hi = {.1, .2, .4}, .spacing = {.05, .05, .1}};
    char *text = malloc(n + 1);
    REQUIRE(text != NULL);
    if (n > 0) memcpy(text, data, n);
    text[n] = '\0';
    case_errors *errors = case_errors_new();
    case_dict *dict = case_dict_parse(text, "input", errors);
    REQUIRE((dict == NULL) == (case_errors_count(errors) > 0));
    if (dict != NULL) {
        translate(dict, &box);
        translate(dict, NULL);
    }
    case_dict_free(dict);
    case_errors_free(errors);
    free(text);
    fuzz_write(fuzz_path("input"), data, n);
    read_case();
    return 0;
}
