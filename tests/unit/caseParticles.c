/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * caseParticles.c - demProperties and couplingProperties: what is read, and each refusal.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "caseFixture.h"
#include "near.h"

static const char *const plain =
    "contactLaw linear;\n"
    "materials\n"
    "{ glass { density 2526; youngsModulus 1e8; poissonRatio .35; } steel { density 7800; } }\n"
    "contacts\n"
    "(\n"
    "{ materials (glass glass); stiffness 1000; restitution .97; friction .1; }\n"
    "{ materials (steel glass); stiffness 1500; stiffnessRatio .5; restitution .9; friction .09; "
    "}\n"
    ");\n"
    "walls { vessel { material steel;\n"
    "shape { type box; min (0 0 0); max (.1 .2 .4); inside true; } } }\n"
    "insertion { bed { type random; material glass; solidFraction .3; seed 7;\n"
    "diameter .0025;\n"
    "velocity (0 0 -1.5); velocitySpread .25; angularVelocity (1 2 3);\n"
    "region { type box; min (0 0 0); max (.1 .2 .3); } } }\n"
    "timeStep { stepsPerPeriod 30; maximum 1e-4; impactSpeed 2; }\n"
    "neighbour { skin .2; }\n"
    "parallel { imbalance 1.25; }\n"
    "domain { min (0 0 0); max (.1 .2 .4); periodic (no yes no); }\n";

static const double weight[3] = {0, 0, -9.81};

/* Read a text as demProperties of a case in f; check; the caller frees dem. */
static void read_in(fixture *f, const char *text, const case_mesh *mesh, const cpl_param *coupling,
                    case_dem *dem)
{
    case_dict *dict = case_dict_parse(text, "demProperties", f->errors);
    assert_non_null(dict);
    case_read_dem(dict, f->directory, mesh, weight, dem, f->errors);
    case_dict_free(dict);
    case_check(NULL, mesh, dem, coupling, f->errors);
}

static void all_values(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    read_in(&f, plain, NULL, NULL, &dem);
    assert_clean(f.errors);
    const dem_param *p = &dem.param;
    assert_int_equal(p->law, DEM_LINEAR);
    assert_int_equal(p->n_material, 2);
    assert_string_equal(p->material[1].name, "steel");
    assert_near(p->material[0].density, 2526, 0);
    assert_near(p->material[0].poisson_ratio, .35, 0);
    for (int i = 1; i <= 2; i++) { /* glass-steel and steel-glass */
        assert_near(p->pair[i].stiffness, 1500, 0);
        assert_near(p->pair[i].stiffness_ratio, .5, 0);
        assert_near(p->pair[i].restitution, .9, 0);
    }
    assert_near(p->pair[0].stiffness_ratio, 1, 0);
    assert_near(p->pair[0].friction, .1, 0);
    assert_int_equal(p->n_wall, 1);
    assert_int_equal(p->wall[0].material, 1);
    assert_near(dem_sdf_distance(p->wall[0].shape, (double[]){.05, .1, .39}), .01, 1e-15);
    const dem_insertion *bed = &p->insertion[0];
    assert_int_equal(bed->kind, DEM_INSERT_RANDOM);
    assert_int_equal(bed->number, -1);
    assert_near(bed->solid_fraction, .3, 0);
    assert_int_equal(bed->seed, 7);
    assert_near(bed->velocity[2], -1.5, 0);
    assert_near(bed->velocity_spread, .25, 0);
    assert_near(bed->angular_velocity[2], 3, 0);
    assert_near(bed->hi[2], .3, 0);
    assert_near(dem_sdf_distance(bed->region, (double[]){.05, .1, .29}), .01, 1e-15);
    assert_near(p->steps_per_period, 30, 0);
    assert_near(p->time_step, 1e-4, 0);
    assert_near(p->impact_speed, 2, 0);
    assert_near(p->skin, .2, 0);
    assert_near(p->imbalance, 1.25, 0);
    assert_near(p->hi[2], .4, 0);
    assert_near(p->gravity[2], -9.81, 0);
    assert_true(p->periodic[1] && !p->periodic[0] && !p->periodic[2]);
    case_dem_free(&dem, 1);
    fixture_free(&f);
}

static void defaults(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    const dem_param fresh = dem_param_default();
    read_in(&f,
            "contactLaw hertz; materials { a { density 1; youngsModulus 2; poissonRatio .3; } }"
            "contacts ();domain { min (0 0 0); max (1 1 1); }",
            NULL, NULL, &dem);
    assert_clean(f.errors);
    assert_int_equal(dem.param.law, DEM_HERTZ);
    assert_near(dem.param.skin, fresh.skin, 0);
    assert_near(dem.param.imbalance, fresh.imbalance, 0);
    assert_near(dem.param.steps_per_period, fresh.steps_per_period, 0);
    assert_int_equal(dem.param.n_insertion + dem.param.n_wall, 0);
    case_dem_free(&dem, 1);
    fixture_free(&f);
}

/* `old` replaced by `new` in the plain dictionary must be refused with `part` in the message. */
static void assert_variant_says(const char *old, const char *new, const char *part)
{
    fixture f = fixture_new();
    case_dem dem;
    char *text = replaced(plain, old, new);
    read_in(&f, text, NULL, NULL, &dem);
    assert_says(f.errors, part);
    case_dem_free(&dem, 1);
    free(text);
    fixture_free(&f);
}

static void refused_materials(void **unused)
{
    (void)unused;
    assert_variant_says("linear", "hertz",
                        "demProperties:3: materials.steel.youngsModulus: missing; "
                        "accepted: a number > 0 in Pa");
    assert_variant_says(
        "contactLaw linear", "contactLaw lineer",
        "demProperties:1: contactLaw: found 'lineer'; accepted: linear, hertz; did you "
        "mean 'linear'?");
    assert_variant_says(
        "density 2526", "density -2526",
        "demProperties:3: materials.glass.density: found '-2526'; accepted: a number > 0 "
        "in kg/m3");
    assert_variant_says("density 2526", "densty 2526", "did you mean 'density'?");
    assert_variant_says("poissonRatio .35", "poissonRatio .51",
                        "accepted: a number > -1 and <= 0.5");
    assert_variant_says(
        "restitution .97", "restitution 1.2",
        "demProperties:6: contacts[0].restitution: found '1.2'; accepted: a number > 0 and "
        "<= 1");
    assert_variant_says("restitution .97", "restitution 0", "contacts[0].restitution: found '0'");
    assert_variant_says("friction .09", "friction -.09", "contacts[1].friction: found '-.09'");
    assert_variant_says("stiffness 1500; ", "",
                        "contacts[1].stiffness: missing; accepted: a number > 0 in N/m");
    assert_variant_says("(steel glass)", "(steel glas)", "did you mean 'glass'?");
    assert_variant_says("(steel glass)", "(steel)", "accepted: the names of two materials (a b)");
    assert_variant_says("(steel glass)", "(glass glass)", "given before, in line 6");
    assert_variant_says(
        "(steel glass)", "(steel steel)",
        "contacts: no contact for the materials (glass steel), which can meet: insertion "
        "'bed' and wall 'vessel'");
    assert_variant_says("(glass glass)", "(steel steel)",
                        "materials (glass glass), which can meet");
    assert_variant_says("contacts", "contact", "contacts: missing");
}

/* `old` replaced by `new` in the plain dictionary is read, with `note` among the notes. */
static void read_variant(const char *old, const char *new, const char *note, dem_param *param)
{
    fixture f = fixture_new();
    case_dem dem;
    char *text = replaced(plain, old, new);
    read_in(&f, text, NULL, NULL, &dem);
    assert_clean(f.errors);
    assert_non_null(strstr(case_notes_text(f.errors), note));
    assert_int_equal(*note == '\0', *case_notes_text(f.errors) == '\0');
    *param = dem.param; /* its numbers; what it points to is freed */
    case_dem_free(&dem, 1);
    free(text);
    fixture_free(&f);
}

/* Rolling resistance, cohesion, balance, fixed step: chosen, defaults, and numbers without use. */
static void models(void **unused)
{
    (void)unused;
    dem_param p;
    read_variant("contactLaw linear;", "contactLaw linear; balance yes;", "", &p);
    assert_true(p.balance);
    assert_int_equal(p.rolling, DEM_ROLLING_NONE);
    assert_int_equal(p.cohesion, DEM_COHESION_NONE);
    assert_near(p.fixed_step, 0, 0);
    read_variant("maximum 1e-4", "fixed 2e-6", "", &p);
    assert_near(p.fixed_step, 2e-6, 0);
    assert_false(p.balance);
    read_variant("friction .09", "friction .09; rollingFriction .01",
                 "contacts[1].rollingFriction: has no effect with rolling none", &p);
    read_variant("friction .09", "friction .09; cohesionEnergyDensity 1e4",
                 "contacts[1].cohesionEnergyDensity: has no effect with cohesion none", &p);
    assert_variant_says("contactLaw linear;", "contactLaw linear; rolling elasticPlastic;",
                        "contacts[0].rollingFriction: missing; accepted: a number >= 0");
    assert_variant_says("contactLaw linear;", "contactLaw linear; cohesion sjkr;",
                        "contacts[0].cohesionEnergyDensity: missing; accepted: a number >= 0 in "
                        "J/m3");
    assert_variant_says("contactLaw linear;", "contactLaw linear; rolling elasticplastic;",
                        "found 'elasticplastic'; accepted: none, constantTorque, elasticPlastic; "
                        "did you mean 'elasticPlastic'?");
    assert_variant_says("contactLaw linear;", "contactLaw linear; cohesion SJKR;",
                        "accepted: none, sjkr");
    assert_variant_says("maximum 1e-4", "fixed 0", "timeStep.fixed: found '0'");
    char *both = replaced(plain, "friction .1;",
                          "friction .1; rollingFriction .02; rollingDamping .4; "
                          "cohesionEnergyDensity 5e3;");
    char *all = replaced(both, "friction .09;",
                         "friction .09; rollingFriction .01; cohesionEnergyDensity 1e3;");
    char *text = replaced(all, "contactLaw linear;",
                          "contactLaw linear; rolling elasticPlastic; cohesion sjkr;");
    fixture f = fixture_new();
    case_dem dem;
    read_in(&f, text, NULL, NULL, &dem);
    assert_clean(f.errors);
    assert_int_equal(dem.param.rolling, DEM_ROLLING_EPSD);
    assert_int_equal(dem.param.cohesion, DEM_COHESION_SJKR);
    assert_near(dem.param.pair[0].rolling_friction, .02, 0);
    assert_near(dem.param.pair[0].rolling_damping, .4, 0);
    assert_near(dem.param.pair[0].cohesion, 5e3, 0);
    assert_near(dem.param.pair[2].rolling_friction, .01, 0);
    assert_near(dem.param.pair[2].rolling_damping, .3, 0); /* default */
    assert_near(dem.param.pair[1].cohesion, 1e3, 0);
    case_dem_free(&dem, 1);
    fixture_free(&f);
    free(both);
    free(all);
    free(text);
}

static void refused_walls(void **unused)
{
    (void)unused;
    assert_variant_says("material steel", "material stele", "walls.vessel.material: found 'stele'");
    assert_variant_says(
        "type box; min (0 0 0); max (.1 .2 .4)", "type bocks",
        "walls.vessel.shape.type: found 'bocks'; accepted: plane, box, sphere, cylinder, cone");
    assert_variant_says(
        "max (.1 .2 .4); inside", "max (.1 0 .4); inside",
        "demProperties:10: walls.vessel.shape.max: its y is 0, not above that of min, 0");
    assert_variant_says("inside true", "inside false", "fills the whole domain");
    assert_variant_says("type box; min (0 0 0); max (.1 .2 .4); inside true",
                        "type sphere; centre (3 3 3); radius .1", "lies wholly outside the domain");
    assert_variant_says("type box; min (0 0 0); max (.1 .2 .4); inside true",
                        "type plane; point (0 0 0); normal (0 0 0)", "shape.normal: found (0 0 0)");
    assert_variant_says("type box; min (0 0 0); max (.1 .2 .4); inside true",
                        "type cylinder; point1 (0 0 0); point2 (0 0 0); radius 1",
                        "the same as point1");
    assert_variant_says("type box; min (0 0 0); max (.1 .2 .4); inside true",
                        "type cone; point1 (0 0 0); point2 (0 0 1); radius1 0; radius2 0",
                        "at least one of them > 0");
}

static void refused_insertions(void **unused)
{
    (void)unused;
    assert_variant_says("solidFraction .3", "solidFraction .3; number 5", "given beside number");
    assert_variant_says("solidFraction .3;", "", "accepted: either number or solidFraction");
    assert_variant_says("solidFraction .3", "solidFraction .7",
                        "accepted: a number > 0 and <= 0.64");
    assert_variant_says("solidFraction .3", "number 2.5",
                        "number: found '2.5'; accepted: a whole number");
    assert_variant_says(
        "diameter .0025", "diameter .15",
        "demProperties:12: insertion.bed.diameter: particles of 0.15 m do not fit into the "
        "region, which is 0.1 m wide in x");
    assert_variant_says(
        "(.1 .2 .3)", "(.1 .2 .5)",
        "insertion.bed.region.max: the region reaches from 0 to 0.5 m in z, beyond the domain, 0 "
        "to 0.4 m");
    assert_variant_says("(.1 .2 .3)", "(.1 .2 .3); inside yes", "region.inside: unknown key");
    assert_variant_says("type random; material glass; solidFraction .3",
                        "type lattice; material glass", "spacing: missing");
    assert_variant_says("type random; material glass; solidFraction .3",
                        "type lattice; material glass; spacing .002", "or the particles overlap");
    assert_variant_says("type random; material glass; solidFraction .3",
                        "type lattice; material glass; spacing (.003 .003 .7)",
                        "no particle would be made");
    assert_variant_says("seed 7", "seed -7", "seed: found '-7'");
    assert_variant_says("velocitySpread .25", "velocitySpread -1", "in m/s");
    assert_variant_says("periodic (no yes no)", "periodic (no yes)", "accepted: three of yes, no");
    assert_variant_says("domain { min (0 0 0); max (.1 .2 .4); periodic (no yes no); }", "",
                        "domain: missing");
    assert_variant_says("stepsPerPeriod 30", "stepsPerPeriod 3", "stepsPerPeriod: found '3'");
    assert_variant_says("maximum 1e-4", "maximum 0", "timeStep.maximum: found '0'");
    assert_variant_says("skin .2", "skin 0", "neighbour.skin: found '0'");
    assert_variant_says("imbalance 1.25", "imbalance 1",
                        "parallel.imbalance: found '1'; accepted: a number > 1");
}

/* Positions from a file: read, and refused outside the domain or within a wall. */
static void positions(void **unused)
{
    (void)unused;
    fixture f = fixture_new();
    case_dem dem;
    char *text = replaced(plain, "type random; material glass; solidFraction .3",
                          "type file; material glass; file \"spheres\"");
    char *list = replaced(text, "region { type box; min (0 0 0); max (.1 .2 .3); }", "");
    put_file(&f, "constant/spheres",
             "FoamFile { class vectorField; }\n3((.05 .1 .2)\n(.01 .1 .2)(.05 .1 .3))");
    read_in(&f, list, NULL, NULL, &dem);
    assert_clean(f.errors);
    assert_int_equal(dem.param.insertion[0].n, 3);
    assert_near(dem.param.insertion[0].x[2][2], .3, 0);
    case_dem_free(&dem, 1);
    put_file(&f, "constant/spheres", "((.05 .1 .2) (.01 .1 .5) (.05 -.1 .3))");
    read_in(&f, list, NULL, NULL, &dem);
    assert_says(f.errors, "demProperties:11: insertion.bed.file: in ");
    assert_says(f.errors,
                "constant/spheres particle 1, counted from 0, at (0.01 0.1 0.5) lies outside the "
                "domain, (0 0 0) to (0.1 0.2 0.4) m; 2 in all do");
    case_dem_free(&dem, 1);
    put_file(&f, "constant/spheres", "((.05 .1 .2) (.01 .1))");
    read_in(&f, list, NULL, NULL, &dem);
    assert_says(f.errors, "spheres:1: position 1, counted from 0, is '(0.01 0.1)'; accepted: a "
                          "list of positions");
    case_dem_free(&dem, 1);
    put_file(&f, "constant/spheres", "2\n((.05 .1 .2)\n(.05 .1 0.5.5))");
    read_in(&f, list, NULL, NULL, &dem);
    assert_says(f.errors,
                "spheres:3: position 1, counted from 0, is '(0.05 0.1 0.5.5)'; accepted: a "
                "list of positions");
    case_dem_free(&dem, 1);
    shell("rm %s/constant/spheres%s", f.directory, "");
    read_in(&f, list, NULL, NULL, &dem);
    assert_says(f.errors, "constant/spheres: the file cannot be read");
    case_dem_free(&dem, 1);
    free(text);
    free(list);
    fixture_free(&f);
}

static case_mesh box_mesh(double hx)
{
    case_mesh mesh = {.cells = {4, 8, 16}, .hi = {.1, .2, .4}, .spacing = {hx, .025, .025}};
    mesh.side[2].type = mesh.side[3].type = CASE_CYCLIC;
    return mesh;
}

/* The mesh gives the domain; its cells are compared with the particles. */
static void mesh_and_particles(void **unused)
{
    (void)unused;
    const cpl_param coupling = cpl_param_default();
    const char *const domain = "domain { min (0 0 0); max (.1 .2 .4); periodic (no yes no); }";
    char *text = replaced(plain, domain, "");
    const struct {
        double hx;
        const char *error, *note;
    } cases[] = {
        {.0025, "", "a cell of the mesh, 0.0025 m in x, is only 1 diameters"},
        {.0024,
         "insertion.bed.diameter: the particles, 0.0025 m, are larger than a cell of the mesh, "
         "0.0024 m in x",
         ""},
        {.00375, "", ""},
        {.0037, "", "is only 1.48 diameters; 1.5 or more are recommended"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        fixture f = fixture_new();
        case_dem dem;
        case_mesh mesh = box_mesh(cases[i].hx);
        read_in(&f, text, &mesh, &coupling, &dem);
        assert_int_equal(case_errors_count(f.errors), *cases[i].error != '\0');
        assert_says(f.errors, cases[i].error);
        assert_int_equal(*case_notes_text(f.errors) != '\0', *cases[i].note != '\0');
        assert_non_null(strstr(case_notes_text(f.errors), cases[i].note));
        assert_near(dem.param.hi[2], .4, 0);
        assert_true(dem.param.periodic[1] && !dem.param.periodic[2]);
        case_dem_free(&dem, 1);
        fixture_free(&f);
    }
    free(text);
    fixture f = fixture_new();
    case_dem dem;
    case_mesh mesh = box_mesh(.025);
    text = replaced(plain, "max (.1 .2 .4); periodic (no yes no)",
                    "max (.1 .2 .41); periodic (yes yes no)");
    read_in(&f, text, &mesh, &coupling, &dem);
    assert_says(f.errors, "domain: from 0 to 0.41 m in z it reaches beyond the mesh, 0 to 0.4 m");
    assert_says(f.errors, "domain.periodic: found yes in x, but the patches of the mesh say no");
    case_dem_free(&dem, 1);
    fixture_free(&f);
    free(text);
}

static void coupling_values(void **unused)
{
    (void)unused;
    case_errors *errors = case_errors_new();
    cpl_param p;
    case_dict *dict =
        parsed("map centre; packingLimit .7; drag DiFelice; scheme explicit; carryGain .25;"
               "addedMassAbove .2; ledgerTolerance 1e-10;",
               errors);
    case_read_coupling(dict, &p, errors);
    assert_clean(errors);
    assert_int_equal(p.map, CPL_CENTRE);
    assert_int_equal(p.drag, CPL_DI_FELICE);
    assert_int_equal(p.scheme, CPL_EXPLICIT);
    assert_near(p.packing_limit + p.carry_gain + p.added_mass_above + p.ledger_tolerance,
                1.15 + 1e-10, 1e-15);
    case_dict_free(dict);
    dict = parsed("map dividedCubes; packingLimit 1; drag Ergun; carryGane .5; ledgerTolerance 0;",
                  errors);
    case_read_coupling(dict, &p, errors);
    assert_int_equal(case_errors_count(errors), 5);
    assert_says(
        errors,
        "map: found 'dividedCubes'; accepted: centre, dividedCube; did you mean 'dividedCube'?");
    assert_says(errors, "packingLimit: found '1'; accepted: a number > 0 and < 1");
    assert_says(errors,
                "drag: found 'Ergun'; accepted: none, ErgunWenYu, DiFelice, SchillerNaumann\n");
    assert_says(errors, "did you mean 'carryGain'?");
    case_dict_free(dict);
    case_errors_free(errors);
    errors = case_errors_new();
    dict = parsed("", errors);
    case_read_coupling(dict, &p, errors);
    assert_clean(errors);
    const cpl_param fresh = cpl_param_default();
    assert_int_equal(p.map, fresh.map);
    assert_int_equal(p.drag, fresh.drag);
    assert_int_equal(p.scheme, fresh.scheme);
    assert_near(p.packing_limit, fresh.packing_limit, 0);
    assert_near(p.carry_gain, fresh.carry_gain, 0);
    assert_near(p.added_mass_above, fresh.added_mass_above, 0);
    assert_near(p.ledger_tolerance, fresh.ledger_tolerance, 0);
    case_dict_free(dict);
    case_errors_free(errors);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_values),
        cmocka_unit_test(defaults),
        cmocka_unit_test(refused_materials),
        cmocka_unit_test(refused_walls),
        cmocka_unit_test(refused_insertions),
        cmocka_unit_test(positions),
        cmocka_unit_test(mesh_and_particles),
        cmocka_unit_test(coupling_values),
        cmocka_unit_test(models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
