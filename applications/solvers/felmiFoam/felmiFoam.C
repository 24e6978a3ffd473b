/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
Application
    felmiFoam

Group
    grpLagrangianSolvers

Description
    Transient solver for particles (discrete element method) in an
    incompressible fluid, laminar or turbulent, both phases sharing the
    pressure:

        d(eps)/dt + div(eps U) = 0
        d(eps U)/dt + div(eps U U) =
            - eps grad p + eps g + div(eps tau) + S - K U

    with eps the void fraction, U the interstitial velocity, p the pressure
    per density (weight of the fluid included) and S - K U the drag per
    density, implicit in U in momentum and in the pressure equation (Mori and
    Sakai). Drag, weight and pressure gradient are balanced on faces and reach
    cells by Perot's reconstruction (faceForces.H): a sharp bed surface neither
    checkerboards nor costs accuracy. Particles are booked what the cells lose,
    to rounding; the fluid's own momentum is kept as far as the pressure
    corrections are carried.

    Particles are those of constant/demProperties, coupled as
    constant/couplingProperties says.

    References:
        Y. Mori, doctoral thesis, University of Tokyo (2021).
        B. Perot, J. Comput. Phys. 159 (2000) 58, doi:10.1006/jcph.2000.6424.

    Written for ESI releases v1912 to v2506.

\*---------------------------------------------------------------------------*/

#include "fvCFD.H"
#include "singlePhaseTransportModel.H"
#include "turbulentTransportModel.H"
#include "pimpleControl.H"
#include "fvOptions.H"
#include "fixedFluxPressureFvPatchScalarField.H"
#include "clockValue.H"

#include "faceForces.H"
#include "particlePhase.H"
#include "patchTable.H"
#include "stopRun.H"

#include <mpi.h>

// * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * //

int main(int argc, char *argv[])
{
    argList::addNote
    (
        "Transient solver for particles (discrete element method) in an"
        " incompressible fluid."
    );

    #include "aboutCase.H"
    #include "postProcess.H"

    #include "addCheckCaseOptions.H"
    #include "setRootCaseLists.H"
    #include "startParticles.H"
    #include "createTime.H"
    #include "createMesh.H"
    #include "createControl.H"
    #include "createTimeControls.H"
    #include "createFields.H"

    particles.report();
    particles.writeSnapshot();

    Info<< "Starting time loop\n" << endl;

    while (runTime.run())
    {
        #include "readTimeControls.H"
        #include "CourantNo.H"
        #include "setDeltaT.H"

        ++runTime;

        Info<< "Time = " << runTime.timeName() << nl << endl;

        particles.advance();
        particles.voidage(voidfraction);
        alphaf = faces.average(voidfraction);

        const clockValue startFluid(true);
        label iterations = 0;
        scalar residual = 0;

        // --- Pressure-velocity PIMPLE corrector loop
        while (pimple.loop())
        {
            // the inlet may follow the void fraction
            U.correctBoundaryConditions();

            // drag laws see the velocity that carries the superficial flux
            particles.drag
            (
                faces.reconstruct(alphaPhi)/voidfraction(),
                K,
                S,
                Us
            );

            #include "UEqn.H"

            // --- Pressure corrector loop
            while (pimple.correct())
            {
                #include "pEqn.H"
            }

            if (pimple.turbCorr())
            {
                laminarTransport.correct();
                turbulence->correct();
            }
        }

        const scalar secondsFluid = startFluid.elapsed();

        #include "settle.H"

        particles.log(CoNum, secondsFluid);
        table.write(CoNum, iterations, residual, particles.last().height);

        const bool written = runTime.write();
        if (runTime.writeTime())
        {
            if (!returnReduce(written, andOp<bool>()))
            {
                stopRun
                (
                    "the fields of time " + runTime.timeName()
                  + " cannot be written: the disk may be full"
                );
            }
            particles.write();
            particles.writeRestart();
        }

        runTime.printExecutionTime(Info);
    }

    particles.logShares();

    Info<< "End\n" << endl;

    return 0;
}


// ************************************************************************* //
