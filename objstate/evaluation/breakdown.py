"""Errors by the conditions under which they came about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.evaluation.summary import StateErrors, summarize_states, unit_of
from objstate.geometry import FloatArray
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


@dataclass(frozen=True)
class Group:
    """The errors of the updates that share a condition."""

    condition: str
    label: str
    coordinate: str
    unit: str  # rad or m
    errors: StateErrors


def groups(judged: pl.DataFrame) -> tuple[Group, ...]:
    """The errors by each condition, in the order of its stretches; empty ones are left out."""
    return tuple(group for each in (*_by_name(judged), *_by_bin(judged)) for group in each)


def _by_name(judged: pl.DataFrame) -> Iterator[Sequence[Group]]:
    import polars as pl

    for column in NAMED:
        if column in judged.columns:
            seen = judged.filter(pl.col("observed") & pl.col(column).is_not_null())
            parts = seen.partition_by(column, "coordinate", as_dict=True)
            yield [_group(column, key, part) for key, part in _ordered(parts)]


def _ordered(parts: Mapping[Any, pl.DataFrame]) -> list[tuple[Any, pl.DataFrame]]:
    """Parts by the names in their keys."""
    return sorted(parts.items(), key=lambda part: [natural_key(str(name)) for name in part[0]])


def _by_bin(judged: pl.DataFrame) -> Iterator[Sequence[Group]]:
    import polars as pl

    for bins in BINS:
        if bins.column not in judged.columns:
            continue
        chosen = judged.filter(pl.col(bins.column).is_not_null())
        seen = chosen.filter("observed") if bins.observed else chosen
        values = seen[bins.column].to_numpy()
        place = np.searchsorted(np.array(bins.edges), values, side="right") - 1
        parts = seen.with_columns(pl.Series("bin", place)).partition_by(
            "bin", "coordinate", as_dict=True
        )
        labels = bins.labels()
        yield [
            _group(bins.title, (labels[number], coordinate), part)
            for (number, coordinate), part in sorted(parts.items())
        ]


def _group(condition: str, key: tuple[str, ...], part: pl.DataFrame) -> Group:
    label, coordinate = key
    errors: FloatArray = part["error"].to_numpy()
    summary = summarize_states(coordinate, errors, part["inside"].to_numpy())
    assert summary is not None  # a group has rows
    return Group(condition, label, coordinate, unit_of(coordinate), summary)
