"""Draws elfring2014.png: one run of section 7 of Elfring et al. 2014, as in their Figs. 5 and 7.

.venv/bin/python -m pip install -e .[docs]
.venv/bin/python docs/images/elfring2014.py
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from objstate.experiments.elfring2014 import Course, Setup, simulate
from objstate.geometry import IntArray

HERE = Path(__file__).parent
SEED = 0
FROM, LASTING = 400.0, 100.0  # s, the stretch whose path is shown
PLAIN = Setup()
FIXED = replace(PLAIN, strategy="fixed path")
PATHS = {
    "fixed path": FIXED,
    "IG_thr 5, alpha 0.75": replace(PLAIN, gain_threshold=5.0),
    "IG_thr 15, alpha 0.75": replace(PLAIN, gain_threshold=15.0),
    "IG_thr 8, alpha 0.05": replace(PLAIN, cost_weight=0.05),
    "IG_thr 8, alpha 2": replace(PLAIN, cost_weight=2.0),
}
COUNTED = {"coordinator, IG_thr 8, alpha 1": replace(PLAIN, cost_weight=1.0), "fixed path": FIXED}
INK, FAINT, PATH = "#22303c", "#5c6b78", "#7aa6d1"
COLOURS = ("#c8553d", "#a9b4be")


def main() -> None:
    """Simulate one room and draw it."""
    mpl.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9, "text.color": INK})
    figure = plt.figure(figsize=(11, 5.4), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(1.15, 1))
    for axes, (what, setup) in zip(above.subplots(1, len(PATHS)), PATHS.items(), strict=True):
        draw_path(axes, simulate(setup, SEED))
        axes.set_title(what, fontsize=9, color=FAINT)
    courses = {what: simulate(setup, SEED) for what, setup in COUNTED.items()}
    updates, approaches = below.subplots(1, 2)
    draw_counts(updates, "updates", {what: each.updates for what, each in courses.items()})
    draw_counts(approaches, "actions", {what: each.approaches for what, each in courses.items()})
    figure.savefig(HERE / "elfring2014.png", dpi=110, facecolor="white")


def draw_path(axes: Axes, course: Course) -> None:
    """The objects, and where the robot drove for a while."""
    step = PLAIN.assumptions.step
    path = course.robot[round(FROM / step) : round((FROM + LASTING) / step) + 1]
    axes.plot(*path.T, color=PATH, lw=1.0)
    axes.plot(*path[-1], "o", ms=5, color=PATH, mec=INK, mew=0.6)
    axes.plot(*course.objects.T, "s", ms=3.5, color=COLOURS[0])
    axes.set(xlim=(0.0, PLAIN.room), ylim=(0.0, PLAIN.room), xticks=[], yticks=[])
    axes.set_aspect("equal")


def draw_counts(axes: Axes, of: str, counts: dict[str, IntArray]) -> None:
    """Bars of how often something was done, by object."""
    width = 0.8 / len(counts)
    for k, (what, each) in enumerate(counts.items()):
        at = np.arange(1, len(each) + 1) + (k - 0.5) * width
        axes.bar(at, each, width, color=COLOURS[k], label=f"{what}: {each.sum()} {of}")
    axes.set(xticks=np.arange(1, PLAIN.objects + 1), xlabel="object", ylabel=of)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    axes.margins(y=0.35)


if __name__ == "__main__":
    main()
