"""One run of section 7: a robot that keeps ten positions up to date."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.experiments.elfring2014.setup import Setup
from objstate.experiments.elfring2014.strategies import strategy
from objstate.gaze.entropy import diagonal_entropy
from objstate.gaze.gaussian import PointBeliefs
from objstate.geometry import FloatArray, IntArray


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
        return self.between(0, len(self.robot))

    def between(self, first: int, last: int) -> float:
        """m, driven between two time steps."""
        return float(np.hypot(*np.diff(self.robot[first : last + 1], axis=0).T).sum())

    @property
    def worst_entropy(self) -> float:
        """Mean over time of the largest entropy, eq. (13), nats."""
        return float(self.entropies.max(axis=1).mean())

    @property
    def total_entropy(self) -> float:
        """Mean over time of the sum of the entropies, eq. (14), nats."""
        return float(self.entropies.sum(axis=1).mean())


def simulate(setup: Setup, seed: int) -> Course:
    """One run. The same seed gives every strategy the same room, start and readings."""
    room, noise = (np.random.default_rng([seed, subject]) for subject in range(2))
    truth = room.uniform(0.0, setup.room, (setup.objects, 2))
    pose = np.append(room.uniform(0.0, setup.room, 2), 0.0)
    drift = room.uniform(0.0, setup.largest_drift, setup.objects)
    first, *readings = _readings(setup, truth, noise)
    beliefs = PointBeliefs(first, np.full_like(first, setup.noise), drift)
    choose = strategy(setup, truth, np.random.default_rng([seed, 2]))
    sensor, way, variances, places = setup.sensor, np.empty((0, 3)), [], [pose[:2]]
    updates, approaches = (np.zeros(setup.objects, dtype=np.int64) for _ in range(2))
    for measured in readings:
        if not len(way) and (chosen := choose(beliefs, pose[:2])):
            target, way = chosen
            approaches[target] += 1
        beliefs = beliefs.predicted()
        if len(way) or setup.assumptions.updates_when_idle:
            pose, way = (way[0], way[1:]) if len(way) else (pose, way)
            seen = sensor.sees(pose, truth)
            beliefs = beliefs.updated(seen, measured, setup.noise)
            updates += seen
        variances.append(beliefs.variances)
        places.append(pose[:2])
    entropies = diagonal_entropy(np.array(variances))
    return Course(entropies, np.array(places), truth, updates, approaches)


def _readings(setup: Setup, truth: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Measured positions (t + 1, n, d); beyond the floor's two coordinates objects are at zero.

    The first of them are what the beliefs begin with.
    """
    positions = np.zeros((setup.objects, setup.assumptions.coordinates))
    positions[:, :2] = truth
    spread = rng.standard_normal((setup.steps + 1, *positions.shape))
    return np.asarray(positions + np.sqrt(setup.noise) * spread)
