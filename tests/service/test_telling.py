"""What the world was taught is told once, by whichever process, in the order it was taught."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sqlalchemy import select

from objstate.config import Settings
from objstate.errors import WorldError
from objstate.objects import ObjectBelief
from objstate.service.believed import Believed
from objstate.service.events import Events
from objstate.service.options import ServiceOptions
from objstate.service.parts import Parts
from objstate.service.tables import EVENTS, make_tables
from objstate.service.telling import Telling
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.store import DriveEntry, open_store
from tests.world.conftest import place
from tests.world.examples import BUILDING, at_angle, desk_at

__all__ = ["place"]


class Process:
    """What one process of a service knows of the world, and tells."""

    def __init__(self, place: str) -> None:
        self.database, self.store = Database(parse_location(place)), open_store(place, BUILDING)
        make_tables(self.database)
        self.believed = Believed(self.database, self.store, BUILDING, Settings())
        self.telling = Telling(self.database, Events(self.database))

    def teach(self, digest: str, *beliefs: ObjectBelief) -> None:
        self.store.add(DriveEntry(digest, 0, 10), list(beliefs))

    def tell(self) -> None:
        self.believed.refresh()
        self.telling.tell(self.believed.now)

    def told(self) -> list[tuple[str, int]]:
        with self.database.reading() as connection:
            rows = connection.execute(select(EVENTS.c.data).order_by(EVENTS.c.id)).scalars()
            told = [json.loads(data) for data in rows]
        return [(each["object"], each["stamp_ns"]) for each in told]


def test_any_process_tells_what_another_was_taught_and_none_tells_it_again(place: str) -> None:
    first, second = Process(place), Process(place)
    first.teach("a", at_angle(0.3, 5), at_angle(0.4, 6), desk_at(3.0, 5))
    first.teach("b", at_angle(0.2, 2))
    second.tell()
    first.tell()
    taught = [("desk", 5), ("door", 6), ("door", 2)]  # of each drive each object's last belief
    assert first.told() == taught
    second.teach("c")
    second.teach("d", at_angle(0.5, 8))
    for process in (first, second, Process(place)):
        process.tell()
    assert first.told() == [*taught, ("door", 8)]


def test_what_was_taught_is_told_after_a_restart_but_not_what_was_before_the_service(
    place: str,
) -> None:
    open_store(place, BUILDING).add(DriveEntry("before", 0, 10), [at_angle(0.3, 5)])
    Process(place).teach("unfinished", at_angle(0.4, 6))
    restarted = Process(place)
    restarted.tell()
    assert restarted.told() == [("door", 6)]


def test_others_hear_of_what_was_taught_where_this_process_cannot_read_the_world(
    hall: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = Parts(ServiceOptions(hall[0], str(tmp_path / "world.db"), tmp_path / "data"))

    def fail() -> None:
        raise WorldError("The world can't be read.")

    monkeypatch.setattr(parts.believed, "refresh", fail)
    for count, teach in enumerate((parts.note_taught, lambda: parts.forget("door", "me")), 1):
        with pytest.raises(WorldError):
            teach()
        assert (tmp_path / "data" / "taught").stat().st_size == count
