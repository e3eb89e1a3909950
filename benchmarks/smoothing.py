"""Filtered and smoothed states, and movements, against the truth.

``smoothing.py SCENE SEED...`` simulates a scene; ``smoothing.py DRIVE...`` takes folders that hold
``log.mcap``, ``truth.csv`` and ``building.urdf``, as ``benchmarks.independent --cache`` makes them.

A movement counts if it begins after a scan first bore on the object, ends before the last one did,
and leaves it at least 3 degrees or 5 cm from where it was; movements without a scan between them
are one. An event is right where it overlaps a movement.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from objstate.evaluation.states import (
    STANDING_NS,
    Coordinate,
    Posteriors,
    TrueCourse,
    compare,
    observed_posteriors,
    true_courses,
)
from objstate.evaluation.summary import ROTATIONS
from objstate.geometry import FloatArray, IntArray
from objstate.recording.events import Event, read_events
from objstate.recording.tables import read_states, read_truth
from objstate.run import RunOptions, estimate_log
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

LEAST = np.radians(3.0)  # rad or m, of a movement
ANGLE, LENGTH = np.radians(1.0), 0.01  # units of errors; sure and wrong: 5 off, and known to 10
HELD_S = 1.0  # s for which an estimate counts at most
SLACK_NS = 500_000_000  # ns by which an event may miss a movement
HEADER = (
    "| drive | state | of | estimates | mean error | median | in 90 % | sure and wrong "
    "| found | right |"
)


class Drive(NamedTuple):
    """A log with its truth."""

    name: str
    log: Path
    building: Path
    truth: Path


@dataclass
class Errors:
    """Of one coordinate in one table of a result, at all scans that bore on its objects."""

    coordinate: str
    errors: list[FloatArray] = field(default_factory=list)
    inside: list[FloatArray] = field(default_factory=list)
    wrong_s: float = 0.0
    seconds: float = 0.0

    def add(self, estimated: Posteriors, course: TrueCourse, symmetry: int) -> None:
        """Take in one object."""
        compared = compare(self.coordinate, estimated, course, symmetry=symmetry)
        known = course.period(estimated.stamps_ns) >= 0
        error, widths = np.abs(compared.errors), (estimated.uppers - estimated.lowers)[known]
        unit = ANGLE if self.coordinate in ROTATIONS else LENGTH
        sure = (error > 5.0 * unit) & ~compared.inside & (widths < 10.0 * unit)
        stamps = compared.stamps_ns
        held = np.minimum(np.diff(stamps, append=stamps[-1:]) / 1e9, HELD_S)
        self.errors.append(error / unit)
        self.inside.append(compared.inside.astype(float))
        self.wrong_s += float(held[sure].sum())
        self.seconds += float(held.sum())

    @property
    def cells(self) -> str:
        error, inside = np.concatenate(self.errors), np.concatenate(self.inside)
        unit = "deg" if self.coordinate in ROTATIONS else "cm"
        return (
            f"{len(error)} | {error.mean():.2f} {unit} | {np.median(error):.2f} {unit} | "
            f"{inside.mean():.1%} | {self.wrong_s / self.seconds:.2%}"
        )


def movements(courses: Sequence[TrueCourse], seen_ns: IntArray) -> Iterator[tuple[int, int]]:
    """From when to when (ns) an object that is seen at moments (n,) was moved, as far as that shows.

    It has the ``courses`` of its coordinates.
    """
    spans: list[list[int]] = []
    for change in np.unique(np.concatenate([course.stamps_ns[1:] for course in courses])).tolist():
        last = spans[-1][1] if spans else -STANDING_NS
        stood = change - last >= STANDING_NS
        if stood and ((seen_ns > last) & (seen_ns < change)).any():
            spans.append([change, change])
        elif spans:
            spans[-1][1] = change
    for begin, end in spans:
        moved = max(abs(course.value_at(end) - course.value_at(begin - 1)) for course in courses)
        if seen_ns[0] < begin and end < seen_ns[-1] and moved >= LEAST:
            yield begin, end


@dataclass(frozen=True)
class Told:
    """How many movements the events of a result list."""

    moved: int = 0  # movements
    found: int = 0  # of these
    listed: int = 0  # events
    right: int = 0  # of these

    def __add__(self, other: Told) -> Told:
        """Both together."""
        return Told(*map(sum, zip(astuple(self), astuple(other), strict=True)))

    @property
    def cells(self) -> str:
        return f"{self.found} of {self.moved} | {self.right} of {self.listed}"


def is_met(event: Event, span: tuple[int, int], seen_ns: IntArray) -> bool:
    """Whether an event of an object that is seen at moments (n,) tells of a movement."""
    before = seen_ns[max(np.searchsorted(seen_ns, event.from_ns, side="right") - 1, 0)]
    after = seen_ns[min(np.searchsorted(seen_ns, event.to_ns), len(seen_ns) - 1)]
    return bool(before - SLACK_NS <= span[1] and span[0] <= after + SLACK_NS)


def told_by(result: Path, truth: Mapping[Coordinate, TrueCourse]) -> Told:
    """How many movements the events in a result folder list, and how many of those are true."""
    events = {(each.object, each.from_ns): each for each in read_events(result)}
    observed = observed_posteriors(read_states(result, filtered=True))
    told = Told()
    for name in sorted({name for name, _ in observed} & {name for name, _ in truth}):
        own = [event for event in events.values() if event.object == name]
        courses = [course for (each, _), course in truth.items() if each == name]
        seen_ns = next(each.stamps_ns for (other, _), each in observed.items() if other == name)
        spans = list(movements(courses, seen_ns))
        changes = np.concatenate([course.stamps_ns[1:] for course in courses]).tolist()
        found = [any(is_met(event, span, seen_ns) for event in own) for span in spans]
        right = [any(is_met(event, (each, each), seen_ns) for each in changes) for event in own]
        told += Told(len(spans), sum(found), len(own), sum(right))
    return told


def rows(drive: Drive) -> Iterator[str]:
    """The rows of a drive in the table."""
    truth = true_courses(read_truth(drive.truth))
    with tempfile.TemporaryDirectory() as folder:
        run = estimate_log([drive.log], drive.building, Path(folder) / "out", RunOptions())
        told = told_by(run.folder, truth).cells
        for kind in sorted({kind for _, kind in truth}):
            for table in ("filtered", "smoothed"):
                errors = Errors(kind)
                estimates = read_states(run.folder, filtered=table == "filtered")
                for key, each in observed_posteriors(estimates.filter(coordinate=kind)).items():
                    if key in truth:
                        errors.add(each, truth[key], run.symmetry.get(key[0], 1))
                shown = told if table == "smoothed" else "|"
                yield f"| {drive.name} | {kind} | {table} | {errors.cells} | {shown} |"


def drives(arguments: Sequence[str], folder: Path) -> Iterator[Drive]:
    """The drives that were asked for; scenes are simulated into a folder."""
    if Path(arguments[0]).is_dir():
        for each in map(Path, arguments):
            name = f"{each.parent.name}, seed {each.name}"
            yield Drive(name, each / "log.mcap", each / "building.urdf", each / "truth.csv")
        return
    scene = Path(arguments[0])
    for seed in arguments[1:]:
        made = simulate(scene, folder / seed, seed=int(seed))
        name = f"{scene.name.partition('.')[0]}, seed {seed}"
        yield Drive(name, made.log, load_scene(scene).building, made.folder / "truth.csv")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Filtered and smoothed states against the truth.")
    parser.add_argument("arguments", nargs="+", metavar="SCENE SEED... | DRIVE...")
    print(f"{HEADER}\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for drive in drives(parser.parse_args().arguments, Path(folder)):
            for row in rows(drive):
                print(row, flush=True)
