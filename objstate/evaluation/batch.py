"""A batch against the truth: errors by condition, calibration, and against another batch."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.building import load_building
from objstate.building.model import Building
from objstate.errors import BuildingError, LogError, ResultError, TruthError
from objstate.evaluation.breakdown import ALL, Group, groups, parts_of
from objstate.evaluation.calibration import Calibration, calibrations
from objstate.evaluation.conditions import conditions, no_conditions
from objstate.evaluation.judged import judge
from objstate.evaluation.lost import read_lost
from objstate.evaluation.movements import MovementErrors, movement_errors
from objstate.evaluation.paired import Difference, differences
from objstate.evaluation.states import true_courses
from objstate.evaluation.summary import StateErrors, summarize_states, unit_of
from objstate.evaluation.sums import Finals, Sums, Totals, packed, sums_of, unpacked
from objstate.recording.batches import BatchLog, is_batch, read_logs, result_of
from objstate.recording.events import read_events
from objstate.recording.index import BatchIndex, open_index, settled
from objstate.recording.parts import OnLog, Part, file_state, parts, states_state, truth_state
from objstate.recording.summary import read_summary
from objstate.recording.tables import check_truth_times, read_states, read_truth, unknown_names
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import TrueState
from objstate.storage import building_here, here

if TYPE_CHECKING:
    import polars as pl

FORM = 3  # of the sums that are kept


@dataclass(frozen=True)
class Overall:
    """The errors of one kind of coordinate over all logs."""

    coordinate: str
    unit: str  # rad or m
    updates: StateErrors | None
    final: StateErrors | None


@dataclass(frozen=True)
class BatchEvaluation:
    """How well the estimates of many logs agree with their truths."""

    logs: int  # with a result and a truth
    without_truth: tuple[str, ...]
    without_result: tuple[str, ...]
    notes: tuple[str, ...]  # what could not be evaluated of which log, and why
    overall: tuple[Overall, ...]
    groups: tuple[Group, ...]  # at the updates, by condition
    calibration: tuple[Calibration, ...]  # of the final estimates
    against: tuple[Difference, ...]  # empty without another result
    movements: MovementErrors | None = None  # of all logs; None where there are none

    def to_dict(self) -> dict[str, Any]:
        """The same as plain dictionaries and lists, for JSON; rad, m and s."""
        return asdict(self)


def evaluate_batch(
    folder: str | Path,
    truth: str | Path | None = None,
    against: str | Path | None = None,
    on_log: OnLog | None = None,
    *,
    filtered: bool = False,
) -> BatchEvaluation:
    """Compare a batch, or one result, with its truth; and with another one of the same logs.

    Of a batch, each log's own truth is taken; ``truth`` (CSV) serves those without one. The states
    are those given the whole log, or with ``filtered`` those that the robot would have known then.
    Raises ResultError, and TruthError where no log has a truth.
    """
    logs = _logs(folder, truth)
    totals = Totals()
    with _opened(folder) as index:
        results = _results(folder, index, logs)
        left = {log.name: log for log in logs if log.truth is not None and log.name in results}
        if not left:
            raise TruthError(f"No log of {folder} has both a result and a truth; give --truth.")
        wanted = {n: _part(results[n], log, filtered) for n, log in left.items()}

        def made(name: str) -> bytes:
            return packed(judged_sums(results[name], left[name], filtered=filtered))

        for name, content in parts(index, kind_of(filtered), wanted, made, on_log):
            totals.add(name, unpacked(content, f"What is kept of {name}"))
    finals = totals.finals()
    overall = _overall(totals, finals)
    if not overall:
        raise TruthError(f"The truth has none of the objects in {folder}.")
    return BatchEvaluation(
        logs=len(left),
        without_truth=tuple(log.name for log in logs if log.truth is None),
        without_result=tuple(log.name for log in logs if log.name not in results),
        notes=tuple(sorted(totals.notes)),
        overall=overall,
        groups=groups(totals),
        calibration=calibrations(finals),
        against=() if against is None else _against(finals, against, left, results, filtered),
        movements=totals.movements,
    )


def kind_of(filtered: bool) -> str:
    """Under which the sums of a log are kept."""
    return "errors, filtered" if filtered else "errors"


def _part(result: Path, log: BatchLog, filtered: bool) -> Part:
    return Part(log.name, result, stamp_of(result, log, filtered))


def stamp_of(result: Path, log: BatchLog, filtered: bool) -> str:
    """What changes when the sums of a log do."""
    made_of = [states_state(result, filtered), file_state(log.log), _building_state(log.building)]
    return json.dumps([FORM, truth_state(log), *made_of])


@cache
def _building_state(address: str) -> list[object]:
    return file_state(address)


@contextmanager
def _opened(folder: str | Path) -> Iterator[BatchIndex | None]:
    """The index of a batch; None of a plain result."""
    if not is_batch(folder):
        yield None
        return
    with open_index(folder) as index:
        yield index


def _logs(folder: str | Path, truth: str | Path | None) -> list[BatchLog]:
    """The logs of a batch, or the one of a result folder, with truths."""
    spare = None if truth is None else str(truth)
    if not is_batch(folder):
        inputs = read_summary(folder)["inputs"]
        return [BatchLog("", inputs["logs"][0]["path"], inputs["building"]["path"], spare)]
    return [
        BatchLog(log.name, log.log, log.building, log.truth or spare, log.path)
        for log in read_logs(folder)
    ]


def _results(
    folder: str | Path, index: BatchIndex | None, logs: Sequence[BatchLog]
) -> dict[str, Path]:
    """Where the results of logs are, those that are there, by name."""
    if index is None:
        return {log.name: Path(folder) for log in logs}
    entries = settled(index, Path(folder), read_logs(folder))
    done = {name for name, entry in entries.items() if entry.outcome.status == "done"}
    return {log.name: result_of(folder, log.name) for log in logs if log.name in done}


def _digests(result: Path) -> list[str]:
    """Of the log's files that a result was made of."""
    return sorted(file["sha256"] for file in read_summary(result)["inputs"]["logs"])


def _truth(log: BatchLog) -> list[TrueState]:
    """The truth of a log; empty where there is none."""
    return [] if log.truth is None else read_truth(here(log.truth))


def _plain(result: Path, log: BatchLog, truth: Sequence[TrueState], filtered: bool) -> pl.DataFrame:
    """The judged estimates of one log, without conditions."""
    import polars as pl

    if log.truth is None:
        return pl.DataFrame()
    estimates = read_states(result, filtered=filtered)
    if len(estimates):
        stamps = estimates["stamp"].to_numpy()
        check_truth_times(truth, int(stamps.min()), int(stamps.max()), log.truth)
    return judge(estimates, true_courses(truth), read_lost(result))


def judged_sums(
    result: Path, log: BatchLog, building: Building | None = None, *, filtered: bool = False
) -> Sums:
    """One log's part of its batch's errors; ``building`` is that of the log, where known."""
    notes: list[str] = []
    judged = _judged(result, log, building, notes, filtered)
    movements = None if filtered else _movements(result, log)
    return sums_of(parts_of(judged), judged, notes, movements)


def _movements(result: Path, log: BatchLog) -> MovementErrors | None:
    courses = true_courses(_truth(log))
    errors = movement_errors(read_events(result), read_states(result), courses)
    return errors[-1] if errors else None


def _judged(
    result: Path, log: BatchLog, building: Building | None, notes: list[str], filtered: bool
) -> pl.DataFrame:
    """The judged estimates of one log with the conditions they were made under."""
    truth = _truth(log)
    plain = _plain(result, log, truth, filtered)
    if truth:
        notes.extend(unknown_names(truth, read_summary(result)["objects"]))
    if plain.is_empty():
        return plain
    known = no_conditions()
    try:
        model, path = building or _building(log.building), read_tum(result / TRAJECTORY)
        try:
            known = conditions(plain, model, path, _reachable(log.log))
        except LogError as error:
            notes.append(f"beams aren't counted. {error}")
            known = conditions(plain, model, path, None)
    except BuildingError as error:
        notes.append(f"nothing by class, distance or incidence. {error}")
    return plain.join(known, on=["stamp", "object"], how="left", maintain_order="left")


def _reachable(log: str) -> Path:
    if "://" in log:
        raise LogError(f"{log} isn't on this machine.")
    return Path(log)


@cache
def _building(address: str) -> Building:
    return load_building(building_here(address))


def _overall(totals: Totals, finals: pl.DataFrame) -> tuple[Overall, ...]:
    updates = {key[2]: errors for key, errors in totals.errors() if key[0] == ALL}
    last = {
        coordinate: summarize_states(
            coordinate, part["error"].to_numpy(), part["inside"].to_numpy()
        )
        for (coordinate,), part in finals.partition_by("coordinate", as_dict=True).items()
    }
    return tuple(
        Overall(name, unit_of(name), updates.get(name), last.get(name))
        for name in sorted({*updates, *last})
    )


def _against(
    finals: pl.DataFrame,
    other: str | Path,
    logs: Mapping[str, BatchLog],
    own: Mapping[str, Path],
    filtered: bool,
) -> tuple[Difference, ...]:
    """Both by the truths of the first, whose results are its ``own``. Raises ResultError."""
    found = Finals()
    with _opened(other) as index:
        results = _results(other, index, list(logs.values()))
        if not results:
            raise ResultError(
                f"{other} has no result of a log with one of the same names; compare a batch with a "
                "batch of the same logs, or one result with one, such as logs/NAME of a batch."
            )
        for name, result in results.items():
            if _digests(result) != _digests(own[name]):
                raise ResultError(
                    f"{result} is not of the log of {own[name]}; compare results of the same logs."
                )
        wanted = {n: _part(result, logs[n], filtered) for n, result in results.items()}
        kept = {} if index is None else index.stamps(kind_of(filtered))
        same = {n: part for n, part in wanted.items() if kept.get(n) == part.stamp}
        for name, content in parts(index, kind_of(filtered), same, lambda _: b""):
            found.add(name, unpacked(content, f"What is kept of {name}"))
    for name in wanted.keys() - same.keys():  # not kept: their conditions weren't asked for
        judged = _plain(results[name], logs[name], _truth(logs[name]), filtered)
        found.add(name, sums_of({}, judged, ()))
    return differences(finals, found.table())
