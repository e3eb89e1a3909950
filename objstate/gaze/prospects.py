"""What looks from many places would tell of many objects, at one moment.

Simulating a look takes longer than weighing what it tells against a belief. So looks
are kept, and used again as long as nothing moved that they show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.gaze.entropy import belief_entropy
from objstate.gaze.laser import LaserLooks, Look
from objstate.gaze.viewpoints import middle_of
from objstate.geometry import BoolArray, FloatArray, wrap
from objstate.objects import ObjectBelief

MARGIN = 0.2  # m, more than simulated looks shift an object
SAME = 0.1  # m and rad to which states are rounded before a look is simulated anew

Mark = tuple[object, ...]


@dataclass(frozen=True)
class LookLibrary:
    """Looks of some lasers, each simulated once."""

    lasers: Mapping[str, LaserLooks]
    _known: dict[Mark, Look | None] = field(default_factory=dict, init=False, repr=False)

    def look(
        self, sensor: str, belief: ObjectBelief, pose: FloatArray, others: Mapping[str, _Standing]
    ) -> Look | None:
        """What a sensor's look from ``pose`` (3,) tells of an object before or behind others."""
        around = tuple(each.mark for each in others.values())
        key: Mark = (sensor, belief.item.name, pose.tobytes(), around)
        if belief.item.kind is Kind.PLANAR:
            key += (_rounded(belief.mean),)
        if key not in self._known:
            states = {name: each.state for name, each in others.items()}
            self._known[key] = self.lasers[sensor].look(belief, pose, states)
        return self._known[key]


@dataclass(frozen=True, eq=False)
class _Standing:
    """An object whose state is known well enough to stand in a scene."""

    state: FloatArray  # (d,)
    mark: Mark


class Prospects:
    """Expected gains under one moment's beliefs.

    Args:
        library: what looks tell.
        beliefs: of all objects.
        reach: m from the robot, within which the estimator updates objects.
    """

    def __init__(
        self, library: LookLibrary, beliefs: Mapping[str, ObjectBelief], reach: float
    ) -> None:
        self.beliefs = beliefs
        self._library = library
        self._reach = reach
        self._names = list(beliefs)
        self._middles = np.array([middle_of(each) for each in beliefs.values()]).reshape(-1, 2)
        self._radii = np.array([_radius(each.item) for each in beliefs.values()])
        self._standing = {
            name: _Standing(each.mean, (name, _rounded(each.mean)))
            for name, each in beliefs.items()
            if each.settled
        }
        self._gains: dict[Mark, Mapping[str, float]] = {}

    @cached_property
    def entropies(self) -> dict[str, float]:
        """What is not known of each object, nats."""
        return {name: belief_entropy(belief) for name, belief in self.beliefs.items()}

    def near(self, places: FloatArray) -> BoolArray:
        """(o,) which objects, in the order of the beliefs, are within reach of one of places (k, 2)."""
        off = np.linalg.norm(self._middles - places[:, None], axis=2)
        return np.asarray((off <= self._reach).any(axis=0))

    def gains_at(self, sensor: str, pose: FloatArray, scans: float) -> Mapping[str, float]:
        """Expected gain of each object in sight from ``pose`` (3,) by some scans, nats."""
        key = (sensor, pose.tobytes(), scans)
        if key not in self._gains:
            self._gains[key] = self._looked(sensor, pose, scans)
        return self._gains[key]

    def _looked(self, sensor: str, pose: FloatArray, scans: float) -> dict[str, float]:
        off = self._middles - pose[:2]
        distance = np.hypot(off[:, 0], off[:, 1])
        near = [self._names[k] for k in np.flatnonzero(distance <= self._reach)]
        # an object is wholly out of view where even its nearest point is, seen from there
        turn = np.abs(wrap(np.arctan2(off[:, 1], off[:, 0]) - pose[2]))
        width = np.where(
            distance > self._radii, np.arcsin(np.minimum(self._radii / distance, 1.0)), np.pi
        )
        half = self._library.lasers[sensor].sensor.field_of_view / 2.0
        in_view = {self._names[k] for k in np.flatnonzero(turn - width <= half)}
        gains = {}
        for name in (each for each in near if each in in_view):
            others = {o: self._standing[o] for o in near if o != name and o in self._standing}
            look = self._library.look(sensor, self.beliefs[name], pose, others)
            if look is not None:
                gains[name] = look.gain(self.beliefs[name], scans)
        return gains


def _rounded(state: FloatArray) -> bytes:
    return np.asarray(np.rint(state / SAME)).tobytes()


def _radius(item: MovableObject) -> float:
    """m from where an object is looked for, within which all of it is where its look is simulated."""
    widest = float(np.hypot(*item.mesh.vertices[:, :2].T).max())
    if item.kind is Kind.PLANAR:
        return widest + MARGIN
    if item.kind is Kind.SLIDING:
        return widest + max(abs(item.lower), abs(item.upper)) + MARGIN
    return 1.5 * widest + MARGIN  # half of the leaf to the hinge, and the leaf
