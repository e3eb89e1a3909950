"""Pictures like figures 7.2 and 7.5."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from objstate.experiments.darmstadt.accuracy import BEGIN, THREE_AND_A_BOX, watched
from objstate.experiments.darmstadt.coverage import ACTIVE, CELLWISE, SWEEP, Coverage
from objstate.experiments.darmstadt.sectors import SECTORS
from objstate.experiments.darmstadt.setting import BOX, LENGTH, POLE_RADIUS, WIDTH
from objstate.experiments.plans import ESTIMATE, TRUTH, WALL, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EXTENT = (-LENGTH / 2.0, LENGTH / 2.0, -WIDTH / 2.0, WIDTH / 2.0)
FAR = 5.0  # m, how far free sectors are drawn


def draw_models(seconds: float, seed: int) -> Figure:
    """Figure 7.2: the sector model and the grid after some time, with what really stands there."""
    *_, robot = watched(THREE_AND_A_BOX, seed, seconds)
    figure = new_figure(9.0, 3.3)
    left, right = figure.subplots(1, 2)
    bearings = np.arange(SECTORS + 1) * 2.0 * np.pi / SECTORS
    for k in np.flatnonzero(robot.sectors.occupied):
        away = float(np.hypot(*robot.sectors.points[k]))
        arc = np.linspace(bearings[k], bearings[k + 1], 8)
        ring = [
            d * np.column_stack([np.cos(a), np.sin(a)]) for d, a in ((away, arc), (FAR, arc[::-1]))
        ]
        left.fill(*(BEGIN[:2] + np.concatenate(ring)).T, color=WALL, lw=0.0)
    values = robot.grid.values(robot.stamp_ns)
    right.imshow(values, cmap="gray_r", vmin=0, vmax=1, origin="lower", extent=EXTENT)
    for axes, title in ((left, "sector model"), (right, "occupancy grid")):
        _draw_scene(axes)
        axes.set_title(title, fontsize=9)
    return figure


def draw_gazes(found: Sequence[Coverage]) -> Figure:
    """Figure 7.5: paths of the head over one minute of a robot that stands, with the first seed."""
    figure = new_figure(9.0, 5.4)
    shown = (SWEEP, CELLWISE, ACTIVE)
    for axes, name in zip(figure.subplots(3, 1, sharex=True), shown, strict=True):
        run = next(each for each in found if each.behaviour == name and not each.walking)
        pan, tilt = np.degrees(run.path).T
        axes.plot(pan, -tilt, color=ESTIMATE, lw=0.7)
        axes.set(ylabel="tilt (°)", title=name, ylim=(-80, 0))
        axes.title.set_fontsize(9)
        axes.invert_xaxis()  # pan to the left is positive
    axes.set_xlabel("pan (°)")
    return figure


def _draw_scene(axes: Axes) -> None:
    from matplotlib.patches import Circle, Rectangle

    for pole in THREE_AND_A_BOX.poles:
        axes.add_patch(Circle(tuple(pole), 2.0 * POLE_RADIUS, fill=False, color=TRUTH))
    for box in THREE_AND_A_BOX.boxes:
        corner = box - np.array(BOX[:2]) / 2.0
        axes.add_patch(Rectangle(tuple(corner), BOX[0], BOX[1], fill=False, color=TRUTH))
    axes.plot(*BEGIN[:2], "o", color=ESTIMATE, ms=4)
    axes.set(xlim=EXTENT[:2], ylim=EXTENT[2:], aspect="equal", xticks=[], yticks=[])
