"""What the report of a batch needs of one log, as bytes that are kept."""

from __future__ import annotations

import json
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np

from objstate.errors import ObjstateError
from objstate.evaluation import LatestState, latest_states, read_lost
from objstate.geometry import FloatArray
from objstate.packing import pack, unpack
from objstate.recording.batches import BatchLog
from objstate.recording.parts import Part, states_state, truth_state
from objstate.recording.summary import read_summary
from objstate.recording.tables import read_states, read_truth
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import Estimate
from objstate.records import Path as RobotPath
from objstate.report.course import Course
from objstate.report.coverage import LEVELS, Coverage, coverages
from objstate.report.judgement import Judged, judged
from objstate.storage import here

FORM = 1  # of what is kept
MOST_POSES = 100  # of a path
MOST_ERRORS = 200  # of a kind, evenly spread, that the histogram shows
NO_ODOMETRY = np.full(3, np.nan)


@dataclass(frozen=True, eq=False)
class DoneLog:
    """The result of one log, as far as the report of a batch shows it."""

    log: BatchLog
    begin_ns: int
    laser_height: float  # m
    latest: list[LatestState]
    verdicts: list[Judged]
    course: Course
    coverages: list[Coverage]
    odometry: FloatArray  # (3,) errors of measured m ahead, rad sideways and rad of turns; nan
    doubts: tuple[str, ...] = ()


def part_of(result: Path, log: BatchLog, filtered: bool) -> Part:
    """Its version."""
    stamp = json.dumps([FORM, truth_state(log), states_state(result, filtered)])
    return Part(log.name, result, stamp)


def kind_of(filtered: bool) -> str:
    """Under which it is kept."""
    return "report, filtered" if filtered else "report"


def packed(done: DoneLog) -> bytes:
    """A log as bytes; its path in steps, and of its errors some."""
    step = -(-len(done.course.path.stamps_ns) // MOST_POSES) or 1
    inside = {id(each.state): each.inside for each in done.verdicts}
    words = {
        "begin_ns": done.begin_ns,
        "height": done.laser_height,
        "latest": [
            [*astuple(each.estimate), each.truth, each.error, inside.get(id(each))]
            for each in done.latest
        ],
        "lost": list(done.course.lost),
        "searching": done.course.searching,
        "seconds": done.course.seconds,
        "coverages": [[each.kind, each.count] for each in done.coverages],
        "doubts": done.doubts,
    }
    arrays = {
        "stamps": done.course.path.stamps_ns[::step],
        "poses": done.course.path.poses[::step].astype("<f4"),
        "odometry": done.odometry,
    }
    for number, each in enumerate(done.coverages):
        arrays[f"held {number}"] = each.held
        arrays[f"errors {number}"] = each.errors[:: -(-len(each.errors) // MOST_ERRORS) or 1]
    return pack(words, arrays)


def unpacked(content: bytes, log: BatchLog) -> DoneLog:
    """The log that was packed. Raises WorldError for damage."""
    words, arrays = unpack(content, f"What is kept of {log.name}")
    latest, verdicts = [], []
    for *row, truth, error, inside in words["latest"]:
        state = LatestState(Estimate(*row), truth, error)
        latest.append(state)
        if inside is not None:
            verdicts.append(Judged(state, inside))
    path = RobotPath(arrays["stamps"], arrays["poses"].astype(float))
    lost = [(int(since), int(found)) for since, found in words["lost"]]
    begin_ns, seconds = int(words["begin_ns"]), float(words["seconds"])
    return DoneLog(
        log=log,
        begin_ns=begin_ns,
        laser_height=float(words["height"]),
        latest=latest,
        verdicts=verdicts,
        course=Course(path, lost, bool(words["searching"]), begin_ns, seconds),
        coverages=[
            Coverage(kind, count, arrays[f"errors {n}"], LEVELS, arrays[f"held {n}"])
            for n, (kind, count) in enumerate(words["coverages"])
        ],
        odometry=arrays["odometry"],
        doubts=tuple(words["doubts"]),
    )


def read_done(result: Path, log: BatchLog, filtered: bool) -> DoneLog:
    """A log by its result. Raises ResultError; an unreadable truth becomes a warning."""
    summary, lost = read_summary(result), read_lost(result)
    estimates = read_states(result, filtered=filtered)
    truth, doubts = None, list[str]()
    if log.truth is not None:
        try:
            truth = read_truth(here(log.truth))
        except ObjstateError as error:
            doubts.append(str(error))
    begin_ns, symmetry = int(summary["begin_ns"]), dict(summary.get("symmetry", {}))
    latest = latest_states(estimates, truth or (), lost, symmetry)
    searching = bool(summary["options"].get("global_start")) and len(lost) > 0
    seconds = float(summary["timings"]["log_seconds"])
    systematic = summary.get("odometry_error", {}).get("systematic")
    return DoneLog(
        log=log,
        begin_ns=begin_ns,
        laser_height=min(map(float, summary["laser_heights"].values())),
        latest=latest,
        verdicts=judged(latest, symmetry),
        course=Course(read_tum(result / TRAJECTORY), lost, searching, begin_ns, seconds),
        coverages=coverages(estimates, truth or (), lost, symmetry),
        odometry=NO_ODOMETRY if systematic is None else _systematic(systematic),
        doubts=tuple(doubts),
    )


def _systematic(matrix: list[list[float]]) -> FloatArray:
    """(3,) for a metre ahead: m ahead and, as an angle, m to the side; for a radian turned: rad."""
    return np.array([matrix[0][0], matrix[1][0], matrix[2][2]])


def without_waste(done: DoneLog) -> DoneLog:
    """The log without what only pictures of it need."""
    nothing = RobotPath(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    return replace(done, coverages=[], course=replace(done.course, path=nothing))
