#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# felmiMAC from the command line: a channel without particles reaches its parabola, output falls on
# the right times and OpenFOAM's tools read it; wrong conditions stop it with their message.
. "$(dirname "$0")/../functions"
bad=0

# channel: length .2, height .01 m, 24 Pa over it, rho 1.3, nu 1e-3: mean velocity .7692 m/s
channel()
{
    rm -rf case
    mkdir -p case/0 case/constant case/system
    dictionary system/blockMeshDict dictionary <<'END'
vertices
(
    (0 0 0) (.2 0 0) (.2 .01 0) (0 .01 0) (0 0 .01) (.2 0 .01) (.2 .01 .01) (0 .01 .01)
);
blocks (hex (0 1 2 3 4 5 6 7) (4 20 1) simpleGrading (1 1 1));
edges ();
boundary
(
    outlet { type patch; faces ((1 2 6 5)); }
    plates { type wall; faces ((2 3 7 6) (0 1 5 4)); }
    inlet { type patch; faces ((3 0 4 7)); }
    sides { type empty; faces ((0 1 2 3) (4 5 6 7)); }
);
END
    dictionary system/controlDict dictionary <<'END'
application felmiMAC;
startFrom startTime;
startTime 0;
stopAt endTime;
endTime .12;
deltaT 1e-4;
writeControl adjustableRunTime;
writeInterval .05;
adjustTimeStep yes;
maxCo .5;
END
    dictionary system/fvSolution dictionary <<'END'
felmiMAC { tolerance 1e-10; convection central; }
END
    dictionary system/fvSchemes dictionary <<'END'
ddtSchemes { default Euler; }
gradSchemes { default Gauss linear; }
divSchemes { default none; }
laplacianSchemes { default Gauss linear corrected; }
interpolationSchemes { default linear; }
snGradSchemes { default corrected; }
END
    dictionary constant/transportProperties dictionary <<'END'
transportModel Newtonian;
rho 1.3;
nu 1e-3;
END
    dictionary 0/U volVectorField <<'END'
dimensions [0 1 -1 0 0 0 0];
internalField uniform (0 0 0);
boundaryField
{
    outlet { type inletOutlet; inletValue uniform (0 0 0); value uniform (0 0 0); }
    plates { type noSlip; }
    inlet { type zeroGradient; }
    sides { type empty; }
}
END
    dictionary 0/p volScalarField <<'END'
dimensions [0 2 -2 0 0 0 0];
internalField uniform 0;
boundaryField
{
    outlet { type fixedValue; value uniform 0; }
    plates { type fixedFluxPressure; value uniform 0; }
    inlet { type fixedValue; value uniform 18.461538461538462; }
    sides { type empty; }
}
END
}

# meanVelocity SIDES CELLS: dp H^2/(12 mu L), times 1 + 2/n^2 on n cells (mirrored ghost), to 1e-4
meanVelocity()
{
    awk -F'[( )]' -v sides="$1" -v cells="$2" '
        /^\([-0-9]/ && !done { sum += $2; n++ } /^\)/ { done = 1 } END {
        mean = 24 * .01^2 / (12 * 1.3e-3 * .2) * (1 + 2 / 20^2)
        printf "channel, sides %s: mean velocity of %d cells %.6f m/s, %.6f expected\n", sides, n,
            sum / n, mean
        exit !(n == cells && (sum / n / mean - 1)^2 < 1e-8) }' case/0.12/U || bad=1
}

expect 0 "usage: felmiMAC" felmiMAC -help
expect 0 "." felmiMAC -version
expect 2 "unknown argument '-cas'" felmiMAC -cas .
expect 2 "a directory must follow" felmiMAC -case
expect 1 "controlDict" felmiMAC -case nowhere

channel
expect 0 "End" felmiMAC -case case
# output at its own interval, and at the end
times=$(cd case && ls -d [0-9]* | tr '\n' ' ')
[ "$times" = "0 0.05 0.1 0.12 " ] || { echo "times: $times"; bad=1; }
[ -e case/0.1/voidfraction ] && { echo "void fraction without particles"; bad=1; }
head -n 1 case/postProcessing/felmiMAC/solver.csv |
    grep -qx "time,deltaT,courant,iterations,residual,p_outlet,p_inlet,height" ||
    { head -n 1 case/postProcessing/felmiMAC/solver.csv; bad=1; }
meanVelocity empty 80

if command -v blockMesh >/dev/null && command -v postProcess >/dev/null; then
    (cd case && blockMesh && postProcess -func "patchAverage(name=inlet,U)" -latestTime) >log 2>&1 ||
        { tail -n 5 log; bad=1; }
    average=$(sed -n 's/.*areaAverage(inlet) of U = (\([^ ]*\) .*/\1/p' log)
    awk -v u="$average" 'BEGIN { exit !(u > .76 && u < .78) }' ||
        { echo "OpenFOAM reads '$average' m/s at the inlet"; bad=1; }
fi

# The same flow between other sides without friction, two cells across.
for type in slip symmetry symmetryPlane cyclic; do
    channel
    patch=$type u=$type p=$type
    [ $type = slip ] && patch=patch p=zeroGradient
    sed -i 's/(4 20 1)/(4 20 2)/' case/system/blockMeshDict
    if [ $type = cyclic ]; then
        sed -i 's/^ *sides .*/back { type cyclic; neighbourPatch front; faces ((0 1 2 3)); }\
            front { type cyclic; neighbourPatch back; faces ((4 5 6 7)); }/' case/system/blockMeshDict
        sed -i 's/sides {/"back|front" {/' case/0/U case/0/p
    else
        sed -i "s/sides { type empty/sides { type $patch/" case/system/blockMeshDict
    fi
    sed -i "s/type empty/type $u/" case/0/U
    sed -i "s/type empty/type $p/" case/0/p
    expect 0 "End" felmiMAC -case case
    meanVelocity $type 160
done

channel
sed -i 's/noSlip/noSlp/' case/0/U
expect 1 "did you mean 'noSlip'?" felmiMAC -case case
channel
sed -i 's/inlet { type fixedValue/inlet { type zeroGradient/' case/0/p
expect 1 "U of type zeroGradient leaves the velocity to the pressure" felmiMAC -case case
channel
sed -i 's/plates { type fixedFluxPressure/plates { type fixedValue/' case/0/p
expect 1 "U of type noSlip gives the velocity, and p of type fixedValue" felmiMAC -case case
channel
sed -i 's/sides { type empty/sides { type symmetry/' case/0/U
expect 1 "but the patch is empty in blockMeshDict" felmiMAC -case case
channel
sed -i 's/adjustTimeStep yes/adjustTimeStep no/; s/deltaT .*/deltaT 1e-3;/' case/system/controlDict
expect 1 "the explicit viscous term is stable only up to" felmiMAC -case case
channel
sed -i 's/convection central;/convektion central;/' case/system/fvSolution
expect 1 "did you mean 'convection'?" felmiMAC -case case
channel
sed -i 's/tolerance/meanFlux (1 0 0); tolerance/' case/system/fvSolution
expect 1 "the x direction is not periodic" felmiMAC -case case
channel
sed -i 's/plates {/platse {/' case/0/U
expect 1 "boundaryField.platse: no patch of the mesh has this name; did you mean 'plates'?" \
    felmiMAC -case case
# digits of fields as the case says
channel
sed -i 's/^endTime .*/endTime 1e-3;/; s/^maxCo .*/maxCo .5; writePrecision 3;/' case/system/controlDict
expect 0 "End" felmiMAC -case case
grep -q '^([0-9.e-]*[.][0-9]' case/0.001/U || { echo "no fractions"; bad=1; }
grep -E '^\(' case/0.001/U | grep -E '[1-9][0-9]{3}[0-9.]* ' && { echo "more than 3 digits"; bad=1; }
# A Courant number of about 200 in the first step is no flow: one message, one prefix, below the log.
channel
sed -i 's/adjustTimeStep yes/adjustTimeStep no/; s/^deltaT .*/deltaT 1e-2;/' case/system/controlDict
sed -i 's/^nu .*/nu 1e-6;/' case/constant/transportProperties
sed -i 's/inlet { .*/inlet { type fixedValue; value uniform (1000 0 0); }/' case/0/U
sed -i 's/inlet { .*/inlet { type zeroGradient; }/' case/0/p
expect 1 "the Courant number has grown to" felmiMAC -case case
felmiMAC -case case >log 2>&1
[ "$(grep -n '^felmiMAC: time' log | cut -d: -f1)" = "$(wc -l <log)" ] || { tail -n 3 log; bad=1; }
# both ends of given velocity, unequal: the box would fill up
channel
sed -i 's/inlet { .*/inlet { type fixedValue; value uniform (1 0 0); }/
        s/outlet { .*/outlet { type fixedValue; value uniform (.5 0 0); }/' case/0/U
sed -i 's/let { .*/let { type fixedFluxPressure; value uniform 0; }/' case/0/p
expect 1 "the box has no side of given pressure" felmiMAC -case case

exit $bad
