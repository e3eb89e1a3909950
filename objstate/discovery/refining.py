"""A building adjusted to all drives through it, and the files that say so.

Walls and lasers come first: each drive is surveyed once, and all surveys are put together. Then each
new drive is estimated in the building whose walls stand right, and tells where doors hang.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

from objstate.building import load_building
from objstate.building.digest import geometry_digest
from objstate.building.model import Building
from objstate.building.sidecar import sidecar_of
from objstate.building.warping import Columns
from objstate.building.writing import (
    CALIBRATION,
    LEARN_FILE,
    REPORT_FILE,
    check_target,
    write_buildings,
)
from objstate.calibration import (
    CalibrationOptions,
    LaserCorrection,
    Survey,
    Surveyed,
    Surveys,
    calibration_text,
)
from objstate.config import BuildingErrorSettings
from objstate.discovery.refining_report import report_of
from objstate.discovery.told import Told, learn_text, told_before
from objstate.errors import LogError
from objstate.geometry import FloatArray
from objstate.run import BuildingInput, RunOptions, open_run
from objstate.run.calibrating import survey_log
from objstate.run.inputs import describe_log, log_identity
from objstate.world.adjusting import adjusted, beside, downward, motions, places_beside
from objstate.world.places import Places, PlaceStatics, places_of, put_together
from objstate.world.statics import DoorStatics, Drive, combined, contradicting, evidence_of
from objstate.world.surveys import is_same
from objstate.world.widths import Edges

SURVEYING = 0.5  # of the whole work

Report = Callable[[float], None]  # share of all drives done
Result = TypeVar("Result")
Each = Callable[[Callable[[Path], Result], Sequence[Path]], Iterator[Result]]


@dataclass(frozen=True, eq=False)
class Refined:
    """What was written, and what was learnt."""

    urdf: Path
    doors: list[DoorStatics]
    furniture: list[PlaceStatics]
    walls: Surveyed
    lasers: tuple[LaserCorrection, ...]
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
    """Learn from drives where what is fixed is, and write a better building to ``out``.

    Each log is a drive of its own, all by one robot, and ``jobs`` are done at a time. ``out`` gets
    the building with its sidecar, in which each door has its own deviations, ``calibration.yaml``
    with the lasers' mountings, ``learn.json`` and ``report.html``, whole or not at all. A folder
    that was learnt of the same building before is gone on from: drives that it knows are not read
    again, and what they told of doors follows the walls about them. Raises BuildingError,
    SettingsError, LogError and ResultError.
    """
    run, target, model = run or RunOptions(), Path(out), BuildingInput.read(building).model
    digest, columns = geometry_digest(model), Columns.of(model.walls)
    error = model.error or BuildingErrorSettings()
    before = told_before(target, digest)
    if before is None:
        check_target(target, overwrite)
    known = {told.digest for told in before or ()}
    fresh = [log for log in map(Path, logs) if _digest(log, run) not in known]
    surveys = Surveys(columns, error)
    with _workers(jobs, len(fresh)) as each:
        surveyed = each(partial(_surveyed, Path(building), run), fresh)
        told = [*(before or ()), *_counted(surveyed, len(fresh), 0.0, SURVEYING, on_progress)]
        out_of_line = surveys.contradicting([one.survey for one in told])
        walls = surveys.together([one.survey for one in _but(told, out_of_line)])
        lasers = _corrections(walls, told)
        mounts = {**run.mounts, **{laser.frame: laser.corrected_mount for laser in lasers}}
        hang = partial(_hung, Path(building), walls.walls, replace(run, mounts=mounts))
        hung = list(_counted(each(hang, fresh), len(fresh), SURVEYING, 1.0, on_progress))
    old = len(told) - len(fresh)
    moved = motions(model, columns, walls.walls)
    fresh_told = [
        replace(one, doors=beside(doors, moved, -1.0), furniture=places_beside(places, moved, -1.0))
        for one, (doors, places) in zip(told[old:], hung, strict=True)
    ]
    told = [*told[:old], *fresh_told]
    if out_of_line is None:
        out_of_line = contradicting([one.doors for one in told])
    counting = _but(told, out_of_line)
    there = [beside(one.doors, moved, 1.0) for one in counting]
    doors = combined(there, error, downward(model))
    pieces = put_together([places_beside(one.furniture, moved, 1.0) for one in counting])
    better = adjusted(model, columns, walls, doors, pieces)
    left_out = [one for one in told if one not in counting]
    about = learn_text(str(building), digest, told, left_out, columns, walls, lasers, doors, pieces)
    page = report_of(better, columns, walls, lasers, doors, pieces, counting)
    files = {LEARN_FILE: about, CALIBRATION: calibration_text(lasers), REPORT_FILE: page}
    sidecar = sidecar_of(better.error or error)
    urdf = write_buildings(target, {".": better}, {".": sidecar}, files)[0]
    silent = tuple(sorted(set(_hinged(model)) - {door.name for door in doors}))
    return Refined(
        urdf,
        doors,
        pieces,
        walls,
        lasers,
        len(counting),
        tuple(one.log for one in left_out),
        silent,
    )


def _but(told: Sequence[Told], number: int | None) -> list[Told]:
    return [one for k, one in enumerate(told) if k != number]


@contextmanager
def _workers(jobs: int | None, most: int) -> Iterator[Each]:  # type: ignore[type-arg]
    """A map over logs, in their order, by as many processes as there are jobs."""
    count = min(jobs or os.cpu_count() or 1, most)
    if count <= 1:
        yield map
        return
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        yield pool.map


def _counted(
    results: Iterable[Result], count: int, begin: float, end: float, report: Report | None
) -> Iterator[Result]:
    """The results, and how far the work has come with each."""
    for number, each in enumerate(results, start=1):
        yield each
        if report is not None:
            report(begin + (end - begin) * number / count)


def _surveyed(building: Path, run: RunOptions, log: Path) -> Told:
    """What one drive tells of walls and lasers. Raises LogError and others."""
    survey, mounts = survey_log(log, load_building(building), run)
    # as it is read again, so that going on gives the same
    survey = Survey.read(survey.words())
    return Told(str(log), _digest(log, run), mounts, survey, {}, {})


def _hung(building: Path, walls: FloatArray, run: RunOptions, log: Path) -> tuple[Drive, Places]:
    """What one drive tells of doors and furniture, where the walls' columns are displaced.

    Raises LogError.
    """
    model = BuildingInput.read(building).model
    model = replace(model, walls=Columns.of(model.walls).warped(walls))
    records, estimator = open_run([log], model, run)
    edges = Edges(model, estimator.settings.beam_model)
    for record in records:
        edges.note(record, estimator, estimator.feed(record))
    return evidence_of(estimator.objects, edges.told), places_of(
        estimator.objects, estimator.settings
    )


def _corrections(walls: Surveyed, told: Sequence[Told]) -> tuple[LaserCorrection, ...]:
    """Of each laser's mounting. Raises LogError where drives have it at several places."""
    mounts: dict[str, tuple[FloatArray, str]] = {}
    for one in told:
        for frame, mount in one.mounts.items():
            first, log = mounts.setdefault(frame, (mount, one.log))
            if not is_same(first, mount):
                raise LogError(
                    f"Laser '{frame}' is mounted elsewhere in {one.log} than in {log}; learn from "
                    f"the drives of one robot alone, or give its mounting with --mount."
                )
    told_below = CalibrationOptions().told_below
    return tuple(walls.correction(frame, mounts[frame][0], told_below) for frame in walls.lasers)


def _digest(log: Path, run: RunOptions) -> str:
    return log_identity(describe_log(log), run)


def _hinged(building: Building) -> list[str]:
    return [name for name, item in building.objects.items() if item.kind.value != "planar"]
