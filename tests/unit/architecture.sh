#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Dependencies point one way (docs/design.md): who may include whose header.
cd "$(dirname "$0")/../.." || exit 1
status=0

# forbid PATTERN FILE...: no include or use of PATTERN in the files
forbid() {
    local pattern=$1
    shift
    if grep -nE "$pattern" "$@"; then
        echo "not allowed above: $pattern"
        status=1
    fi
}

include='#[[:space:]]*include[[:space:]]*[<"]'
forbid "$include(cpl|case|phase)\.h|${include}fv" src/demC/*.[ch]
forbid "$include(dem|case|phase)\.h|${include}(fv|foam)" src/couplingLib/*.[ch]
forbid "${include}phase\.h" src/caseLib/*.[chly]
forbid "${include}case\.h" src/particlePhase/*.[ch]
forbid 'MPI_COMM_WORLD' src/*/*.[chly]
forbid "$include(hdf5|gsl)" src/*/dem.h src/*/cpl.h src/*/phase.h src/*/case.h
# the programs stay behind the public headers of the engine
forbid "${include}dem_internal\.h" applications/*/*/*.[chC] src/particlePhase/*.[ch] src/caseLib/*.[ch]
[ $status = 0 ] && echo "includes as designed"
exit $status
