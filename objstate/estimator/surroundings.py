"""Which objects a scan may see, and with which beams, before any ray is cast.

Every object stays within a circle about its place, whatever its state: about the
hinge of a door, the middle of a sliding door's way, the believed place of furniture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief
from objstate.records import Rays
from objstate.sensing.level import moves_in_plane

SPREAD_SIGMAS = 3.0  # how far samples of a belief stray from its mean


class Surroundings:
    """The circles in which a building's objects can be, kept up as beliefs move."""

    def __init__(self, building: Building) -> None:
        self.names = tuple(building.objects)
        self._index = {name: k for k, name in enumerate(self.names)}
        self._reach = {name: _reach(item) for name, item in building.objects.items()}
        circles = [_circle(item, self._reach[name]) for name, item in building.objects.items()]
        self._circles = np.array(circles).reshape(-1, 3)  # x, y, radius

    def follow(self, name: str, belief: ObjectBelief) -> None:
        """Let a piece of furniture's circle follow its belief."""
        if belief.item.kind is Kind.PLANAR:
            strayed = SPREAD_SIGMAS * float(np.hypot(belief.std[0], belief.std[1]))
            radius = self._reach[name] + strayed
            self._circles[self._index[name]] = [*belief.mean[:2], radius]

    def rehang(self, item: MovableObject) -> None:
        """Let an object's circle follow its hinge."""
        self._circles[self._index[item.name]] = _circle(item, self._reach[item.name])

    def within(
        self, robot: PoseBelief, distance: float, among: Sequence[str] | None = None
    ) -> list[str]:
        """Names of the objects, of all or of some, whose circles come within ``distance`` m of the robot."""
        names, circles = self.names if among is None else among, self.circles(among)
        off, reach = circles[:, :2] - robot.mean[:2], circles[:, 2] + distance
        near = (off * off).sum(axis=1) <= reach * reach
        return [names[k] for k in np.flatnonzero(near).tolist()]

    def entries(self, names: Sequence[str], robot: PoseBelief, rays: Rays) -> FloatArray:
        """Range (m, n) at which each beam enters each named object's circle; inf where it passes by.

        The circles are widened by what the robot's own uncertainty may shift them.
        """
        circles = self.circles(names)
        x, y, yaw = robot.mean.tolist()
        cos, sin = math.cos(yaw), math.sin(yaw)
        east, north = circles[:, 0] - x, circles[:, 1] - y
        seen = np.array([cos * east + sin * north, cos * north - sin * east])  # from the robot
        yaw_std = math.sqrt(robot.covariance[2, 2])
        margin = robot.position_std + yaw_std * np.hypot(seen[0], seen[1])
        radius = (circles[:, 2] + SPREAD_SIGMAS * margin)[:, None]
        directions, level = rays.courses
        to_x = seen[0][:, None] - rays.origins[:, 0]
        to_y = seen[1][:, None] - rays.origins[:, 1]
        along = to_x * directions[:, 0] + to_y * directions[:, 1]
        aside = to_x * directions[:, 1] - to_y * directions[:, 0]
        squared = radius * radius - aside * aside
        half = np.sqrt(np.maximum(squared, 0.0))
        passes = (squared < 0.0) | (along + half <= 0.0)
        entered = np.maximum(along - half, 0.0) / level
        entered[passes] = np.inf
        return np.asarray(entered)

    def circles(self, names: Sequence[str] | None) -> FloatArray:
        """(m, 3) x, y and radius, m, of the circles of some objects, or of all."""
        if names is None:
            return self._circles
        return self._circles[[self._index[name] for name in names]].reshape(-1, 3)


def item_states(item: MovableObject) -> FloatArray:
    """States (k, d) between which an object moves: its limits, or where it should stand."""
    if item.kind is Kind.PLANAR:
        return item.home[None]
    return np.array([[item.lower], [item.upper]])


def _circle(item: MovableObject, reach: float) -> tuple[float, float, float]:
    """Middle and radius of the circle that holds an object of some reach in all its states."""
    places = item.transforms(item_states(item))[:, :2, 3]
    middle = places.mean(axis=0)
    strayed = float(np.hypot(*(places - middle).T).max())
    return float(middle[0]), float(middle[1]), reach + strayed


def _reach(item: MovableObject) -> float:
    """Largest horizontal distance of the object's mesh from its own origin in any state, m."""
    if len(item.mesh.vertices) == 0:
        return 0.0
    if not moves_in_plane(item):
        return float(np.linalg.norm(item.mesh.vertices, axis=1).max())
    turned = item.mesh.vertices @ item.transforms(item.home[None])[0, :3, :3].T
    return float(np.hypot(turned[:, 0], turned[:, 1]).max())
