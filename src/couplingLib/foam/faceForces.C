/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Forces on faces, their reconstruction in cells, and its transpose: see
    faceForces.H for the equations and their reference. Fields are OpenFOAM's:
    one array of internal faces and one array a patch. On a coupled patch each
    side adds the half of the face that lies in its own cell.
\*---------------------------------------------------------------------------*/

#include "faceForces.H"

namespace Foam
{

// T_c is handed on only where it differs from unity by more than rounding:
// 1e-13 is some hundred roundings of sums over the faces of a cell.
static const scalar roundingOfUnity = 1e-13;

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
            weight_[f]*q[owner[f]] + (1 - weight_[f])*q[neighbour[f]];
    }

    forAll(q.boundaryField(), patchi)
    {
        const fvPatchField<Type>& qb = q.boundaryField()[patchi];
        Field<Type>& result_b = result.boundaryFieldRef()[patchi];

        result_b = qb.patchInternalField();

        if (qb.coupled())
        {
            const scalarField& w = weight_.boundaryField()[patchi];
            result_b = w*result_b + (1 - w)*qb.patchNeighbourField();
        }
    }

    return tresult;
}


// cells[c] += sum over its faces of weight*product(face). On the neighbour's
// side the flux turns its sign and so does the lever: the product stays.
template<class Type, class Product>
void faceForces::gatherOwned
(
    Field<Type>& cells,
    const surfaceScalarField& weight,
    const Product& product
) const
{
    const labelUList& owner = mesh_.owner();
    const labelUList& neighbour = mesh_.neighbour();

    forAll(owner, f)
    {
        const Type q = product(lever_[f], -1, f);
        cells[owner[f]] += weight[f]*q;
        cells[neighbour[f]] += (1 - weight[f])*q;
    }

    forAll(weight.boundaryField(), patchi)
    {
        const scalarField& w = weight.boundaryField()[patchi];
        const vectorField& lever = lever_.boundaryField()[patchi];
        const labelUList& cell = mesh_.boundary()[patchi].faceCells();

        forAll(cell, i)
        {
            cells[cell[i]] += w[i]*product(lever[i], patchi, i);
        }
    }
}


faceForces::faceForces(const fvMesh& mesh)
:
    mesh_(mesh),
    weight_("faceForcesWeight", 1 - mesh.surfaceInterpolation::weights()),
    leverOwner_
    (
        IOobject("leverOwner", mesh.time().timeName(), mesh),
        mesh,
        dimensionedVector(dimLength, Zero)
    ),
    lever_("lever", leverOwner_),
    tensor_(mesh.nCells(), Zero),
    unity_(true)
{
    const vectorField& C = mesh.cellCentres();
    const vectorField& Cf = mesh.faceCentres();

    forAll(mesh.owner(), f)
    {
        leverOwner_[f] = Cf[f] - C[mesh.owner()[f]];
        lever_[f] = C[mesh.neighbour()[f]] - C[mesh.owner()[f]];
    }

    forAll(mesh.boundary(), patchi)
    {
        const fvPatch& patch = mesh.boundary()[patchi];
        vectorField& owned = leverOwner_.boundaryFieldRef()[patchi];

        owned = patch.Cf() - patch.Cn();

        if (patch.coupled())
        {
            lever_.boundaryFieldRef()[patchi] = patch.delta();
        }
        else
        {
            lever_.boundaryFieldRef()[patchi] = owned;
            weight_.boundaryFieldRef()[patchi] = 1;
        }
    }

    makeTensor();
}


void faceForces::makeTensor()
{
    const surfaceVectorField& Sf = mesh_.Sf();

    gatherOwned
    (
        tensor_,
        weight_,
        [&](const vector& lever, const label patchi, const label f)
        {
            return
                lever
               *(patchi < 0 ? Sf[f] : Sf.boundaryField()[patchi][f]);
        }
    );

    tensor_ /= mesh_.V();

    for (direction d = 0; d < vector::nComponents; ++d)
    {
        if (mesh_.solutionD()[d] < 0)
        {
            tensor_.replace(4*d, 1);
        }
    }

    unity_ = gMax(mag(tensor_ - Foam::tensor(I))()) < roundingOfUnity;
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
        result[neighbour[f]] += (lever_[f] - leverOwner_[f])*F[f];
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


tmp<volVectorField::Internal> faceForces::transpose
(
    const surfaceScalarField& q
) const
{
    tmp<volVectorField::Internal> tresult
    (
        new volVectorField::Internal
        (
            IOobject("transposed", mesh_.time().timeName(), mesh_),
            mesh_,
            dimensionedVector(q.dimensions()/dimArea, Zero)
        )
    );
    vectorField& result = tresult.ref();

    gatherOwned
    (
        result,
        weight_,
        [&](const vector& lever, const label patchi, const label f)
        {
            return
                lever*(patchi < 0 ? q[f] : q.boundaryField()[patchi][f]);
        }
    );

    result /= mesh_.V();

    return tresult;
}


void faceForces::hold
(
    surfaceScalarField& gradpf,
    const surfaceScalarField& balance,
    const volScalarField& p
) const
{
    forAll(p.boundaryField(), patchi)
    {
        const fvPatchScalarField& pb = p.boundaryField()[patchi];

        if (!pb.coupled() && !pb.fixesValue())
        {
            gradpf.boundaryFieldRef()[patchi] = balance.boundaryField()[patchi];
        }
    }
}


vector faceForces::total(const surfaceScalarField& F) const
{
    vector result(Zero);

    forAll(mesh_.owner(), f)
    {
        result += lever_[f]*F[f];
    }

    forAll(F.boundaryField(), patchi)
    {
        const scalarField& Fb = F.boundaryField()[patchi];
        const vectorField& lever = leverOwner_.boundaryField()[patchi];

        forAll(Fb, i)
        {
            result += lever[i]*Fb[i];
        }
    }

    return returnReduce(result, sumOp<vector>());
}

} // End namespace Foam
