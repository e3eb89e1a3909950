"""What the tables over all logs say of a log that is done, made from its result alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from objstate.errors import ObjstateError
from objstate.evaluation import Evaluation, evaluate
from objstate.recording.batches import BatchLog
from objstate.recording.summary import read_summary
from objstate.recording.tables import read_estimates
from objstate.storage import here

ROWS = "rows"  # the kind under which they are kept


def rows_of(result: Path, log: BatchLog) -> bytes:
    """Its rows of ``summary.parquet`` and of ``timings.parquet``, as JSON."""
    run = read_summary(result)
    observed = read_estimates(result).filter("observed")
    summary = {
        "log_seconds": run["timings"]["log_seconds"],
        "scans": run["counts"].get("Scan", 0),
        "estimates": run["counts"]["estimates"],
        "objects_observed": observed["object"].n_unique(),
        "lost_seconds": sum(found - since for since, found in run["lost_ns"]) / 1e9,
        "warnings": run["warnings"],
    }
    elapsed = run["timings"]["elapsed_seconds"]
    times = {"elapsed_seconds": elapsed, "speed": run["timings"]["log_seconds"] / elapsed}
    rows = {"summary": summary | _errors(result, log), "times": times}
    return json.dumps(rows, ensure_ascii=False).encode()


def _errors(result: Path, log: BatchLog) -> dict[str, Any]:
    """A log's errors against its truth, if it has one; why not, if that is of no use."""
    if log.truth is None:
        return {}
    try:
        path = None if log.path is None else here(log.path)
        return _error_columns(evaluate(result, here(log.truth), path))
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
