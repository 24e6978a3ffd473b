#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What felmiFoam refuses before its first step, with nothing written: a misspelt key, at the line
# where the user wrote it; a wrong value that came by #include and $macro; a missing file; a parallel
# run; and particles of an earlier run, which it cannot take up yet. Then a good case
# leaves a cloud that OpenFOAM's own tools read.
. "$(dirname "$0")/foamCase"

lattice 0.0025 "0 0 0.02" "0.02 0.02 0.04"
endTime=0.002
makeCase

# refuses TEXT [ARGUMENT...]: the run stops with TEXT in its message, and wrote nothing
refuses()
{
    local text=$1 before
    shift
    before=$(ls -R)
    if felmiFoam "$@" >"$work.log" 2>&1; then
        echo "felmiFoam ran; expected: $text"
        exit 1
    fi
    grep -qF -- "$text" "$work.log" || {
        tail -n 15 "$work.log"
        echo "expected: $text"
        exit 1
    }
    [ "$before" = "$(ls -R)" ] || { echo "something was written"; exit 1; }
    echo "refused: $text"
}

cp constant/demProperties good
{ cat good; printf 'timeStop\n{\n    stepsPerPeriod 30;\n}\n'; } >constant/demProperties
refuses "demProperties:$(($(wc -l <good) + 3)): timeStop: unknown key"
printf 'lowest -0.001;\n' >constant/halves
{ cat good; printf '#include "halves"\ntimeStep\n{\n    maximum $lowest;\n}\n'; } >constant/demProperties
refuses "timeStep.maximum: found '-0.001'"
cp good constant/demProperties
mv constant/couplingProperties aside
refuses "couplingProperties: the file cannot be read"
mv aside constant/couplingProperties
cp constant/transportProperties good
sed -i 's/rho [^;]*;//' constant/transportProperties
refuses "rho: missing; accepted: a number > 0 in kg/m3"
mv good constant/transportProperties
refuses "leave out mpirun and -parallel" -parallel
[ "$(felmiFoam -version)" = "$(felmiMAC -version)" ]
felmiFoam -help | grep -q '^writes: U, p,'

runCase
sed -i 's/startTime 0;/startTime 0.002;/; s/endTime 0.002;/endTime 0.004;/' system/controlDict
refuses "holds the particles of an earlier run"
[ "$(grep -c '^(.*) [0-9]*$' 0.002/lagrangian/particles/positions)" = 512 ]
if command -v foamToVTK >/dev/null; then
    foamToVTK -time 0.002 >log.foamToVTK
    grep -q 'Lagrangian.*particles' log.foamToVTK
fi
