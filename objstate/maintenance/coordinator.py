"""From beliefs to the ranked actions: what to update next, with which sensor, from where."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import NonNegative, Positive, Settings, Strict
from objstate.errors import SettingsError
from objstate.gaze.fading import fadings
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
LEAST = -1e3  # nats: less entropy than any belief has
STRAYED = 0.25  # m that furniture may be moved before its viewpoints are sought anew


class GainWeight(Strict):
    """How much the gains of some objects count; those of all others count as they are."""

    match: str  # shell-style: * ? [..]
    weight: NonNegative = 1.0


class CoordinatorSettings(Strict):
    """All settings of the choice of what to look at next."""

    choice: ChoiceSettings = ChoiceSettings()
    looks: LookSettings = LookSettings()
    viewpoints: ViewpointSettings = ViewpointSettings()
    floor: FloorSettings = FloorSettings()
    weights: tuple[GainWeight, ...] = ()  # of objects whose names match; later ones win
    stride: Positive = 1.0  # m between the places on the way from which looks are simulated


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An action that isn't weighed yet."""

    object: str
    sensor: str
    pose: FloatArray  # (3,)
    way: FloatArray  # (k, 2) m
    stops: FloatArray  # (n, 3) poses on the way from which looks are simulated
    distance: float  # m


@dataclass(frozen=True, eq=False)
class Action:
    """Update an object with a sensor: a_s(o), Elfring et al. 2014."""

    object: str
    sensor: str
    pose: FloatArray  # (3,) from which to look
    way: FloatArray = field(repr=False)  # (k, 2) m, from the robot to there
    gains: Mapping[str, float]  # nats, expected of each object seen on the way or from there
    distance: float  # m, the length of the way
    worth: float  # of the gains as the settings count and weigh them: nat h, or nats
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
        self._weights = {name: _weight(name, s.weights) for name in building.objects}
        self._fadings = fadings(
            building.objects, estimation, s.looks.robot_std, s.looks.robot_yaw_std
        )

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
            found = [
                self._weighed(prospects, each)
                for name in names
                for each in self._of(prospects, name, ways)
            ]
        else:
            found = [each for name in names for each in self._from_here(prospects, name, at)]
        return sorted(found, key=lambda action: -action.utility)

    def best(self, actions: Sequence[Action]) -> Action | None:
        """Eqs. (7), (10), (11): the first of ranked actions above the thresholds, if any."""
        s = self.settings.choice
        useful = (each for each in actions if each.utility > s.least_utility)
        return next((each for each in useful if each.gain > s.gain_threshold), None)

    def choose(self, beliefs: Mapping[str, ObjectBelief], at: FloatArray) -> Action | None:
        """The best of all ``actions`` of a robot at (3,), found without weighing those that can't be.

        Raises SettingsError for a place that is not on the free floor.
        """
        prospects = Prospects(self._library, beliefs, self._reach)
        ways = self.floor.ways_from(at[:2], beliefs)
        candidates = [each for name in beliefs for each in self._of(prospects, name, ways)]
        if not candidates:
            return None
        most, s = self._most(prospects, candidates), self.settings.choice
        found, least = None, s.least_utility
        for k in np.argsort(-most, kind="stable").tolist():
            if most[k] <= least:
                break
            action = self._weighed(prospects, candidates[k])
            if action.utility > least and action.gain > s.gain_threshold:
                found, least = action, action.utility
        return found

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

    def _of(self, prospects: Prospects, name: str, ways: Ways) -> Iterator[_Candidate]:
        piece = int(self.floor.pieces[ways.start])
        for sensor in self.sensors.values():
            poses, ends = self.places(prospects.beliefs[name], sensor, piece)
            for pose, end in zip(poses, ends.tolist(), strict=True):
                cells = ways.to(end)
                if cells is not None:
                    yield _Candidate(name, sensor.name, pose, *self._on(cells))

    def _on(self, cells: IntArray) -> tuple[FloatArray, FloatArray, float]:
        """The way through cells, the poses on it from which to look, and its length."""
        way = self.floor.places[cells]
        return way, self._looked_from(cells), length_of(way)

    def _from_here(self, prospects: Prospects, name: str, at: FloatArray) -> list[Action]:
        here = np.array([self.floor.nearest(at[:2])])
        each = [_Candidate(name, sensor, at, *self._on(here)) for sensor in self.sensors]
        found = [self._weighed(prospects, candidate) for candidate in each]
        return [action for action in found if name in action.gains]

    def _weighed(self, prospects: Prospects, candidate: _Candidate) -> Action:
        """An action with all that it promises."""
        gains = self._gains_along(prospects, candidate)
        worth = self._worth(prospects, gains)
        cost, utility = self._useful(np.array([worth]), np.array([candidate.distance]))
        return Action(
            candidate.object,
            candidate.sensor,
            candidate.pose,
            candidate.way,
            gains,
            candidate.distance,
            worth,
            float(cost[0]),
            float(utility[0]),
        )

    def _useful(self, worths: FloatArray, distances: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Costs and utilities (a,), eqs. (8) and (9)."""
        cost = costs(distances, self.settings.choice)
        return cost, utilities(worths, cost, self.settings.choice)

    def _worth(self, prospects: Prospects, gains: Mapping[str, float]) -> float:
        """What gains count, nat h or nats, each by its object's weight."""
        if self.settings.choice.counting == "gain":
            return sum(self._weights[name] * gain for name, gain in gains.items())
        return sum(
            self._weights[name] * self._fadings[name].worth(prospects.entropies[name], gain)
            for name, gain in gains.items()
        )

    def _most(self, prospects: Prospects, candidates: Sequence[_Candidate]) -> FloatArray:
        """Utilities (a,) that no action exceeds: those of seeing all within reach as well as can be."""
        if self.settings.choice.counting == "gain":
            return np.full(len(candidates), np.inf)
        all_ = {name: entropy - LEAST for name, entropy in prospects.entropies.items()}
        each = np.array([self._worth(prospects, {name: gain}) for name, gain in all_.items()])
        near = [prospects.near(np.vstack([c.stops, c.pose])[:, :2]) for c in candidates]
        distances = np.array([candidate.distance for candidate in candidates])
        return self._useful(np.array(near) @ each, distances)[1]

    def _gains_along(self, prospects: Prospects, candidate: _Candidate) -> dict[str, float]:
        """Expected gain of each object seen on a way or from its end, nats.

        Looks at one object from neighbouring places tell much the same: the best counts.
        """
        looks, sensor = self.settings.looks, candidate.sensor
        gains = dict(prospects.gains_at(sensor, candidate.pose, looks.scans))
        for stop in candidate.stops:
            for name, gain in prospects.gains_at(sensor, stop, looks.scans_on_way).items():
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


def _weight(name: str, weights: Sequence[GainWeight]) -> float:
    """What an object's gains count: by the last rule that matches."""
    matching = [each.weight for each in weights if fnmatchcase(name, each.match)]
    return matching[-1] if matching else 1.0
