/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * stl.c - whatever the bytes of an STL file are, there is a shape that answers, or a reason.
 *
 * Read as it stands and, where it is refused, with `mend`. A shape has finite distances and
 * gradients near the surface and far from it, its parts lie within its bounds, and its inverse can
 * be made.
 *
 * Reference: libFuzzer, https://llvm.org/docs/LibFuzzer.html
 */
#include "dem.h"
#include "fuzzFile.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static void ask(const dem_sdf *shape)
{
    double lo[3], hi[3];
    dem_sdf_bounds(shape, lo, hi);
    for (int a = 0; a < 3; a++) REQUIRE(isfinite(lo[a]) && isfinite(hi[a]) && lo[a] <= hi[a]);
    for (int q = 0; q < 6; q++) {
        double x[3], g[3];
        for (int a = 0; a < 3; a++)
            x[a] = lo[a] + (hi[a] - lo[a]) * (q < 4 ? .1 + .27 * ((q + a) % 4) : 20. * (a - q));
        REQUIRE(isfinite(dem_sdf_distance(shape, x)));
        for (int p = 0; p < dem_sdf_parts(shape) && p < 20; p++) {
            REQUIRE(isfinite(dem_sdf_eval(shape, p, x, g)));
            REQUIRE(isfinite(g[0] + g[1] + g[2]));
        }
    }
    REQUIRE(dem_sdf_parts(shape) > 0 && dem_sdf_memory(shape) > 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    const char *path = fuzz_path("input.stl");
    char message[256];
    dem_sdf *shape = NULL;
    fuzz_write(path, data, n);
    for (int mend = 0; mend < 2 && shape == NULL; mend++) {
        dem_stl stl = dem_stl_default();
        stl.path = path;
        stl.inside = (int)(n % 2);
        stl.mend = mend;
        message[0] = '\0';
        shape = dem_sdf_stl(&stl, message, sizeof message);
        if (shape == NULL)
            REQUIRE(strstr(message, path) == message && strlen(message) > strlen(path));
    }
    if (shape == NULL) return 0;
    ask(shape);
    shape = dem_sdf_complement(shape);
    REQUIRE(shape != NULL);
    ask(shape);
    dem_sdf_free(shape);
    return 0;
}
