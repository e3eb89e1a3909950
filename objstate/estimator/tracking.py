"""The robot belief of the place that is followed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray, between
from objstate.localization import PoseBelief


@dataclass(frozen=True, eq=False)
class Track:
    """A robot belief, and where the odometry was when a scan last corrected it."""

    belief: PoseBelief
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
        return Track(belief, self.corrected_at)

    def corrected(self, belief: PoseBelief, odometry: FloatArray | None) -> Track:
        """The track with the belief after a scan."""
        return Track(belief, odometry)
