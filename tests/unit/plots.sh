#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The drawing tools draw what they are given, and say what is wrong with what they cannot.
here=$(cd "$(dirname "$0")/../.." && pwd)
export FELMI_DIR=$here FELMI_BUILD=$1
. "$here/etc/bashrc"
felmiPython -c '' || exit 77
work=$1/unit/plots
rm -rf "$work"
mkdir -p "$work"
cd "$work" || exit 1
bad=0

cp -r "$here"/tutorials/bouncingSpheres/{constant,system} .
sed -i 's/^endTime .*/endTime 0.3;/' system/controlDict
felmiDEM >log.felmiDEM || exit 1

# refused TEXT COMMAND...
refused()
{
    local text=$1 output
    shift
    if output=$("$@" 2>&1) || ! grep -qF -- "$text" <<<"$output" || grep -q Traceback <<<"$output"; then
        echo "$*: '$text' expected in a refusal, found: $output"
        bad=1
    fi
}

# png FILE: it is one, and not blank (a blank one compresses to very little)
png()
{
    [ "$(head -c 4 "$1" | tail -c 3)" = PNG ] && [ "$(stat -c %s "$1")" -gt 8000 ] ||
        { echo "$1: no picture"; bad=1; }
}

felmiPlotParticles . --output a.png --count 3 || bad=1
png a.png
felmiPlotParticles dem -o b.png --times 0.1,0.2 --axes yz --colour vz --range -3 3 --columns 1 || bad=1
png b.png
felmiPlotParticles dem/0.1.h5 -o c.png --slice -0.1 0.1 || bad=1
png c.png
felmiPlotSeries postProcessing/particles.csv -o d.png --columns centre.z,kineticEnergy+potentialEnergy \
    --mean 0.1 --reference centre.z=0.1 || bad=1
png d.png
felmiPlotSeries postProcessing/wallForces.csv --list | grep -qx floor.z || bad=1

refused "no particles.xmf" felmiPlotParticles system
refused "not a snapshot" felmiPlotParticles system/controlDict
refused "two of x, y, z" felmiPlotParticles dem --axes xx
refused "no column 'height'; there are time, particles" \
    felmiPlotSeries postProcessing/particles.csv -c height
refused "No such file" felmiPlotSeries nowhere.csv
refused "cannot write" felmiPlotSeries postProcessing/particles.csv -o nowhere/a.png
exit $bad
