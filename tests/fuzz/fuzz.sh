#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Fuzz one reader: fuzz.sh BUILD SUBJECT [SECONDS]; SUBJECT make only makes the fuzzers.
#
# Without SECONDS a fixed number of inputs from a fixed seed, so that every run is the same; with
# them, for as long, and what was learnt is kept in BUILD/fuzz/corpus for the next time. An input
# that fails is left in BUILD/fuzz/failed, and FUZZER FILE runs it again.
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "${1:?build directory}" && pwd)/fuzz
subject=${2:?subject}
seconds=$3
declare -A runs=([dictionary]=4000 [stl]=40000 [restart]=1200 [samples]=1500)
declare -A longest=([dictionary]=4096 [stl]=2048 [restart]=800 [samples]=85)

if ! clang -fsanitize=fuzzer -x c -o /dev/null - 2>/dev/null <<<'
    int LLVMFuzzerTestOneInput(const unsigned char *data, unsigned long n);
    int LLVMFuzzerTestOneInput(const unsigned char *data, unsigned long n) { return data && n > 99; }'
then
    echo "no clang with libFuzzer here: etc/install-dependencies --test installs it"
    exit 77
fi

if [ "$subject" = make ]; then
    mkdir -p "$build"
    [ -f "$build/Makefile" ] || CC=clang cmake -S "$here/../.." -B "$build" -DFELMI_FUZZ=ON \
        -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="-O1 -fno-math-errno" >"$build/log" || exit 1
    exec cmake --build "$build" -j "$(nproc)" -- --no-print-directory \
        fuzz_dictionary fuzz_stl fuzz_restart fuzz_samples
fi

work=$build/work/$subject
corpus=$work/corpus
rm -rf "$work"
mkdir -p "$corpus" "$build/failed" "$build/corpus/$subject"
"$here/seeds.py" "$subject" "$work/seeds" || exit 1
budget="-runs=${runs[$subject]} -seed=4"
if [ -n "$seconds" ]; then
    corpus=$build/corpus/$subject
    budget="-max_total_time=$seconds"
fi
# keys and words of dictionaries, as they stand in the reader's source
words=
if [ "$subject" = dictionary ]; then
    words=-dict=$work/words
    {
        grep -oh '"[A-Za-z][A-Za-z0-9]*"' "$here"/../../src/caseLib/*.c
        printf '"%s"\n' '{' '}' '(' ')' ';' '$' '${' '#include \"x\"' '#line 9\x0a' '[0 1 0 0 0]' \
            1e999 nan '3{1}' '/*' '*/' '//' 'nonuniform List<vector>' '#calc'
    } | sort -u >"$work/words"
fi
# in memory: files are made and read thousands of times
export TMPDIR=$work
[ -d /dev/shm ] && [ -w /dev/shm ] && TMPDIR=$(mktemp -d /dev/shm/felmiFuzzXXXXXX)
trap '[ "$TMPDIR" = "$work" ] || rm -rf "$TMPDIR"' EXIT
# Requests for absurd amounts of memory are refused, as by any machine, and the readers have to cope.
export ASAN_OPTIONS=allocator_may_return_null=1:max_allocation_size_mb=1000
"$build/tests/fuzz/fuzz_$subject" $budget $words -max_len="${longest[$subject]}" -timeout=20 \
    -rss_limit_mb=3000 -print_final_stats=1 -artifact_prefix="$build/failed/$subject-" \
    "$corpus" "$work/seeds" >"$work/log" 2>&1
status=$?
if [ $status != 0 ]; then
    grep -vE '^#[0-9]+.*(NEW|REDUCE|pulse)' "$work/log" | tail -n 150
    exit 1
fi
grep -E '^#[0-9]+.*(INITED|DONE)|^stat::|^Done' "$work/log"
# a fuzzer that reaches nothing would never fail
grep -qE '^#[0-9]+.*INITED cov: [0-9]{3}' "$work/log" || { echo "hardly any code was reached"; exit 1; }
