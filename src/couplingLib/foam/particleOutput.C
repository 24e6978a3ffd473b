/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    What the particle phase prints and writes: the report at the start, the
    line of a step, the OpenFOAM cloud lagrangian/particles (positions, id,
    U, d, rho) and the snapshots in dem.
\*---------------------------------------------------------------------------*/

#include "particlePhase.H"
#include "clockValue.H"
#include "IOField.H"
#include "ListOps.H"
#include "passiveParticleCloud.H"
#include "PstreamBuffers.H"
#include "UIPstream.H"
#include "UOPstream.H"
#include "stopRun.H"

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
    const label cellCount = returnReduce(mesh_.nCells(), sumOp<label>());
    const label particleCount =
        returnReduce(label(particles.n), sumOp<label>());
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
        << "Mesh: " << cellCount << " cells, "
        << (cells_.box() ? "one block of equal cells" : "general") << nl
        << "Particles: " << particleCount << nl
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
)
{
    secondsFluid_ += secondsFluid;

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


void particlePhase::logShares() const
{
    char text[1024];

    phase_shares(phase_, text, sizeof text, secondsFluid_, secondsElapsed());
    Info<< text << endl;
}


phase_report particlePhase::last() const
{
    return phase_last_report(phase_);
}


// What the cloud holds of particles
struct cloudColumns
{
    labelList id;
    vectorField x, U;
    scalarField d, rho;

    void append(const cloudColumns& more)
    {
        id.append(more.id);
        x.append(more.x);
        U.append(more.U);
        d.append(more.d);
        rho.append(more.rho);
    }

    // The rows with these numbers
    cloudColumns subset(const labelUList& rows) const
    {
        return cloudColumns
        {
            labelList(id, rows),
            vectorField(x, rows),
            vectorField(U, rows),
            scalarField(d, rows),
            scalarField(rho, rows)
        };
    }
};


Ostream& operator<<(Ostream& os, const cloudColumns& c)
{
    return os << c.id << c.x << c.U << c.d << c.rho;
}


Istream& operator>>(Istream& is, cloudColumns& c)
{
    return is >> c.id >> c.x >> c.U >> c.d >> c.rho;
}


static cloudColumns columnsOf(const dem_view& view, const dem_material* material)
{
    const label n = view.n;
    cloudColumns c
    {
        labelList(n),
        vectorField(n),
        vectorField(n),
        scalarField(n),
        scalarField(n)
    };

    for (label i = 0; i < n; ++i)
    {
        c.id[i] = view.id[i];
        c.x[i] = vector(view.x[i][0], view.x[i][1], view.x[i][2]);
        c.U[i] = vector(view.v[i][0], view.v[i][1], view.v[i][2]);
        c.d[i] = 2*view.radius[i];
        c.rho[i] = material[view.material[i]].density;
    }

    return c;
}


// Particles go from the processor that moves them to the one of their cell
static cloudColumns toHosts(const cloudColumns& own, const labelUList& host)
{
    const labelListList rows(invertOneToMany(UPstream::nProcs(), host));
    PstreamBuffers buffers(UPstream::commsTypes::nonBlocking);

    forAll(rows, proc)
    {
        UOPstream to(proc, buffers);
        to << own.subset(rows[proc]);
    }
    buffers.finishedSends();

    cloudColumns all;

    forAll(rows, proc)
    {
        cloudColumns part;
        UIPstream from(proc, buffers);
        from >> part;
        all.append(part);
    }

    return all;
}


template<class Type>
static void writeField
(
    const cloud& particles,
    const word& name,
    const Field<Type>& values
)
{
    IOField<Type>
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
        values
    ).write();
}


void particlePhase::writeCloud() const
{
    const dem_view view = dem_particles(phase_engine(phase_));

    cloudColumns rows(columnsOf(view, dem_.param.material));
    if (UPstream::parRun())
    {
        rows = toHosts(rows, cells_.hosts(view.n, view.x));
    }

    List<int> cell;
    cells_.find
    (
        rows.x.size(),
        reinterpret_cast<const double (*)[3]>(rows.x.cdata()),
        cell
    );

    // origId counts from output to output otherwise, and from run to run anew
    particle::particleCount_ = 0;

    passiveParticleCloud particles
    (
        mesh_,
        "particles",
        IDLList<passiveParticle>()
    );

    // A centre outside the mesh would have stopped the run in the map; the
    // check spares the cloud a search of its own.
    DynamicList<label> inside(cell.size());

    forAll(cell, i)
    {
        if (cell[i] >= 0)
        {
            particles.addParticle
            (
                new passiveParticle(mesh_, rows.x[i], cell[i])
            );
            inside.append(i);
        }
    }
    rows = rows.subset(inside);

    particles.write();
    writeField(particles, "id", Field<label>(rows.id));
    writeField(particles, "U", rows.U);
    writeField(particles, "d", rows.d);
    writeField(particles, "rho", rows.rho);
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
    const fileName directory(runTime.globalPath()/"dem");
    const word name(runTime.timeName());

    if (dem_write_snapshot(engine, directory.c_str(), name.c_str()) != DEM_OK)
    {
        stopRun(dem_message(engine));
    }
}

} // End namespace Foam
