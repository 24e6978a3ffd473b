#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The particle phase on several ranks: tests/unit/phaseRanks.c.
set -e
program="${1:?build directory}/tests/unit_phaseRanks"
command -v mpirun >/dev/null || exit 77
# A failure on one rank must end the others, which wait for it: abort, and mpirun does the rest.
export CMOCKA_TEST_ABORT=1
for ranks in 2 3 4; do
    timeout 120 mpirun --oversubscribe -n "$ranks" "$program"
done
