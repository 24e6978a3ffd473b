#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# goldschmidtBed with felmiFoam on 1, 2 and 4 ranks: after 50 and 100 flow steps positions and
# velocities of the particles, U, p and void fraction agree to 1e-9, and every balance of the ledger is
# below 1e-12 in every step of each. Linear systems are solved to rounding, for their solvers depend on
# the division; hence flow and particles do in the last digit. Impacts multiply that: two spheres whose
# places differ by one unit in the last place of .3 m part with velocities that differ by 1e-12 of
# theirs, and after the hundredth step a sphere in an impact may be off by some 1e-8. Of the velocities
# there the mean is compared.
. "$(dirname "$0")/foamCase"

# setEntry FILE ENTRY VALUE: in system/
setEntry()
{
    foamDictionary -entry "$2" -set "$3" system/"$1" >log.foamDictionary
}

for ranks in "1 1 1" "1 2 1" "1 2 2"; do
    folder=ranks$((${ranks// /*}))
    mkdir $folder
    (
        cd $folder
        copyTutorial goldschmidtBed 0 constant system
        setEntry controlDict endTime 0.04
        setEntry controlDict writeInterval 0.02
        setEntry controlDict writePrecision 17
        for field in p pFinal; do
            setEntry fvSolution solvers/$field \
                '{ solver PCG; preconditioner DIC; tolerance 1e-15; relTol 0; maxIter 1000; }'
        done
        setEntry fvSolution 'solvers/"(U|k|epsilon|omega|nuTilda)(Final)?"/tolerance' 1e-15
        blockMesh >log.blockMesh
        runRanks "$ranks"
        [ "$(grep -c '^Time = .*ledger' log.felmiFoam)" = 100 ]
    )
done

export PYTHONPATH=$here/tests/cross
felmiPython "$PYTHONPATH/foamSame.py" 1e-9 0.02 0.45 5400 ranks1 ranks2 ranks4
felmiPython "$PYTHONPATH/foamSame.py" --mean 1e-9 0.04 0.45 5400 ranks1 ranks2 ranks4
