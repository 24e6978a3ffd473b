#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What a flow step of goldschmidtBed costs: felmiFoam, DPMFoam and felmiMAC in one run.
#
# Same mesh, flow step 2e-5 s, Hertz's law (E 1e8 Pa, nu .35), same tolerances, same number of DEM
# sub-steps (DPMFoam's own count, which the others are given). felmiFoam fluidises the bed for .2 s;
# from that state, particles with their velocities and the air, felmiFoam and DPMFoam take the same
# steps, on one core and then on two, the mesh cut across its width. felmiMAC starts from the same
# positions at rest. DPMFoam's and felmiFoam's times are CPU seconds of one process, on two cores of the
# first one, which waits by computing; the parts of a step and felmiMAC's sum are wall clock.
#
#     goldschmidt.sh [BUILD_FOLDER [STEPS [CORES]]]        CORES: "1 2", or 1
set -e
here=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "${1:-$here/build}" && pwd)
steps=${2:-100}
cores=${3:-1 2}
export FELMI_DIR=$here FELMI_BUILD=$build
. "$here/etc/bashrc"
start=0.2 deltaT=2e-5
for program in felmiFoam DPMFoam blockMesh; do
    command -v $program >/dev/null || { echo "no $program here: skipped"; exit 77; }
done
example=${FOAM_TUTORIALS:-/usr/share/doc/openfoam-examples/examples}/lagrangian/DPMFoam/Goldschmidt
[ -d "$example" ] || { echo "no $example (package openfoam-examples): skipped"; exit 77; }

work=$build/bench/goldschmidt
rm -rf "$work"
mkdir -p "$work"
cd "$work"

# run FOLDER PROGRAM
run()
{
    (cd "$1" && "$2" >"log.$2" 2>&1) || { tail -n 20 "$1/log.$2"; exit 1; }
}

# ---- felmiFoam: the state and its own steps -------------------------------------------------------
felmiCase()
{
    mkdir -p "$1"
    cp -r "$here"/tutorials/goldschmidtBed/{0,constant,system} "$1"
    sed -i 's/^contactLaw.*/contactLaw hertz;/' "$1/constant/demProperties"
    echo "timeStep { maximum $2; }" >>"$1/constant/demProperties"
    # solvers and tolerances of DPMFoam's tutorial
    python3 - "$1/system/fvSolution" "$example/system/fvSolution" <<'END'
import re
import sys
block = re.compile(r"^solvers\s*\{.*?^\}", re.S | re.M)
ours, theirs = (open(path).read() for path in sys.argv[1:])
solvers = block.search(theirs).group(0).replace("kinematicCloud:theta", "pcorr").replace("U.air", "U")
open(sys.argv[1], "w").write(block.sub(lambda m: solvers, ours))
END
}

# subSteps LOG: DPMFoam's sub-steps a flow step
subSteps()
{
    awk '/move-collide subCycles/ { n = $1 } END { print n ? n : 1 }' "$1"
}

end=$(python3 -c "print($start + $steps * $deltaT)")
expected=5  # sub-steps of DPMFoam with its tutorial's collisionResolutionSteps; checked below
felmiCase foam "$(python3 -c "print(1.000001 * $deltaT / $expected)")"
python3 - "$here" $start $deltaT $end <<'END'
import re
import sys
here, start, delta, end = sys.argv[1], *sys.argv[2:]
path = "foam/system/controlDict"
text = open(path).read()
for key, value in (("deltaT", "5e-4"), ("endTime", end), ("writeInterval", start),
                   ("writePrecision", "14"), ("timePrecision", "12"), ("adjustTimeStep", "yes"),
                   ("maxCo", "1e3")):
    text = re.sub(rf"^{key}\b.*$", f"{key} {value};", text, flags=re.M)
text += f"""
maxDeltaT 5e-4;
functions
{{
    step
    {{
        type setTimeStep;
        libs ("libutilityFunctionObjects.so");
        deltaT table ((0 5e-4) ({float(start) - 1e-9:.12g} 5e-4) ({start} {delta}));
    }}
}}
"""
open(path, "w").write(text)
END
run foam blockMesh
run foam felmiFoam

# ---- DPMFoam from the same state ------------------------------------------------------------------
mkdir dpm
cp -r "$example"/{0,constant,system} dpm
find dpm -name '*.gz' -exec gunzip {} +
python3 - $start <<'END'
import re
import sys

state = "foam/" + sys.argv[1] + "/"
number = r"\(([^()]*)\)"


def rows(path):
    text = open(path).read()
    return [r for r in re.findall(number, text[text.index("}"):])]


positions, velocities = rows(state + "lagrangian/particles/positions"), rows(state + "lagrangian/particles/U")
assert len(positions) == len(velocities) > 1000
header = "FoamFile { version 2.0; format ascii; class %s; object %s; }\n"
with open("dpm/constant/kinematicCloudPositions", "w") as f:
    f.write(header % ("vectorField", "kinematicCloudPositions"))
    f.write(f"{len(positions)}\n(\n" + "".join(f"({p})\n" for p in positions) + ")\n")
open("velocities", "w").write("\n".join(velocities))

# the air: fields of felmiFoam between the boundary conditions of the example
for name, source in (("U.air", "U"), ("p", "p")):
    text = open("dpm/0/" + name).read()
    field = open(state + source).read()
    inner = re.search(r"internalField.*?(?=\n\s*boundaryField)", field, re.S).group(0)
    text = re.sub(r"internalField[^;]*;", lambda m: inner, text, count=1)
    text = text.replace("$internalField", "uniform 0").replace("binary", "ascii")
    open("dpm/0/" + name, "w").write(text)
END
control()
{
    sed -i "s/^deltaT .*/deltaT $1;/; s/^endTime .*/endTime $2;/; s/^startFrom .*/startFrom startTime;/
        s/^writeControl .*/writeControl timeStep;/; s/^writeInterval .*/writeInterval $3;/
        s/^writeFormat .*/writeFormat ascii;/; s/^writePrecision .*/writePrecision 14;/
        s/^timePrecision .*/timePrecision 12;/" dpm/system/controlDict
}
# one step of 1 ns makes a cloud of the positions; the velocities are then put into its file
control 1e-9 1e-9 1
run dpm blockMesh
run dpm DPMFoam
mv dpm/1e-09/lagrangian dpm/0/
rm -rf dpm/1e-09
python3 - <<'END'
import re
cloud = "dpm/0/lagrangian/kinematicCloud/"
velocities = open("velocities").read().split("\n")
text = open(cloud + "origId").read()
ids = [int(i) for i in re.search(r"\n\d+\s*\(\s*([\d\s]+)\)", text).group(1).split()]
assert sorted(ids) == list(range(len(velocities)))
head = open(cloud + "U").read()
head = head[:head.index("}") + 1]
open(cloud + "U", "w").write(head + f"\n{len(ids)}\n(\n" + "".join(f"({velocities[i]})\n" for i in ids) + ")\n")
path = "dpm/constant/kinematicCloudProperties"
text = open(path).read()
start = text.index("injectionModels")
depth, end = 0, text.index("{", start)
while True:
    depth += {"{": 1, "}": -1}.get(text[end], 0)
    end += 1
    if depth == 0:
        break
open(path, "w").write(text[:start] + "injectionModels {}" + text[end:])
END
control $deltaT "$(python3 -c "print($steps * $deltaT)")" $steps
run dpm DPMFoam
substeps=$(subSteps dpm/log.DPMFoam)

# ---- felmiFoam again where it took another number of sub-steps ---------------------------------------
if [ "$substeps" != $expected ]; then
    sed -i "s/^timeStep .*/timeStep { maximum $(python3 -c "print(1.000001 * $deltaT / $substeps)"); }/" \
        foam/constant/demProperties
    (cd foam && rm -rf 0.* dem postProcessing)
    run foam felmiFoam
fi

# ---- both on two cores, from the same state ---------------------------------------------------------
# A rank that waits lets others compute: on a busy machine these would be the other rank.
export OMPI_MCA_mpi_yield_when_idle=1
# onTwo FOLDER PROGRAM TIME
onTwo()
{
    cat >"$1/system/decomposeParDict" <<'END'
FoamFile { version 2.0; format ascii; class dictionary; object decomposeParDict; }
numberOfSubdomains 2;
method simple;
coeffs { n (1 2 1); }
END
    (cd "$1" && decomposePar -time "$3" >log.decomposePar 2>&1) || { tail "$1/log.decomposePar"; exit 1; }
    (cd "$1" && mpirun -np 2 "$2" -parallel >"log.$2" 2>&1) || { tail -n 20 "$1/log.$2"; exit 1; }
}

if [[ " $cores " == *" 2 "* ]] && command -v mpirun >/dev/null; then
    mkdir -p foam2/restart dpm2
    cp -r foam/{0,$start,constant,system} foam2
    cp foam/restart/$start.h5 foam2/restart
    rm -rf foam2/$start/lagrangian
    sed -i "s/^startFrom .*/startFrom startTime;/; s/^startTime .*/startTime $start;/" \
        foam2/system/controlDict
    onTwo foam2 felmiFoam $start
    cp -r dpm/{0,constant,system} dpm2
    onTwo dpm2 DPMFoam 0
fi

# ---- felmiMAC ---------------------------------------------------------------------------------------
if command -v felmiMAC >/dev/null; then
    felmiCase mac "$(python3 -c "print(1.000001 * $deltaT / $substeps)")"
    cp dpm/constant/kinematicCloudPositions mac/constant/positions
    python3 - $deltaT "$(python3 -c "print(3 * $steps * $deltaT)")" <<'END'
import re
import sys
path = "mac/constant/demProperties"
text = open(path).read()
i = text.index("insertion ")
j = text.index("timeStep")
text = text[:i] + """insertion { bed { type file; file "constant/positions"; material glass;
    diameter 0.0025; } }
""" + text[j:]
open(path, "w").write(text)
path = "mac/system/controlDict"
text = open(path).read()
for key, value in (("deltaT", sys.argv[1]), ("endTime", sys.argv[2]), ("writeInterval", sys.argv[2])):
    text = re.sub(rf"^{key}\b.*$", f"{key} {value};", text, flags=re.M)
open(path, "w").write(text)
END
    run mac felmiMAC
fi

python3 - $steps "$substeps" $deltaT <<'END'
import os
import re
import sys

steps, substeps, delta = int(sys.argv[1]), sys.argv[2], float(sys.argv[3])


def cpu(path):
    """CPU seconds a step over the last steps but one of an OpenFOAM log."""
    times = [float(t) for t in re.findall(r"ExecutionTime = ([\d.]+) s", open(path).read())]
    return (times[-1] - times[-steps]) / (steps - 1)


def shares(path):
    """Mean of the parts of a step, ms, from our line of the log, and their shares."""
    pattern = r"\[dem ([\d.]+) map ([\d.]+) (?:exchange ([\d.]+) )?drag ([\d.]+) fluid ([\d.]+) ms\]"
    rows = [[float(x or 0) for x in r] for r in re.findall(pattern, open(path).read())][-steps:]
    mean = [sum(c) / len(rows) for c in zip(*rows)]
    names = ("dem", "map", "exchange", "forces", "fluid")
    text = ", ".join(f"{n} {x:.1f} = {100 * x / sum(mean):.0f} %" for n, x in zip(names, mean))
    return sum(mean), text


print(f"goldschmidtBed, 24750 spheres, 5400 cells, flow step {delta:g} s, {substeps} DEM sub-steps")
for cores, suffix in ((1, ""), (2, "2")):
    if not os.path.exists(f"foam{suffix}/log.felmiFoam"):
        continue
    foam, dpm = cpu(f"foam{suffix}/log.felmiFoam"), cpu(f"dpm{suffix}/log.DPMFoam")
    print(f"{cores} core{'s' if cores > 1 else ''}")
    print(f"    DPMFoam   {1e3 * dpm:8.1f} ms a step")
    print(f"    felmiFoam {1e3 * foam:8.1f} ms a step ({shares(f'foam{suffix}/log.felmiFoam')[1]})")
    print(f"    felmiFoam is {dpm / foam:.1f} times as fast as DPMFoam")
if os.path.exists("mac/log.felmiMAC"):
    all_parts, text = shares("mac/log.felmiMAC")
    print(f"felmiMAC on 1 core: {all_parts:.1f} ms a step ({text})")
END
