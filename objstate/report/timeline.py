"""What the plan shows at each moment, small enough to travel in a page."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.evaluation.states import TrueCourse, true_courses
from objstate.evaluation.summary import ROTATIONS
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.records import Path as RobotPath
from objstate.records import TrueState

if TYPE_CHECKING:
    import polars as pl

STEP = 1.0  # s between two moments of one object; longer where there are too many
MOST_MOMENTS = 20_000  # of all objects together: about 1 MB of a page
MOST_POSES = 3_000  # of the robot's path
TENTHS = 10  # of a second
ROTATION_UNITS = 1800 / np.pi  # tenths of a degree in a radian
LENGTH_UNITS = 1000  # millimetres in a metre


def object_moments(
    estimates: pl.DataFrame, begin_ns: int, name: str, coordinates: tuple[str, ...], step: float
) -> dict[str, Any]:
    """The estimates of one object, one in each ``step`` s: the last one that observed it, or the last.

    Times are tenths of a second, angles tenths of a degree, lengths millimetres.
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
    return {
        "t": _tenths(first["stamp"].to_numpy(), begin_ns),
        "seen": first["observed"].cast(pl.UInt8).to_list(),
        **{
            column: [in_units(c, parts[c][column].to_numpy()) for c in coordinates]
            for column in ("mean", "lower", "upper")
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


def in_units(coordinate: str, values: FloatArray) -> list[int]:
    """Values in the page's units."""
    return _whole(values * (ROTATION_UNITS if coordinate in ROTATIONS else LENGTH_UNITS))


def _course(coordinate: str, course: TrueCourse, begin_ns: int) -> dict[str, list[int]]:
    return {"t": _tenths(course.stamps_ns, begin_ns), "v": in_units(coordinate, course.values)}


def _tenths(stamps_ns: IntArray, begin_ns: int) -> list[int]:
    return _whole((stamps_ns - begin_ns) / 1e9 * TENTHS)


def _whole(values: FloatArray) -> list[int]:
    return [int(value) for value in np.rint(values)]
