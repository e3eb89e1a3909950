"""The sweeps of section 7, and what they come to on average."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from objstate.experiments.elfring2014.setup import Assumptions, Setup
from objstate.experiments.elfring2014.simulation import simulate
from objstate.geometry import FloatArray
from objstate.processes import in_order

PAIRED = (
    2.0,
    4.0,
    6.0,
)  # nats, thresholds whose runs are compared with the benchmark's in the same room
THRESHOLDS = (2.0, 4.0, 6.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 20.0)  # nats, Fig. 4
WEIGHTS = (0.05, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.7, 2.0)  # Fig. 6
INTERVAL = 1.96  # standard deviations of a mean to either side: 95 %


@dataclass(frozen=True)
class Mean:
    """A mean over runs, with half of its 95 % interval."""

    value: float
    half: float

    @staticmethod
    def of(values: FloatArray) -> Mean:
        if len(values) < 2:
            return Mean(float(values.mean()), float("nan"))
        half = INTERVAL * values.std(ddof=1) / np.sqrt(len(values))
        return Mean(float(values.mean()), float(half))


@dataclass(frozen=True)
class Averages:
    """What a set-up came to over all runs."""

    setup: Setup
    worst_entropy: Mean  # nats
    total_entropy: Mean  # nats
    distance: Mean  # m
    actions: Mean
    updates: Mean

    @staticmethod
    def of(setup: Setup, rows: FloatArray) -> Averages:
        """Of rows (r, 5), one a run."""
        return Averages(setup, *(Mean.of(column) for column in rows.T))


@dataclass(frozen=True)
class Difference:
    """What a set-up came to less what the benchmark did in the same room, over all rooms."""

    setup: Setup
    worst_entropy: Mean  # nats
    total_entropy: Mean  # nats
    better_worst: float  # share of rooms in which the worst entropy is lower
    better_total: float

    @staticmethod
    def of(setup: Setup, rows: FloatArray, benchmark: FloatArray) -> Difference:
        """Of rows (r, 5), one a run, of the same seeds in the same order."""
        less = rows[:, :2] - benchmark[:, :2]
        worst, total = less.T
        better = (less < 0.0).mean(axis=0).tolist()
        return Difference(setup, Mean.of(worst), Mean.of(total), *better)


def _rows(setups: Sequence[Setup], runs: int, processes: int) -> FloatArray:
    """(s, r, 5) figures of each run. The number of processes changes nothing but the time."""
    jobs = [(setup, seed) for setup in setups for seed in range(runs)]
    return np.array(list(in_order(_row, jobs, processes))).reshape(len(setups), runs, -1)


def _row(job: tuple[Setup, int]) -> tuple[float, ...]:
    course = simulate(*job)
    return (
        course.worst_entropy,
        course.total_entropy,
        course.distance,
        float(course.approaches.sum()),
        float(course.updates.sum()),
    )


@dataclass(frozen=True)
class Reproduction:
    """Figures 4 and 6, and the run of Fig. 7, under one set of assumptions."""

    assumptions: Assumptions
    benchmark: Averages
    thresholds: tuple[Averages, ...]  # Fig. 4, by IG_thr
    weights: tuple[Averages, ...]  # Fig. 6, by alpha
    differences: tuple[Difference, ...]  # from the benchmark, at thresholds of ``PAIRED``

    def at_threshold(self, nats: float) -> Averages:
        return next(each for each in self.thresholds if each.setup.gain_threshold == nats)

    def at_weight(self, alpha: float) -> Averages:
        return next(each for each in self.weights if each.setup.cost_weight == alpha)


def reproduce(
    sets: Sequence[Assumptions],
    runs: int,
    processes: int,
    thresholds: Sequence[float] = THRESHOLDS,
    weights: Sequence[float] = WEIGHTS,
) -> list[Reproduction]:
    """The sweeps under each set of assumptions."""
    return [_reproduced(each, runs, processes, thresholds, weights) for each in sets]


def _reproduced(
    assumptions: Assumptions,
    runs: int,
    processes: int,
    thresholds: Sequence[float],
    weights: Sequence[float],
) -> Reproduction:
    plain = Setup(assumptions=assumptions)
    by_threshold = [replace(plain, gain_threshold=nats) for nats in thresholds]
    by_weight = [replace(plain, cost_weight=alpha) for alpha in weights]
    setups = [replace(plain, strategy="fixed path"), *by_threshold, *by_weight]
    rows = _rows(setups, runs, processes)
    found = [Averages.of(setup, each) for setup, each in zip(setups, rows, strict=True)]
    first = 1 + len(thresholds)
    return Reproduction(
        assumptions,
        found[0],
        tuple(found[1:first]),
        tuple(found[first:]),
        tuple(
            Difference.of(setup, each, rows[0])
            for setup, each in zip(by_threshold, rows[1:first], strict=True)
            if setup.gain_threshold in PAIRED
        ),
    )
