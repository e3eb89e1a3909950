"""Estimates of one coordinate beside its true values."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.lost import Stretches, within
from objstate.evaluation.summary import ROTATIONS
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.records import TrueState

if TYPE_CHECKING:
    import polars as pl

Coordinate = tuple[str, str]  # the names of an object and of one coordinate of its state

# A true state that lasts at least so long is one in which the object stands; shorter ones
# are the steps of a swing, whose end is not a final state.
STANDING_NS = 1_000_000_000


@dataclass(frozen=True, eq=False)
class Posteriors:
    """What was estimated of one coordinate of one object, at the updates that observed it."""

    stamps_ns: IntArray  # (n,) ascending
    values: FloatArray  # (n,) medians
    lowers: FloatArray  # (n,) central 90 %
    uppers: FloatArray  # (n,)


@dataclass(frozen=True, eq=False)
class TrueCourse:
    """The true value of one coordinate of one object over time: a step function."""

    stamps_ns: IntArray  # (k,) ascending: when each value begins
    values: FloatArray  # (k,)

    @staticmethod
    def of(rows: Sequence[TrueState]) -> TrueCourse:
        """The course of one coordinate's rows, in time order; repeated values are merged."""
        stamps = np.array([row.stamp_ns for row in rows], dtype=np.int64)
        values = np.array([row.value for row in rows])
        changes = np.concatenate([[True], values[1:] != values[:-1]])
        return TrueCourse(stamps[changes], values[changes])

    def value_at(self, stamp_ns: int) -> float | None:
        """The value that holds at a stamp; None before the first."""
        period = int(np.searchsorted(self.stamps_ns, stamp_ns, side="right")) - 1
        return None if period < 0 else float(self.values[period])

    def period(self, stamps_ns: IntArray) -> IntArray:
        """(n,) index of the value that holds at each stamp; -1 before the first."""
        return np.searchsorted(self.stamps_ns, stamps_ns, side="right") - 1

    @property
    def standing(self) -> BoolArray:
        """(k,) the values that last long enough to be a state in which the object stands."""
        return np.append(np.diff(self.stamps_ns) >= STANDING_NS, True)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Errors of the updates of one coordinate whose true value is known."""

    stamps_ns: IntArray  # (n,) of the updates, ascending
    errors: FloatArray  # (n,) estimate minus truth; rotations wrapped
    inside: BoolArray  # (n,) the truth lies inside the 90 % interval
    final: BoolArray  # (n,) the last update before the state changes or the log ends that stood


def observed_posteriors(estimates: pl.DataFrame) -> dict[Coordinate, Posteriors]:
    """The rows of ``estimates.parquet`` that observed something, by coordinate."""
    observed = estimates.filter("observed").sort("stamp", maintain_order=True)
    parts = observed.partition_by("object", "coordinate", as_dict=True)
    return {
        (name, coordinate): Posteriors(
            *(part[column].to_numpy() for column in ("stamp", "median", "lower", "upper"))
        )
        for (name, coordinate), part in parts.items()
    }


def true_courses(truth: Iterable[TrueState]) -> dict[Coordinate, TrueCourse]:
    """The course of each coordinate in true states, which are in time order."""
    rows: dict[Coordinate, list[TrueState]] = defaultdict(list)
    for row in truth:
        rows[row.object, row.coordinate].append(row)
    return {key: TrueCourse.of(group) for key, group in rows.items()}


def compare_all(
    estimates: pl.DataFrame,
    courses: Mapping[Coordinate, TrueCourse],
    lost: Stretches = (),
    symmetry: Mapping[str, int] | None = None,
) -> dict[Coordinate, Comparison]:
    """``compare`` for every coordinate that was observed and whose truth is known."""
    return {
        key: compare(key[1], posteriors, courses[key], lost, (symmetry or {}).get(key[0], 1))
        for key, posteriors in observed_posteriors(estimates).items()
        if key in courses
    }


def compare(
    coordinate: str,
    posteriors: Posteriors,
    truth: TrueCourse,
    lost: Stretches = (),
    symmetry: int = 1,
) -> Comparison:
    """Estimates beside the truth; those before the first true value are left out.

    Those made while the robot was ``lost`` were taken back, so that none of them is final.
    Of an object of some order of ``symmetry``, equal headings count as one.
    """
    period = truth.period(posteriors.stamps_ns)
    known = period >= 0
    period = period[known]
    stood = ~within(posteriors.stamps_ns[known], lost)
    true = truth.values[period]
    return Comparison(
        stamps_ns=posteriors.stamps_ns[known],
        errors=error(coordinate, posteriors.values[known], true, symmetry),
        inside=inside_interval(
            coordinate, true, posteriors.lowers[known], posteriors.uppers[known], symmetry
        ),
        final=last_of_each(period, stood) & truth.standing[period],
    )


def error(
    coordinate: str, estimate: FloatArray, truth: FloatArray, symmetry: int = 1
) -> FloatArray:
    """Estimate minus truth; rotations wrapped, to the nearest of ``symmetry`` equal ones."""
    off = estimate - truth
    return wrap(symmetry * off) / symmetry if coordinate in ROTATIONS else off


def inside_interval(
    coordinate: str,
    values: FloatArray,
    lowers: FloatArray,
    uppers: FloatArray,
    symmetry: int = 1,
) -> BoolArray:
    """(n,) whether each value lies in its interval; on the circle in any turn of it."""
    if coordinate not in ROTATIONS:
        return (lowers <= values) & (values <= uppers)
    uppers = np.where(uppers < lowers, uppers + 2 * np.pi, uppers)  # an upper bound that wrapped
    turns = 2 * np.pi / symmetry * np.arange(-symmetry, symmetry + 1)
    turned = values + turns[:, None]
    return np.asarray(((lowers <= turned) & (turned <= uppers)).any(axis=0))


def last_of_each(period: IntArray, chosen: BoolArray) -> BoolArray:
    """(n,) the last chosen entry of each run of equal numbers in an ascending sequence."""
    numbers = period[chosen]
    last = np.zeros(len(period), dtype=bool)
    last[chosen] = np.append(numbers[1:] != numbers[:-1], True)[: len(numbers)]
    return last
