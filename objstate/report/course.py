"""The robot's way as a reader should see it: what is known of it, and what isn't."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.evaluation.lost import Stretches, within
from objstate.geometry import BoolArray, FloatArray
from objstate.records import Path

LOCALIZED_WELL = 0.9  # a smaller share of the time is marked


def weak(share: float) -> str:
    """How a share of the time in which a robot was localized is marked."""
    return "" if share >= LOCALIZED_WELL else "wrong"


@dataclass(frozen=True, eq=False)
class Course:
    """A path with the stretches in which the robot was lost.

    Where the robot was ``searching``, the first of these is the one before it was found: its belief
    was all over the building, and its mean is no place.
    """

    path: Path
    lost: Stretches
    searching: bool
    begin_ns: int
    seconds: float

    @property
    def localized(self) -> float:
        """The share of the time in which the robot wasn't lost."""
        end = self.begin_ns + int(1e9 * self.seconds)
        spans = (max(0, min(b, end) - max(a, self.begin_ns)) for a, b in self.lost)
        return 1.0 - min(1.0, sum(spans) / 1e9 / max(self.seconds, 1e-9))

    @property
    def driven(self) -> float:
        """m along the path, where it is known."""
        return sum(float(np.hypot(*np.diff(part, axis=0).T).sum()) for part in self.known)

    @property
    def known(self) -> list[FloatArray]:
        """Pieces (n, 2) of the path in which the robot was localized."""
        return _runs(self.path.poses[:, :2], ~within(self.path.stamps_ns, self.lost))

    @property
    def doubtful(self) -> list[FloatArray]:
        """Pieces (n, 2) of the path in which it was lost, without those before it was found."""
        later = self.lost[1:] if self.searching else self.lost
        return _runs(self.path.poses[:, :2], within(self.path.stamps_ns, later))

    @property
    def drawn(self) -> FloatArray:
        """(n, 2) all that a plan shows of it."""
        return np.concatenate([np.zeros((0, 2)), *self.known, *self.doubtful])


def _runs(points: FloatArray, chosen: BoolArray) -> list[FloatArray]:
    """The runs of neighbouring points that are chosen."""
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0))
    return [points[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)]
