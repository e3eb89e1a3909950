"""From beliefs to the ranked actions: what to update next, with which sensor, from where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import Positive, Settings, Strict
from objstate.errors import SettingsError
from objstate.gaze.floor import Floor, FloorSettings, Ways, length_of
from objstate.gaze.laser import LaserLooks, Look, LookSettings
from objstate.gaze.sensors import Sensor
from objstate.gaze.viewpoints import ViewpointSettings, middle_of, viewpoints
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.maintenance.choice import ChoiceSettings, costs, utilities
from objstate.objects import ObjectBelief
from objstate.sensing.embree import EmbreeCaster

HEADINGS = 8  # headings, evenly spread, in which looks on the way are simulated
PLACE = 0.1  # m and rad to which others' states are rounded before a look is simulated anew
ROOM = 0.25  # m by which furniture may stray before its viewpoints are sought anew


class CoordinatorSettings(Strict):
    """All settings of the choice of what to look at next."""

    choice: ChoiceSettings = ChoiceSettings()
    looks: LookSettings = LookSettings()
    viewpoints: ViewpointSettings = ViewpointSettings()
    floor: FloorSettings = FloorSettings()
    stride: Positive = 1.0  # m between the places on the way from which looks are simulated


@dataclass(frozen=True, eq=False)
class Action:
    """Update an object with a sensor: a_s(o), Elfring et al. 2014."""

    object: str
    sensor: str
    pose: FloatArray  # (3,) from which to look
    way: FloatArray = field(repr=False)  # (k, 2) m, from the robot to there
    gains: Mapping[str, float]  # nats, expected of each object seen on the way or from there
    distance: float  # m, the length of the way
    cost: float  # eq. (8)
    utility: float  # eq. (9)

    @property
    def gain(self) -> float:
        """Expected information gain in all, nats."""
        return sum(self.gains.values())


class Coordinator:
    """Ranks actions in one building. Holds nothing but what it has computed already.

    Args:
        building: the walls and the objects.
        sensors: the robot's lasers.
        settings: every constant of the choice.
        estimation: the estimator's settings, whose beam model says what readings tell.
        floor: where the robot may drive; by default wherever walls leave room.
    """

    def __init__(
        self,
        building: Building,
        sensors: Sequence[Sensor],
        settings: CoordinatorSettings | None = None,
        estimation: Settings | None = None,
        floor: Floor | None = None,
    ) -> None:
        s = settings or CoordinatorSettings()
        if not sensors:
            raise SettingsError("A robot without a sensor can't look at anything; give one.")
        self.settings = s
        self.building = building
        self.floor = floor or Floor.of(building, s.floor)
        self.sensors = {each.name: each for each in sensors}
        estimation = estimation or Settings()
        self._reach = estimation.object_updates.max_distance
        self._looks = {
            each.name: LaserLooks(building, each, estimation, s.looks) for each in sensors
        }
        self._walls = EmbreeCaster(building.walls)
        self._viewpoints: dict[tuple[object, ...], tuple[FloatArray, IntArray]] = {}
        self._known: dict[tuple[object, ...], Look | None] = {}

    def actions(
        self,
        beliefs: Mapping[str, ObjectBelief],
        at: FloatArray,
        *,
        may_drive: bool = True,
        only: Sequence[str] | None = None,
    ) -> list[Action]:
        """All actions, the most useful first, of a robot at (3,); of objects ``only``, if given.

        A robot that may not drive can only update what it sees from where it is.
        """
        scene = _Scene.of(self, beliefs)
        names = list(beliefs) if only is None else list(only)
        if not may_drive:
            found = [each for name in names for each in self._from_here(scene, name, at)]
        else:
            ways = self.floor.ways_from(at[:2], beliefs)
            found = [each for name in names for each in self._of(scene, name, ways, at)]
        return sorted(found, key=lambda action: -action.utility)

    def best(self, actions: Sequence[Action]) -> Action | None:
        """Eqs. (7), (10), (11): the most useful of ranked actions above the gain threshold, if any."""
        threshold = self.settings.choice.gain_threshold
        return next((each for each in actions if each.gain > threshold), None)

    # --- actions of one object ------------------------------------------------------

    def _of(self, scene: _Scene, name: str, ways: Ways, at: FloatArray) -> list[Action]:
        belief = scene.beliefs[name]
        found = []
        for sensor in self.sensors.values():
            piece = int(self.floor.pieces[ways.start])
            for pose, cell in zip(*self.places(belief, sensor, piece), strict=True):
                way = ways.to(int(cell))
                if way is not None:
                    found.append(self._action(scene, name, sensor, pose, way))
        return found

    def _from_here(self, scene: _Scene, name: str, at: FloatArray) -> list[Action]:
        found = [
            self._action(scene, name, sensor, at, at[None, :2]) for sensor in self.sensors.values()
        ]
        return [each for each in found if name in each.gains]

    def _action(
        self, scene: _Scene, name: str, sensor: Sensor, pose: FloatArray, way: FloatArray
    ) -> Action:
        gains = scene.gains_along(sensor.name, self._looked_from(way, pose))
        distance = length_of(way)
        choice = self.settings.choice
        cost = costs(np.array([distance]), choice)
        utility = utilities(np.array([sum(gains.values())]), cost, choice)
        return Action(
            name, sensor.name, pose, way, gains, distance, float(cost[0]), float(utility[0])
        )

    def _looked_from(self, way: FloatArray, pose: FloatArray) -> FloatArray:
        """Poses (k, 3) on a way (n, 2), a stride apart, and the one at its end."""
        s = self.settings
        driven = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
        marks = np.arange(s.stride, driven[-1] - s.stride / 2.0, s.stride)
        index = np.searchsorted(driven, marks)
        ahead = way[index] - way[np.maximum(index - 1, 0)]
        step, turn = s.stride / 2.0, 2.0 * np.pi / HEADINGS
        raster = np.rint(way[index] / step) * step
        heading = np.rint(np.arctan2(ahead[:, 1], ahead[:, 0]) / turn) * turn
        return np.vstack([np.column_stack([raster, wrap(heading)]), pose])

    def places(
        self, belief: ObjectBelief, sensor: Sensor, piece: int
    ) -> tuple[FloatArray, IntArray]:
        """Poses (k, 3) from which to look at an object, and their cells (k,) of the floor."""
        key: tuple[object, ...] = (belief.item.name, sensor.name, piece)
        if belief.item.kind is Kind.PLANAR:
            key += tuple(np.rint(belief.mean[:2] / ROOM).tolist())
        if key not in self._viewpoints:
            self._viewpoints[key] = viewpoints(
                belief, self.floor, self._walls, sensor.height, self.settings.viewpoints, piece
            )
        return self._viewpoints[key]

    def look(
        self, sensor: str, belief: ObjectBelief, pose: FloatArray, others: Mapping[str, FloatArray]
    ) -> Look | None:
        """What a look tells; simulated once for what is the same to ``PLACE``."""
        key: tuple[object, ...] = (sensor, belief.item.name, pose.tobytes())
        if belief.item.kind is Kind.PLANAR:
            key += tuple(np.rint(belief.mean / PLACE).tolist())
        key += tuple((name, np.rint(state / PLACE).tobytes()) for name, state in others.items())
        if key not in self._known:
            self._known[key] = self._looks[sensor].look(belief, pose, others)
        return self._known[key]


@dataclass(frozen=True, eq=False)
class _Scene:
    """One moment's beliefs, and what looks from places would tell of them."""

    coordinator: Coordinator
    beliefs: Mapping[str, ObjectBelief]
    names: list[str]
    middles: FloatArray  # (n, 2)
    settled: dict[str, FloatArray]
    told: dict[tuple[str, bytes], dict[str, float]]

    @staticmethod
    def of(coordinator: Coordinator, beliefs: Mapping[str, ObjectBelief]) -> _Scene:
        return _Scene(
            coordinator,
            beliefs,
            list(beliefs),
            np.array([middle_of(each) for each in beliefs.values()]).reshape(-1, 2),
            {name: each.mean for name, each in beliefs.items() if each.settled},
            {},
        )

    def gains_along(self, sensor: str, poses: FloatArray) -> dict[str, float]:
        """Expected gain of each object seen from some of the poses (k, 3), nats.

        Looks at one object from neighbouring places tell much the same: the best counts.
        """
        gains: dict[str, float] = {}
        for pose in poses:
            for name, gain in self._gains_at(sensor, pose).items():
                gains[name] = max(gain, gains.get(name, 0.0))
        return gains

    def _gains_at(self, sensor: str, pose: FloatArray) -> dict[str, float]:
        key = (sensor, pose.tobytes())
        if key not in self.told:
            self.told[key] = self._looked(sensor, pose)
        return self.told[key]

    def _looked(self, sensor: str, pose: FloatArray) -> dict[str, float]:
        distance = np.linalg.norm(self.middles - pose[:2], axis=1)
        near = [self.names[k] for k in np.flatnonzero(distance <= self.coordinator._reach)]
        gains = {}
        for name in near:
            others = {o: self.settled[o] for o in near if o != name and o in self.settled}
            look = self.coordinator.look(sensor, self.beliefs[name], pose, others)
            if look is not None:
                gains[name] = look.gain(self.beliefs[name])
        return gains
