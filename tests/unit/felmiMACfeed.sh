#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# felmiMAC with a feeder and an outlet: particles of two species are fed into gas at rest, fall
# through it and are taken away; no particle at the start; every step of the ledger closes.
. "$(dirname "$0")/../functions"
mkdir -p case/0 case/constant case/system
bad=0

dictionary system/blockMeshDict dictionary <<'END'
vertices
(
    (0 0 0) (.03 0 0) (.03 .03 0) (0 .03 0) (0 0 .08) (.03 0 .08) (.03 .03 .08) (0 .03 .08)
);
blocks (hex (0 1 2 3 4 5 6 7) (6 6 16) simpleGrading (1 1 1));
edges ();
boundary
(
    top { type patch; faces ((4 5 6 7)); }
    bottom { type wall; faces ((0 3 2 1)); }
    sides { type wall; faces ((0 1 5 4) (2 3 7 6) (1 2 6 5) (3 0 4 7)); }
);
END
dictionary system/controlDict dictionary <<'END'
application felmiMAC;
startFrom startTime;
startTime 0;
stopAt endTime;
endTime .18;
deltaT 2e-4;
writeControl adjustableRunTime;
writeInterval .06;
END
dictionary system/fvSolution dictionary <<'END'
felmiMAC { tolerance 1e-10; }
END
dictionary constant/transportProperties dictionary <<'END'
transportModel Newtonian;
rho 1.2;
nu 1.5e-5;
END
dictionary constant/g uniformDimensionedVectorField <<'END'
dimensions [0 1 -2 0 0 0 0];
value (0 0 -9.81);
END
dictionary constant/couplingProperties dictionary <<'END'
map dividedCube;
packingLimit .7;
drag ErgunWenYu;
scheme semiImplicit;
END
dictionary constant/demProperties dictionary <<'END'
domain { min (0 0 0); max (.03 .03 .08); }
contactLaw linear;
materials { glass { density 2500; } plastic { density 900; } }
contacts
(
    { materials (glass glass); stiffness 200; restitution .9; friction .2; }
    { materials (glass plastic); stiffness 200; restitution .9; friction .2; }
    { materials (plastic plastic); stiffness 200; restitution .9; friction .2; }
);
walls
{
    box
    {
        material glass;
        shape { type box; min (0 0 -1); max (.03 .03 1); inside true; }
    }
}
feeders
{
    chute
    {
        region { type box; min (.004 .004 .06); max (.026 .026 .075); }
        species
        (
            { material glass; size { type normal; by mass; mean .001; deviation .0001; min .0007;
              max .0013; } share 1; }
            { material plastic; diameter .0012; share 1; }
        );
        shareBy mass;
        massRate .03;
        begin .005;
        end .07;
        velocity (0 0 -.5);
        velocitySpread .02;
        seed 3;
    }
}
outlets { drain { region { type box; min (0 0 0); max (.03 .03 .012); } } }
END
dictionary 0/U volVectorField <<'END'
dimensions [0 1 -1 0 0 0 0];
internalField uniform (0 0 0);
boundaryField
{
    top { type inletOutlet; inletValue uniform (0 0 0); value uniform (0 0 0); }
    bottom { type noSlip; }
    sides { type noSlip; }
}
END
dictionary 0/p volScalarField <<'END'
dimensions [0 2 -2 0 0 0 0];
internalField uniform 0;
boundaryField
{
    top { type fixedValue; value uniform 0; }
    bottom { type fixedFluxPressure; value uniform 0; }
    sides { type fixedFluxPressure; value uniform 0; }
}
END

expect 0 "End" felmiMAC -case case
ledgerBelow 1e-12 case/postProcessing/ledger/ledger.csv || bad=1
# .03 kg/s for .065 s at 2500 and 900 kg/m3, equal masses: volume of some of it in mid-run, none left
awk -F, '
    /^#/ { next }
    !n { for (i = 1; i <= NF; i++) name[$i] = i; n = 1; next }
    { volume = $name["particle_volume"]; if (volume > most) most = volume }
    END {
        whole = .03 * .065 * .5 * (1 / 2500 + 1 / 900)
        printf "volume: at most %.3g of %.3g m3, at the end %.3g\n", most, whole, volume
        exit !(most > .5 * whole && most <= whole && volume < .05 * whole)
    }' case/postProcessing/ledger/ledger.csv || bad=1
exit $bad
