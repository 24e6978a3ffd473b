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

    path_ = p.time().globalPath()/"postProcessing"/"felmiFoam"/"solver.csv";

    string failure;
    if (Pstream::master())
    {
        failure = openFile(again);
    }
    Pstream::scatter(failure);

    if (failure.size())
    {
        stopRun(failure);
    }
}


string patchTable::openFile(const bool again)
{
    string head("time,deltaT,courant,iterations,residual");
    for (const label patchi : open_)
    {
        head += ",p_" + p_.mesh().boundary()[patchi].name();
    }
    head += ",height\n";

    char message[1024];
    const scalar from =
        again ? p_.time().value() : std::numeric_limits<scalar>::quiet_NaN();

    std::FILE* table =
        cpl_table_open
        (
            path_.c_str(),
            head.c_str(),
            from,
            message,
            sizeof message
        );
    if (!table)
    {
        return message;
    }
    if (message[0])
    {
        Info<< path_.name() << ": " << message << nl << endl;
    }
    std::fclose(table);

    file_.open(path_, std::ios::app);
    file_.precision(rowPrecision);

    return string();
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

    if (Pstream::master())
    {
        const Time& runTime = p_.time();

        file_ << runTime.value() << ',' << runTime.deltaTValue() << ','
            << courant << ',' << iterations << ',' << residual;
        for (const scalar p : mean)
        {
            file_ << ',' << p;
        }
        file_ << ',' << height << std::endl;
    }

    bool written = !file_.fail();
    Pstream::scatter(written);

    if (!written)
    {
        stopRun("cannot write " + path_ + ": the disk may be full");
    }
}

} // End namespace Foam
