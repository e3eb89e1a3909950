"""Tables over all logs: which logs share a file, and that none is there twice or lost."""

import random
import sqlite3
from contextlib import closing
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.batch import compacting
from objstate.batch.compacting import MOST_BYTES, MOST_LOGS, TABLES, compact, pieces
from objstate.errors import StorageError
from objstate.recording.batches import Outcome, result_of, scan_batch
from objstate.recording.index import INDEX, Entry, Making, open_index


def entry(name: str, size: int = 1000, made_ns: int = 1) -> Entry:
    return Entry(Outcome(name, "done"), Making(made_ns, "{}", None, size))


def fleet(count: int) -> dict[str, Entry]:
    return {f"drive_{n:05d}": entry(f"drive_{n:05d}") for n in range(count)}


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 400), st.sampled_from([1, MOST_BYTES // 10]))
def test_each_log_that_is_done_is_in_one_piece(seed: int, count: int, size: int) -> None:
    rng = random.Random(seed)
    names = {f"log_{rng.randrange(10**6)}" for _ in range(count)}
    entries = {name: entry(name, rng.randrange(2 * size)) for name in names}
    failed = set(rng.sample(sorted(names), len(names) // 5))
    entries |= {name: Entry(Outcome(name, "failed")) for name in failed}
    found = list(pieces(entries))
    assert [name for piece in found for name in piece.names] == sorted(names - failed)
    for piece in found:
        sizes = [making.bytes for name in piece.names if (making := entries[name].making)]
        assert len(piece.names) <= MOST_LOGS
        assert len(piece.names) == 1 or sum(sizes) <= MOST_BYTES


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2999))
def test_a_log_that_comes_later_changes_few_pieces(late: int) -> None:
    after = fleet(3000)
    before = {name: each for name, each in after.items() if name != f"drive_{late:05d}"}
    old, new = ({piece.stamp for piece in pieces(each)} for each in (before, after))
    assert 30 < len(new) < 120
    assert 1 <= len(new - old) <= 8


def a_batch(folder: Path, count: int) -> dict[str, Entry]:
    """Results with a table of estimates each; the third has no other ones."""
    entries = fleet(count)
    for n, name in enumerate(entries):
        own = result_of(folder, name)
        own.mkdir(parents=True)
        for table in TABLES[: 1 if n == 2 else 3]:
            pl.DataFrame({"stamp": [n, n + 1], "value": [0.5, 1.0]}).write_parquet(own / table)
    return entries


def rows(folder: Path) -> list[tuple[str, int]]:
    return sorted(scan_batch(folder, filtered=True).select("log", "stamp").collect().rows())


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.glob("*.parquet/*")}


def test_tables_hold_what_results_do_and_only_what_changed_is_written(tmp_path: Path) -> None:
    entries = a_batch(tmp_path, 300)
    some = dict(list(entries.items())[:280])
    with open_index(tmp_path) as index:
        compact(index, tmp_path, some)
        before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.parquet/*")}
        compact(index, tmp_path, entries)
    names = list(entries)
    assert rows(tmp_path) == [(name, n + k) for n, name in enumerate(names) for k in (0, 1)]
    both = scan_batch(tmp_path).collect()  # smoothed, and of the third the filtered ones
    assert sorted(both["log"].to_list()) == sorted(2 * names)
    kept = [path for path, made in before.items() if path.stat().st_mtime_ns == made]
    assert len(kept) >= len(before) - 6
    del entries[names[0]]  # as if its run had failed since
    with open_index(tmp_path) as index:
        compact(index, tmp_path, entries)
    assert {name for name, _ in rows(tmp_path)} == set(entries)


def test_broken_off_anywhere_no_log_is_there_twice_and_the_end_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries = a_batch(tmp_path / "a", 150)
    a_batch(tmp_path / "b", 150)
    early = {name: each for n, (name, each) in enumerate(entries.items()) if n % 3}
    with open_index(tmp_path / "a") as index:
        compact(index, tmp_path / "a", entries)
    with open_index(tmp_path / "b") as index:
        compact(index, tmp_path / "b", early)
        for stop in range(4):
            full(monkeypatch, after=stop)
            with pytest.raises(StorageError):
                compact(index, tmp_path / "b", entries)
            monkeypatch.undo()
            there = rows(tmp_path / "b") if list((tmp_path / "b").glob("est*/*.parquet")) else []
            assert len(there) == len(set(there))
        compact(index, tmp_path / "b", entries)
    assert files(tmp_path / "b") == files(tmp_path / "a")


def full(monkeypatch: pytest.MonkeyPatch, after: int) -> None:
    """A disk that is full once so many files have been written."""
    left = [after]
    real = compacting.whole

    def whole(*given: object, **options: object) -> object:
        if not left[0]:
            raise StorageError("full", transient=False)
        left[0] -= 1
        return real(*given, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(compacting, "whole", whole)


def test_folders_of_an_earlier_version_make_way(tmp_path: Path) -> None:
    entries = a_batch(tmp_path, 3)
    with closing(sqlite3.connect(tmp_path / INDEX)) as old:
        old.executescript(
            "CREATE TABLE log (name TEXT PRIMARY KEY, status TEXT NOT NULL, reason TEXT, "
            "attempts INTEGER, peak_memory_mb REAL, made_ns INTEGER, options INTEGER, "
            "geometry TEXT, bytes INTEGER, summary TEXT, times TEXT, truth TEXT, "
            "linked INTEGER NOT NULL DEFAULT 0); "
            "INSERT INTO log (name, status, linked) VALUES ('x', 'failed', 1); "
            "PRAGMA user_version = 1"
        )
    part = tmp_path / "estimates.parquet" / "log=drive_00000" / "part.parquet"
    part.parent.mkdir(parents=True)
    part.write_bytes(b"")
    with open_index(tmp_path) as index:
        assert index.entries()["x"].outcome.status == "failed"
        compact(index, tmp_path, entries)
    assert not part.exists()
    assert {name for name, _ in rows(tmp_path)} == set(entries)
