"""Errors against truth on fresh simulated drives: ``python benchmarks/accuracy.py SCENE SEED...``

``--settings FILE`` estimates with other settings than the defaults. Prints a row for each seed, and one over all: final door errors in degrees (the
last observed estimate before a state changes or the log ends), the share of
truths inside the 90 % intervals, the Cramér-Rao bound (root mean square, deg) and
how many times it the root mean square error is, the robot's own error, and for how long it was said
to be lost, which it never is.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from objstate.bound import BoundErrors, evaluate_bound
from objstate.config import Settings, load_settings
from objstate.evaluation import compare_paths, latest_states
from objstate.recording.tables import read_estimates, read_truth
from objstate.recording.tum import read_tum
from objstate.records import NANOSECONDS
from objstate.run import RunOptions, estimate_log
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

HEADER = (
    "| seed | doors | mean error | median | largest | within 5 deg | in 90 % interval | bound "
    "| error / bound | robot | said to be lost | times real time |"
)


@dataclass(frozen=True)
class Row:
    """What one drive came to."""

    errors: np.ndarray  # (n,) deg, final door errors without their signs
    inside: np.ndarray  # (n,) whether the 90 % intervals hold
    limit: BoundErrors  # of all doors' angles
    robot: float  # m, mean error
    lost: float  # s for which it was said to be lost
    speed: float  # times real time


def study(scene: Path, seeds: list[int], settings: Settings) -> None:
    """Simulate, estimate and evaluate a scene for each seed; print a Markdown table."""
    print(HEADER + "\n|" + " --- |" * HEADER.count(" | ") + " --- |")
    rows = []
    for seed in seeds:
        rows.append(drive(scene, seed, settings))
        print_rows(str(seed), rows[-1:])
    print_rows("all", rows)


def drive(scene: Path, seed: int, settings: Settings) -> Row:
    """One simulated drive, estimated."""
    with tempfile.TemporaryDirectory() as folder:
        simulated = simulate(scene, Path(folder) / "drive", seed=seed)
        truth = read_truth(simulated.folder / "truth.csv")
        building = load_scene(scene).building
        options = RunOptions(settings=settings)
        result = estimate_log([simulated.log], building, Path(folder) / "result", options)
        states = [
            each
            for each in latest_states(read_estimates(result.folder), truth, result.lost_ns)
            if each.error is not None and each.estimate.observed
        ]
        limits = evaluate_bound(result.folder, simulated.folder / "truth.csv").overall
        robot = compare_paths(
            read_tum(result.folder / "trajectory.tum"), read_tum(simulated.folder / "path.tum")
        )
        return Row(
            errors=np.degrees([abs(each.error) for each in states]),
            inside=np.array(
                [each.estimate.lower <= each.truth <= each.estimate.upper for each in states]
            ),
            limit=next(each for each in limits if each.coordinate == "angle"),
            robot=robot.position.mean,
            lost=sum(end - begin for begin, end in result.lost_ns) / NANOSECONDS,
            speed=result.log_seconds / result.elapsed_seconds,
        )


def print_rows(name: str, rows: list[Row]) -> None:
    """One row of the table, of one drive or of all."""
    errors = np.concatenate([row.errors for row in rows])
    inside = np.concatenate([row.inside for row in rows])
    error, bound = (
        np.sqrt(np.average(np.square(each), weights=[row.limit.count for row in rows]))
        for each in ([row.limit.error for row in rows], [row.limit.bound for row in rows])
    )
    print(
        f"| {name} | {len(errors)} | {errors.mean():.2f} | {np.median(errors):.2f} | "
        f"{errors.max():.2f} | {100 * np.mean(errors <= 5):.0f} % | {100 * inside.mean():.0f} % | "
        f"{np.degrees(bound):.2f} | {error / bound:.1f} | "
        f"{100 * np.mean([row.robot for row in rows]):.1f} cm | "
        f"{sum(row.lost for row in rows):.1f} s | "
        f"{np.median([row.speed for row in rows]):.0f} |",
        flush=True,
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Errors against truth on simulated drives.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--settings", type=Path)
    given = parser.parse_args()
    study(given.scene, given.seeds, load_settings(given.settings))
