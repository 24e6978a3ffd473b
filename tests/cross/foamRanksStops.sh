#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What goes wrong on one of two ranks while felmiFoam runs stops both, with the reason said once: a
# particle that leaves the domain, files that cannot be written, and a full disk.
. "$(dirname "$0")/foamCase"

gravity="(0 0 -9.81)" density=2500 deltaT=1e-3 endTime=0.1 tolerance=1e-9
insertion="block { type lattice; material glass; diameter $diameter; spacing 0.003;
    region { type box; min (0 0 0.001); max (0.02 0.02 0.02); } }"
makeCase
decomposeCase "1 1 2"

# stops TEXT: the run ends before its time and says TEXT, once
stops()
{
    local status=0
    onRanks 2 felmiFoam -parallel >log.felmiFoam 2>&1 || status=$?
    if [ $status != 1 ] || [ "$(grep -c "$1" log.felmiFoam)" != 1 ] || grep -q '^End' log.felmiFoam; then
        tail -n 20 log.felmiFoam
        echo "status $status; expected once: $1"
        exit 1
    fi
    grep -h "$1" log.felmiFoam
    rm -rf postProcessing dem restart processor*/0.*
}

stops '^particle [0-9]* has left the domain .*position (.*) N$'

for folder in postProcessing dem restart; do
    touch $folder
    sed -i 's/writeInterval [^;]*/writeInterval 0.002/' system/controlDict
    stops "$folder.*: .*\(directory\|in the way\)"
done
mkdir -p postProcessing/felmiFoam/solver.csv
stops 'solver.csv: .*directory'

# a disk of 1 MB is full after the first fields
disk=$work/disk
mkdir disk
if mount -t tmpfs -o size=1m felmi disk 2>/dev/null; then
    trap 'umount "$disk"' EXIT
    cp -r 0 constant system disk
    cd disk
    decomposeCase "1 1 2"
    sed -i 's/writeInterval [^;]*/writeInterval 0.001/' system/controlDict
    status=0
    onRanks 2 felmiFoam -parallel >../log.full 2>&1 || status=$?
    cd ..
    grep -h -i 'no space\|cannot be written\|cannot write\|room' log.full || { tail log.full; exit 1; }
    [ $status != 0 ] && [ $status != 124 ]
fi
