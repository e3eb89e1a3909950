"""A building's doors, adjusted to all drives that passed them, and the files that say so."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import yaml

from objstate.building.digest import geometry_digest
from objstate.building.model import Building
from objstate.building.writing import LEARN_FILE, check_target, write_buildings
from objstate.config import BuildingErrorSettings
from objstate.errors import BuildingError
from objstate.run import BuildingInput, RunOptions, open_run
from objstate.run.inputs import describe_log, log_identity
from objstate.world.statics import (
    DoorEvidence,
    DoorStatics,
    Drive,
    combined,
    contradicting,
    evidence_of,
    rehung,
)

FORM = 1  # of what is written to LEARN_FILE

Report = Callable[[float], None]  # share of all drives done


@dataclass(frozen=True, eq=False)
class Told:
    """What one drive told."""

    log: str
    digest: str
    doors: Drive


@dataclass(frozen=True, eq=False)
class Refined:
    """What was written, and what was learnt."""

    urdf: Path
    doors: list[DoorStatics]
    drives: int  # that count
    left_out: tuple[str, ...] = ()  # logs of drives that contradict the others
    silent: tuple[str, ...] = field(default=())  # doors of which no drive tells


def refine_building(
    logs: Sequence[str | Path],
    building: str | Path,
    out: str | Path,
    run: RunOptions | None = None,
    *,
    jobs: int | None = None,
    overwrite: bool = False,
    on_progress: Report | None = None,
) -> Refined:
    """Learn from drives where a building's doors hang, and write a better building to ``out``.

    Each log is a drive of its own, and ``jobs`` are done at a time. ``out`` gets the building with
    its sidecar, in which each door has its own deviations, and ``learn.json``, whole or not at all.
    A folder that was learnt of the same building before is gone on from: drives that it knows are
    not read again. Raises BuildingError, SettingsError, LogError and ResultError.
    """
    run, target = run or RunOptions(), Path(out)
    read = BuildingInput.read(building)
    digest = geometry_digest(read.model)
    before = _before(target, digest)
    if before is None:
        check_target(target, overwrite)
    known = {told.digest for told in before or ()}
    fresh = [log for log in map(Path, logs) if _digest(log, run) not in known]
    told = [*(before or ()), *_all_told(fresh, Path(building), run, jobs, on_progress)]
    out_of_line = contradicting([each.doors for each in told])
    counting = [each for k, each in enumerate(told) if k != out_of_line]
    error = read.model.error or BuildingErrorSettings()
    doors = combined([each.doors for each in counting], error)
    better = rehung(read.model, doors)
    about = _about(str(building), digest, told, out_of_line, doors)
    urdf = write_buildings(
        target,
        {".": better},
        {".": _sidecar(better)},
        {LEARN_FILE: json.dumps(about, indent=1) + "\n"},
    )[0]
    left_out = () if out_of_line is None else (told[out_of_line].log,)
    silent = tuple(sorted(set(_hinged(read.model)) - {each.name for each in doors}))
    return Refined(urdf, doors, len(counting), left_out, silent)


def _all_told(
    logs: Sequence[Path],
    building: Path,
    run: RunOptions,
    jobs: int | None,
    on_progress: Report | None,
) -> Iterator[Told]:
    """What each drive tells, in the order of the logs whatever the number of jobs."""
    count = min(jobs or os.cpu_count() or 1, len(logs))
    if count <= 1:
        for number, log in enumerate(logs):
            yield _told(log, building, run)
            _report(on_progress, number + 1, len(logs))
        return
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        running = [pool.submit(_told, log, building, run) for log in logs]
        for number, each in enumerate(running):
            yield each.result()
            _report(on_progress, number + 1, len(logs))


def _report(on_progress: Report | None, done: int, count: int) -> None:
    if on_progress is not None:
        on_progress(done / count)


def _told(log: Path, building: Path, run: RunOptions) -> Told:
    """What one drive tells of the doors that it passed. Raises LogError and others."""
    records, estimator = open_run([log], BuildingInput.read(building).model, run)
    for record in records:
        estimator.feed(record)
    doors = evidence_of(estimator.objects)
    return Told(str(log), _digest(log, run), doors)


def _digest(log: Path, run: RunOptions) -> str:
    return log_identity(describe_log(log), run)


def _hinged(building: Building) -> list[str]:
    return [name for name, item in building.objects.items() if item.kind.value != "planar"]


def _sidecar(building: Building) -> str:
    """The deviations of the building, and of each door that was learnt."""
    assert building.error is not None
    words = building.error.model_dump(exclude_unset=True)
    words["doors"] = {
        name: {key: round(value, 4) for key, value in own.model_dump(exclude_unset=True).items()}
        for name, own in building.error.doors.items()
    }
    head = (
        "# How far walls, hinges and lasers may be off; standard deviations. Learnt from drives.\n"
    )
    return head + yaml.safe_dump({"building_error": words}, sort_keys=False)


def _about(
    building: str,
    digest: str,
    told: Sequence[Told],
    out_of_line: int | None,
    doors: Sequence[DoorStatics],
) -> dict[str, Any]:
    return {
        "form": FORM,
        "building": building,
        "geometry_sha256": digest,
        "drives": [
            {
                "log": each.log,
                "sha256": each.digest,
                "contradicts": number == out_of_line,
                "doors": {name: door.words() for name, door in each.doors.items()},
            }
            for number, each in enumerate(told)
        ],
        "doors": [
            {
                "door": each.name,
                "drives": each.drives,
                "hinge_m": each.hinge.round(4).tolist(),
                "hinge_std_m": round(each.hinge_std, 4),
                "bearing_deg": round(math.degrees(each.bearing), 3),
                "bearing_std_deg": round(math.degrees(each.bearing_std), 3),
            }
            for each in doors
        ],
    }


def _before(out: Path, digest: str) -> list[Told] | None:
    """What earlier drives told, where ``out`` was learnt of this building; else None.

    Raises BuildingError for a folder whose file is damaged.
    """
    file = out / LEARN_FILE
    if not file.is_file():
        return None
    try:
        words = json.loads(file.read_text(encoding="utf-8"))
        if words.get("form") != FORM or words.get("geometry_sha256") != digest:
            return None
        return [
            Told(
                each["log"],
                each["sha256"],
                {name: DoorEvidence.read(door) for name, door in each["doors"].items()},
            )
            for each in words["drives"]
        ]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BuildingError(
            f"{file} can't be gone on from ({error}); remove it, or choose another folder."
        ) from error
