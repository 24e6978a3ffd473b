/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Orderly end of a run: see stopRun.H.
\*---------------------------------------------------------------------------*/

#include "stopRun.H"
#include "IOstreams.H"
#include "OSspecific.H"

#include <cstdlib>
#include <mpi.h>

namespace Foam
{

// Seconds until a processor believes that the others do not stop with it
static const unsigned int patience = 20;


static void say(const string& message)
{
    const bool ended = message.size() && message.back() == '\n';

    Serr<< nl << "--> felmiFoam stops:" << nl << message.c_str()
        << (ended ? "" : "\n") << endl;
}


// Have all processors come here?
static bool meetOthers()
{
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);

    const double end = MPI_Wtime() + patience;
    int met = 0;

    while (!met && MPI_Wtime() < end)
    {
        MPI_Test(&request, &met, MPI_STATUS_IGNORE);
    }

    return met;
}


void stopRun(const string& message)
{
    int started = 0, ended = 0, rank = 0;

    Info<< flush;
    MPI_Initialized(&started);
    MPI_Finalized(&ended);

    if (!started || ended)
    {
        say(message);
        std::exit(1);
    }

    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (rank == 0)
    {
        say(message);
    }
    if (!meetOthers())
    {
        if (rank != 0)
        {
            say(message);
        }
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    MPI_Finalize();
    std::exit(1);
}

} // End namespace Foam
