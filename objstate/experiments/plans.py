"""Plans of buildings, for the pictures of experiments. Needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.building import outline
from objstate.building.model import Building, MovableObject
from objstate.geometry import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CUT = 0.3  # m above the floor, where the lasers are
BELOW_TOP = 0.005  # m below its top, where furniture is as large as people see it
WALL, MODEL, ESTIMATE, TRUTH, PATH, STRANGER = (
    "#7d8b98", "#a9b4be", "#c8553d", "#0b7a75", "#7aa6d1", "#f2b950",
)  # fmt: skip


def new_figure(width: float, height: float) -> Figure:
    """A figure of so many inches, for files alone."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def draw_plan(axes: Axes, building: Building, path: FloatArray) -> None:
    """Walls at laser height, and the robot's path (n, 3)."""
    _add(axes, outline(building.walls, CUT), WALL, 0.8)
    axes.plot(path[:, 0], path[:, 1], color=PATH, lw=1.0, zorder=1)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def draw_object(
    axes: Axes, item: MovableObject, state: FloatArray, colour: str, width: float, **style: Any
) -> None:
    """An object in a state (d,): its outline at laser height and just below its top."""
    place = item.transforms(np.asarray(state)[None])[0]
    top = float(item.mesh.moved(place).vertices[:, 2].max()) - BELOW_TOP
    for height in (CUT, top):
        _add(axes, outline(item.mesh, height, place), colour, width, **style)


def draw_leaf(
    axes: Axes, door: MovableObject, angle: float, colour: str, width: float, length: float = 1.0
) -> None:
    """A hinged door as a line from its hinge; ``length`` in widths of the leaf."""
    leaf = door.mesh.moved(door.transforms(np.array([[angle]]))[0]).vertices[:, :2]
    hinge = door.origin[:2, 3]
    end = hinge + 2 * length * ((leaf.min(axis=0) + leaf.max(axis=0)) / 2 - hinge)
    axes.plot(*np.stack([hinge, end]).T, color=colour, lw=width, solid_capstyle="round")


def draw_legend(figure: Figure, *entries: tuple[str, str]) -> None:
    """What colours mean: pairs of colour and words."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour, lw=2, label=words) for colour, words in entries]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(entries), frameon=False)


def _add(axes: Axes, segments: FloatArray, colour: str, width: float, **style: Any) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(segments), colors=colour, linewidths=width, **style))
