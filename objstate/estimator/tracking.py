"""One hypothesis of where the robot is, and how well it fits.

Something that isn't in the model makes beams shorter, never longer. So beams that
return from beyond a wall tell a robot in the wrong place from a changed world. And
even among people some beams read what they should; in the wrong place next to none do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray, between
from objstate.localization import PoseBelief
from objstate.records import NANOSECONDS

HALF = 0.5  # of how well scans are usually explained
TINY = 1e-3  # s, in which a mean over a track's life so far begins


@dataclass(frozen=True, eq=False)
class TrackRecord:
    """How badly a track has fitted so far."""

    misfit: float = 0.0  # share of returning beams that pass through walls, a running mean
    fit: float = 1.0  # how well beams are explained, a running mean; 0: as by chance
    usual_fit: float = 0.0  # the same over longer
    seconds: float = 0.0  # for how long it has been held against scans
    until_ns: int | None = None  # when it was last held against one

    def judged(
        self, through_walls: float, fit: float, stamp_ns: int, s: LocalizationSettings
    ) -> TrackRecord:
        """The record after a scan: how many returns pass through walls, how well it is explained."""
        if self.until_ns is None:
            return TrackRecord(until_ns=stamp_ns)
        seconds = (stamp_ns - self.until_ns) / NANOSECONDS
        usual_after = min(self.seconds + TINY, s.usual_after)
        return TrackRecord(
            misfit=_drawn_to(self.misfit, through_walls, seconds / s.doubt_after),
            fit=_drawn_to(self.fit, fit, seconds / s.fit_after),
            usual_fit=_drawn_to(self.usual_fit, fit, seconds / usual_after),
            seconds=self.seconds + seconds,
            until_ns=stamp_ns,
        )

    @property
    def may_have_slid(self) -> bool:
        """Whether so little was explained that the pose may have settled on what looks alike nearby."""
        return self.fit < HALF * self.usual_fit

    def fits(self, s: LocalizationSettings) -> bool:
        """Whether nothing speaks against the track."""
        as_usual = self.fit >= s.doubt_below * self.usual_fit
        return as_usual and self.misfit <= s.doubt_above and not self.is_wrong(s)

    def is_wrong(self, s: LocalizationSettings) -> bool:
        """Whether the robot can't be where the track says."""
        return self.fit < s.lost_below


@dataclass(frozen=True, eq=False)
class Track:
    """A robot belief, how it fits, and where the odometry was when a scan last corrected it."""

    belief: PoseBelief
    record: TrackRecord = TrackRecord()
    corrected_at: FloatArray | None = None  # (3,)

    def moved_enough(self, odometry: FloatArray | None, s: LocalizationSettings) -> bool:
        """Whether the robot has moved on since the last correction.

        Scans from one place repeat each other's errors, and would settle a wide
        belief on a wrong place.
        """
        if self.corrected_at is None or odometry is None:
            return True
        step = between(self.corrected_at, odometry)
        return bool(np.hypot(step[0], step[1]) >= s.update_min_d or abs(step[2]) >= s.update_min_a)

    def moved(self, belief: PoseBelief) -> Track:
        """The track with the belief after some odometry."""
        return Track(belief, self.record, self.corrected_at)

    def corrected(self, belief: PoseBelief, odometry: FloatArray | None) -> Track:
        """The track with the belief after a scan."""
        return Track(belief, self.record, odometry)

    def judged(self, record: TrackRecord) -> Track:
        """The track with a new record."""
        return Track(self.belief, record, self.corrected_at)


def _drawn_to(mean: float, value: float, share: float) -> float:
    """A running mean after a value that stood for a ``share`` of its time constant."""
    return mean - math.expm1(-share) * (value - mean)
