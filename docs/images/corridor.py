"""Draws corridor.png: what the sample run believes of each door, in the end and on the way: ``make docs``.

The image's metadata hold the angles that it shows, so that a test can tell when they are out of date.
"""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib as mpl
import numpy as np
import polars as pl
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle, Wedge

from objstate.building import load_building, outline
from objstate.building.model import Building, MovableObject
from objstate.evaluation import latest_states
from objstate.evaluation.latest import LatestState
from objstate.geometry import FloatArray
from objstate.recording.tables import read_estimates, read_truth
from objstate.recording.tum import TRAJECTORY, read_tum

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PICTURE = HERE / "corridor.png"
ANGLES = "Description"  # the key of the metadata: JSON of the angle of each door, degrees
LASER_HEIGHT = 0.3  # m
MOMENTS = (16.0, 17.8, 19.2)  # s into the log, at which a stretch of the corridor is shown
STRETCH = ((9.8, 19.9), (-2.6, 2.6))  # m
NAMES_AT = 2.95  # m from the corridor's middle

INK, FAINT, WALL, PATH = "#22303c", "#5c6b78", "#7d8b98", "#7aa6d1"
LEAF, SECTOR, TRUTH = "#c8553d", "#f2b950", "#0b7a75"


def draw_corridor(result: Path) -> None:
    """Draw what a run of the sample log, in a result folder, came to."""
    building = load_building(ROOT / "models" / "corridor" / "corridor.urdf")
    truth = read_truth(ROOT / "logs" / "corridor.truth.csv")
    estimates = read_estimates(result)
    path = read_tum(result / TRAJECTORY)
    begin_ns = int(path.stamps_ns[0])

    mpl.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9, "text.color": INK})
    figure = plt.figure(figsize=(11, 6.1), layout="constrained")
    grid = figure.add_gridspec(2, len(MOMENTS), height_ratios=(1.32, 1))
    plan = figure.add_subplot(grid[0, :])
    states = latest_states(estimates, truth)
    draw(plan, building, states, path.poses, leaf_width=2.2)
    for state in states:
        name(plan, building[state.estimate.object], state)
    (x0, x1), (y0, y1) = STRETCH
    plan.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, ec=FAINT, lw=0.7, ls=":"))
    plan.set_title("every door at the end of the drive", fontsize=9, color=FAINT)
    for column, moment in enumerate(MOMENTS):
        until_ns = begin_ns + round(moment * 1e9)
        known = latest_states(estimates.filter(pl.col("stamp") <= until_ns), truth)
        driven = path.poses[path.stamps_ns <= until_ns]
        axes = figure.add_subplot(grid[1, column])
        draw(axes, building, known, driven, leaf_width=2.6)
        axes.plot(*driven[-1, :2], "o", ms=9, color=PATH, mec=INK, mew=0.6)
        axes.set(xlim=STRETCH[0], ylim=STRETCH[1])
        axes.set_title(f"the dotted stretch after {moment:g} s", fontsize=9, color=FAINT)
    legend(figure)
    angles = {state.estimate.object: round(degrees(state), 1) for state in states}
    about = {ANGLES: json.dumps(angles)}
    figure.savefig(PICTURE, dpi=110, facecolor="white", metadata=about)
    plt.close(figure)


def draw(
    axes: Axes, building: Building, states: list[LatestState], path: FloatArray, leaf_width: float
) -> None:
    """The plan at laser height, the path, and each door: interval, estimate, truth."""
    walls = outline(building.walls, LASER_HEIGHT)
    axes.add_collection(LineCollection(walls, colors=WALL, linewidths=0.8))
    axes.plot(path[:, 0], path[:, 1], color=PATH, lw=1.0, zorder=1)
    for state in states:
        door, estimate = building[state.estimate.object], state.estimate
        width = float(door.mesh.vertices[:, 0].max())
        ends = sorted(np.degrees([bearing(door, a) for a in (estimate.lower, estimate.upper)]))
        axes.add_patch(Wedge(door.origin[:2, 3], 1.2 * width, *ends, color=SECTOR, alpha=0.6, lw=0))
        style = {"color": LEAF, "lw": leaf_width, "solid_capstyle": "round"}
        axes.plot(*leaf(door, estimate.value, width), **style)
        if state.truth is not None:
            axes.plot(*leaf(door, state.truth, 1.2 * width), color=TRUTH, lw=0.9)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def bearing(door: MovableObject, angle: float) -> float:
    """Where a leaf points from its hinge at an opening angle, rad; it grows without wrapping."""
    closed = door.transforms(np.zeros((1, 1)))[0]
    turn = (door.origin[:3, :3] @ door.axis)[2]
    return float(np.arctan2(closed[1, 0], closed[0, 0]) + turn * angle)


def leaf(door: MovableObject, angle: float, length: float) -> FloatArray:
    """Both ends (2, 2) of a line from the hinge: x of each, y of each."""
    hinge, direction = door.origin[:2, 3], bearing(door, angle)
    return np.stack([hinge, hinge + length * np.array([np.cos(direction), np.sin(direction)])]).T


def degrees(state: LatestState) -> float:
    """The estimated angle of a door."""
    return float(np.degrees(state.estimate.value))


def name(axes: Axes, door: MovableObject, state: LatestState) -> None:
    """The door's number and angle, in its room."""
    x, y = leaf(door, 0.0, 0.45)[:, 1]
    label = f"{door.name.removeprefix('door_')}: {degrees(state):.0f}°"
    axes.text(x, np.sign(y) * NAMES_AT, label, ha="center", va="center")


def legend(figure: Figure) -> None:
    """What the colours mean."""
    figure.legend(
        handles=[
            Line2D([], [], color=LEAF, lw=3, label="estimated leaf"),
            Patch(color=SECTOR, alpha=0.6, label="90 % interval"),
            Line2D([], [], color=TRUTH, lw=1.0, label="true direction"),
            Line2D([], [], color=PATH, lw=1.2, label="the robot's estimated path"),
        ],
        loc="outside lower center",
        ncols=4,
        frameon=False,
    )
