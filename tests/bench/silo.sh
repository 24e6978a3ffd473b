#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The published silo in full: 100 000 spheres, tens of minutes on one core. verify.demSilo is the
# same with a quarter of the spheres.
#
#     silo.sh <build directory>
set -e
[ $# = 1 ] || { echo "usage: silo.sh <build directory>" >&2; exit 2; }
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
cmake --build "$1" --target verify_demSilo -- --no-print-directory
time "$1/tests/verify_demSilo" full
