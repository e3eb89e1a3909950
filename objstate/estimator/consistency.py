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
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Kind
from objstate.config import ConsistencySettings
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief

SHARPENED = (Kind.HINGED, Kind.SLIDING)  # no scan leaves one of their samples with all the weight
OF_MEAN = np.sqrt(np.pi / 2.0)  # a Gaussian's deviation by its mean distance from zero


@dataclass(frozen=True, eq=False)
class Stretch:
    """How a belief (d,) changed for a while, each scan by the deviation that it found."""

    moved: FloatArray  # the mean, in deviations
    shrunk: FloatArray  # the variance, as a share of itself


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
        self._open: dict[str, Stretch] = {}
        self.off = 0.0  # m by which the building is off its model

    def factor(self, of: Hashable) -> float:
        """On the variances of beliefs that are as sharp as they should be; 1 where nothing is known."""
        return self._needed(of) * self.sharper(of)

    def sharper(self, of: Hashable) -> float:
        """By which scans of objects of one class tell more, and drift adds less variance, than the settings have it.

        That is as far as readings err by chance: where the building is off, all scans err alike.
        """
        if of not in SHARPENED:
            return 1.0
        s = self._settings
        by_chance = 1.0 / (1.0 + (self.off / s.off_m) ** 2)
        most = min(by_chance, s.most_tempering) / self._tempering
        return max(min(1.0 / self._needed(of), most), 1.0)

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
        stretch = self._open.pop(name, None)
        if not (before.settled and after.settled and before.std.all()):
            return
        moved, shrunk = after.moved_from(before) / before.std, 1.0 - (after.std / before.std) ** 2
        if np.abs(moved).max() > s.jump:
            return
        if stretch is not None:
            moved, shrunk = moved + stretch.moved, shrunk + stretch.shrunk
        if shrunk.mean() < s.stretch:
            self._open[name] = Stretch(moved, shrunk)
            return
        telling = shrunk > 0.0
        by_mean = OF_MEAN * np.abs(moved[telling]) / math.sqrt(self.sharper(of))
        by_variance = np.sqrt(shrunk[telling])
        self._moved[of] = self._moved.get(of, 0.0) + float(by_mean.sum())
        self._expected[of] = self._expected.get(of, 0.0) + float(by_variance.sum())
