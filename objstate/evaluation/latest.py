"""The final estimates of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.lost import Stretches, within
from objstate.evaluation.states import Coordinate, TrueCourse, error, true_courses
from objstate.order import natural_key
from objstate.recording.tables import COLUMNS
from objstate.records import Estimate, TrueState

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class LatestState:
    """The last estimate of one coordinate that a scan observed, or the last of all without one."""

    estimate: Estimate
    truth: float | None  # at the estimate's stamp, where known
    error: float | None  # estimate minus truth; rotations wrapped


def latest_states(
    estimates: pl.DataFrame,
    truth: Iterable[TrueState] = (),
    lost: Stretches = (),
    symmetry: Mapping[str, int] | None = None,
) -> list[LatestState]:
    """The latest state of every coordinate of every object, by object's name.

    ``estimates`` has the columns of ``estimates.parquet``; ``truth`` is in time order.
    What was estimated while the robot was ``lost`` was taken back, and doesn't count. Headings of
    objects with some order of ``symmetry`` are compared modulo 360 degrees / order.
    """
    taken_back = within(estimates["stamp"].to_numpy(), lost)
    last = (
        estimates.filter(~taken_back)
        .sort("observed", "stamp", maintain_order=True)
        .unique(["object", "coordinate"], keep="last", maintain_order=True)
    )
    courses = true_courses(truth)
    rows = [Estimate(*row) for row in last.select(COLUMNS).iter_rows()]
    rows.sort(key=lambda row: natural_key(row.object))
    return [_latest(row, courses, (symmetry or {}).get(row.object, 1)) for row in rows]


def _latest(
    estimate: Estimate, courses: Mapping[Coordinate, TrueCourse], symmetry: int
) -> LatestState:
    course = courses.get((estimate.object, estimate.coordinate))
    truth = None if course is None else course.value_at(estimate.stamp_ns)
    if truth is None:
        return LatestState(estimate, None, None)
    off = error(estimate.coordinate, np.array(estimate.value), np.array(truth), symmetry)
    return LatestState(estimate, truth, float(off))
