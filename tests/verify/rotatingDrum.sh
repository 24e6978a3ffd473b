#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The drum as the tutorial runs it: a surface of triangles that turns, periodic along its axis.
# Torque on the drum = moment of the bed's weight to 1 %, power of the drum = what the contacts lose
# to 3 %, and rolling resistance makes the slope steeper.
set -e
. "$(dirname "$0")/../functions"
felmiPython -c '' || exit 77
copyTutorial rotatingDrum
./Allrun
[ -s drum.png ] && [ -s drumBalance.png ]
