"""Whether something movable stands in the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from objstate.building.model import Kind
from objstate.errors import QueryError
from objstate.geometry import BoolArray, FloatArray, invert
from objstate.objects import ObjectBelief
from objstate.objects.footprint import motions, reach, silhouette

ROUND_OFF = 1e-9  # m; touching is no blocking
WIDEST_ROBOT = 5.0  # m, of a radius


@dataclass(frozen=True)
class Blocker:
    """An object that may block the path."""

    object: str
    probability: float


@dataclass(frozen=True)
class Blockage:
    """How probably a path is blocked by something movable, and by what."""

    probability: float
    blockers: tuple[Blocker, ...]  # the most probable first


def blocked(beliefs: Mapping[str, ObjectBelief], path: ArrayLike, robot_radius: float) -> Blockage:
    """The probability that a robot on a path meets a movable object.

    ``path`` (n, 2) is a polyline in m, in the building's frame; the robot is a disc. Objects
    count as independent of each other, as they are estimated. Walls don't count: they are
    the planner's map. Raises QueryError for a path or a radius that is none.
    """
    points = checked_path(path, robot_radius)
    blockers = [
        Blocker(name, float(probability))
        for name, belief in beliefs.items()
        if (probability := probability_on(belief, points, robot_radius)) > 0.0
    ]
    free = np.prod([1.0 - each.probability for each in blockers])
    blockers.sort(key=lambda each: (-each.probability, each.object))
    return Blockage(float(1.0 - free), tuple(blockers))


def probability_on(belief: ObjectBelief, path: FloatArray, robot_radius: float) -> float:
    """The probability that an object reaches within ``robot_radius`` of a polyline (n, 2)."""
    hit = states_on(belief, path, robot_radius)
    if hit is None:
        return 0.0
    return belief.presence * float(np.minimum(belief.weights.values[hit].sum(), 1.0))


def probability_in(belief: ObjectBelief, polygon: FloatArray) -> float:
    """The probability that an object reaches into a polygon (n, 2) m."""
    low, high = _bounds(belief)
    if (polygon.max(axis=0) < low).any() or (polygon.min(axis=0) > high).any():
        return 0.0
    import shapely

    areas = shapely.polygons(_seen_from(belief, polygon))
    hit = np.asarray(shapely.intersects(silhouette(belief.item), areas))
    return belief.presence * float(np.minimum(belief.weights.values[hit].sum(), 1.0))


def states_on(belief: ObjectBelief, path: FloatArray, robot_radius: float) -> BoolArray | None:
    """In which states (n,) an object reaches within ``robot_radius`` of a polyline; None: in none.

    ``path`` is (k, 2) m.
    """
    low, high = _bounds(belief)
    if (path.max(axis=0) < low - robot_radius).any() or (
        path.min(axis=0) > high + robot_radius
    ).any():
        return None
    import shapely

    seen = _seen_from(belief, path)
    is_point = np.ptp(path, axis=0).max() <= ROUND_OFF
    # GEOS has lines of no length only within reach of a prepared shape where they touch it
    ways = shapely.points(seen[:, 0]) if is_point else shapely.linestrings(seen)
    hit = shapely.dwithin(silhouette(belief.item), ways, robot_radius - ROUND_OFF)
    return np.asarray(hit) if hit.any() else None


def _seen_from(belief: ObjectBelief, points: FloatArray) -> FloatArray:
    """Points (k, 2) as the object sees them in each state, (n, k, 2): one shape for all states."""
    back = invert(motions(belief.item, belief.states))
    return np.asarray(points @ back[:, :2, :2].swapaxes(1, 2) + back[:, None, :2, 3])


def _bounds(belief: ObjectBelief) -> tuple[FloatArray, FloatArray]:
    """Two corners (2,) of a box that the object never leaves."""
    low, high = reach(belief.item)
    if belief.item.kind is not Kind.PLANAR:
        return low, high
    places = belief.states[:, :2]
    return places.min(axis=0) + low, places.max(axis=0) + high


def checked_path(path: ArrayLike, robot_radius: float) -> FloatArray:
    points = points_of(path)
    if points is None or not len(points):
        raise QueryError("A path is a list of points (x, y), in finite metres; give at least one.")
    if not (np.isfinite(robot_radius) and robot_radius > 0.0):
        raise QueryError(f"The robot's radius of {robot_radius} m must be above 0 and finite.")
    if robot_radius > WIDEST_ROBOT:
        raise QueryError(
            f"A robot's radius of {robot_radius:g} m is wider than corridors are; give metres."
        )
    return np.concatenate([points, points]) if len(points) == 1 else points


def points_of(given: ArrayLike) -> FloatArray | None:
    """Points (n, 2), finite; None for anything else."""
    try:
        points = np.asarray(given, dtype=float)
    except (TypeError, ValueError):  # ragged, or words
        return None
    is_list = points.ndim == 2 and points.shape[1] == 2 and bool(np.isfinite(points).all())
    return points if is_list else None
