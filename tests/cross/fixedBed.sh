#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The fixed bed of the tutorial: each solver within .5 % of Ergun over a range of velocities.
set -e
here=$(cd "$(dirname "$0")/../.." && pwd)
export FELMI_DIR=$here FELMI_BUILD=$1
. "$here/etc/bashrc"
. "$here/tests/functions"

work=$1/cross/fixedBed
rm -rf "$work"
mkdir -p "$work"
cp -r "$here"/tutorials/fixedBed/. "$work"
"$work/Allrun"
cd "$work"
for run in run/*/*; do
    ledgerBelow 1e-12 "$run/postProcessing/ledger/ledger.csv"
done
./compare --check run/*
[ -s ergun.png ]
