#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Restart of felmiMAC: a coupled run that was interrupted, or killed at random moments, leaves the
# same files as a straight one, to the last byte: particles, fluid, series and ledger.
. "$(dirname "$0")/../functions"
bad=0
RANDOM=1879
fail() { echo "$*"; bad=1; }

# setControl DIR KEY VALUE
setControl() { sed -i -E "s/^$2 .*/$2 $3;/" "$1/system/controlDict"; }

# same DIR1 DIR2 WHAT: every file of the first is in the second, to the byte
same()
{
    local f
    [ -n "$(ls "$1"/$3 2>/dev/null)" ] || fail "no $1/$3"
    for f in "$1"/$3; do
        cmp "$f" "$2/${f#"$1"/}" || bad=1
    done
}
sameRun()
{
    local what
    for what in "restart/*" "dem/*" "postProcessing/*/*" "0.*/*"; do same "$1" "$2" "$what"; done
}

# bed DIR: the lower part of goldschmidtBed
bed()
{
    mkdir "$1"
    (cd "$1" && copyTutorial goldschmidtBed 0 constant system)
    sed -i 's/0.297/0.03/' "$1/constant/demProperties"
    setControl "$1" startFrom latestTime
    setControl "$1" endTime 0.04
    setControl "$1" writeInterval 0.01
}

# ---- interrupted at an output ---------------------------------------------------------------------
bed straight
expect 0 "End" felmiMAC -case straight
[ "$(cd straight/restart && echo *)" = "0.03.h5 0.04.h5" ] || fail "kept: $(ls straight/restart)"
ledgerBelow 1e-12 straight/postProcessing/ledger/ledger.csv || bad=1
bed parts
setControl parts endTime 0.02
expect 0 "End" felmiMAC -case parts
setControl parts endTime 0.04
expect 0 "Go on from restart/0.02.h5" felmiMAC -case parts
sameRun straight parts
expect 0 "nothing is left to do" felmiMAC -case parts
sameRun straight parts

# ---- steps that follow the flow, a feeder, and restart files at other times than output ------------
adaptive()
{
    bed "$1"
    setControl "$1" adjustTimeStep yes
    setControl "$1" deltaT 1e-4
    setControl "$1" writeInterval 0.012
    cat >>"$1/constant/demProperties" <<'END'
feeders { chute { region { type box; min (-.006 -.03 .06); max (.006 .03 .1); } material glass;
                  size { type uniform; by number; min .002; max .003; } numberRate 3000; begin .003;
                  end .03; } }
END
    printf 'maxCo 0.3;\nrestart { interval 0.0049; keep 0; }\n' >>"$1/system/controlDict"
}
adaptive free
expect 0 "End" felmiMAC -case free
adaptive back
expect 0 "End" felmiMAC -case back
middle=$(ls back/restart | sort -g | sed -n 4p)
setControl back startFrom startTime
setControl back startTime "${middle%.h5}"
expect 0 "Go on from restart/$middle" felmiMAC -case back
sameRun free back
setControl back startTime 0
setControl back endTime 0.001
expect 0 "of an earlier run to restart.old" felmiMAC -case back

# ---- a periodic box whose mean flux is held -------------------------------------------------------
box()
{
    mkdir -p case/0 case/constant case/system
    cp -r "$here"/tutorials/goldschmidtBed/constant/{couplingProperties,transportProperties,g} \
        case/constant
    dictionary system/blockMeshDict dictionary <<'END'
vertices
(
    (0 0 0) (.03 0 0) (.03 .03 0) (0 .03 0) (0 0 .06) (.03 0 .06) (.03 .03 .06) (0 .03 .06)
);
blocks (hex (0 1 2 3 4 5 6 7) (6 6 12) simpleGrading (1 1 1));
edges ();
boundary
(
    top { type cyclic; neighbourPatch bottom; faces ((4 5 6 7)); }
    bottom { type cyclic; neighbourPatch top; faces ((0 3 2 1)); }
    left { type cyclic; neighbourPatch right; faces ((0 4 7 3)); }
    right { type cyclic; neighbourPatch left; faces ((2 6 5 1)); }
    sides { type wall; faces ((0 1 5 4) (2 3 7 6)); }
);
END
    dictionary system/controlDict dictionary <<'END'
startFrom latestTime;
startTime 0;
endTime 0.02;
deltaT 2e-4;
writeControl adjustableRunTime;
writeInterval 0.01;
END
    echo 'felmiMAC { meanFlux (0 0 0.4); tolerance 1e-6; }' | dictionary system/fvSolution dictionary
    dictionary constant/demProperties dictionary <<'END'
contactLaw linear;
materials { glass { density 2500; } }
contacts ( { materials (glass glass); stiffness 200; restitution .9; friction .2; } );
walls { sides { material glass; shape { type box; min (-1 0 -1); max (1 .03 1); inside yes; } } }
insertion { bed { type random; material glass; diameter .002; number 300; velocitySpread .05;
                  region { type box; min (0 0 0); max (.03 .03 .03); } } }
END
    dictionary 0/U volVectorField <<'END'
dimensions [0 1 -1 0 0 0 0];
internalField uniform (0 0 0);
boundaryField { sides { type noSlip; } "top|bottom|left|right" { type cyclic; } }
END
    dictionary 0/p volScalarField <<'END'
dimensions [0 2 -2 0 0 0 0];
internalField uniform 0;
boundaryField { sides { type fixedFluxPressure; value uniform 0; } ".*" { type cyclic; } }
END
    mv case "$1"
}
box periodic
expect 0 "End" felmiMAC -case periodic
box periodic2
setControl periodic2 endTime 0.01
expect 0 "End" felmiMAC -case periodic2
setControl periodic2 endTime 0.02
expect 0 "Go on from restart/0.01.h5" felmiMAC -case periodic2
sameRun periodic periodic2

# ---- what is no file to go on from ----------------------------------------------------------------
cp -r parts broken
setControl broken endTime 0.05
before=$(cd broken && find . -type f | sort | xargs cksum)
printf 'x' | dd of=broken/restart/0.04.h5 bs=1 seek=9999 conv=notrunc 2>/dev/null
expect 1 "broken/restart/0.04.h5: is damaged" felmiMAC -case broken
expect 1 "to go on from restart/0.03.h5 instead" felmiMAC -case broken
cp straight/restart/0.04.h5 broken/restart/
sed -i 's/(2 30 90)/(2 30 45)/' broken/system/blockMeshDict
expect 1 "broken/restart/0.04.h5: its fluid is on another mesh" felmiMAC -case broken
cp straight/system/blockMeshDict broken/system
[ "$before" = "$(cd broken && find . -type f | sort | xargs cksum)" ] || fail "an error lost something"
sed -i 's/^contactLaw .*/contactLaw hertz;/' broken/constant/demProperties
expect 1 "its contact law is linear, that of this simulation hertz" felmiMAC -case broken
cp straight/constant/demProperties broken/constant
rm broken/restart/*
expect 1 "there is no file restart/0.04.h5; accepted" felmiMAC -case broken
setControl broken startFrom startTime
expect 0 "End" felmiMAC -case broken

bed alone
setControl alone endTime 0.0008
setControl alone writeInterval 0.0004
expect 0 "End" felmiDEM -case alone
setControl alone endTime 0.01
expect 1 "restart/0.0008.h5: is of a run of particles alone" felmiMAC -case alone

# ---- killed at random moments ---------------------------------------------------------------------
# Restart file and output in every step, which take most of the time.
bed dense
setControl dense endTime 0.024
setControl dense writeInterval 0.0004
cp -r dense killed
expect 0 "End" felmiMAC -case dense
kills=0 parts=0
for ((try = 0; try < 40 && kills < 8; try++)); do
    before=$(ls killed/restart 2>/dev/null)
    felmiMAC -case killed >log.killed 2>&1 &
    pid=$!
    while [ "$(ls killed/restart 2>/dev/null)" = "$before" ] && kill -0 $pid 2>/dev/null; do
        sleep 0.01
    done
    sleep 0.0$((RANDOM % 90 + 10))
    if kill -KILL $pid 2>/dev/null; then kills=$((kills + 1)); fi
    wait $pid 2>/dev/null
    status=$?
    [ $status = 137 ] || [ $status = 0 ] || { cat log.killed; fail "status $status"; break; }
    ls killed/restart/.*.part >/dev/null 2>&1 && parts=$((parts + 1))
done
echo "killed $kills times, $parts times within a restart file, at $(ls killed/restart | tail -n 1)"
[ $kills = 8 ] || fail "only $kills kills: the run is too short"
expect 0 "End" felmiMAC -case killed
sameRun dense killed
exit $bad
