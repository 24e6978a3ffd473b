/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Time series of the flow: see patchTable.H.
\*---------------------------------------------------------------------------*/

#include "patchTable.H"
#include "stopRun.H"
#include "wallFvPatch.H"

#include "cpl.h"

#include <limits>

namespace Foam
{

// Digits of a row: enough to difference two pressures to 1e-9 of their value
static const int rowPrecision = 14;


patchTable::patchTable
(
    const volScalarField& p,
    const dimensionedScalar& rho,
    const bool again
)
:
    p_(p),
    rho_(rho.value())
{
    DynamicList<label> open;

    for (const fvPatch& patch : p.mesh().boundary())
    {
        if
        (
           !isA<wallFvPatch>(patch)
        && !fvPatch::constraintType(patch.type())
        )
        {
            open.append(patch.index());
        }
    }
    open_.transfer(open);

    if (!Pstream::master())
    {
        return;
    }

    const fileName path
    (
        p.time().globalPath()/"postProcessing"/"felmiFoam"/"solver.csv"
    );

    string head("time,deltaT,courant,iterations,residual");
    for (const label patchi : open_)
    {
        head += ",p_" + p.mesh().boundary()[patchi].name();
    }
    head += ",height\n";

    char message[1024];
    const scalar from =
        again ? p.time().value() : std::numeric_limits<scalar>::quiet_NaN();

    std::FILE* table =
        cpl_table_open
        (
            path.c_str(),
            head.c_str(),
            from,
            message,
            sizeof message
        );
    if (!table)
    {
        stopRun(message);
    }
    if (message[0])
    {
        Info<< path.name() << ": " << message << nl << endl;
    }
    std::fclose(table);

    file_.open(path, std::ios::app);
    file_.precision(rowPrecision);
}


void patchTable::write
(
    const scalar courant,
    const label iterations,
    const scalar residual,
    const scalar height
)
{
    const surfaceScalarField& magSf = p_.mesh().magSf();
    scalarField mean(open_.size());

    forAll(open_, i)
    {
        const scalarField& area = magSf.boundaryField()[open_[i]];
        mean[i] =
            rho_*gSum(area*p_.boundaryField()[open_[i]])/gSum(area);
    }

    if (!Pstream::master())
    {
        return;
    }

    const Time& runTime = p_.time();

    file_ << runTime.value() << ',' << runTime.deltaTValue() << ',' << courant
        << ',' << iterations << ',' << residual;
    for (const scalar p : mean)
    {
        file_ << ',' << p;
    }
    file_ << ',' << height << std::endl;
}

} // End namespace Foam
