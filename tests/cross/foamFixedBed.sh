#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bed of fixed spheres with sharp surfaces in felmiFoam. The pressure drop is that of Ergun's
# equation for the measured void fraction to .5 %; it equals the sum of the fluid's forces on the
# particles to 1e-9; and the pressure falls without wiggles, half a cell's drop at each surface.
. "$(dirname "$0")/foamCase"

# Room enough that the flow is uniform at inlet and outlet, or momentum is lost there.
size="0.01 0.01 0.3" cells="2 2 60"
inlet="(0 0 0.05)" U=$inlet tolerance=1e-14 endTime=16 deltaT=4e-2
lattice 0.0025 "0 0 0.1" "0.01 0.01 0.16"
makeCase
runCase

PYTHONPATH=$here/tests/cross python3 - <<'END'
import math
from foamRead import field, ledger, solver

# Ergun (1952) as pressure drop per length
rho, mu, d, v = 1.2, 1.2 * 1.5e-5, 2.4e-3, .05
area, length = .01 * .01, .06
number = 4 * 4 * 24
eps = 1 - number * math.pi / 6 * d**3 / (area * length)
ergun = (150 * (1 - eps)**2 / eps**3 * mu * v / d**2 + 1.75 * (1 - eps) / eps**3 * rho * v**2 / d)

row = solver()[-1]
drop = row["p_bottom"] - row["p_top"]
error = drop / (ergun * length) - 1
print(f"pressure drop {drop:.8g} Pa, Ergun {ergun * length:.8g} Pa: {100 * error:+.3f} %")
assert abs(error) < 5e-3

force = ledger()[-1]["particle_force_z"] / row["deltaT"]
balance = drop * area / force - 1
print(f"drop x area / sum of forces - 1 = {balance:.2e}")
assert abs(balance) < 1e-9

p = [rho * x for x in field("16/p", 240)]
column = [sum(p[4 * k:4 * k + 4]) / 4 for k in range(60)]
step = [(a - b) / (ergun * .005) for a, b in zip(column, column[1:])]
print("drop from cell to cell / Ergun:", " ".join(f"{s:.4f}" for s in step[17:35]))
assert all(abs(s) < 1e-2 for s in step[:19] + step[32:]), "wiggles outside the bed"
assert all(abs(s - .5) < 2e-2 for s in (step[19], step[31])), "surface"
assert all(abs(s - 1) < 1e-2 for s in step[20:31]), "wiggles in the bed"
END
