# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether runs of one case agree: particles by id, fields cell by cell.

    foamSame.py [--mean] BOUND TIME SIZE CELLS RUN OTHER...

compares particles and fields of each OTHER folder with those of RUN: the largest difference of
positions over SIZE (m), of U and of the particles' velocities over the largest, of p over its range,
of voidfraction. --mean: of the particles' velocities the mean difference over the mean speed.
"""
import sys

import h5py
import numpy as np
from foamRead import field


def particles(run, time):
    """Positions and velocities in the order of ids."""
    with h5py.File(f"{run}/dem/{time}.h5") as h5:
        ids = h5["particles/id"][:]
        order = np.argsort(ids)
        assert (np.diff(ids[order]) > 0).all(), (run, "ids twice")
        return [h5["particles/" + name][:][order] for name in ("position", "velocity")]


def fields(run, time, cells):
    return [np.array(field(f"{run}/{time}/{name}", cells)) for name in ("U", "p", "voidfraction")]


def cloud(run, time):
    """Number of particles in the cloud that OpenFOAM sees."""
    with open(f"{run}/{time}/lagrangian/particles/id") as file:
        return next(int(line) for line in file if line.strip().isdigit())


def length(rows):
    return np.sqrt((rows**2).sum(axis=1))


def main():
    arguments = sys.argv[1:]
    means = arguments[0] == "--mean"
    bound, time, size, cells, reference, *others = arguments[means:]
    norm = np.mean if means else np.max
    x, v = particles(reference, time)
    U, p, eps = fields(reference, time, int(cells))
    assert abs(v).max() > 0 and abs(U).max() > 0 and np.ptp(p) > 0 and eps.min() < .9
    bad = False
    for run in others:
        xr, vr = particles(run, time)
        Ur, pr, epsr = fields(run, time, int(cells))
        assert len(xr) == len(x) == cloud(run, time), (run, len(xr), len(x), cloud(run, time))
        off = {
            "positions": length(xr - x).max() / float(size),
            "velocities" + means * " (mean)": norm(length(vr - v)) / norm(length(v)),
            "U": length(Ur - U).max() / length(U).max(),
            "p": abs(pr - p).max() / np.ptp(p),
            "voidfraction": abs(epsr - eps).max(),
        }
        print(f"{run} against {reference} at {time} s: " +
              ", ".join(f"{name} {value:.1e}" for name, value in off.items()))
        bad = bad or not max(off.values()) < float(bound)
    sys.exit(bad)


main()
