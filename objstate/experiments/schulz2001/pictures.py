"""Pictures like Figs. 3, 6 and 8 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from objstate.building import load_building
from objstate.experiments.placements import placements
from objstate.experiments.plans import (
    ESTIMATE,
    MODEL,
    PATH,
    STRANGER,
    TRUTH,
    draw_leaf,
    draw_legend,
    draw_object,
    draw_plan,
    new_figure,
)
from objstate.experiments.schulz2001.desks import FURNITURE
from objstate.experiments.schulz2001.movable import OBJECT, WORDS
from objstate.experiments.trial import Run, Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from objstate.simulation.scene import Boxes

CORRIDOR = 3.2  # m to both sides of its middle that are shown
AROUND = 0.35  # m to all sides of an object that is shown by itself


def draw_doors(trial: Trial, runs: Sequence[Run]) -> Figure:
    """Fig. 3: the robot's path and the doors, with the paper's step between states."""
    building, run = load_building(trial.scene.building), runs[0]
    figure = new_figure(11.0, 3.4)
    axes = figure.add_subplot()
    draw_plan(axes, building, run.path)
    axes.set_ylim(-CORRIDOR, CORRIDOR)
    for final in run.finals:
        door = building[final.object]
        draw_leaf(axes, door, final.estimate, ESTIMATE, 2.6)
        draw_leaf(axes, door, final.truth, TRUTH, 0.9, length=1.25)
        x, y = door.origin[:2, 3]
        words = f"{degrees(final.estimate):.0f}°"
        axes.text(x, y + 1.5 * np.sign(y), words, ha="center", va="center", fontsize=8)
    axes.set_title(_title("4.1", run), fontsize=9)
    draw_legend(figure, (ESTIMATE, "estimated"), (TRUTH, "true"), (PATH, "robot"))
    return figure


def draw_movable(trial: Trial, runs: Sequence[Run]) -> Figure:
    """Fig. 6: the robot's path past the object, and the object's three states."""
    building, run = load_building(trial.scene.building), runs[0]
    item, placed = building[OBJECT], placements(run.finals)
    figure = new_figure(9.0, 6.0)
    grid = figure.add_gridspec(2, len(WORDS))
    plan = figure.add_subplot(grid[0, :])
    draw_plan(plan, building, run.path)
    draw_object(plan, item, item.home, MODEL, 1.2)
    plan.set_title(_title("4.2", run), fontsize=9)
    for column, each in enumerate(placed[: len(WORDS)]):
        axes = figure.add_subplot(grid[1, column])
        draw_plan(axes, building, run.path)
        draw_object(axes, item, item.home, MODEL, 1.2)
        draw_object(axes, item, each.estimate, ESTIMATE, 2.2)
        draw_object(axes, item, each.truth, TRUTH, 0.9)
        x, y, _ = each.truth
        axes.set(xlim=(x - AROUND, x + AROUND), ylim=(y - AROUND, y + AROUND))
        off = f"{100 * each.off:.1f} cm and {degrees(each.turned):.1f}° off"
        axes.set_title(f"{WORDS[column]} state: {off}", fontsize=9)
    draw_legend(figure, (MODEL, "model"), (ESTIMATE, "estimated"), (TRUTH, "true"), (PATH, "robot"))
    return figure


def draw_desks(trial: Trial, runs: Sequence[Run]) -> Figure:
    """Fig. 8: two offices as the model has them, as they were found, and as they are."""
    building, run = load_building(trial.scene.building), runs[0]
    figure = new_figure(9.0, 6.6)
    axes = figure.add_subplot()
    draw_plan(axes, building, run.path)
    for name in FURNITURE:
        draw_object(axes, building[name], building[name].home, MODEL, 1.2)
    for each in placements(run.finals):
        draw_object(axes, building[each.object], each.estimate, ESTIMATE, 2.0)
        draw_object(axes, building[each.object], each.truth, TRUTH, 0.9)
        x, y, _ = each.truth
        axes.text(x, y, each.object, ha="center", va="center", fontsize=8)
    for box in trial.scene.boxes:
        _draw_box(axes, box)
    axes.set_title(_title("4.3", run), fontsize=9)
    draw_legend(
        figure, (MODEL, "model"), (ESTIMATE, "estimated"), (TRUTH, "true"),
        (STRANGER, "not in the model"), (PATH, "robot"),
    )  # fmt: skip
    return figure


def _draw_box(axes: Axes, box: Boxes) -> None:
    """An obstacle that the model doesn't know, where it has a place of its own."""
    from matplotlib.patches import Rectangle

    if box.pose is None:
        return
    (x, y), (width, depth, _) = (box.pose.x, box.pose.y), box.size
    corner = (x - width / 2, y - depth / 2)
    axes.add_patch(
        Rectangle(
            corner, width, depth, angle=degrees(box.pose.yaw), rotation_point="center",
            fill=False, ec=STRANGER, lw=1.4,
        )
    )  # fmt: skip


def _title(section: str, run: Run) -> str:
    return f"{section}: seed {run.seed}, {run.setting}"
