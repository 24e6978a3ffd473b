/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    fvMesh to cpl_mesh: see particleMesh.H. Arrays of OpenFOAM's vectors and
    labels are handed over without a copy where their layout agrees.
\*---------------------------------------------------------------------------*/

#include "particleMesh.H"
#include "coupledPolyPatch.H"
#include "cyclicPolyPatch.H"
#include "emptyPolyPatch.H"
#include "symmetryPolyPatch.H"
#include "symmetryPlanePolyPatch.H"
#include "wallPolyPatch.H"

#include <cstring>

namespace Foam
{

static_assert(sizeof(vector) == 3*sizeof(double), "needs double precision");

// Positions in ascii mesh files carry six digits: equality of cells is meant
// to that precision, relative to the width of a cell.
static const scalar positionPrecision = 1e-4;

// A walk crosses a few faces from one step to the next; one that has not ended
// after as many faces as this is left to the octree.
static const label longestWalk = 30;

// Distance from a face, relative to the cell's size, up to which a point still
// counts as inside, so that no point is lost between two warped faces.
static const scalar faceTolerance = 1e-9;


particleMesh::particleMesh(const fvMesh& mesh)
:
    mesh_(mesh),
    cells_(),
    box_(false)
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


Vector<label> particleMesh::equalCells() const
{
    const Vector<label> none(0, 0, 0);

    if (!mesh_.nCells())
    {
        return none;
    }

    const boundBox& bounds = mesh_.bounds();
    const vector width = hi_[0] - lo_[0];
    Vector<label> n;

    for (direction d = 0; d < vector::nComponents; ++d)
    {
        n[d] = round(bounds.span()[d]/width[d]);
    }
    if (n.x()*n.y()*n.z() != mesh_.nCells())
    {
        return none;
    }

    const vector exact = cmptDivide(bounds.span(), vector(n));
    const scalar tolerance = positionPrecision*cmptMin(exact);

    label c = 0;
    for (label k = 0; k < n.z(); ++k)
    {
        for (label j = 0; j < n.y(); ++j)
        {
            for (label i = 0; i < n.x(); ++i, ++c)
            {
                const vector corner =
                    bounds.min() + cmptMultiply(exact, vector(i, j, k));

                if
                (
                    cmptMax(cmptMag(lo_[c] - corner)) > tolerance
                 || cmptMax(cmptMag(hi_[c] - corner - exact)) > tolerance
                 || mesh_.cells()[c].size() != 6
                )
                {
                    return none;
                }
            }
        }
    }

    return n;
}


Vector<label> particleMesh::periodicAxes() const
{
    Vector<label> axes(0, 0, 0);

    for (const polyPatch& patch : mesh_.boundaryMesh())
    {
        // cyclicAMI and its like: periodic for the fluid, but their faces need
        // not match, and particles would take them for the end of the box
        if (isA<coupledPolyPatch>(patch) && !isA<cyclicPolyPatch>(patch))
        {
            FatalErrorInFunction
                << "patch " << patch.name() << " is " << patch.type()
                << ": of all coupled types particles pass "
                << cyclicPolyPatch::typeName << " only"
                << exit(FatalError);
        }

        if (isA<cyclicPolyPatch>(patch) && patch.size())
        {
            const vector n = cmptMag(patch.faceNormals()[0]);

            for (direction d = 0; d < vector::nComponents; ++d)
            {
                axes[d] |= (n[d] > 1 - positionPrecision);
            }
        }
    }

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

    if
    (
        cpl_mesh_box
        (
            &cells_,
            count,
            bounds.min().cdata(),
            width.cdata(),
            wraps
        )
     != CPL_OK
    )
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
        if (isA<coupledPolyPatch>(patch))
        {
            FatalErrorInFunction
                << "patch " << patch.name() << " is " << patch.type()
                << ": particles pass periodic boundaries only on a mesh that"
                << " is one block of equal cells, numbered as blockMesh does"
                << exit(FatalError);
        }
    }

    offset_.assign(1, 0);
    DynamicList<int> neighbour(6*mesh_.nCells());

    for (const labelList& cellCells : mesh_.cellCells())
    {
        for (const label c : cellCells)
        {
            neighbour.append(c);
        }
        offset_.push_back(neighbour.size());
    }
    neighbour_.transfer(neighbour);

    normal_ = mesh_.faceAreas()/max(mag(mesh_.faceAreas()), VSMALL);

    cells_.n = mesh_.nCells();
    cells_.volume = mesh_.cellVolumes().cdata();
    cells_.centre =
        reinterpret_cast<const double (*)[3]>(mesh_.cellCentres().cdata());
    cells_.lo = reinterpret_cast<const double (*)[3]>(lo_.cdata());
    cells_.hi = reinterpret_cast<const double (*)[3]>(hi_.cdata());
    cells_.offset = offset_.data();
    cells_.neighbour = neighbour_.cdata();
    cells_.locate = locate;
    cells_.context = this;
}


label particleMesh::walk(const point& x, label celli) const
{
    for (label step = 0; step < longestWalk; ++step)
    {
        // the face that x lies farthest beyond
        scalar farthest = faceTolerance*mag(hi_[celli] - lo_[celli]);
        label facei = -1;

        for (const label f : mesh_.cells()[celli])
        {
            const scalar side = mesh_.faceOwner()[f] == celli ? 1 : -1;
            const scalar beyond =
                side*((x - mesh_.faceCentres()[f]) & normal_[f]);

            if (beyond > farthest)
            {
                farthest = beyond;
                facei = f;
            }
        }

        if (facei < 0)
        {
            return celli;
        }
        if (!mesh_.isInternalFace(facei))
        {
            return -1;
        }

        celli =
            mesh_.faceOwner()[facei] == celli
          ? mesh_.faceNeighbour()[facei]
          : mesh_.faceOwner()[facei];
    }

    return -1;
}


void particleMesh::locate
(
    void* context,
    size_t m,
    const double (*x)[3],
    int* cell
)
{
    particleMesh& self = *static_cast<particleMesh*>(context);

    if (self.hint_.size() < label(m))
    {
        self.hint_.setSize(m, 0);
    }

    for (size_t i = 0; i < m; ++i)
    {
        const point p(x[i][0], x[i][1], x[i][2]);
        label& hint = self.hint_[i];

        label found = self.walk(p, hint);
        if (found < 0)
        {
            found = self.mesh_.findCell(p);
        }
        if (found >= 0)
        {
            hint = found;
        }
        cell[i] = found;
    }
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
    case_mesh summary;
    const boundBox& bounds = mesh_.bounds();

    for (direction d = 0; d < vector::nComponents; ++d)
    {
        summary.lo[d] = bounds.min()[d];
        summary.hi[d] = bounds.max()[d];
        summary.spacing[d] = min((hi_ - lo_)().component(d));
        summary.cells[d] = box_ ? cells_.cells[d] : 1;
    }

    // The patch of a side is that of the faces which look that way most
    for (label side = 0; side < 6; ++side)
    {
        vector outward(Zero);
        outward[side/2] = side % 2 ? 1 : -1;

        scalar most = 0;
        summary.side[side].type = CASE_PATCH;
        summary.side[side].patch[0] = '\0';

        for (const polyPatch& patch : mesh_.boundaryMesh())
        {
            const scalar area = sum(max(patch.faceAreas() & outward, 0.0));

            if (area > most)
            {
                most = area;
                summary.side[side].type = sideType(patch);
                word name(patch.name());
                name.resize(std::min<size_t>(name.size(), CASE_NAME - 1));
                std::strcpy(summary.side[side].patch, name.c_str());
            }
        }
    }

    return summary;
}

} // End namespace Foam
