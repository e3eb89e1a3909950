"""Section 7.1: what the parts of a picture's work cost, and what the look-up table saves.

Times differ from run to run; the thesis' are of its robot, so that only ratios compare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import get_args

import numpy as np

from objstate.experiments.darmstadt import gazing
from objstate.experiments.darmstadt.accuracy import BEGIN
from objstate.experiments.darmstadt.behaviours import Sweep
from objstate.experiments.darmstadt.camera import lines, take
from objstate.experiments.darmstadt.robot import Robot
from objstate.experiments.darmstadt.setting import LAYOUT, REACH, STANDING, Scene
from objstate.gaze.field import FocusGazer
from objstate.grid import entropy
from objstate.grid.entropy import Method

WARM_UP, FRAMES = 90, 150
BALL = np.array([0.5, 0.0])
POLES = Scene(np.array([[0.0, 0.5], [0.5, -0.6]]))


@dataclass(frozen=True)
class RunTime:
    """Medians over pictures, ms."""

    occupancy: float  # percepts drawn, and values of all cells by their age
    entropies: dict[Method, float]  # of all cells
    drawn: float  # of ball and landmarks
    particles: float  # the search with the thesis' views
    windows: float  # the best of all views

    def entropy_part(self, method: Method) -> float:
        """All that the entropy map takes in each picture in the thesis, ms."""
        return self.entropies[method] + self.drawn + self.particles


def measure_time() -> RunTime:
    """The robot stands, sweeps and does each part in each picture."""
    rng = np.random.default_rng(0)
    robot, sweep, gaze = Robot(POLES, STANDING, rng), Sweep(), gazing.with_views(0)
    robot.ball, robot.ball_validity = BALL, 0.5
    gazer = FocusGazer(LAYOUT, gazing.CAMERA, gazing.PARTICLES, gazing.APART)
    spent: dict[str, list[float]] = {}

    def clocked(name: str, done: Callable[[], object]) -> None:
        begin = perf_counter()
        done()
        spent.setdefault(name, []).append(1000.0 * (perf_counter() - begin))

    for _ in range(WARM_UP + FRAMES):
        robot.step(BEGIN, sweep.target(robot, BEGIN))
        aim = robot.head.shaken(STANDING, rng)
        percepts = lines(take(POLES, BEGIN, aim), aim, REACH).percepts(BEGIN, 0.01, 0.01)
        grid, stamp = robot.grid, robot.stamp_ns
        clocked("sweep", partial(grid.sweep, percepts, stamp, REACH))
        clocked("values", partial(grid.values, stamp))
        values = grid.values(stamp)
        for method in get_args(Method):
            clocked(method, partial(entropy, values, method))
        clocked("drawn", partial(gaze.add_objects, values.copy(), robot))
        bits, seeds = gaze.bits(robot), [BALL]
        clocked("particles", partial(gazer.by_particles, bits, BEGIN, seeds[0], rng, seeds))
        clocked("windows", partial(gazer.by_windows, bits, BEGIN, seeds[0]))
    median = {name: float(np.median(each[WARM_UP:])) for name, each in spent.items()}
    return RunTime(
        median["sweep"] + median["values"],
        {method: median[method] for method in get_args(Method)},
        median["drawn"],
        median["particles"],
        median["windows"],
    )
