#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A library offers what its public header declares and nothing else: every exported symbol carries
# the prefix of its library and stands in the header.
build=${1:?build directory}
cd "$(dirname "$0")/../.." || exit 1
command -v nm >/dev/null || exit 77
status=0 count=0
for library in demC:dem couplingLib:cpl caseLib:case particlePhase:phase; do
    folder=${library%:*} prefix=${library#*:}
    symbols=$(nm -D --defined-only "$build/src/$folder/lib$folder.so" | awk '{ print $3 }')
    [ -n "$symbols" ] || { echo "lib$folder.so exports nothing"; status=1; }
    for symbol in $symbols; do
        count=$((count + 1))
        [[ $symbol == "${prefix}"_* ]] && grep -qw -- "$symbol" "src/$folder/$prefix.h" && continue
        echo "lib$folder.so exports $symbol, which $prefix.h does not declare"
        status=1
    done
done
echo "$count exported symbols looked at"
exit $status
