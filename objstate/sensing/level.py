"""Level lasers: a horizontal cut of a rigid thing is always the same outline.

That holds for walls, for objects that turn about a vertical axis, and for those
that move in the floor plane. What a level sweep sees of them are segments.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from objstate.building.model import Building, Kind, MovableObject
from objstate.building.outline import outline
from objstate.geometry import FloatArray, IntArray
from objstate.records import Rays

T = TypeVar("T", bound=np.generic)

LEVEL = 1e-6  # rad or relative: a laser or an axis tilted by less counts as level or upright
SAME_HEIGHT = 1e-6  # m
INDEX_STEPS = 2  # of a sweep's index, for each beam
STRIDE = 2.0  # m the robot moves before the walls near it are looked up again


@dataclass(frozen=True, eq=False)
class Sweep:
    """The beams of a level scan, sorted by bearing in the robot's frame."""

    height: float  # m above the floor
    order: IntArray  # (n,) the scan's beams by bearing
    rows: FloatArray  # (5, n) pseudo-angle, direction, origin relative to the centre; sorted
    index: IntArray  # (m + 1,) first beam at or after each of m even steps of the pseudo-angle
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
        steps = np.linspace(-2.0, 2.0, INDEX_STEPS * len(rays) + 1)
        return Sweep(
            height=float(rays.origins[0, 2]),
            order=order,
            rows=np.vstack([bearing, rays.directions[order, :2].T, offset.T]),
            index=np.searchsorted(bearing, steps),
            centre=np.array([*centre, np.hypot(*offset.T).max()]),
        )

    def beams(self, measured: FloatArray) -> FloatArray:
        """(6, n) the sorted beams with their measured ranges (n,), as the kernels take them."""
        return np.ascontiguousarray(np.vstack([self.rows, measured[self.order]]))

    def unsorted(self, values: NDArray[T]) -> NDArray[T]:
        """Values (..., n) of sorted beams in the scan's own order."""
        out = np.empty_like(values)
        out[..., self.order] = values
        return out


def pseudo_angles(directions: FloatArray) -> FloatArray:
    """Numbers (n,) in [-2, 2] that grow with the bearings of directions (n, 2 or 3)."""
    x, y = directions[:, 0], directions[:, 1]
    quarter = np.abs(y) / (np.abs(x) + np.abs(y))
    half = np.where(x < 0.0, 2.0 - quarter, quarter)
    return np.asarray(np.where(y < 0.0, -half, half))


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """The wall segments about a place, kept while the robot stays near."""

    middle: FloatArray  # (2,)
    radius: float  # m
    segments: FloatArray  # (k, 4)

    def covers(self, middle: FloatArray, radius: float) -> bool:
        """Whether it holds all segments within ``radius`` m of ``middle`` (2,), and not many more."""
        slack = self.radius - radius
        return bool(np.hypot(*(middle - self.middle)) <= slack <= 2.0 * STRIDE)


class LevelOutlines:
    """Outlines of a building's walls and objects at the heights of its level lasers."""

    def __init__(self, building: Building) -> None:
        self._building = building
        self.hold = all(moves_in_plane(item) for item in building.objects.values())
        self._walls = cache(lambda height: _flat(outline(building.walls, height)))
        self._neighbourhoods: dict[float, Neighbourhood] = {}

    def walls_near(self, height: float, poses: FloatArray, reach: float) -> FloatArray:
        """Wall segments (k, 4) that lie within ``reach`` m of some robot pose (p, 3), and some more."""
        middle = poses[:, :2].mean(axis=0)
        needed = reach + float(np.hypot(*(poses[:, :2] - middle).T).max())
        known = self._neighbourhoods.get(height)
        if known is None or not known.covers(middle, needed):
            walls = self._walls(height)
            chosen = walls[_distance(walls, middle) <= needed + STRIDE]
            known = Neighbourhood(middle, needed + STRIDE, np.ascontiguousarray(chosen))
            self._neighbourhoods[height] = known
        return known.segments

    @cache  # noqa: B019 - lives as long as the outlines it belongs to
    def of_object(self, name: str, height: float) -> FloatArray:
        """Outline (k, 4) of an object at a height, about its origin in its home state."""
        item = self._building[name]
        home = item.transforms(item.home[None])[0]
        segments = outline(item.mesh.moved(home), height)
        return _flat(segments - home[:2, 3])

    def placements(self, name: str, states: FloatArray) -> FloatArray:
        """Positions and turns (s, 3), against the home state, of an object's outline in states (s, d)."""
        return _placements(self._building[name], states)


def moves_in_plane(item: MovableObject) -> bool:
    """Whether an object only turns about vertical axes and moves horizontally."""
    if item.kind is Kind.PLANAR:
        return True
    axis = item.origin[:3, :3] @ item.axis
    if item.kind is Kind.HINGED:
        return bool(np.hypot(axis[0], axis[1]) < LEVEL)
    return bool(abs(axis[2]) < LEVEL)


def _placements(item: MovableObject, states: FloatArray) -> FloatArray:
    """Positions and turns (s, 3) of the link's frame against the home state."""
    if item.kind is Kind.PLANAR:
        return np.ascontiguousarray(states - np.array([0.0, 0.0, item.home[2]]))
    axis, out = item.origin[:3, :3] @ item.axis, np.empty((len(states), 3))
    if item.kind is Kind.HINGED:
        out[:, :2] = item.origin[:2, 3]
        out[:, 2] = np.sign(axis[2]) * (states[:, 0] - item.home[0])
    else:
        out[:, :2] = item.origin[:2, 3] + states * axis[:2]
        out[:, 2] = 0.0
    return out


def _flat(segments: FloatArray) -> FloatArray:
    return np.ascontiguousarray(segments.reshape(-1, 4))


def _distance(segments: FloatArray, point: FloatArray) -> FloatArray:
    """Distances (k,) of segments (k, 4) from a point (2,)."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    length_squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = (((point - start) * along).sum(axis=1) / length_squared).clip(0.0, 1.0)
    nearest = start + share[:, None] * along
    return np.asarray(np.hypot(*(nearest - point).T))
