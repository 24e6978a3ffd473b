#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The silo as the tutorial runs it, the widest orifice only: a wall that moves, an outlet, and the
# rate of discharge within 10 % of Beverloo's law, the mass that has left on a straight line.
set -e
. "$(dirname "$0")/../functions"
felmiPython -c '' || exit 77
copyTutorial hopperDischarge
sed -i '/^silo 21/d; /^silo 25/d; /^small=/d; /^waitFor/d; s/21=run_D21 25=run_D25 //' Allrun
./Allrun
[ -s discharge.png ] && [ -s hopper.png ]
