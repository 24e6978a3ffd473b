#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Time of the engine on one and two ranks, a bed at rest and one that is stirred: alternately, the
# best of several runs each: demRanks.sh <build directory> [repetitions] [ranks ...]. See README.md.
set -euo pipefail

build=$(cd "${1:?usage: demRanks.sh <build directory> [repetitions] [ranks ...]}" && pwd)
repetitions=${2:-5}
shift 2 2> /dev/null || shift $#
ranks=(1 "${@:-2}")
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
work=$build/tests/bench/demSpeed.d
cmake --build "$build" --target demSpeed demRanks > /dev/null
mkdir -p "$work" && cd "$work"
[ -f bed ] || "$build/tests/bench/demSpeed" settle bed
: > ranks.log
for state in rest stir; do
    for ((k = 0; k < repetitions; k++)); do
        for n in "${ranks[@]}"; do
            mpirun --bind-to core --oversubscribe -np "$n" "$build/tests/bench/demRanks" bed 300 $state |
                tee -a ranks.log
        done
    done
done
awk '{ key = $2 " " $1; if (!(key in best) || $3 < best[key]) best[key] = $3
       if (!(($2) in digest)) digest[$2] = $NF; else if (digest[$2] != $NF) differ = 1 }
     END { for (key in best) { split(key, k, " ")
               printf "%s, %d ranks: %.1f ns a particle and step, %.2f times one rank\n", k[1], k[2],
                      best[key], best[k[1] " 1"] / best[key] }
           print differ ? "positions DIFFER with the number of ranks" : "positions are the same to the bit" }' \
    ranks.log | sort
