# SPDX-License-Identifier: GPL-3.0-or-later
"""Sections of walls of triangles, where the walls are at the time of a picture.

The surface comes from an STL file, ASCII or binary. A wall that moves is placed by the row of
<case>/postProcessing/wallForces.csv nearest to the time: x = place + R(turn) x_start, R by
Rodrigues' formula.
"""
import os
import sys

import numpy as np


def stop(text):
    sys.exit(f"felmiPlotParticles: {text}")


def read_stl(path, scale):
    """Corners of the triangles, [n][3][3], m."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        stop(f"{path}: {error.strerror}")
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    if len(data) == 84 + 50 * count and count:  # an ASCII file may not have this length
        rows = np.frombuffer(data, np.uint8, offset=84).reshape(count, 50)
        corners = rows[:, 12:48].copy().view("<f4").astype(float)
    else:
        words = [line.split()[1:] for line in data.decode("ascii", "replace").splitlines()
                 if line.split()[:1] == ["vertex"]]
        try:
            corners = np.array(words, float)
        except ValueError:
            stop(f"{path}: not an STL file")
    if corners.size == 0 or corners.size % 9:
        stop(f"{path}: not an STL file")
    return scale * corners.reshape(-1, 3, 3)


class Wall:
    """`NAME=FILE` or `NAME=FILE*SCALE`; NAME is that of the wall in demProperties."""

    def __init__(self, text, folder):
        self.name, _, file = text.partition("=")
        path, _, scale = file.partition("*")
        try:
            self.corners = read_stl(path, float(scale or 1))
        except ValueError:
            stop(f"--wall {text}: accepted is NAME=FILE or NAME=FILE*SCALE")
        self.poses = self.read_poses(os.path.join(folder, "postProcessing", "wallForces.csv"))

    def read_poses(self, path):
        """Times and rows of place and turn, or None for a wall at rest."""
        if not os.path.exists(path):
            return None
        with open(path) as file:
            rows = [line for line in file if not line.startswith("#")]
        names = rows[0].strip().split(",")
        columns = [f"{self.name}.{what}.{axis}" for what in ("place", "turn") for axis in "xyz"]
        if not set(columns) <= set(names):
            return None
        data = np.genfromtxt(rows[1:], delimiter=",", ndmin=2)
        return data[:, 0], data[:, [names.index(column) for column in columns]]

    def at(self, time):
        """Corners at a time: before the first row the wall is where it starts."""
        if self.poses is None:
            return self.corners
        times, rows = self.poses
        # the start has no row of its own: it lies one interval before the first
        nearest = int(np.argmin(abs(times - time)))
        if times[nearest] - time > 0.5 * times[0]:
            return self.corners
        place, turn = rows[nearest, :3], rows[nearest, 3:]
        angle = np.linalg.norm(turn)
        axis = turn / angle if angle > 0 else np.zeros(3)
        x = self.corners
        turned = (np.cos(angle) * x + np.sin(angle) * np.cross(axis, x)
                  + (1 - np.cos(angle)) * (x @ axis)[..., None] * axis)
        return place + turned

    def section(self, time, depth, level):
        """Segments [n][2][3] where the surface crosses x[depth] = level."""
        x = self.at(time)
        # a level that no corner lies on: corners of drawings are round numbers
        level = level + 1e-7 * np.ptp(x[..., depth]) * np.sqrt(2)
        height = x[..., depth] - level
        crossed = x[(height.min(axis=1) < 0) & (height.max(axis=1) > 0)]
        height = crossed[..., depth] - level
        # the corner that is alone on its side; the section goes through its two edges
        alone = np.where((height > 0).sum(axis=1) == 1, height.argmax(axis=1),
                         height.argmin(axis=1))
        row = np.arange(len(crossed))
        ends = []
        for step in (1, 2):
            other = (alone + step) % 3
            a, b = height[row, alone], height[row, other]
            part = (a / (a - b))[:, None]
            ends.append((1 - part) * crossed[row, alone] + part * crossed[row, other])
        return np.stack(ends, axis=1)
