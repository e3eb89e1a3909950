"""From beliefs to the ranked actions: what to update next, with which sensor, from where."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import overload

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import NonNegative, Positive, Settings, Strict
from objstate.errors import SettingsError
from objstate.gaze.fading import fadings
from objstate.gaze.floor import Floor, FloorSettings, Ways
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.prospects import LookLibrary, Prospects
from objstate.gaze.sensors import Sensor
from objstate.gaze.viewpoints import ViewpointSettings, viewpoints
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.maintenance.choice import ChoiceSettings, costs, utilities
from objstate.objects import ObjectBelief
from objstate.objects.belief import check_robot
from objstate.sensing.casters import caster_of

HEADINGS = 8  # headings, evenly spread, in which looks on the way are simulated
LEAST = -1e3  # nats: less entropy than any belief has
STRAYED = 0.25  # m of motion of furniture after which its viewpoints are computed anew


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
    stride: Positive = 1.0  # m between the places on the way at which looks are simulated

    def for_width(self, width: float) -> CoordinatorSettings:
        """The settings of a robot of a width, m. Raises QueryError for one that no robot has."""
        check_robot(width)
        floor = self.floor.model_copy(update={"robot_radius": width / 2.0})
        return self.model_copy(update={"floor": floor})


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An action that isn't weighed yet."""

    object: str
    sensor: str
    way: IntArray  # (k,) cells, the first of them maybe more than once
    distance: float  # m
    poses: FloatArray  # (n, 3) at which looks are simulated: on the way, and last at its end
    near: BoolArray  # (n, o) which objects may be seen from each, at its end also through walls


@dataclass(frozen=True, eq=False)
class _Routes:
    """Ways to several places, side by side."""

    cells: IntArray  # (k, a)
    distances: FloatArray  # (a,) m
    stops: FloatArray  # (n, 3) poses at which looks on the ways are simulated, way by way
    counts: IntArray  # (a,) of these, by way


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
        settings: of the choice.
        estimation: the estimator's settings, with the beam model.
        floor: where the robot may drive; by default wherever walls leave room.

    Raises:
        SettingsError: no sensor, two of one name, or no place where the robot fits.
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
            raise SettingsError("A robot without a sensor can't see anything; give one.")
        names = [each.name for each in sensors]
        if twice := [name for name in names if names.count(name) > 1]:
            raise SettingsError(f"Two sensors are called '{twice[0]}'; give each its own name.")
        s, estimation = settings or CoordinatorSettings(), estimation or Settings()
        self.settings = s
        self.building = building
        self.estimation = estimation
        self.floor = floor or Floor.of(building, s.floor)
        self.sensors = {each.name: each for each in sensors}
        lasers = {each.name: LaserLooks(building, each, estimation, s.looks) for each in sensors}
        self._library = LookLibrary(building, lasers, estimation.object_updates.max_distance)
        self._walls = caster_of(building.walls)
        self._viewpoints: dict[tuple[object, ...], tuple[FloatArray, IntArray]] = {}
        self._weights = {name: _weight(name, s.weights) for name in building.objects}
        self._fadings = fadings(
            building.objects, estimation, s.looks.robot_std, s.looks.robot_yaw_std
        )

    @property
    def robot_width(self) -> float:
        """m"""
        return 2.0 * self.floor.settings.robot_radius

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
        Raises SettingsError for a place that is not on the free floor, and for objects that the
        beliefs don't have.
        """
        prospects = Prospects(self._library, beliefs)
        names = list(beliefs) if only is None else list(only)
        if unknown := [name for name in names if name not in beliefs]:
            known = ", ".join(sorted(beliefs)) or "none"
            raise SettingsError(f"There is no object '{unknown[0]}'; there are {known}.")
        if may_drive:
            candidates = self._candidates(prospects, names, self.floor.ways_from(at[:2], beliefs))
        else:
            candidates = self._from_here(prospects, names, at)
        full = self._full(prospects)
        weighed = [self._weighed(prospects, full, each) for each in candidates]
        found = [each for each in weighed if may_drive or each.object in each.gains]
        return sorted(found, key=lambda action: -action.utility)

    def best(self, actions: Sequence[Action]) -> Action | None:
        """Eqs. (7), (10), (11): the first of ranked actions above the thresholds, if any."""
        s = self.settings.choice
        useful = (each for each in actions if each.utility > s.least_utility)
        return next((each for each in useful if each.gain > s.gain_threshold), None)

    def choose(self, beliefs: Mapping[str, ObjectBelief], at: FloatArray) -> Action | None:
        """The best of all ``actions`` of a robot at (3,), without evaluating hopeless ones.

        Raises SettingsError for a place that is not on the free floor.
        """
        prospects = Prospects(self._library, beliefs)
        ways = self.floor.ways_from(at[:2], beliefs)
        candidates = self._candidates(prospects, list(beliefs), ways)
        full, s = self._full(prospects), self.settings.choice
        most = self._most(full, candidates)
        found, least = None, s.least_utility
        for k in np.argsort(-most, kind="stable").tolist():
            if most[k] <= least:
                break
            action = self._weighed(prospects, full, candidates[k], least)
            if action is not None and action.gain > s.gain_threshold:
                found, least = action, action.utility
        return found

    def places(
        self, belief: ObjectBelief, sensor: Sensor, piece: int
    ) -> tuple[FloatArray, IntArray]:
        """Poses (k, 3) in a piece of the floor from which to see an object; their cells (k,)."""
        key: tuple[object, ...] = (belief.item.name, sensor.name, piece)
        if belief.item.kind is Kind.PLANAR:
            key += tuple(np.rint(belief.mean[:2] / STRAYED).tolist())
        if key not in self._viewpoints:
            self._viewpoints[key] = viewpoints(
                belief, self.floor, self._walls, sensor, self.settings.viewpoints, piece
            )
        return self._viewpoints[key]

    # --- candidates -----------------------------------------------------------------

    def _candidates(
        self, prospects: Prospects, names: Sequence[str], ways: Ways
    ) -> list[_Candidate]:
        """All actions on objects, with each sensor."""
        return [
            each
            for sensor in self.sensors.values()
            for each in self._of_sensor(prospects, sensor, names, ways)
        ]

    def _of_sensor(
        self,
        prospects: Prospects,
        sensor: Sensor,
        names: Sequence[str],
        ways: Ways,
    ) -> Iterator[_Candidate]:
        """Actions with one sensor, from the places that some way leads to."""
        piece = int(self.floor.pieces[ways.start])
        goals = [
            (name, pose, end)
            for name in names
            for pose, end in zip(*self.places(prospects.beliefs[name], sensor, piece), strict=True)
            if np.isfinite(ways.costs[end])
        ]
        if not goals:
            return
        poses, ends = (np.array(each) for each in list(zip(*goals, strict=True))[1:])
        routes = self._routes(ways.to_each(ends))
        stops, which = np.unique(routes.stops, axis=0, return_inverse=True)
        near = prospects.near(sensor.name, stops)[which]
        at_end = prospects.near(sensor.name, poses, through_walls=True)
        at_end[routes.distances == 0.0] &= ~prospects.just_seen  # a robot that stays errs as before
        last = np.cumsum(routes.counts)
        for k, (name, pose, _) in enumerate(goals):
            passed = slice(last[k] - routes.counts[k], last[k])
            yield _Candidate(
                name,
                sensor.name,
                routes.cells[:, k],
                float(routes.distances[k]),
                np.vstack([routes.stops[passed], pose]),
                np.vstack([near[passed], at_end[k]]),
            )

    def _routes(self, cells: IntArray) -> _Routes:
        """Ways (k, a) with the poses on them at which looks are simulated.

        They are a stride apart, and at the end. Each pose is at its cell's node and faces ahead.
        """
        steps = np.diff(self.floor.places[cells], axis=0)  # (k - 1, a, 2)
        lengths = np.hypot(steps[..., 0], steps[..., 1])
        driven = np.cumsum(lengths, axis=0)
        strides = np.floor(driven / self.settings.stride)
        looks = np.diff(strides, axis=0, prepend=0.0) > 0.0
        looks[-1:] = lengths[-1:] > 0.0
        way, step = np.nonzero(looks.T)
        turn = 2.0 * np.pi / HEADINGS
        ahead = steps[step, way]
        heading = wrap(np.rint(np.arctan2(ahead[:, 1], ahead[:, 0]) / turn) * turn)
        places = self.floor.places[self.floor.nodes[cells[step + 1, way]]]
        distances = lengths.sum(axis=0)
        return _Routes(cells, distances, np.column_stack([places, heading]), looks.sum(axis=0))

    def _from_here(
        self, prospects: Prospects, names: Sequence[str], at: FloatArray
    ) -> list[_Candidate]:
        """Actions that need no way."""
        here, poses = np.array([self.floor.nearest(at[:2])]), at[None]
        near = {sensor: prospects.near(sensor, poses) for sensor in self.sensors}
        return [
            _Candidate(name, sensor, here, 0.0, poses, near[sensor])
            for name in names
            for sensor in self.sensors
        ]

    # --- what they are worth --------------------------------------------------------

    @overload
    def _weighed(self, prospects: Prospects, full: FloatArray, candidate: _Candidate) -> Action: ...
    @overload
    def _weighed(
        self, prospects: Prospects, full: FloatArray, candidate: _Candidate, least: float
    ) -> Action | None: ...
    def _weighed(
        self,
        prospects: Prospects,
        full: FloatArray,
        candidate: _Candidate,
        least: float = -np.inf,
    ) -> Action | None:
        """An action with its expected gain; None if it can't be more useful than ``least``.

        Until an object's looks are simulated, its gain counts as the largest possible one, ``full``
        (o,).
        """
        at_end = candidate.near[-1:] & prospects.near(candidate.sensor, candidate.poses[-1:])
        candidate = replace(candidate, near=np.vstack([candidate.near[:-1], at_end]))
        s, gains, worth = self.settings.choice, dict[str, float](), 0.0
        cost = float(costs(np.array(candidate.distance), s))
        order = np.flatnonzero(candidate.near.any(axis=0))
        order = order[np.argsort(-full[order], kind="stable")]
        left = float(full[order].sum())
        for k in order.tolist():
            left -= full[k]
            told = self._told_along(prospects, candidate, k)
            if told is not None:
                name = prospects.names[k]
                gains[name] = prospects.gain(name, told)
                worth += self._worth(name, float(prospects.entropies[k]), gains[name])
            if float(utilities(np.array(worth + left), np.array(cost), s)) <= least:
                return None
        utility = float(utilities(np.array(worth), np.array(cost), s))
        if utility <= least:
            return None
        return Action(
            candidate.object,
            candidate.sensor,
            candidate.poses[-1],
            self.floor.places[_once(candidate.way)],
            gains,
            candidate.distance,
            worth,
            cost,
            utility,
        )

    def _told_along(self, prospects: Prospects, candidate: _Candidate, k: int) -> FloatArray | None:
        """The summed evidence of looks on a way and at its end about an object; None if unseen.

        At places a stride apart, the robot's errors are independent. At the end, a look ahead
        counts only if the look at the object from there doesn't show it.
        """
        looks, name = self.settings.looks, prospects.names[k]
        seen = np.flatnonzero(candidate.near[:, k])[::-1].tolist()
        end, together = len(candidate.poses) - 1, None
        for stop in seen:
            if together is not None and stop == end - 1:
                continue
            scans = looks.scans if stop == end else looks.scans_on_way
            pose, near = candidate.poses[stop], candidate.near[stop]
            told = prospects.evidence(candidate.sensor, name, pose, near, scans)
            if told is not None:
                together = told if together is None else together + told
        return together

    def _worth(self, name: str, entropy: float, gain: float) -> float:
        """What a gain from an entropy counts, nat h or nats, by its object's weight."""
        if self.settings.choice.counting == "gain":
            return self._weights[name] * gain
        return self._weights[name] * self._fadings[name].worth(entropy, gain)

    def _full(self, prospects: Prospects) -> FloatArray:
        """(o,) the value of complete information about each object."""
        known = zip(prospects.names, prospects.entropies.tolist(), strict=True)
        return np.array([self._worth(name, nats, nats - LEAST) for name, nats in known])

    def _most(self, full: FloatArray, candidates: Sequence[_Candidate]) -> FloatArray:
        """Upper bounds (a,) of utilities: those of complete information about all in reach."""
        near = np.array([each.near.any(axis=0) for each in candidates]).reshape(-1, len(full))
        cost = costs(np.array([each.distance for each in candidates]), self.settings.choice)
        return utilities(near @ full, cost, self.settings.choice)


def _once(way: IntArray) -> IntArray:
    """Cells of a way (k,) without those at its start in which it waits."""
    return way[max(int((way != way[0]).argmax()) - 1, 0) :]


def _weight(name: str, weights: Sequence[GainWeight]) -> float:
    """What an object's gains count: by the last rule that matches."""
    matching = [each.weight for each in weights if fnmatchcase(name, each.match)]
    return matching[-1] if matching else 1.0
