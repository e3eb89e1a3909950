"""Proposals of where furniture may stand: states whose outline passes through readings.

Two ends of beams and two points of the outline that are as far apart determine a state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.lazy import Later, lazy

if TYPE_CHECKING:
    from objstate.objects import sampling
else:
    sampling = Later("objstate.objects.sampling")

TRACED = 96  # points along an outline
SHORTEST = 0.1  # of an object's width: closer ends of beams determine its heading poorly
APART = 0.04  # m by which two lengths may differ, for noise
ON_OUTLINE = 0.08  # m from the outline within which the end of a beam counts as on it
POINTS = 80  # most ends of beams by which states are tested


@dataclass(frozen=True, eq=False)
class TracedOutline:
    """Points along an outline, and all pairs of them by length."""

    points: FloatArray  # (q, 2) m, seen from the object's origin at yaw 0
    pairs: IntArray  # (p, 2) indices of points
    lengths: FloatArray  # (p,) m, ascending

    @staticmethod
    def of(segments: FloatArray) -> TracedOutline | None:
        """Traced along segments (k, 2, 2); None where there are none."""
        if len(segments) == 0:
            return None
        points = _along(segments)
        first, second = np.nonzero(~np.eye(len(points), dtype=bool))
        lengths = np.hypot(*(points[first] - points[second]).T)
        order = np.argsort(lengths, kind="stable")
        return TracedOutline(points, np.column_stack([first, second])[order], lengths[order])

    def states_through(
        self, ends: FloatArray, count: int, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """At most ``count`` states (c, 3) through ends (m, 2), and how many they explain (c,)."""
        ends = ends[np.unique(np.linspace(0, len(ends) - 1, min(POINTS, len(ends))).astype(int))]
        first, second = self._end_pairs(ends, count, rng)
        apart = second - first
        length = np.hypot(apart[:, 0], apart[:, 1])
        low = np.searchsorted(self.lengths, length - APART)
        high = np.searchsorted(self.lengths, length + APART)
        able = high > low
        first, second, apart = first[able], second[able], apart[able]
        low, high = low[able], high[able]
        chosen = self.pairs[low + (rng.random(len(low)) * (high - low)).astype(np.int64)]
        own = self.points[chosen[:, 1]] - self.points[chosen[:, 0]]
        yaw = np.arctan2(apart[:, 1], apart[:, 0]) - np.arctan2(own[:, 1], own[:, 0])
        middle = self.points[chosen].mean(axis=1)
        cos, sin = np.cos(yaw), np.sin(yaw)
        turned = np.column_stack(
            [cos * middle[:, 0] - sin * middle[:, 1], sin * middle[:, 0] + cos * middle[:, 1]]
        )
        states = np.column_stack([(first + second) / 2.0 - turned, wrap(yaw)])
        explained = np.count_nonzero(self.holds(states, ends, ON_OUTLINE), axis=1)
        return states, explained.astype(float)

    def holds(self, states: FloatArray, ends: FloatArray, within: float) -> BoolArray:
        """Which ends (m, 2) the outline comes ``within`` m of: (c, m) for states (c, 3)."""
        out = np.empty((len(states), len(ends)), dtype=bool)
        sampling.lie_on(states, self._abreast, np.ascontiguousarray(ends), within, out)
        return out

    @lazy
    def _abreast(self) -> FloatArray:
        """(2, q) the points as the kernel takes them."""
        return np.ascontiguousarray(self.points.T)

    def _end_pairs(
        self, ends: FloatArray, count: int, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Pairs of ends (c, 2), (c, 2) that may lie on one object; distant ones are preferred."""
        first = ends[rng.integers(len(ends), size=count)]
        length = np.hypot(*np.moveaxis(ends[None] - first[:, None], 2, 0))
        widest = float(self.lengths[-1])
        usable = (length >= SHORTEST * widest) & (length <= widest + APART)
        filled = np.cumsum(np.where(usable, length, 0.0), axis=1)
        able = filled[:, -1] > 0.0
        drawn = rng.random(count) * filled[:, -1]
        second = (filled <= drawn[:, None]).sum(axis=1).clip(max=len(ends) - 1)
        return first[able], ends[second[able]]


def _along(segments: FloatArray) -> FloatArray:
    """(``TRACED``, 2) points at even distances along segments (k, 2, 2)."""
    along = segments[:, 1] - segments[:, 0]
    lengths = np.hypot(along[:, 0], along[:, 1])
    filled = np.cumsum(lengths)
    at = (np.arange(TRACED) + 0.5) / TRACED * filled[-1]
    which = np.searchsorted(filled, at).clip(max=len(segments) - 1)
    share = 1.0 - (filled[which] - at) / np.maximum(lengths[which], np.finfo(float).tiny)
    return np.asarray(segments[which, 0] + share[:, None] * along[which])
