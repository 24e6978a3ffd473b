#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# ns per particle and step of felmiFoam's engine, LAMMPS and LIGGGHTS on the same settled bed, one
# core each: demSpeed.sh <build directory> [repetitions]. See README.md.
set -euo pipefail

build=$(cd "${1:?usage: demSpeed.sh <build directory> [repetitions]}" && pwd)
repetitions=${2:-3}
short=100 long=400 number=100000
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMP_NUM_THREADS=1

command -v lmp liggghts > /dev/null || {
    sudo=; [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get install -y --no-install-recommends lammps liggghts
}
cmake --build "$build" --target demSpeed > /dev/null
demSpeed=$build/tests/bench/demSpeed
work=$build/tests/bench/demSpeed.d
mkdir -p "$work" && cd "$work"
[ -f bed ] || "$demSpeed" settle bed
"$demSpeed" lammps bed data
read -r k rate friction step skin diameter < <("$demSpeed" stiffness)

common() { # settings that both read alike
    cat << END
units           si
boundary        p p f
newton          off
communicate     single vel yes
$1
neighbor        $skin bin
neigh_modify    every 1 delay 0 check yes
timestep        $step
fix             weight all gravity 9.81 vector 0 0 -1
END
}
common 'comm_modify vel yes
atom_style sphere
read_data data' | sed '/^communicate/d' > in.lammps
cat >> in.lammps << END
pair_style      gran/hooke/history $k $k $rate $rate $friction 1
pair_coeff      * *
fix             move all nve/sphere
fix             floor all wall/gran hooke/history $k $k $(awk "BEGIN{print $rate/sqrt(2)}") NULL $friction 1 zplane 0 NULL
thermo          1000000
run             \${steps}
END
common 'atom_style granular
atom_modify map array
read_data data' > in.liggghts
cat >> in.liggghts << END
fix             m1 all property/global kn peratomtypepair 1 $k
fix             m2 all property/global kt peratomtypepair 1 $k
fix             m3 all property/global gamman peratomtypepair 1 $rate
fix             m4 all property/global gammat peratomtypepair 1 $rate
fix             m5 all property/global coefficientFriction peratomtypepair 1 $friction
pair_style      gran model hooke/stiffness tangential history
pair_coeff      * *
fix             floor all wall/gran model hooke/stiffness tangential history primitive type 1 zplane 0
fix             move all nve/sphere
thermo          1000000
run             \${steps}
END

# Processor seconds of a command.
seconds() { { TIMEFORMAT=%U; time "$@" > log 2>&1; } 2>&1 || { tail -5 log >&2; exit 1; }; }
# Two lengths of run: what is done once, reading and building lists, cancels.
peer() { # program, input
    local a b
    a=$(seconds "$1" -in "$2" -var steps $short)
    b=$(seconds "$1" -in "$2" -var steps $long)
    awk "BEGIN{printf \"%.1f\n\", ($b - $a)*1e9/$number/($long - $short)}"
}

echo "ns per particle and step, $number spheres, one core of $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1)"
echo "felmiFoam  LAMMPS  LIGGGHTS   (LAMMPS/felmiFoam  LIGGGHTS/felmiFoam)"
for ((i = 0; i < repetitions; i++)); do
    f=$("$demSpeed" run bed 300 2> log.felmi)
    l=$(peer lmp in.lammps)
    g=$(peer liggghts in.liggghts)
    awk "BEGIN{printf \"%9.1f %7.1f %9.1f   (%.2f  %.2f)\n\", $f, $l, $g, $l/$f, $g/$f}"
done
cat log.felmi
