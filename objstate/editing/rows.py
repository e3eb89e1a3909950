"""Doors as the page has them: hinge, bearing, width and limit, and what a person decided of each."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from objstate.building.door_table import Door
from objstate.building.leaves import hinged
from objstate.building.model import Kind, MovableObject
from objstate.config import Strict

THICKNESS, HEIGHT = 0.04, 2.0  # m, of a leaf that wasn't drawn
UPRIGHT = 1e-6  # of a hinge's unit axis, by which it may lean
SAME = 1e-4  # m and degrees: rounding, not editing
PROBABLE = 0.5  # an undecided candidate is in the building from this probability on

PLAIN = r"^[^\x00-\x1f\x7f]*$"  # what XML and tables can hold on one line
Coordinate = Annotated[float, Field(ge=-1e8, le=1e8)]  # m
Decision = Literal["kept", "accepted", "rejected", "open"]


class DoorRow(Strict):
    """One hinged door."""

    name: Annotated[str, Field(pattern=PLAIN)]
    x: Coordinate  # m, of the hinge
    y: Coordinate
    bearing: Annotated[float, Field(ge=-1e4, le=1e4)]  # degrees, of the closed leaf
    width: Annotated[float, Field(gt=0, le=100)]  # m
    upper: Annotated[float, Field(gt=0, lt=360)]  # degrees
    sense: Literal[1, -1]  # 1 opens counter-clockwise seen from above
    decision: Decision = "kept"  # accepted: a person said so, or drew it
    probability: Annotated[float, Field(ge=0, le=1)] | None = None  # of a candidate

    @property
    def is_taken(self) -> bool:
        """Whether the building has this door."""
        if self.decision == "open":
            return (self.probability or 0.0) >= PROBABLE
        return self.decision != "rejected"

    @property
    def door(self) -> Door:
        """As a door table has it."""
        return Door(
            name=self.name,
            hinge=np.array([self.x, self.y]),
            closed_bearing=math.radians(self.bearing),
            sense=self.sense,
            width=self.width,
            upper=math.radians(self.upper),
        )


class Edits(Strict):
    """All doors that can be edited, as the page sends them."""

    doors: list[DoorRow]


def row_of(item: MovableObject) -> DoorRow | None:
    """A door of a building; None for what isn't hinged upright with closed as one of its limits."""
    is_upright = item.kind is Kind.HINGED and abs(abs(item.direction[2]) - 1.0) < UPRIGHT
    if not is_upright or item.wraps or (item.lower != 0.0 and item.upper != 0.0):
        return None
    closed = item.mesh.moved(item.transforms(np.zeros((1, 1)))[0]).vertices[:, :2] - item.hinge
    if not len(closed):
        return None
    way = (closed.min(axis=0) + closed.max(axis=0)) / 2
    length = float(np.hypot(*way))
    if length < UPRIGHT:
        return None
    width = float((closed @ way).max() / length)
    swing = item.upper if item.upper else item.lower
    return DoorRow(
        name=item.name,
        x=round(float(item.hinge[0]), 4),
        y=round(float(item.hinge[1]), 4),
        bearing=round(math.degrees(math.atan2(way[1], way[0])), 3),
        width=round(width, 4),
        upper=round(abs(math.degrees(swing)), 3),
        sense=1 if swing * item.direction[2] > 0 else -1,
    )


def leaf_of(row: DoorRow, before: MovableObject | None) -> MovableObject:
    """The object of a row; the same as before where nothing was edited."""
    if before is None:
        return hinged(row.door, THICKNESS, HEIGHT)
    old = row_of(before)
    if old is not None and _is_same(old, row):
        return before
    top = float((before.mesh.vertices @ before.origin[2, :3] + before.origin[2, 3]).max())
    return hinged(row.door, THICKNESS, top if top > 0 else HEIGHT)


def _is_same(one: DoorRow, other: DoorRow) -> bool:
    if one.sense != other.sense:
        return False
    turn = (one.bearing - other.bearing + 180.0) % 360.0 - 180.0
    keys = ("x", "y", "width", "upper")
    return abs(turn) < SAME and all(abs(getattr(one, k) - getattr(other, k)) < SAME for k in keys)
