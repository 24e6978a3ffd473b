#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# felmiFoam on several ranks where cells are found by search and where they are periodic: two skewed
# graded blocks, and a box that is cyclic on all sides, whose pairs of sides lie on different ranks.
# Spheres meet, and the packing limit moves volume across borders. All agree with one rank to 1e-9
# and keep every balance to 1e-12.
. "$(dirname "$0")/foamCase"
export PYTHONPATH=$here/tests/cross

density=2500 diameter=0.002 deltaT=5e-4 endTime=0.015 tolerance=1e-15 correctors=3
spheres="type lattice; material glass; diameter $diameter; seed 7;"

# compareRanks NAME CELLS RANKS...: the case of this folder on one rank and on each division RANKS
compareRanks()
{
    local name=$1 count=$2 ranks others=
    shift 2
    sed -i -e 's/writePrecision 14/writePrecision 17/' system/controlDict
    sed -i -e 's/tolerance 1e-12; relTol/tolerance 1e-15; relTol/' system/fvSolution
    echo "packingLimit 0.3;" >>constant/couplingProperties
    for ranks in "1 1 1" "$@"; do
        runRanks "$ranks"
        grep -h 'cells, ' log.felmiFoam
        mkdir "$name${ranks// /}"
        mv dem postProcessing $endTime log.felmiFoam "$name${ranks// /}"
        rm -rf processor* restart
        [ "$ranks" = "1 1 1" ] || others="$others $name${ranks// /}"
    done
    awk -F, '!/^#/ && /[0-9]/ { if ($4 > most) most = $4 } END { print "moved: " most " m3"; exit !(most > 0) }' \
        ${name}111/postProcessing/ledger/ledger.csv
    felmiPython "$PYTHONPATH/foamSame.py" 1e-9 $endTime 0.1 "$count" ${name}111 $others
}

# A box, cyclic on all sides: a liquid drags the spheres along.
insertion="block { $spheres spacing 0.0025; velocitySpread 0.2; region { type box; min (0 0 0); max (.02 .02 .02); } }"
ends=cyclic sides=cyclic size="0.02 0.02 0.04" cells="5 5 10" rho=1000 nu=1e-6 U="(0.1 0 0.3)"
makeCase
compareRanks cyclic 250 "2 1 1" "1 1 3" "2 1 2"
grep -q 'one block of equal cells' cyclic212/log.felmiFoam

# Two skewed blocks, with air that rises.
insertion="block { $spheres spacing 0.0022; velocitySpread 0.06; region { type box; min (.008 .008 .02); max (.024 .024 .06); } }"
ends=patch sides=wall rho=1.2 nu=1.5e-5 gravity="(0 0 -9.81)" inlet="(0 0 1)" U=$inlet nonOrthogonal=1
rm -rf 0 constant
makeCase
{ header dictionary blockMeshDict
  cat <<END
scale 1;
vertices
(
    (0 0 0) (.03 0 0) (.03 .03 0) (0 .03 0)
    (.004 .002 .05) (.034 -.001 .05) (.03 .034 .05) (0 .03 .05)
    (0 0 .1) (.03 0 .1) (.03 .03 .1) (0 .03 .1)
);
blocks
(
    hex (0 1 2 3 4 5 6 7) (6 7 8) simpleGrading (1.5 1 1.3)
    hex (4 5 6 7 8 9 10 11) (6 7 8) simpleGrading (1.5 1 .7)
);
edges ();
boundary
(
    bottom { type patch; faces ( (0 3 2 1) ); }
    top { type patch; faces ( (8 9 10 11) ); }
    xLow { type wall; faces ( (0 4 7 3)(1 2 6 5)(0 1 5 4)(3 7 6 2)(4 8 11 7)(5 6 10 9)(4 5 9 8)(7 11 10 6) ); }
);
END
} >system/blockMeshDict
blockMesh >log.blockMesh
compareRanks skewed 672 "1 1 2" "2 2 1"
grep -q 'cells, general' skewed221/log.felmiFoam

# a rank without cells still has particles to move
{ header dictionary decomposeParDict
  echo 'numberOfSubdomains 2; method manual; coeffs { dataFile "allToOne"; }'
} >system/decomposeParDict
{ header labelList allToOne; echo "672 { 0 }"; } >constant/allToOne
decomposePar >log.decomposePar
onRanks 2 felmiFoam -parallel >log.felmiFoam 2>&1 || { tail log.felmiFoam; exit 1; }
reconstructPar >log.reconstructPar
mkdir oneHasAll
mv dem $endTime oneHasAll
felmiPython "$PYTHONPATH/foamSame.py" 1e-9 $endTime 0.1 672 skewed111 oneHasAll
