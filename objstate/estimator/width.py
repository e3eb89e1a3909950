"""When a recorded robot belief was too wide for objects."""

from __future__ import annotations

import math
from dataclasses import dataclass

from objstate.localization import PoseBelief


@dataclass
class TooWide:
    """Scans with objects near that updated none, because of the robot belief's deviations."""

    total_ns: int = 0  # from scan to scan
    first_ns: int | None = None  # stamp of the first; None: there was none
    last_ns: int = 0
    position_std: float = 0.0  # m, the largest
    yaw_std: float = 0.0  # rad, the largest
    _goes_on: bool = False  # since the last scan

    def note(self, stamp_ns: int, robot: PoseBelief) -> None:
        """Take such a scan."""
        self.first_ns = stamp_ns if self.first_ns is None else self.first_ns
        self.total_ns += stamp_ns - self.last_ns if self._goes_on else 0
        self.last_ns, self._goes_on = stamp_ns, True
        self.position_std = max(self.position_std, robot.position_std)
        self.yaw_std = max(self.yaw_std, math.sqrt(robot.covariance[2, 2]))

    def end(self) -> None:
        """Take any other scan."""
        self._goes_on = False
