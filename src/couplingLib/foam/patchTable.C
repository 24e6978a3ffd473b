/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Time series of the flow: see patchTable.H.
\*---------------------------------------------------------------------------*/

#include "patchTable.H"
#include "OSspecific.H"
#include "wallFvPatch.H"

namespace Foam
{

// Digits of a row: enough to difference two pressures to 1e-9 of their value
static const int rowPrecision = 14;


patchTable::patchTable(const volScalarField& p, const dimensionedScalar& rho)
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

    const fileName folder(p.time().globalPath()/"postProcessing"/"felmiFoam");
    const fileName path(folder/"solver.csv");
    const bool append = p.time().value() > 0 && isFile(path);

    mkDir(folder);
    file_.open(path, append ? std::ios::app : std::ios::trunc);
    file_.precision(rowPrecision);

    if (!append)
    {
        file_ << "time,deltaT,courant,iterations,residual";
        for (const label patchi : open_)
        {
            file_ << ",p_" << p.mesh().boundary()[patchi].name();
        }
        file_ << ",height\n";
    }
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
