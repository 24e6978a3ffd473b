# SPDX-License-Identifier: GPL-3.0-or-later
"""The look that the project's figures share."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the backend is chosen)

# Okabe & Ito's palette: told apart by all kinds of colour vision.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]


def set_style():
    plt.rcParams.update({
        "font.family": "sans-serif",
        "font.size": 9,
        "axes.titlesize": 9,
        "axes.labelsize": 9,
        "axes.linewidth": 0.7,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.prop_cycle": plt.cycler(color=COLOURS),
        "lines.linewidth": 1.1,
        "legend.frameon": False,
        "legend.fontsize": 8,
        "xtick.labelsize": 8,
        "ytick.labelsize": 8,
        "savefig.facecolor": "white",
        "figure.dpi": 100,
    })


def save(figure, path, dpi):
    """Write a figure; the usual reason of failure is a folder that is not there."""
    try:
        figure.savefig(path, dpi=dpi)
    except OSError as error:
        raise SystemExit(f"cannot write {path}: {error.strerror}")
    print(path)
