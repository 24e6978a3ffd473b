#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Momentum of everything: in a box that is cyclic in all directions, half filled with spheres that a
# liquid drags along, nothing comes in from outside. Fluid, particles and what is carried between
# them keep their momentum: felmiMAC to rounding, felmiFoam to what its pressure corrections leave
# undone, which shrinks with their number.
. "$(dirname "$0")/foamCase"

ends=cyclic sides=cyclic size="0.02 0.02 0.04" cells="5 5 10" rho=1000 nu=1e-6 density=2500
diameter=0.002 U="(0 0 0.3)" deltaT=1e-3 endTime=0.1 writeInterval=0.1 tolerance=1e-13
lattice 0.0025 "0 0 0" "0.02 0.02 0.02"

run()
{
    mkdir -p "$1"
    (
        cd "$1"
        correctors=$3
        makeCase
        $2 >log.$2
    )
}
run foam felmiFoam 4
run mac felmiMAC 1

PYTHONPATH=$here/tests/cross python3 - <<'END'
import csv
from foamRead import field

volume, rho, U0 = .02 * .02 * .04 / 250, 1000, .3
for folder, bound in ("foam", 1e-5), ("mac", 1e-10):
    rows = [row for row in open(f"{folder}/postProcessing/ledger/ledger.csv") if row[0] != "#"]
    last = list(csv.DictReader(rows))[-1]
    eps = field(f"{folder}/0.1/voidfraction", 250)
    U = field(f"{folder}/0.1/U", 250)
    fluid = sum(rho * e * u[2] * volume for e, u in zip(eps, U))
    solid = float(last["momentum_z"]) + float(last["carried_z"])
    start = rho * U0 * (250 * volume - float(last["particle_volume"]))
    print(f"{folder}: fluid {fluid:.6e} + particles and carried {solid:.6e} N s, "
          f"off by {(fluid + solid) / start - 1:.1e}")
    assert solid > .05 * start, "the particles took nothing up"
    assert abs((fluid + solid) / start - 1) < bound
END
