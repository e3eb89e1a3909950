"""The bearing of a closed door by the walls beside it, which a closed leaf continues."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.building.outline import outline
from objstate.geometry import FloatArray

ASKEW_DEG = 0.3  # deviation of a closed leaf from the direction of its wall
BENT_DEG = 0.1  # deviation of a straight wall's direction here from that of the whole
MOST_DEG = 6.0  # between a modelled leaf and a wall, up to which the leaf closes along it
ASIDE = 0.3  # m between a leaf and a face of its wall, at most
BESIDE, OVER = 0.6, 0.2  # m between an end of a leaf and the wall on that side; of overlap
SHORTEST = 0.3  # m, of a wall that shows a direction
FACES = 2  # of a wall, whose errors are the same


class BearingReading(NamedTuple):
    """A reading of the error of a closed door's bearing, with Gaussian noise."""

    error: float  # rad, in the direction of the door's state
    variance: float  # rad^2


def bearings_by_walls(
    building: Building, names: Iterable[str], wall_std_m: float
) -> dict[str, BearingReading]:
    """The bearings of some doors of a building, where walls at the leaf's height tell them."""
    walls_at = cache(lambda height: outline(building.walls, height).reshape(-1, 4))
    found = {}
    for name in names:
        item = building.objects[name]
        if item.kind is not Kind.HINGED:
            continue
        leaf = item.mesh.moved(item.transforms(item.home[None])[0])
        heights = leaf.vertices[:, 2]
        height = round(0.5 * float(heights.min() + heights.max()), 1)
        segments = outline(leaf, height).reshape(-1, 4)
        reading = bearing_by_walls(item, segments, walls_at(height), wall_std_m)
        if reading is not None:
            found[name] = reading
    return found


def bearing_by_walls(
    item: MovableObject, leaf: FloatArray, walls: FloatArray, wall_std_m: float
) -> BearingReading | None:
    """The bearing of a hinged door that is closed in its home state, by walls in line with it.

    ``leaf`` (k, 4) and ``walls`` (n, 4) are segments in m, with the leaf in its home state. None
    where no wall tells it, and where that state isn't at a limit.
    """
    if item.wraps or item.home[0] not in (item.lower, item.upper):
        return None
    reading = by_walls(leaf, walls, wall_std_m)
    if reading is None or item.direction[2] > 0.0:
        return reading
    return reading._replace(error=-reading.error)


def by_walls(leaf: FloatArray, walls: FloatArray, wall_std_m: float) -> BearingReading | None:
    """The error of a bearing, counter-clockwise, by walls in line with the leaf; None without any.

    The ends of a wall have independent errors of a deviation ``wall_std_m`` across it. The mean of the
    walls' directions is weighted by their precision, and is as uncertain as they differ.
    """
    sides = leaf[:, 2:] - leaf[:, :2]
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    if lengths.max(initial=0.0) == 0.0:
        return None
    along = sides[lengths.argmax()] / lengths.max()
    axes = np.column_stack([along, [-along[1], along[0]]])
    (begin, right), (end, left) = (
        bound(leaf.reshape(-1, 2) @ axes, axis=0) for bound in (np.min, np.max)
    )
    ends = walls.reshape(-1, 2, 2) @ axes
    ends = np.take_along_axis(ends, ends[..., :1].argsort(axis=1), axis=1)
    way = ends[:, 1] - ends[:, 0]
    lengths, turns = np.hypot(*way.T), np.arctan2(way[:, 1], way[:, 0])
    near = np.zeros(len(walls), dtype=bool)
    for tips, before, past in (
        (ends[:, 1], begin - BESIDE, begin + OVER),
        (ends[:, 0], end - OVER, end + BESIDE),
    ):
        in_line = (right - ASIDE <= tips[:, 1]) & (tips[:, 1] <= left + ASIDE)
        near |= in_line & (before <= tips[:, 0]) & (tips[:, 0] <= past)
    near &= (lengths >= SHORTEST) & (np.abs(turns) <= math.radians(MOST_DEG))
    if not near.any():
        return None
    lengths, turns = lengths[near], turns[near]
    precisions = 1.0 / (2.0 * (wall_std_m / lengths) ** 2 + math.radians(BENT_DEG) ** 2)
    shares = precisions / precisions.sum()
    error = float(shares @ turns)
    variance = math.radians(ASKEW_DEG) ** 2 + FACES / float(precisions.sum())
    return BearingReading(error, variance + float(shares @ (turns - error) ** 2))
