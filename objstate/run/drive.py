"""Data gathered of a drive while its records are read."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from objstate.estimator import Estimator
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.records import Estimate, Path, Record, Scan
from objstate.sensing.level import LEVEL

NOTICEABLE = 0.01  # change of a probability
COMPARED_NS = 1_000_000_000  # least time between two scans of a laser that are held to the walls
THROUGH = 0.15  # m beyond a wall, from which on a reading passed through it


@dataclass
class Drive:
    """One drive so far."""

    begin_ns: int = 0
    end_ns: int = 0
    scans: int = 0
    estimates: int = 0
    observed: int = 0  # estimates of objects that a beam reached
    pause_ns: tuple[int, int] = (0, 0)  # the longest without any record, and when it began
    heights: dict[str, float] = field(default_factory=dict)  # m above the floor, by laser
    tilts: dict[str, float] = field(default_factory=dict)  # rad, of those that aren't level
    # range_min and range_max, m, of lasers that had no return so far
    without_return: dict[str, tuple[float, float]] = field(default_factory=dict)
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))  # of scans with a pose
    localized: list[tuple[int, float]] = field(
        default_factory=list
    )  # from a stamp on, the probability
    poses: array[float] = field(default_factory=lambda: array("d"))  # x, y, yaw at each of them
    returned: int = 0  # readings of some scans, from a robot that was probably localized
    through: int = 0  # those of them that passed through a wall
    _compared_ns: dict[str, int] = field(default_factory=dict)  # the last of these scans, by laser

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Record the state after a record."""
        self.begin_ns = self.begin_ns or record.stamp_ns
        since_ns, self.end_ns = self.end_ns or record.stamp_ns, record.stamp_ns
        self.pause_ns = max(self.pause_ns, (self.end_ns - since_ns, since_ns))
        if estimates:
            self.estimates += len(estimates)
            self.observed += sum(estimate.observed for estimate in estimates)
        if isinstance(record, Scan):
            self._note_scan(record, estimator.robot)
            if self._is_compared(record, estimator):
                self._compare(record, estimator.walls(record))
            p = estimator.p_localized
            if not self.localized or abs(p - self.localized[-1][1]) >= NOTICEABLE:
                self.localized.append((record.stamp_ns, p))

    @property
    def seconds(self) -> float:
        """Its duration so far."""
        return (self.end_ns - self.begin_ns) / 1e9

    @property
    def path(self) -> Path:
        """The robot's pose at each scan, from where it is known on."""
        return Path(np.array(self.stamps_ns), np.array(self.poses).reshape(-1, 3))

    @property
    def start(self) -> FloatArray:
        """The first pose (3,) that is known. Raises IndexError where none is."""
        return np.asarray(self.path.poses[0])

    @property
    def share_through(self) -> float:
        """Share, 0..1, of the readings that passed through walls of the building.

        People and boxes shorten readings, but nothing lets a beam pass a wall.
        """
        return self.through / max(self.returned, 1)

    def _is_compared(self, scan: Scan, estimator: Estimator) -> bool:
        last = self._compared_ns.get(scan.laser)
        is_due = last is None or scan.stamp_ns - last >= COMPARED_NS
        return is_due and estimator.robot is not None and not estimator.is_lost

    def _compare(self, scan: Scan, walls: FloatArray) -> None:
        self._compared_ns[scan.laser] = scan.stamp_ns
        returned = np.isfinite(scan.ranges)
        self.returned += int(np.count_nonzero(returned))
        self.through += int(np.count_nonzero((scan.ranges > walls + THROUGH)[returned]))

    def _note_scan(self, scan: Scan, robot: PoseBelief | None) -> None:
        self.scans += 1
        if scan.laser not in self.heights and len(scan):
            self.heights[scan.laser] = float(scan.rays.origins[0, 2])
            if (sine := float(np.abs(scan.rays.directions[:, 2]).max())) > LEVEL:
                self.tilts[scan.laser] = math.asin(min(sine, 1.0))
            self.without_return[scan.laser] = scan.range_min, scan.range_max
        if scan.laser in self.without_return and np.isfinite(scan.ranges).any():
            del self.without_return[scan.laser]
        if robot is not None:
            self.stamps_ns.append(scan.stamp_ns)
            self.poses.extend(robot.mean.tolist())
