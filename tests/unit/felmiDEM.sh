#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The command line of felmiDEM and how it ends when something is wrong: status, message, no results.
. "$(dirname "$0")/../functions"
bad=0

# fresh: a short case
fresh()
{
    rm -rf case
    mkdir case
    cp -r "$here"/tutorials/bouncingSpheres/{constant,system} case
    sed -i 's/^endTime .*/endTime 0.1;/; s/^deltaT .*/deltaT 0.003;/' case/system/controlDict
}

expect 0 "usage: felmiDEM" felmiDEM -help
expect 0 "." felmiDEM -version
expect 2 "unknown argument '-cas'" felmiDEM -cas .
expect 2 "a directory must follow" felmiDEM -case
expect 1 "controlDict" felmiDEM -case nowhere

fresh
expect 0 "End" felmiDEM -case case
# deltaT is shortened so that output every 0.05 s falls on whole steps: 17 steps each
[ "$(ls case/dem | tr '\n' ' ')" = "0.05.h5 0.1.h5 0.h5 particles.xmf " ] || { ls case/dem; bad=1; }
[ "$(grep -c '^Time = ' <(cd case && felmiDEM))" = 34 ] || { echo "not 34 steps"; bad=1; }

fresh
sed -i 's/restitution .*/restitution 1.2;/' case/constant/demProperties
expect 1 "restitution" felmiDEM -case case
[ ! -e case/dem ] || { echo "wrote results of a bad case"; bad=1; }

# Without a floor the sphere falls out of the domain: fatal, with its id.
fresh
sed -i '/^walls/,/^}/d; s/^endTime .*/endTime 1;/' case/constant/demProperties
sed -i 's/^endTime .*/endTime 1;/' case/system/controlDict
expect 1 "particle 0" felmiDEM -case case

# A file where results should go.
fresh
echo >case/dem
expect 1 "case/dem" felmiDEM -case case
fresh
echo >case/postProcessing
expect 1 "postProcessing" felmiDEM -case case

# Nothing at the start, one feeder, one outlet, all balances: what came is there or has gone.
fresh
sed -i 's/^endTime .*/endTime 0.6;/; s/^writeInterval .*/writeInterval 0.3;/' case/system/controlDict
sed -i '/^insertion/,/^}/d; /^walls/,/^}/d; /^timeStep/,/^}/d' case/constant/demProperties
cat >>case/constant/demProperties <<'END'
balance yes;
feeders
{
    rain
    {
        region { type box; min (-0.4 -0.4 0.6); max (0.4 0.4 0.9); }
        numberRate 150;
        end 0.4;
        velocity (0 0 -1);
        material ball;
        size { type uniform; by mass; min 0.02; max 0.05; }
    }
}
outlets
{
    drain { region { type box; min (-0.5 -0.5 -0.2); max (0.5 0.5 0.2); } }
}
END
expect 0 "Created 0 particles" felmiDEM -case case
(cd case && felmiDEM) >log 2>&1
grep -q '  fed 60  removed [1-9]' log || { echo "no counts in the log"; tail -n 5 log; bad=1; }
grep -q 'ball, uniform by mass, 0.02 to 0.05 m' log || { echo "no feeder in the log"; bad=1; }
awk -F, '
    /^time/ { for (i = 1; i <= NF; i++) at[$i] = i; next }
    /^#/ { next }
    {
        rows++
        if ($at["rain.number"] - $at["drain.number"] != $at["domain.number"]) bad = 1
        if ($at["residual"] ^ 2 > ($at["rain.mass"] * 1e-13) ^ 2) bad = 1
        last = $at["rain.number"]
        gone = $at["drain.number"]
    }
    END { if (bad || !rows || last != 60 || !gone) { print rows, last, gone, bad; exit 1 } }
' case/postProcessing/massBalance.csv || { echo "massBalance.csv is wrong"; bad=1; }
[ "$(sed -n 3p case/postProcessing/energy.csv | tr -cd , | wc -c)" = 11 ] || { echo "energy.csv"; bad=1; }
[ "$(sed -n 3p case/postProcessing/angularMomentum.csv | tr -cd , | wc -c)" = 12 ] ||
    { echo "angularMomentum.csv"; bad=1; }

# A step that is too large is refused with the limit.
fresh
sed -i 's/maximum .*/fixed 0.1;/' case/constant/demProperties
expect 1 "fixed" felmiDEM -case case
exit $bad
