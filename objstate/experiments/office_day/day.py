"""One working day of one strategy, and what it was worth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from objstate.building.model import Kind
from objstate.experiments.office_day.office import Office
from objstate.experiments.office_day.robot import Robot
from objstate.experiments.office_day.strategies import Choose, Moment
from objstate.gaze.entropy import belief_entropy
from objstate.geometry import FloatArray
from objstate.maintenance import Expectation, outcome
from objstate.objects import ObjectBelief, ObjectFilter, filter_for
from objstate.simulation.states import StateHistory

PATIENCE = 30.0  # s a robot waits before it decides anew
SAMPLE_EVERY = 300.0  # s between the moments at which beliefs are judged
RIGHT = np.radians(10.0)  # rad within which a door's angle counts as right


@dataclass(frozen=True, eq=False)
class Day:
    """What came of a day."""

    times: FloatArray = field(repr=False)  # (t,) s at which beliefs were judged
    entropies: FloatArray = field(repr=False)  # (t,) nats, of all objects together
    right: FloatArray = field(repr=False)  # (t,) share of doors whose angle is right
    driven: FloatArray = field(repr=False)  # (t,) m until then
    path: FloatArray = field(repr=False)  # (n, 3) where the robot was
    predicted: FloatArray = field(repr=False)  # (k,) nats, of each task
    realized: FloatArray = field(repr=False)  # (k,) nats
    outcomes: dict[str, int]  # of the tasks
    lost: int  # stretches in which the robot was lost

    @property
    def tasks(self) -> int:
        return sum(self.outcomes.values())


def run_day(
    place: Office, day: Mapping[str, StateHistory], robot: Robot, choose: Choose, hours: float
) -> Day:
    """Let a strategy drive a robot for some hours."""
    filters = {
        name: filter_for(item, place.settings) for name, item in place.building.objects.items()
    }
    rows: list[tuple[float, ...]] = []
    predicted: list[float] = []
    realized: list[float] = []
    outcomes: Counter[str] = Counter()
    while robot.time < hours * 3600.0:
        while len(rows) * SAMPLE_EVERY <= robot.time:
            rows.append(_judged(robot, day))
        beliefs = robot.beliefs()
        goal = choose(Moment(beliefs, robot.believed_pose, robot.time))
        if goal is None:
            robot.wait(PATIENCE)
            continue
        before = robot.time
        robot.drive(goal.way, goal.pose)
        task = Expectation.of(beliefs[goal.object])
        outcomes[outcome(task, beliefs[goal.object], robot.beliefs()[goal.object]).value] += 1
        if goal.gains is not None:
            seconds = robot.time - before
            predicted.append(sum(goal.gains.values()))
            realized.append(_realized(filters, beliefs, robot, seconds))
    rows.append(_judged(robot, day))
    times, entropies, right, driven = np.array(rows).T
    return Day(
        times=times,
        entropies=entropies,
        right=right,
        driven=driven,
        path=np.array(robot.path),
        predicted=np.array(predicted),
        realized=np.array(realized),
        outcomes=dict(sorted(outcomes.items())),
        lost=len(robot.estimator.lost),
    )


def _judged(robot: Robot, day: Mapping[str, StateHistory]) -> tuple[float, ...]:
    """Moment, total entropy, share of doors that are right, way driven so far."""
    beliefs = robot.beliefs()
    total = sum(belief_entropy(belief) for belief in beliefs.values())
    doors = [name for name, each in beliefs.items() if each.item.kind is not Kind.PLANAR]
    off = [abs(_best(beliefs[name]) - day[name].at(robot.time)[0]) for name in doors]
    return robot.time, total, float(np.mean(np.array(off) < RIGHT)), robot.driven


def _best(belief: ObjectBelief) -> float:
    """The most probable state of a door."""
    return float(belief.states[belief.weights.log.argmax(), 0])


def _realized(
    filters: Mapping[str, ObjectFilter],
    before: Mapping[str, ObjectBelief],
    robot: Robot,
    seconds: float,
) -> float:
    """How much more would be unknown now without the drive, nats, of all objects it saw."""
    gain, rng = 0.0, np.random.default_rng(0)
    for name, after in robot.beliefs().items():
        if after.last_observed_ns != before[name].last_observed_ns:
            unseen = filters[name].predict(before[name], seconds, rng)
            gain += belief_entropy(unseen) - belief_entropy(after)
    return gain
