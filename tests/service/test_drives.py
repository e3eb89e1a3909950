"""Drives in the table of jobs: what counts as an attempt, and what a killed service leaves."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from objstate.service.drives import (
    ABANDONED_S,
    DONE,
    FAILED,
    MOST_ATTEMPTS,
    WAITING,
    Drive,
    Drives,
)
from objstate.service.tables import make_tables
from objstate.service.watching import Watch
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.store import open_store
from tests.world.conftest import place
from tests.world.examples import BUILDING

__all__ = ["place"]


async def arriving(*chunks: bytes) -> AsyncIterator[bytes]:
    for chunk in chunks:
        yield chunk


@pytest.fixture
def database(place: str) -> Database:
    open_store(place, BUILDING)
    database = Database(parse_location(place))
    make_tables(database)
    return database


def received(drives: Drives, *chunks: bytes) -> Drive:
    return asyncio.run(drives.receive(arriving(*chunks), 10**7, None))


def test_what_comes_in_pieces_is_one_log(database: Database, tmp_path: Path) -> None:
    drives = Drives(database, tmp_path / "data")
    pieces = [os.urandom(700_000) for _ in range(4)]
    drive = received(drives, *pieces)
    assert drives.log(drive).read_bytes() == b"".join(pieces)
    assert received(drives, b"".join(pieces)).id == drive.id
    assert len(drives.all()) == 1


def test_being_killed_is_no_fault_of_the_log(database: Database, tmp_path: Path) -> None:
    for _ in range(MOST_ATTEMPTS + 2):
        drives = Drives(database, tmp_path / "data")
        drives.put_back()
        received(drives, b"a log")
        assert (drives.next() or pytest.fail("no drive waits")).attempts == 1
    drives.put_back()
    taken = drives.next()
    assert taken is not None
    drives.again(taken, "the disk is full", counts=False)
    assert drives.get(taken.id).attempts == 0
    taken = drives.next()
    assert taken is not None
    drives.again(taken, "its process died", counts=True)
    assert drives.get(taken.id).attempts == 1


def test_a_log_that_failed_is_queued_anew_when_it_is_sent_again(
    database: Database, tmp_path: Path
) -> None:
    drives = Drives(database, tmp_path / "data")
    received(drives, b"a log")
    received(drives, b"another log")
    for state in (FAILED, DONE):
        drives.end(drives.next() or pytest.fail("no drive waits"), state, reason="lost")
    again, done = received(drives, b"a log"), received(drives, b"another log")
    assert (again.state, again.reason, again.ended_ns, done.state) == (WAITING, None, None, DONE)
    assert drives.next() == drives.get(again.id)
    assert drives.log(again).read_bytes() == b"a log"


def test_uploads_that_broke_off_are_removed_in_the_end(database: Database, tmp_path: Path) -> None:
    Drives(database, tmp_path / "data")
    old, new = (tmp_path / "data" / "incoming" / name for name in ("old", "new"))
    for partial in (old, new):
        partial.write_bytes(b"half")
    os.utime(old, (0, old.stat().st_mtime - ABANDONED_S - 60))
    Drives(database, tmp_path / "data")
    assert (old.exists(), new.exists()) == (False, True)


def test_a_watched_folder_may_be_empty_but_not_missing(
    database: Database, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    empty, missing = tmp_path / "empty", tmp_path / "missing"
    empty.mkdir()
    places = [str(empty), str(empty / "*.mcap"), str(missing)]
    watch = Watch(places, database, Drives(database, tmp_path / "data"), lambda _: None)
    with caplog.at_level("WARNING"):
        watch.look()
    (said,) = caplog.messages
    assert str(missing) in said
