"""Sections 7.2 and 7.3: what the grid and the sector model say of things whose place is known.

A cell's error is how far it lies on the wrong side of the obstacle's outline, or on the right one: the
distance of its middle to the obstacle's, less the radius. The thesis takes all occupied cells; of the
free ones it doesn't say which: here those that the obstacle touches. Deviations are about no error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from objstate.experiments.darmstadt.behaviours import Sweep
from objstate.experiments.darmstadt.robot import FRAMES_A_SECOND, Robot
from objstate.experiments.darmstadt.setting import LAYOUT, STANDING, Scene
from objstate.geometry import FloatArray
from objstate.grid.grid import FREE, OCCUPIED
from objstate.processes import in_order

PLACES = ((1.5, 0.0), (2.5, 0.0), (1.5, 1.0))  # m ahead and to the left, table 7.4
BEGIN = np.array([-1.5, 0.0, 0.0])  # the robot's pose
SAMPLE_FRAMES = FRAMES_A_SECOND // 2  # every 500 ms
WARM_UP_S = 5.0  # until the map holds something
TOUCHES = LAYOUT.resolution / math.sqrt(2.0)  # m from an outline, of a cell's middle
THREE_AND_A_BOX = Scene(
    np.array([[0.3, 0.9], [0.0, -0.7], [1.2, 0.1]]), np.array([[-0.4, 0.3]])
)  # as in figure 7.2a
PHANTOM = 0.25  # m from all obstacles, from where what is occupied is one


@dataclass(frozen=True)
class Accuracy:
    """Errors of one recording, m."""

    place: int
    sector: float
    occupied: float
    free: float  # nan where no cell that the obstacle touches was free


@dataclass(frozen=True)
class Validity:
    """One recording of three poles and a box."""

    found_by_grid: float  # share of the four
    found_by_sectors: float
    phantom_cells: float  # mean number of occupied cells far from all obstacles
    phantom_sectors: float  # of sectors


def measure(seeds: Sequence[int], seconds: float, processes: int) -> Iterator[Accuracy]:
    """Table 7.5, one place after another."""
    tasks = [(place, seed, seconds) for place in range(len(PLACES)) for seed in seeds]
    yield from in_order(_measured, tasks, processes)


def validate(seeds: Sequence[int], seconds: float, processes: int) -> Iterator[Validity]:
    """Figure 7.2."""
    yield from in_order(_validated, [(seed, seconds) for seed in seeds], processes)


def watched(scene: Scene, seed: int, seconds: float) -> Iterator[Robot]:
    """The robot each half second, while it stands and sweeps."""
    robot, sweep = Robot(scene, STANDING, np.random.default_rng(seed)), Sweep()
    for frame in range(1, round(seconds * FRAMES_A_SECOND) + 1):
        robot.step(BEGIN, sweep.target(robot, BEGIN))
        if frame % SAMPLE_FRAMES == 0 and robot.time > WARM_UP_S:
            yield robot


def _measured(task: tuple[int, int, float]) -> Accuracy:
    place, seed, seconds = task
    scene = Scene(BEGIN[None, :2] + np.array(PLACES[place]))
    away = scene.distances(LAYOUT.centres().reshape(-1, 2)).reshape(LAYOUT.shape)
    sector: list[FloatArray] = []
    occupied: list[FloatArray] = []
    free: list[FloatArray] = []
    for robot in watched(scene, 1000 * place + seed, seconds):
        values = robot.grid.values(robot.stamp_ns)
        occupied.append(away[values > OCCUPIED])
        free.append(away[(values < FREE) & (away < TOUCHES)])
        sector.append(scene.distances(_points(robot)))
    return Accuracy(place, *(_deviation(each) for each in (sector, occupied, free)))


def _validated(task: tuple[int, float]) -> Validity:
    seed, seconds = task
    scene, centres = THREE_AND_A_BOX, LAYOUT.centres().reshape(-1, 2)
    things = [Scene(pole[None]) for pole in scene.poles]
    things += [Scene(np.empty((0, 2)), box[None]) for box in scene.boxes]
    rows = []
    for robot in watched(scene, seed, seconds):
        cells = centres[(robot.grid.values(robot.stamp_ns) > OCCUPIED).ravel()]
        points = _points(robot)
        found = [
            float(np.mean([(thing.distances(each) < PHANTOM).any() for thing in things]))
            for each in (cells, points)
        ]
        far = [float((scene.distances(each) > PHANTOM).sum()) for each in (cells, points)]
        rows.append([*found, *far])
    return Validity(*np.mean(rows, axis=0).tolist())


def _points(robot: Robot) -> FloatArray:
    """(n, 2) m on the field, of the occupied sectors; the robot looks along the field's axis."""
    return np.asarray(BEGIN[:2] + robot.sectors.points[robot.sectors.occupied])


def _deviation(errors: Sequence[FloatArray]) -> float:
    """About no error; nan of none."""
    listed = np.concatenate(errors) if errors else np.empty(0)
    return float(np.sqrt(np.mean(listed**2))) if len(listed) else math.nan
