#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# MFiX's case DEM06: a sphere of 100 um, 2000 kg/m3, released at rest in air that rises at .40 m/s,
# Schiller and Naumann's drag. Velocity against time within .5 % of the terminal velocity of
# tests/verify/data/mfix_dem06_vel.csv. Cells are so wide that the sphere does not feel its own
# wake: it slows the air of its cell by F/(rho U^2 A), 1e-4.
. "$(dirname "$0")/foamCase"

size="0.06 0.06 0.12" cells="3 3 6" nu=1.5e-5 gravity="(0 0 -9.80665)"
U="(0 0 0.4)" inlet=$U drag=SchillerNaumann endTime=0.35 deltaT=2.5e-4 tolerance=1e-10
diameter=1e-4 density=2000
lattice 0.01 "0.025 0.025 0.095" "0.035 0.035 0.105"
makeCase
runCase

PYTHONPATH=$here/tests/cross python3 - "$here" <<'END'
import csv
import math
import sys
from foamRead import ledger

mass = 2000 * math.pi / 6 * 1e-4**3
path = sys.argv[1] + "/tests/verify/data/mfix_dem06_vel.csv"
reference = [(float(r["t"]), float(r["exact_rk4"])) for r in csv.DictReader(open(path))]
steps = {round(row["time"], 6): row["momentum_z"] / mass for row in ledger()}
terminal = -.05740169
worst = max(abs(steps[round(t, 6)] - v) for t, v in reference if t > 0)
print(f"velocity at .35 s {steps[.35]:.6f} m/s, largest error {100 * worst / abs(terminal):.3f} %"
      " of the terminal velocity")
assert worst < 5e-3 * abs(terminal)
END
