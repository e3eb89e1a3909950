"""Events of what the world was taught, each told once by whichever process of the service."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Select, and_, func, select, update

from objstate.service.believed import Known
from objstate.service.events import KEPT, Events
from objstate.service.tables import TOLD
from objstate.world.codec import unpack_belief
from objstate.world.database import Database
from objstate.world.schema import BELIEFS
from objstate.world.words import belief_words


class Telling:
    """Tells of the beliefs that drives and reports taught.

    Up to which drive is told is stored, and advanced in the transaction that inserts the events.
    """

    def __init__(self, database: Database, events: Events) -> None:
        self._database, self._events = database, events
        self._told = 0  # the last drive that this process knows to be told

    def tell(self, known: Known) -> None:
        """Tell of what was taught up to a revision and isn't told yet. Raises WorldError."""
        if known.drive <= self._told:
            return
        with self._database.reading() as connection:  # without waiting for writers
            told = _told(connection)
        if told < known.drive:
            with self._database.writing() as connection:
                told = _told(connection)
                last = self._events.keep(connection, _news(connection, told, known))
                connection.execute(update(TOLD).values(drive=max(told, known.drive)))
            self._events.wake(last)
        self._told = known.drive


def _told(connection: Connection) -> int:
    """Up to which drive any process has told."""
    return int(connection.execute(select(TOLD.c.drive)).scalar_one())


def _news(connection: Connection, told: int, known: Known) -> list[tuple[str, dict[str, Any]]]:
    """The events of drives after the one that is told, in the order in which they were added."""
    world, news = known.world, []
    for name, *stamps, packed in connection.execute(_last_beliefs(told, known.drive)):
        belief = world.fitted(unpack_belief(packed, world.objects[name], *stamps))
        news.append(("belief", belief_words(belief) | {"revision": known.revision}))
    return news


def _last_beliefs(after: int, until: int) -> Select[Any]:
    """Of each drive after one the last belief of each object; not more than events are kept."""
    b = BELIEFS.c
    last = (
        select(b.object, b.drive, func.max(b.stamp_ns).label("stamp_ns"))
        .where(b.drive > after, b.drive <= until)
        .group_by(b.object, b.drive)
        .order_by(b.drive.desc())
        .limit(KEPT)
        .subquery()
    )
    is_last = [b[name] == last.c[name] for name in ("object", "drive", "stamp_ns")]
    query = select(b.object, b.stamp_ns, b.last_observed_ns, b.belief).join(last, and_(*is_last))
    return query.order_by(b.drive, b.object)
