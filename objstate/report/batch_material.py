"""What the report of a batch is made of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from objstate.building import load_building
from objstate.building.model import Building
from objstate.errors import ObjstateError
from objstate.evaluation import LatestState, latest_states, read_lost
from objstate.recording.batches import (
    BatchLog,
    Outcome,
    read_logs,
    read_summary_table,
    result_of,
)
from objstate.recording.index import read_outcomes
from objstate.recording.summary import read_summary
from objstate.recording.tables import read_states, read_truth
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.report.course import Course
from objstate.report.coverage import Coverage, coverages
from objstate.report.judgement import Judged, judged


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


@dataclass(frozen=True, eq=False)
class BatchMaterial:
    """A batch, read as far as its report goes."""

    folder: Path
    outcomes: list[Outcome]
    rows: dict[str, dict[str, Any]]  # of summary.parquet, by log
    done: list[DoneLog]
    buildings: dict[str, Building]  # by address
    doubts: tuple[str, ...] = ()


def read_batch(
    folder: str | Path, building: str | Path | None = None, *, filtered: bool = False
) -> BatchMaterial:
    """Read a batch; ``building`` is taken instead of those that its logs name.

    A building or a truth that can't be read is a doubt, and what needs it is left out.
    Raises ResultError for a folder that is no batch, and BuildingError for a ``building``
    that can't be read.
    """
    folder, doubts = Path(folder), list[str]()
    logs = read_logs(folder)
    known = read_outcomes(folder, logs)
    outcomes = [known[log.name] for log in logs]
    finished = [
        log for log, outcome in zip(logs, outcomes, strict=True) if outcome.status == "done"
    ]
    return BatchMaterial(
        folder=folder,
        outcomes=outcomes,
        rows={row["log"]: row for row in read_summary_table(folder).iter_rows(named=True)},
        done=[_read_done(folder, log, doubts, filtered) for log in finished],
        buildings=_buildings([log.building for log in finished], building, doubts),
        doubts=tuple(dict.fromkeys(doubts)),
    )


def _read_done(folder: Path, log: BatchLog, doubts: list[str], filtered: bool) -> DoneLog:
    result = result_of(folder, log.name)
    summary, lost = read_summary(result), read_lost(result)
    estimates = read_states(result, filtered=filtered)
    truth = None
    if log.truth is not None:
        try:
            truth = read_truth(log.truth)
        except ObjstateError as error:
            doubts.append(str(error))
    begin_ns, symmetry = int(summary["begin_ns"]), dict(summary.get("symmetry", {}))
    latest = latest_states(estimates, truth or (), lost, symmetry)
    searching = bool(summary["options"].get("global_start")) and len(lost) > 0
    seconds = float(summary["timings"]["log_seconds"])
    return DoneLog(
        log=log,
        begin_ns=begin_ns,
        laser_height=min(map(float, summary["laser_heights"].values())),
        latest=latest,
        verdicts=judged(latest, symmetry),
        course=Course(read_tum(result / TRAJECTORY), lost, searching, begin_ns, seconds),
        coverages=coverages(estimates, truth or (), lost, symmetry),
    )


def _buildings(
    addresses: list[str], instead: str | Path | None, doubts: list[str]
) -> dict[str, Building]:
    """The buildings by address; those that can't be read are left out."""
    if instead is not None:
        model = load_building(Path(instead))
        return dict.fromkeys(addresses, model)
    found = {}
    for address in dict.fromkeys(addresses):
        try:
            found[address] = load_building(Path(address))
        except ObjstateError as error:
            doubts.append(f"{error} Its plan is left out; say with --building where it is.")
    return found
