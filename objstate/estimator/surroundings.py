"""The objects that a scan may meet, and with which beams, before any ray is cast.

Every object stays within a circle whatever its state: about the hinge of a door, the middle of a
sliding door's range, the believed place of furniture.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.sensing import circles
from objstate.sensing.circles import SPREAD_SIGMAS
from objstate.sensing.level import moves_in_plane


class Surroundings:
    """The circles in which a building's objects can be, updated as beliefs move."""

    def __init__(self, building: Building) -> None:
        self.names = tuple(building.objects)
        self._index = {name: k for k, name in enumerate(self.names)}
        self._reach = {name: _reach(item) for name, item in building.objects.items()}
        found = [_circle(item, self._reach[name]) for name, item in building.objects.items()]
        self._circles = np.array(found).reshape(-1, 3)  # x, y, radius

    def follow(self, name: str, belief: ObjectBelief) -> None:
        """Move a piece of furniture's circle with its belief."""
        if belief.item.kind is Kind.PLANAR:
            strayed = SPREAD_SIGMAS * float(np.hypot(belief.std[0], belief.std[1]))
            radius = self._reach[name] + strayed
            self._circles[self._index[name]] = [*belief.mean[:2], radius]

    def rehang(self, item: MovableObject) -> None:
        """Move a door's circle with its hinge."""
        self._circles[self._index[item.name]] = _circle(item, self._reach[item.name])

    def circles(self, names: Sequence[str]) -> FloatArray:
        """(m, 3) x, y and radius, m, of the circles of some objects."""
        return self._circles[[self._index[name] for name in names]].reshape(-1, 3)

    @property
    def all_circles(self) -> FloatArray:
        """(m, 3) the circles of all objects, in the order of their names."""
        return self._circles

    def within(self, place: FloatArray, distance: float) -> tuple[list[str], FloatArray]:
        """The objects within ``distance`` m of a place (2 or 3,), and their circles (m, 3)."""
        numbers, around = circles.within(self._circles, place[0], place[1], distance)
        return [self.names[k] for k in numbers.tolist()], around


def item_states(item: MovableObject) -> FloatArray:
    """States (k, d) between which an object moves: its limits, or its modelled place."""
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
