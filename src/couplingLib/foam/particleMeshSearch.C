/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Where points are in the mesh: see particleMesh.H.
\*---------------------------------------------------------------------------*/

#include "particleMesh.H"
#include "PstreamBuffers.H"
#include "UIPstream.H"
#include "UOPstream.H"

#include <algorithm>

namespace Foam
{

// A walk crosses a few faces from one step to the next; one that has not ended
// after as many faces as this is left to the octree.
static const label longestWalk = 30;

// Distance from a face, relative to the cell's size, up to which a point still
// counts as inside, so that no point is lost between two warped faces.
static const scalar faceTolerance = 1e-9;


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

    if (!self.mesh_.nCells())
    {
        std::fill_n(cell, m, -1);
        return;
    }
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


// Place of x in the block of equal cells, or -1
int64_t particleMesh::placeOf(const double x[3]) const
{
    int64_t place = 0;

    for (direction d = vector::nComponents; d-- > 0; )
    {
        const scalar s = (x[d] - cells_.origin[d])/cells_.spacing[d];
        const int n = cells_.cells[d];

        if (!(s >= 0 && s <= n))
        {
            return -1;
        }
        place = n*place + std::min(int(s), n - 1);
    }

    return place;
}


void particleMesh::find
(
    const size_t m,
    const double (*x)[3],
    List<int>& cell
) const
{
    cell.setSize(m);

    if (!box_ || !UPstream::parRun())
    {
        cells_.locate(cells_.context, m, x, cell.data());
        return;
    }

    for (size_t i = 0; i < m; ++i)
    {
        const int64_t place = placeOf(x[i]);
        const auto found = std::lower_bound(id_.begin(), id_.end(), place);
        const bool own = found != id_.end() && *found == place;

        cell[i] = own ? int(found - id_.begin()) : -1;
    }
}


// Points go to all processors whose bounds hold them, which say whether they
// have them in a cell. Of two that do, on a face between them, it is the first.
labelList particleMesh::hosts(const size_t m, const double (*x)[3]) const
{
    labelList host(m, -1);

    boundBox own(boundBox::invertedBox);
    forAll(lo_, c)
    {
        own.add(lo_[c]);
        own.add(hi_[c]);
    }
    if (lo_.size())
    {
        own.inflate(faceTolerance);
    }

    List<boundBox> bounds(UPstream::nProcs());
    bounds[UPstream::myProcNo()] = own;
    Pstream::gatherList(bounds);
    Pstream::scatterList(bounds);

    List<DynamicList<label>> asked(bounds.size());
    PstreamBuffers questions(UPstream::commsTypes::nonBlocking);
    PstreamBuffers answers(UPstream::commsTypes::nonBlocking);

    forAll(bounds, proc)
    {
        DynamicList<point> points;

        for (size_t i = 0; i < m; ++i)
        {
            const point p(x[i][0], x[i][1], x[i][2]);

            if (bounds[proc].contains(p))
            {
                asked[proc].append(i);
                points.append(p);
            }
        }
        UOPstream to(proc, questions);
        to << pointField(points);
    }
    questions.finishedSends();

    forAll(bounds, proc)
    {
        pointField points;
        UIPstream from(proc, questions);
        from >> points;

        List<int> cell;
        find
        (
            points.size(),
            reinterpret_cast<const double (*)[3]>(points.cdata()),
            cell
        );
        UOPstream to(proc, answers);
        to << cell;
    }
    answers.finishedSends();

    forAll(bounds, proc)
    {
        List<int> cell;
        UIPstream from(proc, answers);
        from >> cell;

        forAll(cell, i)
        {
            label& found = host[asked[proc][i]];

            if (found < 0 && cell[i] >= 0)
            {
                found = proc;
            }
        }
    }

    return host;
}

} // End namespace Foam
