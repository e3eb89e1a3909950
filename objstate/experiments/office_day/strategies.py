"""Who decides where the robot goes next: the coordinator, and those it is measured against."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from objstate.experiments.tours import shortest_tour
from objstate.gaze.floor import Ways, length_of
from objstate.geometry import FloatArray
from objstate.maintenance import Coordinator
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS


@dataclass(frozen=True, eq=False)
class Moment:
    """What a strategy may know when it decides."""

    beliefs: Mapping[str, ObjectBelief]
    at: FloatArray  # (3,) the robot
    time: float  # s

    def age(self, name: str) -> float:
        """s since an object was last seen."""
        seen = self.beliefs[name].last_observed_ns
        return np.inf if seen is None else self.time - seen / NANOSECONDS


@dataclass(frozen=True, eq=False)
class Goal:
    """Where to go and what to look at there."""

    object: str
    pose: FloatArray  # (3,)
    way: FloatArray = field(repr=False)  # (k, 2)
    gains: Mapping[str, float] | None = None  # nats, where they were predicted


Choose = Callable[[Moment], Goal | None]  # None: wait


def coordinated(coordinator: Coordinator) -> Choose:
    """The most useful action above the coordinator's gain threshold."""

    def choose(moment: Moment) -> Goal | None:
        action = coordinator.choose(moment.beliefs, moment.at)
        if action is None:
            return None
        return Goal(action.object, action.pose, action.way, action.gains)

    return choose


def fixed_round(coordinator: Coordinator, pause: float) -> Choose:
    """All objects in the order of a short tour; a round starts ``pause`` s after the last.

    What has been seen in passing since the round began is passed over.
    """
    tour, left, started = list[str](), list[str](), -np.inf

    def choose(moment: Moment) -> Goal | None:
        nonlocal started
        if not left:
            if moment.time - started < pause:
                return None
            if not tour:
                tour.extend(_round_trip(coordinator, moment))
            started = moment.time
            left.extend(tour)
        while left and moment.age(left[0]) < moment.time - started:
            left.pop(0)
        if not left:
            return None
        ways = coordinator.floor.ways_from(moment.at[:2], moment.beliefs)
        return _nearest(coordinator, moment, ways, left.pop(0))

    return choose


def _round_trip(coordinator: Coordinator, moment: Moment) -> list[str]:
    """Names of all objects that the robot can look at, in the order of a short round trip."""
    here = coordinator.floor.ways_from(moment.at[:2], moment.beliefs)
    goals = [_nearest(coordinator, moment, here, name) for name in moment.beliefs]
    reached = [goal for goal in goals if goal is not None]
    cells = [coordinator.floor.nearest(goal.pose[:2]) for goal in reached]
    places = coordinator.floor.places[cells]
    ways = [coordinator.floor.ways_from(place, moment.beliefs).costs[cells] for place in places]
    return [reached[k].object for k in shortest_tour(np.array(ways))]


def oldest_first(coordinator: Coordinator, age: float) -> Choose:
    """The object that was seen longest ago, if that is more than ``age`` s."""

    def choose(moment: Moment) -> Goal | None:
        name = max(moment.beliefs, key=moment.age)
        if moment.age(name) <= age:
            return None
        ways = coordinator.floor.ways_from(moment.at[:2], moment.beliefs)
        return _nearest(coordinator, moment, ways, name)

    return choose


def greedy_nearest(coordinator: Coordinator, age: float) -> Choose:
    """The nearest of the objects that were not seen for ``age`` s."""

    def choose(moment: Moment) -> Goal | None:
        old = [name for name in moment.beliefs if moment.age(name) > age]
        if not old:
            return None
        ways = coordinator.floor.ways_from(moment.at[:2], moment.beliefs)
        goals = [goal for name in old if (goal := _nearest(coordinator, moment, ways, name))]
        return min(goals, key=lambda goal: length_of(goal.way), default=None)

    return choose


def at_random(coordinator: Coordinator, pause: float, rng: np.random.Generator) -> Choose:
    """Any object, one every ``pause`` s."""
    names, last = list(coordinator.building.objects), -np.inf

    def choose(moment: Moment) -> Goal | None:
        nonlocal last
        if moment.time - last < pause:
            return None
        last = moment.time
        ways = coordinator.floor.ways_from(moment.at[:2], moment.beliefs)
        return _nearest(coordinator, moment, ways, names[int(rng.integers(len(names)))])

    return choose


def _nearest(coordinator: Coordinator, moment: Moment, ways: Ways, name: str) -> Goal | None:
    """The nearest place from which an object can be looked at."""
    (sensor,) = coordinator.sensors.values()
    piece = int(coordinator.floor.pieces[ways.start])
    poses, cells = coordinator.places(moment.beliefs[name], sensor, piece)
    if not len(cells) or not np.isfinite(ways.costs[cells]).any():
        return None
    best = int(ways.costs[cells].argmin())
    passed = ways.to(int(cells[best]))
    return None if passed is None else Goal(name, poses[best], coordinator.floor.places[passed])
