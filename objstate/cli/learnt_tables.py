"""What was learnt of a building, as tables and lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.discovery import Candidate, Learnt, Refined
    from objstate.world.places import PlaceStatics

NUMBERS = ("prob.", "hinge (m)", "bearing (deg)", "width (m)", "opens", "seen (deg)")


def describe_found(learnt: Learnt) -> Iterator[str | Table]:
    """The doors that were found in a map."""
    from objstate.discovery.candidates import LEAST

    if learnt.candidates:
        table = new_table(f"{len(learnt.candidates)} candidates", ("door",), NUMBERS)
        for each in learnt.candidates:
            table.add_row(each.door.name, *_cells(each))
        yield table
    else:
        yield "No doors found."
    if learnt.passed_over:
        yield (
            f"{learnt.passed_over} of {learnt.openings} openings weren't weighed as doors: each lies "
            f"in a line that is a wall with less than {100 * LEAST:.0f} % probability (learn.json "
            "lists them)."
        )


def _cells(each: Candidate) -> Iterator[str]:
    door, (x, y), bearing = each.door, each.door.hinge, math.degrees(each.door.closed_bearing)
    least, most = min(each.angles), max(each.angles)
    yield f"{each.probability:.3f}"
    yield f"{x:z.2f}, {y:z.2f} ± {each.hinge_deviation:.2f}"
    yield f"{bearing:z.1f} ± {math.degrees(each.bearing_std):.1f}"
    yield f"{door.width:.2f}"
    yield door.opens
    if door.slides:
        yield _range(f"{least:.2f}", f"{most:.2f}") + " m"
    else:
        yield _range(f"{math.degrees(least):.0f}", f"{math.degrees(most):.0f}")


def _range(least: str, most: str) -> str:
    return least if least == most else f"{least} to {most}"


def describe_refined(refined: Refined) -> Iterator[str | Table]:
    """Where doors, walls and lasers are, beside the model."""
    numbers = ("drives", "hinge x, y (cm)", "bearing (deg)", "wider (cm)")
    drives = f"{refined.drives} drive{'s' if refined.drives != 1 else ''}"
    table = new_table(drives, ("door",), numbers)
    for each in refined.doors:
        table.add_row(
            each.name,
            str(each.drives),
            f"{100.0 * each.hinge[0]:+.1f}, {100.0 * each.hinge[1]:+.1f} "
            f"± {100.0 * each.hinge_std:.1f}",
            f"{math.degrees(each.bearing):+.2f} ± {math.degrees(each.bearing_std):.2f}",
            f"{100.0 * each.width:+.1f} ± {100.0 * each.width_std:.1f}",
        )
    yield table
    if refined.furniture:
        yield _pieces(refined.furniture)
    walls = refined.walls
    yield (
        f"Walls differ from the model by {100.0 * walls.wall_std:.1f} cm, and are known to "
        f"{100.0 * walls.remaining_std:.1f} cm."
    )
    for laser in refined.lasers:
        yaw, std = math.degrees(laser.correction[2]), math.degrees(laser.std[2])
        yield f"Laser {laser.frame} is turned by {yaw:+.2f} ± {std:.2f} degrees."
    if refined.silent:
        yield f"No drive tells of {', '.join(refined.silent)}."


def _pieces(furniture: Sequence[PlaceStatics]) -> Table:
    """Where furniture stands that is fixed."""
    numbers = ("drives", "fixed (%)", "x, y (cm)", "yaw (deg)")
    table = new_table("Furniture", ("piece",), numbers)
    for each in furniture:
        (x, y, yaw), std = each.moved.tolist(), each.std
        table.add_row(
            each.name,
            str(each.drives),
            f"{100.0 * each.fixed:.0f}",
            f"{100.0 * x:+.1f}, {100.0 * y:+.1f} ± {100.0 * each.place_std:.1f}",
            f"{math.degrees(yaw):+.1f} ± {math.degrees(std[2]):.1f}",
        )
    return table
