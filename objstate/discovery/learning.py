"""A building with its doors, learnt from a map and drives, and the files that say so."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
from objstate.building.occupancy import read_map
from objstate.building.sidecar import sidecar_of
from objstate.building.writing import DOORS_FILE, LEARN_FILE, check_output, write_buildings
from objstate.config import BuildingErrorSettings, DoorErrorSettings
from objstate.discovery.candidates import Candidate, Finding, find_doors
from objstate.discovery.drives import distinct_logs
from objstate.discovery.gathering import Beams, gather
from objstate.run import RunOptions

NAME = "building"  # of what is written

LOCALIZING = 0.5  # of the whole work, on average

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
    overwrite: bool = False,
    on_progress: Report | None = None,
) -> Learnt:
    """Find the doors of a map in drives, and write the building that has them to ``out``.

    Each log is a drive of its own; one that is given twice counts once. ``out`` gets
    ``building.urdf`` with its sidecar, ``doors.csv`` with all candidates, and ``learn.json``, whole
    or not at all. Raises BuildingError, SettingsError, LogError and ResultError.
    """
    run, target = run or RunOptions(), Path(out)
    check_output(target, overwrite, map_yaml)
    digests, warnings = distinct_logs(logs, run)
    paths = list(digests)
    plan = replace(read_map(Path(map_yaml)), name=NAME)
    walls = building_of_map(plan)
    drives: list[Beams] = []
    seconds = 0.0
    for number, log in enumerate(paths):
        begun, before = LOCALIZING * number / len(paths), seconds

        def gathered(share: float, s: float, begun: float = begun, before: float = before) -> None:
            nonlocal seconds
            seconds = before + s
            if on_progress is not None:
                on_progress(begun + LOCALIZING * share / len(paths), seconds)

        drives.append(gather(log, walls, run, gathered))

    def weighed(share: float) -> None:
        if on_progress is not None:
            on_progress(LOCALIZING + (1.0 - LOCALIZING) * share, seconds)

    found = find_doors(plan, walls, Beams.joined(drives), run.settings.beam_model, weighed)
    candidates = found.candidates
    probable = [each for each in candidates if each.door.is_probable]
    building = building_of_map(plan, [each.door for each in probable])
    error = building.error or BuildingErrorSettings()
    error = error.model_copy(update={"doors": {each.door.name: _error(each) for each in probable}})
    about = _about(map_yaml, paths, drives, found)
    beside = {
        DOORS_FILE: candidates_table(candidates),
        LEARN_FILE: json.dumps(about, indent=1) + "\n",
    }
    urdf = write_buildings(target, {".": building}, {".": sidecar_of(error)}, beside)[0]
    return Learnt(urdf, candidates, found.openings, len(found.passed_over), tuple(warnings))


def _error(found: Candidate) -> DoorErrorSettings:
    """How far a door may be off."""
    return DoorErrorSettings(
        hinge_std_m=found.hinge_deviation,
        bearing_std_deg=math.degrees(found.bearing_std),
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


def _about(
    map_yaml: str | Path, logs: Sequence[str | Path], drives: list[Beams], found: Finding
) -> dict[str, Any]:
    return {
        "map": str(map_yaml),
        "drives": [
            {"log": str(log), "scans": int(beams.scan.max()) + 1, "beams": len(beams)}
            for log, beams in zip(logs, drives, strict=True)
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
