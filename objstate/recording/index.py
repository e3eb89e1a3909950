"""The index of a batch: one SQLite file that says which logs are done, and what is known of each.

So that a start that finds everything done reads one file, and not every result. Each change is a
transaction: a kill, or a disk that is full, leaves the index as it was before. It repeats only
what lies in the folder: without it, or where a result is newer than what it says, the result is
read once, and noted.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from objstate.errors import ResultError, StorageError
from objstate.outages import outage_of
from objstate.recording.batches import LOGS, OUTCOMES, BatchLog, Outcome, read_json
from objstate.recording.results import MARK

INDEX = "index.sqlite"
REMOTE = ".remote"  # in a copy of a batch that lies elsewhere: its address
FORM = 2  # of the tables
WAIT_S = 60.0  # for another process that writes
SPARE = 0.5  # share of a file's pages that are free, above which it is compacted

TABLES = """
CREATE TABLE IF NOT EXISTS log (
    name TEXT PRIMARY KEY, status TEXT NOT NULL, reason TEXT, attempts INTEGER,
    peak_memory_mb REAL, made_ns INTEGER, options INTEGER, geometry TEXT, bytes INTEGER,
    summary TEXT, times TEXT, truth TEXT
);
CREATE TABLE IF NOT EXISTS options (id INTEGER PRIMARY KEY, text TEXT NOT NULL UNIQUE);
CREATE TABLE IF NOT EXISTS part (
    kind TEXT NOT NULL, name TEXT NOT NULL, stamp TEXT NOT NULL, content BLOB NOT NULL,
    PRIMARY KEY (kind, name)
);
CREATE TABLE IF NOT EXISTS piece (name TEXT PRIMARY KEY, stamp TEXT NOT NULL);
"""
OLDER = {1: "ALTER TABLE log DROP COLUMN linked"}  # what each earlier form needs


@dataclass(frozen=True)
class Making:
    """How the result of a log was made."""

    made_ns: int  # when it took its place, as its mark says
    options: str  # JSON
    geometry: str | None  # digest of the building's
    bytes: int  # of the log


@dataclass(frozen=True)
class Entry:
    """What the index knows of one log."""

    outcome: Outcome
    making: Making | None = None  # of a result that is there
    summary: str | None = None  # JSON, its row of ``summary.parquet``
    times: str | None = None  # JSON, its row of ``timings.parquet``
    truth: str | None = None  # the state of the files of its truth, when the summary was made


class BatchIndex:
    """The index of one batch; ``open_index`` opens it."""

    def __init__(self, connection: sqlite3.Connection, folder: Path) -> None:
        self._connection = connection
        self._folder = folder
        self.is_mirror = (folder / REMOTE).is_file()  # results lie elsewhere

    @contextmanager
    def changing(self) -> Iterator[sqlite3.Connection]:
        """A transaction: all of it comes to be, or nothing. Raises StorageError."""
        with _told(self._folder):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise

    def entries(self) -> dict[str, Entry]:
        """What is known of each log, by name."""
        with _told(self._folder):
            texts = dict(self._connection.execute("SELECT id, text FROM options"))
            rows = self._connection.execute(
                "SELECT name, status, reason, attempts, peak_memory_mb, made_ns, options, geometry,"
                " bytes, summary, times, truth FROM log"
            )
            return {row[0]: _entry(row, texts) for row in rows}

    def names(self) -> set[str]:
        """The logs that it tells of."""
        with _told(self._folder):
            return {name for (name,) in self._connection.execute("SELECT name FROM log")}

    def note(self, outcomes: Iterable[Outcome]) -> None:
        """Note how runs ended. What was known of their older results is forgotten."""
        rows = [(o.name, o.status, o.reason, o.attempts, o.peak_memory_mb) for o in outcomes]
        with self.changing() as connection:
            connection.executemany(
                "INSERT INTO log (name, status, reason, attempts, peak_memory_mb) "
                "VALUES (?, ?, ?, ?, ?) ON CONFLICT (name) DO UPDATE SET status = excluded.status, "
                "reason = excluded.reason, attempts = excluded.attempts, "
                "peak_memory_mb = excluded.peak_memory_mb, made_ns = NULL, summary = NULL, "
                "times = NULL",
                rows,
            )

    def describe(self, entries: Mapping[str, Entry]) -> None:
        """Write down all that is known of some logs."""
        with self.changing() as connection:
            texts = {e.making.options for e in entries.values() if e.making is not None}
            connection.executemany(
                "INSERT OR IGNORE INTO options (text) VALUES (?)", [(text,) for text in texts]
            )
            numbers = {text: number for number, text in connection.execute("SELECT * FROM options")}
            connection.executemany(
                f"INSERT OR REPLACE INTO log VALUES ({', '.join('?' * 12)})",
                [_row(name, entry, numbers) for name, entry in entries.items()],
            )

    def forget(self, names: Iterable[str]) -> None:
        """Drop what was noted of logs' runs. Their results stay until there are new ones."""
        with self.changing() as connection:
            connection.executemany(
                "UPDATE log SET status = 'not run', reason = NULL, attempts = NULL, "
                "made_ns = NULL, summary = NULL, times = NULL WHERE name = ?",
                [(name,) for name in names],
            )

    def drop(self, names: Iterable[str]) -> None:
        """Leave out logs that the batch doesn't list any more."""
        rows = [(name,) for name in names]
        with self.changing() as connection:
            connection.executemany("DELETE FROM log WHERE name = ?", rows)
            connection.executemany("DELETE FROM part WHERE name = ?", rows)

    def parts(self, kind: str, name: str | None = None) -> Iterator[tuple[str, str, bytes]]:
        """What was kept of each log, or of one, under a kind: its name, its stamp, its content."""
        query = "SELECT name, stamp, content FROM part WHERE kind = ?"
        with _told(self._folder):
            if name is None:
                yield from self._connection.execute(query, (kind,))
            else:
                yield from self._connection.execute(f"{query} AND name = ?", (kind, name))

    def stamps(self, kind: str) -> dict[str, str]:
        """The stamps of what was kept under a kind, by log."""
        with _told(self._folder):
            found = self._connection.execute("SELECT name, stamp FROM part WHERE kind = ?", (kind,))
            return dict(found)

    def keep(self, kind: str, parts: Iterable[tuple[str, str, bytes]]) -> None:
        """Keep contents of logs under a kind, each with the stamp of what it was made from."""
        with self.changing() as connection:
            connection.executemany(
                "INSERT OR REPLACE INTO part VALUES (?, ?, ?, ?)",
                [(kind, *part) for part in parts],
            )

    def pieces(self) -> dict[str, str]:
        """The parts of the combined tables, each with the stamp of what it was made from."""
        with _told(self._folder):
            return dict(self._connection.execute("SELECT name, stamp FROM piece"))

    def note_piece(self, name: str, stamp: str | None) -> None:
        """Note that a part of the combined tables was written, or with None, that it is gone."""
        with self.changing() as connection:
            connection.execute("DELETE FROM piece WHERE name = ?", (name,))
            if stamp is not None:
                connection.execute("INSERT INTO piece VALUES (?, ?)", (name, stamp))

    def compact(self) -> None:
        """Give back the room of what was replaced, where that is most of the file."""
        with _told(self._folder):
            (free,) = self._connection.execute("PRAGMA freelist_count").fetchone()
            (pages,) = self._connection.execute("PRAGMA page_count").fetchone()
            if free > SPARE * pages:
                self._connection.execute("VACUUM")


@contextmanager
def open_index(folder: str | Path) -> Iterator[BatchIndex]:
    """The index of a batch's folder, made where there is none.

    Where the folder can't be written, it is made in memory. Raises StorageError, and ResultError
    for a file that is no index.
    """
    home = Path(folder)
    with _told(home), closing(_connected(home)) as connection:
        yield BatchIndex(connection, home)


def read_entries(folder: str | Path, logs: Iterable[BatchLog]) -> dict[str, Entry]:
    """What is known of each of a batch's ``logs``, by name, as ``settled`` finds it."""
    with open_index(folder) as index:
        return settled(index, Path(folder), logs)


def read_outcomes(folder: str | Path, logs: Iterable[BatchLog]) -> dict[str, Outcome]:
    """How the latest run of each of a batch's ``logs`` ended, by name. Raises ResultError."""
    return {name: entry.outcome for name, entry in read_entries(folder, logs).items()}


def write_outcome(folder: str | Path, outcome: Outcome) -> None:
    """Note how a log's run ended."""
    with open_index(folder) as index:
        index.note([outcome])


def settled(index: BatchIndex, folder: Path, logs: Iterable[BatchLog]) -> dict[str, Entry]:
    """What is known of each log, by name, once the index has caught up with the results.

    A result without a note was finished just before the batch was killed, or before there was
    an index. One beside the note of a run that went wrong is older than that run, and doesn't
    count. Raises ResultError.
    """
    known = index.entries()
    results = os.path.join(folder, LOGS)
    found: dict[str, Entry] = {}
    changed: dict[str, Entry] = {}
    old = None if known else _old_notes(folder)
    for log in logs:
        entry = known.get(log.name) or Entry(
            (old or {}).get(log.name, Outcome(log.name, "not run"))
        )
        if entry.outcome.status in ("done", "not run"):
            fresh = _caught_up(entry, f"{results}/{log.name}", index.is_mirror)
            if fresh is not entry or log.name not in known:
                changed[log.name] = entry = fresh
        elif log.name not in known:
            changed[log.name] = entry
        found[log.name] = entry
    if changed:
        index.describe(changed)
    return found


def _caught_up(entry: Entry, result: str, is_mirror: bool) -> Entry:
    """The entry, if it tells of the result that is there; else what the result tells."""
    name = entry.outcome.name
    try:
        made_ns = os.stat(f"{result}/{MARK}").st_mtime_ns  # of 100,000: a Path would take seconds
    except OSError:
        if is_mirror or (entry.outcome.status == "not run" and entry.making is None):
            return entry  # elsewhere, a result that was noted is there
        return Entry(Outcome(name, "not run"))
    if entry.making is not None and entry.making.made_ns == made_ns:
        return entry
    outcome = replace(entry.outcome, status="done", reason=None)
    return Entry(outcome, _making(result, made_ns))


def _making(result: str, made_ns: int) -> Making:
    from objstate.recording.summary import read_summary

    made = read_summary(result)
    inputs: Mapping[str, Any] = made.get("inputs", {})
    return Making(
        made_ns=made_ns,
        options=json.dumps(made.get("options"), sort_keys=True),
        geometry=inputs.get("building", {}).get("geometry_sha256"),
        bytes=sum(int(file["bytes"]) for file in inputs.get("logs", ())),
    )


def _old_notes(folder: Path) -> dict[str, Outcome]:
    """How runs ended, as batches of earlier versions noted it: a file for each log."""
    files = sorted((folder / OUTCOMES).glob("[!.]*.json"))
    return {note.name: note for note in (Outcome(**read_json(file)) for file in files)}


def _connected(folder: Path) -> sqlite3.Connection:
    path = folder / INDEX
    try:
        return _prepared(sqlite3.connect(path, timeout=WAIT_S, isolation_level=None))
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN):
            raise
    here = sqlite3.connect(":memory:", isolation_level=None)
    if path.is_file():
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?immutable=1", uri=True)) as there:
            there.backup(here)
    return _prepared(here)


def _prepared(connection: sqlite3.Connection) -> sqlite3.Connection:
    try:
        (form,) = connection.execute("PRAGMA user_version").fetchone()
        if form > FORM:
            raise ResultError(
                f"The batch was indexed by a newer objstate (form {form}; this one knows up to "
                f"{FORM}); update objstate."
            )
        if form < FORM:
            connection.execute("BEGIN IMMEDIATE")
            if form in OLDER:
                connection.execute(OLDER[form])
            for statement in filter(str.strip, TABLES.split(";")):
                connection.execute(statement)
            connection.execute(f"PRAGMA user_version = {FORM}")
            connection.execute("COMMIT")
    except BaseException:
        connection.close()
        raise
    return connection


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Turn what SQLite raises into words."""
    path = folder / INDEX
    try:
        yield
    except sqlite3.OperationalError as error:
        outage = outage_of(error)
        transient = outage is not None and outage.transient
        raise StorageError(
            f"Can't write {path}: {error}; free some space, or try again later.", transient
        ) from error
    except sqlite3.DatabaseError as error:
        raise ResultError(
            f"{path} is damaged ({error}); remove it: the next start makes it anew."
        ) from error


def _entry(row: tuple[Any, ...], texts: Mapping[int, str]) -> Entry:
    name, status, reason, attempts, memory, made_ns, options, geometry, size, *rest = row
    summary, times, truth = rest
    outcome = Outcome(name, status, reason, attempts, memory)
    making = None if made_ns is None else Making(made_ns, texts[options], geometry, size)
    return Entry(outcome, making, summary, times, truth)


def _row(name: str, entry: Entry, numbers: Mapping[str, int]) -> tuple[Any, ...]:
    outcome, making = entry.outcome, entry.making
    made: tuple[Any, ...] = (None,) * 4
    if making is not None:
        made = (making.made_ns, numbers[making.options], making.geometry, making.bytes)
    noted = (name, outcome.status, outcome.reason, outcome.attempts, outcome.peak_memory_mb)
    return (*noted, *made, entry.summary, entry.times, entry.truth)
