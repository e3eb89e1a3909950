"""Candidates for objects, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.recording.candidates import Found


def candidates_table(found: Sequence[Found]) -> Table:
    """Obstacles that are not in the building, the most probable first."""
    numbers = ("x (m)", "y (m)", "yaw (deg)", "length (m)", "width (m)", "real %", "looks")
    table = new_table("Not in the building", ("name",), numbers)
    for each in found:
        figures = (each.x, each.y)
        table.add_row(
            each.name,
            *(f"{figure:.2f}" for figure in figures),
            f"{degrees(each.yaw):.0f}",
            f"{each.length:.2f}",
            f"{each.width:.2f}",
            percent(each.probability),
            str(each.looks),
        )
    return table
