#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A uniform suspension settles in a box that is closed below and above and periodic sideways: void
# fraction .4 and .8, in gas (density ratio 2000), in water (2.6) and nearly buoyant (1.1), with flow
# time steps of .01, 1 and 100 times the relaxation time m/kappa. The slip velocity approaches, without
# growing oscillation, the one at which drag carries the buoyant weight,
#     kappa/V (u - v) = eps (rho_p - rho) g,     eps u + (1 - eps) v = 0,
# to 1 %. Gravity is so weak that the particles move by a thousandth of their diameter in all.
. "$(dirname "$0")/foamCase"

ends=wall sides=cyclic size="0.006 0.006 0.018" cells="2 2 6" drag=DiFelice tolerance=1e-12
predictor=no

cat >setUp.py <<'END'
"""Face-centred cubic suspension: writes positions, prints the numbers of the case."""
import math
import sys

eps, ratio, stiffness = (float(x) for x in sys.argv[1:4])
rho, mu = (1.2, 1.8e-5) if ratio > 100 else (1000., 1e-3)
a = .0015                                    # two unit cells of the lattice a cell of the mesh
d = a * ((1 - eps) * 6 / math.pi / 4) ** (1 / 3)
mass = ratio * rho * math.pi / 6 * d**3
steps = {.01: 800, 1: 200, 100: 100}[stiffness]


def kappa(w):
    """Di Felice (1994) with the pressure gradient shared by both phases."""
    re = eps * rho * w * d / mu
    chi = 3.7 - .65 * math.exp(-(1.5 - math.log10(re))**2 / 2)
    return (.63 + 4.8 / re**.5)**2 * .5 * rho * w * math.pi * d**2 / 4 * eps**(2 - chi)


# The travel of the particles, v = -eps w, sets the slip w, and that sets gravity.
w = 1e-9
for i in range(200):
    dt = stiffness * mass / kappa(w)
    w = 1e-3 * d / (eps * steps * dt)
g = kappa(w) * w / (math.pi / 6 * d**3) / (eps * (ratio - 1) * rho)
spring = mass * (2 * math.pi / 20 / (dt / 5))**2   # no contacts: any that asks for few sub-steps
basis = [(.25, .25, .25), (.75, .75, .25), (.75, .25, .75), (.25, .75, .75)]
points = [((i + b[0]) * a, (j + b[1]) * a, (k + b[2]) * a)
          for k in range(12) for j in range(4) for i in range(4) for b in basis]
with open("constant/positions", "w") as f:
    f.write(f"{len(points)}\n(\n" + "\n".join("(%.17g %.17g %.17g)" % p for p in points) + "\n)\n")
print(rho, mu / rho, repr(d), ratio * rho, repr(dt), steps, repr(g), repr(spring), repr(w))
END

mkdir -p constant
insertion='block { type file; file "constant/positions"; material glass; diameter $diameter; }'
template=$insertion
failed=0
for eps in 0.4 0.8; do
    for ratio in 2000 2.6 1.1; do
        for stiff in 0.01 1 100; do
            rm -rf [0-9]* dem postProcessing constant/polyMesh
            read -r rho nu diameter density deltaT steps g stiffness slip \
                <<<"$(python3 setUp.py $eps $ratio $stiff)"
            gravity="(0 0 -$g)"
            endTime=$(python3 -c "print($steps * $deltaT)")
            insertion=${template/\$diameter/$diameter}
            makeCase
            felmiFoam >log.$eps.$ratio.$stiff 2>&1 || {
                tail -n 5 log.$eps.$ratio.$stiff
                failed=1
                continue
            }
            ledgerBelow 1e-12 postProcessing/ledger/ledger.csv >log.ledger || {
                tail -n 3 log.ledger
                failed=1
            }
            PYTHONPATH=$here/tests/cross python3 - $eps $ratio $stiff $slip <<'END' || failed=1
import glob
import math
import sys
from foamRead import field, ledger

eps, ratio, stiffness, expected = (float(x) for x in sys.argv[1:])
time = max((f[:-2] for f in glob.glob("*/U")), key=float)
U, Us = field(time + "/U", 24), field(time + "/Us", 24)
slip = sum(U[c][2] - Us[c][2] for c in range(8, 16)) / 8
momentum = [row["momentum_z"] for row in ledger()]
tail = momentum[-len(momentum) // 5:]
wobble = (max(tail) - min(tail)) / abs(tail[-1])
overshoot = max(abs(m) for m in momentum) / abs(momentum[-1]) - 1
error = slip / expected - 1
print(f"eps {eps} density ratio {ratio:6g} k dt/m {stiffness:6g}: slip {100 * error:+.3f} %, "
      f"overshoot {100 * overshoot:.2f} %, last fifth varies by {100 * wobble:.3f} %")
assert abs(error) < 1e-2, "slip"
assert wobble < 1e-2 and overshoot < .5, "oscillates"
END
        done
    done
done
exit $failed
