"""Errors by the conditions under which they came about."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.evaluation.summary import StateErrors, unit_of
from objstate.evaluation.sums import Key, Totals
from objstate.order import natural_key

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class Bins:
    """Where a condition is cut into stretches, and how these are called."""

    column: str
    title: str
    edges: tuple[float, ...]  # ascending; a stretch begins with its edge, the last has no end
    factor: float = 1.0  # from SI to the unit of the labels
    observed: bool = True  # only updates that observed the object count

    def labels(self) -> list[str]:
        ends = [f"{self.factor * edge:g}" for edge in self.edges]
        return [
            *(f"{low} to {high}" for low, high in pairwise(ends)),
            f"from {ends[-1]}",
        ]


BINS = (
    Bins("distance", "distance (m)", (0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)),
    Bins("incidence", "incidence (deg)", tuple(np.radians([0, 30, 60, 75, 85])), 180 / np.pi),
    Bins("beams", "beams", (0, 1, 3, 6, 12, 25, 50)),
    Bins("since_seen", "last seen before (s)", (0.0, 0.05, 1.0, 10.0, 60.0, 600.0), observed=False),
)
NAMED = ("object", "class")  # conditions that are names
ALL = ""  # under which all updates that observed an object stand


@dataclass(frozen=True)
class Group:
    """The errors of the updates that share a condition."""

    condition: str
    label: str
    coordinate: str
    unit: str  # rad or m
    errors: StateErrors


def parts_of(judged: pl.DataFrame) -> dict[Key, pl.DataFrame]:
    """The updates that share a condition; under ALL, those that observed the object."""
    if judged.is_empty():
        return {}
    whole = judged.filter("observed").partition_by("coordinate", as_dict=True)
    every = {(ALL, "", coordinate): part for (coordinate,), part in sorted(whole.items())}
    return every | dict(_by_name(judged)) | dict(_by_bin(judged))


def groups(totals: Totals) -> tuple[Group, ...]:
    """The errors by each condition, in the order of its stretches; empty ones are left out."""
    found = [(key, errors) for key, errors in totals.errors() if key[0] != ALL]
    return tuple(
        Group(*key, unit_of(key[2]), errors)
        for key, errors in sorted(found, key=lambda each: _place(each[0]))
    )


def _place(key: Key) -> tuple[object, ...]:
    condition, label, coordinate = key
    if condition in NAMED:
        return (NAMED.index(condition), natural_key(label), natural_key(coordinate))
    number, bins = next((n, each) for n, each in enumerate(BINS) if each.title == condition)
    return (len(NAMED) + number, bins.labels().index(label), coordinate)


def _by_name(judged: pl.DataFrame) -> Iterator[tuple[Key, pl.DataFrame]]:
    import polars as pl

    for column in NAMED:
        if column in judged.columns:
            seen = judged.filter(pl.col("observed") & pl.col(column).is_not_null())
            for (label, coordinate), part in _parted(seen, column):
                yield (column, str(label), str(coordinate)), part


def _by_bin(judged: pl.DataFrame) -> Iterator[tuple[Key, pl.DataFrame]]:
    import polars as pl

    for bins in BINS:
        if bins.column not in judged.columns:
            continue
        chosen = judged.filter(pl.col(bins.column).is_not_null())
        seen = chosen.filter("observed") if bins.observed else chosen
        values = seen[bins.column].to_numpy()
        place = np.searchsorted(np.array(bins.edges), values, side="right") - 1
        labels = bins.labels()
        for (number, coordinate), part in _parted(
            seen.with_columns(pl.Series("bin", place)), "bin"
        ):
            yield (bins.title, labels[number], str(coordinate)), part


def _parted(frame: pl.DataFrame, column: str) -> list[tuple[tuple[Any, ...], pl.DataFrame]]:
    """Parts by a column and the coordinate."""
    return sorted(frame.partition_by(column, "coordinate", as_dict=True).items())
