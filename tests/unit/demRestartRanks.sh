#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Restart written and read by one to four ranks, each way. Nobody waits for a rank that failed.
set -e
program="${1:?build directory}/tests/unit_demRestartMany"
command -v mpirun >/dev/null || exit 77
# A failure on one rank must end the others, which wait for it: abort, and mpirun does the rest.
export CMOCKA_TEST_ABORT=1
timeout 300 mpirun --oversubscribe -n 4 "$program"
