#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Restart of felmiFoam on several ranks. A fluidised bed on two ranks that was interrupted goes on as a
# straight run does, and put together and decomposed anew also on one rank and on four. To rounding: the
# particles are divided by the time that ranks were measured to work, and a cell's sum is taken in the
# order of the ranks. A time that one rank has not written is refused by all.
. "$(dirname "$0")/foamCase"
export PYTHONPATH=$here/tests/cross

diameter=0.0024 density=2500
lattice 0.0028 "0 0 0.002" "0.02 0.02 0.03"
vessel
gravity="(0 0 -9.81)" inlet="(0 0 1.2)" tolerance=1e-15
deltaT=5e-4 endTime=0.02 writeInterval=0.01
makeCase
sed -i 's/startFrom startTime/startFrom latestTime/; s/writePrecision 14/writePrecision 17/' \
    system/controlDict
sed -i 's/tolerance 1e-12; relTol/tolerance 1e-15; relTol/' system/fvSolution

# at FOLDER COMMAND...
at() { (cd "$1" && shift && "$@"); }

endAt() { sed -i "s/endTime [^;]*;/endTime $1;/" system/controlDict; }
onTwo() { onRanks 2 felmiFoam -parallel >log.felmiFoam 2>&1; }

# ---- straight, and in two parts
mkdir straight
cp -r 0 constant system straight
at straight decomposeCase "1 1 2"
cp -r straight parts
at straight onTwo
at parts endAt 0.01
at parts onTwo
cp -r parts half
at parts endAt 0.02
at parts onTwo
grep 'Go on from restart/0.01.h5' parts/log.felmiFoam
at straight reconstructPar >log.reconstructPar
at parts reconstructPar -latestTime >log.reconstructPar

# ---- on other ranks
at half reconstructPar >log.reconstructPar
rm -r half/processor*
for ranks in "1 1 1" "2 2 1"; do
    folder=on${ranks// /}
    cp -r half $folder
    at $folder endAt 0.02
    if [ "$ranks" = "1 1 1" ]; then
        at $folder felmiFoam >log.$folder 2>&1
    else
        at $folder decomposeCase "$ranks"
        at $folder onRanks 4 felmiFoam -parallel >log.$folder 2>&1
        at $folder reconstructPar -latestTime >log.reconstructPar
    fi
    grep 'Go on from restart/0.01.h5' log.$folder
done
for folder in straight parts on111 on221; do
    ledgerBelow 1e-12 $folder/postProcessing/ledger/ledger.csv
    [ "$(grep -c '^0' $folder/postProcessing/ledger/ledger.csv)" = 40 ]
    [ "$(grep -c '^0' $folder/postProcessing/felmiFoam/solver.csv)" = 40 ]
done
felmiPython "$PYTHONPATH/foamSame.py" 1e-9 0.02 0.1 320 straight parts on111 on221

# ---- what one rank misses
rm -r parts/processor1/0.02
at parts endAt 0.03
if at parts onTwo; then
    echo "ran without the fields of a rank"
    exit 1
fi
grep "Start time is not the same for all processors" parts/log.felmiFoam
