"""Any object, given the whole log."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Kind
from objstate.lazy import lazy
from objstate.objects import ObjectBelief
from objstate.recording.events import SAME
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
        return movements(self.rests, self._differs)

    def _differs(self, first: int, last: int) -> float:
        """Largest probability, at moments from first to last, of another state than at the first.

        Furniture that was moved is in another component, and so in another place.
        """
        then, *others = self.beliefs[first : last + 1]
        if then.item.kind is Kind.PLANAR:
            return 1.0
        same = SAME[then.item.coordinates[0]]
        far = np.abs(then.relative_to(then.median)[:, 0]) > same
        return max((float(each.weights.values[far].sum()) for each in others), default=0.0)


def smoothed(history: History, also_ns: Iterable[int] = ()) -> Smoothed:
    """An object at the moments of its history, and at others (ns) far from them."""
    if isinstance(history, DoorHistory):
        door = smoothed_door(history, also_ns)
        return Smoothed(door.beliefs, DoorRests(door.chains, door.presence))
    piece = smoothed_furniture(history, also_ns)
    return Smoothed(piece.beliefs, FurnitureRests(piece.stamps_ns, piece.mixtures, piece.stays))
