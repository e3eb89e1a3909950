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

from objstate.building.model import Kind
from objstate.config import ConsistencySettings
from objstate.objects import ObjectBelief

SHARPENED = (Kind.HINGED, Kind.SLIDING)  # no scan leaves one of their samples with all the weight
OF_MEAN = math.sqrt(math.pi / 2.0)  # a Gaussian's deviation by its mean distance from zero


class Change(NamedTuple):
    """Of one coordinate of a belief, over a stretch: each scan's by the deviation that it found."""

    moved: float  # the mean, in deviations
    shrunk: float  # the variance, as a share of itself


class Consistency:
    """How wide beliefs of some class should be, and by what.

    Of doors whose beliefs are too wide, scans tell more than the settings have it: they are ``sharper``. Else what speaks for another
    state would count too little, too. What is left is a ``factor`` on the variances of what is published.
    """

    def __init__(self, settings: ConsistencySettings, tempering: float) -> None:
        self._settings = settings
        self._tempering = tempering  # exponent on the likelihood of a scan, as the settings have it
        self._moved: dict[Hashable, float] = {}  # by class: sums over stretches and coordinates
        self._expected: dict[Hashable, float] = {}
        self._open: dict[str, Sequence[Change]] = {}  # by object: of each coordinate
        self.off = 0.0  # m by which the building is off its model

    def factor(self, of: Hashable) -> float:
        """On the variances of beliefs that are as sharp as they should be; 1 where nothing is known."""
        needed = self._needed(of)
        return needed * self._sharper(of, needed)

    def sharper(self, of: Hashable) -> float:
        """By which scans of objects of one class tell more, and drift adds less variance, than the settings have it.

        That is as far as readings err by chance: where the building is off, all scans err alike.
        """
        return self._sharper(of, self._needed(of))

    def _sharper(self, of: Hashable, needed: float) -> float:
        if of not in SHARPENED:
            return 1.0
        s = self._settings
        by_chance = 1.0 / (1.0 + (self.off / s.off_m) ** 2)
        most = min(by_chance, s.most_tempering) / self._tempering
        return max(min(1.0 / needed, most), 1.0)

    def _needed(self, of: Hashable) -> float:
        """The factor on the variances of beliefs that are as wide as the settings have them."""
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
        by_mean = OF_MEAN / math.sqrt(self.sharper(of))
        for moved, shrunk in changed:
            if shrunk > 0.0:
                self._moved[of] = self._moved.get(of, 0.0) + by_mean * abs(moved)
                self._expected[of] = self._expected.get(of, 0.0) + math.sqrt(shrunk)
