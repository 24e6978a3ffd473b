/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    What the particle phase prints and writes: the report at the start, the
    line of a step, the OpenFOAM cloud lagrangian/particles (positions, id,
    U, d, rho) and the snapshots in dem.
\*---------------------------------------------------------------------------*/

#include "particlePhase.H"
#include "clockValue.H"
#include "IOField.H"
#include "passiveParticleCloud.H"

#include <cmath>
#include <cstdlib>

namespace Foam
{

// Wall-clock time since the first call
static scalar secondsElapsed()
{
    static const clockValue start(true);
    return start.elapsed();
}


// A title and caseLib's lines under it, which are freed; nothing if there
// are none
static void printLines(const char* title, char* lines)
{
    if (lines && *lines)
    {
        Info<< title << ':' << nl << lines;
    }
    std::free(lines);
}


void particlePhase::report() const
{
    const dem_view particles = dem_particles(phase_engine(phase_));
    const dem_limits limits = dem_time_limits(phase_engine(phase_));
    const scalar deltaT = mesh_.time().deltaTValue();
    const scalar step = min(limits.step, deltaT);

    secondsElapsed();

    Info<< "Fluid equations, eps = voidfraction, p shared by both phases:" << nl
        << "    d(eps)/dt + div(eps U) = 0" << nl
        << "    d(eps U)/dt + div(eps U U) ="
        << " - eps grad p + eps g + div(eps tau) + S - K U" << nl
        << "    rho " << rho_ << " kg/m3, drag "
        << (coupling_.scheme == CPL_EXPLICIT ? "explicit" : "implicit in U")
        << nl << nl
        << "Mesh: " << mesh_.nCells() << " cells, "
        << (cells_.box() ? "one block of equal cells" : "general") << nl
        << "Particles: " << label(particles.n) << nl
        << "    contact law "
        << (dem_.param.law == DEM_HERTZ ? "hertz" : "linear") << nl;
    printLines("Walls", case_describe_walls(&dem_, "    "));
    printLines("Feeders", case_describe_feeders(&dem_, "    "));
    printLines("Outlets", case_describe_outlets(&dem_, "    "));
    printLines
    (
        "Limits of the DEM time step by pairs of materials",
        case_describe_limits(&dem_, phase_engine(phase_), "    ")
    );

    Info<< "Limits of the DEM time step (s):" << nl
        << "    contact " << limits.contact << ", Rayleigh " << limits.rayleigh
        << " (not imposed), user " << limits.user << nl
        << "    flow time step " << deltaT << " = "
        << max(label(std::ceil(deltaT/step)), 1) << " steps of at most " << step
        << nl << endl;
}


void particlePhase::log
(
    const scalar courant,
    const scalar secondsFluid
) const
{
    const Time& runTime = mesh_.time();
    char line[1024];

    phase_log
    (
        phase_,
        line,
        sizeof line,
        runTime.value(),
        runTime.endTime().value(),
        courant,
        secondsFluid,
        secondsElapsed(),
        runTime.startTime().value()
    );

    Info<< line << endl;
}


phase_report particlePhase::last() const
{
    return phase_last_report(phase_);
}


// A field of the cloud from a function of the particle's row
template<class Type, class Value>
static void writeField
(
    const cloud& particles,
    const word& name,
    const label n,
    const Value& value
)
{
    IOField<Type> field
    (
        IOobject
        (
            name,
            particles.time().timeName(),
            particles,
            IOobject::NO_READ,
            IOobject::NO_WRITE,
            false
        ),
        n
    );

    forAll(field, i)
    {
        field[i] = value(i);
    }

    field.write();
}


void particlePhase::writeCloud() const
{
    const dem_view view = dem_particles(phase_engine(phase_));
    const label n = view.n;

    List<int> cell(n);
    cells_.cells().locate
    (
        cells_.cells().context,
        view.n,
        view.x,
        cell.data()
    );

    passiveParticleCloud particles
    (
        mesh_,
        "particles",
        IDLList<passiveParticle>()
    );

    // A centre outside the mesh would have stopped the run in the map; the
    // check spares the cloud a search of its own.
    labelList row(n);
    label written = 0;

    for (label i = 0; i < n; ++i)
    {
        if (cell[i] >= 0)
        {
            const point x(view.x[i][0], view.x[i][1], view.x[i][2]);
            particles.addParticle(new passiveParticle(mesh_, x, cell[i]));
            row[written++] = i;
        }
    }

    particles.write();

    writeField<label>
    (
        particles, "id", written,
        [&](const label i) { return label(view.id[row[i]]); }
    );
    writeField<vector>
    (
        particles, "U", written,
        [&](const label i)
        {
            const double* v = view.v[row[i]];
            return vector(v[0], v[1], v[2]);
        }
    );
    writeField<scalar>
    (
        particles, "d", written,
        [&](const label i) { return 2*view.radius[row[i]]; }
    );
    writeField<scalar>
    (
        particles, "rho", written,
        [&](const label i)
        {
            return dem_.param.material[view.material[row[i]]].density;
        }
    );
}


void particlePhase::write()
{
    writeCloud();
    writeSnapshot();
}


void particlePhase::writeSnapshot()
{
    const Time& runTime = mesh_.time();

    dem_sim* engine = phase_engine(phase_);
    const fileName directory(runTime.path()/"dem");
    const word name(runTime.timeName());

    if (dem_write_snapshot(engine, directory.c_str(), name.c_str()) != DEM_OK)
    {
        stopRun(dem_message(engine));
    }
}

} // End namespace Foam
