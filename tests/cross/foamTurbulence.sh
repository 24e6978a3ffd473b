#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# OpenFOAM's incompressible turbulence models run on the coupled flow: k-epsilon (RAS) and one
# equation of k (LES), a bed fluidised by a jet, ten steps each. They must make a viscosity (other
# flow than laminar), keep k positive, and leave every balance of the ledger closed.
. "$(dirname "$0")/foamCase"

sides=wall size="0.03 0.03 0.06" cells="6 6 12" gravity="(0 0 -9.81)" endTime=0.01
inlet="(0 0 3)" U=$inlet diameter=0.002 density=2500 tolerance=1e-9
lattice 0.0022 "0 0 0" "0.03 0.03 0.03"
vessel

# turbulentField NAME DIMENSIONS VALUE WALL
turbulentField()
{
    header volScalarField $1
    echo "dimensions [$2]; internalField uniform $3; boundaryField {
        bottom { type fixedValue; value uniform $3; }
        top { type inletOutlet; inletValue uniform $3; value uniform $3; }
        \"(x|y)(Low|High)\" { type $4; value uniform $3; } }"
}

mkdir -p 0
for turbulence in laminar RAS,kEpsilon LES,kEqn; do
    turbulentField k "0 2 -2 0 0 0 0" 0.06 kqRWallFunction >0/k
    turbulentField epsilon "0 2 -3 0 0 0 0" 2 epsilonWallFunction >0/epsilon
    turbulentField nut "0 2 -1 0 0 0 0" 0 nutkWallFunction >0/nut
    makeCase
    runCase
    rm -rf $turbulence
    mkdir $turbulence
    mv 0.01 log.felmiFoam $turbulence
    rm -rf dem postProcessing constant/polyMesh
done

PYTHONPATH=$here/tests/cross python3 - <<'END'
from foamRead import field

n = 6 * 6 * 12
laminar = field("laminar/0.01/U", n)
for model in ("RAS,kEpsilon", "LES,kEqn"):
    U = field(model + "/0.01/U", n)
    k, nut = field(model + "/0.01/k", n), field(model + "/0.01/nut", n)
    change = max(abs(a[i] - b[i]) for a, b in zip(U, laminar) for i in range(3))
    print(f"{model}: nut up to {max(nut):.2e} m2/s, velocity differs by up to {change:.3f} m/s")
    assert max(nut) > 1e-6 and min(k) > 0
    assert change > 1e-3
END
