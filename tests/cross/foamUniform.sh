#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A uniform flow without drag along a step of the void fraction (fixed spheres on one side of the
# box) stays uniform to rounding: convection, time derivative and interpolation agree on eps.
. "$(dirname "$0")/foamCase"

cells="4 4 10" size="0.02 0.02 0.05" drag=none endTime=0.02 U="(0 0 2.385)"
endsU="bottom { type fixedValue; value uniform $U; } top { type zeroGradient; }"
lattice 0.0025 "0 0 0" "0.01 0.02 0.05"
makeCase
runCase

PYTHONPATH=$here/tests/cross python3 - <<'END'
from foamRead import field

eps = field("0.02/voidfraction", 160)
worst = max(abs(u[0]) + abs(u[1]) + abs(u[2] - 2.385) for u in field("0.02/U", 160))
print(f"void fraction {min(eps):.4f} to {max(eps):.4f}, velocity off by {worst:.1e} m/s")
assert max(eps) - min(eps) > .4
assert worst < 1e-12
END
