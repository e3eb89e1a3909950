"""Whether beliefs are as sure as they say: learnt from how they change.

What a belief's mean will move by is on average as much, squared, as its variance
will shrink by: the mean of a posterior is a martingale. Beliefs whose means move
less are too wide, and those whose means move more too narrow, because their errors
go together where the model takes them to be independent. A stretch lasts until the
variance has shrunk by some share, what it grew by meanwhile left aside: not by time,
for shrinkage close to nothing, which beliefs of samples have by chance, says nothing.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import NamedTuple

from objstate.config import ConsistencySettings
from objstate.objects import ObjectBelief

OF_MEAN = math.sqrt(math.pi / 2.0)  # a Gaussian's deviation by its mean distance from zero


class Change(NamedTuple):
    """Of one coordinate of a belief, over a stretch: each scan's by the deviation that it found."""

    moved: float  # the mean, in deviations
    shrunk: float  # the variance, as a share of itself


class Consistency:
    """By which factor the variances of beliefs of some class should be changed."""

    def __init__(self, settings: ConsistencySettings) -> None:
        self._settings = settings
        self._moved: dict[Hashable, float] = {}  # by class: sums over stretches and coordinates
        self._expected: dict[Hashable, float] = {}
        self._open: dict[str, Sequence[Change]] = {}  # by object: of each coordinate

    def factor(self, of: Hashable) -> float:
        """On the variances of beliefs of a class; 1 where nothing is known."""
        s = self._settings
        moved, expected = self._moved.get(of, 0.0), self._expected.get(of, 0.0)
        ratio = (moved + s.weight) / (expected + s.weight)
        return min(max(ratio**2, s.least), s.most)

    def note(self, before: ObjectBelief, after: ObjectBelief) -> None:
        """Take in how a scan changed the belief of an object that nobody moved since the scan before.

        Else what a scan says against its having been moved would pass for what it says of the place.
        """
        name, of, s = after.item.name, after.item.kind, self._settings
        changed = self._open.pop(name, [Change(0.0, 0.0)] * len(after.cell))
        std, later = before.std.tolist(), after.std.tolist()
        if not (before.settled and after.settled and all(std)):
            return
        moved = after.moved_from(before).tolist()
        moved = [move / was for move, was in zip(moved, std, strict=True)]
        if max(map(abs, moved)) > s.jump:
            return
        changed = [
            Change(so_far.moved + move, so_far.shrunk + 1.0 - (is_now / was) ** 2)
            for so_far, move, was, is_now in zip(changed, moved, std, later, strict=True)
        ]
        if sum([each.shrunk for each in changed]) < s.stretch * len(changed):
            self._open[name] = changed
            return
        for moved, shrunk in changed:
            if shrunk > 0.0:
                self._moved[of] = self._moved.get(of, 0.0) + OF_MEAN * abs(moved)
                self._expected[of] = self._expected.get(of, 0.0) + math.sqrt(shrunk)
