#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The feed of a mill as the tutorial runs it: rate, balance to rounding, sizes by mass, shares of
# two species, a trough that vibrates and conveys, an outlet.
set -e
. "$(dirname "$0")/../functions"
felmiPython -c '' || exit 77
copyTutorial millFeed
./Allrun
[ -s balance.png ] && [ -s trough.png ]
