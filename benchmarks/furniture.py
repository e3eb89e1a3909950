"""Furniture against truth on fresh simulated drives: ``python benchmarks/furniture.py SCENE SEED...``

Prints, for every object, the errors of its final states (the last observed estimate
before somebody moves it or the log ends) over all seeds: in metres on the floor, and
in degrees modulo the object's symmetry; the shares of x, y and yaw inside their 90 %
intervals; how long after the object was first in reach it was found for good (within
5 cm and 5 degrees, presence above 0.9); and the probability that it is there in the end.

``--building`` estimates with another building than the scene's, such as one with an
object that isn't there, ``--settings`` with other settings than the defaults, and
``--logs`` keeps the simulated drives in a folder and takes those that are there.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from objstate.building import load_building
from objstate.config import load_settings
from objstate.evaluation.states import Posteriors, compare, observed_posteriors, true_courses
from objstate.recording.tables import read_estimates, read_truth
from objstate.run import RunOptions, estimate_log
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

HEADER = (
    "| object | finals | off (cm): median, mean, largest | yaw (deg): median, mean, largest "
    "| within 3 cm, 2 deg | x, y, yaw in 90 % interval | found after (s): median, largest "
    "| presence: least, mean, largest |"
)
FOUND_M, FOUND_DEG, FOUND_PRESENCE = 0.05, 5.0, 0.9


@dataclass(frozen=True)
class Final:
    """How one drive's last estimate of a state came out."""

    off: float  # m
    turned: float  # rad
    inside: tuple[bool, bool, bool]


@dataclass(frozen=True)
class Outcome:
    """How one drive came out for one object."""

    finals: tuple[Final, ...]
    found_after: float  # s; nan: it wasn't, or has no truth
    presence: float


def study(scene: Path, seeds: list[int], options: argparse.Namespace) -> None:
    """Simulate, estimate and compare a scene for each seed; print a Markdown table."""
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    speeds = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.logs or Path(scratch)
        for seed in seeds:
            drive = folder / f"{scene.name.split('.')[0]}_{seed}"
            found, speed = one_drive(scene, seed, drive, options)
            speeds.append(speed)
            for name, outcome in found.items():
                outcomes[name].append(outcome)
                print(f"<!-- {seed} {row(name, [outcome])} -->", flush=True)
    print(HEADER + "\n|" + " --- |" * 8)
    for name, each in sorted(outcomes.items()):
        print(row(name, each))
    if len(outcomes) > 1:
        print(row("all", [one for each in outcomes.values() for one in each]))
    print(f"\n{np.median(speeds):.1f} x real time (median)")


def one_drive(
    scene: Path, seed: int, drive: Path, options: argparse.Namespace
) -> tuple[dict[str, Outcome], float]:
    """The outcome for each piece of furniture, and the speed."""
    if not drive.exists():
        simulate(scene, drive, seed=seed)
    urdf = options.building or load_scene(scene).building
    run = RunOptions(settings=load_settings(options.settings))
    with tempfile.TemporaryDirectory() as folder:
        result = estimate_log([drive / "log.mcap"], urdf, Path(folder) / "result", run)
        estimates = read_estimates(result.folder)
    courses = true_courses(read_truth(drive / "truth.csv"))
    posteriors = observed_posteriors(estimates)
    outcomes = {}
    for name, item in load_building(urdf).objects.items():
        keys = [(name, coordinate) for coordinate in item.coordinates]
        if len(keys) == 1 or keys[0] not in posteriors:
            continue
        rows = estimates.filter((pl.col("object") == name) & (pl.col("coordinate") == "x"))
        presence = rows.filter("observed")["presence"].to_numpy()
        parts = [posteriors[key] for key in keys]
        if keys[0] in courses:
            truths = [courses[key] for key in keys]
            outcomes[name] = compared(parts, truths, presence, item.symmetry.order)
        else:
            outcomes[name] = Outcome((), float("nan"), float(presence[-1]))
    return outcomes, result.log_seconds / result.elapsed_seconds


def compared(
    parts: list[Posteriors], truths: list, presence: np.ndarray, order: int
) -> Outcome:  # fmt: skip
    """One object's estimates of x, y and yaw beside their truths."""
    each = [
        compare(coordinate, part, truth, symmetry=order)
        for coordinate, part, truth in zip(("x", "y", "yaw"), parts, truths, strict=True)
    ]
    off = np.hypot(each[0].errors, each[1].errors)
    turned = np.abs(each[2].errors)
    inside = np.column_stack([part.inside for part in each])
    last = np.any([part.final for part in each], axis=0)
    finals = [
        Final(float(o), float(t), (bool(i[0]), bool(i[1]), bool(i[2])))
        for o, t, i in zip(off[last], turned[last], inside[last], strict=True)
    ]
    right = (off <= FOUND_M) & (turned <= np.radians(FOUND_DEG)) & (presence > FOUND_PRESENCE)
    wrong = np.flatnonzero(~right)
    stamps = parts[0].stamps_ns
    since = 0 if len(wrong) == 0 else wrong[-1] + 1
    after = (stamps[since] - stamps[0]) / 1e9 if since < len(stamps) else float("nan")
    return Outcome(tuple(finals), float(after), float(presence[-1]))


def row(name: str, outcomes: list[Outcome]) -> str:
    """One row of the table."""
    presence = np.array([each.presence for each in outcomes])
    there = f"{presence.min():.3f}, {presence.mean():.3f}, {presence.max():.3f}"
    finals = [final for each in outcomes for final in each.finals]
    if not finals:
        return f"| {name} | 0 | | | | | | {there} |"
    off = 100.0 * np.array([final.off for final in finals])
    turned = np.degrees([final.turned for final in finals])
    inside = 100.0 * np.array([final.inside for final in finals]).mean(axis=0)
    within = 100.0 * np.mean((off <= 3.0) & (turned <= 2.0))
    after = np.array([each.found_after for each in outcomes])
    found = after[np.isfinite(after)]
    times = f"{np.median(found):.1f}, {found.max():.1f}" if len(found) else "never"
    missed = "" if len(found) == len(after) else f"; {len(after) - len(found)} never"
    return (
        f"| {name} | {len(finals)} | {np.median(off):.1f}, {off.mean():.1f}, {off.max():.1f} "
        f"| {np.median(turned):.1f}, {turned.mean():.1f}, {turned.max():.1f} | {within:.0f} % "
        f"| {inside[0]:.0f}, {inside[1]:.0f}, {inside[2]:.0f} % | {times}{missed} | {there} |"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("scene", type=Path)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--building", type=Path)
    parser.add_argument("--settings", type=Path)
    parser.add_argument("--logs", type=Path)
    arguments = parser.parse_args()
    study(arguments.scene, arguments.seeds, arguments)
