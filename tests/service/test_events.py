"""Every listener hears every event once and in order, and many of them cost one read."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

from objstate.service.events import Event, Events
from objstate.service.tables import make_tables
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.store import open_store
from tests.world.examples import BUILDING

LISTENERS, COUNT = 40, 25


class Counting(Events):
    """Events that count their reads."""

    reads = 0

    def after(self, identity: int) -> list[Event]:
        self.reads += 1
        return super().after(identity)


def events_at(folder: Path) -> Counting:
    place = str(folder / "world.db")
    open_store(place, BUILDING)
    database = Database(parse_location(place))
    make_tables(database)
    return Counting(database)


async def heard(events: Events, after: int | None, until: int) -> list[int]:
    """The numbers of the events that a listener hears."""
    numbers: list[int] = []
    async for text in events.stream(after):
        if "data: " in text:
            numbers.append(int(text.split("\n")[0].removeprefix("id: ")))
        if numbers and numbers[-1] == until:
            break
    return numbers


def test_many_listeners_share_what_is_read(tmp_path: Path) -> None:
    events = events_at(tmp_path)

    def happen() -> None:
        for number in range(COUNT):
            events.add(("belief", {"number": number}))

    async def listen() -> list[list[int]]:
        events.listen_on(asyncio.get_running_loop())
        listening = [heard(events, 0, COUNT) for _ in range(LISTENERS)]
        together = asyncio.gather(*listening)
        await asyncio.sleep(0)
        threading.Thread(target=happen).start()
        return await asyncio.wait_for(together, 30.0)

    assert asyncio.run(listen()) == [list(range(1, COUNT + 1))] * LISTENERS
    assert events.reads < LISTENERS * COUNT / 4


def test_a_stream_says_at_once_where_it_is_to_be_resumed(tmp_path: Path) -> None:
    events = events_at(tmp_path)
    events.add(("belief", {}), ("belief", {}))

    async def first() -> str:
        return await anext(events.stream(None))

    assert asyncio.run(first()) == "id: 2\n\n"
