"""Doors as the page has them: hinge, bearing, width and limit, and the decision."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from objstate.building.door_table import PROBABLE, SLIDES, Door
from objstate.building.leaves import leaf_of_door
from objstate.building.model import Kind, Mesh, MovableObject
from objstate.config import Strict
from objstate.geometry import FloatArray

THICKNESS, HEIGHT = 0.04, 2.0  # m, of a leaf that wasn't drawn
UPRIGHT = 1e-6  # of a hinge's unit axis, by which it may lean
THICKEST = 0.15  # m: what is thicker is no leaf that slides
SAME = 1e-4  # m and degrees: rounding, not editing

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
    in_map: Annotated[float, Field(ge=0, lt=360)] | None = None  # degrees, see ``Door``
    # m, middle of the closed leaf before a person moved it; None of a door that a person drew
    found_at: tuple[Coordinate, Coordinate] | None = None

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
            in_map=None if self.in_map is None else math.radians(self.in_map),
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
            in_map=None if door.in_map is None else round(math.degrees(door.in_map), 1),
        )


class Edits(Strict):
    """All doors that can be edited, as the page sends them."""

    doors: list[DoorRow]


def row_of(item: MovableObject) -> DoorRow | None:
    """A door of a building; None for what is no upright leaf with closed as one of its limits."""
    is_door = item.kind is not Kind.PLANAR and not item.wraps
    if not is_door or (item.lower == 0.0) == (item.upper == 0.0):
        return None
    closed = item.mesh.moved(item.transforms(np.zeros((1, 1)))[0])
    if not len(closed.faces):
        return None
    door = (_turning if item.kind is Kind.HINGED else _sliding)(item, closed)
    return None if door is None else DoorRow.of(door)


def _turning(item: MovableObject, closed: Mesh) -> Door | None:
    """A door with a closed leaf, if it turns about an upright hinge."""
    offsets = closed.vertices[:, :2] - item.hinge
    way = _along(closed)
    along = float((offsets.min(axis=0) + offsets.max(axis=0)) / 2 @ way)
    if abs(abs(item.direction[2]) - 1.0) >= UPRIGHT or abs(along) < UPRIGHT:
        return None
    way = math.copysign(1.0, along) * way
    return Door(
        name=item.name,
        hinge=item.hinge,
        closed_bearing=math.atan2(way[1], way[0]),
        sense=1 if (item.upper or item.lower) * item.direction[2] > 0 else -1,
        width=float((offsets @ way).max()),
        upper=abs(item.upper or item.lower),
    )


def _along(leaf: Mesh) -> FloatArray:
    """(2,) the level unit vector along an upright leaf, in one of its two directions.

    The least area of the leaf's faces looks that way. Handles have little area beside the two broad
    faces, so that they hardly turn it.
    """
    corner, second, third = (leaf.vertices[leaf.faces[:, k]] for k in range(3))
    normals = np.cross(second - corner, third - corner)
    areas = np.linalg.norm(normals, axis=1)
    level = normals[areas > 0.0, :2]
    _, directions = np.linalg.eigh((level / areas[areas > 0.0, None]).T @ level)
    return np.asarray(directions[:, 0])


def _sliding(item: MovableObject, closed: Mesh) -> Door | None:
    """The same of one that slides along itself, on a level rail."""
    if abs(item.direction[2]) >= UPRIGHT:
        return None
    opens = item.direction[:2] if item.upper else -item.direction[:2]
    beside = np.array([-opens[1], opens[0]])
    along, across = closed.vertices[:, :2] @ opens, closed.vertices[:, :2] @ beside
    width = float(np.ptp(along))
    if np.ptp(across) > min(THICKEST, width):
        return None
    return Door(
        name=item.name,
        hinge=along.max() * opens + (across.min() + across.max()) / 2.0 * beside,
        closed_bearing=math.atan2(-opens[1], -opens[0]),
        sense=SLIDES,
        width=width,
        upper=abs(item.upper or item.lower),
    )


def leaf_of(row: DoorRow, before: MovableObject | None) -> MovableObject:
    """The object of a row: the one before with its name and limit, or a box where it hangs anew."""
    door = DoorRow.of(row.door).door  # rounded as in a door table
    old = None if before is None else row_of(before)
    if before is None or old is None:
        return leaf_of_door(door, THICKNESS, HEIGHT)
    if not hangs_alike(old, row):
        top = float((before.mesh.vertices @ before.origin[2, :3] + before.origin[2, 3]).max())
        return leaf_of_door(door, THICKNESS, top if top > 0 else HEIGHT)
    if abs(old.upper - row.upper) < SAME:
        return before if before.name == row.name else replace(before, name=row.name)
    lower, upper = (0.0, door.upper) if before.upper else (-door.upper, 0.0)
    return replace(before, name=row.name, lower=lower, upper=upper)


def hangs_alike(one: DoorRow, other: DoorRow) -> bool:
    """Whether hinge, closed bearing, width and sense are the same."""
    if one.sense != other.sense:
        return False
    turn = (one.bearing - other.bearing + 180.0) % 360.0 - 180.0
    lengths = ("x", "y", "width")
    return abs(turn) < SAME and all(
        abs(getattr(one, key) - getattr(other, key)) < SAME for key in lengths
    )
