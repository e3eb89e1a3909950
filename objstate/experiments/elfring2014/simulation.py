"""One run of section 7: a robot that keeps ten positions up to date."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.experiments.elfring2014.setup import Setup
from objstate.experiments.elfring2014.tour import shortest_tour
from objstate.gaze.gaussian import PointBeliefs, gains_along, straight_ways
from objstate.geometry import FloatArray, IntArray
from objstate.maintenance.choice import ChoiceSettings, best, costs, utilities


@dataclass(frozen=True, eq=False)
class Course:
    """What happened in one run."""

    entropies: FloatArray = field(repr=False)  # (t, n) nats, after each time step
    robot: FloatArray = field(repr=False)  # (t + 1, 2) m
    objects: FloatArray = field(repr=False)  # (n, 2) m, where they stand
    updates: IntArray = field(repr=False)  # (n,) measurements of each object
    approaches: IntArray = field(repr=False)  # (n,) actions towards each object

    @property
    def distance(self) -> float:
        """m, driven in all."""
        return float(np.hypot(*np.diff(self.robot, axis=0).T).sum())

    @property
    def worst_entropy(self) -> float:
        """Mean over time of the largest entropy, eq. (13), nats."""
        return float(self.entropies.max(axis=1).mean())

    @property
    def total_entropy(self) -> float:
        """Mean over time of the sum of the entropies, eq. (14), nats."""
        return float(self.entropies.sum(axis=1).mean())


def simulate(setup: Setup, seed: int) -> Course:
    """One run. The same seed gives every strategy the same room."""
    room = np.random.default_rng([seed, 0])
    truth = room.uniform(0.0, setup.room, (setup.objects, 2))
    drift = room.uniform(0.0, setup.largest_drift, setup.objects)
    robot, readings = room.uniform(0.0, setup.room, 2), np.random.default_rng([seed, 1])
    measured = _readings(truth, setup, readings)
    beliefs = PointBeliefs(measured, np.full_like(truth, setup.noise), drift)
    choose = _chooser(setup, truth, np.random.default_rng([seed, 2]))
    sensor, entropies, places = setup.sensor, [], [robot]
    updates, approaches = (np.zeros(setup.objects, dtype=np.int64) for _ in range(2))
    pose, way, target = np.append(robot, 0.0), np.empty((0, 3)), None
    for _ in range(setup.steps):
        if not len(way) or (setup.assumptions.replans and setup.strategy == "coordinator"):
            was = target if len(way) else None
            target, way = choose(beliefs, pose)
            if target is not None and target != was:
                approaches[target] += 1
        beliefs = beliefs.predicted()
        if idle := not len(way):
            seen = np.zeros(setup.objects, dtype=bool)
        else:
            pose, way = way[0], way[1:]
        if not idle or setup.assumptions.updates_when_idle:
            seen = sensor.sees(pose, truth)
        beliefs = beliefs.updated(seen, _readings(truth, setup, readings), setup.noise)
        updates += seen
        entropies.append(beliefs.entropies)
        places.append(pose[:2])
    return Course(np.array(entropies), np.array(places), truth, updates, approaches)


def _readings(truth, setup, rng):
    return truth + np.sqrt(setup.noise) * rng.standard_normal(truth.shape)


def _goals(setup, pose, means):
    off = means - pose[:2]
    d = np.hypot(off[:, 0], off[:, 1])
    share = np.clip((d - setup.assumptions.stop_at), 0.0, None) / np.where(d > 0, d, 1)
    return pose[:2] + share[:, None] * off


def _chooser(setup, truth, rng):
    stride = setup.assumptions.speed * setup.assumptions.step
    if setup.strategy == "fixed path":
        order = shortest_tour(truth) if setup.assumptions.order == "shortest" else rng.permutation(len(truth))
        state = {"k": 0}
        def fixed(beliefs, pose):
            target = int(order[state["k"] % len(order)])
            state["k"] += 1
            ways, lengths = straight_ways(pose[:2], _goals(setup, pose, truth)[target][None], stride)
            return target, ways[0]
        return fixed
    s = ChoiceSettings(gain_threshold=setup.gain_threshold, gain_norm=setup.gain_norm, cost_weight=setup.cost_weight, cost_scale=setup.room)
    sensor = setup.sensor
    def coordinate(beliefs, pose):
        goals = _goals(setup, pose, beliefs.means)
        ways, lengths = straight_ways(pose[:2], goals, stride)
        gains = gains_along(beliefs, ways, lengths, sensor)
        d = np.hypot(*(goals - pose[:2]).T)
        k = best(gains, utilities(gains, costs(d, s), s), s)
        return (None, np.empty((0, 3))) if k is None else (k, ways[k, : lengths[k]])
    return coordinate
