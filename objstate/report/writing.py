"""Writing a report beside the result, or the batch, that it shows."""

from __future__ import annotations

from datetime import UTC, tzinfo
from pathlib import Path

from objstate.errors import ResultError
from objstate.outputs import write_text
from objstate.recording.batches import REPORT, is_batch, read_logs, result_of
from objstate.recording.index import open_index, read_outcomes
from objstate.report.batch_material import BatchMaterial, read_batch
from objstate.report.batch_page import batch_page
from objstate.report.habits import DoneDoor, done_door
from objstate.report.material import read_material
from objstate.report.news import note_news
from objstate.report.page import report_page
from objstate.statistics.doors import statistics_of_all
from objstate.statistics.looks import OpenAbove, door_looks


def write_report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    building: str | Path | None = None,
    truth: str | Path | None = None,
    true_path: str | Path | None = None,
    zone: tzinfo = UTC,
    robot_radius: float | None = None,
    filtered: bool = False,
) -> Path:
    """Write the report of a result folder to ``out``, or into the folder, and return its path.

    An older report there is replaced. The building and the truth are those that the result names,
    unless given here. Dates are shown in the time zone ``zone``. With its radius (m) the robot is
    drawn at its size. States are the smoothed ones, or with ``filtered`` those that could be known
    at the time. Raises ResultError, BuildingError and TruthError.
    """
    target = Path(folder) / REPORT if out is None else Path(out)
    material = read_material(folder, building, truth, true_path, filtered=filtered)
    write_text(target, report_page(material, zone, robot_radius))
    return target


def write_batch_report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    building: str | Path | None = None,
    each: bool = False,
    zone: tzinfo = UTC,
    robot_radius: float | None = None,
    filtered: bool = False,
) -> Path:
    """Write the report of a batch to ``out``, or into the folder, and return its path.

    Dates, hours and weekdays are shown in the time zone ``zone``. With ``each``, the report of
    every log that is done is written into its result first. ``filtered`` is as in ``write_report``.
    Logs that have a report are linked. Raises ResultError and BuildingError.
    """
    if not is_batch(folder):
        raise ResultError(f"{folder} is no batch; make one with `objstate batch`.")
    target = Path(folder) / REPORT if out is None else Path(out)
    if each:
        _write_each(Path(folder), building, zone, robot_radius, filtered)
    material = read_batch(folder, building, filtered=filtered)
    with open_index(folder) as index:
        news = note_news(index, material)
    doors = _doors(material, zone, filtered)
    write_text(target, batch_page(material, doors, news, target, REPORT, zone))
    return target


def _write_each(
    folder: Path,
    building: str | Path | None,
    zone: tzinfo,
    robot_radius: float | None,
    filtered: bool,
) -> None:
    logs = read_logs(folder)
    outcomes = read_outcomes(folder, logs)
    for log in logs:
        if outcomes[log.name].status == "done":
            result = result_of(folder, log.name)
            write_report(
                result,
                building=building or log.building,
                truth=log.truth,
                true_path=log.path,
                zone=zone,
                robot_radius=robot_radius,
                filtered=filtered,
            )


def _doors(material: BatchMaterial, zone: tzinfo, filtered: bool) -> list[DoneDoor]:
    """The doors that some look decided on, by name."""
    if not material.lines:
        return []
    found = door_looks(material.folder, OpenAbove(), filtered=filtered)
    decided = [each for each in found if len(each.looks)]
    known = statistics_of_all(decided, zone)
    return [done_door(each, own, zone) for each, own in zip(decided, known, strict=True)]
