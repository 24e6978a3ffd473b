#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A balance of the ledger above ledgerTolerance ends the run: the fixed bed, whose residuals are those
# of rounding, with a tolerance of 1e-30. Each solver stops in its first step, names the balance and
# leaves the row that shows it.
set -e
. "$(dirname "$0")/../functions"
copyTutorial fixedBed 0 constant system
echo 'velocity (0 0 1);' >velocity
echo 'ledgerTolerance 1e-30;' >>constant/couplingProperties
solvers=felmiMAC
if command -v felmiFoam >/dev/null; then
    blockMesh >log.blockMesh
    solvers="felmiMAC felmiFoam"
fi
for solver in $solvers; do
    rm -rf postProcessing dem
    if $solver >log.$solver 2>&1; then
        echo "$solver ran on"
        exit 1
    fi
    grep 'balance of' log.$solver || { tail -n 5 log.$solver; exit 1; }
    [ "$(grep -c '^[0-9]' postProcessing/ledger/ledger.csv)" = 1 ]
done
