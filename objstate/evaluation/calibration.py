"""Calibration of estimates: how often intervals hold the truth, and errors by stated width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.summary import unit_of
from objstate.geometry import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    import polars as pl

LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
WIDTHS = 10  # groups of equally many estimates, by their standard deviation
RESAMPLED = 1000  # times that the logs are drawn anew
SMALLEST = 1e-12  # of a standard deviation, so that a belief in one point can be divided by
SEED = 0  # of that drawing


@dataclass(frozen=True)
class Level:
    """How often the truth lay in the central interval of a level."""

    level: float
    share: float
    lower: float  # 90 % interval of the share, by drawing whole logs anew
    upper: float


@dataclass(frozen=True)
class Width:
    """Estimates that claim about the same standard deviation, and the errors they have."""

    count: int
    std: float  # root mean square of what they claim
    rms: float  # of their errors; equal to std if they are right


@dataclass(frozen=True)
class Calibration:
    """One kind of coordinate, over the last estimates of each state.

    Intervals of other levels than the recorded 90 % are those of a normal distribution with
    the recorded median and standard deviation; ``recorded`` is the share of truths inside the
    recorded intervals.
    """

    coordinate: str
    unit: str  # rad or m
    count: int
    recorded: Level
    levels: tuple[Level, ...]
    widths: tuple[Width, ...]


def calibrations(judged: pl.DataFrame) -> tuple[Calibration, ...]:
    """One for each kind of coordinate that has final estimates; ``judged`` has a column ``log``."""
    finals = judged.filter("final").partition_by("coordinate", as_dict=True)
    return tuple(_calibration(coordinate, part) for (coordinate,), part in sorted(finals.items()))


def _calibration(coordinate: str, part: pl.DataFrame) -> Calibration:
    from scipy.stats import norm

    errors, stds = part["error"].to_numpy(), part["std"].to_numpy()
    _, logs = np.unique(part["log"].to_numpy(), return_inverse=True)
    off = np.abs(errors) / np.maximum(stds, SMALLEST)
    inside = [part["inside"].to_numpy(), *(off <= norm.ppf((1 + level) / 2) for level in LEVELS)]
    recorded, *levels = _levels((0.9, *LEVELS), inside, logs)
    return Calibration(
        coordinate=coordinate,
        unit=unit_of(coordinate),
        count=len(errors),
        recorded=recorded,
        levels=tuple(levels),
        widths=_widths(errors, stds),
    )


def _levels(levels: Sequence[float], inside: Sequence[BoolArray], logs: IntArray) -> list[Level]:
    """The share inside of each level, and its interval.

    Logs are drawn anew, as what one log holds errs together; the same ones for all levels.
    """
    counts = np.bincount(logs)
    held = np.array([np.bincount(logs, weights=each) for each in inside])
    rng = np.random.default_rng(SEED)
    shares = np.empty((RESAMPLED, len(levels)))
    for row in shares:  # one by one: thousands of drawings of all logs don't fit into memory
        drawn = np.bincount(rng.integers(len(counts), size=len(counts)), minlength=len(counts))
        row[:] = held @ drawn / (counts @ drawn)
    bounds = np.quantile(shares, [0.05, 0.95], axis=0).T
    return [
        Level(level, float(each.mean()), float(lower), float(upper))
        for level, each, (lower, upper) in zip(levels, inside, bounds, strict=True)
    ]


def _widths(errors: FloatArray, stds: FloatArray) -> tuple[Width, ...]:
    order = np.argsort(stds, kind="stable")
    parts = np.array_split(order, min(WIDTHS, len(order)))
    return tuple(Width(len(part), _rms(stds[part]), _rms(errors[part])) for part in parts)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
