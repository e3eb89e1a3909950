"""Doors as the page has them: hinge, bearing, width and limit, and the decision."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from objstate.building.door_table import SLIDES, Door
from objstate.building.leaves import leaf_of_door
from objstate.building.model import Kind, MovableObject
from objstate.config import Strict
from objstate.geometry import FloatArray

THICKNESS, HEIGHT = 0.04, 2.0  # m, of a leaf that wasn't drawn
UPRIGHT = 1e-6  # of a hinge's unit axis, by which it may lean
THICKEST = 0.15  # m: what is thicker is no leaf that slides
SAME = 1e-4  # m and degrees: rounding, not editing
PROBABLE = 0.5  # an undecided candidate is in the building from this probability on

PLAIN = r"^[^\x00-\x1f\x7f]*$"  # what XML and tables can hold on one line
Coordinate = Annotated[float, Field(ge=-1e8, le=1e8)]  # m
Decision = Literal["kept", "accepted", "rejected", "open"]


class DoorRow(Strict):
    """One door. The hinge of one that slides is its leaf's end past which it slides open."""

    name: Annotated[str, Field(pattern=PLAIN)]
    x: Coordinate  # m, of the hinge
    y: Coordinate
    bearing: Annotated[float, Field(ge=-1e4, le=1e4)]  # degrees, of the closed leaf
    width: Annotated[float, Field(gt=0, le=100)]  # m
    upper: Annotated[float, Field(gt=0, lt=360)]  # degrees; m, if it slides
    sense: Literal[1, -1, 0]  # 1 opens counter-clockwise seen from above, 0 slides
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
            upper=self.upper if self.sense == SLIDES else math.radians(self.upper),
        )

    @staticmethod
    def of(door: Door) -> DoorRow:
        """The row of a door of a table; to be decided on, if that has a probability."""
        bearing = round(math.degrees(door.closed_bearing), 3)
        return DoorRow(
            name=door.name,
            x=round(float(door.hinge[0]), 4),
            y=round(float(door.hinge[1]), 4),
            bearing=round(180.0 - (180.0 - bearing) % 360.0, 3),  # 180 and -180 are one
            width=round(door.width, 4),
            upper=round(door.upper, 4) if door.slides else round(math.degrees(door.upper), 3),
            sense=0 if door.slides else 1 if door.sense > 0 else -1,
            decision="kept" if door.probability is None else "open",
            probability=door.probability,
        )


class Edits(Strict):
    """All doors that can be edited, as the page sends them."""

    doors: list[DoorRow]


def row_of(item: MovableObject) -> DoorRow | None:
    """A door of a building; None for what is no upright leaf with closed as one of its limits."""
    is_door = item.kind is not Kind.PLANAR and not item.wraps
    if not is_door or (item.lower != 0.0 and item.upper != 0.0):
        return None
    closed = item.mesh.moved(item.transforms(np.zeros((1, 1)))[0]).vertices[:, :2]
    if not len(closed):
        return None
    door = (_turning if item.kind is Kind.HINGED else _sliding)(item, closed)
    return None if door is None else DoorRow.of(door)


def _turning(item: MovableObject, closed: FloatArray) -> Door | None:
    """A door whose closed leaf has the vertices (n, 2) m, if it turns about an upright hinge."""
    way = (closed.min(axis=0) + closed.max(axis=0)) / 2 - item.hinge
    length = float(np.hypot(*way))
    if abs(abs(item.direction[2]) - 1.0) >= UPRIGHT or length < UPRIGHT:
        return None
    return Door(
        name=item.name,
        hinge=item.hinge,
        closed_bearing=math.atan2(way[1], way[0]),
        sense=1 if (item.upper or item.lower) * item.direction[2] > 0 else -1,
        width=float(((closed - item.hinge) @ way).max() / length),
        upper=abs(item.upper or item.lower),
    )


def _sliding(item: MovableObject, closed: FloatArray) -> Door | None:
    """The same of one that slides along itself, on a level rail."""
    if abs(item.direction[2]) >= UPRIGHT:
        return None
    opens = item.direction[:2] if item.upper else -item.direction[:2]
    along, across = closed @ opens, closed @ np.array([-opens[1], opens[0]])
    width = float(np.ptp(along))
    if np.ptp(across) > min(THICKEST, width):
        return None
    aside = (across.min() + across.max()) / 2.0
    return Door(
        name=item.name,
        hinge=along.max() * opens + aside * np.array([-opens[1], opens[0]]),
        closed_bearing=math.atan2(-opens[1], -opens[0]),
        sense=SLIDES,
        width=width,
        upper=abs(item.upper or item.lower),
    )


def leaf_of(row: DoorRow, before: MovableObject | None) -> MovableObject:
    """The object of a row; the same as before where nothing was edited."""
    if before is None:
        return leaf_of_door(row.door, THICKNESS, HEIGHT)
    old = row_of(before)
    if old is not None and _is_same(old, row):
        return before
    top = float((before.mesh.vertices @ before.origin[2, :3] + before.origin[2, 3]).max())
    return leaf_of_door(row.door, THICKNESS, top if top > 0 else HEIGHT)


def _is_same(one: DoorRow, other: DoorRow) -> bool:
    if one.sense != other.sense:
        return False
    turn = (one.bearing - other.bearing + 180.0) % 360.0 - 180.0
    keys = ("x", "y", "width", "upper")
    return abs(turn) < SAME and all(abs(getattr(one, k) - getattr(other, k)) < SAME for k in keys)
