"""What a run takes from a world at its start, and what it gives to it in the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.building.model import Building
from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.objects import ObjectBelief
from objstate.records import Estimate, Record

if TYPE_CHECKING:
    from objstate.world.looks import Looks
    from objstate.world.store import WorldStore


@dataclass(frozen=True)
class WorldUse:
    """How a world took part in a run."""

    location: str
    known: int  # objects of which it knew something when the log began
    added: int  # beliefs that it learnt
    had_the_log: bool  # so that nothing was added


@dataclass(eq=False)
class Memory:
    """A world as one run uses it; it watches what the drive teaches."""

    store: WorldStore
    digest: str  # of the log
    begin_ns: int
    known: dict[str, ObjectBelief]  # of objects seen before, propagated to the log's start
    looks: Looks
    settings: Settings  # those of the run, with the doors' habits at the log's start
    lost_since_ns: int | None = None  # the last time that the robot was, of those so far

    @staticmethod
    def opened(
        location: str | Path, building: Building, settings: Settings, digest: str, begin_ns: int
    ) -> Memory:
        """What the world believes when the log begins, but for what it learnt from this log.

        Raises WorldError.
        """
        from objstate.world.driving import drive_settings
        from objstate.world.looks import Looks
        from objstate.world.store import open_store

        store = open_store(location, building)
        world = store.load(
            settings,
            objects=building.objects,
            since_ns=begin_ns,
            until_ns=begin_ns,
            without=digest,
        )
        then = world.at(begin_ns)
        known = {name: then[name] for name in world.histories}
        driving = drive_settings(world, begin_ns)
        return Memory(store, digest, begin_ns, known, Looks(begin_ns), driving)

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Note what a record taught of objects, or that it was given up as the robot is lost."""
        lost = estimator.lost
        if lost and lost[-1][0] != self.lost_since_ns:
            self.lost_since_ns = lost[-1][0]
            self.looks.take_back(self.lost_since_ns, estimator.objects.values())
        observed = {each.object: each.stamp_ns for each in estimates if each.observed}
        self.looks.note(estimator.object_at(name, observed[name]) for name in sorted(observed))

    def keep(self, end_ns: int, settings: Settings) -> WorldUse:
        """Add what the drive taught, unless the world has its log. Raises WorldError."""
        from objstate.world.store import DriveEntry

        beliefs = self.looks.beliefs
        is_new = self.store.add(DriveEntry(self.digest, self.begin_ns, end_ns, settings), beliefs)
        added = len(beliefs) if is_new else 0
        return WorldUse(self.store.location, len(self.known), added, had_the_log=not is_new)
