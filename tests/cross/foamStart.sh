#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What felmiFoam refuses before its first step, with nothing written: a misspelt key, at the line
# where the user wrote it; a wrong value that came by #include and $macro; a missing file; and particles
# of an earlier run whose state is not there. On two ranks likewise, said once, without a hang; and
# ranks without -parallel. Then a good case leaves a cloud that OpenFOAM's own tools read.
. "$(dirname "$0")/foamCase"

lattice 0.0025 "0 0 0.02" "0.02 0.02 0.04"
endTime=0.002
makeCase

# refuses TEXT [COMMAND...]: felmiFoam, or COMMAND, stops with TEXT in its message, said once, and wrote
# nothing
refuses()
{
    local text=$1 before
    shift
    [ $# != 0 ] || set -- felmiFoam
    before=$(ls -R)
    if "$@" >"$work.log" 2>&1; then
        echo "$* ran; expected: $text"
        exit 1
    fi
    [ "$(grep -cF -- "$text" "$work.log")" = 1 ] || {
        tail -n 15 "$work.log"
        echo "expected once: $text"
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
[ "$(felmiFoam -version)" = "$(felmiMAC -version)" ]
felmiFoam -help | grep -q '^writes: U, p,'

# on ranks: what is wrong in the case, and what is wrong with the command
refuses "started on 2 ranks of MPI, but OpenFOAM runs on 1" onRanks 2 felmiFoam
decomposeCase "1 1 2"
cp constant/demProperties good
printf 'timeStop\n{\n    stepsPerPeriod 30;\n}\n' >>constant/demProperties
refuses "demProperties:$(($(wc -l <good) + 3)): timeStop: unknown key" onRanks 2 felmiFoam -parallel
mv good constant/demProperties
refuses "number of processor directories = 2 is not equal to the number of processors = 3" \
    onRanks 3 felmiFoam -parallel
rm -r processor*

runCase
rm restart/*
sed -i 's/startTime 0;/startTime 0.002;/; s/endTime 0.002;/endTime 0.004;/' system/controlDict
refuses "time 0.002 is of an earlier run with particles"
[ "$(grep -c '^(.*) [0-9]*$' 0.002/lagrangian/particles/positions)" = 512 ]
if command -v foamToVTK >/dev/null; then
    foamToVTK -time 0.002 >log.foamToVTK
    grep -q 'Lagrangian.*particles' log.foamToVTK
fi
