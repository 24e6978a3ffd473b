#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The drawing tools draw what they are given, and say what is wrong with what they cannot.
. "$(dirname "$0")/../functions"
felmiPython -c '' || exit 77
bad=0

cp -r "$here"/tutorials/bouncingSpheres/{constant,system} .
sed -i 's/^endTime .*/endTime 0.3;/' system/controlDict
felmiDEM >log.felmiDEM || exit 1

# refused TEXT COMMAND...
refused()
{
    local text=$1 output
    shift
    if output=$("$@" 2>&1) || ! grep -qF -- "$text" <<<"$output" || grep -q Traceback <<<"$output"; then
        echo "$*: '$text' expected in a refusal, found: $output"
        bad=1
    fi
}

# png FILE: it is one, and not blank (a blank one compresses to very little)
png()
{
    [ "$(head -c 4 "$1" | tail -c 3)" = PNG ] && [ "$(stat -c %s "$1")" -gt 8000 ] ||
        { echo "$1: no picture"; bad=1; }
}

felmiPlotParticles . --output a.png --count 3 || bad=1
png a.png
felmiPlotParticles dem -o b.png --times 0.1,0.2 --axes yz --colour vz --range -3 3 --columns 1 || bad=1
png b.png
felmiPlotParticles dem/0.1.h5 -o c.png --slice -0.1 0.1 || bad=1
png c.png
# a wall of triangles: ASCII and binary, scaled, moved by wallForces.csv; its section has the length
# that drawing instruments give
felmiPython - "$here/applications/utilities/plot" <<'END' || bad=1
import os, struct, sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from walls import Wall
quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
corner = np.array([[x, y, z] for z in (0, 30.) for y in (0, 20.) for x in (0, 10.)])
triangles = [corner[[q[i] for i in t]] for q in quads for t in ((0, 1, 2), (0, 2, 3))]
with open("box.stl", "w") as file:
    file.write("solid box\n")
    for t in triangles:
        file.write("facet normal 0 0 0\nouter loop\n")
        file.writelines("vertex %g %g %g\n" % tuple(p) for p in t)
        file.write("endloop\nendfacet\n")
    file.write("endsolid box\n")
with open("binary.stl", "wb") as file:
    file.write(b"solid in spite of its first word".ljust(80) + struct.pack("<I", len(triangles)))
    for t in triangles:
        file.write(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0))
os.makedirs("moved/postProcessing", exist_ok=True)
with open("moved/postProcessing/wallForces.csv", "w") as file:
    file.write("# s\ntime," + ",".join(f"lid.{w}.{a}" for w in ("place", "turn") for a in "xyz"))
    file.write("\n0.1,0,0,0,0,0,0\n0.2,1,2,3,0,0,%.12g\n" % (np.pi / 6))
for name in ("box.stl", "binary.stl"):
    wall = Wall(f"lid={name}*0.001", "moved")
    for time, depth, level, length in ((0, 2, 0.01, 0.06), (0, 0, 0.005, 0.1),
                                       (0.2, 2, 3.01, 0.06)):
        ends = wall.section(time, depth, level)
        found = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
        assert abs(found / length - 1) < 1e-6, (name, time, depth, found, length)
    # the corner (10, 0, 30) mm, turned by 30 degrees about z and shifted
    moved = wall.at(0.2).reshape(-1, 3)
    found = np.abs(moved - [1 + .01 * np.cos(np.pi / 6), 2 + .005, 3.03]).max(axis=1).min()
    assert found < 1e-9, (name, found)
END
felmiPlotParticles dem/0.1.h5 -o e.png --wall floor=box.stl*0.01 || bad=1
png e.png
felmiPlotSeries postProcessing/particles.csv -o d.png --columns centre.z,kineticEnergy+potentialEnergy \
    --mean 0.1 --reference centre.z=0.1 || bad=1
png d.png
felmiPlotSeries postProcessing/wallForces.csv --list | grep -qx floor.z || bad=1

refused "no particles.xmf" felmiPlotParticles system
refused "not a snapshot" felmiPlotParticles system/controlDict
refused "two of x, y, z" felmiPlotParticles dem --axes xx
refused "no column 'height'; there are time, particles" \
    felmiPlotSeries postProcessing/particles.csv -c height
refused "not an STL file" felmiPlotParticles . --wall floor=system/controlDict
refused "accepted is NAME=FILE" felmiPlotParticles . --wall floor=box.stl*millimetres
refused "No such file" felmiPlotSeries nowhere.csv
refused "cannot write" felmiPlotSeries postProcessing/particles.csv -o nowhere/a.png
exit $bad
