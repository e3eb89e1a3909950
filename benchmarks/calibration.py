"""Calibration against truth on simulated drives: ``python benchmarks/calibration.py SCENE SEED...``

Prints for each seed and laser the true corrections, the estimated ones and their
deviations, and over all the share of truths inside the 90 % intervals. With
``--gain``, doors' and the robot's errors without and with ``estimate --calibrate``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from objstate.building import load_building
from objstate.evaluation import compare_paths, latest_states
from objstate.geometry import wrap
from objstate.recording.tables import read_estimates, read_truth
from objstate.recording.tum import read_tum
from objstate.run import RunOptions, estimate_log
from objstate.run.calibrating import calibrate_log
from objstate.simulation import simulate
from objstate.simulation.drive import Simulation
from objstate.simulation.scene import load_scene

SHOWN = np.array([100.0, 100.0, 180.0 / np.pi, 1000.0])  # cm, cm, deg, ms
NINETY = 1.645  # deviations of a Gaussian's central 90 %


def study(scene: Path, seeds: list[int], gain: bool) -> None:
    """Simulate and calibrate a scene for each seed; print a Markdown table."""
    print("| seed | laser | x (cm) | y (cm) | yaw (deg) | clock (ms) |\n|" + " --- |" * 6)
    errors, deviations = [], []
    for seed in seeds:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            log = simulate(scene, folder / "drive", seed=seed).log
            building, truth = load_scene(scene).building, true_corrections(scene, seed)
            found = calibrate_log([log], building)
            for laser in found.lasers:
                row(f"{seed} | {laser.frame}", truth[laser.frame], laser.correction, laser.std)
                errors.append(laser.correction - truth[laser.frame])
                deviations.append(laser.std)
            if gain:
                print_gain(seed, folder, building, RunOptions())
                tuned = RunOptions(mounts=found.mounts, clock_offsets=found.clock_offsets)
                print_gain(seed, folder, building, tuned)
    off, std = np.array(errors), np.array(deviations)
    inside = 100.0 * np.mean(np.abs(off) <= NINETY * std, axis=0)
    print("root mean square error:", (SHOWN * np.sqrt((off**2).mean(axis=0))).round(2))
    print("root mean square of the deviations:", (SHOWN * np.sqrt((std**2).mean(axis=0))).round(2))
    print("% of truths in 90 % intervals:", inside.round(), "over all:", inside.mean().round(1))


def true_corrections(scene: Path, seed: int) -> dict[str, np.ndarray]:
    """(4,) of each laser by frame: x, y, yaw, clock."""
    settings = load_scene(scene, seed)
    simulation = Simulation(settings, load_building(settings.building))
    return {
        laser.frame: np.array(
            [
                mount[0, 3] - laser.mount.x,
                mount[1, 3] - laser.mount.y,
                float(wrap(np.arctan2(mount[1, 0], mount[0, 0]) - laser.mount.yaw)),
                settings.model_error.clock_offset,
            ]
        )
        for laser, mount in simulation.mounts
    }


def row(label: str, truth: np.ndarray, estimate: np.ndarray, std: np.ndarray) -> None:
    """Truth, estimate and deviation of each quantity."""
    cells = [
        f"{t:.2f}: {e:.2f} ± {s:.2f}"
        for t, e, s in zip(SHOWN * truth, SHOWN * estimate, SHOWN * std, strict=True)
    ]
    print(f"| {label} | {' | '.join(cells)} |", flush=True)


def print_gain(seed: int, folder: Path, building: Path, options: RunOptions) -> None:
    """Final door errors and the robot's own, of an estimation under options."""
    drive, out = folder / "drive", folder / "result"
    result = estimate_log([drive / "log.mcap"], building, out, options, overwrite=True)
    states = [
        each
        for each in latest_states(
            read_estimates(out), read_truth(drive / "truth.csv"), result.lost_ns
        )
        if each.error is not None and each.estimate.observed
    ]
    errors = np.degrees([abs(each.error) for each in states])
    inside = [each.estimate.lower <= each.truth <= each.estimate.upper for each in states]
    robot = compare_paths(read_tum(out / "trajectory.tum"), read_tum(drive / "path.tum"))
    print(
        f"seed {seed}, {'calibrated' if options.mounts else 'as recorded'}: doors mean "
        f"{errors.mean():.2f} deg, median {np.median(errors):.2f}, largest {errors.max():.2f}, in "
        f"90 % interval {100 * np.mean(inside):.0f} %; robot {100 * robot.position.mean:.2f} cm, "
        f"{np.degrees(robot.yaw.mean):.3f} deg",
        flush=True,
    )


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--gain"]
    study(Path(words[0]), [int(seed) for seed in words[1:]], gain="--gain" in sys.argv)
