"""A process that adds a drive to a world; importing this loads all that it needs."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing.connection import Connection

from sqlalchemy import Executable

from objstate.habits.model import ready
from objstate.world.store import DriveEntry, open_store
from tests.world.examples import BUILDING, SECOND, at_angle

ready()  # once in the process that all writers are forked from, instead of in each


def write(place: str, digest: str, begin_ns: int, count: int, other: Connection) -> None:
    """Add a drive of so many beliefs; stop when they are in the transaction, and go on when told.

    ``other`` hears "begun", "half-way" where the drive is new, and "added" or "known"; it tells
    once to go on.
    """
    told = False

    def half_way() -> Iterator[Executable]:
        nonlocal told
        other.send("half-way")
        told = bool(other.recv())
        yield from ()

    entry = DriveEntry(digest, begin_ns, begin_ns + count * SECOND)
    beliefs = [at_angle(0.5, begin_ns + second * SECOND) for second in range(count)]
    other.send("begun")
    added = open_store(place, BUILDING).add(entry, beliefs, also=half_way())
    other.send("added" if added else "known")
    if not told:
        other.recv()
