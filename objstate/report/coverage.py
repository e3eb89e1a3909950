"""Do the intervals hold the truth as often as they claim?"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.lost import Stretches, within
from objstate.evaluation.states import compare, observed_posteriors, true_courses
from objstate.evaluation.summary import ROTATIONS
from objstate.geometry import FloatArray
from objstate.records import TrueState

if TYPE_CHECKING:
    import polars as pl

LEVELS = np.linspace(0.05, 0.95, 19)
CENTRAL = 0.9  # what the recorded intervals claim


@dataclass(frozen=True, eq=False)
class Coverage:
    """How often the truth lies in intervals of several levels, over all updates that observed."""

    kind: str  # "angles" or "lengths"
    count: int
    errors: FloatArray  # (n,) estimate minus truth, rad or m
    claimed: FloatArray  # (k,)
    held: FloatArray  # (k,)


def coverages(
    estimates: pl.DataFrame,
    truth: Iterable[TrueState],
    lost: Stretches,
    symmetry: Mapping[str, int] | None = None,
) -> list[Coverage]:
    """One for angles and one for lengths, where there are any.

    The 90 % interval is the recorded one. Others are it, widened or narrowed about the
    median as a Gaussian's would be.
    """
    gathered: dict[str, list[tuple[FloatArray, FloatArray]]] = {"angles": [], "lengths": []}
    courses = true_courses(truth)
    for (name, coordinate), posterior in observed_posteriors(estimates).items():
        if (name, coordinate) not in courses:
            continue
        course = courses[name, coordinate]
        order = (symmetry or {}).get(name, 1)
        errors = compare(coordinate, posterior, course, lost, order).errors
        known = course.period(posterior.stamps_ns) >= 0
        below = (posterior.values - posterior.lowers)[known]
        above = (posterior.uppers - posterior.values)[known]
        needed = _needed(errors, below, above)
        stood = ~within(posterior.stamps_ns[known], lost)
        kind = "angles" if coordinate in ROTATIONS else "lengths"
        gathered[kind].append((errors[stood], needed[stood]))
    return [_coverage(kind, parts) for kind, parts in gathered.items() if parts]


def _needed(errors: FloatArray, below: FloatArray, above: FloatArray) -> FloatArray:
    """(n,) by what factor each 90 % interval would have to be wider to just hold the truth."""
    sides = np.where(errors > 0.0, below, above).clip(min=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(errors == 0.0, 0.0, np.abs(errors) / sides)


def _coverage(kind: str, parts: list[tuple[FloatArray, FloatArray]]) -> Coverage:
    from scipy.special import ndtri

    errors = np.concatenate([errors for errors, _ in parts])
    needed = np.concatenate([needed for _, needed in parts])
    width = ndtri((1.0 + LEVELS) / 2.0) / ndtri((1.0 + CENTRAL) / 2.0)
    held = (needed[:, None] <= width).mean(axis=0) if len(needed) else np.zeros(len(LEVELS))
    return Coverage(kind, len(errors), errors, LEVELS, held)


def pooled(parts: Iterable[Coverage]) -> list[Coverage]:
    """Coverages of many results as one for each kind."""
    kinds: dict[str, list[Coverage]] = {}
    for part in parts:
        kinds.setdefault(part.kind, []).append(part)
    return [_pool(kind, [each for each in own if each.count]) for kind, own in kinds.items()]


def _pool(kind: str, parts: list[Coverage]) -> Coverage:
    counts = np.array([part.count for part in parts])
    if not len(counts):
        return Coverage(kind, 0, np.zeros(0), LEVELS, np.zeros(len(LEVELS)))
    held = np.average([part.held for part in parts], axis=0, weights=counts)
    return Coverage(
        kind, int(counts.sum()), np.concatenate([part.errors for part in parts]), LEVELS, held
    )
