#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What felmiCheck vouches for: a case of one box is read as felmiMAC reads it, with 0/U, 0/p and
# fvSolution; a case without a box says what was not checked; the last line is true.
. "$(dirname "$0")/../functions"
bad=0

# expect STATUS TEXT: exit status of felmiCheck on the case, and a text in what it prints
expect()
{
    local status=$1 text=$2 got
    felmiCheck -case case >log 2>&1
    got=$?
    if [ $got != "$status" ] || ! grep -qF -- "$text" log; then
        echo "status $got, expected $status; '$text' expected in:"
        tail -n 5 log
        bad=1
    fi
}

# fresh: the main tutorial
fresh()
{
    rm -rf case
    mkdir case
    cp -r "$here"/tutorials/goldschmidtBed/{0,constant,system} case
}

# refused FILE SED TEXT: after this change felmiCheck and felmiMAC say the same
refused()
{
    fresh
    sed -i "$2" "case/$1"
    expect 1 "$3"
    felmiMAC -case case 2>&1 | grep -qF -- "$3" || { echo "felmiMAC does not say '$3'"; bad=1; }
    [ ! -e case/postProcessing ] || { echo "felmiMAC started"; bad=1; }
}

fresh
expect 0 "felmiMAC can run this case."
grep -q '^conditions .*U .* p ' log || { echo "no conditions"; bad=1; }
refused 0/U 's/noSlip/nslip/' "did you mean 'noSlip'?"
refused 0/U 's/^    bottom/    botom/' "did you mean 'bottom'?"
refused 0/p 's/fixedFluxPressure/fixedfluxpressure/' "did you mean 'fixedFluxPressure'?"
refused system/fvSolution 's/^    convection/    convektion/' "did you mean 'convection'?"
refused system/controlDict 's/^deltaT .*/deltaT 10;/' "the explicit viscous term is stable only up to"
grep -q "These are of felmiMAC's reader" log || { echo "felmiFoam could run it"; bad=1; }
fresh
rm case/0/U
expect 1 "0/U: the file cannot be read"

# no box: for felmiFoam, and no guess at particles or cells
fresh
sed -i 's/simpleGrading *(1 1 1)/simpleGrading (1 1 2)/' case/system/blockMeshDict
expect 0 "No mistakes in what was checked."
grep -q 'not checked the mesh' log || { echo "does not say what was not checked"; bad=1; }
sed -i 's/restitution .*/restitution 1.2;/' case/constant/demProperties
expect 1 "restitution: found '1.2'"
fresh
sed -i 's/simpleGrading *(1 1 1)/simpleGrading (1 1 2)/' case/system/blockMeshDict
sed -i 's/^application .*/application felmiMAC;/' case/system/controlDict
expect 1 "felmiCheck: 1 error in the case:"
grep -q 'the cells are not all equal' log || { echo "does not say why"; bad=1; }

# particles alone; without a file g they are weightless
rm -rf case
mkdir case
cp -r "$here"/tutorials/bouncingSpheres/{constant,system} case
expect 0 "felmiDEM can run this case."
rm case/constant/g
expect 0 "gravity    (0 0 0) m/s2"
sed -i 's/^endTime .*/endTime 0.01;/' case/system/controlDict
felmiDEM -case case >log 2>&1 && grep -q 'gravity .*(0 0 0)' log || { tail -n 3 log; bad=1; }

exit $bad
