#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Particles pass cyclic patches only: a box whose sides are coupled in another way is refused by
# name, though it is one block of equal cells, where cyclic ones are taken.
. "$(dirname "$0")/foamCase"

sides=cyclic ends=wall endTime=0.001
lattice 0.005 "0 0 0.02" "0.02 0.02 0.08"
makeCase
sed -i -e '/xLow/s/type cyclic;/type cyclicAMI; transform translational; separationVector (.02 0 0);/' \
    -e '/xHigh/s/type cyclic;/type cyclicAMI; transform translational; separationVector (-.02 0 0);/' \
    system/blockMeshDict
sed -i 's/x\(Low\|High\) { type cyclic;/x\1 { type cyclicAMI;/g' 0/U 0/p
blockMesh >log.blockMesh || { tail log.blockMesh; exit 1; }
if felmiFoam >log.felmiFoam 2>&1; then
    echo "cyclicAMI was taken"
    exit 1
fi
grep 'patch xLow is cyclicAMI: of all coupled types particles pass cyclic only' log.felmiFoam || {
    tail -n 20 log.felmiFoam
    exit 1
}
