#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The command line of felmiDEM and how it ends when something is wrong: status, message, no results.
here=$(cd "$(dirname "$0")/../.." && pwd)
export FELMI_DIR=$here FELMI_BUILD=$1
. "$here/etc/bashrc"
. "$here/tests/functions"
work=$1/unit/felmiDEM
rm -rf "$work"
mkdir -p "$work"
cd "$work" || exit 1
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

if command -v mpirun >/dev/null; then
    fresh
    expect 1 "one rank" mpirun --oversubscribe -n 2 felmiDEM -case case
fi
exit $bad
