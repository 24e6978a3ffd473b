#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The feed of a mill as the tutorial runs it: rate, balance to rounding, sizes by mass, shares of
# two species, a trough that vibrates and conveys, an outlet.
set -e
here=$(cd "$(dirname "$0")/../.." && pwd)
export FELMI_DIR=$here FELMI_BUILD=$1
. "$here/etc/bashrc"
felmiPython -c '' || exit 77

work=$1/verify/millFeed
rm -rf "$work"
mkdir -p "$work"
cp -r "$here"/tutorials/millFeed/. "$work"
cd "$work"
./Allrun
[ -s balance.png ] && [ -s trough.png ]
