"""What happened, in order: kept in the database, and passed on to all who listen."""

from __future__ import annotations

import asyncio
import json
import time
from collections import deque
from collections.abc import AsyncIterator, Iterable
from typing import Any, NamedTuple

from sqlalchemy import Connection, Executable, delete, func, insert, select

from objstate.service.tables import EVENTS
from objstate.world.database import Database

KEPT = 10_000  # events; who was away for more of them hears that some are lost
AT_ONCE = 500  # events read from the database in one go
PASSING = 200  # messages that aren't kept, which may wait for a slow listener
CHECKED_EVERY_S = 15.0  # comment sent to a silent listener, so that a dead connection shows


class Event(NamedTuple):
    """Something that happened."""

    id: int
    kind: str  # drive, belief, deleted
    stamp_ns: int
    data: str  # JSON

    def text(self) -> str:
        """The event as Server-Sent Events have it."""
        return f"id: {self.id}\nevent: {self.kind}\ndata: {self.data}\n\n"


class Listener:
    """Who follows a stream: what isn't kept is handed to it, the newest where it is slow."""

    def __init__(self) -> None:
        self.passing: deque[str] = deque(maxlen=PASSING)


class Events:
    """The events of a service. Those who listen are woken by each new one, and read from here."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._wake = asyncio.Event()
        self._last = 0  # the newest number that is known here
        self._loop: asyncio.AbstractEventLoop | None = None
        self._listeners: set[Listener] = set()
        self._reads: dict[tuple[asyncio.Event, int], asyncio.Task[list[Event]]] = {}

    def listen_on(self, loop: asyncio.AbstractEventLoop) -> None:
        """Wake listeners on this loop."""
        self._loop = loop

    def add(self, *happened: tuple[str, dict[str, Any]], also: Iterable[Executable] = ()) -> None:
        """Keep events, and wake who listens; from any thread. Raises WorldError.

        ``also`` are statements that are made in the same transaction.
        """
        if not happened:
            return
        with self._database.writing() as connection:
            for statement in also:
                connection.execute(statement)
            last = self.keep(connection, happened)
        self.wake(last)

    def keep(self, connection: Connection, happened: Iterable[tuple[str, dict[str, Any]]]) -> int:
        """Keep events in a transaction, after which ``wake`` takes the number of the last event."""
        now = time.time_ns()
        rows = [{"kind": k, "stamp_ns": now, "data": json.dumps(d)} for k, d in happened]
        if rows:
            connection.execute(insert(EVENTS), rows)
        last = int(connection.execute(select(func.max(EVENTS.c.id))).scalar() or 0)
        connection.execute(delete(EVENTS).where(EVENTS.c.id <= last - KEPT))
        return last

    def wake(self, last: int) -> None:
        """Wake who listens, for events up to a number; from any thread."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._news, last)

    def tell(self, kind: str, data: dict[str, Any]) -> None:
        """Tell who listens now of something that isn't kept, as a robot's pose; from any thread."""
        if self._loop is not None and self._listeners:
            text = f"event: {kind}\ndata: {json.dumps(data)}\n\n"
            self._loop.call_soon_threadsafe(self._pass_on, text)

    def follow(self) -> None:
        """Look whether another process has added events; from any thread. Raises WorldError."""
        last = self.last()
        if last > self._last:
            self.wake(last)

    def _news(self, last: int) -> None:
        self._last = max(self._last, last)
        self._ring()

    def _pass_on(self, text: str) -> None:
        for listener in self._listeners:
            listener.passing.append(text)
        self._ring()

    def _ring(self) -> None:
        self._wake.set()
        self._wake = asyncio.Event()

    def last(self) -> int:
        """The number of the last event, 0 before the first. Raises WorldError."""
        with self._database.reading() as connection:
            return int(connection.execute(select(func.max(EVENTS.c.id))).scalar() or 0)

    def after(self, identity: int) -> list[Event]:
        """The next events after a number. Raises WorldError."""
        c = EVENTS.c
        query = select(c.id, c.kind, c.stamp_ns, c.data).where(c.id > identity).order_by(c.id)
        with self._database.reading() as connection:
            return [Event(*row) for row in connection.execute(query.limit(AT_ONCE))]

    async def stream(self, after: int | None) -> AsyncIterator[str]:
        """All events after a number, or from now on, in the words of Server-Sent Events."""
        seen = await asyncio.to_thread(self.last) if after is None else after
        yield f"id: {seen}\n\n"  # where to resume a stream that breaks before its first event
        self._last = max(self._last, seen)
        listener, is_behind = Listener(), True
        self._listeners.add(listener)
        try:
            while True:
                wake = self._wake
                new = await self._shared(wake, seen) if is_behind or self._last > seen else []
                is_behind = False
                for event in new:
                    yield event.text()
                    seen = event.id
                passing = bool(listener.passing)
                while listener.passing:
                    yield listener.passing.popleft()
                if new or passing:
                    continue
                try:
                    await asyncio.wait_for(wake.wait(), CHECKED_EVERY_S)
                except TimeoutError:
                    yield ": still here\n\n"
        finally:
            self._listeners.discard(listener)

    async def _shared(self, wake: asyncio.Event, seen: int) -> list[Event]:
        """The next events after a number, read once for all who wait for them.

        Who is woken by ``wake`` may share only a read that began after the wake before.
        """
        key = wake, seen
        if key not in self._reads:
            self._reads[key] = asyncio.create_task(asyncio.to_thread(self.after, seen))
            self._reads[key].add_done_callback(lambda _: self._reads.pop(key))
        return await asyncio.shield(self._reads[key])
