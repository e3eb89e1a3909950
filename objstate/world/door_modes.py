"""Doors in the words of ``rmf_door_msgs``."""

from __future__ import annotations

from enum import IntEnum

from objstate.building.model import Kind
from objstate.errors import QueryError
from objstate.world.changes import contradict
from objstate.world.world import Snapshot, World

MOVING_FOR_NS = 5_000_000_000  # a door counts as moving for so long after it was seen to move


class DoorMode(IntEnum):
    """The values of ``rmf_door_msgs/msg/DoorMode``."""

    CLOSED = 0
    MOVING = 1
    OPEN = 2
    OFFLINE = 3  # of a door's motor; what a laser sees of a door never says so
    UNKNOWN = 4


def door_mode(
    snapshot: Snapshot, name: str, width: float, *, length: float = 0.0, confidence: float = 0.9
) -> DoorMode:
    """The mode of a door in a fleet's terms, for a robot of a width and a length, m.

    Open is a door that leaves the passage with at least the probability ``confidence``, closed one
    that probably doesn't, however far it is ajar; unknown is anything between. Moving is a door
    whose last two beliefs contradict each other, for five seconds.

    Raises QueryError for an unknown object or a confidence that is none, BuildingError for
    furniture.
    """
    if not 0.5 < confidence <= 1.0:
        raise QueryError(f"A confidence of {confidence} must be above 0.5 and at most 1.")
    clear = snapshot[name].probability_clear(width, length)
    if is_moving(snapshot.world, name, snapshot.stamp_ns):
        return DoorMode.MOVING
    if clear >= confidence:
        return DoorMode.OPEN
    return DoorMode.CLOSED if clear <= 1.0 - confidence else DoorMode.UNKNOWN


def door_modes(
    snapshot: Snapshot, width: float, *, length: float = 0.0, confidence: float = 0.9
) -> dict[str, DoorMode]:
    """The modes of all doors by name. Raises QueryError for a confidence that is none."""
    return {
        name: door_mode(snapshot, name, width, length=length, confidence=confidence)
        for name, item in snapshot.world.objects.items()
        if item.kind is not Kind.PLANAR
    }


def is_moving(world: World, name: str, stamp_ns: int) -> bool:
    """Whether an object was just seen to move: its last two beliefs contradict each other."""
    past = world.history_until(name, stamp_ns)
    if len(past) < 2:
        return False
    before, last = past[-2:]
    if before.stamp_ns is None or last.stamp_ns is None:  # a world has none such
        return False
    is_recent = stamp_ns - last.stamp_ns <= MOVING_FOR_NS
    was_watched = last.stamp_ns - before.stamp_ns <= MOVING_FOR_NS
    return is_recent and was_watched and contradict(before, last)
