#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Meshes that are not one block of equal cells: two skewed graded blocks, and a cylinder of five
# blocks with curved sides, with spheres falling through rising air. Every balance
# of the ledger stays below 1e-12, all solid volume is on the mesh, and a run over the same box
# numbered backwards, which takes the general path, gives what the fast path gives.
. "$(dirname "$0")/foamCase"

gravity="(0 0 -9.81)" density=2500 diameter=0.002 endTime=0.02 tolerance=1e-9 nonOrthogonal=1
inlet="(0 0 1)" U=$inlet sides=wall

# mesh NAME VERTICES BLOCKS BOTTOM TOP SIDES [EDGES]: another mesh for the case
mesh()
{
    { header dictionary blockMeshDict
      cat <<END
scale 1; vertices ( $2 ); blocks ( $3 ); edges ( $7 );
boundary
(
    bottom { type patch; faces ( $4 ); } top { type patch; faces ( $5 ); }
    xLow { type wall; faces ( $6 ); }
);
END
    } >system/blockMeshDict
    rm -rf constant/polyMesh
    blockMesh >log.blockMesh || { tail log.blockMesh; exit 1; }
    echo "$1"
    runCase
    grep 'cells, general' log.felmiFoam || { echo "not a general mesh"; exit 1; }
}

lower="(0 0 0)(.03 0 0)(.03 .03 0)(0 .03 0)"
upper="(0 0 .1)(.03 0 .1)(.03 .03 .1)(0 .03 .1)"

lattice 0.0024 "0.006 0.006 0.02" "0.024 0.024 0.08"
makeCase
mesh "two skewed blocks" "$lower (.004 .002 .05)(.034 -.001 .05)(.03 .034 .05)(0 .03 .05) $upper" \
    "hex (0 1 2 3 4 5 6 7) (6 7 8) simpleGrading (1.5 1 1.3)
     hex (4 5 6 7 8 9 10 11) (6 7 8) simpleGrading (1.5 1 .7)" \
    "(0 3 2 1)" "(8 9 10 11)" \
    "(0 4 7 3)(1 2 6 5)(0 1 5 4)(3 7 6 2)(4 8 11 7)(5 6 10 9)(4 5 9 8)(7 11 10 6)"

# a cylinder of radius 20 mm around a core of 16 x 16 mm
corners() { echo "(-.008 -.008 $1)(.008 -.008 $1)(.008 .008 $1)(-.008 .008 $1)" \
    "(-.0141421356 -.0141421356 $1)(.0141421356 -.0141421356 $1)" \
    "(.0141421356 .0141421356 $1)(-.0141421356 .0141421356 $1)"; }
arcs() { echo "arc $2 $3 (0 -.02 $1) arc $3 $4 (.02 0 $1) arc $4 $5 (0 .02 $1) arc $5 $2 (-.02 0 $1)"; }
lattice 0.0024 "-0.01 -0.01 0.02" "0.01 0.01 0.08"
walls="walls { pipe { material glass; shape { type cylinder; point1 (0 0 0); point2 (0 0 .1);
    radius .02; inside true; } } }"
particles >constant/demProperties
walls=
mesh "a cylinder of five blocks" "$(corners 0) $(corners .1)" \
    "hex (0 1 2 3 8 9 10 11) (5 5 14) simpleGrading (1 1 1)
     hex (4 5 1 0 12 13 9 8) (5 3 14) simpleGrading (1 1 1)
     hex (5 6 2 1 13 14 10 9) (5 3 14) simpleGrading (1 1 1)
     hex (6 7 3 2 14 15 11 10) (5 3 14) simpleGrading (1 1 1)
     hex (7 4 0 3 15 12 8 11) (5 3 14) simpleGrading (1 1 1)" \
    "(0 3 2 1)(4 0 1 5)(5 1 2 6)(6 2 3 7)(7 3 0 4)" \
    "(8 9 10 11)(12 13 9 8)(13 14 10 9)(14 15 11 10)(15 12 8 11)" \
    "(4 5 13 12)(5 6 14 13)(6 7 15 14)(7 4 12 15)" \
    "$(arcs 0 4 5 6 7) $(arcs .1 12 13 14 15)"

# The same box twice: numbered as blockMesh does, and with the block turned about z.
lattice 0.0024 "0.006 0.006 0.02" "0.024 0.024 0.08"
nonOrthogonal=0 size="0.03 0.03 0.1" cells="6 6 16"
makeCase
runCase
grep -q 'one block of equal cells' log.felmiFoam
mv postProcessing fast
mesh "a box numbered otherwise" "$lower $upper" \
    "hex (1 2 3 0 5 6 7 4) (6 6 16) simpleGrading (1 1 1)" \
    "(0 3 2 1)" "(4 5 6 7)" "(0 4 7 3)(1 2 6 5)(0 1 5 4)(3 7 6 2)"
PYTHONPATH=$here/tests/cross python3 - <<'END'
from foamRead import ledger, table

general, fast = ledger(), table("fast/ledger/ledger.csv")
scale = max(abs(row["momentum_z"]) for row in fast)
worst = max(abs(a["momentum_z"] - b["momentum_z"]) for a, b in zip(general, fast)) / scale
print(f"momentum of the particles on the two paths differs by {worst:.1e}")
assert len(general) == len(fast) == 20
assert worst < 1e-7
END
