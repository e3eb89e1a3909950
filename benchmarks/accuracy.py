"""Errors against truth on fresh simulated drives: ``python benchmarks/accuracy.py SCENE SEED...``

Prints a row for each seed, and one over all: final door errors in degrees (the
last observed estimate before a state changes or the log ends), the share of
truths inside the 90 % intervals, and the robot's own error.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from objstate.evaluation import compare_paths, latest_states
from objstate.recording.tables import read_estimates, read_truth
from objstate.recording.tum import read_tum
from objstate.run import estimate_log
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

HEADER = "| seed | doors | mean error | median | largest | within 5 deg | in 90 % interval | robot | times real time |"


def study(scene: Path, seeds: list[int]) -> None:
    """Simulate, estimate and evaluate a scene for each seed; print a Markdown table."""
    print(HEADER + "\n|" + " --- |" * 9)
    rows = [drive(scene, seed) for seed in seeds]
    errors = np.concatenate([errors for errors, *_ in rows])
    inside = np.concatenate([inside for _, inside, *_ in rows])
    robot, speed = np.mean([robot for *_, robot, _ in rows]), np.median([row[3] for row in rows])
    print_row("all", errors, inside, float(robot), float(speed))


def drive(scene: Path, seed: int) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Final errors (deg), whether intervals hold, the robot's mean error (m), and the speed."""
    with tempfile.TemporaryDirectory() as folder:
        simulated = simulate(scene, Path(folder) / "drive", seed=seed)
        truth = read_truth(simulated.folder / "truth.csv")
        building = load_scene(scene).building
        result = estimate_log([simulated.log], building, Path(folder) / "result", None)
        states = [
            each
            for each in latest_states(read_estimates(result.folder), truth, result.lost_ns)
            if each.error is not None and each.estimate.observed
        ]
        robot = compare_paths(
            read_tum(result.folder / "trajectory.tum"), read_tum(simulated.folder / "path.tum")
        )
        errors = np.degrees([abs(each.error) for each in states])
        inside = np.array(
            [each.estimate.lower <= each.truth <= each.estimate.upper for each in states]
        )
        speed = result.log_seconds / result.elapsed_seconds
        print_row(str(seed), errors, inside, robot.position.mean, speed)
        return errors, inside, robot.position.mean, speed


def print_row(
    name: str, errors: np.ndarray, inside: np.ndarray, robot: float, speed: float
) -> None:
    """One row of the table."""
    print(
        f"| {name} | {len(errors)} | {errors.mean():.2f} | {np.median(errors):.2f} | "
        f"{errors.max():.2f} | {100 * np.mean(errors <= 5):.0f} % | {100 * inside.mean():.0f} % | "
        f"{100 * robot:.1f} cm | {speed:.0f} |",
        flush=True,
    )


if __name__ == "__main__":
    study(Path(sys.argv[1]), [int(seed) for seed in sys.argv[2:]])
