"""A building adjusted to all drives through it, and the files that say so.

Walls and lasers come first: each drive is surveyed once, and all surveys are put together. Then each
new drive is estimated in the building whose walls stand right, and tells where doors hang.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from objstate.building import load_building
from objstate.building.digest import geometry_digest
from objstate.building.model import Building
from objstate.building.sidecar import sidecar_of
from objstate.building.urdf import urdf_of
from objstate.building.warping import Columns
from objstate.building.writing import (
    CALIBRATION,
    DECISIONS_FILE,
    LEARN_FILE,
    REPORT_FILE,
    check_output,
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
from objstate.discovery.drives import distinct_logs
from objstate.discovery.refining_report import report_of
from objstate.discovery.told import Told, learn_text, told_before
from objstate.errors import LogError
from objstate.geometry import FloatArray
from objstate.outputs import claimed
from objstate.processes import Each, default_workers, lasting
from objstate.run import BuildingInput, RunOptions, open_run, unknown_start
from objstate.run.calibrating import survey_log
from objstate.run.doubts import doubts_of_robot, failures
from objstate.run.drive import Drive as GoneThrough
from objstate.world.adjusting import adjusted, beside, hung, motions, places_beside
from objstate.world.places import Places, PlaceStatics, places_of, put_together
from objstate.world.statics import DoorStatics, Drive, contradicting, evidence_of
from objstate.world.surveys import is_same
from objstate.world.widths import Edges

SURVEYING = 0.5  # of the whole work
# of an edited folder, with its drives: learnt doors are the given building's, not the edited ones
GO_ON = (
    "copy the folder {out} to EDITED, remove {out}/{decisions}, learn again, and go on editing with "
    "'objstate building edit {out} --out EDITED'"
)

Report = Callable[[float], None]  # share of all drives done
Result = TypeVar("Result")


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
    warnings: tuple[str, ...] = ()  # of drives, and why some are left out


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
    again, and what they told of doors follows the walls about them. Drives in which the robot was
    lost for most of the time are left out. Raises BuildingError, SettingsError, ResultError, and
    LogError, also where no drive is left.
    """
    with claimed(out):
        return _refined(
            logs, building, Path(out), run or RunOptions(), jobs, overwrite, on_progress
        )


def _refined(
    logs: Sequence[str | Path],
    building: str | Path,
    target: Path,
    run: RunOptions,
    jobs: int | None,
    overwrite: bool,
    on_progress: Report | None,
) -> Refined:
    building = urdf_of(Path(building))
    model = BuildingInput.read(building).model
    digest, columns = geometry_digest(model), Columns.of(model.walls)
    error = model.error or BuildingErrorSettings()
    before = told_before(target, digest)
    _check_target(target, building, overwrite, goes_on=before is not None)
    old = before or []
    fresh, warnings = distinct_logs(logs, run, {told.digest for told in old})
    surveys = Surveys(columns, error)
    with lasting(min(jobs or default_workers(), len(fresh))) as each:
        surveyed = each(partial(_surveyed, Path(building), run, fresh), list(fresh))
        new = list(_counted(surveyed, len(fresh), 0.0, SURVEYING, on_progress))
        fitted = _fitted(each, partial(_hung, Path(building), run), surveys, old, new, on_progress)
    walls, lasers, out_of_line = fitted.walls, fitted.lasers, fitted.out_of_line
    moved = motions(model, columns, walls.walls)
    told = [
        *old,
        *(
            replace(
                one,
                doors=beside(each.doors, moved, -1.0),
                furniture=places_beside(each.furniture, moved, -1.0),
            )
            for one, each in zip(fitted.new, fitted.hung, strict=True)
        ),
    ]
    if out_of_line is None:
        out_of_line = contradicting([one.doors for one in told])
    counting = _but(told, out_of_line)
    doors = hung(model, columns, walls.walls, moved, [one.doors for one in counting])
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
        (*warnings, *fitted.warnings),
    )


def _check_target(target: Path, building: str | Path, overwrite: bool, *, goes_on: bool) -> None:
    """Raise BuildingError where nothing may be written to a folder, or learnt on from it."""
    if goes_on:
        cure = GO_ON.format(out=target, decisions=DECISIONS_FILE)
        check_output(target, True, building, cure=cure)
    else:
        check_output(target, overwrite, building)


@dataclass(frozen=True, eq=False)
class _Fitted:
    """Walls and lasers by all drives, and what new ones tell of doors among these walls."""

    walls: Surveyed
    lasers: tuple[LaserCorrection, ...]
    out_of_line: int | None  # the number of the drive that contradicts all others
    new: list[Told]
    hung: list[_Hung]  # of each of these
    warnings: list[str]


def _fitted(
    each: Each,
    hang: Callable[[FloatArray, Sequence[LaserCorrection], Path], _Hung],
    surveys: Surveys,
    old: list[Told],
    new: list[Told],
    report: Report | None,
) -> _Fitted:
    """Put all surveys together, and estimate the new drives; those that were lost are left out.

    Raises LogError where no drive is left.
    """
    told = [*old, *new]
    out_of_line = surveys.contradicting([one.survey for one in told])
    walls = surveys.together([one.survey for one in _but(told, out_of_line)])
    lasers = _corrections(walls, told)
    hanging = each(partial(hang, walls.walls, lasers), [Path(one.log) for one in new])
    hung = list(_counted(hanging, len(new), SURVEYING, 1.0, report))
    pairs = list(zip(new, hung, strict=True))
    failed = [f"{one.log}: {text}" for one, got in pairs for text in got.failures]
    if not failed:
        warnings = [f"{one.log}: {text}" for one, got in pairs for text in got.warnings]
        return _Fitted(walls, lasers, out_of_line, new, hung, warnings)
    right = [one for one, got in pairs if not got.failures]
    if not (old or right):
        raise LogError(failed[0])
    # the drives that are left out have displaced walls and lasers for all others
    again = _fitted(each, hang, surveys, old, right, None)
    return replace(again, warnings=[f"{text} It is left out." for text in failed] + again.warnings)


@dataclass(frozen=True, eq=False)
class _Hung:
    """What one drive told of doors and furniture, and why it is to be doubted."""

    doors: Drive
    furniture: Places
    failures: Sequence[str]  # why nothing of it counts
    warnings: Sequence[str]


def _but(told: Sequence[Told], number: int | None) -> list[Told]:
    return [one for k, one in enumerate(told) if k != number]


def _counted(
    results: Iterable[Result], count: int, begin: float, end: float, report: Report | None
) -> Iterator[Result]:
    """The results, and how far the work has come with each."""
    for number, each in enumerate(results, start=1):
        yield each
        if report is not None:
            report(begin + (end - begin) * number / count)


def _surveyed(building: Path, run: RunOptions, digests: Mapping[Path, str], log: Path) -> Told:
    """What one drive tells of walls and lasers. Raises LogError and others."""
    try:
        survey, mounts = survey_log(log, load_building(building), run)
    except LogError as error:
        raise error if str(log) in str(error) else LogError(f"{log}: {error}") from error
    # as it is read again, so that going on gives the same
    survey = Survey.read(survey.words())
    return Told(str(log), digests[log], mounts, survey, {}, {})


def _hung(
    building: Path,
    run: RunOptions,
    walls: FloatArray,
    lasers: Sequence[LaserCorrection],
    log: Path,
) -> _Hung:
    """What one drive tells of doors and furniture, where the walls' columns are displaced.

    Lasers are mounted as corrected. Raises LogError.
    """
    model = BuildingInput.read(building).model
    model = replace(model, walls=Columns.of(model.walls).warped(walls))
    mounts = {**run.mounts, **{laser.frame: laser.corrected_mount for laser in lasers}}
    records, estimator = open_run([log], model, replace(run, mounts=mounts))
    edges, gone = Edges(model, estimator.settings.beam_model), GoneThrough()
    for record in records:
        estimates = estimator.feed(record)
        edges.note(record, estimator, estimates)
        gone.note(record, estimator, estimates)
    if not gone.stamps_ns:
        raise LogError(f"{log}: {unknown_start(records, run)}")
    return _Hung(
        evidence_of(estimator.objects, edges.told),
        places_of(estimator.objects, estimator.settings),
        failures(gone, estimator, run),
        doubts_of_robot(gone, estimator, run),
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


def _hinged(building: Building) -> list[str]:
    return [name for name, item in building.objects.items() if item.kind.value != "planar"]
