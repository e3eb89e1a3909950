"""Percepts: where a sensor finds the floor free or occupied, and with what probability.

Lasers and cameras give the same kind of percepts, which a grid sweeps (Darmstadt, section 6.1.6).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from objstate.errors import GridError
from objstate.geometry import BoolArray, FloatArray, compose
from objstate.records import Scan


@dataclass(frozen=True, eq=False)
class Percepts:
    """Rays over the floor in ``frame``. Each ends at an obstacle, or where nothing was found so far."""

    starts: FloatArray = field(repr=False)  # (n, 2) m
    ends: FloatArray = field(repr=False)  # (n, 2) m
    obstacle: BoolArray = field(repr=False)  # (n,)
    covariances: FloatArray = field(repr=False)  # (n, 2, 2) m^2, of the ends
    frame: str = "map"
    weights: FloatArray | None = field(default=None, repr=False)  # (n,) of obstacles; 1 without

    def __post_init__(self) -> None:
        count = len(self.ends)
        shapes = {
            "starts": (self.starts, (count, 2)),
            "ends": (self.ends, (count, 2)),
            "obstacle": (self.obstacle, (count,)),
            "covariances": (self.covariances, (count, 2, 2)),
            "weights": (self.shares, (count,)),
        }
        for name, (array, shape) in shapes.items():
            if array.shape != shape:
                raise GridError(
                    f"Percepts have {name} of shape {array.shape}; it has to be {shape}."
                )
            if not np.isfinite(array).all():
                raise GridError(f"Percepts have {name} that are not finite; leave those out.")

        if not ((self.shares >= 0.0) & (self.shares <= 1.0)).all():
            raise GridError("Percepts have weights that are no shares; give numbers from 0 to 1.")

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def shares(self) -> FloatArray:
        """(n,) by which the obstacles count."""
        return np.ones(len(self.ends)) if self.weights is None else self.weights


def laser_percepts(
    scan: Scan,
    pose: FloatArray,
    covariance: FloatArray | None = None,
    range_std: float = 0.02,
    frame: str = "map",
) -> Percepts:
    """Percepts of a scan from a pose (3,) of the robot with covariance (3, 3), m and rad.

    The end of a beam has the uncertainty of its range along the beam and that of the robot's pose.
    Beams without a return are free up to the scan's largest range; discarded ones are left out.
    """
    pose = np.asarray(pose, dtype=float)
    spread = np.zeros((3, 3)) if covariance is None else np.asarray(covariance, dtype=float)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise GridError("Percepts need a finite pose (x m, y m, yaw rad) of the robot.")
    if spread.shape != (3, 3) or not np.isfinite(spread).all():
        raise GridError("Percepts need a finite covariance (3, 3) of the robot's pose.")
    if not (math.isfinite(range_std) and range_std >= 0.0):
        raise GridError(f"Ranges can't have a deviation of {range_std:g} m; give 0 or more.")
    valid = scan.valid
    directions, level = scan.rays.courses
    ranges = np.minimum(scan.ranges[valid], scan.range_max) * level[valid]
    turn = np.array(
        [[math.cos(pose[2]), -math.sin(pose[2])], [math.sin(pose[2]), math.cos(pose[2])]]
    )
    starts = pose[:2] + scan.rays.origins[valid, :2] @ turn.T
    courses = directions[valid] @ turn.T
    ends = starts + ranges[:, None] * courses
    lever = ends - pose[:2]
    xx = spread[0, 0] - 2.0 * spread[0, 2] * lever[:, 1] + spread[2, 2] * lever[:, 1] ** 2
    yy = spread[1, 1] + 2.0 * spread[1, 2] * lever[:, 0] + spread[2, 2] * lever[:, 0] ** 2
    xy = (
        spread[0, 1]
        + spread[0, 2] * lever[:, 0]
        - spread[1, 2] * lever[:, 1]
        - spread[2, 2] * lever[:, 0] * lever[:, 1]
    )
    along = range_std**2
    covariances = np.empty((len(ends), 2, 2))
    covariances[:, 0, 0] = xx + along * courses[:, 0] ** 2
    covariances[:, 1, 1] = yy + along * courses[:, 1] ** 2
    covariances[:, 0, 1] = covariances[:, 1, 0] = xy + along * courses[:, 0] * courses[:, 1]
    return Percepts(starts, ends, np.isfinite(scan.ranges[valid]), covariances, frame)


@dataclass(frozen=True)
class Camera:
    """A camera on a pan and tilt axis that sees where obstacles meet the floor."""

    height: float  # m above the floor
    pan_std: float  # rad, deviation of the pan angle
    tilt_std: float  # rad, deviation of the tilt angle
    within: float = (
        math.inf
    )  # m; an obstacle shows in the percept before, too, within this distance

    def __post_init__(self) -> None:
        for name, value in (("height", self.height), ("within", self.within)):
            if not value > 0.0:
                raise GridError(f"A camera can't have {name} {value:g} m; give a number above 0.")
        for name, value in (("pan_std", self.pan_std), ("tilt_std", self.tilt_std)):
            if not 0.0 <= value < math.pi / 4:
                raise GridError(f"A camera can't have {name} {value:g} rad; give up to 0.78.")

    def percepts(
        self,
        base_points: FloatArray,
        ends: FloatArray,
        obstacle: BoolArray,
        pose: FloatArray,
        frame: str = "map",
    ) -> Percepts:
        """Percepts of scan lines in their order, from the camera's pose (3,) over the floor.

        Each runs from where the line enters the picture (n, 2) to its end (n, 2) m, seen from the
        camera: an obstacle's base, or the upper edge. An obstacle is an outlier, and its line is
        left out, unless that before found one within a distance of ``within``. Deviations come from
        the end projected at angles that differ by those of the head, and tilted up they are larger
        than tilted down; the mean is taken. The axis along which the tilt acts is the direction of
        the end.
        """
        if not (np.isfinite(base_points).all() and np.isfinite(ends).all()):
            raise GridError("Scan lines of a camera have to begin and end at finite places.")
        step = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        shown = np.zeros(len(ends), dtype=bool)
        shown[1:] = obstacle[1:] & obstacle[:-1] & (step <= self.within)
        kept = ~obstacle | shown
        points, count = ends[kept], int(kept.sum())
        away = np.hypot(points[:, 0], points[:, 1])
        tilt = np.arctan2(self.height, away)
        least = self.tilt_std + 1e-3  # rad below the horizon, where the floor ends
        near = self.height / np.tan(np.minimum(tilt + self.tilt_std, math.pi / 2))
        far = self.height / np.tan(np.maximum(tilt - self.tilt_std, least - self.tilt_std))
        radial, lateral = (far - near) / 2.0, away * math.tan(self.pan_std)
        bearing = np.arctan2(points[:, 1], points[:, 0]) + pose[2]
        cos, sin = np.cos(bearing), np.sin(bearing)
        covariances = np.empty((count, 2, 2))
        covariances[:, 0, 0] = (radial * cos) ** 2 + (lateral * sin) ** 2
        covariances[:, 1, 1] = (radial * sin) ** 2 + (lateral * cos) ** 2
        covariances[:, 0, 1] = covariances[:, 1, 0] = (radial**2 - lateral**2) * cos * sin
        placed = [
            compose(pose, np.column_stack([each[kept], np.zeros(count)]))[:, :2]
            for each in (base_points, ends)
        ]
        return Percepts(placed[0], placed[1], obstacle[kept], covariances, frame)
