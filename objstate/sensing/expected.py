"""Expected ranges: d-hat of eq. (10), Schulz and Burgard 2001.

The walls stand in one scene. Each movable object is cast in its own frame, and the expected range
is the smaller one. So a new state needs no rebuilding.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from functools import cache

import numpy as np

from objstate.building.model import Building, MovableObject
from objstate.geometry import FloatArray, invert, transform_from_pose
from objstate.records import Rays
from objstate.sensing.casters import Caster, caster_of


class ExpectedRanges:
    """Expected ranges in one building, for any robot poses and object states."""

    def __init__(self, building: Building) -> None:
        self.building = building
        self._walls = caster_of(building.walls)
        self._object_caster = cache(lambda name: _caster_of(building[name]))

    def with_object(self, item: MovableObject) -> ExpectedRanges:
        """The same building with one object at another place."""
        other = copy(self)
        other.building = self.building.with_object(item)
        return other

    def walls(self, poses: FloatArray, rays: Rays) -> FloatArray:
        """Ranges (p, n) m to the walls from robot poses (p, 3); inf where there are none."""
        origins, directions = cast_from(transform_from_pose(poses), rays)
        hit = self._walls.distances(origins.reshape(-1, 3), directions.reshape(-1, 3))
        return hit.reshape(len(poses), len(rays))

    def object(self, name: str, states: FloatArray, poses: FloatArray, rays: Rays) -> FloatArray:
        """Ranges (p, s, n) m to one object alone, from robot poses (p, 3), in its states (s, d)."""
        into_link = invert(self.building[name].transforms(states))  # (s, 4, 4)
        base_in_link = into_link[None] @ transform_from_pose(poses)[:, None]  # (p, s, 4, 4)
        origins, directions = cast_from(base_in_link, rays)
        hit = self._object_caster(name).distances(origins.reshape(-1, 3), directions.reshape(-1, 3))
        return hit.reshape(len(poses), len(states), len(rays))

    def scene(self, states: Mapping[str, FloatArray], poses: FloatArray, rays: Rays) -> FloatArray:
        """Ranges (p, n) m to the nearest of the walls and the objects in ``states``, each (d,)."""
        nearest = self.walls(poses, rays)
        for name, state in states.items():
            nearest = np.minimum(nearest, self.object(name, state[None], poses, rays)[:, 0])
        return nearest


def _caster_of(item: MovableObject) -> Caster:
    return caster_of(item.mesh, upright=item.transforms(item.home[None])[0, :3, :3])


def cast_from(base: FloatArray, rays: Rays) -> tuple[FloatArray, FloatArray]:
    """Origins and directions (..., n, 3) of ``rays`` when ``base_link`` stands at transforms (..., 4, 4)."""
    rotation = np.swapaxes(base[..., :3, :3], -1, -2)
    return rays.origins @ rotation + base[..., None, :3, 3], rays.directions @ rotation
