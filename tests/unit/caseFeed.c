/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseFeed.c - sizes, species, feeders and outlets of demProperties: what is read, each refusal.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseDem.h"
#include "near.h"

static const char *const fed = DEM_MATERIALS
    "insertion { bed { type random; number 50; seed 3;\n"
    "region { type box; min (0 0 0); max (.1 .2 .2); }\n"
    "species ( { material glass; diameter .003; share 2; }\n"
    "{ material glass; size { type uniform; by mass; min .001; max .002; } share 1; } );\n"
    "shareBy number; } }\n"
    "feeders { chute { region { type cylinder; point1 (.05 .1 .3); point2 (.05 .1 .38);\n"
    "radius .03; } massRate .25; begin 1.5; end 7; mass 2; number 9000; velocity (0 0 -2);\n"
    "velocitySpread .1; angularVelocity (0 3 0); seed 11; material glass;\n"
    "size { type rosinRammler; by mass; d63 .004; exponent 3.5; min .001; max .006; } } }\n"
    "outlets { drain { region { type box; min (0 0 0); max (.1 .2 .01); } begin 2; } }\n";

static void all_values(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    read_dem(&f, fed, &dem);
    assert_clean(f.errors);
    const dem_insertion *bed = dem.param.insertion;
    assert_int_equal(bed->n_species, 2);
    assert_false(bed->share_by_mass);
    assert_near(bed->diameter, .003, 0); /* the largest */
    assert_near(bed->species[0].share, 2, 0);
    assert_int_equal(bed->species[0].size.kind, DEM_SIZE_EQUAL);
    assert_near(bed->species[0].size.mean, .003, 0);
    assert_int_equal(bed->species[1].size.kind, DEM_SIZE_UNIFORM);
    assert_true(bed->species[1].size.by_mass);
    assert_near(bed->species[1].size.lo, .001, 0);
    assert_near(bed->species[1].size.hi, .002, 0);
    assert_int_equal(dem.param.n_feeder, 1);
    const dem_feeder *chute = dem.param.feeder;
    assert_string_equal(chute->name, "chute");
    assert_near(chute->mass_rate, .25, 0);
    assert_near(chute->number_rate, 0, 0);
    assert_near(chute->begin, 1.5, 0);
    assert_near(chute->end, 7, 0);
    assert_near(chute->mass, 2, 0);
    assert_int_equal(chute->number, 9000);
    assert_near(chute->velocity[2], -2, 0);
    assert_near(chute->velocity_spread, .1, 0);
    assert_near(chute->angular_velocity[1], 3, 0);
    assert_int_equal(chute->seed, 11);
    assert_int_equal(chute->n_species, 1);
    const dem_size *size = &chute->species[0].size;
    assert_int_equal(size->kind, DEM_SIZE_ROSIN_RAMMLER);
    assert_true(size->by_mass);
    assert_near(size->mean, .004, 0);
    assert_near(size->exponent, 3.5, 0);
    assert_near(size->lo, .001, 0);
    assert_near(size->hi, .006, 0);
    assert_near(chute->lo[0], .02, 1e-15);
    assert_near(chute->hi[2], .38, 1e-15);
    assert_near(dem_sdf_distance(chute->region, (double[]){.05, .1, .37}), .01, 1e-15);
    assert_int_equal(dem.param.n_outlet, 1);
    assert_string_equal(dem.param.outlet[0].name, "drain");
    assert_near(dem.param.outlet[0].begin, 2, 0);
    assert_true(isinf(dem.param.outlet[0].end));
    assert_near(dem_sdf_distance(dem.param.outlet[0].region, (double[]){.05, .1, .004}), .004,
                1e-15);
    case_dem_free(&dem, 1);
    fixture_free(&f);
}

/* Without the optional keys there is no end and no limit; shares are of mass. */
static void defaults(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    read_dem(&f,
             DEM_MATERIALS "feeders { a { numberRate 12.5; diameter .002; material glass;\n"
                           "region { type sphere; centre (.05 .1 .2); radius .04; } }\n"
                           "b { numberRate 1; species ( { material glass; diameter .003; share 1; "
                           "} ); region { type sphere; centre (.05 .1 .3); radius .04; } } }",
             &dem);
    assert_clean(f.errors);
    const dem_feeder *a = dem.param.feeder, *b = a + 1;
    assert_near(a->number_rate, 12.5, 0);
    assert_near(a->begin, 0, 0);
    assert_true(isinf(a->end) && isinf(a->mass) && a->number == -1);
    assert_near(a->species[0].size.mean, .002, 0);
    assert_true(b->share_by_mass);
    case_dem_free(&dem, 1);
    fixture_free(&f);
}

/* The other laws; a table in the dictionary and in a file. */
static void laws(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    const char *const law = "{ type rosinRammler; by mass; d63 .004; exponent 3.5; min .001; max "
                            ".006; }";
    char *normal = replaced(
        fed, law, "{ type normal; by number; mean .003; deviation .0005; min .002; max .004; }");
    read_dem(&f, normal, &dem);
    assert_clean(f.errors);
    const dem_size *size = &dem.param.feeder[0].species[0].size;
    assert_int_equal(size->kind, DEM_SIZE_NORMAL);
    assert_false(size->by_mass);
    assert_near(size->mean, .003, 0);
    assert_near(size->deviation, .0005, 0);
    case_dem_free(&dem, 1);
    free(normal);
    char *wide = replaced(fed, law, "{ type logNormal; by number; median .003; deviation .3; }");
    read_dem(&f, wide, &dem);
    assert_clean(f.errors);
    size = &dem.param.feeder[0].species[0].size;
    assert_int_equal(size->kind, DEM_SIZE_LOGNORMAL);
    assert_near(size->mean, .003, 0);
    assert_near(size->deviation, .3, 0);
    assert_true(size->lo == 0 && size->hi == 0);
    case_dem_free(&dem, 1);
    free(wide);
    put_file(&f, "constant/sieve", "3 ( (.001 0) (.002 .4) (.005 1) )");
    const char *const tables[] = {"rows ( (.001 0) (.002 .4) (.005 1) )", "file \"sieve\""};
    for (int i = 0; i < 2; i++) {
        char text[128];
        snprintf(text, sizeof text, "{ type table; by mass; %s; }", tables[i]);
        char *table = replaced(fed, law, text);
        read_dem(&f, table, &dem);
        assert_clean(f.errors);
        size = &dem.param.feeder[0].species[0].size;
        assert_int_equal(size->kind, DEM_SIZE_TABLE);
        assert_int_equal(size->n, 3);
        assert_near(size->diameter[2], .005, 0);
        assert_near(size->cumulative[1], .4, 0);
        case_dem_free(&dem, 1);
        free(table);
    }
    fixture_free(&f);
}

static void refused_sizes(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    const char *const at = "demProperties:17: feeders.chute.size.";
    refused_in(&f, fed, "exponent 3.5; ", "", "size.exponent: missing; accepted: a number > 0");
    refused_in(&f, fed, "exponent 3.5; ", "", at);
    refused_in(&f, fed, "min .001; max .006", "min .006; max .001",
               "size.max: found 0.001; accepted: above min, 0.006 m");
    refused_in(&f, fed, "by mass; d63", "d63", "size.by: missing; accepted: number, mass");
    refused_in(&f, fed, "rosinRammler", "rosinRamler", "did you mean 'rosinRammler'?");
    refused_in(&f, fed, "d63 .004", "mean .004", "size.mean: unknown key; accepted: type, by, d63");
    refused_in(&f, fed, "type rosinRammler; by mass; d63 .004; exponent 3.5; min .001",
               "type logNormal; by mass; median .004; deviation .1",
               "size.min: missing; accepted: a number > 0 in m");
    refused_in(&f, fed, "size { type rosinRammler", "diameter .003; size { type rosinRammler",
               "feeders.chute.size: given beside diameter");
    refused_in(&f, fed, "type rosinRammler; by mass; d63 .004; exponent 3.5; min .001; max .006",
               "type table; by mass; rows ( (.001 0) (.002 .4) (.005 .9) )",
               "row 2, counted from 0, is (0.005 0.9); accepted: two or more rows");
    refused_in(&f, fed, "type rosinRammler; by mass; d63 .004; exponent 3.5; min .001; max .006",
               "type table; by mass; rows ( (.001 0 1) (.002 .4 1) )",
               "found rows of 3 numbers; accepted: two or more rows (diameter share)");
    refused_in(&f, fed, "type rosinRammler; by mass; d63 .004; exponent 3.5; min .001; max .006",
               "type table; by mass", "rows: missing, and so is file");
    refused_in(&f, fed, "share 2", "share 0", "insertion.bed.species[0].share: found '0'");
    refused_in(&f, fed, "shareBy number", "shareBy volume", "accepted: number, mass");
    refused_in(&f, fed, "shareBy number", "shareBy number; diameter .003",
               "insertion.bed.material: missing");
    refused_in(&f, fed, "size { type uniform", "size { type uniformly",
               "species[1].size.type: found 'uniformly'");
    fixture_free(&f);
}

static void refused_feeds(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    refused_in(&f, fed, "massRate .25; ", "",
               "demProperties:14: feeders.chute.massRate: missing, and so is numberRate; accepted: "
               "either massRate in kg/s or numberRate in 1/s");
    refused_in(&f, fed, "massRate .25", "massRate .25; numberRate 1", "given beside massRate");
    refused_in(&f, fed, "massRate .25", "massRate -1", "accepted: a number > 0 in kg/s");
    refused_in(&f, fed, "massRate", "massrate", "did you mean 'massRate'?");
    refused_in(&f, fed, "begin 1.5; end 7", "begin 7; end 1.5",
               "end: found 1.5; accepted: after begin, 7 s");
    refused_in(&f, fed, "(.05 .1 .38)", "(.05 .1 .41)",
               "feeders.chute.region: the region reaches from 0.3 to 0.41 m in z, beyond the "
               "domain");
    refused_in(&f, fed, "max .006; } } }", "max .07; } } }",
               "feeders.chute.size: particles of 0.07 m do not fit into the region, which is 0.06 "
               "m wide in x");
    refused_in(&f, fed, "material glass;\nsize", "material lead;\nsize",
               "no contact for the materials (glass lead), which can meet: insertion 'bed' and "
               "feeder 'chute'");
    refused_in(&f, fed, "max (.1 .2 .01)", "max (.1 .2 .31)",
               "demProperties:18: outlets.drain.region: overlaps the region of the feeder 'chute'");
    refused_in(&f, fed, "min (0 0 0); max (.1 .2 .01)", "min (0 0 -1); max (.1 .2 -.01)",
               "outlets.drain.region: lies outside the domain");
    refused_in(&f, fed, "outlets { drain { region", "outlets { drain { shape",
               "outlets.drain.region: missing");
    /* in the solid of a wall */
    refused_in(
        &f, fed, "outlets {",
        "walls { lid { material glass; shape { type box; min (-1 -1 .29); max (1 1 1); } } }\n"
        "outlets {",
        "feeders.chute.region: lies wholly in the solid of the wall 'lid'; is its 'inside' "
        "wrong?");
    refused_in(&f, fed, "outlets {",
               "walls { drum { material glass; shape { type cylinder; point1 (-1 .1 0); point2 (1 "
               ".1 0); radius .3; }\n"
               "motion { type rotation; axis (1 0 0); origin (0 .1 0); rpm 5; } } }\noutlets {",
               "insertion.bed.region: lies wholly in the solid of the wall 'drum'");
    /* not at the same time: no overlap */
    case_dem dem;
    char *later = replaced(fed, "max (.1 .2 .01); } begin 2", "max (.1 .2 .31); } begin 7");
    read_dem(&f, later, &dem);
    assert_clean(f.errors);
    case_dem_free(&dem, 1);
    free(later);
    fixture_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_values),    cmocka_unit_test(defaults),      cmocka_unit_test(laws),
        cmocka_unit_test(refused_sizes), cmocka_unit_test(refused_feeds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
