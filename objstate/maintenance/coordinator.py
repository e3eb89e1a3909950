"""From beliefs to the ranked actions: what to update next, with which sensor, from where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import Positive, Settings, Strict
from objstate.errors import SettingsError
from objstate.gaze.floor import Floor, FloorSettings, Ways, length_of
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.prospects import LookLibrary, Prospects
from objstate.gaze.sensors import Sensor
from objstate.gaze.viewpoints import ViewpointSettings, viewpoints
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.maintenance.choice import ChoiceSettings, costs, utilities
from objstate.objects import ObjectBelief
from objstate.sensing.casters import caster_of

HEADINGS = 8  # headings, evenly spread, in which looks on the way are simulated
STRAYED = 0.25  # m that furniture may be moved before its viewpoints are sought anew


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

    Raises:
        SettingsError: no sensor, or no place where the robot fits.
    """

    def __init__(
        self,
        building: Building,
        sensors: Sequence[Sensor],
        settings: CoordinatorSettings | None = None,
        estimation: Settings | None = None,
        floor: Floor | None = None,
    ) -> None:
        if not sensors:
            raise SettingsError("A robot without a sensor can't look at anything; give one.")
        s, estimation = settings or CoordinatorSettings(), estimation or Settings()
        self.settings = s
        self.building = building
        self.floor = floor or Floor.of(building, s.floor)
        self.sensors = {each.name: each for each in sensors}
        self._reach = estimation.object_updates.max_distance
        lasers = {each.name: LaserLooks(building, each, estimation, s.looks) for each in sensors}
        self._library = LookLibrary(lasers)
        self._walls = caster_of(building.walls)
        self._viewpoints: dict[tuple[object, ...], tuple[FloatArray, IntArray]] = {}

    def actions(
        self,
        beliefs: Mapping[str, ObjectBelief],
        at: FloatArray,
        *,
        may_drive: bool = True,
        only: Sequence[str] | None = None,
    ) -> list[Action]:
        """All actions of a robot at (3,), the most useful first; of objects ``only``, if given.

        A robot that may not drive can only update what it sees from where it is.
        Raises SettingsError for a place that is not on the free floor.
        """
        prospects = Prospects(self._library, beliefs, self._reach)
        names = list(beliefs) if only is None else list(only)
        if may_drive:
            ways = self.floor.ways_from(at[:2], beliefs)
            found = [each for name in names for each in self._of(prospects, name, ways)]
        else:
            found = [each for name in names for each in self._from_here(prospects, name, at)]
        return sorted(found, key=lambda action: -action.utility)

    def best(self, actions: Sequence[Action]) -> Action | None:
        """Eqs. (7), (10), (11): the first of ranked actions above the gain threshold, if any."""
        threshold = self.settings.choice.gain_threshold
        return next((each for each in actions if each.gain > threshold), None)

    def places(
        self, belief: ObjectBelief, sensor: Sensor, piece: int
    ) -> tuple[FloatArray, IntArray]:
        """Poses (k, 3) in a piece of the floor from which to look at an object; their cells (k,)."""
        key: tuple[object, ...] = (belief.item.name, sensor.name, piece)
        if belief.item.kind is Kind.PLANAR:
            key += tuple(np.rint(belief.mean[:2] / STRAYED).tolist())
        if key not in self._viewpoints:
            self._viewpoints[key] = viewpoints(
                belief, self.floor, self._walls, sensor.height, self.settings.viewpoints, piece
            )
        return self._viewpoints[key]

    # --- the actions of one object --------------------------------------------------

    def _of(self, prospects: Prospects, name: str, ways: Ways) -> list[Action]:
        found, piece = [], int(self.floor.pieces[ways.start])
        for sensor in self.sensors.values():
            poses, ends = self.places(prospects.beliefs[name], sensor, piece)
            for pose, end in zip(poses, ends.tolist(), strict=True):
                cells = ways.to(end)
                if cells is not None:
                    found.append(self._action(prospects, name, sensor.name, pose, cells))
        return found

    def _from_here(self, prospects: Prospects, name: str, at: FloatArray) -> list[Action]:
        here = np.array([self.floor.nearest(at[:2])])
        found = [self._action(prospects, name, sensor, at, here) for sensor in self.sensors]
        return [each for each in found if name in each.gains]

    def _action(
        self, prospects: Prospects, name: str, sensor: str, pose: FloatArray, cells: IntArray
    ) -> Action:
        way, choice = self.floor.places[cells], self.settings.choice
        gains, distance = self._gains_along(prospects, sensor, cells, pose), length_of(way)
        cost = costs(np.array([distance]), choice)
        utility = utilities(np.array([sum(gains.values())]), cost, choice)
        return Action(name, sensor, pose, way, gains, distance, float(cost[0]), float(utility[0]))

    def _gains_along(
        self, prospects: Prospects, sensor: str, cells: IntArray, pose: FloatArray
    ) -> dict[str, float]:
        """Expected gain of each object seen on a way through cells (k,) or from its end (3,), nats.

        Looks at one object from neighbouring places tell much the same: the best counts.
        """
        looks = self.settings.looks
        gains = dict(prospects.gains_at(sensor, pose, looks.scans))
        for place in self._looked_from(cells):
            for name, gain in prospects.gains_at(sensor, place, looks.scans_on_way).items():
                gains[name] = max(gain, gains.get(name, 0.0))
        return gains

    def _looked_from(self, cells: IntArray) -> FloatArray:
        """Poses (k, 3) on a way through cells, a stride apart, each at its cell's node."""
        way = self.floor.places[cells]
        driven = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
        marks = np.arange(self.settings.stride, driven[-1], self.settings.stride)
        index = np.searchsorted(driven, marks)
        ahead = way[index] - way[index - 1]
        turn = 2.0 * np.pi / HEADINGS
        heading = np.rint(np.arctan2(ahead[:, 1], ahead[:, 0]) / turn) * turn
        places = self.floor.places[self.floor.nodes[cells[index]]]
        return np.column_stack([places, wrap(heading)])
