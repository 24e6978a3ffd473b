#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# felmiDEM from the dictionaries to the time series: DEM01 as the tutorial runs it. The first bounce of
# both spheres within 1e-3 of the published numbers, and the files a user expects.
set -e
. "$(dirname "$0")/../functions"
copyTutorial bouncingSpheres
felmiPython -c '' || exit 77
./Allrun
[ -s bouncing.png ]
# 40 intervals of output and the start; the series names each of them
[ "$(ls run_e0.9/dem/*.h5 | wc -l)" = 41 ]
[ "$(grep -c '<Time Value=' run_e0.9/dem/particles.xmf)" = 41 ]
# Impulse of the floor over the whole run = momentum gained + weight x time (the law of motion as
# the files tell it): sum F dt = -(p - p0 - M g t), force being that on the floor.
awk -F, 'FNR == NR { if ($1 + 0 > 0) p = $12; next }
    $1 + 0 > 0 { impulse += $4 * ($1 - last); last = $1 }
    END {
        m = 4 / 3 * 3.14159265358979 * .001 * 2600
        expected = -(p + m * 9.80665 * last)
        error = impulse / expected - 1
        print "impulse on the floor " impulse " N s, expected " expected " N s"
        exit !(error < 1e-6 && error > -1e-6)
    }' run_e0.9/postProcessing/particles.csv run_e0.9/postProcessing/wallForces.csv
