# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw snapshots of particles side by side: true size, seen along an axis, coloured by speed."""
import argparse
import os
import sys
import xml.etree.ElementTree as xml

import h5py
import numpy as np

from style import plt, save, set_style
from walls import Wall
from matplotlib.collections import EllipseCollection, LineCollection  # noqa: E402

AXIS = {"x": 0, "y": 1, "z": 2}
LABEL = {  # --colour: dataset, component (None: magnitude), label
    "speed": ("velocity", None, "speed (m/s)"),
    "vx": ("velocity", 0, "$v_x$ (m/s)"),
    "vy": ("velocity", 1, "$v_y$ (m/s)"),
    "vz": ("velocity", 2, "$v_z$ (m/s)"),
    "spin": ("angularVelocity", None, "spin (rad/s)"),
    "force": ("force", None, "force (N)"),
    "diameter": ("diameter", None, "diameter (m)"),
    "density": ("density", None, "density (kg/m$^3$)"),
    "material": ("material", None, "material"),
    "id": ("id", None, "id"),
}


def arguments():
    parser = argparse.ArgumentParser(
        prog="felmiPlotParticles", description=__doc__,
        formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("source", nargs="+",
                        help="a dem directory, a case that has one, or .h5 files")
    parser.add_argument("--output", "-o", default="particles.png", help="picture to write")
    parser.add_argument("--count", "-n", type=int, default=4,
                        help="number of times, evenly spread from first to last")
    parser.add_argument("--times", help="times to draw instead, as 0.1,0.2,0.5 (nearest ones)")
    parser.add_argument("--axes", default="xz", help="axes to the right and upwards")
    parser.add_argument("--colour", default="speed", choices=list(LABEL))
    parser.add_argument("--range", nargs=2, type=float, metavar=("LOW", "HIGH"),
                        help="of the colours; default: from the data")
    parser.add_argument("--colourMap", default="viridis")
    parser.add_argument("--extent", nargs=4, type=float,
                        metavar=("RIGHT0", "RIGHT1", "UP0", "UP1"),
                        help="window, m; default: around all particles drawn")
    parser.add_argument("--slice", nargs=2, type=float, metavar=("FROM", "TO"),
                        help="only centres within these depths along the third axis, m")
    parser.add_argument("--wall", action="append", default=[], metavar="NAME=FILE[*SCALE]",
                        help="STL file of a wall, scaled to m: draws its section half-way of the "
                             "slice, or at 0, where the case's wallForces.csv says that it is; "
                             "may be repeated")
    parser.add_argument("--columns", type=int, default=0, help="pictures in a row; 0: all")
    parser.add_argument("--title", default="")
    parser.add_argument("--dpi", type=int, default=200)
    args = parser.parse_args()
    if len(args.axes) != 2 or args.axes[0] == args.axes[1] or not set(args.axes) <= set(AXIS):
        parser.error(f"--axes {args.axes}: accepted are two of x, y, z, as xz")
    if args.count < 1:
        parser.error("--count must be at least 1")
    return args


def series_of(folder):
    """(time, file) of a directory, from its XDMF series: files of an older run may lie beside."""
    index = os.path.join(folder, "particles.xmf")
    if not os.path.exists(index):
        return []
    found = []
    for grid in xml.parse(index).iter("Grid"):
        time, item = grid.find("Time"), grid.find("Geometry/DataItem")
        if time is not None and item is not None:
            path = item.text.strip().split(":/")[0]
            found.append((float(time.get("Value")), os.path.join(folder, path)))
    return found


def find_snapshots(sources):
    found = []
    for source in sources:
        if os.path.isdir(source):
            here = series_of(source) or series_of(os.path.join(source, "dem"))
            if not here:
                sys.exit(f"felmiPlotParticles: {source}: no particles.xmf in it or in its dem")
            found += here
        else:
            try:
                with h5py.File(source, "r") as file:
                    found.append((float(file.attrs["time"]), source))
            except (OSError, KeyError) as error:
                sys.exit(f"felmiPlotParticles: {source}: not a snapshot ({error})")
    return sorted(found)


def choose(snapshots, count, times):
    if times:
        try:
            wanted = [float(t) for t in times.split(",")]
        except ValueError:
            sys.exit(f"felmiPlotParticles: --times {times}: accepted is a list as 0.1,0.2")
        all_times = np.array([time for time, _ in snapshots])
        return [snapshots[int(np.argmin(abs(all_times - t)))] for t in wanted]
    count = min(count, len(snapshots))
    if count == 1:
        return snapshots[-1:]
    return [snapshots[i] for i in
            np.unique(np.linspace(0, len(snapshots) - 1, count).round().astype(int))]


def load(path, colour):
    try:
        with h5py.File(path, "r") as file:
            group = file["particles"]
            name, component, _ = LABEL[colour]
            value = group[name][...].astype(float)
            x, d = group["position"][...], group["diameter"][...]
    except (OSError, KeyError) as error:
        sys.exit(f"felmiPlotParticles: {path}: {error}")
    if value.ndim == 2:
        value = np.linalg.norm(value, axis=1) if component is None else value[:, component]
    return x, d, value


def toward_viewer(right, up):
    """Axis and sign of right x up: what lies farther along it hides the rest."""
    depth = 3 - right - up
    return depth, 1 if (right + 1) % 3 == up else -1


def draw(axes, snapshot, right, up, unit, points_per_unit, norm, args):
    x, d, value = snapshot
    depth, sign = toward_viewer(right, up)
    keep = np.ones(len(x), bool)
    if args.slice:
        keep = (x[:, depth] >= args.slice[0]) & (x[:, depth] <= args.slice[1])
    order = np.flatnonzero(keep)[np.argsort(sign * x[keep, depth], kind="stable")]
    size = d[order] * unit
    # A rim only where there is room for it: on small circles it would cover the colour.
    points = np.median(size) * points_per_unit if len(size) else 0
    rim = float(np.clip(0.04 * (points - 2), 0, 0.4))
    circles = EllipseCollection(
        size, size, np.zeros(len(order)), units="xy", transOffset=axes.transData,
        offsets=x[order][:, [right, up]] * unit, array=value[order], norm=norm,
        cmap=args.colourMap, edgecolors=(0, 0, 0, 0.5), linewidths=rim)
    axes.add_collection(circles)
    return circles


def sections(args, times, depth):
    """Segments of all walls for each time."""
    source = args.source[0] if os.path.isdir(args.source[0]) else os.path.dirname(args.source[0])
    case = source if os.path.isdir(os.path.join(source, "dem")) else os.path.join(source, "..")
    walls = [Wall(text, case) for text in args.wall]
    level = 0.5 * sum(args.slice) if args.slice else 0.0
    return [np.concatenate([wall.section(time, depth, level) for wall in walls])
            if walls else np.zeros((0, 2, 3)) for time in times]


def window(snapshots, right, up, extent, lines):
    if extent:
        return extent
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for segments in lines:
        if len(segments):
            low = np.minimum(low, segments[..., [right, up]].min(axis=(0, 1)))
            high = np.maximum(high, segments[..., [right, up]].max(axis=(0, 1)))
    for x, d, _ in snapshots:
        if len(x):
            r = 0.5 * d[:, None]
            low = np.minimum(low, (x[:, [right, up]] - r).min(axis=0))
            high = np.maximum(high, (x[:, [right, up]] + r).max(axis=0))
    if not np.all(np.isfinite(low + high)):
        low, high = np.zeros(2), np.ones(2)
    pad = 0.015 * max(high - low)
    return [low[0] - pad, high[0] + pad, low[1] - pad, high[1] + pad]


def colour_norm(snapshots, limits):
    if not limits:
        values = np.concatenate([value for _, _, value in snapshots])
        # The fastest few would wash out all others.
        limits = np.percentile(values, [0.5, 99.5]) if len(values) else (0, 1)
        if limits[0] > 0 and limits[0] < 0.3 * limits[1]:
            limits = (0, limits[1])
        if limits[1] <= limits[0]:
            limits = (limits[0], limits[0] + (abs(limits[0]) or 1))
    return plt.Normalize(*limits)


def lay_out(count, columns, box):
    """Figure, axes as large as a page of 10 x 6 inches lets them be, and points a unit."""
    columns = min(columns or count, count)
    rows = -(-count // columns)
    width, height = box[1] - box[0], box[3] - box[2]
    side, top = 1.7, 0.9  # inches for labels, colour bar, titles
    scale = min((10.5 - side) / (columns * width), (6.0 - top) / (rows * height))
    figure, axes = plt.subplots(
        rows, columns, squeeze=False, sharex=True, sharey=True,
        figsize=(max(columns * width * scale + side, 3.2), max(rows * height * scale + top, 2.0)),
        layout="constrained")
    return figure, axes, 72 * scale


def main():
    args = arguments()
    set_style()
    right, up = AXIS[args.axes[0]], AXIS[args.axes[1]]
    chosen = choose(find_snapshots(args.source), args.count, args.times)
    snapshots = [load(path, args.colour) for _, path in chosen]
    lines = sections(args, [time for time, _ in chosen], toward_viewer(right, up)[0])
    box = np.array(window(snapshots, right, up, args.extent, lines))
    unit, name = (1e3, "mm") if max(box[1] - box[0], box[3] - box[2]) < 1 else (1, "m")
    box = box * unit
    norm = colour_norm(snapshots, args.range)
    figure, axes, points_per_unit = lay_out(len(chosen), args.columns, box)
    for panel in axes.flat[len(chosen):]:
        panel.set_axis_off()
    for panel, (time, _), snapshot, wall in zip(axes.flat, chosen, snapshots, lines):
        panel.add_collection(LineCollection(unit * wall[..., [right, up]], colors="0.3",
                                            linewidths=0.8))
        circles = draw(panel, snapshot, right, up, unit, points_per_unit, norm, args)
        panel.set(xlim=box[:2], ylim=box[2:], aspect="equal", title=f"$t$ = {time:g} s")
        panel.spines[:].set_visible(True)
        panel.label_outer()
    for panel in axes[-1]:
        panel.set_xlabel(f"{args.axes[0]} ({name})")
    for panel in axes[:, 0]:
        panel.set_ylabel(f"{args.axes[1]} ({name})")
    bar = figure.colorbar(circles, ax=axes, shrink=0.8, aspect=30, pad=0.02,
                          extend="max" if not args.range else "neither")
    bar.set_label(LABEL[args.colour][2])
    bar.outline.set_linewidth(0.5)
    if args.title:
        figure.suptitle(args.title, fontsize=11)
    save(figure, args.output, args.dpi)


if __name__ == "__main__":
    main()
