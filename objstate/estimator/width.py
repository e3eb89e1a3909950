"""When a recorded robot belief was too wide for objects."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from objstate.localization import PoseBelief


class Limit(NamedTuple):
    """The largest deviations of a robot belief by which objects are updated."""

    position_std: float  # m
    yaw_std: float = math.inf  # rad


NO_LIMIT = Limit(math.inf)


@dataclass
class TooWide:
    """Scans with objects near that updated none, because of the robot belief's deviations."""

    total_ns: int = 0  # each from its scan to the next
    first_ns: int | None = None  # stamp of the first; None: there was none
    last_ns: int = 0
    position_std: float = 0.0  # m, the largest
    yaw_std: float = 0.0  # rad, the largest
    limit: Limit = NO_LIMIT  # the narrowest that such a scan exceeded
    _goes_on: bool = False  # since the last scan

    def note(self, stamp_ns: int, robot: PoseBelief, limit: Limit) -> None:
        """Take such a scan."""
        self.end(stamp_ns)
        self.first_ns = stamp_ns if self.first_ns is None else self.first_ns
        self.last_ns, self._goes_on = stamp_ns, True
        self.position_std = max(self.position_std, robot.position_std)
        self.yaw_std = max(self.yaw_std, math.sqrt(robot.covariance[2, 2]))
        self.limit = min(self.limit, limit)

    def end(self, stamp_ns: int) -> None:
        """Take any other scan."""
        self.total_ns += stamp_ns - self.last_ns if self._goes_on else 0
        self._goes_on = False
