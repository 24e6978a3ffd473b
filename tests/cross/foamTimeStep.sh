#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# felmiFoam with adjustTimeStep: from a step of 1e-5 s the Courant number grows to maxCo and stays
# there, output falls on its times, and with spheres falling through the rising air every balance
# holds while the step changes.
. "$(dirname "$0")/foamCase"

gravity="(0 0 -9.81)" density=2500 sides=wall tolerance=1e-9
inlet="(0 0 1.3)" U=$inlet deltaT=1e-5 endTime=0.06 writeInterval=0.02
lattice 0.0035 "0 0 0.02" "0.02 0.02 0.08"
makeCase
echo 'adjustTimeStep yes; maxCo 0.37; maxDeltaT 1;' >>system/controlDict
runCase

[ "$(ls -d [0-9]* | tr '\n' ' ')" = "0 0.02 0.04 0.06 " ]
PYTHONPATH=$here/tests/cross python3 - <<'END'
from foamRead import solver

rows = solver()
courant = [row["courant"] for row in rows]
steps = [row["deltaT"] for row in rows]
late = courant[len(rows) // 2:]
print(f"{len(rows)} steps of {min(steps):.1e} to {max(steps):.1e} s; Courant number up to "
      f"{max(courant):.4f}, in the second half {min(late):.4f} to {max(late):.4f}")
assert steps[0] < 2e-5
assert max(courant) < .37 * 1.1 and max(late) > .37 * .9
assert abs(sum(steps) / .06 - 1) < 1e-6
END
