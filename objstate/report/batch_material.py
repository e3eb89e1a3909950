"""What the report of a batch is made of: all logs in figures, some of them in pictures."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.building import load_building
from objstate.building.model import Building
from objstate.errors import ObjstateError
from objstate.order import natural_key
from objstate.recording.batches import BatchLog, Outcome, read_logs, read_summary_table, result_of
from objstate.recording.index import open_index, settled
from objstate.recording.parts import parts
from objstate.report.batch_part import (
    DoneLog,
    kind_of,
    packed,
    part_of,
    read_done,
    unpacked,
    without_waste,
)
from objstate.report.course import LOCALIZED_WELL
from objstate.report.coverage import Coverage, pooled
from objstate.report.judgement import Judged, Tally
from objstate.report.judgement import kind_of as judged_kind
from objstate.storage import building_here

if TYPE_CHECKING:
    import polars as pl

MOST_LISTED = 250  # logs that the page lists, the worst ones
MOST_DRAWN = 250  # logs whose states and paths are drawn, evenly spread
MOST_POOLED = 500  # logs whose errors the histograms show, evenly spread
MOST_DOUBTS = 20

Rank = tuple[float, int, float]  # the larger the worse


@dataclass(frozen=True)
class Line:
    """A log that is done, in a few figures."""

    log: BatchLog
    begin_ns: int
    seconds: float
    localized: float  # share of the time
    odometry: tuple[float, ...]  # as of DoneLog


@dataclass(eq=False)
class ObjectTally:
    """One coordinate of one object of a building, over all logs."""

    tally: Tally = field(default_factory=Tally)
    worst: tuple[str, Judged] | None = None  # by rank, with its log


@dataclass(frozen=True)
class Seen:
    """Where an object stood last, and before that."""

    stamp_ns: int
    value: float
    log: str


@dataclass(eq=False)
class BatchMaterial:
    """A batch, read as far as its report goes."""

    folder: Path
    outcomes: dict[str, Outcome]  # of every log, by name
    summary: pl.DataFrame  # summary.parquet
    buildings: dict[str, Building] = field(default_factory=dict)  # by address
    lines: list[Line] = field(default_factory=list)  # of all logs that are done
    listed: dict[str, DoneLog] = field(default_factory=dict)  # the worst ones
    drawn: list[DoneLog] = field(default_factory=list)
    tallies: dict[str, Tally] = field(default_factory=dict)  # of angles and places
    objects: dict[tuple[str, str, str], ObjectTally] = field(default_factory=dict)
    latest: dict[tuple[str, str, str], Seen] = field(default_factory=dict)
    coverages: list[Coverage] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)

    @property
    def rows(self) -> dict[str, dict[str, Any]]:
        """Of summary.parquet, those of the listed logs and of some that aren't done, by log."""
        import polars as pl

        names = [*self.listed, *(outcome.name for outcome in self.failed[:MOST_LISTED])]
        chosen = self.summary.filter(pl.col("log").is_in(names))
        return {row["log"]: row for row in chosen.iter_rows(named=True)}

    @property
    def failed(self) -> list[Outcome]:
        """How the logs ended that aren't done, by name."""
        found = [each for each in self.outcomes.values() if each.status != "done"]
        return sorted(found, key=lambda each: natural_key(each.name))


def read_batch(
    folder: str | Path, building: str | Path | None = None, *, filtered: bool = False
) -> BatchMaterial:
    """Read a batch; ``building`` replaces those that its logs name.

    A building or a truth that can't be read becomes a warning, and what needs it is left out.
    Raises ResultError for a folder that is no batch, and BuildingError for a ``building`` that
    can't be read.
    """
    folder = Path(folder)
    logs = {log.name: log for log in read_logs(folder)}
    with open_index(folder) as index:
        entries = settled(index, folder, logs.values())
        outcomes = {name: entry.outcome for name, entry in entries.items()}
        material = BatchMaterial(folder, outcomes, read_summary_table(folder))
        done = {name: log for name, log in logs.items() if outcomes[name].status == "done"}
        wanted = {n: part_of(result_of(folder, n), log, filtered) for n, log in done.items()}

        def made(name: str) -> bytes:
            return packed(read_done(result_of(folder, name), done[name], filtered))

        note = _noting(material, len(wanted))
        contents = parts(index, kind_of(filtered), wanted, made)
        for name, content in contents:
            note(unpacked(content, done[name]))
    material.coverages = pooled(material.coverages)
    material.lines.sort(key=lambda line: (line.begin_ns, natural_key(line.log.name)))
    material.drawn.sort(key=lambda log: natural_key(log.log.name))
    material.buildings = _buildings([log.building for log in done.values()], building, material)
    material.doubts = list(dict.fromkeys(material.doubts))[:MOST_DOUBTS]
    return material


def _noting(material: BatchMaterial, total: int) -> Callable[[DoneLog], None]:
    """What takes one log after the other into the material."""
    numbers = count()
    worst: list[tuple[Rank, int, DoneLog]] = []
    draw, pool = (max(1, -(-total // most)) for most in (MOST_DRAWN, MOST_POOLED))

    def note(log: DoneLog) -> None:
        number = next(numbers)
        name, course = log.log.name, log.course
        line = Line(log.log, log.begin_ns, course.seconds, course.localized, tuple(log.odometry))
        material.lines.append(line)
        material.doubts += log.doubts[: MOST_DOUBTS - len(material.doubts)]
        for each in log.verdicts:
            _judge(material, log.log, each)
        for state in log.latest:
            estimate = state.estimate
            key = (log.log.building, estimate.object, estimate.coordinate)
            if estimate.observed and (
                key not in material.latest or material.latest[key].stamp_ns < estimate.stamp_ns
            ):
                material.latest[key] = Seen(estimate.stamp_ns, estimate.value, name)
        if number % draw == 0:
            material.drawn.append(log)
        if number % pool == 0:
            material.coverages += log.coverages
        heapq.heappush(worst, (rank(log), -number, without_waste(log)))
        if len(worst) > MOST_LISTED:
            heapq.heappop(worst)
        if number + 1 == total:
            material.listed = {each.log.name: each for _, _, each in sorted(worst, reverse=True)}

    return note


def _judge(material: BatchMaterial, log: BatchLog, each: Judged) -> None:
    estimate = each.state.estimate
    label = f"{estimate.object} in {log.name}"
    material.tallies.setdefault(judged_kind(each), Tally()).add(label, each)
    key = (log.building, estimate.object, estimate.coordinate)
    own = material.objects.setdefault(key, ObjectTally())
    own.tally.add(log.name, each)
    if own.worst is None or each.rank > own.worst[1].rank:
        own.worst = (log.name, each)


def rank(log: DoneLog) -> Rank:
    """The worst is the largest: those lost for long, then those with wrong states."""
    share = log.course.localized
    worst = max((each.rank for each in log.verdicts), default=(0, 0.0))
    return (0.0 if share >= LOCALIZED_WELL else 1.0 - share, *worst)


def _buildings(
    addresses: list[str], instead: str | Path | None, material: BatchMaterial
) -> dict[str, Building]:
    """The buildings by address; those that can't be read are left out."""
    if instead is not None:
        model = load_building(Path(instead))
        return dict.fromkeys(addresses, model)
    found = {}
    for address in dict.fromkeys(addresses):
        try:
            found[address] = load_building(building_here(address))
        except ObjstateError as error:
            material.doubts.append(
                f"{error} Its plan is left out; say with --building where it is."
            )
    return found
