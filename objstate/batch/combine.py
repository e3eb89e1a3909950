"""The tables over all logs of a batch, made from the folder's files alone.

So they are the same bytes wherever, in what order and on how many workers the logs were
run. Timings, which never are the same, stand in a table of their own.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.errors import ObjstateError
from objstate.evaluation import Evaluation, evaluate
from objstate.outputs import whole
from objstate.recording.batches import (
    PART,
    PARTITION,
    SUMMARY_TABLE,
    TIMINGS_TABLE,
    BatchLog,
    Outcome,
    read_logs,
    read_outcome,
    result_of,
    summary_schema,
    timings_schema,
)
from objstate.recording.events import EVENTS
from objstate.recording.summary import read_summary
from objstate.recording.tables import ESTIMATES, SMOOTHED, read_estimates

if TYPE_CHECKING:
    import polars as pl


def combine(folder: Path) -> tuple[Outcome, ...]:
    """Write the combined tables of a batch; how each log's run ended."""
    import polars as pl

    logs = read_logs(folder)
    outcomes = [read_outcome(folder, log.name) for log in logs]
    done = [log for log, outcome in zip(logs, outcomes, strict=True) if outcome.status == "done"]
    for table in (ESTIMATES, SMOOTHED, EVENTS):
        _link_tables(folder, table, [log.name for log in done])
    rows = [_summary(folder, *pair) for pair in zip(logs, outcomes, strict=True)]
    _write(pl.DataFrame(rows, schema=summary_schema()), folder / SUMMARY_TABLE)
    times = [_timing(folder, outcome) for outcome in outcomes]
    _write(pl.DataFrame(times, schema=timings_schema()), folder / TIMINGS_TABLE)
    return tuple(outcomes)


def _link_tables(folder: Path, table: str, names: Sequence[str]) -> None:
    """A table of all logs, a folder with one partition for each: the same file, not a copy.

    Results of earlier versions have estimates alone.
    """
    with whole(folder / table, overwrite=True, replaceable=Path.is_dir) as combined:
        combined.mkdir()
        for name in names:
            source = result_of(folder, name) / table
            if source.exists() or table == ESTIMATES:
                partition = combined / f"{PARTITION}{name}"
                partition.mkdir()
                _link(source, partition / PART)


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # a file system that has no links
        shutil.copyfile(source, target)


def _summary(folder: Path, log: BatchLog, outcome: Outcome) -> dict[str, Any]:
    known = {
        "log": log.name,
        "status": outcome.status,
        "reason": outcome.reason,
        "source": log.log,
        "building": log.building,
    }
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
