#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Restart of felmiDEM: an interrupted run leaves the same files as a straight one, to the last byte;
# killed at random moments while it writes it always finds a whole file to go on from; nothing of an
# earlier run is mistaken for its own or lost by an error.
. "$(dirname "$0")/../functions"
bad=0
RANDOM=4711
fail() { echo "$*"; bad=1; }

# fresh DIR: grains in a shaken tray, fed and taken away
fresh()
{
    rm -rf "$1"
    mkdir -p "$1"/system "$1"/constant
    cat >"$1"/system/controlDict <<END
startFrom latestTime; startTime 0; endTime 0.3; deltaT 0.003;
writeControl runTime; writeInterval 0.06;
END
    echo 'value (0 0 -9.81);' >"$1"/constant/g
    cat >"$1"/constant/demProperties <<END
domain { min (-0.02 -0.02 -0.01); max (0.02 0.02 0.06); }
contactLaw hertz; rolling elasticPlastic; balance yes;
materials { grain { density 2385; youngsModulus 1e6; poissonRatio 0.3; }
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
insertion { bed { type random; material grain; diameter 0.003; number 150;
                  region { type box; min (-0.017 -0.017 0.004); max (0.01 0.017 0.03); } } }
feeders { spout { region { type box; min (-0.01 -0.01 0.035); max (0.01 0.01 0.055); }
                  massRate 0.02; velocity (0 0 -0.3); velocitySpread 0.05;
                  material grain; size { type uniform; by number; min 0.002; max 0.004; } } }
outlets { drain { region { type box; min (-0.02 -0.02 -0.01); max (0.02 0.02 -0.003); } } }
END
}

# setControl DIR KEY VALUE
setControl() { sed -i -E "s/\\b$2 [^;]*;/$2 $3;/" "$1"/system/controlDict; }

# same DIR1 DIR2 WHAT: every file of the first is in the second, to the byte
same()
{
    local f
    [ -n "$(ls "$1"/$3 2>/dev/null)" ] || fail "no $1/$3"
    for f in "$1"/$3; do
        cmp "$f" "$2/${f#"$1"/}" || bad=1
    done
}

# ---- straight, and interrupted at a time of output ---------------------------------------------
fresh straight
expect 0 "End" felmiDEM -case straight
[ "$(cd straight/restart && echo *)" = "0.24.h5 0.3.h5" ] || fail "kept: $(ls straight/restart)"
head -c 17 straight/restart/0.3.h5 | grep -q "felmiFoam restart" || fail "no head in plain text"

fresh parts
setControl parts endTime 0.18
expect 0 "Created 150 particles" felmiDEM -case parts
setControl parts endTime 0.3
expect 0 "Go on from restart/0.18.h5" felmiDEM -case parts
same straight parts "restart/*"
same straight parts "dem/*"
same straight parts "postProcessing/*"
expect 0 "nothing is left to do" felmiDEM -case parts
same straight parts "dem/*"
same straight parts "postProcessing/*"

# ---- back to an older one: its future is moved away, series are cut ----------------------------
setControl parts startFrom startTime
setControl parts startTime 0.24
setControl parts endTime 0.27
expect 0 "Moved 1 restart file of an earlier run to restart.old" felmiDEM -case parts
cmp parts/restart.old/0.3.h5 straight/restart/0.3.h5 || bad=1
[ "$(cd parts/restart && echo *)" = "0.24.h5 0.27.h5" ] || fail "kept: $(ls parts/restart)"
for f in parts/postProcessing/*.csv; do
    tail -n 1 "$f" | grep -q '^0.27,' || fail "$f does not end at 0.27"
    cmp "$f" <(head -n "$(wc -l <"$f")" straight/"${f#parts/}") || bad=1
done
setControl parts startFrom latestTime
setControl parts endTime 0.3
expect 0 "Go on from restart/0.27.h5" felmiDEM -case parts
same straight parts "postProcessing/*"

# ---- a new beginning ----------------------------------------------------------------------------
setControl parts startFrom startTime
setControl parts startTime 0
setControl parts endTime 0.06
expect 0 "Moved 2 restart files" felmiDEM -case parts
[ "$(cd parts/restart.old && echo *)" = "0.27.h5 0.3.h5" ] || fail "$(ls parts/restart.old)"
[ "$(cd parts/restart && echo *)" = "0.06.h5" ] || fail "$(ls parts/restart)"

# ---- a newest file that is no good ----------------------------------------------------------------
cp -r straight broken
setControl broken endTime 0.36
before=$(cd broken && find . -type f | sort | xargs cksum)
printf 'x' | dd of=broken/restart/0.3.h5 bs=1 seek=9999 conv=notrunc 2>/dev/null
expect 1 "broken/restart/0.3.h5: is damaged" felmiDEM -case broken
expect 1 "startFrom startTime; startTime 0.24;" felmiDEM -case broken
cp straight/restart/0.3.h5 broken/restart/
[ "$before" = "$(cd broken && find . -type f | sort | xargs cksum)" ] || fail "an error lost something"
truncate -s -100 broken/restart/0.3.h5
expect 1 "is truncated" felmiDEM -case broken
setControl broken startFrom startTime
setControl broken startTime 0.24
setControl broken endTime 0.3
expect 0 "Moved 1 restart file" felmiDEM -case broken
same straight broken "restart/*"

# ---- what changes in between ----------------------------------------------------------------------
cp -r straight changed
setControl changed endTime 0.33
sed -i 's/^walls/walls { }\nwalls/; s/sides { material/vessel { material/' changed/constant/demProperties
sed -i '/^walls { }$/d' changed/constant/demProperties
expect 0 "wallForces.csv.before-0.3" felmiDEM -case changed
cmp changed/postProcessing/wallForces.csv.before-0.3 straight/postProcessing/wallForces.csv || bad=1
tail -n 1 changed/postProcessing/particles.csv | grep -q '^0.33,' || fail "particles.csv not continued"
cp -r straight changed2
setControl changed2 endTime 0.33
sed -i 's/contactLaw hertz;/contactLaw linear;/; s/restitution/stiffness 200; restitution/' \
    changed2/constant/demProperties
expect 1 "its contact law is hertz, that of this simulation linear" felmiDEM -case changed2

fresh off
echo 'restart { write no; }' >>off/system/controlDict
setControl off endTime 0.03
expect 0 "End" felmiDEM -case off
[ ! -e off/restart ] || fail "restart files although write no"
echo 'restart { keeep 3; }' >>off/system/controlDict
expect 1 "keep" felmiDEM -case off

# ---- a full disk ----------------------------------------------------------------------------------
cp -r straight full
setControl full endTime 0.36
ln -s /dev/full full/restart/.0.36.h5.part
expect 1 "full/restart/0.36.h5: write: No space left on device" \
    felmiDEM -case full
[ "$(cd full/restart && echo *)" = "0.24.h5 0.3.h5" ] || fail "after a full disk: $(ls full/restart)"
same straight full "restart/*"
expect 0 "Go on from restart/0.3.h5" felmiDEM -case full

# ---- killed at random moments ---------------------------------------------------------------------
# Restart file and snapshot in every step of few sub-steps: most of the time is writing.
fresh dense
cat >>dense/system/controlDict <<END
restart { interval 0.0006; keep 3; }
END
setControl dense deltaT 0.0006
setControl dense writeInterval 0.0006
setControl dense endTime 0.18
cp -r dense killed
expect 0 "End" felmiDEM -case dense
kills=0
parts=0
for ((try = 0; try < 200 && kills < 20; try++)); do
    before=$(ls killed/restart 2>/dev/null)
    felmiDEM -case killed >log.killed 2>&1 &
    pid=$!
    while [ "$(ls killed/restart 2>/dev/null)" = "$before" ] && kill -0 $pid 2>/dev/null; do
        sleep 0.01
    done
    sleep 0.0$((RANDOM % 90 + 10))
    if kill -KILL $pid 2>/dev/null; then kills=$((kills + 1)); fi
    wait $pid 2>/dev/null
    status=$?
    [ $status = 137 ] || [ $status = 0 ] || { cat log.killed; fail "status $status"; break; }
    ls killed/restart/.*.part >/dev/null 2>&1 && parts=$((parts + 1))
done
echo "killed $kills times, $parts times within a restart file, at $(ls killed/restart | tail -n 1)"
[ $kills = 20 ] || fail "only $kills kills: the run is too short"
expect 0 "End" felmiDEM -case killed
same dense killed "restart/*"
same dense killed "dem/*"
same dense killed "postProcessing/*"
exit $bad
