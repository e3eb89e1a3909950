"""Any object, given the whole log."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from objstate.lazy import lazy
from objstate.objects import ObjectBelief
from objstate.smoothing.doors import DoorHistory, smoothed_door
from objstate.smoothing.furniture import FurnitureHistory, smoothed_furniture
from objstate.smoothing.movements import (
    DoorRests,
    FurnitureRests,
    Movement,
    Rests,
    movements,
)

History = DoorHistory | FurnitureHistory


@dataclass(frozen=True, eq=False)
class Smoothed:
    """p(state | the whole log) of one object."""

    beliefs: list[ObjectBelief]  # at moments, in time order
    rests: Rests

    @lazy
    def movements(self) -> list[Movement]:
        """When it was moved; their ``before`` and ``after`` are numbers of beliefs."""
        return movements(self.rests)


def smoothed(history: History, also_ns: Iterable[int] = ()) -> Smoothed:
    """An object at the moments of its history, and at others (ns) far from them."""
    if isinstance(history, DoorHistory):
        door = smoothed_door(history, also_ns)
        return Smoothed(door.beliefs, DoorRests(door.chains))
    piece = smoothed_furniture(history, also_ns)
    return Smoothed(piece.beliefs, FurnitureRests(piece.stamps_ns, piece.mixtures, piece.stays))
