"""Whether beliefs are as sure as they say: learnt from how they change.

What a belief's mean will move by is on average as much, squared, as its variance
will shrink by: the mean of a posterior is a martingale. Beliefs whose means move
less are too wide, and those whose means move more too narrow, because their errors
go together where the model takes them to be independent.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from objstate.config import ConsistencySettings
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS


class Consistency:
    """The factor by which the variances of beliefs of some class should be larger than they say.

    It is a ratio of sums. Each stretch of time adds to them what a mean moved, squared, and what its variance shrank
    by, both by the variance that it began with: a mean of ratios would be led by stretches that
    shrink a belief by next to nothing, as a belief of samples shrinks only on average.
    """

    def __init__(self, settings: ConsistencySettings) -> None:
        self._settings = settings
        self._moved: dict[Hashable, float] = {}  # by class: sums over stretches of time
        self._shrunk: dict[Hashable, float] = {}
        self._open: dict[str, Stretch] = {}

    def factor(self, of: Hashable) -> float:
        """For objects of one class; 1 where nothing is known."""
        s = self._settings
        moved = self._moved.get(of, 0.0) + s.weight
        shrunk = max(self._shrunk.get(of, 0.0), 0.0) + s.weight
        return float(np.clip(moved / shrunk, s.least, s.most))

    def note(self, before: ObjectBelief, after: ObjectBelief, stamp_ns: int) -> None:
        """Take in how a scan changed an object's belief."""
        name, of = after.item.name, after.item.kind
        if not (before.settled and after.settled):
            self._open.pop(name, None)
            return
        variance = before.std**2
        stretch = self._open.get(name) or Stretch(stamp_ns, variance)
        stretch = stretch.extended(after.moved_from(before), variance - after.std**2)
        self._open[name] = stretch
        if stamp_ns - stretch.began_ns >= self._settings.stretch_s * NANOSECONDS:
            self._open.pop(name)
            moved, shrunk = stretch.moved**2 / stretch.variance, stretch.shrunk / stretch.variance
            self._moved[of] = self._moved.get(of, 0.0) + float(
                np.minimum(moved, self._settings.most).sum()
            )
            self._shrunk[of] = self._shrunk.get(of, 0.0) + float(shrunk.sum())


@dataclass(frozen=True, eq=False)
class Stretch:
    """How a belief changes for a while; of each coordinate (d,)."""

    began_ns: int
    variance: FloatArray  # that it began with
    moved: FloatArray | float = 0.0  # by which the mean moved
    shrunk: FloatArray | float = (
        0.0  # by which the variance shrank, what it grew in between not counted
    )

    def extended(self, moved: FloatArray, shrunk: FloatArray) -> Stretch:
        """With one scan more."""
        return replace(self, moved=self.moved + moved, shrunk=self.shrunk + shrunk)
