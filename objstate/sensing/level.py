"""Level lasers: a horizontal cut through a rigid body is always the same outline.

That holds for walls, for objects that turn about a vertical axis, and for those that move in the
floor plane. A level scan sees them as segments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.geometry import FloatArray, IntArray
from objstate.lazy import lazy
from objstate.records import Rays

LEVEL = 1e-6  # rad or relative: a laser or an axis tilted by less counts as level or upright
SAME_HEIGHT = 1e-6  # m
INDEX_STEPS = 2  # entries of a sweep's index for each beam


@dataclass(frozen=True, eq=False)
class Sweep:
    """The beams of a level scan, sorted by bearing in the robot's frame."""

    height: float  # m above the floor
    order: IntArray  # (n,) the scan's beams by bearing
    rows: FloatArray  # (5, n) pseudo-angle, direction, origin relative to the centre; sorted
    centre: FloatArray  # (3,) x, y in the robot's frame, m; largest distance of an origin

    @staticmethod
    def of(rays: Rays) -> Sweep | None:
        """The sweep of some rays, or None where they are not level."""
        if len(rays) == 0 or np.abs(rays.directions[:, 2]).max() > LEVEL:
            return None
        if np.ptp(rays.origins[:, 2]) > SAME_HEIGHT:
            return None
        bearing = pseudo_angles(rays.directions)
        order = np.argsort(bearing, kind="stable")
        bearing, origin = bearing[order], rays.origins[order, :2]
        centre = (origin.min(axis=0) + origin.max(axis=0)) / 2
        offset = origin - centre
        return Sweep(
            height=float(rays.origins[0, 2]),
            order=order,
            rows=np.ascontiguousarray(np.vstack([bearing, rays.directions[order, :2].T, offset.T])),
            centre=np.array([*centre, np.hypot(*offset.T).max()]),
        )

    @lazy
    def around(self) -> float:
        """m; largest distance of a beam's origin from the robot."""
        x, y, spread = self.centre.tolist()
        return math.hypot(x, y) + float(spread)

    @lazy
    def index(self) -> IntArray:
        """(m + 1,) first beam at or after each of some even steps of the pseudo-angle."""
        count = max(INDEX_STEPS * len(self.order), 1)
        steps = np.arange(count + 1) * (4.0 / count) - 2.0
        return np.searchsorted(self.rows[0], steps)


@dataclass(frozen=True, eq=False)
class UncertainObject:
    """Where an object may be, for the readers of a scan."""

    name: str
    states: FloatArray  # (k, d)
    shares: FloatArray  # (k,) sum to the probability that the object is there


def pseudo_angles(directions: FloatArray) -> FloatArray:
    """Numbers (n,) in [-2, 2] that grow with the bearing of directions (n, 2 or 3)."""
    x, y = directions[:, 0], directions[:, 1]
    quarter = np.abs(y) / (np.abs(x) + np.abs(y))
    half = np.where(x < 0.0, 2.0 - quarter, quarter)
    return np.asarray(np.where(y < 0.0, -half, half))


def moves_in_plane(item: MovableObject) -> bool:
    """Whether an object only turns about vertical axes and moves horizontally."""
    if item.kind is Kind.PLANAR:
        return True
    x, y, z = item.direction
    if item.kind is Kind.HINGED:
        return bool(np.hypot(x, y) < LEVEL)
    return bool(abs(z) < LEVEL)


def flat(segments: FloatArray) -> FloatArray:
    """Segments (k, 2, 2) as the kernels take them (k, 4)."""
    return np.ascontiguousarray(segments.reshape(-1, 4))
