/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    fvMesh to cpl_mesh: see particleMesh.H. Arrays of OpenFOAM's vectors and
    labels are handed over without a copy where their layout agrees.
\*---------------------------------------------------------------------------*/

#include "particleMesh.H"
#include "stopRun.H"
#include "coupledPolyPatch.H"
#include "cyclicPolyPatch.H"
#include "emptyPolyPatch.H"
#include "globalIndex.H"
#include "labelIOList.H"
#include "processorCyclicPolyPatch.H"
#include "symmetryPolyPatch.H"
#include "symmetryPlanePolyPatch.H"
#include "syncTools.H"
#include "wallPolyPatch.H"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace Foam
{

static_assert(sizeof(vector) == 3*sizeof(double), "needs double precision");

// Positions in ascii mesh files carry six digits: equality of cells is meant
// to that precision, relative to the width of a cell.
static const scalar positionPrecision = 1e-4;


particleMesh::particleMesh(const fvMesh& mesh)
:
    mesh_(mesh),
    cells_(),
    box_(false),
    id_(mesh.nCells())
{
    makeBounds();

    const Vector<label> n(equalCells());
    const Vector<label> periodic(periodicAxes());

    if (n.x() > 0)
    {
        makeBox(n, periodic);
    }
    else
    {
        makeGeneral();
    }
}


particleMesh::~particleMesh()
{
    if (box_)
    {
        cpl_mesh_free(&cells_);
    }
}


void particleMesh::makeBounds()
{
    lo_.setSize(mesh_.nCells(), point::max);
    hi_.setSize(mesh_.nCells(), point::min);

    forAll(mesh_.cells(), c)
    {
        for (const label f : mesh_.cells()[c])
        {
            for (const label p : mesh_.faces()[f])
            {
                lo_[c] = min(lo_[c], mesh_.points()[p]);
                hi_[c] = max(hi_[c], mesh_.points()[p]);
            }
        }
    }
}


// A cell's place in the box is that of its centre; a part of the mesh keeps the
// order of the whole, so that places increase on every processor.
bool particleMesh::findPlaces
(
    const Vector<label>& n,
    const vector& width
)
{
    const boundBox& bounds = mesh_.bounds();
    const scalar tolerance = positionPrecision*cmptMin(width);
    int64_t before = -1;

    forAll(lo_, c)
    {
        const vector middle = 0.5*(lo_[c] + hi_[c]) - bounds.min();
        Vector<label> at;

        for (direction d = 0; d < vector::nComponents; ++d)
        {
            at[d] = min(max(label(middle[d]/width[d]), 0), n[d] - 1);
        }

        const vector corner = bounds.min() + cmptMultiply(width, vector(at));
        const int64_t here =
            at.x() + int64_t(n.x())*(at.y() + int64_t(n.y())*at.z());

        if
        (
            cmptMax(cmptMag(lo_[c] - corner)) > tolerance
         || cmptMax(cmptMag(hi_[c] - corner - width)) > tolerance
         || mesh_.cells()[c].size() != 6
         || here <= before
        )
        {
            return false;
        }

        id_[c] = before = here;
    }

    return true;
}


Vector<label> particleMesh::equalCells()
{
    const Vector<label> none(0, 0, 0);

    // that of any cell will do
    vector width(vector::max);
    if (mesh_.nCells())
    {
        width = hi_[0] - lo_[0];
    }
    reduce(width, minOp<vector>());

    const vector span = mesh_.bounds().span();
    Vector<label> n;
    scalar count = 1;

    for (direction d = 0; d < vector::nComponents; ++d)
    {
        const scalar cells = std::round(span[d]/width[d]);
        count *= cells;
        if (!(count > 0 && count < labelMax))
        {
            return none;
        }
        n[d] = label(cells);
    }
    if (label(count) != returnReduce(mesh_.nCells(), sumOp<label>()))
    {
        return none;
    }

    const bool equal = findPlaces(n, cmptDivide(span, vector(n)));

    return returnReduce(equal, andOp<bool>()) ? n : none;
}


Vector<label> particleMesh::periodicAxes() const
{
    Vector<label> axes(0, 0, 0);

    for (const polyPatch& patch : mesh_.boundaryMesh())
    {
        const bool cyclic =
            isA<cyclicPolyPatch>(patch) || isA<processorCyclicPolyPatch>(patch);

        // cyclicAMI and its like: periodic for the fluid, but their faces need
        // not match, and particles would take them for the end of the box
        if
        (
            isA<coupledPolyPatch>(patch)
        && !cyclic
        && !isA<processorPolyPatch>(patch)
        )
        {
            stopRun
            (
                "patch " + patch.name() + " is " + patch.type()
              + ": of all coupled types particles pass "
              + cyclicPolyPatch::typeName + " only"
            );
        }

        if (cyclic && patch.size())
        {
            const vector n = cmptMag(patch.faceNormals()[0]);

            for (direction d = 0; d < vector::nComponents; ++d)
            {
                axes[d] |= (n[d] > 1 - positionPrecision);
            }
        }
    }

    reduce(axes, maxOp<Vector<label>>());

    return axes;
}


void particleMesh::makeBox
(
    const Vector<label>& n,
    const Vector<label>& periodic
)
{
    const boundBox& bounds = mesh_.bounds();
    const vector width = cmptDivide(bounds.span(), vector(n));

    const int count[3] = {int(n.x()), int(n.y()), int(n.z())};
    const int wraps[3] =
        {int(periodic.x()), int(periodic.y()), int(periodic.z())};

    const cpl_status made =
        UPstream::parRun()
      ? cpl_mesh_box_part
        (
            &cells_,
            count,
            bounds.min().cdata(),
            width.cdata(),
            wraps,
            id_.size(),
            id_.data()
        )
      : cpl_mesh_box
        (
            &cells_,
            count,
            bounds.min().cdata(),
            width.cdata(),
            wraps
        );

    if (made != CPL_OK)
    {
        FatalErrorInFunction
            << "no memory for the arrays of " << mesh_.nCells() << " cells"
            << exit(FatalError);
    }

    box_ = true;
}


void particleMesh::makeGeneral()
{
    for (const polyPatch& patch : mesh_.boundaryMesh())
    {
        if (isA<coupledPolyPatch>(patch) && !isA<processorPolyPatch>(patch))
        {
            stopRun
            (
                "patch " + patch.name() + " is " + patch.type()
              + ": particles pass periodic boundaries only on a mesh that is"
                " one block of equal cells, numbered as blockMesh does"
            );
        }
    }

    if (UPstream::parRun())
    {
        numberCells();
        makeNeighboursOnRanks();

        // later searches of one processor must not wait for the others
        (void)mesh_.tetBasePtIs();
    }
    else
    {
        makeNeighbours();
    }

    normal_ = mesh_.faceAreas()/max(mag(mesh_.faceAreas()), VSMALL);

    cells_.n = mesh_.nCells();
    cells_.volume = mesh_.cellVolumes().cdata();
    cells_.centre =
        reinterpret_cast<const double (*)[3]>(mesh_.cellCentres().cdata());
    cells_.lo = reinterpret_cast<const double (*)[3]>(lo_.cdata());
    cells_.hi = reinterpret_cast<const double (*)[3]>(hi_.cdata());
    cells_.offset = offset_.data();
    cells_.locate = locate;
    cells_.context = this;
}


void particleMesh::makeNeighbours()
{
    offset_.assign(1, 0);
    neighbour_.reserve(6*mesh_.nCells());

    for (const labelList& cellCells : mesh_.cellCells())
    {
        neighbour_.insert(neighbour_.end(), cellCells.begin(), cellCells.end());
        offset_.push_back(neighbour_.size());
    }

    cells_.neighbour = neighbour_.data();
}


// Cells keep the numbers that they had before the mesh was decomposed, if
// decomposePar has left them; then results are those of any decomposition.
void particleMesh::numberCells()
{
    const label n = mesh_.nCells();
    const scalar all = returnReduce(scalar(n), sumOp<scalar>());

    IOobject io
    (
        "cellProcAddressing",
        mesh_.facesInstance(),
        polyMesh::meshSubDir,
        mesh_,
        IOobject::MUST_READ,
        IOobject::NO_WRITE,
        false
    );

    bool known = io.typeHeaderOk<labelIOList>(true);
    reduce(known, andOp<bool>());

    if (known)
    {
        const labelIOList original(io);
        scalar sum = 0;

        known = original.size() == n;
        forAll(original, c)
        {
            sum += original[c];
            known = known && original[c] >= 0 && original[c] < all;
        }

        // what is left by an earlier mesh of other cells adds up to less
        reduce(sum, sumOp<scalar>());
        known = known && mag(sum - 0.5*all*(all - 1)) < 0.5;
        reduce(known, andOp<bool>());

        if (known)
        {
            id_.assign(original.begin(), original.end());
        }
    }

    if (!known)
    {
        const globalIndex number(n);

        for (label c = 0; c < n; ++c)
        {
            id_[c] = number.toGlobal(c);
        }
    }
}


void particleMesh::makeNeighboursOnRanks()
{
    List<label> own(id_.size());
    std::copy(id_.begin(), id_.end(), own.begin());

    List<label> beyond;     // the other side of each boundary face
    syncTools::swapBoundaryCellList(mesh_, own, beyond);

    offset_.assign(1, 0);
    neighbourId_.reserve(6*id_.size());

    forAll(mesh_.cells(), c)
    {
        for (const label f : mesh_.cells()[c])
        {
            if (mesh_.isInternalFace(f))
            {
                const label owner = mesh_.faceOwner()[f];
                const label other =
                    owner == c ? mesh_.faceNeighbour()[f] : owner;

                neighbourId_.push_back(id_[other]);
            }
            else if
            (
                isA<processorPolyPatch>
                (
                    mesh_.boundaryMesh()[mesh_.boundaryMesh().whichPatch(f)]
                )
            )
            {
                neighbourId_.push_back(beyond[f - mesh_.nInternalFaces()]);
            }
        }
        std::sort
        (
            neighbourId_.begin() + offset_.back(),
            neighbourId_.end()
        );
        offset_.push_back(neighbourId_.size());
    }

    cells_.id = id_.data();
    cells_.neighbour_id = neighbourId_.data();
}


static case_patch_type sideType(const polyPatch& patch)
{
    if (isA<cyclicPolyPatch>(patch)) return CASE_CYCLIC;
    if (isA<emptyPolyPatch>(patch)) return CASE_EMPTY;
    if (isA<wallPolyPatch>(patch)) return CASE_WALL;
    if (isA<symmetryPolyPatch>(patch) || isA<symmetryPlanePolyPatch>(patch))
    {
        return CASE_SYMMETRY;
    }
    return CASE_PATCH;
}


case_mesh particleMesh::summary() const
{
    case_mesh summary = case_mesh();
    const boundBox& bounds = mesh_.bounds();

    for (direction d = 0; d < vector::nComponents; ++d)
    {
        summary.lo[d] = bounds.min()[d];
        summary.hi[d] = bounds.max()[d];
        summary.spacing[d] = gMin((hi_ - lo_)().component(d));
        summary.cells[d] = box_ ? cells_.cells[d] : 1;
    }

    // The patch of a side is that of the faces which look that way most.
    // Cyclic faces that processors share are those of the cyclic patch.
    const polyBoundaryMesh& patches = mesh_.boundaryMesh();
    const label patchCount = patches.nNonProcessor();

    for (label side = 0; side < 6; ++side)
    {
        vector outward(Zero);
        outward[side/2] = side % 2 ? 1 : -1;

        scalarField area(patchCount, Zero);

        for (const polyPatch& patch : patches)
        {
            const label patchi =
                isA<processorCyclicPolyPatch>(patch)
              ? refCast<const processorCyclicPolyPatch>(patch).referPatchID()
              : patch.index();

            if (patchi < patchCount)
            {
                area[patchi] += sum(max(patch.faceAreas() & outward, 0.0));
            }
        }
        reduce(area, sumOp<scalarField>());

        case_side& found = summary.side[side];
        found.type = CASE_PATCH;
        found.patch[0] = '\0';

        if (patchCount && max(area) > 0)
        {
            const polyPatch& patch = patches[findMax(area)];
            word name(patch.name());

            found.type = sideType(patch);
            name.resize(std::min<size_t>(name.size(), CASE_NAME - 1));
            std::strcpy(found.patch, name.c_str());
        }
    }

    return summary;
}

} // End namespace Foam
