"""Records: frozen, batched values with integer nanoseconds.

Frames follow REP-103 and REP-105, ranges REP-117. The robot drives on a level floor: its pose is
``(x, y, yaw)`` of ``base_link``, with the base on z = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import lazy

NANOSECONDS = 1e9  # in a second
STEEP = 1e-9  # cosine of a beam's slope that counts as upright


@dataclass(frozen=True, eq=False)
class Odometry:
    """The robot's pose by dead reckoning."""

    stamp_ns: int
    pose: FloatArray  # (3,) x m, y m, yaw rad: base_link in odom


@dataclass(frozen=True, eq=False)
class Rays:
    """Beams of one scan, each with its own origin, in ``base_link`` at the scan's stamp.

    Mounting, tilt and the robot's motion during the sweep are already in them.
    """

    origins: FloatArray  # (n, 3) m
    directions: FloatArray  # (n, 3) unit vectors

    def __len__(self) -> int:
        return len(self.origins)

    def take(self, index: IntArray | BoolArray) -> Rays:
        """The beams that a NumPy index or mask selects."""
        return Rays(self.origins[index], self.directions[index])

    @lazy
    def courses(self) -> tuple[FloatArray, FloatArray]:
        """Seen from above: unit directions (n, 2), and horizontal shares (n,) of ranges.

        Vertical beams have no direction.
        """
        level = np.hypot(self.directions[:, 0], self.directions[:, 1]).clip(min=STEEP)
        return self.directions[:, :2] / level[:, None], level


@dataclass(frozen=True, eq=False)
class Scan:
    """One sweep of one laser.

    A finite range is a return; ``+inf`` means nothing up to ``range_max``; ``nan`` was discarded
    (erroneous, or outside [range_min, range_max]).
    """

    stamp_ns: int  # of the first beam
    laser: str  # frame of the laser
    ranges: FloatArray  # (n,) m
    rays: Rays  # (n,)
    range_min: float  # m
    range_max: float  # m
    odometry: FloatArray | None = None  # (3,) odometry interpolated at stamp_ns, where known

    def __len__(self) -> int:
        return len(self.ranges)

    @lazy
    def valid(self) -> BoolArray:
        """(n,) the valid beams: those with a return, or with none up to range_max."""
        return ~np.isnan(self.ranges)


@dataclass(frozen=True, eq=False)
class InitialPose:
    """A given pose of the robot, for example on ``/initialpose``."""

    stamp_ns: int
    mean: FloatArray  # (3,) x, y, yaw in map
    covariance: FloatArray | None  # (3, 3); None: not known


@dataclass(frozen=True, eq=False)
class RobotBelief:
    """Weighted samples of the robot's pose in the building's frame (``map``)."""

    stamp_ns: int
    poses: FloatArray  # (n, 3) x, y, yaw
    weights: FloatArray  # (n,) sum to one


@dataclass(frozen=True, eq=False)
class GaussianRobotBelief:
    """A recorded robot belief given by mean and covariance."""

    stamp_ns: int
    mean: FloatArray  # (3,) x, y, yaw in map
    covariance: FloatArray | None  # (3, 3); None: not known


Record = Odometry | Scan | InitialPose | RobotBelief | GaussianRobotBelief


@dataclass(frozen=True)
class Estimate:
    """The posterior of one coordinate of one object after one update."""

    stamp_ns: int
    object: str
    coordinate: str  # angle rad | offset m | x m | y m | yaw rad
    mean: float
    std: float
    lower: float  # central 90 % of the posterior
    upper: float
    observed: bool  # at least one beam of this scan reached the object
    fit: float = math.nan  # share of those beams that the most probable state explains
    presence: float = 1.0  # probability that a piece of furniture is there
    lost: bool = False  # the robot was probably lost; the state is only predicted
    p_closed: float | None = None  # probability that a door stands exactly closed
    p_localized: float = 1.0  # probability of the robot's published pose
    median: float | None = None  # None in results of earlier versions

    @property
    def value(self) -> float:
        """The estimate of the state: the median; the mean where the median isn't known."""
        return self.mean if self.median is None else self.median


@dataclass(frozen=True)
class TrueState:
    """The true value of one coordinate of one object, from its stamp on."""

    stamp_ns: int
    object: str
    coordinate: str
    value: float


@dataclass(frozen=True, eq=False)
class Path:
    """Robot poses over time, as a TUM file holds them."""

    stamps_ns: np.ndarray = field(repr=False)  # (n,) int64
    poses: FloatArray = field(repr=False)  # (n, 3) x, y, yaw in map
