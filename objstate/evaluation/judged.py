"""Every estimate beside its truth, as a table from which errors are counted in many ways."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.lost import Stretches, within
from objstate.evaluation.states import (
    Coordinate,
    TrueCourse,
    error,
    inside_interval,
    last_of_each,
)
from objstate.geometry import BoolArray, IntArray

if TYPE_CHECKING:
    import polars as pl

# Of one coordinate in one log, at most this number of estimates, evenly spread, is judged besides
# the final
# ones: neighbours tell next to nothing new, and thousands of logs must fit into memory.
MOST_JUDGED = 500


def judge(
    estimates: pl.DataFrame, courses: Mapping[Coordinate, TrueCourse], lost: Stretches = ()
) -> pl.DataFrame:
    """The estimates whose truth is known.

    Columns ``stamp, object, coordinate, median, std, lower, upper, observed`` as estimated; ``error``
    and ``inside`` relative to the truth; ``period``, the number of the true value; ``final``,
    whether it is the last observed one of its period that wasn't withdrawn; ``since_seen``, seconds
    since a beam last reached the object, null if none did before.
    """
    import polars as pl

    parts = estimates.sort("stamp", maintain_order=True).partition_by(
        "object", "coordinate", as_dict=True
    )
    judged = [
        _judge(part, coordinate, courses[name, coordinate], lost)
        for (name, coordinate), part in sorted(parts.items())
        if (name, coordinate) in courses
    ]
    return pl.concat(judged) if judged else pl.DataFrame()


def _judge(
    part: pl.DataFrame, coordinate: str, course: TrueCourse, lost: Stretches
) -> pl.DataFrame:
    """The rows of one coordinate, in time order."""
    import polars as pl

    stamps, observed = part["stamp"].to_numpy(), part["observed"].to_numpy()
    period = course.period(stamps)
    known = period >= 0
    true = course.values[np.maximum(period, 0)]
    lower, upper = part["lower"].to_numpy(), part["upper"].to_numpy()
    final = known & _final(period, observed & ~within(stamps, lost) & known, course)
    return (
        part.select("stamp", "object", "coordinate", "median", "std", "lower", "upper", "observed")
        .with_columns(
            pl.Series("error", error(coordinate, part["median"].to_numpy(), true)),
            pl.Series("inside", inside_interval(coordinate, true, lower, upper)),
            pl.Series("period", period),
            pl.Series("final", final),
            since_seen=_since_seen(stamps, observed),
        )
        .filter(pl.Series(known & (final | _evenly(known))))
    )


def _final(period: IntArray, stood: BoolArray, course: TrueCourse) -> BoolArray:
    standing = course.standing[np.maximum(period, 0)]
    return last_of_each(period, stood) & standing


def _since_seen(stamps: IntArray, observed: BoolArray) -> pl.Series:
    """(n,) s; 0 where observed, null before the first time."""
    import polars as pl

    index = np.maximum.accumulate(np.where(observed, np.arange(len(stamps)), -1))
    seconds = (stamps - stamps[np.maximum(index, 0)]) / 1e9
    return pl.Series(seconds).set(pl.Series(index < 0), None)


def _evenly(known: BoolArray) -> BoolArray:
    """(n,) at most MOST_JUDGED of the known, evenly spread."""
    places = np.flatnonzero(known)
    step = max(1, -(-len(places) // MOST_JUDGED))
    chosen = np.zeros(len(known), dtype=bool)
    chosen[places[::step]] = True
    return chosen
