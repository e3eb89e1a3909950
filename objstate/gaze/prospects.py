"""The expected evidence of looks from many places about many objects, at one moment.

Simulating a look takes longer than evaluating it for a belief. So looks are cached, and used again
as long as nothing in them has moved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building, Kind
from objstate.estimator.surroundings import Surroundings
from objstate.gaze.entropy import belief_entropy
from objstate.gaze.gains import Gain, gain_of
from objstate.gaze.laser import LaserLooks, keep
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import lazy
from objstate.objects import ObjectBelief

MARGIN = 0.2  # m; error of robot and objects when the look is taken
MOMENT = 10**9  # ns after a look in which another from the same place carries no new information
SAME = 0.1  # m and rad to which states are rounded before a look is simulated

Mark = tuple[object, ...]


@dataclass(frozen=True, eq=False)
class _Standing:
    """An object whose state is known well enough to stand in a scene."""

    state: FloatArray  # (d,)
    mark: Mark


class LookLibrary:
    """Looks of some lasers in one building, each simulated once.

    Args:
        building: the walls and the objects.
        lasers: by name of the sensor.
        reach: m from the robot, within which the estimator updates objects.
    """

    def __init__(self, building: Building, lasers: Mapping[str, LaserLooks], reach: float) -> None:
        self.lasers = lasers
        self.reach = reach
        self._surroundings = Surroundings(building)
        self._known: dict[Mark, FloatArray | None] = {}

    def look(
        self,
        sensor: str,
        belief: ObjectBelief,
        pose: FloatArray,
        others: Mapping[str, _Standing],
        scans: float,
    ) -> FloatArray | None:
        """The evidence of a sensor's scans from ``pose`` (3,) about an object among others."""
        around = tuple(each.mark for each in others.values())
        key: Mark = (sensor, belief.item.name, pose.tobytes(), scans, around)
        if belief.item.kind is Kind.PLANAR:
            key += (_rounded(belief.mean),)
        if key not in self._known:
            states = {name: each.state for name, each in others.items()}
            keep(self._known, key, self.lasers[sensor].look(belief, pose, states, scans))
        return self._known[key]

    def circles(self, beliefs: Mapping[str, ObjectBelief]) -> FloatArray:
        """(o, 3) x, y and radius, m, of circles around doors' states and furniture's means."""
        circles = self._surroundings.circles(list(beliefs))
        for circle, belief in zip(circles, beliefs.values(), strict=True):
            if belief.item.kind is Kind.PLANAR:
                circle[:2] = belief.mean[:2]
        return circles


class Prospects:
    """The expected evidence of looks under one moment's beliefs.

    Args:
        library: the simulated looks.
        beliefs: of all objects.
    """

    def __init__(self, library: LookLibrary, beliefs: Mapping[str, ObjectBelief]) -> None:
        self.beliefs = beliefs
        self.names = list(beliefs)
        self._library = library
        self._circles = library.circles(beliefs)
        self._standing = {
            name: _Standing(each.mean, (name, _rounded(each.mean)))
            for name, each in beliefs.items()
            if each.is_certain
        }
        self._gains: dict[str, Gain] = {}
        self._told: dict[Mark, FloatArray | None] = {}

    @lazy
    def entropies(self) -> FloatArray:
        """What is not known of each object (o,), nats."""
        return np.array([belief_entropy(belief) for belief in self.beliefs.values()])

    @property
    def just_seen(self) -> BoolArray:
        """(o,) which objects were observed a moment ago."""
        stamps = [(each.stamp_ns, each.last_observed_ns) for each in self.beliefs.values()]
        return np.array(
            [now is not None and seen is not None and now - seen <= MOMENT for now, seen in stamps],
            dtype=bool,
        )

    def near(self, sensor: str, poses: FloatArray, through_walls: bool = False) -> BoolArray:
        """(k, o) which objects, in the order of the beliefs, a sensor may see from poses (k, 3).

        They are within reach, and some beam comes near them before it ends at a wall; or after it,
        ``through_walls``, which is found sooner.
        """
        reach = self._circles[:, 2] + self._library.reach - MARGIN
        circles = self._circles + np.array([0.0, 0.0, MARGIN])
        return self._library.lasers[sensor].in_sight(poses, circles, reach, through_walls)

    def evidence(
        self, sensor: str, name: str, pose: FloatArray, near: BoolArray, scans: float
    ) -> FloatArray | None:
        """The evidence of some scans from ``pose`` (3,) about an object among the ``near`` (o,)."""
        key = (sensor, name, pose.tobytes(), scans)
        if key not in self._told:
            others = {
                other: self._standing[other]
                for k in np.flatnonzero(near).tolist()
                if (other := self.names[k]) != name and other in self._standing
            }
            belief = self.beliefs[name]
            self._told[key] = self._library.look(sensor, belief, pose, others, scans)
        return self._told[key]

    def gain(self, name: str, told: FloatArray) -> float:
        """Expected gain, nats, of the summed evidence of some looks about an object.

        Where beams may not meet a door's leaf at all, looks tell less.
        """
        belief = self.beliefs[name]
        if name not in self._gains:
            self._gains[name] = gain_of(belief)
        met = 1.0 if belief.item.kind is Kind.PLANAR else belief.presence
        return met * self._gains[name](told)


def _rounded(state: FloatArray) -> bytes:
    return np.asarray(np.rint(state / SAME)).tobytes()
