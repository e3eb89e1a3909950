"""Ends of drives' beams as a picture over the plan, to check hinges by."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from objstate.building.model import Building
from objstate.editing.doubts import of_another_building, off_walls
from objstate.errors import LogError
from objstate.geometry import FloatArray, compose, interpolate_pose
from objstate.recording.results import is_result
from objstate.recording.scans import read_scans
from objstate.recording.summary import read_summary
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import Scan
from objstate.run import RunOptions, open_run, unknown_start
from objstate.run.doubts import failures
from objstate.run.drive import Drive
from objstate.run.scans import ends_of

CELL = 0.02  # m, of the picture
MOST_CELLS = 24_000_000  # of a picture; a larger plan has larger cells
STEP_NS = 100_000_000  # between the scans of a log that are drawn
WELL_KNOWN = 0.15  # m: largest deviation of a pose that places points
COMMON = 0.98  # quantile of counts, from which on cells are as dark as can be
FAINTEST = 0.15  # opacity of a cell with one point
COLOUR = (194, 24, 122)  # as the report draws scans

Progress = Callable[[float, float], None]  # share of a log done, seconds of it done
Tell = Callable[[str], None]  # receives warnings
Doubt = Callable[[str | None], None]  # receives a warning of one drive, if there is one


@dataclass(frozen=True)
class Picture:
    """A picture of points over the plan."""

    url: str  # data:image/png
    x: float  # m, its left edge
    y: float  # m, its lower edge
    width: float  # m
    height: float  # m
    points: int


def points_of(
    drives: Sequence[Path],
    building: Building,
    run: RunOptions | None = None,
    on_progress: Progress | None = None,
    tell: Tell = lambda _: None,
) -> FloatArray:
    """(n, 2) m, where beams of results of ``estimate``, or of logs, ended in the building.

    A log is localized in the building's walls, as ``run`` says. ``tell`` receives warnings, as of
    drives of other buildings. Raises LogError where the robot's start is unknown, or where it was
    nowhere found, and ResultError.
    """
    run = run or RunOptions()
    parts = [np.zeros((0, 2))]
    for drive in drives:
        doubt = partial(_tell_of, drive, tell)
        points = np.concatenate(
            [
                np.zeros((0, 2)),
                *(
                    _of_result(drive, building, doubt)
                    if is_result(drive)
                    else _of_log(drive, building, run, on_progress, doubt)
                ),
            ]
        )
        doubt(off_walls(points, building))
        parts.append(points)
    return np.concatenate(parts)


def _tell_of(drive: Path, tell: Tell, doubt: str | None) -> None:
    if doubt is not None:
        tell(f"{drive}: {doubt}")


def _of_result(folder: Path, building: Building, doubt: Doubt) -> Iterator[FloatArray]:
    summary = read_summary(folder)
    for failure in summary.get("failures", ()):
        doubt(failure)
    doubt(of_another_building(folder, summary, building))
    path, scans = read_tum(folder / TRAJECTORY), read_scans(folder)
    for stamp, x, y in zip(scans["stamp"], scans["x"], scans["y"], strict=True):
        after = int(np.searchsorted(path.stamps_ns, stamp))
        if not 0 < after < len(path.stamps_ns):
            continue
        begin, end = path.stamps_ns[after - 1], path.stamps_ns[after]
        share = float((stamp - begin) / max(end - begin, 1))
        pose = interpolate_pose(path.poses[after - 1], path.poses[after], share)
        yield _placed(pose, np.column_stack([x.to_numpy(), y.to_numpy()]) / 100.0)


def _of_log(
    log: Path, building: Building, run: RunOptions, on_progress: Progress | None, doubt: Doubt
) -> Iterator[FloatArray]:
    records, estimator = open_run([log], replace(building, objects={}), run)
    drive = Drive()
    last: dict[str, int] = {}
    began_ns: int | None = None
    for record in records:
        drive.note(record, estimator, estimator.feed(record))
        robot = estimator.robot
        if not isinstance(record, Scan) or robot is None or robot.position_std > WELL_KNOWN:
            continue
        if record.stamp_ns - last.get(record.laser, -STEP_NS) < STEP_NS:
            continue
        last[record.laser] = record.stamp_ns
        began_ns = record.stamp_ns if began_ns is None else began_ns
        if on_progress is not None:
            on_progress(records.share, (record.stamp_ns - began_ns) / 1e9)
        yield _placed(robot.mean, ends_of(record))
    if estimator.robot is None:
        raise LogError(f"{log}: {unknown_start(records, run)}")
    if began_ns is None:
        raise LogError(
            f"The robot was localized nowhere in {log}; see with `objstate estimate` what is wrong."
        )
    for failure in failures(drive, estimator, run):
        doubt(failure)


def _placed(pose: FloatArray, ends: FloatArray) -> FloatArray:
    return compose(pose, np.column_stack([ends, np.zeros(len(ends))]))[:, :2]


def picture(points: FloatArray, low: FloatArray, high: FloatArray) -> Picture | None:
    """The points between two corners (2,) m, darker where there are many; None without any."""
    from PIL import Image

    points = points[((points >= low) & (points < high)).all(axis=1)]
    if not len(points):
        return None
    cell = max(CELL, float(np.sqrt(np.prod(high - low) / MOST_CELLS)))
    columns, rows = np.ceil((high - low) / cell).astype(int)
    places = np.floor((points - low) / cell).astype(int)
    counts = np.bincount(places[:, 1] * columns + places[:, 0], minlength=rows * columns)
    counts = counts.reshape(rows, columns)[::-1]
    most = max(float(np.quantile(counts[counts > 0], COMMON)), 2.0)
    share = np.minimum(np.log1p(counts) / np.log1p(most), 1.0)
    alpha = np.where(counts > 0, FAINTEST + (1 - FAINTEST) * share, 0.0)
    levels = np.rint(15 * alpha).astype(np.uint8)  # few levels, so that the picture stays small
    image = Image.fromarray(levels, mode="P")
    image.putpalette([*COLOUR] * 16)
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True, transparency=bytes(17 * k for k in range(16)))
    url = "data:image/png;base64," + base64.b64encode(file.getvalue()).decode("ascii")
    return Picture(
        url=url,
        x=float(low[0]),
        y=float(low[1]),
        width=float(cell * columns),
        height=float(cell * rows),
        points=len(points),
    )
