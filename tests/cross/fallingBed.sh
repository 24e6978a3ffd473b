#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The first 40 ms of goldschmidtBed, while the lattice of spheres falls and nothing is chaotic yet:
# the two solvers, which share no line of the flow solution, agree in the pressure drop within 1 %
# once the start is over, and at every height the mixture's flux eps u + (1 - eps) v is what is
# blown in, 1.875 m/s, within 2 %. The bed falls at .2 m/s then: without the change of the void
# fraction in time the flux would be 3 % off, and the pressure drop 5 %.
set -e
. "$(dirname "$0")/../functions"
command -v felmiFoam >/dev/null || exit 77
for run in foam mac; do
    mkdir $run
    (cd $run && copyTutorial goldschmidtBed 0 constant system)
    sed -i 's/^endTime .*/endTime 0.04;/; s/^writeInterval .*/writeInterval 0.04;/' \
        $run/system/controlDict
done
blockMesh -case foam >foam/log.blockMesh
felmiFoam -case foam >foam/log.felmiFoam
felmiMAC -case mac >mac/log.felmiMAC

felmiPython - <<'PYTHON'
import re
import sys
import numpy as np


def field(path):
    """internal field of an OpenFOAM file, [layer, cell of it, component]"""
    text = open(path).read()
    body = re.search(r"internalField\s+nonuniform List<\w+>\s*(\d+)\s*\((.*?)\n\)", text, re.S)
    numbers = np.array(re.sub("[()]", " ", body.group(2)).split(), float)
    return numbers.reshape(90, 60, -1)


def drop(folder, solver):
    data = np.genfromtxt(f"{folder}/postProcessing/{solver}/solver.csv", delimiter=",", names=True,
                         comments="#")
    return data["p_bottom"] - data["p_top"]


bad = False
foam, mac = drop("foam", "felmiFoam"), drop("mac", "felmiMAC")
apart = np.abs(foam / mac - 1)[5:].max()
print(f"pressure drop at the end {foam[-1]:.1f} and {mac[-1]:.1f} Pa, at most {100 * apart:.2f} % apart")
bad |= not apart < 0.01
for folder in "foam", "mac":
    eps, u, v = (field(f"{folder}/0.04/{name}") for name in ("voidfraction", "U", "Us"))
    flux = (eps * u[..., 2:] + (1 - eps) * v[..., 2:]).mean(axis=(1, 2))
    # by layers of three cells: one cell holds one or two layers of spheres
    flux = flux[3:48].reshape(-1, 3).mean(axis=1)
    print(f"{folder}: mixture's flux in the bed {flux.min():.4f} .. {flux.max():.4f} m/s")
    bad |= not np.abs(flux / 1.875 - 1).max() < 0.02
sys.exit(bad)
PYTHON
