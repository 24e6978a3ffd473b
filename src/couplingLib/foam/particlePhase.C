/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    The particle phase behind OpenFOAM's fields: see particlePhase.H. Cell
    arrays of vectors are handed to the C library as they are: OpenFOAM's
    vector is three doubles in a row.
\*---------------------------------------------------------------------------*/

#include "particlePhase.H"
#include "caseText.H"
#include "IOdictionary.H"
#include "OSspecific.H"
#include "stopRun.H"

#include <cfenv>

namespace Foam
{

typedef const double (*cellVectors)[3];

// The C libraries count on IEEE arithmetic (the logarithm of zero is minus
// infinity, and handled), OpenFOAM traps it: no traps while one of these lives.
struct ieeeArithmetic
{
    std::fenv_t traps;

    ieeeArithmetic()
    {
        std::feholdexcept(&traps);
    }

    ~ieeeArithmetic()
    {
        std::fesetenv(&traps);
    }
};


static cellVectors vectors(const vectorField& f)
{
    return reinterpret_cast<cellVectors>(f.cdata());
}


// The master's text on all processors: what others get of a dictionary that
// the master reads has lost its lines.
static string masterText(const dictionary& dict)
{
    string text;

    if (Pstream::master())
    {
        text = caseText(dict);
    }
    Pstream::scatter(text);

    return text;
}


// A dictionary of the case as caseLib's reader sees it, or nullptr with the
// reader's message where the file does not exist.
static case_dict* caseDict
(
    const Time& runTime,
    const word& name,
    case_errors* errors
)
{
    const fileName file = runTime.constant()/name;
    const IOobject io
    (
        name,
        runTime.constant(),
        runTime,
        IOobject::MUST_READ,
        IOobject::NO_WRITE,
        false
    );

    bool found = !io.globalFilePath(IOdictionary::typeName).empty();
    Pstream::scatter(found);

    if (!found)
    {
        const fileName path(runTime.globalPath()/file);
        return case_dict_read(path.c_str(), errors);
    }

    const IOdictionary dict(io);

    return case_dict_parse(masterText(dict).c_str(), file.c_str(), errors);
}


// Entries of system/controlDict that caseLib checks. Others (functions, say)
// are OpenFOAM's own matter.
static case_control readControl(const Time& runTime, case_errors* errors)
{
    dictionary times;

    for (const char* key : {"deltaT", "endTime", "restart"})
    {
        const entry* e = runTime.controlDict().findEntry(key);
        if (e)
        {
            times.add(*e);
        }
    }

    case_control control = case_control();
    case_dict* dict = case_dict_parse
    (
        masterText(times).c_str(),
        "system/controlDict",
        errors
    );

    if (dict)
    {
        case_control_of(dict, runTime.startTime().value(), &control, errors);

        const case_dict* restart = case_sub(dict, "restart", 0, errors);
        if (restart && case_has(restart, "interval"))
        {
            case_note
            (
                errors,
                "system/controlDict",
                case_dict_line(restart, "interval"),
                "restart.interval: felmiFoam writes restart files with its"
                " fields, whatever is said here"
            );
        }
        case_dict_free(dict);
    }

    return control;
}


static void checkFluid(const Time& runTime, case_errors* errors)
{
    case_dict* dict = caseDict(runTime, "transportProperties", errors);

    if (dict)
    {
        // the viscosity of models other than Newtonian is OpenFOAM's matter
        case_fluid fluid;
        case_fluid_of(dict, 0, &fluid, errors);
        case_dict_free(dict);
    }
}


void particlePhase::readCase(const vector& g)
{
    const Time& runTime = mesh_.time();
    findRestart();

    const case_mesh mesh = cells_.summary();
    case_errors* errors = case_errors_new();

    control_ = readControl(runTime, errors);
    checkFluid(runTime, errors);

    case_dict* dict = caseDict(runTime, "demProperties", errors);
    const bool demRead = dict;
    if (dict)
    {
        case_read_dem
        (
            dict,
            runTime.globalPath().c_str(),
            &mesh,
            g.cdata(),
            &dem_,
            errors
        );
        case_dict_free(dict);
    }

    dict = caseDict(runTime, "couplingProperties", errors);
    if (dict)
    {
        case_read_coupling(dict, &coupling_, errors);
        case_dict_free(dict);
    }

    if (!case_errors_count(errors))
    {
        case_check(&control_, &mesh, &dem_, &coupling_, errors);
    }

    if (case_errors_count(errors))
    {
        const string text(case_errors_text(errors));
        case_errors_free(errors);
        if (demRead)
        {
            case_dem_free(&dem_, 1);
        }
        stopRun(text);
    }

    Info<< case_notes_text(errors) << flush;
    case_errors_free(errors);
}


particlePhase::particlePhase
(
    const fvMesh& mesh,
    const dimensionedScalar& rho,
    const scalar nu,
    const vector& g,
    MPI_Comm comm
)
:
    mesh_(mesh),
    cells_(mesh),
    control_(),
    dem_(),
    coupling_(cpl_param_default()),
    phase_(nullptr),
    rho_(rho.value()),
    secondsFluid_(0)
{
    const ieeeArithmetic noTraps;
    readCase(g);

    const fileName ledger(mesh.time().globalPath()/"postProcessing"/"ledger");

    phase_param param = phase_param();
    param.dem = &dem_.param;
    param.coupling = &coupling_;
    param.mesh = &cells_.cells();
    param.rho = rho_;
    param.mu = rho_*nu;
    param.ledger = ledger.c_str();
    dem_.param.restart = restart_.empty() ? nullptr : restart_.c_str();

    if (phase_new(comm, &param, &phase_))
    {
        stopNew();
    }
    setAside();
}


particlePhase::~particlePhase()
{
    phase_free(phase_);
    case_dem_free(&dem_, 0);
}


void particlePhase::check(const int status) const
{
    if (status)
    {
        stopRun(phase_ ? phase_message(phase_) : "not enough memory");
    }
}


void particlePhase::advance()
{
    const ieeeArithmetic noTraps;
    check(phase_advance(phase_, mesh_.time().deltaTValue()));
}


void particlePhase::voidage(volScalarField& voidfraction) const
{
    const double* eps = phase_voidage(phase_);

    // the reference stores the old time; element access would not
    scalarField& alpha = voidfraction.primitiveFieldRef();

    forAll(alpha, c)
    {
        alpha[c] = eps[c];
    }
    voidfraction.correctBoundaryConditions();
}


void particlePhase::drag
(
    const volVectorField::Internal& u,
    volScalarField& K,
    volVectorField& S,
    volVectorField& Us
)
{
    const ieeeArithmetic noTraps;
    check(phase_drag(phase_, vectors(u)));

    const double* k = phase_K(phase_);
    cellVectors s = phase_S(phase_);
    cellVectors us = phase_Us(phase_);

    forAll(K, c)
    {
        K[c] = k[c]/rho_;
        S[c] = vector(s[c][0], s[c][1], s[c][2])/rho_;
        Us[c] = vector(us[c][0], us[c][1], us[c][2]);
    }

    K.correctBoundaryConditions();
    S.correctBoundaryConditions();
    Us.correctBoundaryConditions();
}


void particlePhase::settle
(
    const volVectorField::Internal& U,
    const volVectorField::Internal& G,
    const vector& drag,
    const vector& pressure
)
{
    const vectorField gradp(rho_*G.field());
    const ieeeArithmetic noTraps;

    check
    (
        phase_settle
        (
            phase_,
            vectors(U),
            vectors(gradp),
            nullptr,    // faces give a uniform velocity back unchanged
            drag.cdata(),
            pressure.cdata()
        )
    );
}

} // End namespace Foam
