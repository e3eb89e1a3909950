"""What a service is made of."""

from __future__ import annotations

import asyncio
from typing import Any

from sqlalchemy import func, select

from objstate.lazy import altered
from objstate.run import BuildingInput
from objstate.service.advice import Advice
from objstate.service.believed import Believed, known_object
from objstate.service.drives import DONE, FAILED, Drive, Drives
from objstate.service.estimating import Context
from objstate.service.events import Events
from objstate.service.evidence import EvidenceDesk
from objstate.service.folder import claim
from objstate.service.leading import Leadership
from objstate.service.live.drive import LiveDrive
from objstate.service.live.links import Link
from objstate.service.live.options import LiveContext
from objstate.service.live.robots import Robots
from objstate.service.live.scene import FoxgloveServer
from objstate.service.metrics import Metrics
from objstate.service.options import ServiceOptions
from objstate.service.page import plan_words
from objstate.service.processing import Processing
from objstate.service.questions import Questions
from objstate.service.requests import Gate
from objstate.service.tables import DRIVES, deletion, make_tables
from objstate.service.taught import Taught
from objstate.service.telling import Telling
from objstate.service.tokens import Tokens
from objstate.service.uploads import Uploads
from objstate.service.watching import Watch
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.schema import BELIEFS
from objstate.world.store import open_store
from objstate.world.words import belief_words


class Parts:
    """The parts of one service, wired. Raises BuildingError, WorldError or SettingsError."""

    def __init__(self, options: ServiceOptions) -> None:
        options.check()
        self.options = options
        building = BuildingInput.read(options.building).model
        store = open_store(options.world, building)
        self.store, self.building = store, building
        self._plan: dict[str, Any] | None = None
        self._ended_live: dict[str, str] = {}  # by drive that is queued: the live drive
        self.database = Database(parse_location(options.world))
        make_tables(self.database)
        claim(self.database, options.data, is_new=options.new_data)
        settings = options.run.settings
        self.tokens = Tokens(self.database)
        self.gate = Gate(self.tokens, options.requests_per_s)
        self.events = Events(self.database)
        self.believed = Believed(self.database, store, building, settings)
        self.questions = Questions(self.believed)
        self.advice = Advice(building, settings, self.believed)
        self.telling = Telling(self.database, self.events)
        self.desk = EvidenceDesk(self.database, store, self.believed, settings, self.note_taught)
        self.drives = Drives(self.database, options.data)
        context = Context(
            options.building.absolute(),
            options.world,
            options.run,
            options.memory_limit,
            options.scenes,
        )
        self.processing = Processing(
            self.drives, context, options.time_limit_s, self.note_drive, self.note_taught
        )
        self.metrics = Metrics()
        self.listeners = 0
        self.uploads = Uploads(self.database, options.data / "uploads", self.drives)
        self.watch = Watch(options.watched, self.database, self.drives, self.queued)
        live = LiveContext(
            context.building,
            options.world,
            options.run,
            options.memory_limit,
            scenes=options.foxglove_port is not None,
        )
        self.robots = Robots(
            options.data / "live", self.drives, live, options.live, self.note_live, self.note_end
        )
        self.links = [Link(where, self.robots) for where in options.robots]
        self.foxglove: FoxgloveServer | None = None
        self.leadership = Leadership(options.data)
        self._taught, self._followed = Taught(options.data), -1

    def lead(self) -> None:
        """Begin what one process of the service does: estimate, watch places, follow robots."""
        if self.options.foxglove_port is not None:
            self.foxglove = FoxgloveServer(self.options.foxglove_port)
        self.believed.forget_all()
        self.processing.start()
        self.robots.recover()
        self.watch.start()

    def queued(self, drive: Drive) -> None:
        """A drive has come."""
        self.note_drive(drive)
        self.processing.wake()

    def note_live(self, live: LiveDrive, kind: str, what: Any) -> None:
        """What follows from a drive that goes on."""
        who = {"robot": live.robot, "drive": live.id}
        if kind == "beliefs":
            stamp_ns, news = what
            events, rows = [], []
            for name, belief in news:
                own = altered(belief, item=self.building.objects[name])
                rows += self.believed.learn(live.id, own)
                words = belief_words(own) | who | {"live": True}
                events.append(("belief", words))
            self.events.add(*events, also=rows)
            delay_s = live.delay_of(stamp_ns)
            if delay_s is not None:
                self.metrics.note_delay(delay_s)
        elif kind == "robot":
            live.pose, live.is_lost = what["pose"], what["lost"]
            self.events.tell("robot", who | what)
        elif kind in ("lost", "found"):
            self.events.add((kind, who | {"stamp_ns": what}))
        elif kind == "scene" and self.foxglove is not None:
            self.foxglove.show(*what)
        elif kind in ("state", "failed", "warnings"):
            told = {"state": live.state, "warnings": live.warnings}
            self.events.tell("state", who | told)

    def note_end(self, drive: Drive, live: str) -> None:
        """A live drive has ended: its beliefs hold until the world has those of the whole drive."""
        self._ended_live[drive.id] = live
        self.queued(drive)

    def robot_words(self) -> list[dict[str, Any]]:
        """The robots that drive, and those that are connected to."""
        words = {
            link.where.robot: {"robot": link.where.robot, "connection": link.state}
            for link in self.links
        }
        for live in self.robots.driving():
            words[live.robot] = words.get(live.robot, {}) | live.words()
        return [words[robot] for robot in sorted(words)]

    def note_drive(self, drive: Drive) -> None:
        """Tell who listens of a drive, and count one that has ended."""
        if drive.state in (DONE, FAILED) and drive.ended_ns is not None:
            told = drive.summary or {}
            seconds = (told.get("timings") or {}).get("elapsed_seconds", 0.0)
            scans = (told.get("counts") or {}).get("Scan", 0)
            self.metrics.note_drive(drive.state, seconds, scans, told.get("lost_share") or 0.0)
            if drive.id in self._ended_live:
                self.believed.forget(self._ended_live.pop(drive.id))
        self.events.add(("drive", drive.words()))

    async def follow(self) -> None:
        """Take in what any process of the service has acknowledged. Raises WorldError."""
        count = self._taught.count
        if count != self._followed:
            await asyncio.to_thread(self.believed.refresh)
            self._followed = count

    def note_taught(self) -> None:
        """Let every process of the service answer by what this one taught the world."""
        self._taught.note()
        self.refresh()

    def refresh(self) -> None:
        """Take in what the world was taught, and tell who listens. Raises WorldError."""
        self.believed.refresh()
        self.telling.tell(self.believed.now)

    def plan(self) -> dict[str, Any]:
        """What a page draws of the building, and from when on something is stored."""
        if self._plan is None:
            self._plan = plan_words(self.building)
        with self.database.reading() as connection:
            first = connection.execute(select(func.min(BELIEFS.c.stamp_ns))).scalar()
        return self._plan | {"first_ns": first}

    def forget(self, name: str, token: str) -> None:
        """Remove all that was learnt of an object, on record. Raises Problem, WorldError."""
        known_object(self.believed.now.world, name)
        count = select(func.count()).select_from(BELIEFS).where(BELIEFS.c.object == name)
        self.store.forget(name, [deletion(token, "history", name, count.scalar_subquery())])
        self._taught.note()
        self.believed.refresh()
        self.events.add(("deleted", {"object": name}))

    def end(self) -> None:
        """The service ends; what isn't finished goes on at the next start."""
        self.watch.end()
        if self.leadership.is_ours:
            self.robots.end()
            self.processing.end()
        if self.foxglove is not None:
            self.foxglove.end()
        self.leadership.end()

    def gauges(self) -> dict[str, float]:
        """What is so now, for the metrics."""
        states = select(DRIVES.c.state, func.count()).group_by(DRIVES.c.state)
        with self.database.reading() as connection:
            counts = {state: float(count) for state, count in connection.execute(states)}
        drives = {f"drives_{state}": count for state, count in sorted(counts.items())}
        return drives | {
            "listeners": self.listeners,
            "robots_driving": len(self.robots.driving()),
            "robots_lost": sum(live.is_lost for live in self.robots.driving()),
            "objects": len(self.believed.now.world.objects),
        }
