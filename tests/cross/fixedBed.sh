#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The fixed bed of the tutorial: each solver within .5 % of Ergun over a range of velocities.
set -e
. "$(dirname "$0")/../functions"
copyTutorial fixedBed
./Allrun
for run in run/*/*; do
    ledgerBelow 1e-12 "$run/postProcessing/ledger/ledger.csv"
done
./compare --check run/*
[ -s ergun.png ]
