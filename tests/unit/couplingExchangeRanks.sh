#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The map on several ranks: tests/unit/couplingExchange.c, couplingMemory.c.
set -e
programs=${1:?build directory}/tests
command -v mpirun >/dev/null || exit 77
# A failure on one rank must end the others, which wait for it: abort, and mpirun does the rest.
export CMOCKA_TEST_ABORT=1
for ranks in 2 3 4; do
    timeout 120 mpirun --oversubscribe -n "$ranks" "$programs/unit_couplingExchange"
done
timeout 120 mpirun --oversubscribe -n 2 "$programs/unit_couplingMemory"
