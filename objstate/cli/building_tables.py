"""What is in a building, for people."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table
from objstate.order import natural_key

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.building import BuildingSummary, ObjectSummary


def describe_building(summary: BuildingSummary) -> Iterator[str | Table]:
    """The parts of the description, text and tables, in the order of reading."""
    lower, upper = summary.extent
    sides = " x ".join(f"{high - low:.2f}" for low, high in zip(lower, upper, strict=True))
    yield f"{summary.source}: building '{summary.name}'"
    yield f"Walls: {summary.wall_faces} triangles in {sides} m, from {_point(lower)}"
    yield (
        f"At {summary.height:g} m above the floor: {summary.outline_segments} stretches of wall, "
        f"{summary.outline_length:.1f} m in all"
    )
    yield _object_table(summary) if summary.objects else "No movable objects."


def _object_table(summary: BuildingSummary) -> Table:
    """An object in a row; its outline is what a level laser at the height sees of it."""
    numbers = ("x (m)", "y (m)", "range of states", "reach (m)", "outline (m)")
    title = f"{len(summary.objects)} movable objects"
    table = new_table(title, ("object", "kind"), numbers)
    for item in sorted(summary.objects, key=lambda item: natural_key(item.name)):
        x, y, _ = item.position
        place = (f"{x:z.2f}", f"{y:z.2f}")
        lengths = (f"{item.reach:.2f}", f"{item.outline_length:.2f}")
        table.add_row(item.name, item.kind, *place, _states(item), *lengths)
    return table


def _states(item: ObjectSummary) -> str:
    if item.kind == "planar":
        return "-"
    if item.wraps:
        return "all round"
    if item.kind == "sliding":
        return f"{item.lower:z.2f} to {item.upper:z.2f} m"
    return f"{math.degrees(item.lower):z.0f} to {math.degrees(item.upper):z.0f} deg"


def _point(xyz: tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{value:z.2f}" for value in xyz) + ")"
