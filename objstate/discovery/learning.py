"""A building with its doors, learnt from a map and drives, and the files that say so."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from objstate.building.door_table import (
    BEARING_STD,
    HINGE_STD,
    PROBABILITY,
    SIDE,
    TYPE,
    WIDTH_STD,
    door_rows,
)
from objstate.building.from_map import building_of_map
from objstate.building.model import Building
from objstate.building.occupancy import OccupancyMap, read_map
from objstate.building.sidecar import sidecar_of
from objstate.building.writing import DOORS_FILE, LEARN_FILE, check_output, write_buildings
from objstate.config import BuildingErrorSettings, DoorErrorSettings
from objstate.discovery.candidates import Candidate, Finding, find_doors
from objstate.discovery.drives import distinct_logs
from objstate.discovery.gathering import Beams, Gathered, gather
from objstate.errors import LogError
from objstate.outputs import claimed
from objstate.processes import Each, default_workers, lasting
from objstate.run import RunOptions

NAME = "building"  # of what is written

# from which share of the whole work to which, on average
LOCALIZING, FINDING = (0.0, 0.3), (0.3, 0.5)
LOCALIZING_AGAIN, FINDING_AGAIN = (0.5, 0.8), (0.8, 1.0)
OFTEN_LOST = 0.05  # of a drive, from which on another model of the building may place more of it
NOWHERE = "The robot was localized nowhere: is it a log of this building, and is the start right?"

Report = Callable[[float, float], None]  # share of all done, seconds of logs done


@dataclass(frozen=True, eq=False)
class Learnt:
    """What was written, and what was found."""

    urdf: Path
    candidates: list[Candidate]
    openings: int  # number of openings in the walls' lines
    passed_over: int  # those that weren't weighed, since their lines hardly are walls
    warnings: tuple[str, ...] = ()


def learn_doors(
    logs: Sequence[str | Path],
    map_yaml: str | Path,
    out: str | Path,
    run: RunOptions | None = None,
    *,
    jobs: int | None = None,
    overwrite: bool = False,
    on_progress: Report | None = None,
) -> Learnt:
    """Find the doors of a map in drives, and write the building that has them to ``out``.

    Each log is a drive of its own; one that is given twice counts once. So many processes share the
    work out as there are ``jobs``, by default one for each core; they import the script that calls
    this, which has to guard what it does by ``if __name__ == "__main__":``. ``out`` gets
    ``building.urdf`` with its sidecar, ``doors.csv`` with all candidates, and ``learn.json``, whole
    or not at all. Raises BuildingError, SettingsError, LogError and ResultError.
    """
    run, target = run or RunOptions(), Path(out)
    check_output(target, overwrite, map_yaml)
    with claimed(target):
        digests, warnings = distinct_logs(logs, run)
        plan = replace(read_map(Path(map_yaml)), name=NAME)
        walls = building_of_map(plan)
        with lasting(jobs or default_workers()) as in_each:
            work = _Work(plan, walls, run, on_progress, in_each)
            drives = work.localized(list(digests), walls, *LOCALIZING)
            found = work.weighed(drives, *FINDING)
            # among doors that were moved since, or in rooms that were closed, a map misleads
            if again := [log for log, drive in drives.items() if drive.lost_share > OFTEN_LOST]:
                drives |= work.localized(again, _with_doors(plan, found), *LOCALIZING_AGAIN)
                found = work.weighed(drives, *FINDING_AGAIN)
        warnings += [
            f"{log}: {NOWHERE} It is left out." for log in drives if not len(drives[log].beams)
        ]
        about = _about(map_yaml, drives, found)
        beside = {
            DOORS_FILE: candidates_table(found.candidates),
            LEARN_FILE: json.dumps(about, indent=1) + "\n",
        }
        building = _with_doors(plan, found)
        sidecar = sidecar_of(building.error or BuildingErrorSettings())
        urdf = write_buildings(target, {".": building}, {".": sidecar}, beside)[0]
        return Learnt(
            urdf, found.candidates, found.openings, len(found.passed_over), tuple(warnings)
        )


@dataclass(frozen=True, eq=False)
class _Work:
    """Steps of the work, each from a share of the whole to another."""

    plan: OccupancyMap
    walls: Building
    run: RunOptions
    report: Report | None
    in_each: Each
    done: dict[Path, float] = field(default_factory=dict)  # s of each log that was localized

    def localized(
        self, logs: Sequence[Path], building: Building, begin: float, end: float
    ) -> dict[Path, Gathered]:
        """What drives saw, localized in a building. Raises LogError."""

        def told(number: int, share: float, seconds: float) -> None:
            self.done[logs[number]] = seconds
            self._tell(begin, end, (number + share) / len(logs))

        if len(logs) == 1 or self.in_each is map:  # then a drive can tell how far it is
            each = enumerate(logs)
            seen: Iterator[Gathered] = (
                gather(log, building, self.run, partial(told, number)) for number, log in each
            )
        else:
            seen = self.in_each(partial(gather, building=building, run=self.run), logs)
        found = {}
        for number, drive in enumerate(seen):
            found[logs[number]] = drive
            told(number, 1.0, float(drive.beams.seconds.max(initial=0.0)))
        return found

    def weighed(self, drives: Mapping[Path, Gathered], begin: float, end: float) -> Finding:
        """The doors in what they saw. Raises LogError where that is nothing."""
        beams = Beams.joined([each.beams for each in drives.values()])
        if not len(beams):
            raise LogError(f"{', '.join(map(str, drives))}: {NOWHERE}")
        settings = self.run.settings.beam_model
        tell = partial(self._tell, begin, end)
        return find_doors(self.plan, self.walls, beams, settings, tell, self.in_each)

    def _tell(self, begin: float, end: float, share: float) -> None:
        if self.report is not None:
            self.report(begin + (end - begin) * share, sum(self.done.values()))


def _with_doors(plan: OccupancyMap, found: Finding) -> Building:
    """The building of a map with its probable doors, and how far they may be off."""
    probable = [each for each in found.candidates if each.door.is_probable]
    building = building_of_map(plan, [each.door for each in probable])
    error = building.error or BuildingErrorSettings()
    own = {each.door.name: _error(each) for each in probable}
    return replace(building, error=error.model_copy(update={"doors": own}))


def _error(found: Candidate) -> DoorErrorSettings:
    """How far a door may be off."""
    return DoorErrorSettings(
        hinge_std_m=found.hinge_deviation,
        bearing_std_deg=math.degrees(found.bearing_std),
        width_std_m=found.width_std,
        stop_is_known=found.door.slides or found.door.upper < math.pi,
    )


def candidates_table(candidates: Sequence[Candidate]) -> str:
    """A door table with the probability and the deviations of each candidate."""
    told = {
        each.door.name: {
            PROBABILITY: round(each.probability, 4),
            SIDE: round(each.side_probability, 4),
            HINGE_STD: round(each.hinge_deviation, 4),
            BEARING_STD: round(math.degrees(each.bearing_std), 2),
            WIDTH_STD: round(each.width_std, 4),
            TYPE: each.door.type,
        }
        for each in candidates
    }
    return door_rows([each.door for each in candidates], told)


def _about(map_yaml: str | Path, drives: Mapping[Path, Gathered], found: Finding) -> dict[str, Any]:
    return {
        "map": str(map_yaml),
        "drives": [
            {"log": str(log), "scans": len(drive.beams.scans) - 1, "beams": len(drive.beams)}
            for log, drive in drives.items()
        ],
        "doors": [
            {
                "door": each.door.name,
                "probability": round(each.probability, 4),
                "log_odds": round(each.log_odds, 2),
                "hinge_std_along_m": round(float(each.hinge_std[0]), 4),
                "hinge_std_across_m": round(float(each.hinge_std[1]), 4),
                **_states(each),
            }
            for each in found.candidates
        ],
        "openings": found.openings,
        "passed_over": [
            {
                "middle_m": [round(float(value), 2) for value in each.middle],
                "width_m": round(each.width, 2),
                "p_wall": round(each.p_wall, 4),
            }
            for each in found.passed_over
        ],
    }


def _states(found: Candidate) -> dict[str, list[float]]:
    """How far a door was open in each look."""
    if found.door.slides:
        return {"open_m": [round(way, 3) for way in found.angles]}
    return {"angles_deg": [round(math.degrees(angle), 1) for angle in found.angles]}
