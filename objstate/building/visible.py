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
SNAP = 3.0 * JOIN  # m by which places in the network of all segments may be off


def visible(segments: FloatArray) -> FloatArray:
    """Segments (m, 2, 2) of an outline (k, 2, 2) without those, and those ends, that no laser sees.

    Rays from regions in which a circle of radius ``LASER_ROOM`` fits meet what they met before. The
    outline is one that ``outline`` gives, whose collinear segments are joined.
    """
    import shapely

    if len(segments) == 0:
        return segments
    lines = shapely.linestrings(segments)
    network = shapely.unary_union(lines, grid_size=JOIN)  # cut wherever segments meet
    regions = shapely.get_parts(shapely.polygonize([network]))
    narrow = regions[_is_narrow(regions)]
    edges = _edges(shapely.get_parts(network))
    is_shown = ~_is_between(edges, _edges(shapely.get_rings(narrow)))
    if is_shown.all():
        return segments
    return _trimmed(segments, edges[is_shown])


def _is_narrow(regions: Any) -> BoolArray:
    """In which of shapely's polygons (n,) no circle of radius ``LASER_ROOM`` fits."""
    import shapely

    area = shapely.area(regions)
    is_narrow = area < np.pi * LASER_ROOM**2
    # all of a narrow region is near its boundary; only what may be narrow is worth the rest
    unsure = np.flatnonzero(~is_narrow & (area < 2.0 * LASER_ROOM * shapely.length(regions)))
    is_narrow[unsure] = shapely.is_empty(shapely.buffer(regions[unsure], -LASER_ROOM))
    return np.asarray(is_narrow)


def _trimmed(segments: FloatArray, shown: FloatArray) -> FloatArray:
    """The segments (m, 2, 2) of some (k, 2, 2) from the first to the last of the edges ``shown`` (n, 2, 2) on each."""
    import shapely

    along = segments[:, 1] - segments[:, 0]
    squared = np.sum(along**2, axis=1)
    of = shapely.STRtree(shapely.linestrings(segments)).nearest(shapely.points(shown.mean(axis=1)))
    off = np.einsum("nij,nj->ni", shown - segments[of, None, 0], along[of]) / squared[of, None]
    first, last = np.ones(len(segments)), np.zeros(len(segments))
    np.minimum.at(first, of, off.min(axis=1))
    np.maximum.at(last, of, off.max(axis=1))
    snap = SNAP / np.sqrt(squared)
    first, last = (
        np.where(first <= snap, 0.0, first - snap),
        np.where(last >= 1.0 - snap, 1.0, last + snap),
    )
    is_left = first < last
    ends = [segments[:, 0] + share[:, None] * along for share in (first, last)]
    ends[1] = np.where(last[:, None] == 1.0, segments[:, 1], ends[1])
    return np.stack(ends, axis=1)[is_left]


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
