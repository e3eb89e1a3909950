"""Plane geometry: rectangles, convex polygons, and rays cast against segments and circles."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

PARALLEL = 1e-12  # m; a ray this parallel to a segment misses it
BLOCK = 64  # rays cast at once, so that all arrays stay in the processor's cache


@dataclass(frozen=True)
class Hits:
    """Where rays end."""

    ranges: Floats  # (n,) m; inf where nothing is hit
    index: Ints  # (n,) which segment, or -1 for a circle or nothing
    cosine: Floats  # (n,) of the angle of incidence; 1 = head on


def placed(points: Floats, x: float, y: float, yaw: float = 0.0) -> Floats:
    """Points (n, 2) turned about the origin, and then moved."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[cos, sin], [-sin, cos]]) + np.array([x, y])


def rectangle(length: float, width: float) -> Floats:
    """Corners (4, 2) of a rectangle centred at the origin."""
    x, y = length / 2, width / 2
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])


def edges(polygon: Floats) -> Floats:
    """Segments (n, 4) as x, y, x, y of a closed polygon (n, 2)."""
    return np.hstack([polygon, np.roll(polygon, -1, axis=0)])


def all_edges(polygons: Iterable[Floats]) -> Floats:
    """Segments (n, 4) of several polygons."""
    parts = [edges(polygon) for polygon in polygons]
    return np.vstack(parts) if parts else np.empty((0, 4))


def overlap(a: Floats, b: Floats) -> bool:
    """Whether two convex polygons share area, by separating axes."""
    for polygon in (a, b):
        along = np.roll(polygon, -1, axis=0) - polygon
        normals = np.column_stack([-along[:, 1], along[:, 0]])
        of_a, of_b = a @ normals.T, b @ normals.T
        if ((of_a.max(0) <= of_b.min(0)) | (of_b.max(0) <= of_a.min(0))).any():
            return False
    return True


def distance_to(point: Floats, segments: Floats) -> Floats:
    """Distances (n,) of a point to segments (n, 4)."""
    begin, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    square = np.maximum((along**2).sum(1), PARALLEL)
    share = np.clip(((point - begin) * along).sum(1) / square, 0.0, 1.0)
    nearest = begin + share[:, None] * along
    return np.asarray(np.hypot(*(nearest - point).T))


def cast(origins: Floats, directions: Floats, segments: Floats) -> tuple[Floats, Ints]:
    """Ranges (n,) of rays up to the nearest segment, and its index; inf and -1 where none is."""
    ranges, index = np.full(len(origins), np.inf), np.full(len(origins), -1)
    if len(segments):
        for begin in range(0, len(origins), BLOCK):
            part = slice(begin, begin + BLOCK)
            ranges[part], index[part] = _cast_block(origins[part], directions[part], segments)
    return ranges, index


def _cast_block(origins: Floats, directions: Floats, segments: Floats) -> tuple[Floats, Ints]:
    along_x, along_y = (segments[:, 2:] - segments[:, :2]).T
    dx, dy = directions[:, :1], directions[:, 1:]
    to_x = segments[:, 0] - origins[:, :1]  # (n, s)
    to_y = segments[:, 1] - origins[:, 1:]
    cross = dx * along_y - dy * along_x
    cross[np.abs(cross) < PARALLEL] = np.nan  # every comparison below is then false
    ranges = (to_x * along_y - to_y * along_x) / cross
    share = (to_x * dy - to_y * dx) / cross
    ranges[~((ranges > 0.0) & (share >= 0.0) & (share <= 1.0))] = np.inf
    index = ranges.argmin(1)
    nearest = ranges[np.arange(len(ranges)), index]
    return nearest, np.where(np.isfinite(nearest), index, -1)


def cosines(directions: Floats, segments: Floats, index: Ints) -> Floats:
    """Cosines (n,) of the angles of incidence of rays that hit segments; 1 where index is -1."""
    if len(segments) == 0:
        return np.ones(len(directions))
    along = (segments[:, 2:] - segments[:, :2])[index]
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), PARALLEL)
    cross = directions[:, 0] * along[:, 1] - directions[:, 1] * along[:, 0]
    return np.where(index >= 0, np.abs(cross) / length, 1.0)


def cast_circles(origins: Floats, directions: Floats, circles: Floats) -> Floats:
    """Ranges (n,) of rays up to the nearest of circles (c, 3) as x, y, radius; inf where none."""
    if len(circles) == 0:
        return np.full(len(origins), np.inf)
    to = circles[None, :, :2] - origins[:, None]
    ahead = (to * directions[:, None]).sum(2)
    aside = (to**2).sum(2) - ahead**2
    depth = circles[:, 2] ** 2 - aside
    ranges = np.where(depth > 0.0, ahead - np.sqrt(np.maximum(depth, 0.0)), np.inf)
    ranges[ranges <= 0.0] = np.inf
    return np.asarray(ranges.min(1))
