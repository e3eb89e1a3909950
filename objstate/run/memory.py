"""The exchange of a run with a world: beliefs at its start, new ones at its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building
from objstate.config import BuildingErrorSettings, Settings
from objstate.estimator import Estimator
from objstate.objects import ObjectBelief
from objstate.records import Estimate, Record

if TYPE_CHECKING:
    from objstate.world.floor import FloorMemory
    from objstate.world.looks import Looks
    from objstate.world.statics import DoorStatics, Drive
    from objstate.world.store import WorldStore


@dataclass(frozen=True)
class WorldUse:
    """How a world took part in a run."""

    location: str
    known: int  # number of objects that it knew when the log began
    added: int  # number of beliefs that were added
    had_the_log: bool  # so that nothing was added
    hung: int = 0  # number of doors that hang where earlier drives found them
    contradicts: bool = False  # earlier drives, by its hinges, which therefore weren't added


@dataclass(eq=False)
class Memory:
    """A world during one run; it observes the drive."""

    store: WorldStore
    digest: str  # of the log
    begin_ns: int
    known: dict[str, ObjectBelief]  # about objects seen before, predicted to the log's start
    looks: Looks
    settings: Settings  # those of the run, with the objects' habits at the log's start
    building: Building  # with its doors where earlier drives found them
    statics: Drive  # what these told of them
    hung: tuple[DoorStatics, ...]  # and where they are
    lost_since_ns: int | None = None  # latest time at which the robot was lost

    @staticmethod
    def opened(
        location: str | Path, building: Building, settings: Settings, digest: str, begin_ns: int
    ) -> Memory:
        """The world's beliefs when the log begins, without what it learnt from this log.

        Raises WorldError.
        """
        from objstate.world.driving import drive_settings
        from objstate.world.looks import Looks
        from objstate.world.statics import combined, rehung
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
        statics = store.statics(without=digest)
        hung = combined([statics], building.error or BuildingErrorSettings()) if statics else []
        return Memory(
            store,
            digest,
            begin_ns,
            known,
            Looks(begin_ns),
            driving,
            rehung(building, hung),
            statics,
            tuple(hung),
        )

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Record a belief, or its withdrawal while the robot is lost."""
        lost = estimator.lost
        if lost and lost[-1][0] != self.lost_since_ns:
            self.lost_since_ns = lost[-1][0]
            self.looks.take_back(self.lost_since_ns, estimator.objects.values())
        observed = {each.object: each.stamp_ns for each in estimates if each.observed}
        self.looks.note(estimator.object_at(name, observed[name]) for name in sorted(observed))

    def keep(
        self,
        end_ns: int,
        settings: Settings,
        beliefs: Mapping[str, ObjectBelief],
        floor: FloorMemory | None = None,
    ) -> WorldUse:
        """Add what was learnt, unless the world has the log, and its grid.

        ``beliefs`` are those at the end, which tell of hinges. Raises WorldError.
        """
        from objstate.world.statics import contradicts, evidence_of
        from objstate.world.store import DriveEntry

        places = {each.name: (each.hinge, each.bearing, each.leaf) for each in self.hung}
        nowhere = np.zeros(2), 0.0, np.zeros(2)
        statics = {
            name: each.beside(*places.get(name, nowhere))
            for name, each in evidence_of(beliefs).items()
        }
        is_other = contradicts(self.statics, statics)

        kept = self.looks.beliefs
        drive = DriveEntry(self.digest, self.begin_ns, end_ns, settings)
        is_new = self.store.add(drive, kept, floor, statics={} if is_other else statics)
        return WorldUse(
            self.store.location,
            len(self.known),
            len(kept) if is_new else 0,
            had_the_log=not is_new,
            hung=len(self.hung),
            contradicts=is_other,
        )
