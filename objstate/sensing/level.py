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
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.records import Rays

T = TypeVar("T", bound=np.generic)

LEVEL = 1e-6  # rad or relative: a laser or an axis tilted by less counts as level or upright
SAME_HEIGHT = 1e-6  # m
STRIDE = 2.0  # m the robot moves before the walls near it are looked up again


@dataclass(frozen=True, eq=False)
class Sweep:
    """The beams of a level scan, sorted by bearing in the robot's frame."""

    height: float  # m above the floor
    order: IntArray  # (n,) the scan's beams by bearing
    columns: FloatArray  # (n, 5) bearing, direction, origin relative to the centre; sorted
    centre: FloatArray  # (3,) x, y in the robot's frame, m; largest distance of an origin

    @staticmethod
    def of(rays: Rays) -> Sweep | None:
        """The sweep of some rays, or None where they are not level."""
        if len(rays) == 0 or np.abs(rays.directions[:, 2]).max() > LEVEL:
            return None
        if np.ptp(rays.origins[:, 2]) > SAME_HEIGHT:
            return None
        bearing = wrap(np.arctan2(rays.directions[:, 1], rays.directions[:, 0]))
        order = np.argsort(bearing, kind="stable")
        origin = rays.origins[order, :2]
        centre = (origin.min(axis=0) + origin.max(axis=0)) / 2
        offset = origin - centre
        columns = np.column_stack([bearing[order], rays.directions[order, :2], offset])
        spread = float(np.hypot(offset[:, 0], offset[:, 1]).max())
        return Sweep(float(rays.origins[0, 2]), order, columns, np.array([*centre, spread]))

    def beams(self, measured: FloatArray) -> FloatArray:
        """(n, 6) the sorted beams with their measured ranges (n,), as the kernels take them."""
        return np.ascontiguousarray(np.column_stack([self.columns, measured[self.order]]))

    def unsorted(self, values: NDArray[T]) -> NDArray[T]:
        """Values (..., n) of sorted beams in the scan's own order."""
        out = np.empty_like(values)
        out[..., self.order] = values
        return out


class LevelOutlines:
    """Outlines of a building's walls and objects at the heights of its level lasers."""

    def __init__(self, building: Building) -> None:
        self._building = building
        self.hold = all(moves_in_plane(item) for item in building.objects.values())
        self._walls = cache(lambda height: _flat(outline(building.walls, height)))
        self._near: tuple[float, FloatArray, float, FloatArray] | None = None

    def walls_near(
        self, height: float, middle: FloatArray, poses: FloatArray, reach: float
    ) -> FloatArray:
        """Wall segments (k, 4) within ``reach`` m of any robot pose (p, 3) about ``middle`` (2,)."""
        spread = float(np.hypot(*(poses[:, :2] - middle).T).max())
        if self._near is not None:
            known_height, centre, radius, segments = self._near
            if known_height == height and np.hypot(*(middle - centre)) + spread + reach <= radius:
                return segments
        walls = self._walls(height)
        radius = reach + spread + STRIDE
        segments = np.ascontiguousarray(walls[_distance(walls, middle) <= radius])
        self._near = (height, middle, radius, segments)
        return segments

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
    home = item.transforms(item.home[None])[0]
    moved = item.transforms(states)
    turned = moved[:, :3, :3] @ home[:3, :3].T
    yaw = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
    return np.ascontiguousarray(np.column_stack([moved[:, :2, 3], yaw]))


def _flat(segments: FloatArray) -> FloatArray:
    return np.ascontiguousarray(segments.reshape(-1, 4))


def _distance(segments: FloatArray, point: FloatArray) -> FloatArray:
    """Distances (k,) of segments (k, 4) from a point (2,)."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    length_squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = (((point - start) * along).sum(axis=1) / length_squared).clip(0.0, 1.0)
    nearest = start + share[:, None] * along
    return np.asarray(np.hypot(*(nearest - point).T))
