"""sensor_msgs/LaserScan to beams on the robot, by REP-117 and REP-103.

Ranges: ``+inf`` is no return, and so is a reading of exactly ``range_max``, which many
drivers report in its stead. ``nan``, ``-inf`` and whatever lies outside
[range_min, range_max] say nothing; neither does 0, with which some drivers mean no return
and others an error.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray, between, rotation_about, rotation_from_rpy
from objstate.logs.notices import Notices
from objstate.records import Rays, Scan

# s; no laser sweeps longer, so a larger time_increment is a driver's mistake
LONGEST_SWEEP = 1.0

# m that a laser sees at least; without a usable range_max it sees as far as its farthest reading
LEAST_REACH = 1.0

NEARLY_LEVEL = math.radians(2.0)  # by which a laser may tilt to count as level

FARTHEST = 500.0  # m that the lasers of robots read at most
WIDEST = 4 * math.pi  # rad; two turns, of which a scan shows one

# beams; drivers differ in whether the last angle is included
COUNT_TOLERANCE = 1


class Sweep(NamedTuple):
    """A scan before the robot's motion during it is known."""

    stamp_ns: int
    laser: str
    ranges: FloatArray  # (n,) m
    rays: Rays  # (n,) in base_link, as if all beams were taken at once
    range_min: float  # m
    range_max: float  # m
    beam_interval_ns: float

    @property
    def end_ns(self) -> int:
        """When the last beam was taken."""
        return self.stamp_ns + round(self.beam_interval_ns * (len(self.ranges) - 1))

    def beam_times_ns(self) -> IntArray:
        """(n,) when each beam was taken."""
        since_ns = np.rint(self.beam_interval_ns * np.arange(len(self.ranges)))
        return np.asarray(self.stamp_ns + since_ns.astype(np.int64))

    def scan(self, pose: FloatArray) -> Scan:
        """The scan, with all beams taken at its stamp, with odometry at ``pose`` (3,)."""
        return self._with(self.rays, pose)

    def swept(self, poses: FloatArray) -> Scan:
        """The scan when odometry was at ``poses`` (n, 3), one for each beam."""
        return self._with(moved_rays(self.rays, between(poses[0], poses)), poses[0])

    def _with(self, rays: Rays, pose: FloatArray) -> Scan:
        return Scan(
            self.stamp_ns, self.laser, self.ranges, rays, self.range_min, self.range_max, pose
        )


def moved_rays(rays: Rays, motion: FloatArray) -> Rays:
    """Beams (n,) cast while the robot moved by ``motion`` (n, 3) since the scan's stamp."""
    if not motion.any():
        return rays
    turn = rotation_about((0.0, 0.0, 1.0), motion[:, 2])  # (n, 3, 3)
    origins = np.einsum("nij,nj->ni", turn, rays.origins)
    origins[:, :2] += motion[:, :2]
    return Rays(origins, np.einsum("nij,nj->ni", turn, rays.directions))


class BeamGeometry:
    """Beams in ``base_link``, computed once for every laser and mounting."""

    def __init__(self) -> None:
        self._latest: dict[str, tuple[tuple[int, float, float], FloatArray, Rays]] = {}

    def rays(
        self, laser: str, count: int, angle_min: float, increment: float, mounting: FloatArray
    ) -> Rays:
        """``count`` beams of a laser mounted at ``mounting`` (4, 4), level if it nearly is."""
        shape = (count, angle_min, increment)
        if laser in self._latest:
            known_shape, known_mounting, rays = self._latest[laser]
            if known_shape == shape and known_mounting is mounting:
                return rays
        bearings = angle_min + increment * np.arange(count)
        level = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(count)], axis=-1)
        origins = np.tile(mounting[:3, 3], (count, 1))
        rays = Rays(origins, level @ _levelled(mounting[:3, :3]).T)
        self._latest[laser] = (shape, mounting, rays)
        return rays


def _levelled(rotation: FloatArray) -> FloatArray:
    """A rotation (3, 3), about the vertical only if it tilts by less than ``NEARLY_LEVEL``.

    Walls and leaves are upright, so that ranges to them change by less than 0.1 %.
    """
    if not math.cos(NEARLY_LEVEL) < abs(rotation[2, 2]) < 1.0:
        return rotation
    roll = 0.0 if rotation[2, 2] > 0.0 else math.pi  # it may be mounted upside down
    return rotation_from_rpy(roll, 0.0, math.atan2(rotation[1, 0], rotation[0, 0]))


def sweep_from(
    message: Any,
    stamp_ns: int,
    laser: str,
    mounting: FloatArray,
    geometry: BeamGeometry,
    notices: Notices,
) -> Sweep | None:
    """A sweep from a decoded ``LaserScan``; None, with a notice, where it can't be used."""
    count = len(message.ranges)
    if not _has_beams(message, count, laser, notices):
        return None
    ranges, range_min, range_max = clean_ranges(message, laser, notices)
    rays = geometry.rays(laser, count, message.angle_min, message.angle_increment, mounting)
    interval_ns = _beam_interval_ns(message, count, laser, notices)
    return Sweep(stamp_ns, laser, ranges, rays, range_min, range_max, interval_ns)


def clean_ranges(message: Any, laser: str, notices: Notices) -> tuple[FloatArray, float, float]:
    """Ranges (n,) as records hold them, and the limits in which they count, all in metres."""
    ranges = message.ranges.astype(np.float64)
    range_min, range_max = float(message.range_min), float(message.range_max)
    if not range_min >= 0:
        range_min = 0.0
    if not range_min < range_max < np.inf:
        notices.add(
            f"{laser} declares no usable range_max ({range_max:g}): its readings are kept, but "
            "beams without a return say nothing"
        )
        ranges[~np.isfinite(ranges) | (ranges < range_min) | (ranges == 0.0)] = np.nan
        return ranges, range_min, _reach(ranges, range_min)
    ranges[ranges == range_max] = np.inf
    outside = (ranges < range_min) | (ranges == 0.0) | ((ranges > range_max) & (ranges < np.inf))
    ranges[outside] = np.nan
    return ranges, range_min, range_max


def without_return(laser: str, range_min: float, range_max: float) -> str:
    """What to say of a laser none of whose readings are returns."""
    return (
        f"The laser '{laser}' has no return in any scan: its readings are all 0, nan or inf, or not "
        f"from range_min {range_min:g} to range_max {range_max:g} m."
    )


def declared_count(message: Any) -> int:
    """How many beams the angles of a ``LaserScan`` announce; -1 where they make no sense."""
    steps = float(message.angle_max - message.angle_min) / float(
        message.angle_increment or math.nan
    )
    return round(steps) + 1 if math.isfinite(steps) else -1


def disagrees(message: Any) -> bool:
    """Whether a ``LaserScan`` has clearly more or fewer ranges than its angles announce."""
    return abs(declared_count(message) - len(message.ranges)) > COUNT_TOLERANCE


def _reach(ranges: FloatArray, range_min: float) -> float:
    """m; as far as a scan shows that the laser sees."""
    finite = ranges[np.isfinite(ranges)]
    return float(finite.max(initial=max(range_min, LEAST_REACH)))


def _has_beams(message: Any, count: int, laser: str, notices: Notices) -> bool:
    if count == 0:
        notices.drop("Scan", f"{laser} sent no ranges")
        return False
    usable = math.isfinite(message.angle_min) and math.isfinite(message.angle_increment)
    if not usable or (message.angle_increment == 0 and count > 1):
        notices.drop("Scan", f"{laser} sent unusable angles")
        return False
    if (span := abs(message.angle_increment) * (count - 1)) > WIDEST:
        notices.add(
            f"The beams of {laser} span {span:.0f} rad, which looks like degrees; a LaserScan has "
            "radians"
        )
    if FARTHEST < message.range_max < math.inf:
        notices.add(
            f"{laser} reads up to {message.range_max:g} m, which looks like millimetres; a LaserScan "
            "has metres"
        )
    if disagrees(message):
        notices.add(
            f"{laser} sent more or fewer ranges than its angles announce: angle_min and "
            "angle_increment are trusted"
        )
    return True


def _beam_interval_ns(message: Any, count: int, laser: str, notices: Notices) -> float:
    interval = float(message.time_increment)
    if 0 <= interval * count <= LONGEST_SWEEP:
        return interval * 1e9
    notices.add(
        f"{laser} declares a time_increment that can't be, negative or above {LONGEST_SWEEP:g} s "
        "for a sweep: its beams are taken as simultaneous"
    )
    return 0.0
