#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Sampling of surfaces, creation, feeders and outlets on several ranks: the tests that compare ranks
# together with each alone.
set -e
build="${1:?build directory}/tests"
command -v mpirun >/dev/null || exit 77
# A failure on one rank must end the others, which wait for it: abort, and mpirun does the rest.
export CMOCKA_TEST_ABORT=1
for program in demBandRanks demFeedRanks; do
    for ranks in 2 3 4; do
        timeout 120 mpirun --oversubscribe -n "$ranks" "$build/unit_$program"
    done
done
