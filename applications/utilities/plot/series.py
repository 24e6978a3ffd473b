# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw columns of CSV time series, one below the other, several runs in one figure."""
import argparse
import os
import sys

import numpy as np

from style import plt, save, set_style


def arguments():
    parser = argparse.ArgumentParser(
        prog="felmiPlotSeries", description=__doc__,
        formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="FILE[=NAME]",
                        help="CSV file, with the name to show in the legend")
    parser.add_argument("--columns", "-c", default="",
                        help="columns to draw, as kineticEnergy,contacts; a+b: both in one panel")
    parser.add_argument("--list", action="store_true", help="list the columns and stop")
    parser.add_argument("--output", "-o", default="series.png", help="picture to write")
    parser.add_argument("--against", "-x", default="", help="column along x; default: the first")
    parser.add_argument("--from", dest="start", type=float, help="draw from this x on")
    parser.add_argument("--to", dest="end", type=float, help="draw to this x")
    parser.add_argument("--mean", type=float, metavar="X",
                        help="dashed line at the mean (over x) from X on, with its value")
    parser.add_argument("--reference", action="append", default=[], metavar="COLUMN=VALUE",
                        help="grey line at a value; may be repeated")
    parser.add_argument("--log", action="store_true", help="logarithmic upwards")
    parser.add_argument("--title", default="")
    parser.add_argument("--width", type=float, default=6.5, help="inches")
    parser.add_argument("--height", type=float, default=2.2, help="inches a panel")
    parser.add_argument("--dpi", type=int, default=200)
    return parser.parse_args()


def stop(text):
    sys.exit(f"felmiPlotSeries: {text}")


def read(path):
    """Columns by name, and their units if a comment gives one for each."""
    comments, names, rows = [], None, []
    try:
        with open(path) as file:
            for number, line in enumerate(file, 1):
                if line.startswith("#"):
                    comments.append(line[1:].strip().split(","))
                elif names is None:
                    names = [word.strip() for word in line.split(",")]
                elif line.strip():
                    row = line.split(",")
                    if len(row) != len(names):  # a run that is being written, or was killed
                        print(f"{path}:{number}: {len(row)} values, {len(names)} columns: "
                              "left out", file=sys.stderr)
                        continue
                    rows.append(row)
        data = np.array(rows, float).reshape(len(rows), len(names or []))
    except OSError as error:
        stop(f"{path}: {error.strerror}")
    except ValueError as error:
        stop(f"{path}: {error}")
    if names is None or len(rows) == 0:
        stop(f"{path}: no data")
    units = next((c for c in comments if len(c) == len(names)), [""] * len(names))
    return ({name: data[:, i] for i, name in enumerate(names)},
            {name: unit.strip() for name, unit in zip(names, units)}, names)


def label_of(path, paths):
    """What tells a path from the others: its folders without those that all share."""
    parts = [os.path.normpath(p).split(os.sep) for p in paths]
    mine = os.path.normpath(path).split(os.sep)
    while all(len(p) > 1 for p in parts) and len({p[0] for p in parts}) == 1:
        parts, mine = [p[1:] for p in parts], mine[1:]
    while all(len(p) > 1 for p in parts) and len({p[-1] for p in parts}) == 1:
        parts, mine = [p[:-1] for p in parts], mine[:-1]
    return "/".join(mine)


def column(data, name, path):
    if name not in data:
        stop(f"{path}: no column '{name}'; there are {', '.join(data)}")
    return data[name]


def mean_line(panel, x, y, start, colour):
    late = x >= start
    if late.sum() < 2:
        return
    integral = np.sum(0.5 * (y[late][1:] + y[late][:-1]) * np.diff(x[late]))
    mean = integral / (x[late][-1] - x[late][0])
    panel.plot([x[late][0], x[late][-1]], [mean, mean], "--", color=colour, linewidth=0.9)
    panel.annotate(f"{mean:.4g}", (x[late][-1], mean), xytext=(3, 0), color=colour, fontsize=7,
                   textcoords="offset points", va="center", annotation_clip=False)


def draw(panel, group, runs, args):
    for name in group:
        for label, path, (data, _, names) in runs:
            x, y = column(data, args.against or names[0], path), column(data, name, path)
            keep = np.ones(len(x), bool)
            if args.start is not None:
                keep &= x >= args.start
            if args.end is not None:
                keep &= x <= args.end
            text = label if len(group) == 1 else name if len(runs) == 1 else f"{label} {name}"
            line, = panel.plot(x[keep], y[keep], label=text)
            if args.mean is not None:
                mean_line(panel, x[keep], y[keep], args.mean, line.get_color())
    for reference in args.reference:
        name, _, value = reference.partition("=")
        if name in group:
            try:
                panel.axhline(float(value), color="0.55", linewidth=0.8, zorder=0)
            except ValueError:
                stop(f"--reference {reference}: accepted is COLUMN=VALUE")
    unit = runs[0][2][1].get(group[0], "")
    panel.set_ylabel(", ".join(group) + (f" ({unit})" if unit not in ("", "-") else ""))
    if args.log:
        panel.set_yscale("log")


def main():
    args = arguments()
    set_style()
    pairs = [text.partition("=") for text in args.files]
    paths = [path for path, _, _ in pairs]
    runs = [(name or label_of(path, paths), path, read(path)) for path, _, name in pairs]
    names = runs[0][2][2]
    if args.list:
        print("\n".join(names))
        return
    groups = [g.split("+") for g in args.columns.split(",")] if args.columns else \
        [[name] for name in names[1:5]]
    figure, panels = plt.subplots(len(groups), 1, squeeze=False, sharex=True, layout="constrained",
                                  figsize=(args.width, args.height * len(groups) + 0.4))
    for panel, group in zip(panels[:, 0], groups):
        draw(panel, group, runs, args)
        panel.margins(x=0)
    if len(runs) > 1 or any(len(g) > 1 for g in groups):
        for i, panel in enumerate(panels[:, 0]):
            if i == 0 or len(groups[i]) > 1:
                panel.legend(loc="best")
    x_name = args.against or names[0]
    unit = runs[0][2][1].get(x_name, "")
    unit = unit or ("s" if x_name == "time" else "")
    panels[-1, 0].set_xlabel(x_name + (f" ({unit})" if unit else ""))
    if args.title:
        figure.suptitle(args.title, fontsize=11)
    save(figure, args.output, args.dpi)


if __name__ == "__main__":
    main()
