"""Lost and found on simulated drives: ``python benchmarks/lost.py [--global] SCENE SEED...``

Prints a row for each time that the robot is carried elsewhere: after how many seconds it says that
it is lost, after how many it is found within 0.3 m and 10 degrees, and the mean error of its pose
from then on. Below stand false alarms, the time spent, and final door errors (degrees).
With ``--global`` the robot has to find itself at the drive's start.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from objstate.building import load_building
from objstate.estimator import Estimator
from objstate.geometry import wrap
from objstate.logs import open_log
from objstate.recording.tables import read_truth
from objstate.recording.tum import read_tum
from objstate.records import Estimate, Scan
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

CARRIED = 0.5  # m between two scans that no robot drives
NEAR_M, NEAR_RAD = 0.3, np.radians(10.0)


@dataclass
class Stretch:
    """From one kidnapping, or the start, to the next."""

    since_s: float
    said_s: float | None = None
    found_s: float | None = None
    errors: list[float] = field(default_factory=list)  # m, since found
    wrongly: float = 0.0  # s in which it claimed to be found, but was elsewhere
    alarms: int = 0  # times it said lost once it was found


def study(scene: Path, seeds: list[int], anywhere: bool) -> None:
    """Simulate and estimate a scene for each seed; print a Markdown table."""
    print("| seed | carried at | lost said after | found after | robot | sure of a wrong place |")
    print("| --- | --- | --- | --- | --- | --- |")
    for seed in seeds:
        drive(scene, seed, anywhere)


def drive(scene: Path, seed: int, anywhere: bool) -> None:
    """One drive: its rows."""
    with tempfile.TemporaryDirectory() as folder:
        simulated = simulate(scene, Path(folder) / "drive", seed=seed)
        path = read_tum(simulated.folder / "path.tum")
        truth = {
            each.object: each.value
            for each in read_truth(simulated.folder / "truth.csv")
            if each.coordinate == "angle"
        }
        estimator = Estimator(
            load_building(load_scene(scene).building), seed=seed, global_start=anywhere
        )
        true = dict(zip(path.stamps_ns.tolist(), path.poses, strict=True))
        begin, last, before, was_lost = int(path.stamps_ns[0]), None, 0.0, False
        stretches = [Stretch(0.0)]
        final: dict[str, Estimate] = {}
        worst = 0.0
        began = time.process_time()
        for record in open_log(simulated.log):
            rows = estimator.feed(record)
            if not isinstance(record, Scan) or record.stamp_ns not in true:
                continue
            now, pose = (record.stamp_ns - begin) / 1e9, true[record.stamp_ns]
            if last is not None and np.hypot(*(pose - last)[:2]) > CARRIED:
                stretches.append(Stretch(now))
            took, last, before = now - before, pose, now
            note(stretches[-1], estimator, pose, now, took, was_lost)
            was_lost = estimator.is_lost
            final |= {r.object: r for r in rows if r.observed and not r.lost and r.object in truth}
            if stretches[-1].found_s is not None:
                worst = max(
                    [
                        worst,
                        *(
                            off(r, truth)
                            for r in rows
                            if r.object in final and r.observed and r.std < np.radians(2)
                        ),
                    ]
                )
        spent = time.process_time() - began
    for each in stretches:
        print_row(seed, each)
    errors = [off(row, truth) for row in final.values()]
    print(
        f"seed {seed}: false alarms {sum(each.alarms for each in stretches)}, {now:.0f} s in "
        f"{spent:.1f} s; doors: mean {np.mean(errors or [np.nan]):.2f}, worst final "
        f"{max(errors, default=np.nan):.1f}, worst sure one {worst:.1f}",
        flush=True,
    )


def off(row: Estimate, truth: dict[str, float]) -> float:
    """Degrees from the truth."""
    return float(np.degrees(abs(row.mean - truth.get(row.object, np.nan))))


def note(
    stretch: Stretch,
    estimator: Estimator,
    pose: np.ndarray,
    now: float,
    took: float,
    was_lost: bool,
) -> None:
    """What a scan adds to a stretch."""
    robot = estimator.robot
    if robot is None:
        return
    away = robot.mean - pose
    error = float(np.hypot(*away[:2]))
    near = error < NEAR_M and abs(float(wrap(away[2]))) < NEAR_RAD
    if estimator.is_lost:
        stretch.alarms += stretch.found_s is not None and not was_lost
        if stretch.said_s is None and stretch.found_s is None:
            stretch.said_s = now - stretch.since_s
        return
    if near and stretch.found_s is None:
        stretch.found_s = now - stretch.since_s
    if near or stretch.found_s is not None:
        stretch.errors.append(error)
    if not near and stretch.said_s is not None:
        stretch.wrongly += took


def print_row(seed: int, each: Stretch) -> None:
    """One row of the table."""
    said, found = (f"{t:.1f} s" if t is not None else "-" for t in (each.said_s, each.found_s))
    robot = f"{100 * np.mean(each.errors):.1f} cm" if each.errors else "-"
    print(f"| {seed} | {each.since_s:.0f} s | {said} | {found} | {robot} | {each.wrongly:.1f} s |")


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--global"]
    study(Path(words[0]), [int(seed) for seed in words[1:]], "--global" in sys.argv)
