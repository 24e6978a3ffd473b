#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Bad input stops every program before its first step, with the message a user needs.
#
#     badInput.sh <build directory>
#
# Each folder here is a case: files laid over tutorials/goldschmidtBed, of which the good ones stay
# beside them as <name>.good, to be included and then overridden. In it
#     expected             lines that must stand in the output
#     expected.<program>   instead of these for one program
#     programs             the programs that can see this mistake; absent: all
#     remove               files of the base to remove
# Where felmiFoam reads through OpenFOAM, lines are those of OpenFOAM's reader: for it the part of an
# expected line before ": " (file:line) is compared without the line.
build=$1
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
base=$here/../../tutorials/goldschmidtBed
. "$here/../../etc/bashrc"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0 runs=0

complain()
{
    echo "$*"
    failures=$((failures + 1))
}

# where <program>: its path, nothing when it was not built
where()
{
    local path
    for path in "$build/applications/solvers/$1/$1" "$build/applications/utilities/$1/$1"; do
        if [ -x "$path" ]; then echo "$path"; return; fi
    done
    if [ "$1" = felmiFoam ]; then command -v felmiFoam; fi
}

# set_up <case> <directory>
set_up()
{
    local file
    cp -r "$mesh" "$2"
    (cd "$here/$1" && find . -type f -path './*/*') | while read -r file; do
        if [ -e "$2/$file" ]; then mv "$2/$file" "$2/$file.good"; fi
        mkdir -p "$(dirname "$2/$file")"
        case $file in
            */triSurface/*) cp "$here/$1/$file" "$2/$file"; continue ;;
        esac
        # OpenFOAM wants a header; on the first line, so that no line changes its number
        sed "1s/^/FoamFile { version 2.0; format ascii; class dictionary; object $(basename "$file"); } /" \
            "$here/$1/$file" > "$2/$file"
    done
    if [ -e "$here/$1/remove" ]; then
        while read -r file; do rm "$2/$file"; done < "$here/$1/remove"
    fi
}

# has_line <program> <expected line> <output>
has_line()
{
    if [ "$1" != felmiFoam ]; then
        grep -qF -- "$2" "$3"
        return
    fi
    local place=${2%%: *} text=${2#*: }
    place=${place%:*}
    grep -F -- "$text" "$3" | grep -qF -- "${place##*/}"
}

# run <case> <program> <path>
run()
{
    local directory=$work/$1.$2 output=$work/$1.$2.log expected=$here/$1/expected status line
    set_up "$1" "$directory"
    if [ "$2" = felmiFoam ] && [ -e "$here/$1/system/blockMeshDict" ]; then
        (cd "$directory" && blockMesh > "$output" 2>&1) || { complain "$1: blockMesh fails"; return; }
    fi
    (cd "$directory" && find . | sort) > "$work/before"
    (cd "$directory" && timeout 60 "$3") > "$output" 2>&1
    status=$?
    (cd "$directory" && find . | sort) > "$work/after"
    runs=$((runs + 1))
    if [ -e "$expected.$2" ]; then expected=$expected.$2; fi
    if [ $status -eq 0 ]; then complain "$1: $2 accepts it"; fi
    if [ $status -ge 124 ]; then complain "$1: $2 ends with status $status, a crash or a hang"; fi
    while read -r line; do
        has_line "$2" "$line" "$output" || {
            complain "$1: $2 does not say '$line', but:"
            tail -n 20 "$output"
        }
    done < "$expected"
    if ! cmp -s "$work/before" "$work/after"; then
        complain "$1: $2 has written something before it stopped:"
        diff "$work/before" "$work/after"
    fi
    rm -rf "$directory"
}

# The base itself must be good, or nothing that follows would mean anything.
mesh=$work/base
mkdir "$mesh"
cp -r "$base/0" "$base/constant" "$base/system" "$mesh"
"$(where felmiCheck)" -case "$mesh" > "$work/base.log" 2>&1 || {
    cat "$work/base.log"
    complain "the base case is refused"
}
# felmiFoam is not in the build directory: have it use the libraries that are tested.
foam=$(where felmiFoam)
if grep -qs 'FELMI_SANITIZE:BOOL=ON' "$build/CMakeCache.txt"; then foam=; fi
for library in demC couplingLib caseLib particlePhase; do
    LD_LIBRARY_PATH=$build/src/$library${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
done
export LD_LIBRARY_PATH
if [ -n "$foam" ] && ! (cd "$mesh" && blockMesh > "$work/blockMesh.log" 2>&1); then
    cat "$work/blockMesh.log"
    complain "no mesh for felmiFoam"
fi

for folder in "$here"/*/; do
    case=$(basename "$folder")
    programs="felmiCheck felmiDEM felmiMAC felmiFoam"
    if [ -e "$folder/programs" ]; then programs=$(cat "$folder/programs"); fi
    for program in $programs; do
        path=$(where "$program")
        if [ "$program" = felmiFoam ]; then path=$foam; fi
        if [ -n "$path" ]; then run "$case" "$program" "$path"; fi
    done
done
echo "$runs runs of bad cases, $failures failures"
[ "$runs" -gt 0 ] && [ "$failures" -eq 0 ]
