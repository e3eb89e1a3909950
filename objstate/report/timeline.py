"""What the plan shows at each moment, small enough to travel in a page."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.evaluation.lost import Stretches
from objstate.evaluation.states import TrueCourse, true_courses
from objstate.evaluation.summary import ROTATIONS
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.recording.tables import P_CLOSED
from objstate.records import Path as RobotPath
from objstate.records import TrueState

if TYPE_CHECKING:
    import polars as pl

STEP = 1.0  # s between two moments of one object; longer where there are too many
MOST_MOMENTS = 20_000  # of all objects together: about 1 MB of a page
MOST_POSES = 3_000  # of the robot's path
MOST_SCANS = 1_500  # of all lasers: 0.7 MB of a page at most
MOST_CLUTTER = 60_000  # cells at all moments, about: 0.6 MB of a page
TENTHS = 10  # of a second
ROTATION_UNITS = 1800 / np.pi  # tenths of a degree in a radian
LENGTH_UNITS = 1000  # millimetres in a metre


def object_moments(
    estimates: pl.DataFrame, begin_ns: int, name: str, coordinates: tuple[str, ...], step: float
) -> dict[str, Any]:
    """The estimates of one object, one in each ``step`` s: the last observed one, or the last.

    Times are tenths of a second, angles tenths of a degree, lengths millimetres. ``closed`` is the
    probability in percent that a door is closed, where there is one.
    """
    import polars as pl

    rows = estimates.filter(pl.col("object") == name).with_columns(
        moment=((pl.col("stamp") - begin_ns) / (step * 1e9)).floor()
    )
    moments = rows.sort("moment", "observed", "stamp", maintain_order=True).unique(
        ["moment", "coordinate"], keep="last", maintain_order=True
    )
    parts = {c: moments.filter(pl.col("coordinate") == c) for c in coordinates}
    first = parts[coordinates[0]]
    closed = first[P_CLOSED].to_list() if P_CLOSED in first.columns else []
    return {
        "t": _tenths(first["stamp"].to_numpy(), begin_ns),
        "seen": first["observed"].cast(pl.UInt8).to_list(),
        **({"closed": _percents(closed)} if any(share is not None for share in closed) else {}),
        **{
            column: [in_units(c, parts[c][column].to_numpy()) for c in coordinates]
            for column in ("median", "lower", "upper")
        },
    }


def step_for(estimates: pl.DataFrame) -> float:
    """Seconds between moments, such that there are at most ``MOST_MOMENTS``."""
    import polars as pl

    step = STEP
    while True:
        moments = estimates.select(
            "object", (pl.col("stamp") / (step * 1e9)).floor().alias("moment")
        ).n_unique()
        if moments <= MOST_MOMENTS:
            return step
        step *= 2.0


def true_values(
    truth: Iterable[TrueState], begin_ns: int
) -> dict[str, dict[str, dict[str, list[int]]]]:
    """The true course of each coordinate, by object and coordinate."""
    found: dict[str, dict[str, dict[str, list[int]]]] = {}
    for (name, coordinate), course in true_courses(truth).items():
        found.setdefault(name, {})[coordinate] = _course(coordinate, course, begin_ns)
    return found


def robot_moments(path: RobotPath, begin_ns: int) -> dict[str, list[int]]:
    """The robot's path, thinned to ``MOST_POSES``; centimetres and degrees."""
    stride = -(-len(path.stamps_ns) // MOST_POSES)
    stamps, poses = path.stamps_ns[::stride], path.poses[::stride]
    return {
        "t": _tenths(stamps, begin_ns),
        "x": _whole(100 * poses[:, 0]),
        "y": _whole(100 * poses[:, 1]),
        "yaw": _whole(np.degrees(wrap(poses[:, 2]))),
    }


def stretches(lost: Stretches, begin_ns: int) -> list[list[int]]:
    """When the robot was lost."""
    return [_tenths(np.array(pair), begin_ns) for pair in lost]


def scan_moments(scans: pl.DataFrame, path: RobotPath, begin_ns: int) -> dict[str, Any]:
    """Scans with the pose at which each was taken, thinned to ``MOST_SCANS``.

    ``ends`` are all ends as base64 of little-endian int16, cm in ``base_link``: x and y in turn;
    ``count`` says how many of them each scan has.
    """
    at = np.searchsorted(path.stamps_ns, scans["stamp"].to_numpy(), side="right") - 1
    known = scans.filter(at >= 0)
    poses = path.poses[at[at >= 0]]
    stride = max(1, -(-len(known) // MOST_SCANS))
    lasers = known["laser"].unique(maintain_order=True).to_list()
    kept = np.sort(
        np.concatenate(
            [np.zeros(0, dtype=np.int64)]
            + [np.flatnonzero(known["laser"].to_numpy() == laser)[::stride] for laser in lasers]
        )
    )
    rows, poses = known[kept], poses[kept]
    ends = np.column_stack([rows[axis].explode().drop_nulls().to_numpy() for axis in "xy"])
    return {
        "t": _tenths(rows["stamp"].to_numpy(), begin_ns),
        "laser": [lasers.index(laser) for laser in rows["laser"]],
        "pose": [_whole(100 * poses[:, 0]), _whole(100 * poses[:, 1]),
                 _whole(ROTATION_UNITS * wrap(poses[:, 2]))],
        "count": rows["x"].list.len().to_list(),
        "ends": base64.b64encode(ends.astype("<i2").tobytes()).decode("ascii"),
        "step": round(TENTHS * STEP * stride),
    }  # fmt: skip


def clutter_moments(clutter: pl.DataFrame, begin_ns: int) -> dict[str, Any]:
    """Obstacles that are not in the building, thinned to about ``MOST_CLUTTER`` cells.

    ``places`` are alternating x and y, cm, for each moment.
    """
    cells = int(clutter["x"].list.len().sum())
    rows = clutter.gather_every(max(1, -(-cells // MOST_CLUTTER)))
    places = [
        [each for pair in zip(x, y, strict=True) for each in pair]
        for x, y in zip(rows["x"], rows["y"], strict=True)
    ]
    return {"t": _tenths(rows["stamp"].to_numpy(), begin_ns), "places": places}


def in_units(coordinate: str, values: FloatArray) -> list[int]:
    """Values in the page's units."""
    return _whole(values * (ROTATION_UNITS if coordinate in ROTATIONS else LENGTH_UNITS))


def _course(coordinate: str, course: TrueCourse, begin_ns: int) -> dict[str, list[int]]:
    return {"t": _tenths(course.stamps_ns, begin_ns), "v": in_units(coordinate, course.values)}


def _percents(shares: Sequence[float | None]) -> list[int | None]:
    """Shares as whole percents; unknown ones are None."""
    return [
        None if share is None or not np.isfinite(share) else round(100 * share) for share in shares
    ]


def _tenths(stamps_ns: IntArray, begin_ns: int) -> list[int]:
    return _whole((stamps_ns - begin_ns) / 1e9 * TENTHS)


def _whole(values: FloatArray) -> list[int]:
    return [int(value) for value in np.rint(values)]
