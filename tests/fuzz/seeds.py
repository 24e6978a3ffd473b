#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs that the fuzzers begin with: seeds.py SUBJECT DIRECTORY.

dictionary: the dictionaries of the tutorials and tests. stl: small bodies, text and binary. restart,
samples: every kind of change (h5Edit.h) to every dataset, and some heads. What once failed lies in
known/SUBJECT and is always among them.
"""
import pathlib
import shutil
import struct
import sys

here = pathlib.Path(__file__).resolve().parent
tree = here.parent.parent


def dictionaries():
    """Files of cases that begin like dictionaries; what is long only makes the fuzzer slow."""
    for folder in (tree / "tutorials", tree / "tests"):
        for path in sorted(folder.rglob("*")):
            if path.parent.name not in ("constant", "system", "0") or not path.is_file():
                continue
            text = path.read_bytes()
            if 0 < len(text) < 12000 and b"{" in text and b"\0" not in text:
                yield text


CORNERS = {
    "tetrahedron": [[(0, 0, 0), (0, 1, 0), (1, 0, 0)], [(0, 0, 0), (1, 0, 0), (0, 0, 1)],
                    [(0, 0, 0), (0, 0, 1), (0, 1, 0)], [(1, 0, 0), (0, 1, 0), (0, 0, 1)]],
}


def box():
    """Twelve triangles."""
    for axis in range(3):
        for side in (0, 1):
            ring = [(0, 0), (1, 0), (1, 1), (0, 1)] if side else [(0, 0), (0, 1), (1, 1), (1, 0)]
            p = []
            for a, b in ring:
                x = [0.0] * 3
                x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3] = side, a, b
                p.append(tuple(x))
            yield [p[0], p[1], p[2]]
            yield [p[0], p[2], p[3]]


CORNERS["box"] = list(box())
CORNERS["notch"] = [t for t in box() if t[0][2] + t[1][2] + t[2][2] < 3] + [
    [(0, 0, 1), (1, 0, 1), (.5, .5, .4)], [(1, 0, 1), (1, 1, 1), (.5, .5, .4)],
    [(1, 1, 1), (0, 1, 1), (.5, .5, .4)], [(0, 1, 1), (0, 0, 1), (.5, .5, .4)]]
CORNERS["open"] = CORNERS["box"][:-2]
CORNERS["inside out"] = [t[::-1] for t in CORNERS["tetrahedron"]]
CORNERS["two"] = CORNERS["box"] + [[tuple(.5 + .2 * c for c in v) for v in t]
                                   for t in CORNERS["tetrahedron"]]
CORNERS["fins"] = CORNERS["box"] + [[(1, 0, 0), (1, 1, 0), (2, 0, 0)]]
CORNERS["flat"] = CORNERS["tetrahedron"] + [[(0, 0, 0), (1, 1, 1), (.5, .5, .5)]]


def bodies():
    """Each as text and binary."""
    for name, triangles in CORNERS.items():
        text = "solid " + name + "\n"
        for t in triangles:
            text += "facet normal 0 0 0\n outer loop\n"
            text += "".join("  vertex %.6g %.6g %.6g\n" % v for v in t)
            text += " endloop\nendfacet\n"
        yield (text + "endsolid " + name + "\n").encode()
        body = b"".join(struct.pack("<12fH", 0, 0, 0, *(c for v in t for c in v), 0)
                        for t in triangles)
        yield b"solid, but binary".ljust(80) + struct.pack("<I", len(triangles)) + body


def changes(sets):
    """Every kind of change to every dataset, with a choice that differs from one to the next."""
    for kind in range(8):
        for number in range(sets):
            turn = 5 * kind + 3 * number
            yield bytes([kind, number, (7 * number + 1) % sets, number + kind, number // 3,
                         turn % 13]) + struct.pack("<d", turn - 9.5)


def edits(sets, first):
    for number, change in enumerate(changes(sets)):
        yield bytes([first[number % len(first)]]) + change


def restarts():
    yield from edits(96, (0, 1))
    head = b"felmiFoam restart\nversion 1\ntime 0.1\nparticles 14\nlength 1\nchecksum 0\n"
    for text in (head, head[:40], head.replace(b"1\nt", b"2\nt"), head.replace(b"time", b"item"),
                 b"\211HDF\r\n\032\n" + bytes(600), head.ljust(700), head.replace(b"\n", b" ")):
        yield b"\2" + text
        yield b"\3" + text


MAKE = {"dictionary": dictionaries, "stl": bodies, "restart": restarts,
        "samples": lambda: edits(4, (0, 1, 1, 1))}


def main(subject, directory):
    target = pathlib.Path(directory)
    target.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(MAKE[subject]()):
        (target / f"seed{number:04d}").write_bytes(seed)
    for path in sorted((here / "known" / subject).glob("*")):
        shutil.copy(path, target / f"known-{path.name}")


if __name__ == "__main__":
    main(*sys.argv[1:])
