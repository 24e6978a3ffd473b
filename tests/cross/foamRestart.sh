#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Restart of felmiFoam: a fluidised bed in a turbulent flow that was interrupted, or killed at random
# moments, leaves the same files as a straight run, to the last byte, with fields in binary or with 17
# digits. Particles
# without their fluid, or fluid without its particles, are refused.
. "$(dirname "$0")/foamCase"
set +e
bad=0
RANDOM=1868
fail() { echo "$*"; bad=1; }

diameter=0.0024 density=2500
lattice 0.0028 "0 0 0.002" "0.02 0.02 0.03"
vessel
gravity="(0 0 -9.81)" inlet="(0 0 1.2)"
deltaT=5e-4 endTime=0.02 writeInterval=0.005 predictor=yes
turbulence=RAS,kEpsilon
# turbulentField NAME DIMENSIONS VALUE
turbulentField()
{
    header volScalarField "$1"
    echo "dimensions [$2]; internalField uniform $3; boundaryField {
        bottom { type fixedValue; value uniform $3; } $(sidesOf "$1")
        top { type inletOutlet; inletValue uniform $3; value uniform $3; } }"
}

mkdir -p case/0 && cd case || exit 1
turbulentField k "0 2 -2 0 0 0 0" 0.06 >0/k
turbulentField epsilon "0 2 -3 0 0 0 0" 2 >0/epsilon
turbulentField nut "0 2 -1 0 0 0 0" 0 >0/nut
makeCase
sed -i 's/startFrom startTime/startFrom latestTime/; s/writeFormat ascii/writeFormat binary/' \
    system/controlDict
cd "$work" || exit 1

# setControl DIR KEY VALUE
setControl() { sed -i -E "s/\\b$2 [^;]*;/$2 $3;/" "$1"/system/controlDict; }

# same DIR1 DIR2 WHAT: every file of the first is in the second, to the byte
same()
{
    local f differ=0
    [ -n "$(ls "$1"/$3 2>/dev/null)" ] || { echo "no $1/$3"; return 1; }
    for f in "$1"/$3; do
        [ -d "$f" ] || cmp "$f" "$2/${f#"$1"/}" || differ=1
    done
    return $differ
}
sameRun()
{
    local what
    for what in "restart/*" "dem/*" "postProcessing/*/*" "0.*/*" "0.*/lagrangian/particles/*"; do
        same "$1" "$2" "$what" >log.same 2>&1 || { bad=1; head -n 5 log.same; }
    done
}

# sameRows DIR1 DIR2 FROM TO: what solver.csv says of the flow in these times is the same to 1e-9
sameRows()
{
    paste -d, "$1"/postProcessing/felmiFoam/solver.csv "$2"/postProcessing/felmiFoam/solver.csv |
        awk -F, -v from="$3" -v to="$4" -v what="$2" '
        NR > 1 && $1 > from && $1 < to {
            rows++
            for (i = 1; i <= 8; i++) {
                if (i == 4 || i == 5) continue # iterations and residual
                d = ($i - $(i + 8))^2 / ($i^2 + 1e-30)
                if (d > most) most = d
            }
        }
        END { printf "%s: %d rows, largest difference %.1e\n", what, rows, sqrt(most)
              exit !(rows > 2 && most < 1e-18) }' || bad=1
}
run() { felmiFoam -case "$1"; }

# ---- interrupted at an output ---------------------------------------------------------------------
# interrupt NAME: from the case NAME a straight run, and one in two parts
interrupt()
{
    cp -r "$1" "$1.parts"
    expect 0 "End" run "$1"
    ledgerBelow 1e-12 "$1/postProcessing/ledger/ledger.csv" || bad=1
    setControl "$1.parts" endTime 0.01
    expect 0 "End" run "$1.parts"
    setControl "$1.parts" endTime 0.02
    cp -r "$1.parts" "$1.middle"
    expect 0 "Go on from restart/0.01.h5" run "$1.parts"
    sameRun "$1" "$1.parts"
}
cp -r case binary
interrupt binary
[ "$(cd binary/restart && echo *)" = "0.015.h5 0.02.h5" ] || fail "kept: $(ls binary/restart)"
cp -r case ascii
setControl ascii writeFormat ascii
setControl ascii writePrecision 17
interrupt ascii

# ---- on other ranks -------------------------------------------------------------------------------
# From the files of one rank on two: the steps that follow are those of one but for rounding.
(cd binary.middle && decomposeCase "1 1 2" && onRanks 2 felmiFoam -parallel) >log.ranks 2>&1 ||
    { tail -n 5 log.ranks; bad=1; }
grep -q "Go on from restart/0.01.h5" log.ranks || fail "two ranks did not go on"
ledgerBelow 1e-12 binary.middle/postProcessing/ledger/ledger.csv || bad=1
sameRows binary binary.middle 0.0102 0.0122

# ---- back to an earlier time, and what is refused -------------------------------------------------
# refuses TEXT DIR: the run stops with TEXT and leaves everything as it was
refuses()
{
    local before
    before=$(cd "$2" && find . -type f | sort | xargs cksum)
    expect 1 "$1" run "$2"
    [ "$before" = "$(cd "$2" && find . -type f | sort | xargs cksum)" ] || fail "$1: something changed"
}
cp -r ascii back
setControl back endTime 0.025
rm -r back/0.02
refuses "restart/0.02.h5 is later than the latest time, 0.015" back
cp -r ascii/0.02 back
mv back/restart/0.02.h5 .
refuses "no restart/0.02.h5" back
refuses "startFrom startTime; startTime 0.015;" back
head -c 5000 0.02.h5 >back/restart/0.02.h5
refuses "restart/0.02.h5: is truncated" back
refuses "startFrom startTime; startTime 0.015;" back
setControl back startFrom startTime
setControl back startTime 0.015
setControl back endTime 0.02
expect 0 "Moved 1 restart file of an earlier run to restart.old" run back
sameRun ascii back
setControl back startTime 0
setControl back endTime 0.001
expect 0 "Moved 2 restart files" run back

# a run that was killed before it wrote its particles
rm -r back/0.0*
cp -r ascii/0.005 back
rm -r back/0.005/lagrangian
setControl back startFrom latestTime
refuses "no restart/0.005.h5" back
refuses "startFrom startTime; startTime 0;" back

# ---- a step that follows the flow -----------------------------------------------------------------
# OpenFOAM counts what is left to an output from the start: steps differ by rounding.
cp -r case adaptive
echo 'adjustTimeStep yes; maxCo 0.1; maxDeltaT 5e-4;' >>adaptive/system/controlDict
setControl adaptive endTime 0.005
expect 0 "End" run adaptive
cp -r adaptive adaptive.parts
cp -r case adaptive.whole
cp adaptive/system/controlDict adaptive.whole/system
setControl adaptive.whole endTime 0.006
setControl adaptive.whole writeInterval 0.005
expect 0 "End" run adaptive.whole
setControl adaptive.parts endTime 0.006
expect 0 "End" run adaptive.parts
sameRows adaptive.whole adaptive.parts 0.00505 0.006

# ---- killed at random moments ---------------------------------------------------------------------
# Output in every step, which takes most of the time. Killed within it, a run leaves a time without
# the particles' state, and says where to go on from.
cp -r case dense
setControl dense deltaT 1e-4
setControl dense writeInterval 1e-4
setControl dense endTime 0.008
cp -r dense killed
expect 0 "End" run dense
kills=0 within=0
for ((try = 0; try < 40 && kills < 5; try++)); do
    before=$(ls killed/restart 2>/dev/null)
    felmiFoam -case killed >log.killed 2>&1 &
    pid=$!
    while [ "$(ls killed/restart 2>/dev/null)" = "$before" ] && kill -0 $pid 2>/dev/null; do
        sleep 0.01
    done
    sleep 0.0$((RANDOM % 90 + 10))
    if kill -KILL $pid 2>/dev/null; then kills=$((kills + 1)); fi
    wait $pid 2>/dev/null
    status=$?
    if [ $status = 1 ]; then
        from=$(sed -n 's/.*startFrom startTime; startTime \(.*\);/\1/p' log.killed)
        setControl killed startFrom startTime
        setControl killed startTime "${from:?$(cat log.killed)}"
        within=$((within + 1))
    elif [ $status = 137 ] || [ $status = 0 ]; then
        setControl killed startFrom latestTime
    else
        cat log.killed
        fail "status $status"
        break
    fi
done
echo "killed $kills times, $within times within a time, at $(ls killed/restart | tail -n 1)"
[ $kills = 5 ] || fail "only $kills kills: the run is too short"
if ! run killed >log.killed 2>&1; then
    setControl killed startFrom startTime
    setControl killed startTime \
        "$(sed -n 's/.*startFrom startTime; startTime \(.*\);/\1/p' log.killed)"
    expect 0 "End" run killed
fi
sameRun dense killed
exit $bad
