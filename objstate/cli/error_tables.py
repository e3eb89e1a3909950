"""The tables of an evaluation."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.bound import BoundErrors
    from objstate.evaluation import (
        CoordinateErrors,
        Distances,
        MovementErrors,
        RobotErrors,
        StateErrors,
    )

UNITS = {"rad": ("deg", 180 / math.pi), "m": ("cm", 100.0)}  # as people read errors

NUMBERS = ("n", "mean", "median", "p90", "bias", "<5", "<10", "in 90%")

LEGEND = (
    "Absolute errors; bias is estimate minus truth. <5, <10: % of errors of at most 5 and\n"
    "10 deg or cm. in 90%: % of truths inside the 90 % intervals."
)

MOVEMENTS_LEGEND = (
    "true: of objects that were observed before and after. found: a movement is told in their time.\n"
    "false: told in whose time there was none."
)

ROBOT_LEGEND = (
    "Position's rms is the absolute trajectory error (ATE). after 1 m: error of the movement along\n"
    "each metre of way; its rms is the relative pose error (RPE)."
)

BOUND_LEGEND = (
    "Roots of mean squares. ratio: error by bound. typical: the same of the median error, which\n"
    "is 1 at the bound, however far off a few are."
)


def errors_table(
    title: str, entries: Iterable[tuple[CoordinateErrors, StateErrors | None]]
) -> Table:
    """Errors of each coordinate of each object, and of all; what has no errors is left out."""
    table = new_table(title, ("object", "state"), NUMBERS)
    for entry, errors in entries:
        if errors is not None:
            cells = error_cells(entry.coordinate, entry.unit, errors)
            table.add_row(entry.object or "all", *cells)
    return table


def movements_table(entries: Iterable[MovementErrors]) -> Table:
    """True movements beside those that were found."""
    table = new_table("Movements", ("object",), ("true", "found", "missed", "false"))
    for entry in entries:
        counts = entry.count, entry.found, entry.count - entry.found, entry.false
        table.add_row(entry.object or "all", *map(str, counts))
    return table


def bound_table(entries: Iterable[BoundErrors]) -> Table:
    """Final errors beside the least possible, of each coordinate of each object, and of all."""
    title = "Beside the Cramér-Rao bound, when last observed"
    table = new_table(title, ("object", "state"), ("n", "error", "bound", "ratio", "typical"))
    for entry in entries:
        unit, factor = UNITS[entry.unit]
        table.add_row(
            entry.object or "all",
            f"{entry.coordinate} ({unit})",
            str(entry.count),
            f"{factor * entry.error:.2f}",
            f"{factor * entry.bound:.2f}",
            f"{entry.ratio:.1f}",
            f"{entry.typical_ratio:.1f}" if entry.object is None else "",
        )
    return table


def robot_table(robot: RobotErrors) -> Table:
    """The robot's own error."""
    title = f"The robot itself, {robot.count} poses"
    if robot.aligned_by is not None:
        x, y, yaw = robot.aligned_by
        title += f", moved by ({x:.3f}, {y:.3f}) m and {math.degrees(yaw):.2f} deg"
    table = new_table(title, ("error",), ("rms", "mean", "median", "p90", "at the end"))
    table.add_row("position (m)", *_distances(robot.position, 1.0, decimals=3))
    table.add_row("yaw (deg)", *_distances(robot.yaw, 180 / math.pi, decimals=2))
    if robot.relative_position is not None and robot.relative_yaw is not None:
        table.add_row("after 1 m (m)", *_distances(robot.relative_position, 1.0, decimals=3))
        table.add_row("after 1 m (deg)", *_distances(robot.relative_yaw, 180 / math.pi, decimals=2))
    return table


def error_cells(coordinate: str, si_unit: str, errors: StateErrors) -> list[str]:
    """The cells below "state" and NUMBERS."""
    unit, factor = UNITS[si_unit]
    lengths = (errors.mean, errors.median, errors.p90, errors.bias)
    shares = (errors.within_near, errors.within_far, errors.coverage)
    return [
        f"{coordinate} ({unit})",
        str(errors.count),
        *(f"{factor * length:z.1f}" for length in lengths),
        *map(percent, shares),
    ]


def _distances(distances: Distances, factor: float, decimals: int) -> list[str]:
    figures = (distances.rms, distances.mean, distances.median, distances.p90, distances.end)
    return [f"{factor * figure:.{decimals}f}" for figure in figures]
