#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Cost and memory of the particle engine by law, sizes, walls and number of particles, one core:
# demScale.sh <build directory> [repetitions] [tiles ...]. See README.md.
set -euo pipefail

build=$(cd "${1:?usage: demScale.sh <build directory> [repetitions] [tiles ...]}" && pwd)
repetitions=${2:-3}
shift 2 2> /dev/null || shift $#
tiles=("${@:-1}")
[ $# -gt 0 ] || tiles=(1 3 6) # 1e5, 9e5 and 3.6e6 particles
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

cmake --build "$build" --target demScale > /dev/null
demScale=$build/tests/bench/demScale
work=$build/tests/bench/demScale.d
mkdir -p "$work" && cd "$work"
for kind in small equal sizes boxed; do
    [ -f $kind.bed ] || "$demScale" settle $kind $kind.bed
done

# Alternately, so that other work on the machine meets all of them alike; then the least of each.
: > log
measure() { "$demScale" cost "$2" "$3" "$4" "$5" "$6" | sed "s/^/$1 /" | tee -a log; }
for ((k = 0; k < repetitions; k++)); do
    measure linear equal.bed linear floor 1 25
    measure hertz equal.bed hertz floor 1 25
    measure sizes sizes.bed linear floor 1 50
    measure two sizes.bed two floor 1 50
    for wall in planes box stl; do measure "$wall" boxed.bed linear $wall 1 25; done
    measure 1e4 small.bed linear floor 1 250
    for t in "${tiles[@]}"; do measure "tiles$t" equal.bed linear floor "$t" $((24 / t + 4)); done
done
awk '{ for (c = 1; c < NF; c++) if ($(c + 1) == "ns" && $c + 0 > 0) { ns = $c; break }
       if (!($1 in best) || ns < best[$1]) best[$1] = ns
       for (c = 1; c < NF; c++) if ($(c + 1) == "bytes") bytes[$1] = $c }
     END { printf "Hertz over linear %.2f, sizes 1:4 over equal ones %.2f, of two materials %.2f\n",
                  best["hertz"] / best["linear"], best["sizes"] / best["linear"], best["two"] / best["linear"]
           printf "box by its shape over planes %.2f, from an STL file %.2f\n", best["box"] / best["planes"], best["stl"] / best["planes"]
           for (key in best) if (key ~ /^tiles/) { t = substr(key, 6)
               printf "%8d particles: %.2f times 1e4, %d bytes each\n", 1e5 * t * t, best[key] / best["1e4"], bytes[key] } }' log
