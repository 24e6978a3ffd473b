/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Cells to faces and back: see faceForces.H for the equations and their
    reference. Fields are OpenFOAM's: one array of internal faces and one array
    a patch. On a coupled patch each side adds the half of the face that lies
    in its own cell.
\*---------------------------------------------------------------------------*/

#include "faceForces.H"

namespace Foam
{

template<class Type>
tmp<GeometricField<Type, fvsPatchField, surfaceMesh>> faceForces::averageOf
(
    const GeometricField<Type, fvPatchField, volMesh>& q
) const
{
    typedef GeometricField<Type, fvsPatchField, surfaceMesh> faceField;

    tmp<faceField> tresult
    (
        new faceField
        (
            IOobject
            (
                "average(" + q.name() + ')',
                mesh_.time().timeName(),
                mesh_
            ),
            mesh_,
            dimensioned<Type>(q.dimensions(), Zero)
        )
    );
    faceField& result = tresult.ref();

    const labelUList& owner = mesh_.owner();
    const labelUList& neighbour = mesh_.neighbour();

    forAll(owner, f)
    {
        result[f] =
            share_[f]*q[owner[f]] + (1 - share_[f])*q[neighbour[f]];
    }

    forAll(q.boundaryField(), patchi)
    {
        const fvPatchField<Type>& qb = q.boundaryField()[patchi];
        Field<Type>& result_b = result.boundaryFieldRef()[patchi];

        result_b = qb.patchInternalField();

        if (qb.coupled())
        {
            const scalarField& m = share_.boundaryField()[patchi];
            result_b = m*result_b + (1 - m)*qb.patchNeighbourField();
        }
    }

    return tresult;
}


faceForces::faceForces(const fvMesh& mesh)
:
    mesh_(mesh),
    share_("share", 1 - mesh.surfaceInterpolation::weights()),
    leverOwner_
    (
        IOobject("leverOwner", mesh.time().timeName(), mesh),
        mesh,
        dimensionedVector(dimLength, Zero)
    ),
    leverNeighbour_(mesh.nInternalFaces())
{
    const vectorField& C = mesh.cellCentres();
    const vectorField& Cf = mesh.faceCentres();

    forAll(mesh.owner(), f)
    {
        leverOwner_[f] = Cf[f] - C[mesh.owner()[f]];
        leverNeighbour_[f] = Cf[f] - C[mesh.neighbour()[f]];
    }

    forAll(mesh.boundary(), patchi)
    {
        const fvPatch& patch = mesh.boundary()[patchi];

        leverOwner_.boundaryFieldRef()[patchi] = patch.Cf() - patch.Cn();

        if (!patch.coupled())
        {
            share_.boundaryFieldRef()[patchi] = 1;
        }
    }
}


tmp<surfaceScalarField> faceForces::average(const volScalarField& q) const
{
    return averageOf(q);
}


tmp<surfaceScalarField> faceForces::averageFlux(const volVectorField& q) const
{
    return averageOf(q) & mesh_.Sf();
}


tmp<volVectorField::Internal> faceForces::reconstruct
(
    const surfaceScalarField& F
) const
{
    tmp<volVectorField::Internal> tresult
    (
        new volVectorField::Internal
        (
            IOobject("reconstructed", mesh_.time().timeName(), mesh_),
            mesh_,
            dimensionedVector(F.dimensions()/dimArea, Zero)
        )
    );
    vectorField& result = tresult.ref();

    const labelUList& owner = mesh_.owner();
    const labelUList& neighbour = mesh_.neighbour();

    forAll(owner, f)
    {
        result[owner[f]] += leverOwner_[f]*F[f];
        result[neighbour[f]] -= leverNeighbour_[f]*F[f];
    }

    forAll(F.boundaryField(), patchi)
    {
        const labelUList& cell = mesh_.boundary()[patchi].faceCells();
        const scalarField& Fb = F.boundaryField()[patchi];
        const vectorField& lever = leverOwner_.boundaryField()[patchi];

        forAll(cell, i)
        {
            result[cell[i]] += lever[i]*Fb[i];
        }
    }

    result /= mesh_.V();

    return tresult;
}

} // End namespace Foam
