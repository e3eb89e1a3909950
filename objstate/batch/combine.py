"""The tables over all logs of a batch, made from the folder's files alone.

So they are the same bytes wherever, in what order and on how many workers the logs were
run. Timings, which never are the same, stand in a table of their own.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.batch.partitions import link_tables, unlink_tables
from objstate.errors import ObjstateError
from objstate.evaluation import Evaluation, evaluate
from objstate.outputs import whole
from objstate.recording.batches import (
    SUMMARY_TABLE,
    TIMINGS_TABLE,
    BatchLog,
    Outcome,
    read_logs,
    result_of,
    summary_schema,
    timings_schema,
)
from objstate.recording.index import BatchIndex, Entry, open_index, settled
from objstate.recording.parts import truth_state
from objstate.recording.summary import read_summary
from objstate.recording.tables import read_estimates

if TYPE_CHECKING:
    import polars as pl

AT_ONCE = 100  # logs whose rows are noted together


@dataclass(frozen=True)
class Combined:
    """What the tables over all logs tell of."""

    outcomes: tuple[Outcome, ...]  # of every log, by name
    has_changed: bool  # since they were written last


def combine(folder: Path, known: Iterable[BatchLog] | None = None) -> Combined:
    """Write the combined tables of a batch.

    Only what changed since they were written is read. ``known`` are the batch's logs, where they
    have been read.
    """
    logs = read_logs(folder) if known is None else sorted(known, key=lambda log: log.name)
    with open_index(folder) as index:
        entries = settled(index, folder, logs)
        unlisted = index.names() - entries.keys()
        unlink_tables(folder, sorted(unlisted))
        index.drop(sorted(unlisted))
        has_changed = _bring_up_to_date(index, folder, logs, entries) or bool(unlisted)
        tables = (folder / TIMINGS_TABLE, folder / SUMMARY_TABLE)
        has_changed = has_changed or not all(table.is_file() for table in tables)
        if has_changed:
            _write_tables(folder, logs, entries)
            index.compact()
        return Combined(tuple(entries[log.name].outcome for log in logs), has_changed)


def _bring_up_to_date(
    index: BatchIndex, folder: Path, logs: Sequence[BatchLog], entries: dict[str, Entry]
) -> bool:
    """Fill in what entries lack, here and in the index; whether any did."""
    stale = {log.name: log for log in logs if _is_stale(log, entries[log.name])}
    gone = [e.outcome.name for e in entries.values() if e.linked and e.outcome.status != "done"]
    unlink_tables(folder, gone)
    names = [*stale, *(name for name in gone if name not in stale)]
    for begin in range(0, len(names), AT_ONCE):
        some = names[begin : begin + AT_ONCE]
        link_tables(folder, [n for n in some if _is_to_be_linked(entries[n])])
        fresh = {name: entries[name] for name in some}
        fresh |= {n: _with_rows(folder, stale[n], entries[n]) for n in some if n in stale}
        fresh = {n: replace(e, linked=e.outcome.status == "done") for n, e in fresh.items()}
        index.describe(fresh)
        entries.update(fresh)
    return bool(names)


def _is_to_be_linked(entry: Entry) -> bool:
    return entry.outcome.status == "done" and not entry.linked


def _is_stale(log: BatchLog, entry: Entry) -> bool:
    """Whether the log's rows aren't there, or its truth is another one than they were made by."""
    if entry.summary is None or entry.times is None or _is_to_be_linked(entry):
        return True
    return entry.outcome.status == "done" and entry.truth != json.dumps(truth_state(log))


def _with_rows(folder: Path, log: BatchLog, entry: Entry) -> Entry:
    summary = json.dumps(_summary(folder, log, entry.outcome), ensure_ascii=False)
    times = json.dumps(_timing(folder, entry.outcome))
    return replace(entry, summary=summary, times=times, truth=json.dumps(truth_state(log)))


def _write_tables(folder: Path, logs: Sequence[BatchLog], entries: Mapping[str, Entry]) -> None:
    import polars as pl

    rows = [_row(entries[log.name].summary, log) for log in logs]
    _write(pl.DataFrame(rows, schema=summary_schema()), folder / SUMMARY_TABLE)
    times = [json.loads(entries[log.name].times or "{}") | {"log": log.name} for log in logs]
    _write(pl.DataFrame(times, schema=timings_schema()), folder / TIMINGS_TABLE)


def _row(noted: str | None, log: BatchLog) -> dict[str, Any]:
    row: dict[str, Any] = json.loads(noted or "{}")
    return row | {"log": log.name, "source": log.log, "building": log.building}


def _summary(folder: Path, log: BatchLog, outcome: Outcome) -> dict[str, Any]:
    known = {"log": log.name, "status": outcome.status, "reason": outcome.reason}
    if outcome.status != "done":
        return known
    result = result_of(folder, log.name)
    run = read_summary(result)
    observed = read_estimates(result).filter("observed")
    return (
        known
        | {
            "log_seconds": run["timings"]["log_seconds"],
            "scans": run["counts"].get("Scan", 0),
            "estimates": run["counts"]["estimates"],
            "objects_observed": observed["object"].n_unique(),
            "lost_seconds": sum(found - since for since, found in run["lost_ns"]) / 1e9,
            "warnings": run["warnings"],
        }
        | _errors(result, log)
    )


def _errors(result: Path, log: BatchLog) -> dict[str, Any]:
    """A log's errors against its truth, if it has one; why not, if that is of no use."""
    if log.truth is None:
        return {}
    try:
        return _error_columns(evaluate(result, log.truth, log.path))
    except ObjstateError as error:
        return {"truth_problem": str(error)}


def _error_columns(evaluation: Evaluation) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for entry in evaluation.overall:
        if entry.final is not None:
            columns[f"{entry.coordinate}_count"] = entry.final.count
            columns[f"{entry.coordinate}_error"] = entry.final.mean
            columns[f"{entry.coordinate}_coverage"] = entry.final.coverage
    if evaluation.robot is not None:
        columns["robot_error"] = evaluation.robot.position.mean
    return columns


def _timing(folder: Path, outcome: Outcome) -> dict[str, Any]:
    row = {
        "log": outcome.name,
        "attempts": outcome.attempts,
        "peak_memory_mb": outcome.peak_memory_mb,
    }
    if outcome.status != "done":
        return row
    timings = read_summary(result_of(folder, outcome.name))["timings"]
    elapsed = timings["elapsed_seconds"]
    return row | {"elapsed_seconds": elapsed, "speed": timings["log_seconds"] / elapsed}


def _write(frame: pl.DataFrame, path: Path) -> None:
    with whole(path, overwrite=True) as file:
        frame.write_parquet(file)
