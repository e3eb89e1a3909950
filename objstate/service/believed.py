"""The world as the service knows it: in memory, and loaded anew when somebody taught it."""

from __future__ import annotations

import threading
from dataclasses import dataclass

from sqlalchemy import Executable, delete, func, insert, select

from objstate.building.model import Building
from objstate.config import Settings
from objstate.objects import ObjectBelief
from objstate.service.problems import Problem
from objstate.service.tables import DELETIONS, LIVE
from objstate.world.codec import pack_belief, unpack_belief
from objstate.world.database import Database
from objstate.world.schema import DRIVES, OBJECTS
from objstate.world.store import WorldStore
from objstate.world.world import Snapshot, World, checked_stamp


@dataclass(frozen=True)
class Known:
    """A world at one revision; of its past only what answers from its latest moment on need."""

    drive: int  # the number of the last one that it has learnt from
    others: str  # what changes where more than a drive was added
    world: World
    latest_ns: int

    @property
    def revision(self) -> str:
        """What changes with everything that is learnt."""
        return f"{self.drive}.{self.others}"


class Believed:
    """What is believed. Asking never waits for a database but for the past."""

    def __init__(
        self, database: Database, store: WorldStore, building: Building, settings: Settings
    ) -> None:
        self._database, self._store = database, store
        self._building, self._settings = building, settings
        self._lock = threading.Lock()
        self._live: dict[str, tuple[str, ObjectBelief]] = {}  # by object: the drive, its belief
        self._known = self._loaded(*self._asked())

    @property
    def now(self) -> Known:
        """The latest revision known here."""
        return self._known

    def refresh(self) -> None:
        """Take in what the world was taught. Raises WorldError."""
        with self._lock:
            drive, others = self._asked()
            known = self._known
            if (drive, others) == (known.drive, known.others):
                return
            if others == known.others and drive > known.drive:
                world = self._store.later(known.world, known.drive).newest()
                self._known = Known(drive, others, world, world.latest_ns or 0)
            else:
                self._known = self._loaded(drive, others)

    def at(self, stamp_ns: int, name: str | None = None) -> Snapshot:
        """What is believed at a moment, of one object or of all. What is past is read anew.

        Raises QueryError for a moment that is none, WorldError.
        """
        known = self._known
        stamp_ns = checked_stamp(stamp_ns, known.latest_ns)
        if stamp_ns < known.latest_ns:
            names = known.world.objects if name is None else [name]
            return self._store.then(known.world, stamp_ns, names).at(stamp_ns)
        return known.world.at(stamp_ns, {name: belief for name, (_, belief) in self._live.items()})

    def learn(self, drive: str, belief: ObjectBelief) -> list[Executable]:
        """Take a belief of a drive that goes on, until it is in the world.

        Returns the statements that tell other processes of it.
        """
        name, live = belief.item.name, self._live.get(belief.item.name)
        if live is not None and (live[1].stamp_ns or 0) > (belief.stamp_ns or 0):
            return []
        fitted = self._known.world.fitted(belief)
        self._live = self._live | {name: (drive, fitted)}
        row = insert(LIVE).values(
            object=name,
            drive=drive,
            stamp_ns=belief.stamp_ns,
            last_observed_ns=belief.last_observed_ns,
            belief=pack_belief(fitted),
        )
        return [delete(LIVE).where(LIVE.c.object == name), row]

    def forget(self, drive: str) -> None:
        """Let go the beliefs of a drive, which is in the world now, or never will be."""
        self._live = {name: each for name, each in self._live.items() if each[0] != drive}
        with self._database.writing() as connection:
            connection.execute(delete(LIVE).where(LIVE.c.drive == drive))

    def forget_all(self) -> None:
        """Let go the beliefs of all drives that went on when an earlier leader ended."""
        self._live = {}
        with self._database.writing() as connection:
            connection.execute(delete(LIVE))

    def follow_live(self) -> None:
        """Take what drives that go on have taught the leader. Raises WorldError."""
        c, objects = LIVE.c, self._known.world.objects
        known = {name: (drive, each.stamp_ns) for name, (drive, each) in self._live.items()}
        with self._database.reading() as connection:
            marks = connection.execute(select(c.object, c.drive, c.stamp_ns)).all()
            new = [
                row.object for row in marks if known.get(row.object) != (row.drive, row.stamp_ns)
            ]
            rows = connection.execute(select(LIVE).where(c.object.in_(new))).all() if new else []
        there = {row.object for row in marks}
        live = {name: each for name, each in self._live.items() if name in there}
        for row in rows:
            item = objects[row.object]
            belief = unpack_belief(row.belief, item, row.stamp_ns, row.last_observed_ns)
            live[row.object] = row.drive, self._known.world.fitted(belief)
        self._live = live

    def learnt_ns(self, name: str) -> int:
        """When something was last learnt of an object, 0 for never. Raises WorldError."""
        past = self._known.world.history(name)
        latest = (past[-1].stamp_ns or 0) if past else 0
        live = self._live.get(name)
        return latest if live is None else max(latest, live[1].stamp_ns or 0)

    @property
    def live_ns(self) -> int:
        """When a drive that goes on last learnt anything; 0 where none does."""
        return max((each.stamp_ns or 0 for _, each in self._live.values()), default=0)

    def history(self, name: str, most: int) -> tuple[ObjectBelief, ...]:
        """What was learnt of an object, the newest of it. Raises WorldError."""
        return self._store.history(self._known.world, name, most)

    def _asked(self) -> tuple[int, str]:
        with self._database.reading() as connection:
            drives = connection.execute(select(func.max(DRIVES.c.id))).scalar() or 0
            objects = connection.execute(select(func.count()).select_from(OBJECTS)).scalar_one()
            deleted = connection.execute(select(func.max(DELETIONS.c.id))).scalar() or 0
        return int(drives), f"{objects}.{deleted}"

    def _loaded(self, drive: int, others: str) -> Known:
        latest = self._store.latest_ns() or 0
        world = self._store.load(self._settings, objects=self._building.objects, since_ns=latest)
        return Known(drive, others, world, latest)


def known_object(world: World, name: str) -> str:
    """The name of an object. Raises Problem for an unknown one."""
    if name not in world.objects:
        raise Problem(404, f"The building has no object '{name}'.", "See GET /v1/objects.")
    return name
