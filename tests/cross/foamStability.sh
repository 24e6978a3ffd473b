#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Air driven by a pressure difference through a box filled with fixed spheres, started 1 % above its
# steady velocity of 1 m/s. Explicit drag (scheme explicit) holds at .95 times its stability limit
# and diverges at 1.05 times it; implicit drag holds at 1000 times. Limit:
#     dt < d^2 rho eps^2 / [(1 - eps) (75 (1 - eps) mu + 1.75 rho eps d u)],
# twice the relaxation time of the velocity under Ergun's drag (method: docs/theory.md).
. "$(dirname "$0")/foamCase"

# Ten pressure correctors, so that convection of the new velocity is converged within a step and
# the velocity obeys the equation of one mass: 1 % times .9^60 and 1.1^60.
size="0.01 0.01 0.02" cells="2 2 4" U="(0 0 1.01)" steps=60 correctors=10
lattice 0.0025 "0 0 0" "0.01 0.01 0.02"
endsU='"(bottom|top)" { type zeroGradient; }'

# limit of the time step, and pressure per density at the bottom
read -r limit pressure <<<"$(python3 - <<'END'
import math
rho, mu, d, u, length = 1.2, 1.2 * 1.5e-5, 2.4e-3, 1.0, .02
eps = 1 - 4 * 4 * 8 * math.pi / 6 * d**3 / (.01 * .01 * length)
limit = d**2 * rho * eps**2 / ((1 - eps) * (75 * (1 - eps) * mu + 1.75 * rho * eps * d * u))
drag = (1 - eps) * (150 * (1 - eps) * mu / (eps * d**2) + 1.75 * rho * u / d) * u
print(f"{limit:.15g} {drag * length / eps / rho:.15g}")
END
)"
endsP="bottom { type fixedValue; value uniform $pressure; } top { type fixedValue; value uniform 0; }"

# run SCHEME FACTOR: prints how far the velocity is from 1 m/s after all steps
run()
{
    scheme=$1
    deltaT=$(python3 -c "print($2 * $limit)")
    endTime=$(python3 -c "print($2 * $limit * $steps)")
    rm -rf [0-9]* dem postProcessing constant system
    makeCase
    if ! felmiFoam >log.$1.$2 2>&1; then
        grep -q 'FLOATING\|Floating\|sigFpe\|felmiFoam stops' log.$1.$2 || {
            tail -n 20 log.$1.$2 >&2
            exit 1
        }
        echo inf
        return
    fi
    PYTHONPATH=$here/tests/cross python3 -c "
import glob
from foamRead import field
time = max((f for f in glob.glob('*/U') if f != '0/U'), key=lambda f: float(f[:-2]))
print(max(abs(u[2] - 1) for u in field(time, 16)))"
}

below=$(run explicit 0.95)
above=$(run explicit 1.05)
implicit=$(run semiImplicit 1000)
echo "limit $limit s; error after $steps steps: explicit at .95 $below, at 1.05 $above;" \
    "implicit at 1000 $implicit"
python3 -c "
assert $below < 1e-3, 'explicit drag does not hold below its limit'
assert float('$above') > .05, 'explicit drag does not diverge above its limit'
assert $implicit < 1e-6, 'implicit drag does not hold'"
