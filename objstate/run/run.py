"""From a recorded log to a result folder, in one pass."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from objstate.building import load_building
from objstate.building.model import Building
from objstate.errors import LogError
from objstate.estimator import Estimator
from objstate.logs import Log, open_log
from objstate.recording.results import result_folder
from objstate.recording.summary import SUMMARY, write_summary
from objstate.recording.tables import ESTIMATES, EstimateWriter
from objstate.recording.tum import TRAJECTORY, write_tum
from objstate.records import GaussianRobotBelief, RobotBelief, Scan
from objstate.run.doubts import doubts
from objstate.run.drive import Drive
from objstate.run.inputs import describe_building, describe_log
from objstate.run.options import RunOptions
from objstate.run.start import check_start

FILES = (ESTIMATES, TRAJECTORY, SUMMARY)  # what a result folder holds

RECORDED_BELIEFS = (RobotBelief.__name__, GaussianRobotBelief.__name__)

Progress = Callable[[float, float], None]  # share of the log done from 0 to 1, seconds of it done

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunResult:
    """What a run came to; the estimates themselves are in ``folder``."""

    folder: Path
    objects: tuple[str, ...]  # all that the building has
    begin_ns: int  # stamp of the first record
    log_seconds: float
    elapsed_seconds: float
    counts: Mapping[str, int]
    warnings: tuple[str, ...]
    lost_ns: tuple[tuple[int, int], ...] = ()  # stretches in which the robot was lost
    # orders of those objects that look the same after a turn by 360 degrees / order
    symmetry: Mapping[str, int] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """What ``run.json`` says of the outcome."""
        return {
            "version": version("objstate"),
            "objects": list(self.objects),
            "begin_ns": self.begin_ns,
            "timings": {
                "log_seconds": self.log_seconds,
                "elapsed_seconds": self.elapsed_seconds,
            },
            "counts": dict(self.counts),
            "warnings": list(self.warnings),
            "lost_ns": [list(stretch) for stretch in self.lost_ns],
            "symmetry": dict(self.symmetry),
        }


def estimate_log(
    logs: Sequence[str | Path],
    building: str | Path,
    out: str | Path,
    options: RunOptions | None = None,
    *,
    overwrite: bool = False,
    on_progress: Progress | None = None,
) -> RunResult:
    """Estimate every object's state from one drive, recorded in one or several logs.

    Writes ``estimates.parquet``, ``trajectory.tum`` and ``run.json`` into the new
    folder ``out``, whole or not at all. Raises ResultError, BuildingError,
    SettingsError or LogError.
    """
    began = time.monotonic()
    options = options or RunOptions()
    log_paths, urdf = [Path(log) for log in logs], Path(building)
    with result_folder(out, overwrite=overwrite) as folder:
        model = load_building(urdf)
        logger.info("%s: %d movable objects", urdf, len(model.objects))
        check_start(options, model)
        estimator = _estimator(model, options)
        log = open_log(
            log_paths,
            topics=options.topics,
            mounts=options.mounts,
            start=options.start,
            end=options.end,
        )
        drive = _drive_through(log, estimator, folder, on_progress)
        logger.info("%d scans gave %d estimates", drive.scans, drive.estimates)
        _check_robot(drive, log, options)
        write_tum(folder / TRAJECTORY, drive.path)
        result = RunResult(
            folder=Path(out),
            objects=tuple(model.objects),
            begin_ns=drive.begin_ns,
            log_seconds=drive.seconds,
            elapsed_seconds=time.monotonic() - began,
            counts=log.counts | {"estimates": drive.estimates, "poses": len(drive.poses)},
            warnings=(*log.warnings, *estimator.warnings, *doubts(drive, estimator, options)),
            lost_ns=tuple(estimator.lost),
            symmetry=model.symmetries,
        )
        inputs = {
            "logs": [file for path in log_paths for file in describe_log(path)],
            "building": describe_building(urdf, model),
        }
        write_summary(folder, result.to_dict() | {"options": options.to_dict(), "inputs": inputs})
    return result


def _estimator(building: Building, options: RunOptions) -> Estimator:
    return Estimator(
        building,
        options.settings,
        seed=options.seed,
        initial_pose=options.initial_pose,
        global_start=options.global_start,
        belief=options.belief,
    )


def _drive_through(
    log: Log, estimator: Estimator, folder: Path, on_progress: Progress | None
) -> Drive:
    """Feed every record to the estimator; write what it makes of them."""
    drive = Drive()
    with EstimateWriter(folder) as writer:
        for record in log:
            estimates = estimator.feed(record)
            writer.write(estimates)
            drive.note(record, estimator.robot, estimates)
            if on_progress is not None and isinstance(record, Scan):
                on_progress(log.share, drive.seconds)
    return drive


def _check_robot(drive: Drive, log: Log, options: RunOptions) -> None:
    """Raise LogError where nothing told where the robot is."""
    if options.belief == "recorded" and not any(kind in log.counts for kind in RECORDED_BELIEFS):
        raise LogError(
            "The log holds no robot belief (a PoseArray, ParticleCloud or "
            "PoseWithCovarianceStamped); localize with --belief own."
        )
    if not drive.poses:
        raise LogError(
            f"Nothing says where the robot starts: {_where_no_start_is(options)}; "
            "give --initial-pose X,Y,YAW, or --global."
        )


def _where_no_start_is(options: RunOptions) -> str:
    """In what was read of the log there is no initial pose; what was not read may hold one."""
    if options.topics is not None:
        return "the topics that are read hold no /initialpose"
    if options.start is not None:
        return "the log holds no /initialpose from the asked start on"
    return "the log holds no /initialpose"
