#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The installed libraries serve a stranger: the program that docs/extending.md shows, which uses demC
# and couplingLib, builds against an installed copy by pkg-config and by CMake, and a sphere falls
# g t^2/2 in it.
set -e
build=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" >/dev/null

docs=$(cd "$(dirname "$0")/../../docs" && pwd)
cp "$docs/examples/fall.c" "$work"
# the page shows this program, without the licence line
diff <(sed 1d "$work/fall.c") <(sed -n '/^```c$/,/^```$/p' "$docs/extending.md" | sed '1d;$d')

export PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name demC.pc)")
libdir=$(dirname "$PKG_CONFIG_PATH")
# shellcheck disable=SC2046
cc -o "$work/fall" "$work/fall.c" $(pkg-config --cflags --libs demC couplingLib) -lm
LD_LIBRARY_PATH=$libdir "$work/fall"

cat >"$work/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.18)
project(fall LANGUAGES C)
find_package(felmi REQUIRED)
add_executable(fall fall.c)
target_link_libraries(fall PRIVATE felmi::demC felmi::couplingLib m)
CMAKE
cmake -S "$work" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
cmake --build "$work/build" >/dev/null
"$work/build/fall"
