# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of felmiFoam share for reading results: ascii fields and tables."""
import csv
import re


def field(path, cells):
    """Internal field of an OpenFOAM file as a list of numbers or tuples, one a cell."""
    text = open(path).read()
    uniform = re.search(r"internalField\s+uniform\s+([^;]+);", text)
    if uniform:
        return [number(uniform.group(1))] * cells
    body = re.search(r"internalField\s+nonuniform\s+List<\w+>\s*\d+\s*\((.*?)\n\)\s*;", text, re.S)
    values = [number(line) for line in body.group(1).strip().split("\n")]
    assert len(values) == cells, (path, len(values), cells)
    return values


def number(text):
    text = text.strip()
    if text.startswith("("):
        return tuple(float(x) for x in text.strip("()").split())
    return float(text)


def table(path):
    """Rows of a comma-separated table as dictionaries of floats; lines with # are left out."""
    lines = [line for line in open(path) if not line.startswith("#")]
    return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(lines)]


def solver():
    return table("postProcessing/felmiFoam/solver.csv")


def ledger():
    return table("postProcessing/ledger/ledger.csv")
