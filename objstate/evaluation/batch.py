"""A batch against the truth: errors by condition, calibration, and against another batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.building import load_building
from objstate.errors import BuildingError, LogError, TruthError
from objstate.evaluation.breakdown import Group, groups
from objstate.evaluation.calibration import Calibration, calibrations
from objstate.evaluation.conditions import conditions, no_conditions
from objstate.evaluation.judged import judge
from objstate.evaluation.lost import read_lost
from objstate.evaluation.paired import Difference, differences
from objstate.evaluation.states import true_courses
from objstate.evaluation.summary import StateErrors, summarize_states, unit_of
from objstate.recording.batches import BatchLog, is_batch, read_logs, result_of
from objstate.recording.index import read_outcomes
from objstate.recording.summary import read_summary
from objstate.recording.tables import check_truth_times, read_states, read_truth
from objstate.recording.tum import TRAJECTORY, read_tum

if TYPE_CHECKING:
    import polars as pl

OnLog = Callable[[int, int], None]  # logs done, of how many


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
    notes: tuple[str, ...]  # what could not be told of which log, and why
    overall: tuple[Overall, ...]
    groups: tuple[Group, ...]  # at the updates, by condition
    calibration: tuple[Calibration, ...]  # of the final estimates
    against: tuple[Difference, ...]  # empty without another result

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
    import polars as pl

    logs = _logs(folder, truth)
    results = _results(folder, logs)
    judged: list[pl.DataFrame] = []
    notes: list[str] = []
    left = [log for log in logs if log.truth is not None and log.name in results]
    if not left:
        raise TruthError(f"No log of {folder} has both a result and a truth; give --truth.")
    for number, log in enumerate(left):
        judged.append(_judged(results[log.name], log, notes, filtered))
        if on_log is not None:
            on_log(number + 1, len(left))
    whole = pl.concat(judged, how="diagonal")
    if whole.is_empty():
        raise TruthError(f"The truth tells nothing of the objects in {folder}.")
    return BatchEvaluation(
        logs=len(left),
        without_truth=tuple(log.name for log in logs if log.truth is None),
        without_result=tuple(log.name for log in logs if log.name not in results),
        notes=tuple(notes),
        overall=_overall(whole),
        groups=groups(whole),
        calibration=calibrations(whole),
        against=() if against is None else _against(whole, against, left, filtered),
    )


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


def _results(folder: str | Path, logs: Sequence[BatchLog]) -> dict[str, Path]:
    """Where the results of logs are, those that are there, by name."""
    if not is_batch(folder):
        return {log.name: Path(folder) for log in logs}
    outcomes = read_outcomes(folder, read_logs(folder))
    done = {name for name, outcome in outcomes.items() if outcome.status == "done"}
    return {log.name: result_of(folder, log.name) for log in logs if log.name in done}


def _plain(result: Path, log: BatchLog, filtered: bool) -> pl.DataFrame:
    """The judged estimates of one log, without conditions."""
    import polars as pl

    if log.truth is None:
        return pl.DataFrame()
    truth, estimates = read_truth(log.truth), read_states(result, filtered=filtered)
    if len(estimates):
        stamps = estimates["stamp"].to_numpy()
        check_truth_times(truth, int(stamps.min()), int(stamps.max()), log.truth)
    judged = judge(estimates, true_courses(truth), read_lost(result))
    return judged.with_columns(log=pl.lit(log.name)) if len(judged) else judged


def _judged(result: Path, log: BatchLog, notes: list[str], filtered: bool) -> pl.DataFrame:
    """The judged estimates of one log with the conditions they were made under."""
    plain = _plain(result, log, filtered)
    if plain.is_empty():
        return plain
    known = no_conditions()
    try:
        building, path = _building(log.building), read_tum(result / TRAJECTORY)
        try:
            known = conditions(plain, building, path, _reachable(log.log))
        except LogError as error:
            notes.append(f"{log.name}: beams aren't counted. {error}")
            known = conditions(plain, building, path, None)
    except BuildingError as error:
        notes.append(f"{log.name}: nothing by class, distance or incidence. {error}")
    return plain.join(known, on=["stamp", "object"], how="left", maintain_order="left")


def _reachable(log: str) -> Path:
    if "://" in log:
        raise LogError(f"{log} isn't on this machine.")
    return Path(log)


@cache
def _building(address: str) -> Any:
    return load_building(Path(address))


def _overall(judged: pl.DataFrame) -> tuple[Overall, ...]:
    parts = sorted(judged.partition_by("coordinate", as_dict=True).items())
    return tuple(
        Overall(
            coordinate,
            unit_of(coordinate),
            _summary(coordinate, part.filter("observed")),
            _summary(coordinate, part.filter("final")),
        )
        for (coordinate,), part in parts
    )


def _summary(coordinate: str, part: pl.DataFrame) -> StateErrors | None:
    return summarize_states(coordinate, part["error"].to_numpy(), part["inside"].to_numpy())


def _against(
    this: pl.DataFrame, other: str | Path, logs: Sequence[BatchLog], filtered: bool
) -> tuple[Difference, ...]:
    """Both by the truths of the first."""
    import polars as pl

    results = _results(other, logs)
    judged = [_plain(results[log.name], log, filtered) for log in logs if log.name in results]
    return differences(this, pl.concat([this.clear(), *judged], how="diagonal"))
