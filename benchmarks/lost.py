"""Lost and found on simulated drives: ``python benchmarks/lost.py [OPTION] SCENE SEED...``

Prints a row for each time that the robot is carried elsewhere: after how many seconds it says that
it is lost, after how many it is found within 0.3 m and 10 degrees, and the mean error of its pose
from then on. A row over all drives follows: how often lost was said within 2 s and the robot found
within 10 s; in how many drives it was said to be lost without having been carried, and for how
long; and what became of the objects. An object is corrupted when an estimate that was not taken
back is sure (2 degrees, 2 cm) and wrong (5 degrees, 5 cm). With ``--global`` the robot has to
find itself at the drive's start. With ``--misplaced`` the start that it is given is a wrong one, at
random from its path, and counts as the first time that it is carried elsewhere.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from objstate.building import load_building
from objstate.building.model import Building, Kind
from objstate.estimator import Estimator
from objstate.evaluation.states import Coordinate, TrueCourse, error, true_courses
from objstate.geometry import wrap
from objstate.logs import open_log
from objstate.recording.tables import read_truth
from objstate.recording.tum import read_tum
from objstate.records import Estimate, InitialPose, Record, Scan
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

MISPLACED = 1.5  # m from where the robot starts, at least, of a wrong start
CARRIED = 0.5  # m between two scans that no robot drives
NEAR_M, NEAR_RAD = 0.3, np.radians(10.0)
SURE_M, SURE_RAD = 0.02, np.radians(2.0)
WRONG_M, WRONG_RAD = 0.05, np.radians(5.0)
SAY_S, FIND_S = 2.0, 10.0


@dataclass
class Stretch:
    """From one kidnapping, or the start, to the next."""

    since_s: float
    is_kidnapped: bool
    times_lost: int = 0  # before
    said_s: float | None = None
    found_s: float | None = None
    errors: list[float] = field(default_factory=list)  # m, since found
    wrongly: float = 0.0  # s in which it claimed to be found, but was elsewhere
    falsely: float = 0.0  # s in which it was said to be lost, but was not


@dataclass
class Outcome:
    """How one drive came out."""

    stretches: list[Stretch]
    corrupted: list[str]  # names of objects
    objects: int
    degrees: list[float]  # final errors of doors
    metres: list[float]  # of furniture
    log_s: float
    spent_s: float


def study(scene: Path, seeds: list[int], anywhere: bool, misplaced: bool) -> None:
    """Simulate and estimate a scene for each seed; print a Markdown table."""
    print("| seed | carried at | lost said after | found after | robot | sure of a wrong place |")
    print("| --- | --- | --- | --- | --- | --- |")
    outcomes = []
    for seed in seeds:
        outcomes.append(drive(scene, seed, anywhere, misplaced))
        for each in outcomes[-1].stretches:
            print_row(seed, each)
    print_all(outcomes)


def drive(scene: Path, seed: int, anywhere: bool, misplaced: bool) -> Outcome:
    """One drive, estimated."""
    with tempfile.TemporaryDirectory() as folder:
        simulated = simulate(scene, Path(folder) / "drive", seed=seed)
        path = read_tum(simulated.folder / "path.tum")
        courses = true_courses(read_truth(simulated.folder / "truth.csv"))
        building = load_building(load_scene(scene).building)
        estimator = Estimator(building, seed=seed, global_start=anywhere)
        true = dict(zip(path.stamps_ns.tolist(), path.poses, strict=True))
        begin, last, before = int(path.stamps_ns[0]), None, 0.0
        stretches, rows = [Stretch(0.0, anywhere or misplaced)], []
        began = time.process_time()
        wrong = misplaced_start(path.poses, seed) if misplaced else None
        for record in map(partial(starting, mean=wrong), open_log(simulated.log)):
            times_lost = len(estimator.lost)
            rows += [row for row in estimator.feed(record) if row.observed and not row.lost]
            if not isinstance(record, Scan) or record.stamp_ns not in true:
                continue
            now, pose = (record.stamp_ns - begin) / 1e9, true[record.stamp_ns]
            if last is not None and np.hypot(*(pose - last)[:2]) > CARRIED:
                stretches.append(Stretch(now, True, times_lost))
            took, last, before = now - before, pose, now
            note(stretches[-1], estimator, pose, now, took)
        spent = time.process_time() - began
    kept = [
        row
        for row in rows
        if (row.object, row.coordinate) in courses
        and not any(since <= row.stamp_ns < found for since, found in estimator.lost)
    ]
    doors, furniture = finals(kept, courses, building)
    return Outcome(
        stretches, corrupted(kept, courses, building), len(building.objects), doors, furniture,
        before, spent,
    )  # fmt: skip


def misplaced_start(path: np.ndarray, seed: int) -> np.ndarray:
    """A pose (3,) of a path (n, 3) that isn't near its first one, in either direction."""
    rng = np.random.default_rng([seed, 7])
    far = path[np.hypot(*(path - path[0])[:, :2].T) > MISPLACED]
    pose = far[rng.integers(len(far))]
    return np.array([*pose[:2], pose[2] + np.pi * rng.integers(2)])


def starting(record: Record, mean: np.ndarray | None) -> Record:
    """A record, as a start with another pose (3,), if there is one."""
    is_start = mean is not None and isinstance(record, InitialPose)
    return replace(record, mean=mean) if is_start else record


def off(row: Estimate, courses: Mapping[Coordinate, TrueCourse], building: Building) -> float:
    """Distance from the truth, m or rad."""
    item, truth = building[row.object], courses[row.object, row.coordinate].value_at(row.stamp_ns)
    order = item.symmetry.order if item.kind is Kind.PLANAR else 1
    return abs(float(error(row.coordinate, np.array(row.mean), np.array(truth), order)))


def corrupted(
    rows: list[Estimate], courses: Mapping[Coordinate, TrueCourse], building: Building
) -> list[str]:
    """The objects of which something wrong was surely believed."""
    found = set()
    for row in rows:
        is_turn = row.coordinate in ("angle", "yaw")
        sure, wrong = (SURE_RAD, WRONG_RAD) if is_turn else (SURE_M, WRONG_M)
        if row.std <= sure and off(row, courses, building) > wrong:
            found.add(row.object)
    return sorted(found)


def finals(
    rows: list[Estimate], courses: Mapping[Coordinate, TrueCourse], building: Building
) -> tuple[list[float], list[float]]:
    """Errors of the last estimates: of doors in degrees, of furniture's places in metres."""
    last = {(row.object, row.coordinate): row for row in rows}
    errors = {key: off(row, courses, building) for key, row in last.items()}
    doors = [float(np.degrees(each)) for (_, of), each in errors.items() if of == "angle"]
    furniture = [
        float(np.hypot(each, errors[name, "y"])) for (name, of), each in errors.items() if of == "x"
    ]
    return doors, furniture


def note(stretch: Stretch, estimator: Estimator, pose: np.ndarray, now: float, took: float) -> None:
    """What a scan adds to a stretch."""
    robot = estimator.robot
    if robot is None:
        return
    away = robot.mean - pose
    distance = float(np.hypot(*away[:2]))
    near = distance < NEAR_M and abs(float(wrap(away[2]))) < NEAR_RAD
    is_due = stretch.is_kidnapped and stretch.found_s is None
    if is_due and stretch.said_s is None and len(estimator.lost) > stretch.times_lost:
        stretch.said_s = now - stretch.since_s
    if estimator.is_lost:
        stretch.falsely += 0.0 if is_due else took
        return
    if near and stretch.found_s is None:
        stretch.found_s = now - stretch.since_s
    if near or stretch.found_s is not None:
        stretch.errors.append(distance)
    if not near and stretch.said_s is not None:
        stretch.wrongly += took


def print_row(seed: int, each: Stretch) -> None:
    """One row of the table."""
    said, found = (f"{t:.1f} s" if t is not None else "-" for t in (each.said_s, each.found_s))
    robot = f"{100 * np.mean(each.errors):.1f} cm" if each.errors else "-"
    print(
        f"| {seed} | {each.since_s:.0f} s | {said} | {found} | {robot} | {each.wrongly:.1f} s |",
        flush=True,
    )


def print_all(outcomes: list[Outcome]) -> None:
    """What came of all drives together."""
    stretches = [each for outcome in outcomes for each in outcome.stretches]
    carried = [each for each in stretches if each.is_kidnapped]
    said, found = (
        np.array([np.inf if t is None else t for t in times])
        for times in ([e.said_s for e in carried], [e.found_s for e in carried])
    )
    alarmed = sum(any(each.falsely for each in outcome.stretches) for outcome in outcomes)
    wrongly = [each.wrongly for each in stretches]
    falsely = sum(each.falsely for each in stretches)
    log, spent = (sum(getattr(each, of) for each in outcomes) for of in ("log_s", "spent_s"))
    if carried:
        print(
            f"\ncarried {len(carried)} times: lost said within {SAY_S:.0f} s in "
            f"{np.mean(said <= SAY_S):.0%} (median {np.median(said):.1f} s, largest {said.max():.1f} "
            f"s), found within {FIND_S:.0f} s in {np.mean(found <= FIND_S):.0%} (median "
            f"{np.median(found):.1f} s, largest {found.max():.1f} s); sure of a wrong place "
            f"{np.count_nonzero(wrongly)} times, {sum(wrongly):.1f} s"
        )
    print(f"false alarms in {alarmed} of {len(outcomes)} drives, {falsely:.1f} s of {log:.0f} s")
    names = [f"{name} ({k})" for k, each in enumerate(outcomes, 1) for name in each.corrupted]
    objects = sum(each.objects for each in outcomes)
    print(f"corrupted {len(names)} of {objects} objects {', '.join(names)}")
    for words, unit, of in (("doors", "deg", "degrees"), ("furniture", "m", "metres")):
        errors = [value for each in outcomes for value in getattr(each, of)]
        if errors:
            print(
                f"{words}: final error mean {np.mean(errors):.3f} {unit}, largest {max(errors):.3f}"
            )
    print(f"{log:.0f} s in {spent:.0f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("scene", type=Path)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--global", dest="anywhere", action="store_true")
    parser.add_argument("--misplaced", action="store_true")
    arguments = parser.parse_args()
    study(arguments.scene, arguments.seeds, arguments.anywhere, arguments.misplaced)
