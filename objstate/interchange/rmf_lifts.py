"""Lifts of an Open-RMF building: sliding doors on each level, and the cabin behind.

The cabin is a fixed part of each level: its walls are in sight only while the doors are open, and
then it is there. Source: rmf_building_map_tools (Lift, LiftDoor).
"""

from __future__ import annotations

import numpy as np

from objstate.building.leaves import sliding
from objstate.building.model import MovableObject
from objstate.geometry import FloatArray, compose
from objstate.interchange.imported import Notes, several
from objstate.interchange.rmf_file import Lift, LiftDoor, RmfBuilding
from objstate.interchange.rmf_frames import Frame

GAP = 0.05  # m between the shaft's door and the cabin
CABIN_WALL = 0.05  # m, their thickness
DOOR_THICKNESS, DOOR_HEIGHT = 0.03, 2.5  # m
SLIDING = range(1, 5)  # door types of rmf_building_map_msgs/Door that slide; all are made double


def lifts_of(
    source: RmfBuilding, level: str, places: dict[str, Frame], notes: Notes
) -> tuple[list[FloatArray], list[MovableObject]]:
    """The outlines (m, 2) of cabins, and the leaves of doors, that lifts have on a level."""
    cabins: list[FloatArray] = []
    leaves: list[MovableObject] = []
    served = 0
    for name, lift in source.lifts.items():
        doors = {n: lift.doors[n] for n in lift.level_doors.get(level, []) if n in lift.doors}
        if not doors:
            continue
        served += 1
        reference = lift.reference_floor_name or source.reference_level_name
        frame = places[reference] if reference in places else next(iter(places.values()))
        pose = np.array([*frame.place((lift.x, lift.y)), lift.yaw])
        cabins += [_placed(pose, outline) for outline in _cabin(lift)]
        for door, what in doors.items():
            if what.door_type not in SLIDING:
                notes.left.append(
                    f"Level '{level}': door '{door}' of lift '{name}', whose type {what.door_type} "
                    "doesn't slide."
                )
                continue
            leaves += _shaft_door(f"{name}_{door}", lift, what, pose)
    if served:
        notes.taken.append(
            f"Level '{level}': {several(served, 'lift')}, with {several(len(leaves), 'leaf', 'leaves')} of "
            "shaft doors, and a cabin as if it stood there. The cabin's own doors are not taken: they "
            "move with those of the shaft."
        )
    return cabins, leaves


def _shaft_door(name: str, lift: Lift, door: LiftDoor, pose: FloatArray) -> list[MovableObject]:
    """The two leaves of a shaft's door, which open from its middle."""
    side, sign = _side(lift, door)
    x, y = door.x, door.y
    if side == "x":
        x = sign * (lift.width / 2 + GAP)
    else:
        y = sign * (lift.depth / 2 + GAP)
    middle = compose(pose, np.array([x, y, door.motion_axis_orientation]))
    along = door.width / 2 * np.array([np.cos(middle[2]), np.sin(middle[2])])
    start = middle[:2]
    return [
        sliding(f"{name}_right", start, start + along, DOOR_THICKNESS, DOOR_HEIGHT),
        sliding(f"{name}_left", start, start - along, DOOR_THICKNESS, DOOR_HEIGHT),
    ]


def _side(lift: Lift, door: LiftDoor) -> tuple[str, int]:
    """On which side of the cabin a door is: along which axis, and in which direction."""
    if abs(abs(door.x) - lift.width / 2) <= abs(abs(door.y) - lift.depth / 2):
        return "x", 1 if door.x > 0 else -1
    return "y", 1 if door.y > 0 else -1


def _cabin(lift: Lift) -> list[FloatArray]:
    """Rectangles (4, 2) about the cabin's walls, with gaps for its doors, in the lift's frame."""
    outlines = []
    for axis, sign in (("x", 1), ("x", -1), ("y", 1), ("y", -1)):
        half, across = lift.depth / 2, lift.width / 2
        if axis == "y":
            half, across = across, half
        inset = CABIN_WALL if axis == "x" else 0.0
        cuts = [-half + inset, half - inset]
        for door in lift.doors.values():
            if _side(lift, door) == (axis, sign):
                middle = door.y if axis == "x" else door.x
                cuts += [middle - door.width / 2, middle + door.width / 2]
        cuts.sort()
        near, far = sign * across, sign * (across - CABIN_WALL)
        for start, end in zip(cuts[::2], cuts[1::2], strict=True):
            if end > start:
                corners = np.array([[near, start], [near, end], [far, end], [far, start]])
                outlines.append(corners if axis == "x" else corners[:, ::-1])
    return outlines


def _placed(pose: FloatArray, outline: FloatArray) -> FloatArray:
    return compose(pose, np.column_stack([outline, np.zeros(len(outline))]))[:, :2]
