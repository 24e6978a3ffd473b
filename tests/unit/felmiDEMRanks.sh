#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# felmiDEM under mpirun: the same particles and series as alone; restarts on other numbers of ranks;
# one message where something is wrong, and no rank left waiting; killed while it writes, it goes on.
. "$(dirname "$0")/../functions"
command -v mpirun >/dev/null || exit 77
bad=0
RANDOM=815
fail() { echo "$*"; bad=1; }

# on RANKS ARGUMENTS: felmiDEM, which must end by itself
on()
{
    local ranks=$1
    shift
    timeout 200 mpirun --oversubscribe -np "$ranks" felmiDEM "$@"
}

# fresh DIR: grains that fall into a shaken tray, fed and taken away
fresh()
{
    rm -rf "$1"
    mkdir -p "$1"/system "$1"/constant
    cat >"$1"/system/controlDict <<END
startFrom latestTime; startTime 0; endTime 0.12; deltaT 0.003;
writeControl runTime; writeInterval 0.06; restart { keep 0; }
END
    echo 'value (0 0 -9.81);' >"$1"/constant/g
    cat >"$1"/constant/demProperties <<END
domain { min (-0.02 -0.02 -0.01); max (0.02 0.02 0.06); }
contactLaw hertz; rolling elasticPlastic; balance yes;
parallel { imbalance 1.05; }
materials { grain { density 2385; youngsModulus 3e5; poissonRatio 0.3; }
            steel { density 7800; youngsModulus 1e7; poissonRatio 0.3; } }
contacts
(
    { materials (grain grain); restitution 0.6; friction 0.4; rollingFriction 0.1; }
    { materials (grain steel); restitution 0.7; friction 0.3; rollingFriction 0.1; }
    { materials (steel steel); restitution 0.7; friction 0.3; rollingFriction 0.1; }
);
walls
{
    sides { material steel; shape { type box; min (-0.019 -0.019 -0.1); max (0.019 0.019 0.1);
                                    inside yes; } }
    tray { material steel; shape { type box; min (-0.02 -0.02 -0.005); max (0.012 0.02 0); }
           motion { type oscillation; amplitude (0.002 0 0.0005); frequency 17; } }
}
insertion { bed { type random; material grain; diameter 0.003; number 200;
                  region { type box; min (-0.017 -0.017 0.002); max (0.01 0.017 0.02); } } }
feeders { spout { region { type box; min (-0.01 -0.01 0.025); max (0.01 0.01 0.055); }
                  massRate 0.02; velocity (0 0 -0.6); velocitySpread 0.05;
                  material grain; size { type uniform; by number; min 0.002; max 0.004; } } }
outlets { drain { region { type box; min (-0.02 -0.02 -0.01); max (0.02 0.02 -0.003); } } }
END
}

setControl() { sed -i -E "s/\\b$2 [^;]*;/$2 $3;/" "$1"/system/controlDict; }

# sameRun DIR1 DIR2: particles of the snapshots by id and the state of the restart files bit for bit,
# but for sums over particles and contacts, which are the same to rounding, as are the series
cat >compare.py <<'END'
import glob, os, sys
import h5py
import numpy as np

one, two = sys.argv[1:3]
SUMS = ("walls/load", "state/mass", "balance/", "outlets/mass", "kept/massAtStart")
bad = compared = 0


def differs(what, a, b, exact):
    global bad, compared
    compared += 1
    if a.shape != b.shape:
        print(what, "has the shapes", a.shape, b.shape)
        bad = 1
    elif not (a == b).all() and (exact or np.abs(a - b).max() > 1e-11 * np.abs(a).max()):
        print(what, "differs")
        bad = 1


for path in sorted(glob.glob(one + "/dem/*.h5")):
    with h5py.File(path) as a, h5py.File(two + path[len(one):]) as b:
        order = [np.argsort(f["particles/id"][:]) for f in (a, b)]
        for name in a["particles"]:
            rows = [f["particles"][name][:][o] for f, o in zip((a, b), order)]
            differs(path + " " + name, *rows, True)
for path in sorted(glob.glob(one + "/restart/*.h5")):
    with h5py.File(path) as a, h5py.File(two + path[len(one):]) as b:
        sets = []
        a.visititems(lambda name, s: sets.append(name) if isinstance(s, h5py.Dataset) else None)
        for name in sets:
            if name != "particles/place":  # in the store, which has another order on other ranks
                differs(path + " " + name, a[name][()], b[name][()], not name.startswith(SUMS))
for path in sorted(glob.glob(one + "/postProcessing/*.csv")):
    rows = [open(p).read().split("\n") for p in (path, two + path[len(one):])]
    heads = [[line for line in r if line[:1] in "#t"] for r in rows]
    values = [np.array([[float(x) for x in line.split(",")] for line in r if line[:1].isdigit()])
              for r in rows]
    compared += 1
    size = np.abs(values[0]).max(axis=0)
    # the last columns of these are residuals: rounding itself
    columns = slice(0, -1 if os.path.basename(path) in ("massBalance.csv", "energy.csv") else None)
    if heads[0] != heads[1] or values[0].shape != values[1].shape:
        print(path, "has other rows")
        bad = 1
    elif (np.abs(values[0] - values[1]) > 1e-8 * size + 1e-15).any(axis=0)[columns].any():
        print(path, "differs in column", np.argmax(np.abs(values[0] - values[1]) - 1e-8 * size) %
              len(size))
        bad = 1
if compared < 60:
    print("only", compared, "comparisons")
    bad = 1
sys.exit(bad)
END
sameRun() { felmiPython compare.py "$1" "$2" || { echo "$1 and $2 differ"; bad=1; }; }

# ---- the same on one rank and on three, straight and interrupted ---------------------------------
fresh one
expect 0 "End" felmiDEM -case one
fresh three
on 3 -case three >log.three 2>&1 || fail "three: $(tail -n 3 log.three)"
grep -q '^nProcs : 3' log.three || fail "no number of ranks in the log"
[ "$(grep -c '^Time = ' log.three)" = 40 ] || fail "the log has $(grep -c '^Time = ' log.three) steps"
grep -q 'exchange .* imbalance' log.three || fail "no exchange nor imbalance in the log"
grep -qE '^Divided [1-9][0-9]* times among 3 ranks' log.three || fail "no divisions in the log"
grep -qE '^ +exchange +[0-9.]+ s' log.three || fail "no time of the exchange in the log"
sameRun one three

for ranks in 1 2; do
    cp -r three again
    rm again/restart/0.12.h5
    on $ranks -case again >log.again 2>&1 || fail "again: $(tail -n 3 log.again)"
    grep -q 'Go on from restart/0.06.h5' log.again || fail "begun anew on $ranks ranks"
    sameRun one again
    rm -r again
done

# ---- errors: once, and the end of all ranks --------------------------------------------------------
# once STATUS TEXT ARGUMENTS: on three ranks
once()
{
    local status=$1 text=$2 output
    shift 2
    output=$(on 3 "$@" 2>&1)
    local got=$?
    [ $got = "$status" ] && [ "$(grep -cF -- "$text" <<<"$output")" = 1 ] && return
    fail "felmiDEM $*: status $got, expected $status; '$text' once in:"
    grep -F felmiDEM <<<"$output" | head -n 8
}
cp -r one broken
printf 'x' | dd of=broken/restart/0.12.h5 bs=1 seek=9999 conv=notrunc 2>/dev/null
setControl broken endTime 0.15
once 1 "broken/restart/0.12.h5: is damaged" -case broken
once 2 "unknown argument '-cas'" -cas broken
fresh wrong
sed -i 's/restitution 0.6/restitution 1.6/' wrong/constant/demProperties
once 1 "restitution: found '1.6'" -case wrong
fresh lost
sed -i '/^outlets/d; s/^    sides .*/    sides { material steel; shape { type box; min (-0.019 -0.019 -0.1); max (0.03 0.019 0.1);/' \
    lost/constant/demProperties
setControl lost endTime 1
once 1 "left the domain" -case lost
fresh full
mkdir -p full/restart
ln -s /dev/full full/restart/.0.06.h5.part
once 1 "full/restart/0.06.h5: write: " -case full
[ -z "$(ls full/restart)" ] || fail "after a full disk: $(ls full/restart)"

# A file system that really is full, where one can be made.
mkdir small
if mount -t tmpfs -o size=192k none small 2>/dev/null; then
    trap 'umount "$work/small"' EXIT
    fresh small/case
    output=$(on 2 -case small/case 2>&1)
    [ $? = 1 ] && grep -q "No space left on device" <<<"$output" ||
        fail "on a full file system: $(tail -n 3 <<<"$output")"
    umount small
    trap - EXIT
fi

# ---- one rank of two is killed while they write ------------------------------------------------------
fresh dense
setControl dense deltaT 0.0006
setControl dense writeInterval 0.0006
setControl dense endTime 0.12
sed -i 's/keep 0/keep 3/' dense/system/controlDict
cp -r dense killed
expect 0 "End" felmiDEM -case dense
kills=0
for ((try = 0; try < 40 && kills < 5; try++)); do
    before=$(ls killed/restart 2>/dev/null)
    (on 2 -case killed >log.killed 2>&1) &
    pid=$!
    while [ "$(ls killed/restart 2>/dev/null)" = "$before" ] && kill -0 $pid 2>/dev/null; do
        sleep 0.01
    done
    sleep "$(printf '0.%02d' $((RANDOM % 20 + 2)))" # within the next few files
    limit=$(pgrep -P $pid) && mpi=$(pgrep -P "$limit") && ranks=($(pgrep -P "$mpi")) &&
        kill -KILL "${ranks[RANDOM % 2]}" 2>/dev/null && kills=$((kills + 1))
    wait $pid
    status=$?
    [ $status = 137 ] || [ $status = 0 ] || { tail log.killed; fail "status $status"; break; }
done
echo "killed $kills times, at $(ls killed/restart | tail -n 1)"
[ $kills = 5 ] || fail "only $kills kills: the run is too short"
on 2 -case killed >log.killed 2>&1 || fail "killed: $(tail -n 3 log.killed)"
sameRun dense killed
exit $bad
