"""The exchange of a run with a world: what is known at its start, what is new at its end."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building
from objstate.building.warping import Columns
from objstate.calibration import CalibrationOptions, LaserCorrection, Surveyed, Surveyor, Surveys
from objstate.calibration.gathering import Gathering
from objstate.calibration.walls import WallReader
from objstate.config import BuildingErrorSettings, Settings
from objstate.errors import LogError, WorldError
from objstate.estimator import Estimator
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.recording.stamps import DAY_NS
from objstate.records import Estimate, Record
from objstate.run.options import RunOptions

if TYPE_CHECKING:
    from objstate.world.adjusting import Motions
    from objstate.world.floor import FloorMemory
    from objstate.world.looks import Looks
    from objstate.world.statics import DoorStatics, Drive
    from objstate.world.store import WorldStore
    from objstate.world.surveys import KeptSurvey
    from objstate.world.widths import Edges, WidthEvidence


MOST_AHEAD = 1.0  # days by which a robot's clock may be ahead


@dataclass(frozen=True)
class WorldUse:
    """How a world took part in a run."""

    location: str
    known: int  # number of objects that it knew when the log began
    added: int  # number of beliefs that were added
    had_the_log: bool  # so that nothing was added
    unreliable: bool = False  # the run failed, so that nothing was added
    hung: int = 0  # number of doors that hang where earlier drives found them
    contradicts: bool = False  # earlier drives, by hinges or walls, which therefore weren't added
    surveyed: int = 0  # number of earlier drives to which walls and lasers were adjusted


@dataclass(frozen=True, eq=False)
class Statics:
    """What earlier drives told of what doesn't move, and the building adjusted to it."""

    drives: int  # that told of walls
    columns: Columns  # of the world's building
    walls: FloatArray  # (c, 2) m, displacements of these
    lasers: tuple[LaserCorrection, ...]  # of the log's lasers
    moved: Motions  # of the walls about each object
    told: Drive  # of doors, beside the walls about them
    hung: tuple[DoorStatics, ...]  # where these are
    building: Building  # as adjusted

    @staticmethod
    def of(
        building: Building,
        told: Drive,
        kept: Sequence[KeptSurvey],
        mounts: Mapping[str, FloatArray],
    ) -> Statics:
        """By drives; ``mounts`` (4, 4) are those of the log's lasers by frame."""
        from objstate.world.adjusting import adjusted, hung, motions
        from objstate.world.statics import rehung

        error = building.error or BuildingErrorSettings()
        columns = Columns.of(building.walls)
        surveyed = None
        walls = np.zeros((len(columns.places), 2))
        if kept:
            surveyed = Surveys(columns, error).together([each.beside(mounts) for each in kept])
            walls = surveyed.walls
        moved = motions(building, columns, walls)
        doors = tuple(hung(building, columns, walls, moved, [told])) if told else ()
        if surveyed is None:
            return Statics(0, columns, walls, (), moved, told, doors, rehung(building, doors))
        lasers = _corrections(surveyed, mounts)
        better = adjusted(building, columns, surveyed, doors)
        return Statics(len(kept), columns, walls, lasers, moved, told, doors, better)

    def of_doors(
        self, beliefs: Mapping[str, ObjectBelief], widths: Mapping[str, WidthEvidence]
    ) -> Drive:
        """What a drive in the adjusted building told of doors, beside the walls about them."""
        from objstate.world.adjusting import beside
        from objstate.world.statics import evidence_of

        places = {
            each.name: (each.hinge, each.bearing, each.leaf, each.width) for each in self.hung
        }
        nowhere = np.zeros(2), 0.0, np.zeros(2), 0.0
        found = evidence_of(beliefs, widths)
        there = {name: each.beside(*places.get(name, nowhere)) for name, each in found.items()}
        return beside(there, self.moved, -1.0)

    def of_walls(
        self, gathering: Gathering, estimator: Estimator, mounts: Mapping[str, FloatArray]
    ) -> KeptSurvey | None:
        """What it told of walls and lasers, of those in ``mounts`` (4, 4).

        None where no laser is level, or the robot was localized nowhere.
        """
        from objstate.world.surveys import KeptSurvey

        try:
            gathered = gathering.gathered(WallReader.of(estimator, CalibrationOptions()))
            survey = Surveyor.of(estimator, self.columns.displaced(self.walls)).survey(gathered)
        except LogError:
            return None
        off = {each.frame: each.told_correction for each in self.lasers}
        survey = survey.beside(off, self.walls)
        return KeptSurvey(survey, {frame: mounts[frame] for frame in survey.lasers})


def _check_clock(begin_ns: int) -> None:
    """Raise WorldError for a log from the future, which would outdate all that a world learns."""
    ahead = (begin_ns - time.time_ns()) / DAY_NS
    if ahead > MOST_AHEAD:
        raise WorldError(
            f"The log begins {ahead:.0f} days ahead of this machine's clock, and a world takes its "
            "latest drive for what is believed now. Correct the log's stamps or the clock, or "
            "estimate it without a world."
        )


def _corrections(walls: Surveyed, mounts: Mapping[str, FloatArray]) -> tuple[LaserCorrection, ...]:
    """Of the log's lasers, as far as earlier drives had them."""
    below = CalibrationOptions().told_below
    known = sorted(mounts.keys() & set(walls.lasers))
    return tuple(walls.correction(frame, mounts[frame], below) for frame in known)


@dataclass(eq=False)
class Memory:
    """A world during one run; it observes the drive."""

    store: WorldStore
    digest: str  # of the log
    begin_ns: int
    known: dict[str, ObjectBelief]  # about objects seen before, predicted to the log's start
    looks: Looks
    settings: Settings  # those of the run, with the objects' habits at the log's start
    mounts: Mapping[str, FloatArray]  # (4, 4) of the log's lasers by frame, by its first scans
    statics: Statics
    gathering: Gathering
    edges: Edges
    lost_since_ns: int | None = None  # latest time at which the robot was lost

    @staticmethod
    def opened(
        location: str | Path,
        building: Building,
        settings: Settings,
        digest: str,
        begin_ns: int,
        mounts: Mapping[str, FloatArray],
    ) -> Memory:
        """What the world knows when the log begins, without what it learnt from this log.

        ``mounts`` (4, 4) are those of the log's lasers by frame. Raises WorldError.
        """
        from objstate.world.driving import drive_settings
        from objstate.world.looks import Looks
        from objstate.world.store import open_store
        from objstate.world.widths import Edges

        _check_clock(begin_ns)
        store = open_store(location, building)
        store.check_writable()
        world = store.load(
            settings,
            objects=building.objects,
            since_ns=begin_ns,
            until_ns=begin_ns,
            without=digest,
        )
        then = world.at(begin_ns)
        known = {name: then[name] for name in world.histories}
        told, surveys = store.statics(without=digest), store.surveys(without=digest)
        statics = Statics.of(building, told, surveys, mounts)
        return Memory(
            store,
            digest,
            begin_ns,
            known,
            Looks(begin_ns),
            drive_settings(world, begin_ns),
            mounts,
            statics,
            Gathering(CalibrationOptions()),
            Edges(statics.building, settings.beam_model),
        )

    @property
    def building(self) -> Building:
        """Adjusted to what earlier drives told."""
        return self.statics.building

    def options(self, run: RunOptions) -> RunOptions:
        """Those of a run, with objects' habits, and with lasers where earlier drives found them."""
        found = {each.frame: each.corrected_mount for each in self.statics.lasers}
        return replace(run, settings=self.settings, mounts={**run.mounts, **found})

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Record a belief, or its withdrawal while the robot is lost."""
        self.gathering.note(record, estimator)
        self.edges.note(record, estimator, estimates)
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
        estimator: Estimator,
        mounts: Mapping[str, FloatArray],
        floor: FloorMemory | None = None,
    ) -> WorldUse:
        """Add what was learnt, unless the world has the log, and its grid.

        ``mounts`` (4, 4) are those with which the log's lasers were read, by frame. Raises
        WorldError.
        """
        from objstate.world.statics import contradicts
        from objstate.world.store import DriveEntry

        doors = self.statics.of_doors(estimator.objects, self.edges.told)
        survey = self.statics.of_walls(self.gathering, estimator, {**mounts, **self.mounts})
        is_other = contradicts(self.statics.told, doors) or self._contradicts(survey)
        kept = self.looks.beliefs
        is_new = self.store.add(
            DriveEntry(self.digest, self.begin_ns, end_ns, settings),
            kept,
            floor,
            statics={} if is_other else doors,
            survey=None if is_other else survey,
        )
        return WorldUse(
            self.store.location,
            len(self.known),
            len(kept) if is_new else 0,
            had_the_log=not is_new,
            hung=len(self.statics.hung),
            contradicts=is_other,
            surveyed=self.statics.drives,
        )

    def left_alone(self) -> WorldUse:
        """Add nothing, since the run isn't reliable; the log may be estimated again."""
        return WorldUse(
            self.store.location,
            len(self.known),
            0,
            had_the_log=False,
            unreliable=True,
            hung=len(self.statics.hung),
            surveyed=self.statics.drives,
        )

    def _contradicts(self, survey: KeptSurvey | None) -> bool:
        """Whether walls are elsewhere than all earlier drives found them."""
        if survey is None:
            return False
        before = self.store.surveys(without=self.digest)
        surveys = [each.beside(survey.mounts) for each in (*before, survey)]
        error = self.building.error or BuildingErrorSettings()
        return Surveys(self.statics.columns, error).contradicting(surveys) == len(before)
