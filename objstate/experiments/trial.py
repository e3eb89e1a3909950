"""One simulated drive, estimated in several ways and held against its truth and its bound."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from objstate.bound import Bounds, bounds_of
from objstate.building import load_building
from objstate.config import Settings
from objstate.evaluation import compare_paths
from objstate.evaluation.states import (
    Comparison,
    Coordinate,
    TrueCourse,
    compare_all,
    true_courses,
)
from objstate.geometry import FloatArray
from objstate.recording.tables import read_estimates
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import Path as RobotPath
from objstate.run import RunOptions, estimate_log
from objstate.simulation import simulate
from objstate.simulation.drive import Simulation
from objstate.simulation.scene import Scene, dump_scene


@dataclass(frozen=True)
class Trial:
    """A drive to simulate; the scene's seed is its number."""

    scene: Scene
    settings: Mapping[str, Settings]  # how it is estimated, by a name


@dataclass(frozen=True)
class Final:
    """The last observed estimate of one coordinate before its state changes or the log ends."""

    object: str
    coordinate: str
    stamp_ns: int
    truth: float  # rad or m, as all below
    error: float  # estimate minus truth; rotations wrapped
    inside: bool  # the truth lies inside the 90 % interval
    bound: float  # least standard deviation by Cramér and Rao

    @property
    def estimate(self) -> float:
        """The estimate itself."""
        return self.truth + self.error


@dataclass(frozen=True)
class Average:
    """All observed estimates of one coordinate, as in Figs. 5 and 7 of the paper."""

    object: str
    coordinate: str
    truth: float  # the last
    error: float  # mean of estimates minus truth
    std: float  # of estimates about their mean


@dataclass(frozen=True, eq=False)
class Run:
    """What came of estimating one drive in one way."""

    setting: str
    seed: int
    seconds: float  # of the log
    finals: tuple[Final, ...]
    averages: tuple[Average, ...]
    path: FloatArray  # (n, 3) the estimated poses of the robot
    robot_error: float  # m, mean


@dataclass(frozen=True, eq=False)
class _Known:
    """What the simulation knows of a drive."""

    courses: Mapping[Coordinate, TrueCourse]
    bounds: Bounds
    path: RobotPath


def run_trial(trial: Trial) -> tuple[Run, ...]:
    """Simulate a drive and estimate it in every way; same trial, same figures."""
    simulation = Simulation(trial.scene, load_building(trial.scene.building))
    known = _Known(true_courses(simulation.truth()), bounds_of(simulation), simulation.path())
    with tempfile.TemporaryDirectory() as scratch:
        scene = Path(scratch) / "scene.yaml"
        scene.write_text(dump_scene(trial.scene), encoding="utf-8")
        log = simulate(scene, Path(scratch) / "drive").log
        return tuple(
            _run(trial, name, log, Path(scratch) / f"result_{number}", known)
            for number, name in enumerate(trial.settings)
        )


def _run(trial: Trial, name: str, log: Path, out: Path, known: _Known) -> Run:
    options = RunOptions(settings=trial.settings[name], seed=trial.scene.seed)
    result = estimate_log([log], trial.scene.building, out, options)
    path = read_tum(out / TRAJECTORY)
    compared = compare_all(read_estimates(out), known.courses, result.lost_ns, result.symmetry)
    return Run(
        setting=name,
        seed=trial.scene.seed,
        seconds=result.log_seconds,
        finals=tuple(_finals(compared, known)),
        averages=tuple(_averages(compared, known)),
        path=path.poses,
        robot_error=compare_paths(path, known.path).position.mean,
    )


def _finals(compared: Mapping[Coordinate, Comparison], known: _Known) -> Iterator[Final]:
    for key, part in sorted(compared.items()):
        stamps, course = part.stamps_ns[part.final], known.courses[key]
        columns = (
            stamps,
            course.values[course.period(stamps)],
            part.errors[part.final],
            part.inside[part.final],
            known.bounds.at(key, stamps),
        )
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield Final(*key, *row)


def _averages(compared: Mapping[Coordinate, Comparison], known: _Known) -> Iterator[Average]:
    for key, part in sorted(compared.items()):
        if len(part.errors):
            truth = float(known.courses[key].values[-1])
            yield Average(*key, truth, float(part.errors.mean()), float(np.std(part.errors)))
