"""The outline of walls without what lies inside them, which no laser sees.

Walls that were put together from many shapes, as from one box for each cell of a map, are full of
faces that two shapes share. The outline of all of them divides the floor into regions. What lies
between two regions that are both too narrow for a laser can't be seen.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.building.outline import JOIN
from objstate.geometry import BoolArray, FloatArray, IntArray

LASER_ROOM = 0.1  # m: a circle of this radius holds about half of a small robot, and its laser
SNAP = 3.0 * JOIN  # m: shorter edges may be remainders of a crossing after rounding


def visible(segments: FloatArray) -> FloatArray:
    """The segments (m, 2, 2) of an outline (k, 2, 2) of which a laser can see some part.

    From regions that hold a circle of radius ``LASER_ROOM``, rays meet exactly what they met
    before.
    """
    import shapely

    if len(segments) == 0:
        return segments
    lines = shapely.linestrings(segments)
    network = shapely.unary_union(lines, grid_size=JOIN)  # cut wherever segments meet
    regions = shapely.get_parts(shapely.polygonize([network]))
    narrow = regions[_is_narrow(regions)]
    edges = _edges(shapely.get_parts(network))
    is_hidden = _is_between(edges, _edges(shapely.get_rings(narrow)))
    if not is_hidden.any():
        return segments
    shown = edges[~is_hidden]
    shown = shown[np.linalg.norm(shown[:, 1] - shown[:, 0], axis=1) > SNAP]
    is_seen = np.zeros(len(segments), dtype=bool)
    is_seen[shapely.STRtree(lines).nearest(shapely.points(shown.mean(axis=1)))] = True
    return segments[is_seen]


def _is_narrow(regions: Any) -> BoolArray:
    """In which of shapely's polygons (n,) no circle of radius ``LASER_ROOM`` fits."""
    import shapely

    area = shapely.area(regions)
    is_narrow = area < np.pi * LASER_ROOM**2
    # all of a narrow region is near its boundary; only possibly narrow ones are tested further
    unsure = np.flatnonzero(~is_narrow & (area < 2.0 * LASER_ROOM * shapely.length(regions)))
    is_narrow[unsure] = shapely.is_empty(shapely.buffer(regions[unsure], -LASER_ROOM))
    return np.asarray(is_narrow)


def _edges(lines: Any) -> FloatArray:
    """The segments (k, 2, 2) of lines of shapely (n,)."""
    import shapely

    points, of = shapely.get_coordinates(lines, return_index=True)
    pairs = np.stack([points[:-1], points[1:]], axis=1)
    return np.asarray(pairs[of[:-1] == of[1:]])


def _numbered(segments: FloatArray) -> IntArray:
    """Numbers (k,) of segments (k, 2, 2), the same for those between the same two points."""
    points = segments[..., 0] + 1j * segments[..., 1]
    ends, number = np.unique(points, return_inverse=True)
    first, second = np.sort(number.reshape(-1, 2), axis=1).T
    return np.asarray(first * len(ends) + second)


def _is_between(edges: FloatArray, sides: FloatArray) -> BoolArray:
    """Which edges (k, 2, 2) are sides of two regions, by the ``sides`` (n, 2, 2) of each."""
    numbers = _numbered(np.concatenate([edges, sides]))
    known, times = np.unique(numbers[len(edges) :], return_counts=True)
    return np.isin(numbers[: len(edges)], known[times > 1])
