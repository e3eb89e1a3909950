"""Whether beliefs are as sure as they say: learnt from how they change.

What a belief's mean will move by is on average as much, squared, as its variance
will shrink by: the mean of a posterior is a martingale. Beliefs whose means move
less are too wide, and those whose means move more too narrow, because their errors
go together where the model takes them to be independent.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from objstate.config import ConsistencySettings
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS


class Consistency:
    """The factor by which the variances of beliefs of some class should be larger than they say."""

    def __init__(self, settings: ConsistencySettings) -> None:
        self._settings = settings
        self._moved: dict[Hashable, float] = {}  # by class: sums over stretches of time
        self._stretches: dict[Hashable, float] = {}
        self._open: dict[str, tuple[int, np.ndarray, np.ndarray]] = {}

    def factor(self, of: Hashable) -> float:
        """For objects of one class; 1 where nothing is known."""
        s = self._settings
        moved = self._moved.get(of, 0.0) + s.weight
        return float(np.clip(moved / (self._stretches.get(of, 0.0) + s.weight), s.least, s.most))

    def note(self, before: ObjectBelief, after: ObjectBelief, stamp_ns: int) -> None:
        """Take in how a scan changed an object's belief."""
        name = after.item.name
        if not (before.settled and after.settled):
            self._open.pop(name, None)
            return
        move = after.moved_from(before)
        shrunk = before.std**2 - after.std**2
        began, moves, shrinks = self._open.get(name, (stamp_ns, 0.0 * move, 0.0 * move))
        moves, shrinks = moves + move, shrinks + shrunk
        if stamp_ns - began < self._settings.stretch_s * NANOSECONDS:
            self._open[name] = (began, moves, shrinks)
            return
        self._open.pop(name)
        telling = shrinks > 0.0
        if telling.any():
            of, ratios = after.item.kind, moves[telling] ** 2 / shrinks[telling]
            ratio = float(np.mean(np.minimum(ratios, self._settings.most)))
            self._moved[of] = self._moved.get(of, 0.0) + ratio
            self._stretches[of] = self._stretches.get(of, 0.0) + 1.0
