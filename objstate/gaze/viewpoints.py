"""Places from which to look at an object."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Kind
from objstate.config import Count, Positive, Strict
from objstate.gaze.floor import Floor, leaf_ends
from objstate.gaze.sensors import Sensor
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.objects import ObjectBelief
from objstate.sensing.casters import Caster

SIGHT = 0.05  # m before a wall at which what stands there still counts as in sight


class ViewpointSettings(Strict):
    """How many places to look from, and how far away."""

    places: Count = 4  # of each object
    nearest: Positive = 0.8  # m from the object's middle
    farthest: Positive = 2.5  # m
    preferred: Positive = 1.5  # m, the distance of the first place


def middle_of(belief: ObjectBelief) -> FloatArray:
    """The point (2,) to look at: the middle of a door's frame, furniture's estimated place."""
    if belief.item.kind is Kind.PLANAR:
        return np.asarray(belief.mean[:2])
    near, far = leaf_ends(belief.item)
    return np.asarray((near + far) / 2.0)


def viewpoints(
    belief: ObjectBelief,
    floor: Floor,
    walls: Caster,
    sensor: Sensor,
    settings: ViewpointSettings,
    piece: int,
) -> tuple[FloatArray, IntArray]:
    """Poses (k, 3) from which to look at an object, at most the settings' ``places``, and cells.

    They stand in one connected ``piece`` of the free floor, see the object's middle past the walls
    at the sensor's height, turn the sensor to it, and are as far from one another as possible.
    """
    s, middle = settings, middle_of(belief)
    cells = floor.within(middle - s.farthest, middle + s.farthest)
    distance = np.hypot(*(floor.places[cells] - middle).T)
    ring = (floor.pieces[cells] == piece) & (distance >= s.nearest) & (distance <= s.farthest)
    ring[ring] = _in_sight(floor.places[cells[ring]], middle, walls, sensor.height)
    if not ring.any():
        return np.zeros((0, 3)), cells[ring]
    cells, distance = cells[ring], distance[ring]
    first = int(np.abs(distance - s.preferred).argmin())
    chosen = cells[_far_apart(floor.places[cells], first, s.places)]
    towards = middle - floor.places[chosen]
    yaw = wrap(np.arctan2(towards[:, 1], towards[:, 0]) - sensor.yaw)
    return np.column_stack([floor.places[chosen], yaw]), chosen


def _in_sight(places: FloatArray, middle: FloatArray, walls: Caster, height: float) -> np.ndarray:
    """Which places (n, 2) no wall separates from a point (2,)."""
    off = np.column_stack([places - middle, np.zeros(len(places))])
    length = np.linalg.norm(off, axis=1)
    start = np.tile([*middle, height], (len(places), 1))
    return np.asarray(walls.distances(start, off / length[:, None]) > length - SIGHT)


def _far_apart(places: FloatArray, first: int, count: int) -> IntArray:
    """Numbers of up to ``count`` of the places (n, 2), each the farthest from those before it."""
    chosen = [first]
    gap = np.linalg.norm(places - places[first], axis=1)
    while len(chosen) < min(count, len(places)):
        chosen.append(int(gap.argmax()))
        gap = np.minimum(gap, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return np.array(chosen)
