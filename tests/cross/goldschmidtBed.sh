#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The main job, as its tutorial runs it: both solvers on one case. Time-mean pressure drop within 3 %
# of the net weight over the area, solvers within 2 % in pressure drop and 5 % in bed height, and
# every balance of the ledger below 1e-12 in every step.
set -e
. "$(dirname "$0")/../functions"
copyTutorial goldschmidtBed
./Allrun
for run in foam mac; do
    [ -d $run ] && ledgerBelow 1e-12 $run/postProcessing/ledger/ledger.csv
done
./compare --check $(ls -d foam mac 2>/dev/null)
for picture in history.png bed_mac.png; do
    [ -s $picture ]
done
