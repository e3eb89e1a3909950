"""The folder of a batch: what lies where, and which logs it is about.

``batch.json`` lists the logs; each has its result folder below ``logs``, or none yet. How their
runs ended stands in the index (``index.py``).
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from objstate.errors import ResultError
from objstate.outputs import write_text
from objstate.recording.parquet import read_parquet
from objstate.recording.tables import ESTIMATES, KNOWN_COORDINATES, SMOOTHED

if TYPE_CHECKING:
    import polars as pl

BATCH = "batch.json"
LOGS = "logs"
OUTCOMES = "outcomes"
SUMMARY_TABLE = "summary.parquet"
TIMINGS_TABLE = "timings.parquet"
REPORT = "report.html"  # in a result folder, or a batch
PART = "from-{first}.parquet"  # of a combined table: its logs from this one on, by name

Status = Literal["done", "failed", "timed out", "killed", "not run"]


@dataclass(frozen=True)
class BatchLog:
    """One log of a batch and what belongs to it; addresses are absolute paths or URLs."""

    name: str  # of its result folder
    log: str
    building: str
    truth: str | None = None  # CSV of true states
    path: str | None = None  # TUM, the robot's true path
    robot: str | None = None  # which one drove it, where that was said


@dataclass(frozen=True)
class Outcome:
    """How the run of one log ended."""

    name: str
    status: Status
    reason: str | None = None  # why it isn't done
    attempts: int | None = None  # how often it was begun, where that was noted
    peak_memory_mb: float | None = None  # of the worker process so far, at the end of the log


def is_batch(folder: str | Path) -> bool:
    """Whether a folder is one that ``objstate batch`` writes."""
    return (Path(folder) / BATCH).is_file()


def result_of(folder: str | Path, name: str) -> Path:
    """Where a log's result folder lies."""
    return Path(folder) / LOGS / name


def write_logs(folder: str | Path, logs: Iterable[BatchLog]) -> None:
    """Write ``batch.json``, sorted by name, a line for each log."""
    ordered = sorted(logs, key=lambda log: log.name)
    lines = [json.dumps(vars(log), sort_keys=True, ensure_ascii=False) for log in ordered]
    write_text(Path(folder) / BATCH, '{"logs": [\n' + ",\n".join(lines) + "\n]}\n")


def read_logs(folder: str | Path) -> list[BatchLog]:
    """The logs of a batch, by name. Raises ResultError for a folder that is none."""
    path = Path(folder) / BATCH
    if not path.is_file():
        raise ResultError(f"{folder} is no batch; make one with `objstate batch`.")
    content = read_json(path)
    try:
        return [BatchLog(**row) for row in content["logs"]]
    except (KeyError, TypeError) as error:
        raise ResultError(f"{path} doesn't list logs; make the batch anew.") from error


def scan_batch(folder: str | Path, *, filtered: bool = False) -> pl.LazyFrame:
    """All estimates of a batch, lazily; the column ``log`` names each row's log.

    Their states are those given the whole log, where a result has them, or with ``filtered`` those
    that the robot would have known then.

    Raises ResultError where no log has a result.
    """
    import polars as pl

    estimates, smoothed = (
        [pl.scan_parquet(part) for part in sorted((Path(folder) / table).glob("*.parquet"))]
        for table in (ESTIMATES, SMOOTHED)
    )
    if not estimates:
        raise ResultError(f"{folder} holds no estimates; run `objstate batch` to its end.")
    every = pl.concat(estimates, how="diagonal")
    if filtered or not smoothed:
        return every
    better = pl.concat(smoothed, how="diagonal")
    others = every.join(better.select("log").unique(), on="log", how="anti")
    return pl.concat([better, others], how="diagonal")


@cache
def summary_schema() -> pl.Schema:
    """Names and types of the columns of ``summary.parquet``."""
    import polars as pl

    text, count, number = pl.String(), pl.Int64(), pl.Float64()
    columns: dict[str, Any] = dict.fromkeys(("log", "status", "reason", "source", "building"), text)
    columns["log_seconds"] = number
    columns |= dict.fromkeys(("scans", "estimates", "objects_observed"), count)
    columns |= {"lost_seconds": number, "warnings": pl.List(text), "truth_problem": text}
    for coordinate in KNOWN_COORDINATES:
        columns[f"{coordinate}_count"] = count
        columns |= dict.fromkeys((f"{coordinate}_error", f"{coordinate}_coverage"), number)
    return pl.Schema(columns | {"robot_error": number})


@cache
def timings_schema() -> pl.Schema:
    """Names and types of the columns of ``timings.parquet``."""
    import polars as pl

    columns: dict[str, Any] = {"log": pl.String(), "attempts": pl.Int64()}
    numbers = ("elapsed_seconds", "speed", "peak_memory_mb")
    return pl.Schema(columns | dict.fromkeys(numbers, pl.Float64()))


def read_summary_table(folder: str | Path) -> pl.DataFrame:
    """``summary.parquet`` of a batch. Raises ResultError where there is none."""
    cure = "run `objstate batch` to its end"
    return read_parquet(Path(folder) / SUMMARY_TABLE, summary_schema(), cure)


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object of a batch's folder. Raises ResultError."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultError(f"{path} can't be read ({error}); make the batch anew.") from error
    if not isinstance(content, dict):
        raise ResultError(f"{path} must hold a JSON object; make the batch anew.")
    return content
