"""Two results of the same logs against each other, estimate by estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.errors import ResultError
from objstate.evaluation.summary import unit_of
from objstate.geometry import FloatArray

if TYPE_CHECKING:
    import polars as pl

LEVEL = 0.95  # of the intervals of differences
KEY = ("log", "object", "coordinate", "period")  # what makes two estimates a pair


@dataclass(frozen=True)
class Difference:
    """A measure in both results, and by how much the first differs from the second."""

    measure: str
    coordinate: str
    unit: str  # rad, m, or 1 for shares
    pairs: int  # of estimates
    units: int  # logs, or objects where there is one log: what the interval counts as independent
    this: float
    other: float
    difference: float  # this minus other: below zero, errors became smaller
    lower: float  # 95 % interval of the difference, paired t; infinite with one unit
    upper: float


def differences(this: pl.DataFrame, other: pl.DataFrame) -> tuple[Difference, ...]:
    """The differences of the final estimates that both results have, by kind of coordinate.

    Pairs are averaged within each log, and logs are compared by the paired t distribution;
    of one log alone, within each object. Raises ResultError where nothing is in both.
    """
    columns = [*KEY, "error", "inside", "lower", "upper"]
    left, right = (each.filter("final").select(columns) for each in (this, other))
    pairs = left.join(right, on=list(KEY), suffix="_other").sort(KEY)
    if pairs.is_empty():
        raise ResultError("The results have no log, object and state in common to be compared by.")
    by = "log" if pairs["log"].n_unique() > 1 else "object"
    return tuple(
        _difference(measure, coordinate, part, by)
        for (coordinate,), part in sorted(pairs.partition_by("coordinate", as_dict=True).items())
        for measure in MEASURES
    )


def _difference(measure: str, coordinate: str, pairs: pl.DataFrame, by: str) -> Difference:
    _, unit = np.unique(pairs[by].to_numpy(), return_inverse=True)
    counts = np.bincount(unit)
    this, other = (
        np.bincount(unit, weights=MEASURES[measure](pairs, suffix)) / counts
        for suffix in ("", "_other")
    )
    lower, upper = _interval(this - other)
    return Difference(
        measure=measure,
        coordinate=coordinate,
        unit="1" if measure == "in 90 %" else unit_of(coordinate),
        pairs=len(pairs),
        units=len(counts),
        this=float(this.mean()),
        other=float(other.mean()),
        difference=float((this - other).mean()),
        lower=lower,
        upper=upper,
    )


def _interval(values: FloatArray) -> tuple[float, float]:
    """The interval of the mean of values (n,)."""
    from scipy.stats import t

    if len(values) < 2:
        return -np.inf, np.inf
    half = t.ppf((1 + LEVEL) / 2, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return float(values.mean() - half), float(values.mean() + half)


def _absolute_error(pairs: pl.DataFrame, suffix: str) -> FloatArray:
    return np.asarray(np.abs(pairs[f"error{suffix}"].to_numpy()))


def _width(pairs: pl.DataFrame, suffix: str) -> FloatArray:
    width = (pairs[f"upper{suffix}"] - pairs[f"lower{suffix}"]).to_numpy()
    wrapped = width + 2 * np.pi * (width < 0)  # an upper bound that wrapped
    return np.asarray(wrapped)  # an upper bound that wrapped


def _inside(pairs: pl.DataFrame, suffix: str) -> FloatArray:
    return pairs[f"inside{suffix}"].to_numpy().astype(float)


MEASURES: dict[str, Callable[[pl.DataFrame, str], FloatArray]] = {
    "absolute error": _absolute_error,
    "in 90 %": _inside,
    "interval width": _width,
}
