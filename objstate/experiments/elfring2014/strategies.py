"""The two strategies that section 7 compares: where to go next."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle

import numpy as np

from objstate.experiments.elfring2014.setup import Setup
from objstate.experiments.tours import shortest_tour
from objstate.gaze.gaussian import PointBeliefs, gains_along, straight_ways
from objstate.geometry import FloatArray, IntArray
from objstate.maintenance.choice import ChoiceSettings, best, costs, utilities

# beliefs and the robot's place (2,) to an object's number and the poses (k, 3) of the way
# there, one a time step; None to wait a time step
Choose = Callable[[PointBeliefs, FloatArray], tuple[int, FloatArray] | None]


def strategy(setup: Setup, truth: FloatArray, rng: np.random.Generator) -> Choose:
    """The strategy of a set-up, for objects that stand at ``truth`` (n, 2)."""
    if setup.strategy == "coordinator":
        return _coordinator(setup)
    if setup.assumptions.order == "shortest":
        distance = np.linalg.norm(truth[:, None] - truth, axis=2)
        return _fixed_path(setup, truth, shortest_tour(distance))
    return _fixed_path(setup, truth, rng.permutation(len(truth)))


def _fixed_path(setup: Setup, truth: FloatArray, order: IntArray) -> Choose:
    """Along all objects, over and over again."""
    targets = cycle(order.tolist())

    def choose(beliefs: PointBeliefs, place: FloatArray) -> tuple[int, FloatArray]:
        target = next(targets)
        ways, _ = straight_ways(place, truth[target][None], setup.stride)
        return target, ways[0]

    return choose


def _coordinator(setup: Setup) -> Choose:
    """To the object whose update is most useful, if its way promises enough."""
    sensor, assumed = setup.sensor, setup.assumptions
    settings = ChoiceSettings(
        gain_threshold=setup.gain_threshold,
        counting="gain",
        least_utility=-np.inf,
        gain_norm=setup.gain_norm,
        cost_weight=setup.cost_weight,
        cost_scale=setup.room,
    )

    def choose(beliefs: PointBeliefs, place: FloatArray) -> tuple[int, FloatArray] | None:
        goals = beliefs.means[:, :2]
        ways, lengths = straight_ways(place, goals, setup.stride)
        gains = gains_along(beliefs, ways, lengths, sensor, assumed.counting, assumed.counted)
        distances = np.hypot(*(goals - place).T)
        chosen = best(gains, utilities(gains, costs(distances, settings), settings), settings)
        return None if chosen is None else (chosen, ways[chosen, : lengths[chosen]])

    return choose
