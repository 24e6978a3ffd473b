/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Particles that go on from an earlier run. Their state is in
    restart/<time>.h5 of the case, that of the fluid in the time directory. The
    file is written last, once the directory is on the disk: where there is a
    file of a time, its directory is whole. A time of which there is only one of
    the two is refused.
\*---------------------------------------------------------------------------*/

#include "particlePhase.H"
#include "OSspecific.H"
#include "Pstream.H"
#include "stopRun.H"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <limits>
#include <unistd.h>

namespace Foam
{

// Name of what the clock of the run is kept by
static const char* const clockName = "foam.clock";


static fileName restartFolder(const Time& runTime)
{
    return runTime.globalPath()/"restart";
}


// What a user can do instead of starting at a time that is refused: the latest
// earlier one of which there is everything
static string instead(const Time& runTime)
{
    const fileName folder(runTime.globalPath());
    char found[CASE_NAME];
    double most = runTime.startTime().value();

    do
    {
        most = std::nextafter(most, std::numeric_limits<double>::lowest());
        most = case_restart_latest(folder.c_str(), most, found);

        if (std::isfinite(most))
        {
            const word time(fileName(found).lessExt());

            if (isDir(runTime.path()/time))
            {
                return
                    "to go on from an earlier time: startFrom startTime;"
                    " startTime " + time + ";";
            }
        }
    }
    while (std::isfinite(most));

    return "to begin anew: startFrom startTime; startTime 0;";
}


// Has a run with particles written into the directory of the start? Its time is
// the first that a run writes there, its particles are the last.
static bool written(const Time& runTime)
{
    const fileName directory(runTime.timePath());
    const bool mine =
        isDir(directory/"lagrangian"/"particles")
     || (isDir(restartFolder(runTime)) && isFile(directory/"uniform"/"time"));

    return returnReduce(mine, orOp<bool>());
}


// What is wrong with the start, or nothing
static string refusal(const Time& runTime, const bool again)
{
    const word& now = runTime.timeName();
    const fileName folder(restartFolder(runTime));
    const word startFrom
    (
        runTime.controlDict().lookupOrDefault<word>("startFrom", "latestTime")
    );
    char found[CASE_NAME];

    if (again && !isFile(folder/(now + ".h5")))
    {
        return
            "time " + now + " is of an earlier run with particles, but their"
            " state is not there: no restart/" + now + ".h5. A run that was"
            " killed while it wrote leaves such a time; " + instead(runTime);
    }

    const double most = std::numeric_limits<double>::infinity();
    const double latest =
        case_restart_latest(runTime.globalPath().c_str(), most, found);
    const scalar after = runTime.value() + 0.01*runTime.deltaTValue();

    if (startFrom == "latestTime" && std::isgreater(latest, after))
    {
        return
            "restart/" + string(found) + " is later than the latest time, "
          + now + ": the fluid of its time is not there. To go on from " + now
          + " or to begin there: startFrom startTime; startTime " + now + ";";
    }

    return string();
}


void particlePhase::findRestart()
{
    const Time& runTime = mesh_.time();
    const bool again = written(runTime);
    string message;

    if (Pstream::master())
    {
        message = refusal(runTime, again);

        const word file(runTime.timeName() + ".h5");

        if (isFile(restartFolder(runTime)/file))
        {
            restart_ = restartFolder(runTime)/file;
        }
    }
    Pstream::scatter(message);
    Pstream::scatter(restart_);

    if (message.size())
    {
        stopRun(message);
    }
}


void particlePhase::stopNew() const
{
    string message(phase_ ? phase_message(phase_) : "not enough memory");

    if (again())
    {
        message += '\n' + instead(mesh_.time());
    }
    stopRun(message);
}


void particlePhase::resume(Time& runTime)
{
    if (restart_.empty())
    {
        dem_set_time(phase_engine(phase_), runTime.value());
        return;
    }

    double clock[2];    // time, and the step that follows it where it may vary

    if (dem_kept(phase_engine(phase_), clockName, 2, clock) != 2)
    {
        stopRun
        (
            "restart file " + restart_ + ": was not written by felmiFoam, and"
            " knows nothing of the fluid here"
        );
    }

    runTime.setTime(clock[0], runTime.timeIndex());
    if (runTime.controlDict().lookupOrDefault("adjustTimeStep", false))
    {
        runTime.setDeltaT(clock[1], false);
    }

    Info<< "Go on from restart/" << restart_.name() << nl << endl;
}


void particlePhase::setAside() const
{
    int moved = 0;

    if (Pstream::master())
    {
        case_control control = case_control();
        std::strncpy
        (
            control.restart,
            restart_.name().c_str(),
            sizeof control.restart - 1
        );

        const fileName folder(mesh_.time().globalPath());
        moved = case_set_restarts_aside(folder.c_str(), &control);
    }
    Pstream::scatter(moved);

    if (Pstream::master() && control_.restart_write)
    {
        mkDir(restartFolder(mesh_.time()));     // says whose the times are
    }

    if (moved < 0)
    {
        stopRun
        (
            "cannot move restart files of an earlier run to restart.old: "
          + string(std::strerror(errno))
        );
    }
    if (moved > 0)
    {
        Info<< "Moved " << moved << " restart file" << (moved == 1 ? "" : "s")
            << " of an earlier run to restart.old" << nl << endl;
    }
}


// What has been written into a directory, or into any other of its file system,
// is on the disk
static void synchronise(const fileName& directory)
{
    const int folder = ::open(directory.c_str(), O_RDONLY);

    if (folder >= 0)
    {
        (void)::syncfs(folder);
        ::close(folder);
    }
}


void particlePhase::writeRestart()
{
    if (!control_.restart_write)
    {
        return;
    }

    const Time& runTime = mesh_.time();
    const double clock[] = {runTime.value(), runTime.deltaTValue()};
    dem_sim* engine = phase_engine(phase_);

    synchronise(runTime.timePath());

    if
    (
        dem_keep(engine, clockName, 2, clock) != DEM_OK
     || dem_write_restart
        (
            engine,
            restartFolder(runTime).c_str(),
            runTime.timeName().c_str(),
            control_.restart_keep
        ) != DEM_OK
    )
    {
        stopRun(dem_message(engine));
    }
}

} // End namespace Foam
