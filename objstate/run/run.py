"""From a recorded log to a result folder, in one pass."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.building.model import Building
from objstate.errors import LogError
from objstate.estimator import Estimator
from objstate.logs import Log, open_log
from objstate.logs.containers import Paths, as_paths
from objstate.objects import ObjectBelief
from objstate.recording.candidates import CANDIDATES
from objstate.recording.events import EVENTS
from objstate.recording.grids import CLUTTER, GRID_IMAGE, GRID_MAP, ClutterWriter
from objstate.recording.posteriors import POSTERIORS, PosteriorWriter
from objstate.recording.results import result_folder
from objstate.recording.scans import SCANS, ScanWriter
from objstate.recording.summary import SUMMARY, write_summary
from objstate.recording.tables import ESTIMATES, SMOOTHED, EstimateWriter
from objstate.recording.tum import TRAJECTORY, write_tum
from objstate.records import (
    GaussianRobotBelief,
    InitialPose,
    Odometry,
    RobotBelief,
    Scan,
)
from objstate.run.doubts import doubts, failures, lost_share
from objstate.run.drive import Drive
from objstate.run.inputs import (
    BuildingInput,
    describe_log,
    describe_truth,
    log_identity,
    seen_from,
)
from objstate.run.observer import Observer
from objstate.run.options import RunOptions, check_options
from objstate.run.posteriors import PosteriorRecorder
from objstate.run.scans import ScanRecorder
from objstate.run.smoothing import write_smoothed
from objstate.run.start import check_start

if TYPE_CHECKING:
    from objstate.run.memory import Memory, WorldUse
    from objstate.world.floor import FloorMemory

FILES = (
    ESTIMATES,
    SMOOTHED,
    EVENTS,
    POSTERIORS,
    SCANS,
    TRAJECTORY,
    SUMMARY,
)  # what a result folder holds
GRID_FILES = (CLUTTER, GRID_MAP, GRID_IMAGE, CANDIDATES)  # with a grid

RECORDED_BELIEFS = (RobotBelief.__name__, GaussianRobotBelief.__name__)

Progress = Callable[[float, float], None]  # share of the log done from 0 to 1, seconds of it done

FIRST_SCANS = 10  # of one laser, by which all others have scanned as well

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunResult:
    """The outcome of a run; the estimates themselves are in ``folder``."""

    folder: Path
    objects: tuple[str, ...]  # all of the building
    begin_ns: int  # stamp of the first record
    log_seconds: float
    elapsed_seconds: float
    counts: Mapping[str, int]
    warnings: tuple[str, ...]  # the failures first
    failures: tuple[str, ...] = ()  # why its estimates aren't reliable; empty for a success
    lost_share: float = 0.0  # of the log, in which the robot was probably lost
    share_through: float = 0.0  # of the readings, which pass through walls of the building
    lost_ns: tuple[tuple[int, int], ...] = ()  # intervals in which the robot was probably lost
    lost_probabilities: tuple[float, ...] = ()  # the largest probability in each of these
    # from a stamp on, the probability of the published pose
    p_localized: tuple[tuple[int, float], ...] = ()
    # orders of rotational symmetry, for objects with several equal headings
    symmetry: Mapping[str, int] = field(default_factory=dict)
    world: WorldUse | None = None  # where one took part
    laser_heights: Mapping[str, float] = field(default_factory=dict)  # m above the floor, by frame
    odometry_error: Mapping[str, Any] = field(default_factory=dict)  # as learnt

    def to_dict(self) -> dict[str, Any]:
        """The outcome as in ``run.json``."""
        return {
            "version": version("objstate"),
            "objects": list(self.objects),
            "begin_ns": self.begin_ns,
            "timings": {
                "log_seconds": self.log_seconds,
                "elapsed_seconds": self.elapsed_seconds,
            },
            "counts": dict(self.counts),
            "success": not self.failures,
            "failures": list(self.failures),
            "lost_share": self.lost_share,
            "share_through": self.share_through,
            "warnings": list(self.warnings),
            "lost_ns": [list(stretch) for stretch in self.lost_ns],
            "lost_probabilities": list(self.lost_probabilities),
            "p_localized": [list(each) for each in self.p_localized],
            "symmetry": dict(self.symmetry),
            "world": None if self.world is None else asdict(self.world),
            "laser_heights": dict(self.laser_heights),
            "odometry_error": dict(self.odometry_error),
        }


def estimate_log(
    logs: Paths,
    building: str | Path | BuildingInput,
    out: str | Path,
    options: RunOptions | None = None,
    *,
    world: str | Path | None = None,
    overwrite: bool = False,
    on_progress: Progress | None = None,
    observers: Sequence[Observer] = (),
    truth: str | Path | None = None,
    true_path: str | Path | None = None,
    mcap: bool = False,
    grid: bool = False,
    on_finish: Callable[[Path, Building, RunResult], None] | None = None,
) -> RunResult:
    """Estimate every object's state from one drive, recorded in one or several logs.

    ``logs`` are paths, or one, and ``building`` is that of a URDF, or what ``BuildingInput.read``
    read of it before, so that many logs share it. Writes
    ``estimates.parquet``, ``smoothed.parquet``, ``events.parquet``, ``posteriors.parquet``,
    ``scans.parquet``, ``trajectory.tum`` and ``run.json`` into the new folder ``out``, whole or not
    at all. With a ``world``, a path or a PostgreSQL URL, it starts from the world's beliefs when
    the log begins, and adds what was learnt, once for each log; a run with ``failures`` adds
    nothing. ``observers`` receive all records.
    ``truth`` and ``true_path`` are not used to estimate, but are named in ``run.json``, where a
    report finds them. With ``mcap``, ``estimates.mcap`` holds the run as a scene for Foxglove and
    RViz, the truth beside it. With ``grid``, ``clutter.parquet`` holds obstacles that are not in
    the building, ``grid.yaml`` and ``grid.pgm`` the map at the end, and ``candidates.json`` what
    may be an object. ``on_finish`` may write more into the folder that it is given.

    Raises ResultError, BuildingError, SettingsError, LogError, TruthError or WorldError, and
    TypeError for a building, options or a world that are none of the above.
    """
    began = time.monotonic()
    options = RunOptions() if options is None else options
    check_options(options)
    log_paths = as_paths(logs)
    with result_folder(out, overwrite=overwrite) as folder:
        read = building if isinstance(building, BuildingInput) else BuildingInput.read(building)
        model = read.model
        logger.info("%s: %d movable objects", model.name, len(model.objects))
        check_start(options, model)
        log = _opened(log_paths, options)
        truths = describe_truth(truth, true_path)
        described = [file for path in log_paths for file in describe_log(path)]
        memory, known, driving = None, None, options
        if world is not None:
            memory = _memory(world, model, log, options, log_identity(described, options))
            model, known, driving = memory.building, memory.known, memory.options(options)
            log = _opened(log_paths, driving)
        estimator = make_estimator(model, driving, known, history=True)
        observers = (*observers, *([] if memory is None else [memory]))
        with ExitStack() as files:
            floor = None
            if grid:
                from objstate.run.floor import Floor

                floor = Floor(model, options.settings, files.enter_context(ClutterWriter(folder)))
                observers = (*observers, floor)
            if mcap:
                from objstate.run.scene.recorder import record_scene

                scene = record_scene(folder, model, truth, true_path, floor)
                observers = (*observers, files.enter_context(scene))
            drive = _drive_through(log, estimator, folder, observers, on_progress)
        logger.info("%d scans gave %d estimates", drive.scans, drive.estimates)
        _check_robot(drive, log, options)
        write_smoothed(folder, estimator.histories)
        write_tum(folder / TRAJECTORY, drive.path)
        left = None
        if floor is not None:
            floor.write(folder, drive.end_ns, estimator)
            left = floor.memory(drive.end_ns)
        failed = failures(drive, estimator, options)
        result = RunResult(
            folder=Path(out),
            objects=tuple(model.objects),
            begin_ns=drive.begin_ns,
            log_seconds=drive.seconds,
            elapsed_seconds=time.monotonic() - began,
            counts=log.counts | {"estimates": drive.estimates, "poses": len(drive.stamps_ns)},
            warnings=(
                *failed,
                *log.warnings,
                *estimator.warnings,
                *doubts(drive, estimator, options),
                *([] if floor is None else floor.doubts()),
            ),
            failures=tuple(failed),
            lost_share=lost_share(drive, estimator, options),
            share_through=drive.share_through,
            lost_ns=tuple(estimator.lost),
            lost_probabilities=estimator.lost_probabilities,
            p_localized=tuple(drive.localized),
            symmetry=model.symmetries,
            world=_world_use(memory, drive, log, options, estimator, left, failed),
            laser_heights=drive.heights,
            odometry_error=estimator.odometry_error.to_dict(),
        )
        inputs = {
            "logs": described,
            "building": seen_from(out, read.description),
            **{k: seen_from(out, v) for k, v in truths.items()},
        }
        write_summary(folder, result.to_dict() | {"options": options.to_dict(), "inputs": inputs})
        if on_finish is not None:
            on_finish(folder, model, result)
    return result


def open_run(
    logs: Sequence[Path], building: Building, options: RunOptions, *, observes: bool = True
) -> tuple[Log, Estimator]:
    """The log, and the estimator to feed with it, by the options; ``observes`` as this has it.

    Raises BuildingError, SettingsError or LogError.
    """
    check_start(options, building)
    return _opened(logs, options), make_estimator(building, options, observes=observes)


def _opened(logs: Sequence[Path], options: RunOptions) -> Log:
    return open_log(
        logs,
        topics=options.topics,
        mounts=options.mounts,
        clock_offsets=options.clock_offsets,
        start=options.start,
        end=options.end,
    )


def _memory(
    world: str | Path, building: Building, log: Log, options: RunOptions, digest: str
) -> Memory:
    """What a world knows when a log begins, with the odometry reading or scan that comes first."""
    from objstate.run.memory import Memory

    begin_ns: int | None = None
    scans = Counter[str]()
    for record in log:
        if begin_ns is None and isinstance(record, Odometry | Scan):
            begin_ns = record.stamp_ns
        if isinstance(record, Scan):
            scans[record.laser] += 1
            if scans[record.laser] == FIRST_SCANS:
                break
    assert begin_ns is not None  # a log without scans is an error
    return Memory.opened(world, building, options.settings, digest, begin_ns, log.mountings)


def _world_use(
    memory: Memory | None,
    drive: Drive,
    log: Log,
    options: RunOptions,
    estimator: Estimator,
    floor: FloorMemory | None,
    failed: Sequence[str],
) -> WorldUse | None:
    """What a world kept of the drive: nothing where the run failed."""
    if memory is None:
        return None
    if failed:
        return memory.left_alone()
    return memory.keep(drive.end_ns, options.settings, estimator, log.mountings, floor)


def make_estimator(
    building: Building,
    options: RunOptions,
    beliefs: Mapping[str, ObjectBelief] | None = None,
    *,
    history: bool = False,
    observes: bool = True,
) -> Estimator:
    return Estimator(
        building,
        options.settings,
        seed=options.seed,
        initial_pose=options.initial_pose,
        global_start=options.global_start,
        belief=options.belief,
        beliefs=beliefs,
        history=history,
        observes=observes,
    )


def _drive_through(
    log: Log,
    estimator: Estimator,
    folder: Path,
    observers: Sequence[Observer],
    on_progress: Progress | None,
) -> Drive:
    """Feed every record to the estimator, write the estimates, and notify observers."""
    drive = Drive()
    with (
        EstimateWriter(folder) as table,
        PosteriorWriter(folder) as histograms,
        ScanWriter(folder) as scans,
    ):
        recorders = (PosteriorRecorder(histograms), ScanRecorder(scans))
        watching: list[Observer] = [drive, *recorders, *observers]
        for record in log:
            estimates = estimator.feed(record)
            table.write(estimates)
            for observer in watching:
                observer.note(record, estimator, estimates)
            if on_progress is not None and isinstance(record, Scan):
                on_progress(log.share, drive.seconds)
        table.lost = estimator.lost
    return drive


def _check_robot(drive: Drive, log: Log, options: RunOptions) -> None:
    """Raise LogError where the robot's pose was never known."""
    if options.belief == "recorded" and not any(kind in log.counts for kind in RECORDED_BELIEFS):
        beliefs = [fact for fact in _dropped_poses(log) if "initialpose" not in fact.lower()]
        why = "; ".join(beliefs) or "a PoseArray, ParticleCloud or PoseWithCovarianceStamped"
        raise LogError(
            f"The log holds no robot belief that can be used ({why}); localize with --belief own."
        )
    if not drive.stamps_ns:
        raise LogError(unknown_start(log, options))


def _dropped_poses(log: Log) -> list[str]:
    """The log's initial poses and robot beliefs that were dropped, and why."""
    named = "/initialpose", InitialPose.__name__, "Belief"
    return [f for f in log.counts if " dropped: " in f and any(name in f for name in named)]


def unknown_start(log: Log, options: RunOptions) -> str:
    """What to say where no usable initial pose was found in a log, or in the part that was read."""
    where = "the log holds no /initialpose"
    if dropped := _dropped_poses(log):
        where = "; ".join(dropped)
    elif options.topics is not None:
        where = "the topics that are read hold no /initialpose"
    elif options.start is not None:
        where += " after --from"
    return f"The robot's start is unknown: {where}; give --initial-pose X,Y,YAW, or --global."
