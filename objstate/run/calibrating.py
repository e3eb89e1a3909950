"""Lasers calibrated, and walls surveyed, by a recorded log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from objstate.building import load_building
from objstate.building.model import Building
from objstate.building.warping import Columns
from objstate.calibration import Calibration, CalibrationOptions, Survey, Surveyor
from objstate.calibration.calibration import calibration_of
from objstate.calibration.gathering import gather
from objstate.calibration.walls import WallReader
from objstate.geometry import FloatArray
from objstate.records import Scan
from objstate.run.options import RunOptions
from objstate.run.run import open_run

Progress = Callable[[float, float], None]  # share of the log done from 0 to 1, seconds of it done


def calibrate_log(
    logs: Sequence[str | Path],
    building: str | Path,
    run: RunOptions | None = None,
    options: CalibrationOptions | None = None,
    on_progress: Progress | None = None,
) -> Calibration:
    """Each laser's mounting and clock from one drive, recorded in one or several logs.

    ``run`` says what is read and where the robot starts. Raises BuildingError,
    SettingsError or LogError.
    """
    run = run or RunOptions()
    model = load_building(Path(building))
    log, estimator = open_run([Path(each) for each in logs], model, run)
    began_ns: int | None = None

    def tell(scan: Scan) -> None:
        nonlocal began_ns
        began_ns = scan.stamp_ns if began_ns is None else began_ns
        if on_progress is not None:
            on_progress(log.share, (scan.stamp_ns - began_ns) / 1e9)

    options = options or CalibrationOptions()
    gathered = gather(log, estimator, options, tell)
    reader = WallReader.of(estimator, options)
    found = calibration_of(gathered, reader, log.mountings, run.clock_offsets, options)
    return replace(found, warnings=(*log.warnings, *estimator.warnings, *found.warnings))


def survey_log(
    log: Path, building: Building, run: RunOptions
) -> tuple[Survey, dict[str, FloatArray]]:
    """What one drive tells of walls and lasers, and its lasers' mountings (4, 4) by frame.

    Raises SettingsError or LogError.
    """
    records, estimator = open_run([log], building, run, observes=False)
    gathered = gather(records, estimator, CalibrationOptions())
    survey = Surveyor.of(estimator, Columns.of(building.walls)).survey(gathered)
    return survey, {frame: records.mountings[frame] for frame in survey.lasers}
