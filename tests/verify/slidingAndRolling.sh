#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Friction and rolling resistance from the dictionaries to the snapshots, as the tutorial runs it:
# the 5/7 and 2/7 rules, the decay by rolling resistance and the motion on a slope to half a per cent.
set -e
. "$(dirname "$0")/../functions"
felmiPython -c '' || exit 77
copyTutorial slidingAndRolling
./Allrun
[ -s slidingAndRolling.png ]
# The balls at rest or rolling straight on press on their lanes with their weight, m g = 0.2103587
# N, and on the slope with m g cos 20 along its normal (sin 20, 0, cos 20).
awk -F, '/^#/ { next }
    !columns { for (i = 1; i <= NF; i++) column[$i] = i; columns = NF; next }
    $1 > 0.4 {
        n++
        flat += $column["slip.z"]
        slope += $column["ice.x"] * sin(.34906585) + $column["ice.z"] * cos(.34906585)
    }
    END {
        e1 = flat / n / -.2103587 - 1
        e2 = slope / n / (-.2103587 * cos(.34906585)) - 1
        print "weight on the flat lane " flat / n " N, error " e1
        print "across the slope " slope / n " N, error " e2
        exit !(e1 * e1 < 1e-6 && e2 * e2 < 1e-6)
    }' run_elasticPlastic/postProcessing/wallForces.csv
