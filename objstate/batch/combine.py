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

from objstate.batch.compacting import compact
from objstate.batch.rows import ROWS, rows_of
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
from objstate.recording.parts import Part, parts, truth_state

if TYPE_CHECKING:
    import polars as pl

AT_ONCE = 100  # logs whose rows are noted together


@dataclass(frozen=True)
class Combined:
    """What the tables over all logs tell of."""

    outcomes: tuple[Outcome, ...]  # of every log, by name
    has_changed: bool  # since they were written last


def combine(
    folder: Path, known: Iterable[BatchLog] | None = None, *, compacted: bool = True
) -> Combined:
    """Write the combined tables of a batch; those of estimates and events only if ``compacted``.

    Only what changed since they were written is read. ``known`` are the batch's logs, where they
    have been read.
    """
    logs = read_logs(folder) if known is None else sorted(known, key=lambda log: log.name)
    with open_index(folder) as index:
        entries = settled(index, folder, logs)
        unlisted = index.names() - entries.keys()
        index.drop(sorted(unlisted))
        has_changed = _bring_up_to_date(index, folder, logs, entries) or bool(unlisted)
        tables = (folder / TIMINGS_TABLE, folder / SUMMARY_TABLE)
        has_changed = has_changed or not all(table.is_file() for table in tables)
        if has_changed:
            _write_tables(folder, logs, entries)
            index.compact()
        if compacted:
            compact(index, folder, entries)
        return Combined(tuple(entries[log.name].outcome for log in logs), has_changed)


def _bring_up_to_date(
    index: BatchIndex, folder: Path, logs: Sequence[BatchLog], entries: dict[str, Entry]
) -> bool:
    """Fill in what entries lack, here and in the index; whether any did."""
    stale = {log.name: log for log in logs if _is_stale(log, entries[log.name])}
    names = list(stale)
    for begin in range(0, len(names), AT_ONCE):
        some = names[begin : begin + AT_ONCE]
        fresh = {name: _with_rows(index, folder, stale[name], entries[name]) for name in some}
        index.describe(fresh)
        entries.update(fresh)
    return bool(names)


def _is_stale(log: BatchLog, entry: Entry) -> bool:
    """Whether the log's rows aren't there, or its truth is another one than they were made by."""
    if entry.summary is None or entry.times is None:
        return True
    return entry.outcome.status == "done" and entry.truth != json.dumps(truth_state(log))


def _with_rows(index: BatchIndex, folder: Path, log: BatchLog, entry: Entry) -> Entry:
    """The entry with its rows, those that its worker made or new ones."""
    state = json.dumps(truth_state(log))
    known: dict[str, Any] = {}
    if entry.outcome.status == "done":
        result = result_of(folder, log.name)
        part = Part(log.name, result, state)
        found = parts(index, ROWS, {log.name: part}, lambda _: rows_of(result, log))
        known = json.loads(next(content for _, content in found))
    outcome = entry.outcome
    summary = {"status": outcome.status, "reason": outcome.reason, **known.get("summary", {})}
    times = {
        "attempts": outcome.attempts,
        "peak_memory_mb": outcome.peak_memory_mb,
        **known.get("times", {}),
    }
    return replace(
        entry,
        summary=json.dumps(summary, ensure_ascii=False),
        times=json.dumps(times),
        truth=state,
    )


def _write_tables(folder: Path, logs: Sequence[BatchLog], entries: Mapping[str, Entry]) -> None:
    import polars as pl

    rows = [_row(entries[log.name].summary, log) for log in logs]
    _write(pl.DataFrame(rows, schema=summary_schema()), folder / SUMMARY_TABLE)
    times = [json.loads(entries[log.name].times or "{}") | {"log": log.name} for log in logs]
    _write(pl.DataFrame(times, schema=timings_schema()), folder / TIMINGS_TABLE)


def _row(noted: str | None, log: BatchLog) -> dict[str, Any]:
    row: dict[str, Any] = json.loads(noted or "{}")
    return row | {"log": log.name, "source": log.log, "building": log.building}


def _write(frame: pl.DataFrame, path: Path) -> None:
    with whole(path, overwrite=True) as file:
        frame.write_parquet(file)
