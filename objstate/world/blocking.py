"""Whether something movable stands in the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from objstate.errors import WorldError
from objstate.geometry import FloatArray, invert
from objstate.objects import ObjectBelief
from objstate.objects.footprint import hull_from_above, motions, silhouette

ROUND_OFF = 1e-9  # m; touching is no blocking


@dataclass(frozen=True)
class Blocker:
    """An object that may be in the way."""

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
    the planner's map. Raises WorldError for a path or a radius that is none.
    """
    points = _checked(path, robot_radius)
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
    import shapely

    moved = motions(belief.item, belief.states)
    near = _near(belief, moved, path, robot_radius)
    if not near.any():
        return 0.0
    back = invert(moved[near])  # the path as the object sees it, which is one shape for all states
    seen = path @ back[:, :2, :2].swapaxes(1, 2) + back[:, None, :2, 3]
    lines = shapely.linestrings(seen)
    hit = shapely.dwithin(silhouette(belief.item), lines, robot_radius - ROUND_OFF)
    return float(np.minimum(belief.weights.values[near][hit].sum(), 1.0))


def _near(
    belief: ObjectBelief, moved: FloatArray, path: FloatArray, robot_radius: float
) -> np.ndarray:
    """(n,) in which states the object comes near the path's bounding box at all."""
    hull = hull_from_above(belief.item)
    middle = hull.mean(axis=0)
    reach = np.linalg.norm(hull - middle, axis=1).max() + robot_radius
    places = moved[:, :2, :2] @ middle + moved[:, :2, 3]
    low, high = path.min(axis=0) - reach, path.max(axis=0) + reach
    return np.asarray(((places >= low) & (places <= high)).all(axis=1))


def _checked(path: ArrayLike, robot_radius: float) -> FloatArray:
    points = np.asarray(path, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not len(points) or not np.isfinite(points).all():
        raise WorldError("A path is a list of points (x, y), in finite metres; give at least one.")
    if not (np.isfinite(robot_radius) and robot_radius > 0.0):
        raise WorldError(f"The robot's radius of {robot_radius} m must be above 0 and finite.")
    return np.concatenate([points, points]) if len(points) == 1 else points
