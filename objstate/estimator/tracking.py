"""One hypothesis of where the robot is, and how well it fits.

Something that isn't in the model makes beams shorter, never longer. So beams that
return from beyond a wall tell a robot in the wrong place from a changed world. And
even among people some beams read what they should; in the wrong place next to none do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray, between
from objstate.localization import PoseBelief
from objstate.records import NANOSECONDS

TINY = 1e-3  # s, in which a mean over a track's life so far begins


@dataclass(frozen=True, eq=False)
class Track:
    """A robot belief and its record: when it was last corrected, and how badly it fits."""

    belief: PoseBelief
    misfit: float = 0.0  # share of returning beams that pass through walls, a running mean
    fit: float = 1.0  # how well beams are explained, a running mean; 0: as by chance
    usual_fit: float = 0.0  # the same over longer
    seconds: float = 0.0  # for how long it has been held against scans
    corrected_ns: int | None = None
    corrected_at: FloatArray | None = None  # (3,) odometry at the last correction
    judged_ns: int | None = None  # when it was last held against a scan

    def moved_enough(self, odometry: FloatArray | None, s: LocalizationSettings) -> bool:
        """Whether the robot has moved on since the last correction.

        Scans from one place repeat each other's errors, and would settle a wide
        belief on a wrong place.
        """
        if self.corrected_at is None or odometry is None:
            return True
        step = between(self.corrected_at, odometry)
        return bool(np.hypot(step[0], step[1]) >= s.update_min_d or abs(step[2]) >= s.update_min_a)

    def corrected(self, belief: PoseBelief, stamp_ns: int, odometry: FloatArray | None) -> Track:
        return replace(self, belief=belief, corrected_ns=stamp_ns, corrected_at=odometry)

    def judged(
        self, through_walls: float, fit: float, stamp_ns: int, s: LocalizationSettings
    ) -> Track:
        """The track after a scan: how many returns pass through walls, how well it is explained."""
        if self.judged_ns is None:
            return replace(self, judged_ns=stamp_ns)
        seconds = (stamp_ns - self.judged_ns) / NANOSECONDS
        return replace(
            self,
            misfit=_drawn_to(self.misfit, through_walls, seconds / s.lost_after),
            fit=_drawn_to(self.fit, fit, seconds / s.fit_after),
            usual_fit=_drawn_to(
                self.usual_fit, fit, seconds / min(self.seconds + TINY, s.usual_after)
            ),
            seconds=self.seconds + seconds,
            judged_ns=stamp_ns,
        )

    def fits(self, s: LocalizationSettings) -> bool:
        """Whether nothing speaks against the track."""
        as_usual = self.fit >= s.doubt_below * self.usual_fit
        return as_usual and self.misfit <= s.lost_above / 2.0 and not self.is_wrong(s)

    def is_wrong(self, s: LocalizationSettings) -> bool:
        """Whether the robot can't be where the track says."""
        return self.misfit > s.lost_above or self.fit < s.lost_below


def _drawn_to(mean: float, value: float, share: float) -> float:
    """A running mean after a value that stood for a ``share`` of its time constant."""
    return float(mean - np.expm1(-share) * (value - mean))


def share_through_walls(measured: FloatArray, walls: FloatArray, margin: float) -> float:
    """Share of returning beams (n,) that measured more than ``margin`` m beyond the walls (n,).

    Beams stand in the order of their bearings. The farthest wall of a beam and its
    two neighbours counts, since beside a corner, or along a wall, a small turn of
    the robot moves the expected range far.
    """
    returns = np.isfinite(measured)
    if not returns.any():
        return 0.0
    farthest = walls.copy()
    farthest[1:] = np.maximum(farthest[1:], walls[:-1])
    farthest[:-1] = np.maximum(farthest[:-1], walls[1:])
    return float(np.mean(measured[returns] > farthest[returns] + margin))
